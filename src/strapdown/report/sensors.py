"""The catalogue as tables, and sensors compared: Allan deviations, drift in an outage, a page."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
import pandas as pd

from strapdown.bundle import InputFiles, sensor_file, write_json
from strapdown.config.outage import OutageSpec, SensorsSpec
from strapdown.config.spec import specify
from strapdown.constants import STANDARD_GRAVITY
from strapdown.errors import ConfigError, Finding
from strapdown.formats import csv
from strapdown.progress import Progress, silent
from strapdown.report import document
from strapdown.report.chart import Chart, Line, Panel, look
from strapdown.report.report_bundle import ReportBundle, finite, with_page
from strapdown.report.values import length_words, three_digits
from strapdown.sensors.catalogue import ALLAN_OF_GAUSS_MARKOV, SENSORS, Sensor, load_sensor
from strapdown.sensors.noise_terms import allan_model
from strapdown.sensors.triad_errors import TriadErrors
from strapdown.sensors.uncertainty import uncertainty_of
from strapdown.systems.inputs import Memory, SavedRun
from strapdown.systems.one_thread import one_thread
from strapdown.systems.outage_run import forecast_of_sensor, sensor_of

if TYPE_CHECKING:
    from strapdown.report.chart_svg import ChartFigure

DEG, G = math.pi / 180.0, STANDARD_GRAVITY
#: Of each triad: words, unit and factor of deviations, and columns of the list with their factors.
TRIADS: dict[str, tuple[str, str, float, dict[str, tuple[str, float]]]] = {
    "gyro": (
        "Gyros",
        "deg/h",
        3600.0 / DEG,
        {
            "noise_density": ("gyro noise, deg/√h", 60.0 / DEG),
            "bias_instability": ("instability, deg/h", ALLAN_OF_GAUSS_MARKOV * 3600.0 / DEG),
            "bias": ("bias, deg/h", 3600.0 / DEG),
        },
    ),
    "accel": (
        "Accelerometers",
        "µg",
        1e6 / G,
        {
            "noise_density": ("accel noise, µg/√Hz", 1e6 / G),
            "bias_instability": ("instability, µg", ALLAN_OF_GAUSS_MARKOV * 1e6 / G),
            "bias": ("bias, mg", 1e3 / G),
        },
    ),
}
#: Averaging times of the deviations, s.
TAU = np.geomspace(0.01, 1e5, 141)
#: Standard deviations over an outage: name of the column, heading, and panel.
DRIFTS = {
    "position_sd_m": "horizontal position, m",
    "tilt_sd_deg": "roll and pitch, deg",
    "heading_sd_deg": "heading, deg",
}
LIST_CAPTION = (
    "Largest axis. Bias: standard deviation of a unit, a bound of the data sheet over √3. "
    "Instability: flat minimum of the Allan deviation. Assumed: figures without a source, typical "
    "of the class."
)
METHOD = (
    "Allan deviations of white noise, Gauss-Markov process, random walk and trend of the error "
    "model, of the root mean square of the axes.",
    "Standard deviations by the covariance of the filter: 600 s of a drive with fixes of 1.5 m and "
    "0.05 m/s each second, then the outage, straight on. Bias, scale factor, misalignment and "
    "g-sensitivity are what the drive leaves of the data sheet's; what a file does not state is "
    "taken as zero.",
)


@dataclass(frozen=True, eq=False, repr=False)
class SensorsRun(SavedRun):
    """Sensors compared: in memory until `save` writes the page and its data.

    Attributes
    ----------
    sensors : tuple of Sensor
    deviations : DataFrame
        ``sensor``, ``triad``, ``tau`` s, and ``allan``, rad/s or m/s², by their error models.
    drift : DataFrame
        ``sensor``, ``time`` s since the fixes ended, and the standard deviations
        ``position_sd_m`` (horizontal), ``tilt_sd_deg``, ``heading_sd_deg``.
    findings : tuple of Finding
        Sensors without a triad, which have no drift.
    """

    bundle = "strapdown.report.sensors:SENSORS_BUNDLE"

    spec: SensorsSpec
    sensors: tuple[Sensor, ...]
    deviations: pd.DataFrame
    drift: pd.DataFrame
    inputs: tuple[InputFiles, ...]
    findings: tuple[Finding, ...]
    memory: Memory = field(default=Memory({}))

    configuration: ClassVar[str] = "spec"

    def to_pandas(self) -> pd.DataFrame:
        """A row for each sensor, as `catalogue_table`, with the drift at the end."""
        return catalogue_table(self.sensors).join(self.drift.groupby("sensor").last(), on="name")

    def plot(self, kind: str = "allan") -> ChartFigure:
        """Draw the Allan deviations, or the ``drift`` over the outage.

        ConfigError: no sensor has both triads, which a drift needs.
        """
        from strapdown.report.chart_svg import ChartFigure

        chart = drift_chart(self) if kind == "drift" else allan_chart(self)
        if chart is None:
            raise ConfigError(self.findings[0])
        return ChartFigure(chart)

    def __repr__(self) -> str:
        return f"<SensorsRun {', '.join(one.name for one in self.sensors)}>"


@one_thread()
def compare(spec: SensorsSpec, progress: Progress = silent) -> SensorsRun:
    """Compare sensors: deviations by their error models, drift by the filter's covariance."""
    sensors = tuple(load_sensor(name) for name in spec.sensor)
    names = [one.name for one in sensors]
    if len(set(names)) < len(names):
        twice = next(name for name in names if names.count(name) > 1)
        raise ConfigError("outage.sensor-twice", quantity="sensor", name=twice)
    deviations, drifts, findings = [], [], []
    for k, (given, sensor) in enumerate(zip(spec.sensor, sensors, strict=True)):
        progress(f"drift of {sensor.name}", k / len(sensors))
        for triad, errors in _triads(sensor).items():
            table = pd.DataFrame({"tau": TAU, "allan": _allan(errors)})
            deviations.append(table.assign(sensor=sensor.name, triad=triad))
        try:
            known = sensor_of(given)
        except ConfigError as error:
            if not error.finding.code.startswith("outage.sensor-without"):
                raise
            findings.append(error.finding.replace(severity="warning", file=sensor.name))
            continue
        motion = {"speed_m_per_s": spec.speed_m_per_s}
        outage = specify(OutageSpec, outage_s=spec.outage_s, sensor=given, motion=motion)
        found = forecast_of_sensor(outage, known)
        P = np.maximum(np.diagonal(found.covariance, axis1=1, axis2=2), 0.0)
        table = pd.DataFrame(
            {
                "time": found.time,
                "position_sd_m": np.sqrt(P[:, 0] + P[:, 1]),
                "tilt_sd_deg": np.degrees(np.sqrt(P[:, 6] + P[:, 7])),
                "heading_sd_deg": np.degrees(np.sqrt(P[:, 8])),
            }
        )
        drifts.append(table.assign(sensor=sensor.name))
    drift = pd.concat(drifts) if drifts else pd.DataFrame(columns=["time", *DRIFTS, "sensor"])
    return SensorsRun(
        spec,
        sensors,
        pd.concat(deviations, ignore_index=True)[["sensor", "triad", "tau", "allan"]],
        drift.reset_index(drop=True)[["sensor", "time", *DRIFTS]],
        tuple(one for name in spec.sensor for one in sensor_file(name)),
        tuple(findings),
    )


def _triads(sensor: Sensor) -> dict[str, TriadErrors]:
    """Error model of each triad that the sensor has figures of."""
    there = {figure.key.partition(".")[0] for figure in sensor.sources}
    models = (("gyro", sensor.imu_errors.gyro), ("accel", sensor.imu_errors.accel))
    return {name: errors for name, errors in models if name in there and errors is not None}


def _allan(errors: TriadErrors) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Root mean square of the Allan deviations of the axes."""
    symbols = {"N": "noise_density", "GM": "bias_instability", "K": "random_walk", "R": "trend"}
    axes = zip(*(errors.axis(name) for name in symbols.values()), strict=True)
    square = [
        allan_model(
            {s: v for s, v in zip(symbols, values, strict=True) if v}, TAU, errors.correlation_time
        )
        ** 2
        for values in axes
    ]
    return np.asarray(np.sqrt(np.mean(square, axis=0)), np.float64)


# Tables.


def catalogue_table(sensors: Sequence[Sensor] = ()) -> pd.DataFrame:
    """Return a row for each sensor; for each of the catalogue, if none is given.

    Returns
    -------
    DataFrame
        ``name``, ``class``, noise, bias instability and bias of both triads (NaN where a sensor has
        none; units in the names), ``figures`` and ``assumed``: how many there are, and how many
        have no source.
    """
    rows = []
    for one in sensors or [load_sensor(name) for name in SENSORS]:
        row: dict[str, Any] = {"name": one.name, "class": one.grade}
        models = _triads(one)
        for triad, (*_, columns) in TRIADS.items():
            known = uncertainty_of(one, triad) if triad in models else None
            for quantity, (heading, factor) in columns.items():
                owner: Any = known if quantity == "bias" else models.get(triad)
                size = 0.0 if owner is None else factor * max(owner.axis(quantity))
                row[heading] = size if size > 0.0 else math.nan
        row["figures"] = len(one.sources)
        row["assumed"] = sum(bool(figure.assumed) for figure in one.sources)
        rows.append(row)
    return pd.DataFrame(rows)


def list_block(table: pd.DataFrame) -> document.TableBlock:
    """Return the list of sensors as a table of a page or a terminal."""

    def shown(value: Any) -> str:
        if isinstance(value, float):
            return "–" if math.isnan(value) else three_digits(value)
        return str(value)

    kept = table.drop(columns=["figures", "assumed", *(c for c in DRIFTS if c in table)])
    kept = kept.drop(columns=[c for c in ("time",) if c in kept])
    rows = [tuple(shown(value) for value in row) for row in kept.itertuples(index=False)]
    price = zip(table["assumed"], table["figures"], strict=True)
    rows = [(*row, f"{a} of {n}") for row, (a, n) in zip(rows, price, strict=True)]
    return document.TableBlock(
        (*kept.columns, "assumed"), tuple(rows), text=(0, 1), caption=LIST_CAPTION
    )


def drift_block(run: SensorsRun) -> document.TableBlock | None:
    """Return the standard deviations of each sensor at the end of the outage."""
    if run.drift.empty:
        return None
    rows = []
    for name, row in run.drift.groupby("sensor", sort=False).last().iterrows():
        angles = (three_digits(row[c]) for c in ("tilt_sd_deg", "heading_sd_deg"))
        rows.append((str(name), length_words(row["position_sd_m"]), *angles))
    after = f"after {run.spec.outage_s:g} s without fixes at {run.spec.speed_m_per_s:g} m/s"
    columns = "sensor | position | roll and pitch, deg | heading, deg"
    return document.table_of(columns, rows, f"Standard deviations {after}.")


def figures_block(sensor: Sensor) -> document.TableBlock:
    """Return every figure of a sensor with its source, or why it is assumed."""
    rows = []
    for figure in sensor.sources:
        same = len(set(figure.value)) == 1
        values = figure.value[:1] if same else figure.value
        where = figure.source or f"assumed: {figure.assumed}"
        rows.append((figure.key, ", ".join(f"{v:.6g}" for v in values), where))
    title = f"{sensor.title} ({sensor.name}, {sensor.grade}): {sensor.summary}"
    return document.TableBlock(
        ("figure, with its unit", "value", "source"), tuple(rows), (0, 2), "", (), title
    )


# Page.


def allan_chart(run: SensorsRun) -> Chart:
    """Return the Allan deviations of the sensors over one another."""
    panels = []
    for triad, (title, unit, factor, _) in TRIADS.items():
        lines = []
        for k, sensor in enumerate(run.sensors):
            table = run.deviations
            own = (table["sensor"] == sensor.name) & (table["triad"] == triad)
            kept = table[own & (table["allan"] > 0.0)]
            if len(kept):
                tau, y = kept["tau"].to_numpy(), factor * kept["allan"].to_numpy()
                lines.append(_line(sensor.name, tau, y, k))
        if lines:
            panels.append(Panel(f"deviation, {unit}", tuple(lines), log=True, title=title))
    return Chart("allan", "Allan deviation", "", "averaging time, s", tuple(panels), log_x=True)


def drift_chart(run: SensorsRun) -> Chart | None:
    """Return the standard deviations over the outage; None without a sensor of both triads."""
    panels = []
    for column, label in DRIFTS.items():
        lines = []
        for k, sensor in enumerate(run.sensors):
            kept = run.drift[run.drift["sensor"] == sensor.name]
            if len(kept):
                values = kept["time"].to_numpy(), kept[column].to_numpy()
                lines.append(_line(sensor.name, *values, k))
        if lines:
            panels.append(Panel(label, tuple(lines), log=True))
    if not panels:
        return None
    title = "Drift without fixes, standard deviation"
    return Chart("drift", title, "", "time since the last fix, s", tuple(panels))


def _line(name: str, x: Any, y: Any, k: int) -> Line:
    return Line(name, x, y, look(k)["colour"], look(k)["dash"])


def sensors_document(run: SensorsRun, name: str) -> document.Document:
    """Return the page of a comparison."""
    sections = (
        document.section("deviations", "Noise", allan_chart(run)),
        document.section("drift", "Drift in an outage", drift_chart(run)),
        *(
            document.section(one.name, f"Figures of {one.name}", figures_block(one), folded=True)
            for one in run.sensors
        ),
        document.section("method", "Method", document.listed(METHOD), folded=True),
        document.section("again", "Check this folder", *document.run_again(name)),
    )
    return document.document_of(
        ", ".join(one.name for one in run.sensors),
        "Sensors compared",
        (),
        (
            list_block(catalogue_table(run.sensors)),
            drift_block(run),
            document.findings_list(run.findings, "cli") if run.findings else None,
        ),
        sections,
        links=(("sensors.json", "figures and drift"), ("drift.csv", "drift over time")),
    )


def sensors_json(run: SensorsRun) -> dict[str, Any]:
    """Return a comparison as plain data for programs."""
    ends = run.drift.groupby("sensor").last().drop(columns="time").to_dict("index")
    return finite(
        {
            "outage_s": run.spec.outage_s,
            "speed_m_per_s": run.spec.speed_m_per_s,
            "sensors": [{**sensor_json(s), "drift": ends.get(s.name)} for s in run.sensors],
            "findings": [one.plain("cli") for one in run.findings],
        }
    )


def sensor_json(sensor: Sensor) -> dict[str, Any]:
    """Return a sensor as plain data: every figure with its source."""
    (row,) = catalogue_table([sensor]).to_dict("records")
    figures = [
        {"key": f.key, "value": list(f.value), "source": f.source, "assumed": f.assumed}
        for f in sensor.sources
    ]
    return finite({**{str(key): value for key, value in row.items()}, "sources": figures})


def _write_data(run: SensorsRun, folder: Path) -> None:
    write_json(folder / "sensors.json", sensors_json(run))
    for file, table in (("deviations", run.deviations), ("drift", run.drift)):
        renamed = table.rename(columns={"tau": "tau_s", "time": "time_s"})
        columns = {str(c): renamed[c].to_numpy() for c in renamed.columns}
        csv.write(folder / f"{file}.csv", columns, {})


#: Page, JSON, deviations and drift of a comparison of sensors.
SENSORS_BUNDLE = ReportBundle(
    "sensors",
    lambda run: {"sensors": run.spec.plain()},
    lambda configuration: compare(specify(SensorsSpec, **configuration["sensors"])),
    with_page(_write_data, sensors_document),
)

"""Alignment and predicted GNSS outage drift from Python."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, field, fields, replace
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pandas as pd

from strapdown.api.navigation import NavigationRun
from strapdown.api.reading import GnssFile, ImuFile, imu_input, table_input
from strapdown.bundle.seal import Seal, check_destination
from strapdown.config.alignment import NOT_BEFORE_FINE, AlignmentSpec, LogTable
from strapdown.config.coast import CoastSpec
from strapdown.config.navigation import NavigationSpec
from strapdown.config.spec import specify
from strapdown.errors import ConfigError
from strapdown.formats import read_raw
from strapdown.progress import Progress, silent
from strapdown.report.alignment import write_alignment
from strapdown.report.coast import read_coasting_run, write_coast
from strapdown.systems.alignment_run import AlignmentResult, run_alignment
from strapdown.systems.inputs import NOWHERE, Memory, moved_inputs, moved_paths
from strapdown.systems.outage_run import CoastResult, run_coast
from strapdown.tables import EULER

if TYPE_CHECKING:
    from strapdown.report.chart_figure import ChartFigure

__all__ = [
    "AlignmentRun",
    "OutageRun",
    "align",
    "coast",
    "run_specified",
    "specify_alignment",
]


@dataclass(frozen=True, eq=False, repr=False)
class AlignmentRun(AlignmentResult):
    """Result of an alignment.

    `attitude` is the attitude over the record by time (deg); `start` and `end` are the attitudes at
    its ends, each with `sd` and `covariance`; `readiness` gives the time until they were known.
    `save` writes the result; until then it is in memory only.
    """

    memory: Memory = field(default=Memory({}))

    def to_pandas(self) -> pd.DataFrame:
        """Attitude table over the record by time in s: quaternion, and angles in deg."""
        return self.attitude.copy()

    def plot(self, kind: str = "attitude") -> ChartFigure:
        """Draw roll, pitch and heading over time.

        Parameters
        ----------
        kind : {'attitude', 'roll', 'pitch', 'heading'}

        Returns
        -------
        ChartFigure
            Displays itself in a notebook; `save` writes it as SVG, PNG or PDF.

        Raises
        ------
        ConfigError
            The chart does not exist.
        """
        from strapdown.report.alignment_charts import attitude_chart
        from strapdown.report.chart_figure import ChartFigure

        if kind not in ("attitude", *EULER):
            raise ConfigError("api.unknown-chart", quantity="kind", kind=kind)
        chart = attitude_chart(self)
        if kind != "attitude":
            chart = replace(chart, panels=(chart.panels[EULER.index(kind)],))
        return ChartFigure(chart)

    def save(
        self,
        out: str | Path,
        *,
        report: bool = True,
        force: bool = False,
        progress: Progress = silent,
    ) -> Seal:
        """Write the alignment as a sealed bundle, which `verify` runs again.

        Parameters
        ----------
        out : str or Path
            New folder. Tables given in memory become input files in it.
        report : bool
            Whether to write the page and the figures as well.
        force : bool
            Overwrite an existing bundle.
        progress : callable, optional
            Called with a stage and the completed fraction.

        Returns
        -------
        Seal

        Raises
        ------
        ConfigError
            `out` exists and may not be overwritten.
        DataError
            An input file has changed since it was read.
        """
        check_destination(Path(out), force)
        with self.memory.as_files() if self.memory.tables else nullcontext(NOWHERE) as folder:
            result = _moved(self, NOWHERE, folder)
            return write_alignment(result, out, report=report, force=force, progress=progress)

    def __repr__(self) -> str:
        last = self.attitude.iloc[-1]
        sd = self.end.sd_deg
        angles = ", ".join(
            f"{name} {last[name]:.4g}° ± {s:.2g}°" for name, s in zip(EULER, sd, strict=True)
        )
        return f"<AlignmentRun {self.source.name}: at the end {angles} (1 sd)>"

    def _repr_html_(self) -> str:
        found = "".join(f"<li>{escape(str(f))}</li>" for f in self.findings)
        return f"<div><b>{escape(repr(self)[1:-1])}</b></div><ul>{found}</ul>"


def _moved(run: AlignmentRun, old: Path, new: Path) -> AlignmentRun:
    if not run.memory.tables or old == new:
        return run
    return replace(
        run,
        spec=AlignmentSpec.checked(moved_paths(run.spec.plain(), old, new)),
        inputs=moved_inputs(run.inputs, old, new, copied=True),
    )


def align(
    imu: Any,
    *,
    site: Mapping[str, float] | Sequence[float] | None = None,
    sensor: str | Path | None = None,
    method: str | Mapping[str, Any] = "inertial_frame",
    fine: bool = True,
    gnss: Any = None,
    prefilter: str | Mapping[str, Any] = "none",
    progress: Progress = silent,
) -> AlignmentRun:
    """Find roll, pitch and heading of a body at a fixed position, with their uncertainty.

    Parameters
    ----------
    imu : Imu, DataFrame, (t, gyro, accel), str or Path
        Samples: s, rad/s (n, 3), m/s² (n, 3), body axes forward-right-down. A path is that of a
        log, or of a configuration (``.toml``), which then replaces the other arguments.
    site : mapping or sequence of float
        ``lat_deg``, ``lon_deg``, ``alt_m``: deg, deg, m over the ellipsoid; by default as stated
        in the log.
    sensor : str or Path
        Data sheet: a name of the catalogue, or a ``.toml`` file.
    method : str or mapping
        Coarse alignment: ``inertial_frame``, ``two_vector``, ``levelling``, ``gnss_course``; with
        options as a mapping: ``{"kind": "known_heading", "heading_deg": 90.0}``.
    fine : bool
        Whether a filter refines it, where that is possible after the coarse method.
    gnss : GnssFixes, DataFrame, str or Path, optional
        Fixes, for ``gnss_course``.
    prefilter : str or mapping
        Filter applied to the samples first: ``{"kind": "robust_fir", "rate_hz": 100.0}``.
    progress : callable, optional
        Called with a stage and the completed fraction.

    Returns
    -------
    AlignmentRun

    Raises
    ------
    ConfigError
        A required argument is missing or does not fit; the message names the argument.
    DataError
        The record cannot be used, or does not determine the attitude.
    DivergenceError
        The filter left the range possible for a stationary body.
    """
    if isinstance(imu, str | Path) and Path(imu).suffix.lower() == ".toml":
        if any(one is not None for one in (site, sensor, gnss)):
            raise ConfigError(
                "api.configuration-and-arguments",
                file=Path(imu).name,
                quantity="site, sensor, gnss",
            )
        return run_specified(AlignmentSpec.read(imu), Path(imu), progress)
    given = imu_input(imu)
    fixes = None if gnss is None else table_input(gnss, "gnss")
    tables = {"imu.npz": given} if isinstance(given, pd.DataFrame) else {}
    tables |= {"gnss.csv": fixes} if isinstance(fixes, pd.DataFrame) else {}
    memory = Memory(tables)
    with memory.as_files() if tables else nullcontext(NOWHERE) as folder:
        log = (
            given
            if isinstance(given, ImuFile)
            else ImuFile(specify(LogTable, path=str(folder / "imu.npz")))
        )
        if isinstance(fixes, pd.DataFrame):
            path: str | None = str(folder / "gnss.csv")
        else:
            path = fixes.path if isinstance(fixes, GnssFile) else fixes
        place = site if site is None or isinstance(site, Mapping) else _named(site)
        spec = specify_alignment(
            log,
            site=place,
            sensor=sensor,
            coarse={"kind": method} if isinstance(method, str) else method,
            fine=fine,
            gnss=path,
            prefilter={"kind": prefilter} if isinstance(prefilter, str) else prefilter,
        )
        run = run_specified(spec, None, progress)
        return _moved(replace(run, memory=memory), folder, NOWHERE)


def _named(site: Sequence[float]) -> dict[str, float]:
    if len(site) not in (2, 3):
        raise ConfigError("api.not-a-position", quantity="site", count=len(site))
    return dict(zip(("lat_deg", "lon_deg", "alt_m"), map(float, site), strict=False))


def run_specified(
    spec: AlignmentSpec, file: Path | None = None, progress: Progress = silent
) -> AlignmentRun:
    """Run a specification of an alignment.

    Parameters
    ----------
    spec : AlignmentSpec
    file : Path, optional
        File it was read from, also an input.
    progress : callable, optional

    Returns
    -------
    AlignmentRun
    """
    result = run_alignment(spec, file, progress)
    return AlignmentRun(**{f.name: getattr(result, f.name) for f in fields(result)})


def specify_alignment(
    log: ImuFile,
    *,
    site: Mapping[str, float] | None,
    sensor: str | Path | None,
    coarse: Mapping[str, Any],
    fine: bool,
    gnss: str | None = None,
    prefilter: Mapping[str, Any] | None = None,
    called: Callable[[str], str] = str,
) -> AlignmentSpec:
    """Build the specification of an alignment; its position may come from the log.

    Parameters
    ----------
    log : ImuFile
    site, sensor, fine, gnss
        As `align`.
    coarse, prefilter : mapping
        The module with its options, including ``kind``.
    called : callable
        Name of an argument in the interface, for messages: ``sensor`` as ``--sensor``.

    Returns
    -------
    AlignmentSpec

    Raises
    ------
    ConfigError
        A required argument is missing; the message names it.
    DataError
        The log cannot be read.
    """
    if sensor is None:
        raise ConfigError("api.no-sensor-for-alignment", quantity=called("sensor"))
    alone = not fine or coarse.get("kind") in NOT_BEFORE_FINE
    return AlignmentSpec.checked(
        {
            "name": Path(log.log.path).resolve().stem,
            "log": log.log.model_dump(exclude_none=True),
            "axes": {"axes": log.axes},
            "site": _site(log.log.path, site or {}, called),
            "sensors": {"sensor": str(sensor)},
            "prefilter": dict(prefilter or {"kind": "none"}),
            "gnss": None if gnss is None else {"path": gnss},
            "coarse": dict(coarse),
            "fine": {"kind": "none" if alone else "filter"},
        }
    )


def _site(log: str, known: Mapping[str, float], called: Callable[[str], str]) -> dict[str, float]:
    if not {"lat_deg", "lon_deg"} & set(known):
        start = read_raw(Path(log)).start
        if start is not None:
            said = {"lat_deg": start.lat_deg, "lon_deg": start.lon_deg, "alt_m": start.alt}
            return {**said, **known}
    for key in ("lat", "lon"):
        if f"{key}_deg" not in known:
            raise ConfigError(
                "api.no-site-position",
                quantity=called(key),
                called=called("lat"),
                called_2=called("lon"),
                called_3=called("alt"),
            )
    return {key: float(value) for key, value in known.items()}


# --- predicted drift in a GNSS outage -----------------------------------------------------


@dataclass(frozen=True, eq=False, repr=False)
class OutageRun(CoastResult):
    """Predicted drift in a GNSS outage.

    `forecast` has the covariance over the outage and the shares of its sources; `recorded`, for a
    navigation run, the actual drift. `save` writes the result; until then it is in memory only.
    """

    memory: Memory = field(default=Memory({}))

    @property
    def bound_m(self) -> pd.Series:
        """95 % bound of the horizontal position, m, by time since the outage began, s."""
        return pd.Series(
            self.forecast.bound, index=pd.Index(self.forecast.time, name="time"), name="bound_m"
        )

    def to_pandas(self) -> pd.DataFrame:
        """The 95 % bound, and the motion over the outage, by time since it began."""
        table = self.bound_m.to_frame()
        return table.join(self.forecast.trajectory)

    def plot(self) -> ChartFigure:
        """Draw the 95 % bound over the outage.

        Returns
        -------
        ChartFigure
            Displays itself in a notebook; `save` writes it as SVG, PNG or PDF.
        """
        from strapdown.report.chart_figure import ChartFigure
        from strapdown.report.coast_document import cone_chart

        return ChartFigure(cone_chart(self))

    def save(
        self,
        out: str | Path,
        *,
        report: bool = True,
        force: bool = False,
        progress: Progress = silent,
    ) -> Seal:
        """Write the prediction as a sealed bundle, which `verify` runs again.

        Parameters
        ----------
        out : str or Path
            New folder.
        report : bool
            Whether to write the page and the figures as well.
        force : bool
            Overwrite an existing bundle.
        progress : callable, optional

        Returns
        -------
        Seal

        Raises
        ------
        ConfigError
            `out` exists and may not be overwritten.
        """
        check_destination(Path(out), force)
        with self.memory.as_files() if self.memory.tables else nullcontext(NOWHERE) as folder:
            result = _moved_outage(self, NOWHERE, folder)
            return write_coast(result, out, report=report, force=force, progress=progress)

    def __repr__(self) -> str:
        time, bound = self.forecast.time[-1], self.forecast.bound[-1]
        return f"<OutageRun {self.name}: within {bound:.4g} m (95 %) after {time:g} s>"

    def _repr_html_(self) -> str:
        return f"<div><b>{escape(repr(self)[1:-1])}</b></div>"


def _moved_outage(run: OutageRun, old: Path, new: Path) -> OutageRun:
    if not run.memory.tables or old == new or run.navigation is None:
        return run
    return replace(
        run,
        navigation=NavigationSpec.checked(moved_paths(run.navigation.plain(), old, new)),
        inputs=moved_inputs(run.inputs, old, new, copied=True),
    )


def coast(
    source: str | Path | NavigationRun,
    outage_s: float = 60.0,
    *,
    progress: Progress = silent,
    **options: Any,
) -> OutageRun:
    """Predict the drift of a sensor, or of a navigation run, in a GNSS outage.

    Parameters
    ----------
    source : str, Path or NavigationRun
        A sensor of the catalogue or its file, along a stated motion; or a navigation run, its
        bundle or its configuration, whose receivers are switched off.
    outage_s : float, s
    progress : callable, optional
        Called with a stage and the completed fraction.
    **options
        Tables and keys of the configuration: ``motion={"speed_m_per_s": 15.0}``,
        ``start={"heading_sd_deg": 1.0}``, ``aiding={"no_slip": {}}``; for a run ``places``,
        ``at_s``, ``from_s``, ``to_s``, ``duration_s``.

    Returns
    -------
    OutageRun

    Raises
    ------
    ConfigError
        The sensor does not exist, or an option does not fit.
    DataError
        The record of the run no longer exists.
    """
    with _run_of(source) as (navigation, file, memory, folder):
        sensor = None if navigation is not None else str(source)
        spec = specify(CoastSpec, outage_s=float(outage_s), sensor=sensor, **options)
        run = run_outage(spec, navigation, file, progress)
        return _moved_outage(replace(run, memory=memory), folder, NOWHERE)


@contextmanager
def _run_of(
    source: str | Path | NavigationRun,
) -> Iterator[tuple[NavigationSpec | None, Path | None, Memory, Path]]:
    """The navigation run that a source names, with every input a file."""
    if not isinstance(source, NavigationRun):
        yield (*read_coasting_run(source), Memory({}), NOWHERE)
        return
    with source.memory.as_files() if source.memory.tables else nullcontext(NOWHERE) as folder:
        table = moved_paths(source.spec.plain(), NOWHERE, folder)
        yield NavigationSpec.checked(table), None, source.memory, folder


def run_outage(
    spec: CoastSpec,
    navigation: NavigationSpec | None = None,
    file: Path | None = None,
    progress: Progress = silent,
) -> OutageRun:
    """Run a specification of an outage prediction; as `run_coast`.

    Parameters
    ----------
    spec : CoastSpec
    navigation : NavigationSpec, optional
    file : Path, optional
    progress : callable, optional

    Returns
    -------
    OutageRun
    """
    result = run_coast(spec, navigation, file, progress)
    return OutageRun(**{f.name: getattr(result, f.name) for f in fields(result)})

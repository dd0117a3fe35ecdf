"""Input of a navigation run: body-axis samples, measurement tables and reference."""

from __future__ import annotations

import zlib
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from strapdown.bundle import InputFiles, input_files, log_files, sensor_file
from strapdown.config.choice import SLOTS, options_of
from strapdown.config.navigation import AidSpec, NavigationSpec
from strapdown.ellipsoids import find_ellipsoid
from strapdown.errors import ConfigError, DataError, DivergenceError, Finding
from strapdown.evaluation.differences import rotation_contradicted
from strapdown.formats import files_of
from strapdown.formats.aid_table import (
    along_body,
    read_aid_table,
    read_control_points,
    wheel_table,
)
from strapdown.formats.assemble import require_accel
from strapdown.formats.clocks import on_clock_of
from strapdown.formats.gnss_files import read_gnss
from strapdown.formats.recording import Reading, Recording, StatedStart
from strapdown.formats.trajectory_readers import read_trajectory
from strapdown.formats.wheel_columns import EMPTY, UNIT_OPEN
from strapdown.navigation.measurements.gnss_readiness import without_repeats
from strapdown.navigation.measurements.magnetometer import Magnetometer
from strapdown.navigation.measurements.measurement import TabulatedMeasurement
from strapdown.sensors.error_chain import child
from strapdown.systems.alignment_source import body_record
from strapdown.systems.inputs import refuse_long_span
from strapdown.tables import GNSS, GYRO
from strapdown.tables.checks import HEIGHTS_AS_STATED, index_of, source_of, values_of
from strapdown.tables.sample_clock import sample_clock

#: Finding of a kind of sampling that is not stated.
UNSTATED = "io.sampling-taken-as-instantaneous"
#: Random stream of the fixes under a simulation's seed; those of the sensors count from zero.
_FIXES = 1000


@dataclass(frozen=True, eq=False)
class NavigationSource:
    """Input of a navigation run.

    Attributes
    ----------
    imu : DataFrame
        Imu table, body axes, of the span that is used.
    tables : mapping of str to DataFrame
        By name of the measurement.
    truth : DataFrame or None
        Trajectory table: of the simulation, or the given reference.
    truth_name : str
        In words, to follow "error against".
    points : DataFrame or None
        Control points (`read_control_points`), on the clock of the samples.
    start : StatedStart or None
        Position and attitude stated in the file.
    """

    name: str
    what: str
    imu: pd.DataFrame
    tables: Mapping[str, pd.DataFrame]
    truth: pd.DataFrame | None
    truth_name: str
    points: pd.DataFrame | None
    start: StatedStart | None
    readings: tuple[Reading, ...]
    inputs: tuple[InputFiles, ...]
    findings: tuple[Finding, ...]

    @property
    def heights_as_stated(self) -> bool:
        """Whether heights count from the level of the fixes, and not from the ellipsoid."""
        return any(table.attrs.get(HEIGHTS_AS_STATED) for table in self.tables.values())


def read_navigation_source(spec: NavigationSpec) -> NavigationSource:
    """Read the log, the measurements and the reference of a specification, or simulate them.

    Parameters
    ----------
    spec : NavigationSpec
        With absolute paths.
    """
    tables: dict[str, pd.DataFrame] = {}
    inputs: list[InputFiles] = []
    findings: list[Finding] = []
    for name, aid in spec.aiding.items():
        if aid.path is not None:
            tables[name] = read_aid(aid)
            findings += tables[name].attrs.get("findings", ())
            inputs.append(input_files(f"aid-{name}", aid.path, files_of(aid.path)))
    truth = None
    if spec.truth is not None:
        truth = read_trajectory(spec.truth.path)
        findings += truth.attrs["findings"]
        inputs.append(input_files("truth", spec.truth.path, files_of(spec.truth.path)))
    points = None
    if spec.control_points is not None:
        given = spec.control_points
        points = read_control_points(given.path, given.columns)
        findings += points.attrs["findings"]
        inputs.append(input_files("control-points", given.path, (Path(given.path),)))
    inputs += sensor_file(spec.sensors.sensor)
    if spec.log is None and spec.simulation is None:
        raise ConfigError("navigation.samples-come-while-runs-no", quantity="live")
    if spec.log is None:
        return _simulated(spec, tables, truth, points, inputs, findings)
    recording, imu, of_log = body_record(spec.log, spec.axes)
    refuse_long_span(imu, recording.name)
    require_accel(recording)
    imu, on_clock = on_even_clock(imu)
    findings += on_clock
    for name, table in tables.items():
        tables[name], shifted = on_clock_of(table, recording.imu)
        findings += [] if shifted is None else [shifted]
        if set(GNSS) <= set(table.columns):
            tables[name], repeats = without_repeats(tables[name])
            findings += repeats
    for name, aid in spec.aiding.items():
        own = of_samples(aid, imu, recording)
        if own is not None:
            tables[name] = own
    if points is not None:
        points, shifted = on_clock_of(points, recording.imu)
        findings += [] if shifted is None else [shifted]
    if truth is not None:
        truth, shifted = on_clock_of(truth, recording.imu)
        contradicted = rotation_contradicted(imu, truth)
        findings += [one for one in (shifted, contradicted) if one is not None]
    return NavigationSource(
        name=recording.name,
        what="recorded log",
        imu=imu,
        tables=tables,
        truth=truth,
        truth_name="" if spec.truth is None else Path(spec.truth.path).name,
        points=points,
        start=recording.start,
        readings=recording.readings,
        inputs=(
            *log_files(spec.log.path, recording.files, spec.log.calibration),
            *inputs,
        ),
        findings=(*of_log, *findings),
    )


def on_even_clock(imu: pd.DataFrame) -> tuple[pd.DataFrame, tuple[Finding, ...]]:
    """Return samples on the clock that they were taken by, where their stamps scatter about it.

    Increments are forces times the steps of time: steps that scatter turn every jolt of a walk into
    an error of the velocity (phone, 5 ms, stamps ±1.4 ms: 12 mm/s, beside bounds of 6 mm/s).
    """
    clock = sample_clock(index_of(imu), values_of(imu, GYRO))
    if not clock.repaired:
        return imu, ()
    code = f"attitude.stamps-{'in-bursts' if clock.kind == 'bursts' else 'jitter'}"
    said = Finding(
        code,
        severity="note",
        file=source_of(imu),
        quantity="time",
        data={"rate_hz": clock.rate_hz, "spread": clock.spread},
    )
    return imu.set_axis(pd.Index(clock.time, name=imu.index.name)), (said,)


def _simulated(
    spec: NavigationSpec,
    tables: Mapping[str, pd.DataFrame],
    truth: pd.DataFrame | None,
    points: pd.DataFrame | None,
    inputs: list[InputFiles],
    findings: list[Finding],
) -> NavigationSource:
    from strapdown.systems.trajectory_source import (
        make_motion,
        simulate_samples,
        simulated_fixes,
        with_key,
    )

    asked = spec.simulation
    assert asked is not None  # one of the two is there
    sensor = asked.sensor or spec.sensors.sensor
    assert sensor is not None  # checked with the specification
    with with_key(f"{spec.name}.toml"):
        motion = make_motion(asked.motion, find_ellipsoid(spec.ellipsoid))
        imu, _ = simulate_samples(motion, asked, sensor, spec.name)
        made = {
            name: simulated_fixes(
                motion, one, child(asked.seed, _FIXES, zlib.crc32(name.encode())), name
            )
            for name, one in spec.receivers.items()
        }
    if asked.sensor != spec.sensors.sensor:
        inputs = [*inputs, *sensor_file(asked.sensor)]
    exact = motion.trajectory(imu.index.to_numpy(dtype=np.float64), source=spec.name)
    return NavigationSource(
        name=spec.name,
        what=f"simulated, {Path(sensor).stem}, seed {asked.seed}",
        imu=imu,
        tables={**tables, **made},
        truth=exact if truth is None else truth,
        truth_name="the exact truth" if spec.truth is None else Path(spec.truth.path).name,
        points=points,
        start=None,
        readings=(),
        inputs=tuple(inputs),
        findings=tuple(findings),
    )


# The file of a measurement, as its table.


def read_aid(given: AidSpec) -> pd.DataFrame:
    """Read the table of a measurement.

    Parameters
    ----------
    given : AidSpec
        With a path.

    Returns
    -------
    DataFrame
        By the time in the file; ``attrs`` hold its clock, ``source`` and ``findings``.
    """
    assert given.path is not None  # checked with the specification
    entry = SLOTS["aiding"].entries[given.kind]
    assert issubclass(entry, TabulatedMeasurement)
    if set(entry.columns) == set(GNSS):
        return read_gnss(given.path, given.options())
    return read_measured(given.make(), given.path, names=given.columns, repair=given.repair)


def read_measured(
    aid: TabulatedMeasurement,
    path: str,
    *,
    names: Mapping[str, str] | None = None,
    repair: bool = False,
) -> pd.DataFrame:
    """Read the table of a measurement other than a receiver, or its stream of a recording.

    Parameters
    ----------
    names, repair
        As `read_aid_table`.
    """
    stated = aid.sd_options()
    table = read_aid_table(
        path,
        aid.column_units(),
        optional=tuple(stated),
        instead=aid.instead,
        names=names,
        repair=repair,
        stream=aid.stream,
    )
    if isinstance(aid, Magnetometer):
        table = along_body(table, aid.axes)
    return _with_sds(aid, table)


def _with_sds(aid: TabulatedMeasurement, table: pd.DataFrame) -> pd.DataFrame:
    """Return the table of a measurement with its standard deviations, which must be stated."""
    for column, option in aid.sd_options().items():
        if column not in table and getattr(aid, option) == 0.0:
            key = next(o.key for o in options_of(type(aid)) if o.field == option)
            file = table.attrs["source"]
            raise DataError("navigation.aid-without-sd", file=file, quantity=column, key=key)
    return aid.converted(table)


def of_samples(given: AidSpec, imu: pd.DataFrame, recording: Recording) -> pd.DataFrame | None:
    """Return the columns of the log that a measurement without a file uses; else None."""
    entry = SLOTS["aiding"].entries[given.kind]
    if given.path is not None or not issubclass(entry, TabulatedMeasurement):
        return None
    if not entry.of_samples:
        return None
    if entry.stream == "wheel" and recording.wheel is not None:
        return _with_sds(given.make(), wheel_table(recording))
    if not set(entry.columns) <= set(imu.columns):
        of_wheels = (UNIT_OPEN, EMPTY) if entry.stream == "wheel" else ()
        if reason := next((f for f in recording.findings if f.code in of_wheels), None):
            raise DataError(reason)
        raise DataError(
            "navigation.no-such-columns-in-log", file=source_of(imu), columns=entry.columns
        )
    table = imu[list(entry.columns)]
    table.attrs = {"source": source_of(imu), "findings": ()}
    converted: pd.DataFrame = given.make().converted(table)
    return converted


# Findings with table rows converted to file rows.


def in_file(findings: Iterable[Finding], *tables: pd.DataFrame) -> tuple[Finding, ...]:
    """Convert rows of findings from table to file.

    Parameters
    ----------
    findings : iterable of Finding
        Their rows count from 1 in a table.
    *tables : DataFrame
        Tables whose ``attrs`` may hold ``first_row``: the file row of their first row, or None
        where rows between were omitted.

    Returns
    -------
    tuple of Finding
        Without a row where it is not known.
    """
    known = {t.attrs.get("source"): t.attrs["first_row"] for t in tables if "first_row" in t.attrs}
    out = []
    for one in findings:
        if one.row is not None and one.file in known:
            first = known[one.file]
            one = one.replace(row=None if first is None else first + one.row - 1)
        out.append(one)
    return tuple(out)


@contextmanager
def said_of_file(*tables: pd.DataFrame) -> Iterator[None]:
    """Errors raised within name file rows, and at least the first table's file."""
    try:
        yield
    except DivergenceError as error:
        said = error.finding
        if said.file is not None or not tables:
            raise
        raise error.replaced(file=source_of(tables[0])) from None
    except DataError as error:
        said = error.finding
        (moved,) = in_file((said,), *tables)
        if moved == said:
            raise
        raise error.replaced(row=moved.row) from None

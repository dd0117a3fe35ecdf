"""Input of a navigation run: body-axis samples, measurement tables and reference."""

from __future__ import annotations

import zlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.aiding.aid import TabulatedMeasurement
from strapdown.alignment.alignment import Site
from strapdown.config.choice import SLOTS
from strapdown.config.navigation import AidSpec, NavigationSpec, ReceiverTable
from strapdown.constants import MAD_TO_SD
from strapdown.dsp.running_integral import running_integral
from strapdown.ellipsoids import Ellipsoid, find_ellipsoid
from strapdown.errors import ConfigError, DataError, DivergenceError, Finding
from strapdown.formats.aid_table import read_aid_table
from strapdown.formats.clocks import on_clock_of
from strapdown.formats.control_points import read_control_points
from strapdown.formats.gnss_files import files_of_fixes, read_gnss
from strapdown.formats.gnss_fixes import GnssOptions
from strapdown.formats.recording import StatedStart
from strapdown.formats.trajectory_readers import files_of_trajectory, read_trajectory
from strapdown.frames import geodetic_from_ned, ned_from_geodetic
from strapdown.nav_state import NavState
from strapdown.results.inputs import InputFiles, Reading
from strapdown.sensors.catalogue import load_sensor
from strapdown.sensors.error_chain import child, normal
from strapdown.simulation import simulate_imu
from strapdown.simulation.earth_motion import EarthMotion
from strapdown.simulation.gnss import GnssReceiver, moved_places, simulate_gnss
from strapdown.systems.alignment_source import body_record
from strapdown.systems.attitude_source import input_files, sensor_file
from strapdown.systems.trajectory_source import make_motion, with_key
from strapdown.tables import (
    GEODETIC,
    GNSS,
    POSITION_SD,
    VELOCITY,
    VELOCITY_SD,
    check_gnss,
    gnss_table,
)
from strapdown.tables import VELOCITY as VELOCITY_COLUMNS
from strapdown.tables.checks import index_of, source_of, values_of

__all__ = [
    "COLUMN_UNITS",
    "NavigationSource",
    "Place",
    "fixes_until",
    "here_by_fix",
    "in_file",
    "read_aid",
    "read_navigation_source",
    "said_of_file",
    "simulated_fixes",
    "site_of_fixes",
]


#: Random stream of the fixes under a simulation's seed; those of the sensors count from zero.
_FIXES = 1000


@dataclass(frozen=True, eq=False)
class NavigationSource:
    """Input of a navigation run.

    Attributes
    ----------
    name, what : str
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
    readings : tuple of Reading
    inputs : tuple of InputFiles
    findings : tuple of Finding
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


def read_navigation_source(spec: NavigationSpec) -> NavigationSource:
    """Read the log, the measurements and the reference of a specification, or simulate them.

    Parameters
    ----------
    spec : NavigationSpec
        With absolute paths.

    Returns
    -------
    NavigationSource

    Raises
    ------
    DataError, ConfigError
        An input cannot be used; the message names file, row and remedy.
    """
    tables: dict[str, pd.DataFrame] = {}
    inputs: list[InputFiles] = []
    findings: list[Finding] = []
    for name, aid in spec.aiding.items():
        if aid.path is not None:
            tables[name] = read_aid(aid)
            findings += tables[name].attrs.get("findings", ())
            inputs.append(input_files(f"aid-{name}", aid.path, files_of_fixes(aid.path)))
    truth = None
    if spec.truth is not None:
        truth = read_trajectory(spec.truth.path)
        findings += truth.attrs["findings"]
        inputs.append(input_files("truth", spec.truth.path, files_of_trajectory(spec.truth.path)))
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
    for name, table in tables.items():
        tables[name], shifted = on_clock_of(table, recording.imu)
        findings += [] if shifted is None else [shifted]
    if points is not None:
        points, shifted = on_clock_of(points, recording.imu)
        findings += [] if shifted is None else [shifted]
    if truth is not None:
        truth, shifted = on_clock_of(truth, recording.imu)
        findings += [] if shifted is None else [shifted]
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
        inputs=(input_files("log", spec.log.path, recording.files), *inputs),
        findings=(*of_log, *findings),
    )


def _simulated(
    spec: NavigationSpec,
    tables: Mapping[str, pd.DataFrame],
    truth: pd.DataFrame | None,
    points: pd.DataFrame | None,
    inputs: list[InputFiles],
    findings: list[Finding],
) -> NavigationSource:
    asked = spec.simulation
    assert asked is not None  # one of the two is there
    sensor = asked.sensor or spec.sensors.sensor
    assert sensor is not None  # checked with the specification
    with with_key(f"{spec.name}.toml"):
        motion = make_motion(asked.motion, find_ellipsoid(spec.ellipsoid))
        imu, _ = simulate_imu(
            motion,
            load_sensor(sensor).draw(asked.seed),
            rate=asked.rate_hz,
            sampling=asked.sampling,
            seed=asked.seed,
            source=spec.name,
        )
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
        truth_name="the exact truth",
        points=points,
        start=None,
        readings=(),
        inputs=tuple(inputs),
        findings=tuple(findings),
    )


# The file of a measurement, as its table.


#: Units of the columns of measurements, as in `read_aid_table`; columns without an entry here or
#: in the measurement keep their unit.
COLUMN_UNITS = {
    "speed": "m/s",
    "height": "m",
    "heading": "deg",
    "vx": "m/s",
    "vy": "m/s",
    "vz": "m/s",
}


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

    Raises
    ------
    DataError, ConfigError
        The file cannot be used; the message names file, row and remedy.
    """
    assert given.path is not None  # checked with the specification
    entry = SLOTS["aiding"].entries[given.kind]
    assert issubclass(entry, TabulatedMeasurement)
    if set(entry.columns) == set(GNSS):
        return read_gnss(
            given.path,
            GnssOptions(
                columns=given.columns,
                position_sd=given.position_sd_m,
                velocity_sd=given.velocity_sd_m_per_s,
                repair=given.repair,
            ),
        )
    units = {c: COLUMN_UNITS.get(c.removesuffix("_sd"), "") for c in entry.columns}
    units |= dict(getattr(entry, "units", {}))
    return read_aid_table(given.path, units, names=given.columns, repair=given.repair)


# Position during an alignment: the stated site, or the fixes of a receiver.


Array = NDArray[np.float64]

# Standard deviation of a vehicle's acceleration, m/s².
MANOEUVRE = 1.0
# Fixes considered for outliers: most, longest time, s, and fewest.
LOOKED_AT, LOOKED_BACK, LEAST_LOOKED_AT = 9, 10.0, 4
# Standard deviations that make a fix an outlier.
CLEAR = 5.0


@dataclass(frozen=True, eq=False)
class Place:
    """Position and velocity of the sensors at an instant.

    Attributes
    ----------
    state : NavState
        With the given attitude.
    covariance : ndarray, (6, 6)
        Displacement and velocity, north-east-down.
    """

    state: NavState
    covariance: Array


def fixes_until(
    tables: Sequence[pd.DataFrame], time: float, offset: float = 0.0
) -> pd.DataFrame | None:
    """Concatenate the fixes up to an instant.

    Parameters
    ----------
    tables : sequence of DataFrame
        Gnss tables, one after the other.
    time : float, s
    offset : float, s
        Stamps minus the time of the inertial sensors.

    Returns
    -------
    DataFrame or None
        By the time of the inertial sensors; None without fixes.
    """
    if not tables:
        return None
    joined = tables[0] if len(tables) == 1 else pd.concat(tables)
    out: pd.DataFrame = joined[joined.index - offset <= time]
    if offset:
        out = out.set_axis(out.index - offset)
    out.attrs = dict(tables[0].attrs)
    if out.empty:
        return None
    check_gnss(out)
    return out


def site_of_fixes(
    fixes: pd.DataFrame | None, begin: float, time: float, ellipsoid: Ellipsoid
) -> tuple[Site, Array]:
    """Return the position of a stationary body, by the median of its fixes.

    Parameters
    ----------
    fixes : DataFrame or None
        Fixes until `time`.
    begin, time : float, s
        Of the rest. If it holds no fix, the newest one before is taken.
    ellipsoid : Ellipsoid

    Returns
    -------
    site : Site
    sd : ndarray, (3,), m
        The smallest stated by a fix: correlated errors do not average out.

    Raises
    ------
    DataError
        No fix has a position.
    """
    place, sd, stamps = _good(fixes, POSITION_SD, time)
    first = min(int(np.searchsorted(stamps, begin)), len(stamps) - 1)
    lat, lon, alt = np.median(place[first:], axis=0).tolist()
    return Site(lat, lon, alt, ellipsoid), np.asarray(sd[first:].min(axis=0))


def here_by_fix(
    fixes: pd.DataFrame | None,
    time: float,
    q_nb: Array,
    lever_arm: Array,
    ellipsoid: Ellipsoid,
    velocity: Array,
    velocity_covariance: Array,
) -> Place:
    """Return the position of a vehicle, by its newest fix that agrees with those before.

    Parameters
    ----------
    fixes : DataFrame or None
        Fixes until `time`.
    time : float, s
    q_nb : ndarray, (4,)
    lever_arm : ndarray, (3,), m
        Lever arm of the antenna, body axes.
    ellipsoid : Ellipsoid
    velocity : ndarray, (3,), m/s
        Velocity of the sensors at `time`, north, east, down.
    velocity_covariance : ndarray, (3, 3), (m/s)²

    Returns
    -------
    Place
        Propagated from the fix by the velocity; the acceleration is unknown, 1 m/s². The effect of
        a wrong stamp of the fix is left to `by_antenna.errors_by_antenna`.

    Raises
    ------
    DataError
        No fix has a position.
    """
    place, sd, stamps = _good(fixes, POSITION_SD, time)
    assert fixes is not None
    k = _newest_that_agrees(fixes, place, sd, stamps, ellipsoid)
    after = time - float(stamps[k])
    off = velocity * after - rotation.rotate(q_nb, lever_arm)
    lat, lon, alt = geodetic_from_ned(off, place[k], ellipsoid=ellipsoid).tolist()
    state = NavState(time, np.radians(lat), np.radians(lon), alt, velocity, q_nb)
    P = np.zeros((6, 6))
    unknown = np.square(sd[k]) + (0.5 * MANOEUVRE * after**2) ** 2
    P[:3, :3] = np.diag(unknown) + velocity_covariance * after**2
    P[:3, 3:] = P[3:, :3] = velocity_covariance * after
    P[3:, 3:] = velocity_covariance
    return Place(state, P)


def _newest_that_agrees(
    fixes: pd.DataFrame, place: Array, sd: Array, stamps: Array, ellipsoid: Ellipsoid
) -> int:
    """Newest position that agrees with the positions before it, propagated by velocities.

    Each velocity is the median of three; the expected position is the median of the predictions
    by the newest fixes.
    """
    rows = np.flatnonzero(stamps >= stamps[-1] - LOOKED_BACK)[-LOOKED_AT:]
    told = np.isfinite(values_of(fixes, VELOCITY_SD)).all(axis=1)
    told &= values_of(fixes, ["quality"])[:, 0] > 0.0
    if len(rows) < LEAST_LOOKED_AT or told.sum() < LEAST_LOOKED_AT:
        return len(stamps) - 1
    v, v_time = values_of(fixes, VELOCITY)[told], index_of(fixes)[told]
    near = np.clip(np.arange(len(v))[:, None] + np.arange(-1, 2), 0, len(v) - 1)
    v = np.median(v[near], axis=1)
    v = np.column_stack([np.interp(stamps[rows], v_time, one) for one in v.T])
    way = running_integral(stamps[rows], v)
    at = np.array([ned_from_geodetic(one, place[-1], ellipsoid=ellipsoid) for one in place[rows]])
    off = at - way
    off -= np.median(off, axis=0)
    usual = np.maximum(sd[rows], MAD_TO_SD * np.median(np.abs(off), axis=0))
    good = (np.abs(off) <= CLEAR * usual).all(axis=1)
    return int(rows[np.flatnonzero(good)[-1]]) if good.any() else len(stamps) - 1


def _good(
    fixes: pd.DataFrame | None, columns: Sequence[str], time: float
) -> tuple[Array, Array, Array]:
    """Positions, standard deviations and stamps of the fixes that have them."""
    if fixes is not None:
        sd = values_of(fixes, columns)
        good = np.isfinite(sd).all(axis=1) & (values_of(fixes, ["quality"])[:, 0] > 0.0)
        if good.any():
            return values_of(fixes, GEODETIC)[good], sd[good], index_of(fixes)[good]
    raise DataError(
        "navigation.no-position-for-alignment",
        file=None if fixes is None else source_of(fixes),
        quantity="site",
        time=time,
    )


# Fixes of a simulated receiver, with specified outages and outliers.


# Random streams under the seed; those of the receiver itself count from zero.
_STRUCK, _WAY = 100, 101


def simulated_fixes(
    motion: EarthMotion, asked: ReceiverTable, seed: np.random.SeedSequence, name: str
) -> pd.DataFrame:
    """Simulate a receiver along a motion.

    Parameters
    ----------
    motion : EarthMotion
    asked : ReceiverTable
    seed : SeedSequence
        Seed of all random numbers.
    name : str
        Name of the measurement, for messages.

    Returns
    -------
    DataFrame
        Gnss table without the fixes of outages; outliers state the precision of the others.
    """
    receiver = GnssReceiver(
        rate=asked.rate_hz,
        position_noise=asked.position_noise_m,
        position_drift=asked.position_drift_m,
        correlation_time=asked.correlation_time_s,
        velocity_noise=asked.velocity_noise_m_per_s,
        antenna=asked.antenna_m,
        time_offset=asked.time_offset_s,
        on_excess="unaffected",
    )
    table = simulate_gnss(motion, receiver, seed=seed, source=name)
    time = index_of(table)
    place, velocity = values_of(table, GEODETIC), values_of(table, VELOCITY_COLUMNS)
    place_sd, velocity_sd = values_of(table, POSITION_SD), values_of(table, VELOCITY_SD)
    if asked.outlier_share > 0.0:
        struck = _uniform(child(seed, _STRUCK), len(time)) < asked.outlier_share
        way = normal(seed, _WAY, len(time), axes=6)
        for part in (way[:, :3], way[:, 3:]):
            part /= np.linalg.norm(part, axis=1, keepdims=True)
        off = asked.outlier_size * struck[:, None] * way
        place = moved_places(place, off[:, :3] * place_sd, motion.ellipsoid)
        velocity = velocity + off[:, 3:] * velocity_sd
    if not asked.velocity:
        velocity_sd = np.full_like(velocity_sd, np.inf)
    kept = np.ones(len(time), dtype=np.bool_)
    for begin, end in asked.outages_s:
        kept &= (time < begin) | (time > end)
    return gnss_table(
        time[kept], place[kept], velocity[kept], place_sd[kept], velocity_sd[kept], source=name
    )


def _uniform(seed: np.random.SeedSequence, count: int) -> Array:
    return np.random.Generator(np.random.PCG64(seed)).random(count)


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
    return tuple(
        one.replace(row=_moved(one.row, known[one.file]))
        if one.row is not None and one.file in known
        else one
        for one in findings
    )


def _moved(row: int, first: int | None) -> int | None:
    return None if first is None else first + row - 1


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

"""Write a proposed navigation configuration from log and fixes, with the open questions."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.alignment.two_vector import triad
from strapdown.config.choice import SLOTS, Slot, options_of
from strapdown.config.logs import FixesTable, LogTable
from strapdown.config.navigation import STAGES
from strapdown.config.toml_text import ASK, Draft, Offered, Page, inline, named_from, string
from strapdown.constants import MAD_TO_SD, STANDARD_GRAVITY
from strapdown.dsp.samples import true_runs, white_sd
from strapdown.earth import FIRST_YEAR, LAST_YEAR, THIS_YEAR, magnetic_field
from strapdown.errors import DataError, Finding
from strapdown.estimation.sensor_blocks import STATED_STATES, resting_sd, states_that_are_stated
from strapdown.formats import holds
from strapdown.formats.aid_table import read_stream, wheel_table
from strapdown.formats.clocks import on_clock_of, year_of
from strapdown.formats.gnss_fixes import POSITION_SDS, VELOCITY_SDS
from strapdown.formats.recording import ABSENT, Recording
from strapdown.frames import ways_between
from strapdown.navigation.measurements.barometer import Barometer
from strapdown.navigation.measurements.heading import Heading
from strapdown.navigation.measurements.magnetometer import Magnetometer
from strapdown.navigation.measurements.measurement import TabulatedMeasurement, longer_by
from strapdown.navigation.measurements.vehicle import Odometer
from strapdown.progress import Progress, silent
from strapdown.sensors.catalogue import SENSORS, load_sensor
from strapdown.sensors.uncertainty import ImuUncertainty
from strapdown.systems.alignment_draft import (
    axes_table,
    listed_kinds,
    log_table,
    options,
    stage,
    toml_value,
)
from strapdown.systems.baseline_angle import baseline_angle
from strapdown.systems.navigation_checks import finer_than_arm
from strapdown.systems.navigation_proposal import NOISE_KEYS, TAKEN, Proposal, propose
from strapdown.systems.navigation_source import read_measured
from strapdown.tables import ACCEL, GEODETIC, GYRO, MAG, POSITION_SD, VELOCITY, VELOCITY_SD
from strapdown.tables.aiding import HEADING
from strapdown.tables.checks import Array, index_of, source_of, values_of

# --- measurements of other sensors that the recording holds -----------------------------

#: Least number of rows within the samples.
LEAST_ROWS = 10
#: Error of a height by gusts, doors and fans, m, and that by the wind of travel as a share of the
#: dynamic pressure: an opening that is not flush has a tenth (`Barometer`). How long both last, s.
GUSTS, OF_DYNAMIC, WEATHER = 0.5, 0.1, 30.0
#: Time over which heights are averaged, s: faster they show no more, and cost updates.
MEAN = 1.0
#: Error of a heading of two antennas by reflected signals, deg, where no standard deviation is
#: stated, and how long it lasts, s.
REFLECTED, LASTS = 0.3, 20.0
#: Errors of the angle of a baseline, deg: of the mounting of the unit in the vehicle, whose course
#: shows the angle, as of an alignment by the course; and of an angle that a person states.
MOUNTED, STATED_ANGLE = 5.0, 2.0
#: Error of a wheel's speed by slip, a bus that is late, and a lever arm that nobody stated, m/s,
#: and how long it lasts, s.
SLIP, TURN = 0.3, 2.0
#: Speed up to which a vehicle may go backwards, m/s: many buses have no sign.
BACKWARDS = 3.0
#: Differences of the Earth's field, as a share of its strength and in dip, deg, that show iron: of
#: hard iron that turns a heading by about as much.
WEAK, DIP = 0.15, 8.0
#: Least standard deviation of a magnetic heading, deg; least horizontal share of the field.
LEAST_SD, LEVEL = 5.0, 0.1
#: Length at the start over which a heading is read, s.
BEGIN = 2.0
#: Parts of it, whose headings show whether the body turns or accelerates.
PARTS = 4


@dataclass(frozen=True)
class Magnetic:
    """A magnetometer of the recording, as a table that a person may switch on.

    Attributes
    ----------
    table : dict
        Of the measurement, with the field by the World Magnetic Model.
    year : float
        Of the model; `THIS_YEAR` if the recording has no date.
    dated : bool
    heading_deg : float
        Of the body at the start, true, as if without hard iron.
    spread_deg : float
        Standard deviation of the headings of the parts of the start, deg: of a body that turns or
        accelerates there.
    measured, expected : tuple of float
        Strength, uT, and dip, deg, of the field at the start, and by the model.
    """

    table: dict[str, Any]
    year: float
    dated: bool
    heading_deg: float
    spread_deg: float
    measured: tuple[float, float]
    expected: tuple[float, float]

    @property
    def disturbed(self) -> bool:
        """Whether the field at the start is not that of the Earth."""
        strength, dip = (a - b for a, b in zip(self.measured, self.expected, strict=True))
        return abs(strength) > WEAK * self.expected[0] or abs(dip) > DIP

    @property
    def heading_sd_deg(self) -> float:
        """Standard deviation of the heading, deg.

        Strength and dip show two components of an error of the field; the third, across it, is
        taken to be as large, and turns the heading by itself over the horizontal field. The motion
        of the heading over the start is added.
        """
        (size, dip), (expected, steep) = self.measured, self.expected
        seen = math.hypot(size / expected - 1.0, math.radians(dip - steep)) / math.sqrt(2.0)
        level = max(math.cos(math.radians(steep)), LEVEL)
        return math.hypot(max(LEAST_SD, math.degrees(seen / level)), self.spread_deg)


def propose_aids(
    log: LogTable,
    imu: pd.DataFrame,
    fixes: pd.DataFrame | None,
    *,
    recording: Recording | None = None,
    beside: str | None = None,
) -> tuple[dict[str, dict[str, Any]], tuple[Finding, ...]]:
    """Propose a table for each stream of a recording that can aid navigation.

    Parameters
    ----------
    log : LogTable
        With a path that can be opened.
    imu : DataFrame
        Imu table of the log.
    fixes : DataFrame, optional
        Gnss table; its speed says how much the wind of travel disturbs a pressure, and its course
        where a baseline of two antennas points.
    recording : Recording, optional
        Of the log, whose columns may have the speed of the wheels.
    beside : str, optional
        File of the fixes, which may have the headings of two antennas.

    Returns
    -------
    tables : dict of str to dict
        By name of the measurement.
    findings : tuple of Finding
        Of reading; a stream that cannot be read is a warning.
    """
    tables: dict[str, dict[str, Any]] = {}
    findings: list[Finding] = []
    of_log = [Barometer(height_sd=1.0, interval=MEAN), Odometer(speed_sd=1.0)]
    ways = [(aid, log.path) for aid in (*of_log, Heading(heading_sd_deg=1.0))]
    ways += [(Heading(heading_sd_deg=1.0), beside)] if beside not in (None, log.path) else []
    held = recording is not None and recording.wheel is not None
    columns = wheel_table(recording) if recording is not None and held else pd.DataFrame()
    for aid, path in ways:
        of_columns = isinstance(aid, Odometer) and held
        if aid.kind in tables or not (of_columns or holds(Path(path), aid.stream)):
            continue
        try:
            table = _within(columns, imu) if of_columns else _read(log, aid, imu, path)
        except DataError as error:
            if error.finding.code not in ABSENT:
                findings.append(error.finding.replace(severity="warning", stream=aid.stream))
            continue
        findings += table.attrs.get("findings", ())
        if len(table) < LEAST_ROWS:
            continue
        if isinstance(aid, Heading):
            tables[aid.kind], shown = _of_antennas(path, table, fixes)
            findings += shown
            continue
        errors = _error_of(aid, fixes)
        step = float(np.median(np.diff(index_of(table))))
        # The filter takes errors as new in each row; those that last have the variance of a mean.
        lasting = errors[0] * math.sqrt(longer_by(step, errors[1]))
        size = math.hypot(float(white_sd(values_of(table, aid.columns[:1]))[0]), lasting)
        own = {"height_sd_m": size, "interval_s": MEAN}
        if not isinstance(aid, Barometer):
            own = {"speed_sd_m_per_s": size}
            if (values_of(table, aid.columns[:1]) >= 0.0).all():
                own["least_speed_m_per_s"] = BACKWARDS
        stated = {key: float(f"{x:.2g}") for key, x in own.items()}
        where = {} if of_columns else {"path": path}
        tables[aid.kind] = {"kind": aid.kind, **where, **stated}
    return tables, tuple(findings)


def _of_antennas(
    path: str, table: pd.DataFrame, fixes: pd.DataFrame | None
) -> tuple[dict[str, Any], list[Finding]]:
    """Propose the table of the headings of two antennas, with what shows the angle, or asks it."""
    out: dict[str, Any] = {"kind": Heading.kind, "path": path}
    if HEADING[1] not in read_stream(path, Heading.stream):
        step = float(np.median(np.diff(index_of(table))))
        heading = np.unwrap(values_of(table, HEADING[:1])[:, 0], period=360.0)
        # As `white_sd`, by the median: what changes is mostly the vehicle's heading, in turns.
        scatter = MAD_TO_SD * float(np.median(np.abs(np.diff(heading, n=2)))) / math.sqrt(6.0)
        size = math.hypot(scatter, REFLECTED * math.sqrt(longer_by(step, LASTS)))
        out["heading_sd_deg"] = float(f"{size:.2g}")
    angle = None if fixes is None else baseline_angle(table, fixes)
    if angle is None:
        return {**out, "axis_deg": ASK.strip('"'), "misalignment_sd_deg": STATED_ANGLE}, []
    shown = Finding(
        "navigation.baseline-angle",
        severity="note",
        file=source_of(table),
        quantity="heading",
        angle=angle.angle_deg,
        sd=angle.sd_deg,
        scatter=angle.scatter_deg,
        duration=angle.duration,
    )
    sd = float(f"{math.hypot(angle.sd_deg, MOUNTED):.2g}")
    return {**out, "axis_deg": round(angle.angle_deg, 1), "misalignment_sd_deg": sd}, [shown]


def _read(log: LogTable, aid: TabulatedMeasurement, imu: pd.DataFrame, path: str) -> pd.DataFrame:
    """Read the rows of a stream within the samples, on their clock."""
    return _within(on_clock_of(read_measured(aid, path, repair=log.repair), imu)[0], imu)


def _within(table: pd.DataFrame, imu: pd.DataFrame) -> pd.DataFrame:
    """Rows of a table within the samples."""
    begin, end = np.searchsorted(index_of(table), index_of(imu)[[0, -1]])
    return table.iloc[begin:end]


def _error_of(aid: TabulatedMeasurement, fixes: pd.DataFrame | None) -> tuple[float, float]:
    """Standard deviation of the errors that last, and how long they do, s."""
    if not isinstance(aid, Barometer):
        return SLIP, TURN
    square = 0.0
    if fixes is not None:
        known = np.isfinite(values_of(fixes, VELOCITY_SD)).all(axis=1)
        speed = np.linalg.norm(values_of(fixes, VELOCITY)[known], axis=1)
        square = float(np.sqrt(np.mean(speed**4))) if known.any() else 0.0
    return math.hypot(GUSTS, OF_DYNAMIC * square / (2.0 * STANDARD_GRAVITY)), WEATHER


def propose_magnetometer(
    log: LogTable,
    imu: pd.DataFrame,
    fixes: pd.DataFrame | None,
    place: tuple[float, float, float] | None,
) -> Magnetic | None:
    """Propose the magnetometer of a recording, at a position; None without either.

    Parameters
    ----------
    imu : DataFrame
        Imu table of the log, with the columns of a field or without.
    fixes : DataFrame, optional
        They may have the date, and the position.
    place : tuple of float, optional
        Latitude and longitude in deg, height in m.
    """
    if place is None and fixes is not None:
        lat, lon, alt = np.median(values_of(fixes, GEODETIC)[:LEAST_ROWS], axis=0).tolist()
        place = (lat, lon, alt)
    readings, path = _field(log, imu)
    if place is None or readings is None or readings.empty:
        return None
    dates = (year for table in (imu, fixes) if table is not None and (year := year_of(table)))
    year = next(dates, None)
    at = float(np.clip(year or THIS_YEAR, FIRST_YEAR, LAST_YEAR))
    model = magnetic_field(*place, at)
    field = tuple(round(x, 2) for x in model.field_ned)
    table = {"kind": "magnetometer", **path, "field_ned_ut": field}
    down, known = np.array([0.0, 0.0, 1.0]), np.array(model.field_ned)

    def attitude(begin: float, end: float) -> tuple[Array, Array]:
        """C_nb and field of a part of the start; the mean specific force is up."""
        force = values_of(imu.loc[begin:end], ACCEL).mean(axis=0)
        mag = values_of(readings.loc[begin:end], MAG).mean(axis=0)
        return triad(down, known) @ triad(-force, mag).T, mag

    edges = imu.index[0] + np.linspace(0.0, BEGIN, PARTS + 1)
    C_nb, mag = attitude(edges[0], edges[-1])
    heading = float(rotation.euler_from_dcm(C_nb)[2]) % 360.0
    parts = itertools.pairwise(edges)
    held = [(a, b) for a, b in parts if len(readings.loc[a:b]) and len(imu.loc[a:b])]
    own = [rotation.euler_from_dcm(attitude(a, b)[0])[2] - heading for a, b in held]
    spread = float(np.sqrt(np.mean(np.square(rotation.within_half_turn(np.array(own))))))
    size = float(np.linalg.norm(mag))
    dip = math.asin(float(np.clip((C_nb @ mag)[2] / size, -1.0, 1.0)))
    measured = size, math.degrees(dip)
    return Magnetic(
        table,
        at,
        year is not None,
        heading,
        spread,
        measured,
        (model.strength, model.inclination),
    )


def _field(log: LogTable, imu: pd.DataFrame) -> tuple[pd.DataFrame | None, dict[str, str]]:
    """Return the magnetic field along the body, and the path of a stream apart."""
    if set(MAG) <= set(imu.columns):
        seen = np.flatnonzero(np.isfinite(values_of(imu, MAG)).all(axis=1))
        return imu[MAG].iloc[seen], {}
    if not holds(Path(log.path), Magnetometer.stream):
        return None, {}
    try:
        return _read(log, Magnetometer(interval=0.0), imu, log.path), {"path": log.path}
    except DataError:
        return None, {}


#: Finding of a kind of sampling that is not stated; turns are means over so many seconds.
UNSTATED, STEADY = "io.sampling-taken-as-instantaneous", 0.5
#: Errors of other sensors in the recording, as comments of their tables.
LASTING_ERRORS = {
    "barometer": "gusts, and the wind of travel",
    "odometer": "slip, a bus that is late, and lever_arm_m, which is taken as zero",
    "heading": "reflected signals",
}
#: Consequence of a magnetic heading.
MAGNETIC = "by the magnetometer at the start, whose field is like the Earth's: is no iron near?"
#: Other measurements, as comments.
OTHER_AIDS = ("no_slip", "zero_velocity", "odometer", "barometer")


def draft_navigation(
    log: LogTable,
    *,
    folder: Path,
    axes: str | None = None,
    gnss: FixesTable | None = None,
    sensor: str | None = None,
    foot: bool = False,
    truth: Path | None = None,
    progress: Progress = silent,
) -> Draft:
    """Write the proposed navigation configuration of a log.

    Parameters
    ----------
    log : LogTable
        With a readable path.
    folder : Path
        Folder of the configuration; other files are named relative to it.
    axes, gnss, sensor, progress
        As `propose`.
    foot : bool
        Whether the unit is on a shoe: zero-velocity updates at its stances (`on_foot`).
    truth : Path, optional
        A reference trajectory, to compare the result with.
    """
    made = propose(log, axes=axes, gnss=gnss, sensor=sensor, progress=progress)
    progress("magnetometer and other measurements", 0.9)
    # The aids of the recording are of a file alone: other callers of `propose` state theirs.
    site = made.table.get("site")
    place = None if site is None else (site["lat_deg"], site["lon_deg"], site["alt_m"])
    magnetic = propose_magnetometer(log, made.imu, made.gnss, place)
    aids, of_aids = propose_aids(
        log,
        made.recording.imu,
        made.gnss,
        recording=made.recording,
        beside=made.table.get("aiding", {}).get("gnss", {}).get("path"),
    )
    table = {**made.table, "aiding": {**made.table.get("aiding", {}), **aids}}
    said = (*made.findings, *(one for one in of_aids if one not in made.findings))
    made = replace(made, table=table, findings=said)
    if foot:
        made = on_foot(made)
    elif magnetic is not None:
        made = _by_magnetometer(made, magnetic)
    parts = {key: made.table["log"].get(key) for key in ("from_s", "to_s", "duration_s")}
    log = log.model_copy(update=parts)
    page = Page()
    page.say(
        f"Navigation over {made.recording.name}: place, velocity and attitude, and how well each "
        "is known.",
        "Each table is a stage of the chain, and kind selects its module; keys that begin "
        "with # show the defaults. Then: strapdown navigate on this file.",
    )
    found = [
        *log_table(
            page,
            log,
            folder,
            made.imu,
            made.recording.name,
            check_sampling=_sampling_to_check(made),
        ),
        *_where(page, made, foot),
    ]
    axes_table(page, axes)
    found += _sensors(page, made)
    stage(page, STAGES["prefilter"], {})
    page.blank()
    page.say(f"Alignment: {made.how}.")
    for name in ("coarse", "fine"):
        stage(page, STAGES[name], made.table[name], {"heading_deg": MAGNETIC})
    for name in ("mechanization", "filter", "damping", "smoother", "recorder"):
        stage(page, STAGES[name], made.table.get(name, {}))
    found += _aids(page, made, magnetic, folder, foot)
    if truth is not None:
        found.append(f"{truth.name}: a reference trajectory, to compare the result with")
    _rest(page, foot, None if truth is None else named_from(truth, folder))
    return Draft(
        page.text,
        tuple(found),
        tuple(page.asked),
        tuple(page.to_check),
        made.findings,
        tuple(_offers(made, magnetic, folder)),
    )


def _offers(made: Proposal, magnetic: Magnetic | None, folder: Path) -> Iterator[Offered]:
    """Yield the tables that `_aids` writes as comments."""
    if made.drives:
        what = "Does it drive on wheels that do not slide? It bounds what an outage costs."
        yield Offered("aiding.no_slip", WHEELS, what, "Yes, use it")
    if magnetic is not None and not magnetic.disturbed and _asks_heading(made):
        start = _start_of(magnetic)
        what = (
            f"{_magnetic(magnetic)}, with a standard deviation of {start['sd_deg']:g}°. Is no iron "
            "near it there?"
        )
        yield Offered("coarse", start, what, "Yes, begin with this heading")
    if magnetic is not None:
        what = f"{_magnetic(magnetic)}. Is it away from iron and currents that change?"
        table = _magnetic_table(magnetic, folder)
        yield Offered("aiding.magnetometer", table, what, "Yes, use it for the heading")


def _magnetic_table(found: Magnetic, folder: Path) -> dict[str, Any]:
    """Return the table of a magnetometer, its file as named from a folder."""
    path = found.table.get("path")
    named = {} if path is None else {"path": named_from(Path(path), folder)}
    return {**found.table, **named, "field_ned_ut": list(found.table["field_ned_ut"])}


def _asks_heading(made: Proposal) -> bool:
    """Whether only a person knows the heading at the start."""
    coarse = made.table["coarse"]
    return coarse["kind"] == "known_heading" and "heading_deg" not in coarse


def _start_of(magnetic: Magnetic) -> dict[str, float]:
    """Return the keys of a coarse alignment with the heading of a magnetometer."""
    heading, sd = round(magnetic.heading_deg, 1), round(magnetic.heading_sd_deg, 1)
    return {"heading_deg": heading, "sd_deg": sd}


def _by_magnetometer(made: Proposal, magnetic: Magnetic) -> Proposal:
    """Take a heading that would be asked from an undisturbed field, for a body that is at rest."""
    if not _asks_heading(made) or magnetic.disturbed or made.rest < BEGIN:
        return made
    coarse = {**made.table["coarse"], **_start_of(magnetic)}
    how = f"{made.how.removesuffix(': the heading is asked')}: the heading is the magnetometer's"
    return replace(made, table={**made.table, "coarse": coarse}, how=how)


def _sampling_to_check(made: Proposal) -> str:
    """Consequence of the assumed kind of sampling; empty where it is stated, or does not matter.

    A mean over the interval before its stamp is half an interval older than a reading at its
    stamp. That shifts the way along itself, and turns the attitude, which
    matters against what fixes and accelerometers resolve.
    """
    if made.gnss is None or all(f.code != UNSTATED for f in made.findings):
        return ""
    time, gnss = index_of(made.imu), made.gnss
    half = 0.5 * float(np.median(np.diff(time)))
    size = max(1, round(STEADY / (2.0 * half)))
    blocks = values_of(made.imu, GYRO)[: len(time) // size * size].reshape(-1, size, 3).mean(axis=1)
    turn = half * float(np.sqrt(np.square(blocks).sum(axis=1).mean()))
    known = load_sensor(made.table["sensors"]["sensor"]) if "sensors" in made.table else None
    tilt = math.inf
    if known is not None:
        tilt = max(ImuUncertainty.of_sensor(known).accel.axis("bias")) / STANDARD_GRAVITY
    way, span = ways_between(values_of(gnss, GEODETIC)), np.diff(index_of(gnss))
    shift = half * float(np.median(way / span)) if len(span) else 0.0
    sd = float(np.nanmedian(values_of(gnss, POSITION_SD)[:, :2]))
    if not (turn > tilt or shift > sd):
        return ""
    return (
        f'"mean" if each row is the mean over the interval before its stamp, as of tactical units '
        f"and better: it is {1e3 * half:.3g} ms older then, {shift:.2g} m of the way and "
        f"{math.degrees(turn):.2g} deg of attitude"
    )


def _where(page: Page, made: Proposal, foot: bool) -> list[str]:
    said = made.table.get("site")
    where = "Position of the body during alignment."
    if said is not None:
        found = "Found: the log states it; check that it is so."
        if SITE_SD in said:
            found = "The origin that is stated for the fixes: the way is dead reckoning from there."
        page.table("[site]", where, found)
        for key, value in said.items():
            sd = key == SITE_SD
            remark = "assumed: as of a map; it is in every bound of the position" if sd else ""
            page.key(key, repr(value), remark, check="how well that place is known" if sd else "")
        return [f"position: {said['lat_deg']:.6f}°, {said['lon_deg']:.6f}°"]
    if made.gnss is not None:
        page.blank()
        page.say(
            f"{where} Left out, it is that of the fixes: [site] with lat_deg, lon_deg, alt_m, "
            "position_sd_m.",
            "A state that is known takes the place of all alignment: [start] with lat_deg, "
            "lon_deg, alt_m, v_ned_m_per_s, roll_deg, pitch_deg, heading_deg and position_sd_m, "
            "velocity_sd_m_per_s, tilt_sd_deg, heading_sd_deg.",
        )
        return []
    if foot:
        page.table(
            "[site]",
            "Where it begins: gravity and the Earth's rate go by the latitude, to a degree. Places "
            "are counted from there.",
        )
        page.key("lat_deg", ASK, "only you know: geodetic latitude, north positive; to a degree")
        page.key("lon_deg", "0.0", "assumed: it changes nothing but the labels of a map")
        page.key("alt_m", "0.0", "assumed: height over the ellipsoid")
        page.key("position_sd_m", repr(HERE), "bounds are of the path from here on")
        page.key("velocity_sd_m_per_s", repr(STILL))
        return []
    page.table("[site]", where)
    page.key("lat_deg", ASK, "only you know: geodetic latitude, north positive")
    page.key("lon_deg", ASK, "only you know: longitude, east positive")
    page.key("alt_m", "0.0", "assumed: height over the ellipsoid")
    return []


def _sensors(page: Page, made: Proposal) -> list[str]:
    page.table(
        "[sensors]",
        "How good the sensors are: every bound, and the weight of every aid, rests on it.",
    )
    named = made.table.get("sensors", {}).get("sensor")
    told: list[str] = []
    if made.noise is not None:
        gyro, accel = made.noise
        noise = (
            f"{float(f'{60.0 * math.degrees(gyro):.2g}'):g} deg/√h and "
            f"{float(f'{accel / STANDARD_GRAVITY * 1e6:.3g}'):g} µg/√Hz"
        )
        told = [f"noise while it is quiet: gyros and accelerometers {noise}"]
        page.say(f"Found: noise of {noise} while it is quiet.")
    if named is None:
        page.key(
            "sensor",
            ASK,
            "only you know: which sensor, of the catalogue or a .toml file of your own",
        )
    else:
        check = (
            "" if not made.guessed else "a grade by the noise of the log; name yours if you know it"
        )
        remark = "assumed: the grade, by its noise; name yours" if made.guessed else ""
        page.key("sensor", string(named), remark, check=check)
        factor = made.table["sensors"].get("unit_factor")
        if factor is not None:
            page.say(
                "Factor on biases, scale factors, misalignments and g-sensitivity of this sensor: "
                "95 % of units lie within these bounds of Student's t (4 degrees of freedom), not "
                "within those of the data sheet. 1 if yours has been tested to lie within them."
            )
            page.key("unit_factor", repr(factor))
    page.say(
        f"The catalogue (strapdown sensors): {', '.join(s.name for s in _whole())}; or a .toml "
        "file of your own. Alternatively, or to replace single values: tables [sensors.gyro] "
        "and [sensors.accel]: bias_sd_deg_per_h, noise_density_deg_per_sqrt_h; bias_sd_ug, "
        "noise_density_ug_per_sqrt_hz, …",
        f"states = [ … ]: which of their errors are estimated, of {', '.join(STATED_STATES)}; "
        "biases, drifts, stated scale factors, misalignments and g-sensitivity, if not given",
    )
    chosen = made.table.get("sensors", {}).get("states")
    if chosen is not None:
        page.key("states", toml_value(chosen) or "")
    for name in ("gyro", "accel"):
        stated = made.table.get("sensors", {}).get(name)
        if stated is None:
            continue
        full = {"gyro": "gyros", "accel": "accelerometers"}[name]
        turns = "the biases as the turns of the whole record allow"
        if set(stated) == {BIAS}:
            why = f"Found: {turns}."
        elif name in made.shaken:
            why = "Found: it shakes far beyond its noise at rest"
            if any(name == triad and key in stated for triad, key, _ in NOISE_KEYS):
                why += "; over the record, so much may be white, x, y, z"
            why += "; and the gyros drift by it:" if name == "gyro" else ":"
            told.append(f"the {full} shake far beyond their noise while it is quiet")
        elif made.guessed:
            why = (
                "Found: noise while it is quiet, x, y, z; biases of the gyros as a rest, or the "
                "turns of the whole record, allow."
            )
        elif not _noisier(made, name, stated):
            why = "Found: noise while it is quiet, as units of a type differ, x, y, z:"
        else:
            why = (
                "Found: noise beyond the data sheet while it is quiet: is it this sensor? x, y, z:"
            )
            told.append(f"the noise of the {full} exceeds that of {named}: is it this sensor?")
        if BIAS in stated and not made.guessed and set(stated) != {BIAS}:
            why += f" And {turns}."
        page.table(f"[sensors.{name}]", why)
        for key, value in stated.items():
            page.key(key, toml_value(value) or "")
    warming = made.table.get("sensors", {}).get("warming")
    if warming is not None:
        page.table(
            "[sensors.warming]",
            "Nothing says that the unit is warm: so much its biases change until it is. Assumed by "
            "the grade; leave this table out if it was on for a quarter of an hour before.",
        )
        for key, value in warming.items():
            page.key(key, toml_value(value) or "")
    for block, stated in made.table.get("states", {}).items():
        why = (
            "As a start whose tilt is hardly known wants it: once the tilt is found, gravity along "
            "the body is another by its square, and a linear filter does not carry that over."
        )
        if block.endswith("_scale"):
            why = "Scale factors follow the temperature of the unit."
        page.table(f"[states.{block}]", why)
        for key, value in stated.items():
            page.key(key, toml_value(value) or "")
    return told


def _noisier(made: Proposal, triad: str, stated: dict[str, Any]) -> bool:
    """Whether a triad's measured noise is more than units of the named sensor differ by."""
    key, unit = next((key, unit) for name, key, unit in NOISE_KEYS if name == triad)
    known = ImuUncertainty.of_sensor(load_sensor(made.table["sensors"]["sensor"]))
    sheet = np.asarray(getattr(known, triad).axis("noise_density"))
    return key not in stated or bool((np.asarray(stated[key]) * unit > SPREAD * sheet).any())


def _whole() -> list[Any]:
    """Sensors of the catalogue whose gyros and accelerometers measure motion."""
    return [s for s in map(load_sensor, SENSORS) if s.grade != "crash"]


BIAS, SITE_SD = "bias_sd_deg_per_h", "position_sd_m"
#: Noise of a unit over that of its data sheet, which is typical of the type.
SPREAD = 1.25
#: Ready-made tables for a vehicle.
WHEELS = {"kind": "no_slip", "mounting_sd_deg": [6.0, 6.0]}

#: Ready-made tables for a unit on a shoe.
ON_FOOT = (
    "stance: zero velocity update (ZUPT) at each stance. It bounds velocity, roll, pitch and two "
    "gyro biases. Heading and position are not observable: the heading drifts with the bias of "
    "the vertical gyro, and the position error grows with the distance. A stationary start of ten "
    "seconds determines that bias.",
    'threshold_rule = "stated" keeps the threshold, in standard deviations of the two keys below '
    "it; otsu finds it from stances and swings as they come. pivot_m: height of the unit over the "
    "ground.",
)


def _aids(
    page: Page, made: Proposal, magnetic: Magnetic | None, folder: Path, foot: bool
) -> list[str]:
    slot = SLOTS["aiding"]
    page.blank()
    page.say(
        "Measurements beside the inertial sensors: [aiding.NAME], each with a name of its own. "
        "Kinds:",
        *listed_kinds(slot, False),
    )
    if foot:
        page.say(*ON_FOOT)
    elif made.gnss is None:
        page.say(
            "None is given here: height goes away by e in 570 s without one. [aiding.gnss] and "
            "path = …, from the folder of this file"
        )
    for name, aid in made.table.get("aiding", {}).items():
        page.table(f"[aiding.{name}]")
        page.key("kind", string(aid["kind"]))
        if "path" in aid:
            page.key("path", string(named_from(Path(aid["path"]), folder)))
            for key in ("columns", "units"):
                if key in aid:
                    page.key(key, inline(aid[key]))
            for key in ("format", "datum_height_m", "origin"):
                if key in aid:
                    page.key(key, toml_value(aid[key]) or "")
            if "clock_steps_s" in aid:
                page.say("Found: stamps from the first of each pair on are too late by the second.")
                page.key("clock_steps_s", toml_value(aid["clock_steps_s"]) or "")
            if aid["kind"] == "gnss":
                _with_remarks(page)
            else:
                page.say(_why(aid, made))
        elif aid["kind"] in LASTING_ERRORS:
            page.say(_why(aid, made))
        for key, what, usual in (
            ("position_sd_m", "position, m", POSITION_SDS),
            ("velocity_sd_m_per_s", "velocity, m/s", VELOCITY_SDS),
        ):
            if key not in aid:
                continue
            assert made.gnss is not None
            if not any(made.gnss.attrs.get(taken) for taken, k in TAKEN.items() if k == key):
                page.key(key, toml_value(aid[key]) or "")
            else:
                best, kind = "", "each fix"
                if key == "position_sd_m" and np.ptp(made.gnss[POSITION_SD[0]]):
                    kind = "the best kind of fix"
                    best = f"of {kind}, others have more; "
                page.key(
                    key,
                    repr(aid[key]),
                    f"assumed: the fixes do not state it; {best}{usual}",
                    check=f"standard deviation of the {what} of {kind}: {usual}",
                )
        arm = _arm(made.gnss) if aid["kind"] == "gnss" else ""
        options(page, slot.entries[aid["kind"]], aid, {"lever_arm_m": arm})
    if made.drives:
        page.say(
            "Does it drive on wheels? Then take the signs off; it bounds what an outage costs. The "
            "mounting angles of the unit are estimated; lever_arm_m is of the middle of the axle "
            "that is not steered."
        )
        _commented(page, "aiding.no_slip", WHEELS)
    aids = made.table.get("aiding", {})
    if magnetic is not None:
        _magnetometer(page, magnetic, folder)
    page.say(*_other(slot, [kind for kind in OTHER_AIDS if kind not in aids]))
    if foot:
        began = made.table["log"].get("from_s")
        if began is not None and began > index_of(made.imu)[0]:
            return [f"it moves where it begins; its first stance, at {began:.6g} s, is the start"]
        return [f"stationary for the first {made.rest:.3g} s"]
    others = [f"{kind} in the recording, proposed" for kind in LASTING_ERRORS if kind in aids]
    if magnetic is not None:
        comment = "" if magnetic.disturbed else "; its table is a comment"
        others.append(f"{_magnetic(magnetic)}{comment}")
    if made.gnss is None:
        return others
    time, own = index_of(made.gnss), index_of(made.imu)
    within = int(((time >= own[0]) & (time <= own[-1])).sum())
    told = [f"{made.gnss.attrs['source']}: {within} of {len(time)} fixes within the log"]
    for at, sd in aids["gnss"].get("clock_unsure_s", ()):
        told.append(
            f"its stamps change over the outage at {at:.6g} s: its clock may have stepped there, "
            f"by {sd:.2g} s or so"
        )
    if not np.isfinite(values_of(made.gnss, VELOCITY_SD[:2])).any():
        told.append(
            "the fixes state no velocity: heading and tilt are found from positions alone, later "
            "and less accurately; a log of the receiver with speed and course is better"
        )
    if made.rest >= 1.0:
        told.append(f"stationary for the first {made.rest:.4g} s, by the sensors and the fixes")
    return [*told, *others]


def _why(aid: Mapping[str, Any], made: Proposal) -> str:
    """Grounds of the table of another sensor."""
    said = (
        "Found in the recording. The standard deviation of a row: its scatter, and errors that "
        f"last: {LASTING_ERRORS[aid['kind']]}."
    )
    if "least_speed_m_per_s" in aid:
        said += " No speed is negative: slower ones may be of driving backwards, and are not used."
    if aid["kind"] != Heading.kind:
        return said
    if "heading_sd_deg" not in aid:
        said = (
            "Found in the recording, with the standard deviation of each row; "
            f"{LASTING_ERRORS[aid['kind']]} have errors that last longer."
        )
    for one in made.findings:
        if one.code == "navigation.baseline-angle":
            said += (
                f" axis_deg: headings less the course, ± {one.data['scatter']:.2g}° each, over "
                f"{one.data['duration']:.0f} s of driving straight. misalignment_sd_deg: as far as "
                "the unit may be turned in the vehicle."
            )
    return said


def _magnetic(found: Magnetic) -> str:
    if found.disturbed:
        (size, dip), (expected, steep) = found.measured, found.expected
        return (
            f"magnetometer: {size:.0f} µT at a dip of {dip:.0f}° at the start, where the Earth has "
            f"{expected:.0f} µT at {steep:.0f}°: iron is near, or its axes are others"
        )
    return (
        f"magnetometer: heading {found.heading_deg:.0f}° at the start, true, by a field like the "
        "Earth's"
    )


def _magnetometer(page: Page, found: Magnetic, folder: Path) -> None:
    """Write the table of a magnetometer as a comment: only a person knows what iron is near."""
    dated = f"of {found.year:.0f}" if found.dated else f"of {found.year:.0f}; the file has no date"
    page.say(
        "Is the magnetometer away from iron and currents that change? Then take the signs off. "
        f"field_ned_ut: the World Magnetic Model {dated}.",
    )
    _commented(page, "aiding.magnetometer", _magnetic_table(found, folder))


def _commented(page: Page, table: str, values: Mapping[str, Any]) -> None:
    """Write a table as a comment."""
    page.say(f"[{table}]", *(f"{key} = {toml_value(value)}" for key, value in values.items()))


def _arm(gnss: pd.DataFrame | None) -> str:
    """Consequence of a lever arm of zero; empty where fixes are coarse against a usual one."""
    sd = None if gnss is None else finer_than_arm(gnss)
    if sd is None:
        return ""
    return (
        "zero, as of an antenna on the sensors: measure it, forward, right, down; an arm of 1 m is "
        f"1 m of position that no bound has, beside fixes of ± {sd:.2g} m (1 sd)"
    )


def _with_remarks(page: Page) -> None:
    page.say(
        "lever_arm_m: of the antenna from the inertial sensors, forward, right, down; zero is "
        "assumed: measure it. time_offset_sd_s above zero: stamps may be off by it, and by how "
        "much is estimated. clock_unsure_s: times at which the receiver's clock may have stepped, "
        "each with a standard deviation; found where regular stamps change over an outage.",
        "position_correlated_share: part of the variance of each position that lasts for "
        "position_correlation_time_s; found where positions scatter less from fix to fix than they "
        "state. Without it bounds of position become too narrow with the number of fixes. "
        "position_sd_factor: on the stated standard deviations; found where the velocities show "
        "larger errors. float_position_sd_m: stated standard deviation from which a position is a "
        "float solution, with errors of its own. "
        "lever_arm_sd_m: a tape measure's; 0 for an arm that is known to a millimetre.",
    )


def _other(slot: Slot, kinds: Sequence[str]) -> list[str]:
    return [
        f"[aiding.{kind}] with {', '.join(o.key for o in options_of(slot.entries[kind])[1:5])}, …"
        for kind in kinds
        if kind in slot.entries
    ]


def _rest(page: Page, foot: bool, truth: str | None) -> None:
    page.table(
        "[output]",
        "Forms of the trajectory: csv, parquet, kml, geojson, gpx, geoparquet, nav, tum.",
    )
    page.key("files", '["csv", "kml", "geojson"]')
    page.blank()
    if truth is None:
        page.say("[truth] and path = …: a reference trajectory, to hold the answer beside")
    else:
        page.table("[truth]", "A reference trajectory, to hold the answer beside.")
        page.key("path", string(truth))
    if foot:
        page.say(
            "[control_points] and path = …: a table of time, north, east of places that it was at, "
            "in any level frame; an origin and a heading are fitted"
        )


# Foot-mounted pedestrian dead reckoning without GNSS: a path relative to its start.


#: Zero-velocity updates at stances. Their noise per sample is that of a swaying foot and a soft
#: sole, far beyond the sensor's. The threshold begins at ten times it, 10 deg/s and 1 m/s², and
#: adapts to separate stance from swing. A speed that the filter knows better than this rejects a
#: stance, unless none was seen for five seconds. During a stance the shoe rolls over its sole,
#: about the ground 0.1 m below the unit.
STANCE: dict[str, Any] = {
    "kind": "zero_velocity",
    "detector": "shoe",
    "window_s": 0.025,
    "threshold": 10.0,
    "threshold_rule": "otsu",
    "rate_sd_deg_per_s": 1.0,
    "force_sd_m_per_s2": 0.1,
    "interval_s": 0.02,
    "largest_speed_m_per_s": 0.5,
    "gate_time_s": 5.0,
    "sd_m_per_s": 0.02,
    "pivot_m": 0.1,
    "correlation_time_s": 0.1,
}
#: ZARU where the whole person is stationary: gyro bias, limited by the sway of the body.
STANDING: dict[str, Any] = {
    "kind": "zero_rate",
    "detector": "variance",
    "window_s": 0.4,
    "threshold": 3.0,
    "rate_sd_deg_per_s": 0.5,
    "force_sd_m_per_s2": 0.05,
    "interval_s": 0.4,
    "largest_speed_m_per_s": 0.2,
    "sd_deg_per_s": 0.3,
}
#: Rate and acceleration beyond which a foot has left its stance, rad/s and m/s².
LEAVES, PUSHES = math.radians(30.0), 2.0
#: The stance ends this long before the first such sample, s; least duration of a stance, s.
BEFORE, LEAST = 0.2, 0.3
#: Stance between two steps: least duration, and the rolling part at either end, s.
STEPPED, ROLLS = 0.2, 0.05
#: The alignment takes half of the initial stance, at most this, s; the other half gives the gyro
#: biases.
LONGEST = 10.0
#: Longest step of the covariance, s: in a swing of half a second a foot turns by 70 deg and back,
#: and steps of 0.1 s would assign sensor errors to wrong directions.
STEP = 0.02
#: Time, some strides, over which the filter's linearization holds, s.
BENT = 10.0
#: The position is relative to the start: initial uncertainty, m, m/s.
HERE, STILL = 0.01, 0.01
#: The heading is relative to the unit's direction at the start: initial uncertainty, deg.
FROM_START = 0.1


def first_stand(imu: pd.DataFrame) -> tuple[float, float] | None:
    """Find the first stationary interval of a unit on a shoe.

    Parameters
    ----------
    imu : DataFrame
        Imu table with specific force.

    Returns
    -------
    begin, length : float, s
        The start of the record, until it turns by 30 deg/s or feels 2 m/s² beyond gravity, less
        0.2 s; where that is less than 0.3 s, the first stance of 0.2 s or more, without 0.05 s at
        either end. None where there is none.
    """
    time = index_of(imu)
    rate = np.linalg.norm(values_of(imu, GYRO), axis=1)
    force: NDArray[np.float64] = np.linalg.norm(values_of(imu, ACCEL), axis=1)
    moves = (rate > LEAVES) | (np.abs(force - STANDARD_GRAVITY) > PUSHES)
    if not moves.any():
        return float(time[0]), float(time[-1] - time[0])
    length = float(time[np.argmax(moves)]) - BEFORE - float(time[0])
    if length >= LEAST:
        return float(time[0]), length
    rests = true_runs(~moves)
    begin, end = time[[run.start for run in rests]], time[[run.stop - 1 for run in rests]]
    stances = np.flatnonzero(end - begin >= STEPPED)
    if not stances.size:
        return None
    k = int(stances[0])
    return float(begin[k]) + ROLLS, float(end[k] - begin[k]) - 2.0 * ROLLS


def second_order(sensors: ImuUncertainty) -> float:
    """Second-order effect of a tilt that stationary accelerometers cannot observe.

    Returns
    -------
    float, m/s²
        ``sqrt(2) g sd²`` for a tilt of standard deviation sd: root mean square of
        ``g (x² + y²)/2``, the difference of gravity along a body tilted by x and y. Accelerometer
        biases estimated before the tilt is known, as it is at the first corner, are off by as much.
    """
    _, accel = resting_sd(sensors, (0.0, 0.0, 0.0), (0.0, 0.0, -STANDARD_GRAVITY))
    return math.sqrt(2.0) * STANDARD_GRAVITY * float(max(accel[:2]) / STANDARD_GRAVITY) ** 2


def on_foot(made: Proposal) -> Proposal:
    """Replace the proposal for a vehicle by that for a unit on a shoe.

    Raises
    ------
    DataError
        The log has no accelerometers, or the unit is never stationary in it.
    """
    if ACCEL[0] not in made.imu.columns:
        raise DataError("navigation.no-accelerometers", file=source_of(made.imu), quantity="accel")
    stand = first_stand(made.imu)
    if stand is None:
        raise DataError(
            "navigation.never-stationary",
            file=source_of(made.imu),
            quantity="accel",
            stepped=STEPPED,
        )
    begin, rest = stand
    late = begin - float(index_of(made.imu)[0])
    length = math.floor(10.0 * min(0.5 * rest, LONGEST)) / 10.0
    length = max(length, LEAST) if not late else rest
    # This noise is the motion of a foot, not the sensor's. Errors that depend on rate and force are
    # largest on a foot: a g-sensitivity of 0.1 deg/s/g turns a run by degrees.
    named = made.table.get("sensors", {}).get("sensor")
    sensors: dict[str, Any] = {}
    states = dict(made.table.get("states", {}))
    if named is not None:
        known = ImuUncertainty.of_sensor(load_sensor(named))
        names = states_that_are_stated(known)
        sensors = {"sensor": named, "states": names}
        drift = second_order(known)
        if drift > max(known.accel_drift.triad) and "accel_drift" in names:
            rounded = float(f"{drift / STANDARD_GRAVITY * 1e6:.2g}")
            states["accel_drift"] = {"sd_ug": rounded, "correlation_time_s": BENT}
    log = made.table["log"] | ({"from_s": round(begin, 6)} if late else {})
    table = {
        **made.table,
        "log": log,
        "sensors": sensors,
        **({"states": states} if states else {}),
        "coarse": {
            "kind": "known_heading",
            "heading_deg": 0.0,
            "sd_deg": FROM_START,
            "duration_s": round(length, 3),
        },
        "fine": {"kind": "none"},
        "filter": {"kind": "error_state", "step_s": STEP},
        "recorder": {"kind": "full"},
        "aiding": {
            **made.table.get("aiding", {}),
            "stance": dict(STANCE),
            "standing": dict(STANDING),
        },
    }
    where = "The heading is counted from where the unit then points: north of the answer is there"
    how = (
        f"stationary for the first {rest:.3g} s: leveled over half of that. {where}, unless you "
        "state another"
    )
    findings = made.findings
    if late:
        how = (
            f"it begins while it moves: all before its first stance, {late:.3g} s, is left out. It "
            f"is levelled by {rest:.2g} s of that. {where}, unless you state another"
        )
        findings = (
            *findings,
            Finding(
                "navigation.moves-at-start",
                file=source_of(made.imu),
                quantity="accel",
                late=late,
                rest=rest,
            ),
        )
    return replace(made, table=table, rest=rest, drives=False, how=how, findings=findings)

"""Propose a navigation pipeline from a log: sensor, rest, motion and alignment."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.lib.stride_tricks import sliding_window_view

from strapdown.alignment.alignment import Site
from strapdown.alignment.course_sums import Antenna
from strapdown.alignment.gnss_course import GnssCourse
from strapdown.alignment.inertial_frame import InertialFrame, fit_inertially, heading_rate
from strapdown.alignment.inertial_sums import sum_inertially
from strapdown.config.logs import AxesTable, FixesTable, LogTable
from strapdown.constants import DEG_PER_HOUR, STANDARD_GRAVITY, Array
from strapdown.errors import DataError, DivergenceError, Finding
from strapdown.formats.assemble import require_accel
from strapdown.formats.clocks import on_clock_of
from strapdown.formats.gnss_files import open_fixes, read_gnss
from strapdown.formats.gnss_fixes import USUAL_POSITION_SD
from strapdown.formats.recording import Recording, as_stated
from strapdown.frames import ways_between
from strapdown.navigation.measurements.clock_windows import (
    ClockStep,
    receiver_clock,
    stamp_step,
    step_finding,
    unsure_steps,
    window_offsets,
)
from strapdown.navigation.measurements.gnss import LASTING
from strapdown.navigation.measurements.gnss_clock import (
    TimeOffset,
    check_overlap,
    sure_delay,
)
from strapdown.navigation.measurements.gnss_course import check_forward, check_turns
from strapdown.navigation.measurements.gnss_readiness import (
    check_fixes,
    float_position_sd,
    lasting_position_sd,
    white_position_sd,
    white_velocity_sd,
    without_repeats,
)
from strapdown.navigation.navigator import Warming
from strapdown.progress import Progress, silent
from strapdown.sensors.catalogue import ALLAN_OF_GAUSS_MARKOV, load_sensor
from strapdown.sensors.rest import LEAST_LENGTH, find_rests_of_every_grade
from strapdown.sensors.uncertainty import (
    UNIT_FACTOR,
    ImuUncertainty,
    TriadUncertainty,
    stated_imu,
)
from strapdown.systems.alignment_source import body_record, gyro_unit_by_turns
from strapdown.systems.named_sensor import unlike_sensor
from strapdown.systems.navigation_checks import ARM_SD
from strapdown.systems.one_thread import one_thread
from strapdown.tables import ACCEL, GEODETIC, GYRO, POSITION_SD, VELOCITY_SD
from strapdown.tables import VELOCITY as VELOCITY_COLUMNS
from strapdown.tables.checks import ORIGIN_STATED, index_of, values_of

#: Windows in which noise is measured, s; the share taken as the quiet one, and left out as loudest.
WINDOW, QUIET = 2.0, 0.05
#: Ratio to the data-sheet noise beyond which a triad's measured noise is stated instead.
LOUD = 3.0
#: Longest average by which noise is measured, s: over longer ones the body moves. And that by which
#: vibration is: over longer ones a vehicle does, on its springs. And the shortest that has all of
#: the noise: the filter of a sensor leaves less of it in the samples of a faster log.
SLOWEST, FAST, FILTERED = 0.16, 0.02, 0.01
#: Shaking that gyros rectify, or that folds down between their samples, drifts: its standard
#: deviation as a share of that of the samples, and over what time, s. Of 4 deg/s of a car's engine
#: 0.2 deg/s were seen beside RTK.
RECTIFIED, SHAKEN = 0.05, 5.0
DRIFT_KEYS = ("bias_instability_deg_per_h", "random_walk_deg_per_h_per_sqrt_h")
NOISE_KEYS = (
    ("gyro", "noise_density_deg_per_sqrt_h", math.radians(1.0) / 60.0),
    ("accel", "noise_density_ug_per_sqrt_hz", 1e-6 * STANDARD_GRAVITY),
)
#: Speed below which a vehicle is stationary, and above which its course is observable, m/s.
STANDS, DRIVES = 0.5, 3.0
#: Distance between positions, in standard deviations, that proves motion: four of a hundred
#: thousand pairs of positions at rest exceed it, exp(-APPARENT**2 / 2).
APPARENT = 4.5
#: Velocities whose mean shows motion.
TOGETHER = 5
#: Fixes that begin later than so many of their intervals do not show what was before.
UNSEEN = 3.0
#: Gyro bias that allows gyrocompassing, the rest needed for it, and the longest that is used, s.
NORTH, LEAST_REST, LONGEST_REST = 2.0 / DEG_PER_HOUR, 60.0, 600.0
#: Findings of a rest that does not give the heading.
NO_NORTH = ("alignment.no-north", "alignment.no-north-near-pole")
#: Grades by the noise of the quietest gyro, rad/s/√Hz: the best consumer part of the catalogue has
#: 0.168 deg/√h, the best calibrated MEMS unit 0.1 deg/√h; a little less counts as the same.
NOISE_OF_GRADES = (
    ("tactical-grade", math.radians(0.06) / 60.0),
    ("industrial-grade", math.radians(0.13) / 60.0),
    ("consumer-grade", math.inf),
)
#: The grade above: of a noise below that of all tactical units (0.012 deg/√h of those with good
#: fibre-optic gyros), whose rest shows a bias below theirs (1 deg/h, Groves 2013, Table 4.1). Noise
#: alone does not show it: a filtered or simulated sensor may have any.
FINEST, FINEST_NOISE, FINEST_BIAS = (
    "intermediate-grade",
    math.radians(0.01) / 60.0,
    1.0 / DEG_PER_HOUR,
)
#: Scale factors of an unknown unit of these grades follow its temperature, over the time in which
#: it takes that of its surroundings: as constants an hour of good fixes makes them surer than they
#: stay.
SCALED, SCALES = (FINEST, "tactical-grade"), {"correlation_time_s": 3600.0}
#: Change of the biases of a grade while the unit warms up: gyros, deg/h, and accelerometers, µg.
#: Data sheets state 0.005 to 0.05 deg/s/K and 0.1 to 1 mg/K for consumer parts (ICM-42688-P,
#: LSM6DSO, BMI160), a third for industrial ones; assumed: a unit becomes 3 to 5 K warmer.
#: And the time in which most of that happens, s.
WARMING = {"phone": (180.0, 1000.0), "industrial": (54.0, 400.0)}
WARM = 400.0
NO_ERRORS = ImuUncertainty(TriadUncertainty(), TriadUncertainty())
#: Longest rest used for a coarse alignment, s.
COARSE = 100.0
#: Levelling for a heading that is asked: the longest, s, and that of a body in motion, which may
#: turn meanwhile.
LEVELLED, LEVELLED_IN_MOTION = 10.0, 2.0
#: Steps of a walk, by the standard deviation of the size of the specific force, m/s², of means over
#: so long, s, through which an engine does not shake.
STEPS, STEADY = 0.5, 0.1
#: Part of a sensor's bias below which that by the turns of a record is stated.
CLEARLY = 0.5
#: Standard deviations that end an alignment by course, deg: of the tilt; and of the heading, which
#: has that of the mounting of the unit, 5 deg, besides.
WELL, HEADING = 3.0, 6.0
#: Trials of it: factor of the length from trial to trial, margin over them, as arm and standard
#: deviations that are answered later change it, and the largest standard deviation that is not too
#: large for a linear filter, deg.
LATER, MARGIN, LARGEST_START = 1.15, 2.0, 15.0
#: Longest part of a record to align by course as a whole, s, so that navigation begins with it; the
#: least one, and how much later than possible.
MOST_BACK, LEAST_BACK, MORE = 300.0, 60.0, 30.0
#: Rules that give gross errors zero weight keep their accuracy among them; with its scale this one
#: cannot reject for ever. Time-correlated errors make innovations small, which does not show a
#: receiver better than stated.
RULE = {"kind": "adaptive", "influence": "igg3", "scale": {"lowest": 1.0}}
#: Fixes without stated standard deviations: a code receiver without corrections, m and m/s.
CODE_POSITION_SD, CODE_VELOCITY_SD = USUAL_POSITION_SD[1], 0.3
#: Standard deviation of the offset between receiver stamps and sensor clock, s: search range.
OFFSET_SD = 0.2
#: A significant delay of velocities is used beyond this time, s; an offset of stamps beyond so many
#: standard deviations and this time; the filter then estimates it from this standard deviation, s,
#: at least.
LEAST_DELAY = 0.01
SIGNIFICANT, LEAST_OFFSET, LEAST_OFFSET_SD = 3.0, 0.01, 0.05
#: An offset that is not significant is a state where its uncertainty times the speed exceeds the
#: standard deviation of the positions so many times.
FAR = 3.0
#: Distance to a step of a clock, s.
ASIDE = 2.0
#: Stamps with an offset come from another clock, and two quartz clocks drift apart by 50 ppm:
#: a random walk of this many s/√s over 400 s, during which the offset may be unobservable.
APART = 1e-3
#: Relative rate of two quartz clocks, at most, where the record does not show a smaller one; one
#: below the other is not estimated where it is not significant.
QUARTZ, FEW = 5e-5, 1.5e-5
#: Share of the variance of positions that lasts from fix to fix: proposed from the first on, and at
#: most. Where standard deviations are assumed, or contradicted by the scatter: that of fixes that
#: scatter like those of a code receiver, and of others; the scatter, m, that separates them.
LASTS, LASTS_MOST = 0.5, 0.9
LASTS_BY_CODE, LASTS_BY_PHASE, PHASE = 0.9, 0.5, 0.05
#: Standard deviation, m, of positions of the latter while none is stated: of a float solution.
FLOATING = 0.3
#: The least share that is proposed where velocities show what lasts; the factor of the standard
#: deviations from which a receiver understates its errors, and beyond which it has others.
SHOWN, UNDERSTATED, MISSTATED = 0.15, 1.5, 10.0
#: Standard deviations of a share by which it must differ from zero, and its variance times the
#: number of fixes: twice the sum of the squared autocorrelations of third differences, 2.31, over
#: two components.
SHARE_SD, SCATTER = 3.0, 2.31
#: Jerk of a vehicle, m/s³, that is not to be taken for scatter.
JERK = 3.0
#: Fixes better than this, m, show that a lever arm is measured by a tape. Velocities do where the
#: body turns: its rate without vibration, by means over so many seconds.
SHOWS_ARM, TURNING = 0.1, 0.2
#: Standard deviation of a place that is stated for velocities alone, m, as one reads it off a map.
ORIGIN_SD = 10.0
#: Attributes of fixes with assumed standard deviations, and the keys of these.
TAKEN = {"position_sd_taken": "position_sd_m", "velocity_sd_taken": "velocity_sd_m_per_s"}


@dataclass(frozen=True, eq=False)
class Proposal:
    """Proposed configuration as plain data, with its grounds.

    Attributes
    ----------
    table : dict
        Of a navigation run; questions to the user have no key.
    imu : DataFrame
        Imu table, body axes.
    gnss : DataFrame or None
        Gnss table, on the clock of the samples.
    rest : float, s
        How long the vehicle is stationary at the start, by all sensors.
    noise : tuple of float, (2,), or None
        Of the gyros in rad/s/√Hz, of the accelerometers in m/s²/√Hz, while it is quiet.
    shaken : tuple of str
        Triads whose stated noise is that of vibration.
    guessed : bool
        Whether the sensor is only a grade, by its noise.
    drives : bool
        Whether it drives fast enough for a course, by the fixes.
    how : str
        Reason for the alignment, in words.
    findings : tuple of Finding
        Findings of reading.
    """

    table: dict[str, Any]
    recording: Recording
    imu: pd.DataFrame
    gnss: pd.DataFrame | None
    rest: float
    noise: tuple[float, ...] | None
    shaken: tuple[str, ...]
    guessed: bool
    drives: bool
    how: str
    findings: tuple[Finding, ...]


@one_thread()
def propose(
    log: LogTable,
    *,
    axes: str | None = None,
    gnss: FixesTable | None = None,
    sensor: str | None = None,
    site: tuple[float, float, float] | None = None,
    heading_deg: float | None = None,
    progress: Progress = silent,
) -> Proposal:
    """Propose how to navigate with a log and its fixes.

    Parameters
    ----------
    log : LogTable
        With a path that can be opened.
    axes : str, optional
        Orientation of the sensor's axes, as `AxesTable.axes`.
    gnss : FixesTable, optional
        The fixes, and statements about them; by default the log itself, if it has fixes. Where
        standard deviations are not stated, those of a code receiver are taken.
    sensor : str, optional
        A sensor of the catalogue, or a file; a grade by the noise, if not given.
    site : tuple of float, optional
        Latitude and longitude in deg, height in m; that of the fixes, or of the log, if not given.
    heading_deg : float, optional
        Heading of the body at the start.
    progress : callable, optional
        Called with a stage and the share that is done.
    """
    progress("reading", 0.1)
    try:
        recording, imu, findings = body_record(log, AxesTable(axes=axes))
    except DataError as error:
        raise _answered_by_turns(error, log, axes, gnss) from None
    require_accel(recording)
    table: dict[str, Any] = {"log": log.model_dump(exclude_none=True), "axes": {"axes": axes}}
    fixes = None
    opened = open_fixes(log.path) if gnss is None else None
    if opened is not None:
        gnss = FixesTable(path=log.path)
    if gnss is not None:
        fixes, shifted = _fixes(gnss, opened, recording)
        findings = (*findings, *fixes.attrs["findings"], *([shifted] if shifted else []))
        fixes, repeats = without_repeats(fixes)
        findings = (*findings, *repeats)
        # Refuse before a file is written whatever the run would refuse.
        check_fixes(fixes)
        check_overlap(fixes, imu, 0.0)
        findings = (*findings, *check_turns(fixes, imu))
    place, start = site, recording.start
    if not place and start is not None:
        place = (start.lat_deg, start.lon_deg, start.alt)
    placed = fixes is None or ORIGIN_STATED not in fixes.attrs
    if not placed and site is None:
        assert fixes is not None
        lat, lon, alt = values_of(fixes, GEODETIC)[0].tolist()
        place = (lat, lon, alt)
    if place is not None:
        table["site"] = dict(zip(("lat_deg", "lon_deg", "alt_m"), place, strict=True))
        if not placed:
            table["site"]["position_sd_m"] = ORIGIN_SD
    progress("finding rests and noise", 0.3)
    until, drives = _motion(imu, fixes)
    quiet = _quiet(imu, until)
    scatter = _scatter(imu)
    # Engine vibration differs between axes; the quietest axis identifies the grade.
    noise = None if scatter is None else tuple(scatter.quiet.min(axis=1).tolist())
    guessed = sensor is None
    sensors: ImuUncertainty | None = None
    shaken: tuple[str, ...] = ()
    if sensor is not None or scatter is not None:
        bias = _rest_bias(imu, _rest(quiet, until, rocks=True), place, fixes)
        table["sensors"], shaken = _sensors(sensor, scatter, bias)
        sensors = _stated(table)
        if table["sensors"]["sensor"] in SCALED:
            table["states"] = {name: dict(SCALES) for name in ("gyro_scale", "accel_scale")}
    if sensor is not None and sensors is not None:
        known_place = None if place is None and fixes is None else _site(place, fixes)
        findings = (*findings, *unlike_sensor(imu, quiet, sensor, sensors, known_place))
    rest = _rest(quiet, until, rocks=sensors is not None and _finds_north(sensors))
    if sensors is not None and rest < LEVELLED_IN_MOTION:
        # Nothing else says that a unit is better than its data sheet allows: by 20 deg/s the
        # heading of a walk is open within seconds, and no linear filter finds it again.
        turns = _bias_by_turns(imu)
        if turns < CLEARLY * max(sensors.gyro.axis("bias")):
            gyro = table["sensors"].get("gyro", {})
            rate = float(f"{turns * DEG_PER_HOUR:.2g}")
            table["sensors"]["gyro"] = {**gyro, "bias_sd_deg_per_h": rate}
            sensors = _stated(table)
    span = float(imu.index[-1] - imu.index[0])
    measured = fixes is not None and np.isfinite(values_of(fixes, VELOCITY_SD[:2])).any()
    levelled = _levelled(imu, rest, until)
    chosen, how = _alignment(
        sensors, rest, drives, heading_deg, span, levelled, velocities=bool(measured)
    )
    if chosen["coarse"]["kind"] == "inertial_frame" and not (place is None and fixes is None):
        assert sensors is not None  # or no rest would do
        no_north = _no_north(imu, _site(place, fixes), sensors, chosen["coarse"]["duration_s"])
        if no_north is not None:
            findings = (*findings, no_north)
            chosen, how = _alignment(
                sensors, 0.0, drives, None, span, levelled, velocities=bool(measured)
            )
    clock: dict[str, Any] = {}
    if fixes is not None:
        assert gnss is not None  # whence the fixes are
        progress("comparing the clocks of fixes and samples", 0.5)
        clock, step = _clock(fixes, imu, drives, sensors)
        if step is not None:
            found = step_finding(fixes, imu, step, corrected=step.certain)
            findings = (*findings, found)
        if step is not None and (step.certain or drives):
            part = log if step.certain else _longer_part(log, imu, found)
            if step.certain:
                moved = 0.0 if shifted is None else shifted.data["shift"]
                gnss = _corrected(gnss, step, moved)
            made = propose(
                part,
                axes=axes,
                gnss=gnss,
                sensor=sensor,
                site=site,
                heading_deg=heading_deg,
                progress=progress,
            )
            return replace(made, findings=(*made.findings, found))
        if step is not None:
            # Where a heading is asked, it is that at the first sample: the whole record is used.
            clock["time_offset_sd_s"] = max(clock.get("time_offset_sd_s", 0.0), abs(step.size))
        if step is None and (unsure := unsure_steps(fixes)) and clock.get("time_offset_sd_s"):
            clock["clock_unsure_s"] = tuple((round(at, 3), sd) for at, sd in unsure)
    if fixes is not None and chosen["coarse"]["kind"] == "gnss_course":
        findings = (*findings, *check_forward(fixes, imu))
    if fixes is not None and sensors is not None and chosen["coarse"]["kind"] == "gnss_course":
        progress("trying alignments", 0.7)
        known = sensors, _as_warming(table["sensors"].get("warming"))
        chosen, how, tried = _tried(chosen, how, imu, fixes, known, levelled, clock)
        findings = (*findings, *tried)
    table |= chosen
    if fixes is not None:
        assert gnss is not None
        table["aiding"] = {
            "gnss": {
                "kind": "gnss",
                **gnss.model_dump(exclude_defaults=True),
                "lever_arm_m": (0.0, 0.0, 0.0),
                "update_rule": RULE,
                **{k: fixes.attrs[taken] for taken, k in TAKEN.items() if taken in fixes.attrs},
                **clock,
            }
        }
    return Proposal(
        table, recording, imu, fixes, rest, noise, shaken, guessed, drives, how, findings
    )


def _fixes(
    gnss: FixesTable, opened: Any, recording: Recording
) -> tuple[pd.DataFrame, Finding | None]:
    """Read fixes onto the clock of a log, with the errors of a code receiver where none are stated.

    `opened`: as of `read_gnss`.
    """
    asked = replace(
        gnss.options(),
        unstated_position_sd=CODE_POSITION_SD,
        unstated_velocity_sd=CODE_VELOCITY_SD,
    )
    return on_clock_of(read_gnss(gnss.path, asked, opened), recording.imu)


def _answered_by_turns(
    error: DataError, log: LogTable, axes: str | None, gnss: FixesTable | None
) -> DataError:
    """Answer the unit of the gyro, where the log leaves it open, by the turns of the fixes.

    Returns the same error if the turns do not show it.
    """

    def fixes_of(recording: Recording) -> pd.DataFrame:
        opened = open_fixes(log.path) if gnss is None else None
        return _fixes(gnss or FixesTable(path=log.path), opened, recording)[0]

    refused = error.finding
    unit = gyro_unit_by_turns(log, AxesTable(axes=axes), refused, fixes_of)
    if unit is None:
        return error
    said = as_stated({**dict(refused.data["answers"]), "gyro_unit": str(unit.data["unit"])})
    questions = refused.data.get("questions") or (refused,)
    asked = tuple(unit if one.quantity == "gyro" else one for one in questions)
    return (
        DataError(unit, **said)
        if len(asked) == 1
        else DataError(error.finding, **said, questions=asked)
    )


def _stated(table: dict[str, Any]) -> ImuUncertainty:
    """Uncertainty of the sensors in a proposed table."""
    stated = table["sensors"]
    return stated_imu(
        load_sensor(stated["sensor"]),
        stated.get("gyro", {}),
        stated.get("accel", {}),
        unit_factor=stated.get("unit_factor", 1.0),
    )


def _corrected(gnss: FixesTable, step: ClockStep, moved: float) -> FixesTable:
    """Fixes with a step of their clock corrected; `moved`: their time minus that of the file, s."""
    at = round(0.5 * (step.after + step.before) - moved, 6)
    steps = (*gnss.clock_steps_s, (at, round(step.size, 6)))
    return gnss.model_copy(update={"clock_steps_s": steps})


def _longer_part(log: LogTable, imu: pd.DataFrame, step: Finding) -> LogTable:
    """The longer part of a log before or after a step of a clock."""
    time = index_of(imu)
    before, after = step.data["begin"] - ASIDE, step.data["end"] + ASIDE
    if before - time[0] >= time[-1] - after:
        return log.model_copy(update={"to_s": round(before, 3), "duration_s": None})
    to = log.to_s if log.duration_s is None else float(time[-1])
    return log.model_copy(update={"from_s": round(after, 3), "to_s": to, "duration_s": None})


class Scatter(NamedTuple):
    """How rates and forces scatter: gyros in rad/s, accelerometers in m/s², (2, 3) by axis.

    Attributes
    ----------
    quiet : ndarray, per √Hz
        Density while it is quiet.
    loud : ndarray, per √Hz
        Largest density over the record of what is faster than `FAST`: with vibration.
    white : ndarray, per √Hz
        The part that may be white: the least density over averages of `FILTERED` to `SLOWEST`.
    shaking : ndarray
        Standard deviation of what is faster than `FAST`.
    """

    quiet: Array
    loud: Array
    white: Array
    shaking: Array


def _scatter(imu: pd.DataFrame) -> Scatter | None:
    """Noise of the sensors and its part by vibration; None without any, or of a short record.

    A spectrum that rises to some frequencies is not that of white noise, whose density is the
    least of all: the densities are those of Hadamard variances (second differences of means)
    over 1, 2, 4 … samples.
    """
    time = index_of(imu)
    if ACCEL[0] not in imu.columns or len(time) < 64:
        return None
    step = float(np.median(np.diff(time)))
    size = max(16, round(WINDOW / step))
    count = len(time) // size
    if count < 3:
        return None
    quiet, loud, white, shaking = np.zeros((4, 2, 3))
    white[:] = np.inf
    for k, columns in enumerate((GYRO, ACCEL)):
        means, interval = values_of(imu, columns), step
        octaves = 1 + max(0, int(math.log2(SLOWEST / step)))
        for octave in range(octaves):
            if octave:
                means = means[: len(means) // 2 * 2].reshape(-1, 2, 3).mean(axis=1)
                interval *= 2.0
            # Second differences remove rotation and acceleration: of white noise they have six
            # times its variance.
            second = np.diff(means, n=2, axis=0)
            each = max(8, size >> octave)
            second = second[: len(second) // each * each].reshape(-1, each, 3)
            sd = np.sqrt(np.square(second).mean(axis=1) / 6.0)
            # Errors grow by the mean of variances, also of a record that rests most of the time;
            # without the largest: a door that shuts is no noise of the drive.
            few = np.sort(sd, axis=0)[: len(sd) - int(QUIET * len(sd))]
            over = np.sqrt(np.square(few).mean(axis=0))
            if not octave:
                quiet[k] = math.sqrt(interval) * np.quantile(sd, QUIET, axis=0)
            if not octave or interval <= FAST:
                shaking[k] = np.maximum(shaking[k], over)
                loud[k] = np.maximum(loud[k], math.sqrt(interval) * over)
            if interval > 0.99 * FILTERED or octave + 1 == octaves:
                white[k] = np.minimum(white[k], math.sqrt(interval) * over)
    # The noise of sensors that shake throughout is no more than what may be white.
    return Scatter(np.minimum(quiet, white), loud, white, shaking) if quiet.min() > 0.0 else None


def _sensors(
    named: str | None, scatter: Scatter | None, bias: float | None
) -> tuple[dict[str, Any], tuple[str, ...]]:
    """Sensor to state: the one that is named, or the grade that the noise allows; shaken triads.

    `bias`: of the gyros by a rest, as of `_rest_bias`. The noise is measured where it exceeds the
    data sheet's; of a grade it always is. Where the body shakes, the gyros drift by it, too, and
    the drift of the data sheet is a walk of the bias.
    """
    # The figures of a grade are those of all units of all its types.
    out: dict[str, Any] = {"sensor": named, "unit_factor": round(UNIT_FACTOR, 2)}
    if named is None:
        del out["unit_factor"]
        assert scatter is not None
        noise = float(min(scatter.quiet[0]))
        out["sensor"] = next(name for name, most in NOISE_OF_GRADES if noise < most)
        if bias is not None and bias < FINEST_BIAS and noise < FINEST_NOISE:
            out["sensor"] = FINEST
    known = ImuUncertainty.of_sensor(load_sensor(out["sensor"]))
    # For gyrocompassing gyros the rocking of a vehicle is motion, not noise.
    north = _finds_north(known) or (named is None and bias is not None and bias <= NORTH)
    if scatter is None:
        return out | ({} if north else _warming(out["sensor"])), ()
    shaken: tuple[str, ...] = ()
    for (triad, key, unit), quiet, loud, white in zip(NOISE_KEYS, *scatter[:3], strict=True):
        sheet = np.asarray(getattr(known, triad).axis("noise_density"))
        stated = quiet if named is None else np.maximum(quiet, sheet)
        if not north and (loud > LOUD * stated).any():
            stated, shaken = np.maximum(white, stated), (*shaken, triad)
        if (stated != sheet).any():
            out[triad] = {key: tuple(float(f"{x:.2g}") for x in stated / unit)}
    drift, factor = known.gyro_drift, 1.0
    largest = max(known.gyro.axis("bias"))
    if named is None and bias is not None and bias < largest:
        factor = bias / largest
        slow = max(drift.triad) * factor * ALLAN_OF_GAUSS_MARKOV
        out["gyro"] = out.get("gyro", {}) | {
            "bias_sd_deg_per_h": float(f"{bias * DEG_PER_HOUR:.2g}"),
            "bias_instability_deg_per_h": float(f"{slow * DEG_PER_HOUR:.2g}"),
        }
    if "gyro" in shaken:
        # Over less than its correlation time the drift of the data sheet is a walk.
        driven = factor * math.sqrt(2.0 / drift.correlation_time) * np.asarray(drift.triad)
        walk = 60.0 * np.hypot(driven, drift.steps)
        drifts = RECTIFIED * ALLAN_OF_GAUSS_MARKOV * scatter.shaking[0]
        out["gyro"] = (
            out.get("gyro", {})
            | {
                key: tuple(float(f"{x * DEG_PER_HOUR:.2g}") for x in size)
                for key, size in zip(DRIFT_KEYS, (drifts, walk), strict=True)
            }
            | {"correlation_time_s": SHAKEN}
        )
    return (out if north else out | _warming(out["sensor"])), shaken


def _warming(named: str) -> dict[str, Any]:
    """Change of the biases of a sensor whose grade warms up: the unit may not be warm yet."""
    if (sds := WARMING.get(load_sensor(named).grade)) is None:
        return {}
    return {"warming": {"gyro_sd_deg_per_h": sds[0], "accel_sd_ug": sds[1], "time_s": WARM}}


def _as_warming(stated: dict[str, float] | None) -> Warming | None:
    """Change of the biases by the keys of `_warming`, in SI."""
    if stated is None:
        return None
    gyro = stated["gyro_sd_deg_per_h"] / DEG_PER_HOUR
    return Warming(gyro, 1e-6 * STANDARD_GRAVITY * stated["accel_sd_ug"], stated["time_s"])


def _rest_bias(
    imu: pd.DataFrame,
    rest: float,
    place: tuple[float, float, float] | None,
    fixes: pd.DataFrame | None,
) -> float | None:
    """Standard deviation of the gyro biases that a rest allows, rad/s; None without a long rest.

    Against the Earth's rate two components of the bias are observable: along the vertical, and
    north. For a standard deviation b their squares have the sum ``b² χ²`` with two degrees of
    freedom, which exceeds 0.103 with a probability of 0.95. A rotation of the body about the
    vertical counts as bias.
    """
    if rest < LEAST_REST or (place is None and fixes is None):
        return None
    site = _site(place, fixes)
    begin = float(imu.index[0])
    sums = sum_inertially(imu[imu.index <= begin + min(rest, LONGEST_REST)])
    fit = fit_inertially(sums, site)
    vertical, _ = heading_rate(sums, fit.C_nb, site, NO_ERRORS)
    # Of the horizontal rate w cos(lat), by the latitude that it seems to be.
    north = float(site.earth_rate[2]) * fit.latitude_change
    return math.hypot(vertical, north) / math.sqrt(-2.0 * math.log(0.95))


def _site(place: tuple[float, float, float] | None, fixes: pd.DataFrame | None) -> Site:
    """Site that is stated, or of the first fixes."""
    if place is None:
        assert fixes is not None
        lat, lon, alt = np.nanmedian(values_of(fixes, GEODETIC)[:10], axis=0).tolist()
        place = (lat, lon, alt)
    return Site(*place)


def _no_north(
    imu: pd.DataFrame, site: Site, sensors: ImuUncertainty, length: float
) -> Finding | None:
    """Reason for which a rest of so many seconds does not give the heading, if it does not.

    Biases that are small are not enough where the body vibrates, or where the sensors have other
    errors at rest.
    """
    try:
        InertialFrame("end").align(imu[imu.index <= imu.index[0] + length], site, sensors)
    except DataError as error:
        if error.finding.code not in NO_NORTH:
            return None  # the run refuses what cannot be helped by another alignment
        return error.finding
    return None


def _quiet(imu: pd.DataFrame, until: float) -> list[tuple[float, float]]:
    """Begin and end of each quiet stretch until the fixes prove motion, s from the first sample."""
    first = float(imu.index[0])
    part = imu[index_of(imu) <= first + until]
    found = find_rests_of_every_grade(part) if len(part) > 1 else ()
    return [(one.start - first, one.end - first) for one in found]


def quiet_at_start(imu: pd.DataFrame, fixes: pd.DataFrame | None) -> list[tuple[float, float]]:
    """Begin and end of each quiet stretch until the fixes prove motion, s from the first sample.

    Parameters
    ----------
    imu : DataFrame
        Imu table.
    fixes : DataFrame, optional
        Gnss table on its clock; without it the sensors alone show a rest.
    """
    return _quiet(imu, _motion(imu, fixes)[0])


def _rest(quiet: Sequence[tuple[float, float]], until: float, *, rocks: bool) -> float:
    """Length of the initial rest in s, in which gyros and accelerometers agree with the fixes.

    `quiet`: as of `_quiet`. `until` (s from the first sample): when the fixes prove motion, which
    positions do late. `rocks`: gyros find north on a body that rocks; it is at rest until its last
    quiet stretch, or until the fixes prove motion if it has none.
    """
    if rocks:
        return max((end for _, end in quiet), default=until)
    ends = 0.0
    for begin, end in quiet:
        if begin - ends > LEAST_LENGTH:
            break
        ends = end
    return ends


def _motion(imu: pd.DataFrame, fixes: pd.DataFrame | None) -> tuple[float, bool]:
    """When fixes first prove motion, s, and whether it then is fast enough for a course."""
    time = index_of(imu)
    if fixes is None:
        return float(time[-1] - time[0]), False
    at = index_of(fixes)
    within = (at >= time[0]) & (at <= time[-1])
    if within.sum() < 2:
        return 0.0, False
    begins, fastest = first_motion(fixes[within])
    rest = float((at[within][begins] if begins is not None else time[-1]) - time[0])
    first = float(at[within][0])
    if begins == 0:
        rest = 0.0
    elif first - time[0] > UNSEEN * float(np.median(np.diff(at[within]))):
        # Before the first fix the sensors alone show a rest.
        still = find_rests_of_every_grade(imu.loc[:first])
        seen = any(one.start <= time[0] + 1.0 and one.end >= first - 1.0 for one in still)
        rest = rest if seen else 0.0
    return max(rest, 0.0), fastest > DRIVES


def first_motion(fixes: pd.DataFrame) -> tuple[int | None, float]:
    """Begin of the first motion, and the greatest significant speed over ground.

    Where the receiver measures no speed: the distance between two positions minus that explained
    by their errors, over 1, 2, 4 … steps, since one step may be shorter than the errors.
    """
    measured = np.isfinite(values_of(fixes, VELOCITY_SD[:2])).all(axis=1)
    velocity = values_of(fixes, VELOCITY_COLUMNS)[measured, :2]
    speed, sd = np.linalg.norm(velocity, axis=1), values_of(fixes, VELOCITY_SD[:2])[measured]
    begins, count = None, min(TOGETHER, len(speed))
    if count:
        # Single velocities scatter: a phone's at rest by half a metre a second.
        mean = sliding_window_view(velocity, count, axis=0).mean(axis=2)
        noise = APPARENT * sd[count - 1 :].max(axis=1) / math.sqrt(count)
        moves = np.linalg.norm(mean, axis=1) > np.maximum(STANDS, noise)
        moving = np.flatnonzero(measured)[np.flatnonzero(moves) + count // 2]
        begins = int(moving[0]) if moving.size else None
    fastest = float(speed.max(initial=0.0))
    if measured.all():
        return begins, fastest
    time = index_of(fixes)
    lat, lon, _ = np.radians(values_of(fixes, GEODETIC)).T
    sd = values_of(fixes, POSITION_SD)[:, :2].max(axis=1)
    scatter = white_position_sd(fixes) if "position_sd_taken" in fixes.attrs else None
    # Where a kind of fix says so, it has been taken for a phase solution.
    if scatter is not None and scatter[0] < PHASE and sd.min() > FLOATING:
        sd = np.minimum(sd, FLOATING)
    steps = 1
    while steps < len(time):
        north = (lat[steps:] - lat[:-steps]) * 6.37e6
        east = (lon[steps:] - lon[:-steps]) * 6.37e6 * np.cos(lat[steps:])
        blur = APPARENT * np.hypot(sd[steps:], sd[:-steps])
        least = (np.hypot(north, east) - blur) / (time[steps:] - time[:-steps])
        fastest = max(fastest, float(least.max()))
        moving = np.flatnonzero(least > STANDS)
        # Motion found over a shorter span is found by a longer one with some of the rest before it.
        if moving.size and (begins is None or moving[0] + steps <= begins):
            begins = int(moving[0])
        steps *= 2
    return begins, fastest


def _clock(
    fixes: pd.DataFrame, imu: pd.DataFrame, drives: bool, sensors: ImuUncertainty | None = None
) -> tuple[dict[str, Any], ClockStep | None]:
    """Errors of positions, significant delays of velocities and stamps, and a step of a clock.

    An offset is a state of the filter where it is significant, and where its uncertainty moves the
    vehicle by far more than the standard deviation of its fixes.
    """
    windows = None
    if drives and sensors is not None:
        windows = partial(window_offsets, fixes, imu, sensors)
    begin, end = np.searchsorted(index_of(fixes), index_of(imu)[[0, -1]])
    step = stamp_step(fixes[begin:end], windows)
    speed, place_sd = _speed(fixes), float(np.median(values_of(fixes, POSITION_SD)[:, :2]))
    # What may be a step costs no part of the record where it moves the vehicle by less than fixes.
    if step is not None and (step.certain or abs(step.size) * speed > place_sd):
        return _position_errors(fixes, 0.0), step
    delay = sure_delay(fixes)
    out = _receiver_errors(fixes, imu, delay)
    if "position_sd_taken" in fixes.attrs and (scatter := white_position_sd(fixes, delay)):
        place_sd = min(place_sd, scatter[0])  # where nothing is stated
    span = float(index_of(fixes)[-1] - index_of(fixes)[0])
    apart, drift = QUARTZ, None
    known = sensors if drives else None
    found, offsets = receiver_clock(fixes, imu, known, _antenna(out, delay))
    if offsets is not None:
        step = offsets.step()
        if step is not None:
            return out, step
        drift = offsets.drift()
    if drift is not None:
        apart = min(math.hypot(*drift), QUARTZ)
        apart = apart if abs(drift[0]) > SIGNIFICANT * drift[1] or apart > FEW else 0.0
    # A random walk that goes as far as the drift.
    walk = {}
    if 0.5 * apart * span * speed > FAR * place_sd:
        walk = {"time_offset_drift_s_per_sqrt_s": float(f"{apart * math.sqrt(span):.1g}")}
    # Of what drives, windows show the offset; of a walk, turns and steps do, to its velocities.
    slow = 0.0 if drives and math.isfinite(place_sd) else _change_in_sd(fixes)
    if found is None:
        if drives or speed * OFFSET_SD > FAR * place_sd or slow * OFFSET_SD > FAR:
            out |= {"time_offset_sd_s": OFFSET_SD} | walk
        return out, None
    offset, sd = found.offset, found.sd
    if abs(offset) > max(SIGNIFICANT * sd, LEAST_OFFSET):
        out |= {"time_offset_s": round(offset, 3)}
        out |= {"time_offset_sd_s": round(max(2.0 * sd, LEAST_OFFSET_SD), 3)}
        return out | {"time_offset_drift_s_per_sqrt_s": APART}, None
    if walk or speed * sd > FAR * place_sd or slow * sd > FAR:
        out |= {"time_offset_sd_s": max(round(2.0 * sd, 3), 0.001)} | walk
    return out, None


def clock_offset(fixes: pd.DataFrame, imu: pd.DataFrame, delay: float) -> TimeOffset | None:
    """Offset of a receiver's clock, as `propose` finds it with a sensor that is not named.

    Parameters
    ----------
    delay : float, s
        Of its velocities.
    """
    until, drives = _motion(imu, fixes)
    scatter, sensors = _scatter(imu), None
    if drives and scatter is not None:
        rest = _rest(_quiet(imu, until), until, rocks=True)
        found, _ = _sensors(None, scatter, _rest_bias(imu, rest, None, fixes))
        sensors = _stated({"sensors": found})
    antenna = _antenna(_receiver_errors(fixes, imu, delay), delay)
    return receiver_clock(fixes, imu, sensors, antenna)[0]


def _receiver_errors(fixes: pd.DataFrame, imu: pd.DataFrame, delay: float) -> dict[str, Any]:
    """Significant delay of velocities, errors of positions, uncertainty of a tape."""
    out = {"velocity_delay_s": round(delay, 3)} if delay > LEAST_DELAY else {}
    out |= _position_errors(fixes, delay)
    if _velocities_show_arm(fixes, imu):
        out["lever_arm_sd_m"] = ARM_SD
    return out


def _antenna(aid: dict[str, Any], delay: float | None = None) -> Antenna:
    """Of a proposed receiver, what an alignment uses; `delay`, s, if it is not as proposed."""
    return Antenna(
        time_offset_sd=aid.get("time_offset_sd_s", 0.0),
        velocity_delay=aid.get("velocity_delay_s", 0.0) if delay is None else delay,
        correlated_share=aid.get("position_correlated_share", 0.0),
        correlation_time=LASTING,
    )


def _position_errors(fixes: pd.DataFrame, delay: float) -> dict[str, float]:
    """Share of the positions' variance that lasts, factor of their sd, uncertainty of a tape.

    The share by the scatter from fix to fix, which lacks what lasts; where the velocities show
    what lasts, by its size, which a receiver may understate. One that understates its scatter
    says nothing of what lasts, either: nor does a scatter that motion or velocities may hide. Of
    most code receivers nearly all lasts; one that scatters by more of what it states may understate
    it.
    Float solutions have errors of their own.
    """
    assumed = "position_sd_taken" in fixes.attrs
    floats = float_position_sd(fixes)
    if floats is not None:
        sd = np.square(values_of(fixes, POSITION_SD)[:, :2]).mean(axis=1)
        fixes = fixes[~(sd >= floats**2)]
    found = white_position_sd(fixes, delay)
    if found is None:
        return {}
    white, part = found
    stated = float(np.nanmedian(values_of(fixes, POSITION_SD)[:, :2]))
    precise = white < PHASE if assumed else stated < SHOWS_ARM
    by_velocity = None if precise else lasting_position_sd(fixes, delay)
    measured = bool(np.isfinite(values_of(fixes, VELOCITY_SD[:2])).any())
    usual = LASTS_BY_PHASE if white < PHASE else LASTS_BY_CODE
    least, lasting, total, certain = LASTS, 1.0 - part**2, 1.0, UNDERSTATED
    if by_velocity is not None:
        least, quiet, slow = SHOWN, *(x**2 for x in by_velocity)
        if _velocities_as_taken(fixes) and quiet + slow < MISSTATED**2:
            total = max(1.0, quiet + slow)
        lasting = 1.0 - quiet / total
    elif not assumed and UNDERSTATED < part < MISSTATED and _shows_scatter(fixes, white):
        total, lasting = part**2 / (1.0 - usual), usual
    elif not (assumed or precise or measured) and _shows_scatter(fixes, white):
        if part < MISSTATED:
            # Where the scatter is more than usual, less lasts, or the receiver understates all of
            # it: nothing says which, and half of the excess is, in its logarithm, of each.
            total, certain = max(1.0, part / math.sqrt(1.0 - usual)), 1.0
            lasting = 1.0 - part**2 / total
    elif not assumed and precise:
        # The scatter is an upper bound of what is white.
        unsure = SHARE_SD * math.sqrt(SCATTER / len(fixes))
        if lasting > -unsure and _shows_scatter(fixes, white):
            least = max(SHOWN, unsure)
        else:
            lasting = max(lasting, usual)
    if assumed:
        lasting = usual if by_velocity is None else max(lasting, usual)
    lasting = min(lasting, LASTS_MOST)
    out = {"position_correlated_share": round(lasting, 2)} if lasting >= least else {}
    if total > 1.0 and math.sqrt(total) >= certain:
        out["position_sd_factor"] = round(math.sqrt(total), 2)
    if precise:
        out["lever_arm_sd_m"] = ARM_SD
    if floats is not None:
        out["float_position_sd_m"] = float(f"{floats:.2g}")
    return out


def _velocities_as_taken(fixes: pd.DataFrame) -> bool:
    """Whether velocities state their standard deviation, or scatter no more than is assumed."""
    taken = fixes.attrs.get("velocity_sd_taken")
    scatter = None if taken is None else white_velocity_sd(fixes)
    return taken is None or (scatter is not None and scatter <= taken)


def _shows_scatter(fixes: pd.DataFrame, white: float) -> bool:
    """Whether a scatter of positions, m, is theirs: not that of velocities, nor motion."""
    step = float(np.median(np.diff(index_of(fixes))))
    sd = values_of(fixes, VELOCITY_SD)[:, :2]
    if not np.isfinite(sd).all():
        # The third difference of a way, over the root of 20.
        return JERK * step**3 / math.sqrt(20.0) < 0.5 * white
    # A way by trapezoids, and by velocities with errors.
    sds = float(np.median(sd)), white_velocity_sd(fixes) or math.inf
    return math.hypot(0.5 * min(sds) * step, JERK * step**3 / math.sqrt(288.0)) < 0.5 * white


def _velocities_show_arm(fixes: pd.DataFrame, imu: pd.DataFrame) -> bool:
    """Whether all velocities together show by how much a tape measures an arm wrong.

    An error of the arm turns with the body. Where a hand sways, the velocity that it causes is in
    step with the one by which the sway of gravity separates tilts from biases: it does not average
    out, and a filter without this state takes it for a tilt.
    """
    sd = values_of(fixes, VELOCITY_SD)[:, :2]
    sd = sd[np.isfinite(sd).all(axis=1)]
    time, rate = index_of(imu), values_of(imu, GYRO)
    size = max(1, round(TURNING / float(np.median(np.diff(time)))))
    count = len(rate) // size
    if not len(sd) or count < 2:
        return False
    # A constant part is mostly a bias.
    means = rate[: count * size].reshape(count, size, 3).mean(axis=1)
    turn = float(np.sqrt(np.square(means - means.mean(axis=0)).sum(axis=1).mean()))
    scatter = min(float(np.median(sd)), white_velocity_sd(fixes) or math.inf)
    return ARM_SD * turn * math.sqrt(len(sd)) > scatter


def _change_in_sd(fixes: pd.DataFrame) -> float:
    """Change of velocity in a second, in standard deviations of all velocities together, 1/s."""
    sd = values_of(fixes, VELOCITY_SD)[:, :2]
    stated = np.isfinite(sd).all(axis=1)
    if stated.sum() < TOGETHER:
        return 0.0
    v, time = values_of(fixes, VELOCITY_COLUMNS)[stated, :2], index_of(fixes)[stated]
    steps = max(1, round(1.0 / float(np.median(np.diff(time)))))
    if len(v) <= steps:
        return 0.0
    usual, apart = float(np.median(sd[stated])), (time[steps:] - time[:-steps])[:, None]
    # Without the change by their own noise, which an assumed one may far exceed.
    noise = usual
    if "velocity_sd_taken" in fixes.attrs:
        noise = min(usual, white_velocity_sd(fixes) or usual)
    square = float(np.mean((np.square(v[steps:] - v[:-steps]) - 2.0 * noise**2) / apart**2))
    return math.sqrt(max(square, 0.0) * len(v)) / usual


def _speed(fixes: pd.DataFrame) -> float:
    """Root mean square of the speed over ground by positions, m/s."""
    place = values_of(fixes, GEODETIC)
    if len(place) < 2:
        return 0.0
    return float(np.sqrt(np.mean(np.square(ways_between(place) / np.diff(index_of(fixes))))))


def _levelled(imu: pd.DataFrame, rest: float, until: float) -> float:
    """How long to level a body whose heading is asked, s.

    At most half of the record: navigation needs the rest. `rest`, `until`: of the body, and until
    the fixes prove motion, which those of a phone do of a walk after many steps.
    """
    time = index_of(imu)
    most = round(min(LEVELLED, 0.5 * float(time[-1] - time[0])), 3)
    if until >= most and not _steps(imu, most):
        return most
    return min(most, max(rest, LEVELLED_IN_MOTION))


def _steps(imu: pd.DataFrame, length: float) -> bool:
    """Whether somebody walks with the body within its first `length` seconds."""
    time = index_of(imu)
    size = max(1, round(STEADY / float(np.median(np.diff(time)))))
    force = np.linalg.norm(values_of(imu, ACCEL)[time - time[0] <= length], axis=1)
    means = force[: len(force) // size * size].reshape(-1, size).mean(axis=1)
    return len(means) > 1 and float(means.std()) > STEPS


def _bias_by_turns(imu: pd.DataFrame) -> float:
    """Standard deviation of the gyro biases by the turns of the whole record, rad/s.

    A body turns about its own axes by a few turns at most, or it turns on and on: a mean rate has
    the bias, and one turn in either direction over the record. Both cancel by chance alone.
    """
    time = index_of(imu)
    mean = np.abs(np.trapezoid(values_of(imu, GYRO), time, axis=0)).max()
    return math.hypot(float(mean), 2.0 * math.pi) / float(time[-1] - time[0])


def _alignment(
    sensors: ImuUncertainty | None,
    rest: float,
    drives: bool,
    heading_deg: float | None,
    span: float,
    levelled: float,
    velocities: bool = True,
) -> tuple[dict[str, Any], str]:
    """Coarse and fine alignment for such a record of `span` seconds, and why.

    `levelled` (s): as of `_levelled`.
    """
    most = round(min(LEVELLED, 0.5 * span), 3)
    if heading_deg is not None:
        coarse = {"kind": "known_heading", "heading_deg": heading_deg, "sd_deg": 2.0}
        length = min(max(rest, 1.0), most)
        return (
            {"coarse": {**coarse, "duration_s": length}, "fine": {"kind": "none"}},
            f"levelled by {length:g} s, with the heading that is stated",
        )
    if rest >= LEAST_REST and sensors is not None and _finds_north(sensors):
        coarse_s = float(math.floor(min(COARSE, rest / 3.0)))
        fine_s = float(math.floor(min(rest, 600.0) - coarse_s))
        return (
            {
                "coarse": {"kind": "inertial_frame", "duration_s": coarse_s},
                "fine": {"kind": "filter", "duration_s": fine_s},
            },
            f"it stands for {rest:.4g} s, and its gyros can find north",
        )
    if drives:
        return (
            {
                "coarse": {
                    "kind": "gnss_course",
                    "window_s": MOST_BACK,
                    "until_heading_sd_deg": HEADING,
                    "until_tilt_sd_deg": _tilt(sensors),
                    "backtrack": True,
                },
                "fine": {"kind": "none"},
            },
            "by its course, once it drives: its forward axis is taken to point where it goes"
            + ("" if velocities else "; the fixes state no velocity, so from positions alone"),
        )
    return (
        {"coarse": {"kind": "known_heading", "duration_s": levelled}, "fine": {"kind": "none"}},
        "neither a rest with gyros that find north, nor a drive with fixes: the heading is asked",
    )


def _tried(
    chosen: dict[str, Any],
    how: str,
    imu: pd.DataFrame,
    fixes: pd.DataFrame,
    known: tuple[ImuUncertainty, Warming | None],
    levelled: float,
    clock: dict[str, float],
) -> tuple[dict[str, Any], str, tuple[Finding, ...]]:
    """An alignment by course with limits that the record meets, by trial at some instants.

    `known`: of the sensors, and how they warm up. `clock`: offset and delay of the fixes. If no
    instant allows an alignment, the heading is asked, and a finding gives the reason.
    """
    coarse, antenna = chosen["coarse"], _antenna(clock)
    keys = ("until_heading_sd_deg", "until_tilt_sd_deg")
    limits = tuple(coarse[key] for key in keys)
    time = index_of(imu)
    site = Site(*np.median(values_of(fixes, GEODETIC), axis=0).tolist())
    attrs, fixes = dict(fixes.attrs), fixes.set_axis(fixes.index - clock.get("time_offset_s", 0.0))
    fixes.index.name, fixes.attrs = "time", attrs

    def after(length: float) -> tuple[float, float]:
        """Standard deviations of heading and tilt of an alignment at this time, deg."""
        begin, end = np.searchsorted(time, time[0] + np.array([length - MOST_BACK, length]) + 1e-7)
        way, part = GnssCourse(backtrack=True), imu.iloc[begin:end]
        sensors, warming = known
        if warming is not None:
            sensors = warming.within(sensors, float(part.index[0]), float(part.index[-1]))
        found = way.align(part, site, sensors, fixes, antenna)
        roll, pitch, heading = np.maximum(found.sd_deg_to_begin, found.sd_deg).tolist()
        return heading, max(roll, pitch)

    best, at = (math.inf, math.inf), 0.0
    refused: Finding | None = None
    span, length = float(time[-1] - time[0]), 2.0
    while True:
        length = min(length, span)
        try:
            sd = after(length)
            if sd[0] <= limits[0] and sd[1] <= limits[1]:
                length = _later(length, span, after, limits)
                met = dict(zip(keys, (MARGIN * one for one in limits), strict=True))
                return {**chosen, "coarse": {**coarse, **met, "least_s": length}}, how, ()
            if max(sd) < max(best):
                best, at = sd, length
        except (DataError, DivergenceError) as error:
            refused = error.finding
        if length >= span:
            break
        length = float(math.ceil(length * LATER))
    if max(best) < LARGEST_START:
        wider = (min(MARGIN * max(one), LARGEST_START) for one in zip(limits, best, strict=True))
        coarse = {**coarse, **dict(zip(keys, map(math.ceil, wider), strict=True)), "least_s": at}
        return {**chosen, "coarse": coarse}, f"{how}; no better than within {max(best):.2g} deg", ()
    most = {"kind": "known_heading", "duration_s": levelled}
    reason = refused or Finding("navigation.course-too-uncertain", sd=max(best))
    return (
        {"coarse": most, "fine": {"kind": "none"}},
        "the fixes do not give the attitude, by the reason that is reported: the heading is asked",
        (reason,),
    )


def _later(
    length: float,
    span: float,
    after: Callable[[float], tuple[float, float]],
    limits: tuple[float, float],
) -> float:
    """Time of the latest alignment within `MORE` that meets the limits, too, s.

    Navigation begins with the first sample in any case, and its start is the better the more of the
    drive it is made from.
    """
    whole = math.floor(min(max(LEAST_BACK, length + MORE), span))
    while whole > length:
        try:
            heading, tilt = after(whole)
            if heading <= limits[0] and tilt <= limits[1]:
                return float(whole)
        except (DataError, DivergenceError):
            pass
        whole = math.floor(whole / LATER)
    return float(math.ceil(length))


def _tilt(sensors: ImuUncertainty | None) -> float:
    """Tilt for an alignment by course, deg: accelerometer bias over g."""
    if sensors is None:
        return WELL
    bias = max(sensors.accel.axis("bias"))
    return max(WELL, float(math.ceil(2.0 * math.degrees(bias / STANDARD_GRAVITY))))


def _finds_north(sensors: ImuUncertainty) -> bool:
    return max(sensors.gyro.axis("bias")) <= NORTH

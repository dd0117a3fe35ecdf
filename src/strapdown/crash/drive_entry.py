"""Vehicle state and sensor errors at the impact, from the drive before it.

GNSS fixes, speeds of the wheels, or both; for a unit of a crash the scale factors and the mounting
as well, as far as the accelerations and turns of the drive show them.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.constants import STANDARD_GRAVITY
from strapdown.crash.entry import ATTITUDE, NARROWED, STATES, Entry, EntryState, biases_off
from strapdown.crash.entry import VELOCITY as VELOCITY_COLUMNS
from strapdown.crash.entry_estimate import (
    AVERAGED,
    DELAY,
    RECOVERY,
    EntryPriors,
    Estimate,
    Fixes,
    SensorErrors,
    between,
    estimate,
    judge_fixes,
    judge_speeds,
    record_of_fixes,
)
from strapdown.crash.measuring_point import (
    ACCEL_BIAS,
    GYRO_BIAS,
    LEVELLING,
    TIMING,
    Parameter,
    PointKinematics,
    SampleEffects,
)
from strapdown.crash.structure import STRUCTURE
from strapdown.dsp.chi_square import chi_square_above
from strapdown.dsp.samples import true_runs
from strapdown.ellipsoids import WGS84
from strapdown.errors import ConfigError, DataError, Finding, add_note, add_warning, check_choice
from strapdown.evaluation.control_points import rigid_fit
from strapdown.frames import geodetic_from_ned, place_difference
from strapdown.increments import motion_increments
from strapdown.mechanization import NavigationRun, NorthEastDown, run_mechanization
from strapdown.nav_state import NavState
from strapdown.sensors.pre_crash import FROM_GRAVITY, Levelling
from strapdown.sensors.triad_errors import finite, triad_of, triple
from strapdown.sensors.uncertainty import TriadUncertainty
from strapdown.tables import (
    ACCEL,
    GEODETIC,
    POSITION_SD,
    VELOCITY,
    VELOCITY_SD,
    check_gnss,
    check_imu,
)
from strapdown.tables.checks import Array, index_of, values_of


def entry_state_from_gnss(
    imu: pd.DataFrame,
    gnss: pd.DataFrame,
    *,
    impact: float,
    priors: EntryPriors,
    window: float = 10.0,
    anchor: float | None = None,
    antenna: Sequence[float] = (0.0, 0.0, 0.0),
    ellipsoid: str = "wgs84",
) -> EntryState:
    """Estimate velocity, attitude and biases at the impact from GNSS fixes before it.

    Parameters
    ----------
    imu : DataFrame
        Imu table with specific force, in vehicle axes at the vehicle's reference point.
    gnss : DataFrame
        Gnss table on the same clock; rows anywhere in time.
    impact : float, s
        Beginning of the crash; samples and fixes from there on are not used.
    priors : EntryPriors
    window : float, s
        Length of the record used before the anchor, 1 to 60.
    anchor : float, s, optional
        Instant of the state, not after the impact; by default the impact. The state is that at
        the last sample of the Imu table up to this instant.
    antenna : sequence of float, m
        From the reference point, in vehicle axes.
    ellipsoid : str
        Reference ellipsoid of the positions, one of `ellipsoids.ELLIPSOIDS`.

    Raises
    ------
    DataError
        A table is not valid, specific force is missing, the Imu table does not reach from before
        the fixes to the anchor, or fewer than three fixes over 1 s are usable.
    ConfigError
        An argument is out of range.
    DivergenceError
        As `run_mechanization`.

    Notes
    -----
    *Method.* Iterated generalized least squares (Gauss-Newton) for the 15 states at the anchor,
    from which the full mechanization runs backward over the window, and for scale,
    misalignment, g-sensitivity, antenna and time offset as far as the priors leave them open.
    The covariance of the rows includes the noise of the inertial sensors between each fix and
    the anchor and the correlated part of the receiver's error (`FixCorrelation`), so that ten
    correlated fixes do not count as ten independent ones; `entry_estimate.adjust` solves it fix by
    fix. Outlying fixes are down-weighted (`entry_estimate.weigh`).

    *Fix selection.* Excluded are fixes from the impact on, fixes where the acceleration without
    gravity exceeds 50 m/s² or the jerk 20 m/s³ (both means over 50 ms, `entry_estimate.strain`) and
    for 1 s after, and fixes of quality 0. `EntryState.fixes` gives the reason for each.

    *Observability.* Velocity and position are always observable. Roll and pitch are not separable
    from the horizontal bias while the vehicle neither turns nor accelerates: 0.1 m/s² of bias is
    0.6 deg, and the prior of the bias decides. Heading is observable only through changes of
    velocity: a steady straight drive does not show it, unless the vehicle may be taken to travel
    along its axis (`EntryPriors.side_slip_sd_deg`). A finding reports an unobservable heading. A
    standard deviation beyond some 15 deg then means "unknown": errors that large are not linear,
    and the integrated accelerometer noise is itself mistaken for a motion.

    *Valid* for motions that the Imu table samples well; for sensor errors constant over the
    window; without vibration rectification; and for fixes whose standard deviations are
    right: a finding reports a misfit that chance does not explain.
    """
    at = impact if anchor is None else anchor
    check_arguments(imu, gnss, impact, window, at, antenna)
    drive = DriveEntry(gnss, impact=impact, window=window, antenna=antenna)
    return _estimated(imu, drive, priors, at, ellipsoid=ellipsoid).state


@dataclass(frozen=True, eq=False)
class _Estimated:
    """The state, and what the search found beside it."""

    state: EntryState
    best: Estimate


def _estimated(
    imu: pd.DataFrame,
    drive: DriveEntry,
    priors: EntryPriors,
    at: float,
    *,
    errors: SensorErrors | None = None,
    ellipsoid: str = "wgs84",
    later: Sequence[float] = (0.0,),
) -> _Estimated:
    """State at the last sample up to `at`, s; `errors` of the sensors at the rows of `imu`.

    `later`, s: delays of the speeds beyond the stated one that were found so far.
    """
    mechanization = NorthEastDown(ellipsoid=ellipsoid)
    impact, gnss = drive.impact, drive.fixes
    source = (gnss if gnss is not None else drive.speeds).attrs.get("source")  # type: ignore[union-attr]
    sensed = index_of(imu)
    last = int(np.searchsorted(sensed, at, side="right")) - 1
    begin = max(at - drive.window, float(sensed[0]))
    epochs = [Epochs.of_fixes(gnss, priors)] if gnss is not None else []
    if drive.speeds is not None:
        epochs += [Epochs.of_speeds(drive.speeds, priors, drive.speed_sd, later[-1])]
    epochs = [one.after(begin) for one in epochs]
    firsts = [one.instants[one.instants <= sensed[last]] for one in epochs]
    if not any(one.size for one in firsts):
        raise DataError(
            "crash.no-fix-between-beginning-window",
            file=source,
            quantity="time",
            begin=begin,
            sensed=sensed[last],
        )
    first = min(float(one[0]) for one in firsts if one.size)
    early = _rows(imu, _between(imu, first - RECOVERY - 2.0 * AVERAGED, last))
    turned = _turn_only(mechanization, early, _origin(gnss, epochs, sensed[last]))
    records = [one.judged(turned, impact, float(sensed[last]), priors) for one in epochs]
    used = [
        one.fixes.at(record["used"].to_numpy()) for one, record in zip(epochs, records, strict=True)
    ]
    fixes = _joined(used)
    why = [reasons for record in records for reasons in record["why"]]
    check_enough(fixes, why, source)

    guesses, found = first_guesses(turned, fixes, priors)
    arm = np.asarray(drive.antenna, dtype=np.float64)

    def over(length: float, guess: NavState, start: Estimate | None) -> Estimate:
        """Estimate from the last part of the drive."""
        # The first is not left out by rounding.
        late = fixes.at(fixes.instants >= sensed[last] - length - 1e-9)
        part = _between(imu, float(late.instants[0]), last)
        own = None if errors is None else errors.rows(part)
        return estimate(mechanization, _rows(imu, part), late, guess, priors, arm, own, start)

    best: Estimate | None = None
    for guess in guesses:
        # A drive backward, or with the axes turned, fits only from the opposite heading.
        if best is None or unlikely(best.cost, best.degrees_of_freedom):
            start = None
            for length in _lengths(fixes, float(sensed[last])):
                start = over(length, guess, start)
            assert start is not None
            best = start if best is None else min(best, start, key=lambda e: e.cost)
    assert best is not None
    found_later = float(best.constants[DELAY])
    if drive.has_speeds and abs(found_later - later[-1]) > LINEAR and len(later) < ROUNDS:
        later = (*later, found_later)
        return _estimated(imu, drive, priors, at, errors=errors, ellipsoid=ellipsoid, later=later)
    receiver = fixes.of_receiver
    for record, mine, names in zip(
        records,
        ([receiver, ~receiver] if gnss is not None else [~receiver]),
        ([("position", 0), ("velocity", 1)], [("speed", 2)])[gnss is None :],
        strict=False,
    ):
        for name, group in names:
            record.loc[record["used"], f"{name}_weight"] = best.weights[mine, group]
            record.loc[record["used"], f"{name}_misfit"] = best.misfits[mine, group]
        say_outliers(record, [name for name, _ in names])
    for record in records:
        found += findings_on_fixes(record, source, at)
    state = EntryState(
        state=best.state,
        gyro_bias=tuple(best.gyro_bias.tolist()),
        accel_bias=tuple(best.accel_bias.tolist()),
        covariance=best.covariance,
        mean_rate=tuple(best.mean_rate.tolist()),
        mean_specific_force=tuple(best.mean_force.tolist()),
        fixes=records[0],
        chi_square=best.chi_square,
        degrees_of_freedom=best.degrees_of_freedom,
        iterations=best.iterations,
        findings=(*found, *findings(best, source, priors)),
        speeds=records[-1] if drive.has_speeds else None,
    )
    return _Estimated(state, best)


@dataclass(frozen=True, eq=False)
class Epochs:
    """Fixes or speeds as read: their stamps, and values at their instants of validity."""

    stamps: Array
    fixes: Fixes
    quality: Array | None

    @classmethod
    def of_fixes(cls, gnss: pd.DataFrame, priors: EntryPriors) -> Epochs:
        """Fixes of a Gnss table."""
        stamps = index_of(gnss)
        zero, none = np.zeros(len(stamps)), np.full(len(stamps), np.nan)
        fixes = Fixes(
            stamps - priors.time_offset,
            values_of(gnss, GEODETIC),
            values_of(gnss, VELOCITY),
            np.hstack([values_of(gnss, POSITION_SD), values_of(gnss, VELOCITY_SD)]),
            zero,
            none,
            zero,
        )
        return cls(stamps, fixes, values_of(gnss, ["quality"])[:, 0])

    @classmethod
    def of_speeds(cls, table: pd.DataFrame, priors: EntryPriors, sd: float, later: float) -> Epochs:
        """Speeds as means over `SPEED_STEP`: faster ones are not independent of each other.

        `later`, s: by so much more than stated they are delayed.
        """
        stamps, speed = index_of(table), values_of(table, ["speed"])[:, 0]
        block = np.floor(stamps / SPEED_STEP).astype(np.int64)
        _, first, count = np.unique(block, return_index=True, return_counts=True)
        stamps, speed = (np.add.reduceat(x, first) / count for x in (stamps, speed))
        n = len(stamps)
        # Wheel sensors often read zero near zero speed.
        sds = np.where(np.abs(speed) < LEAST_SPEED, math.hypot(sd, 0.5 * LEAST_SPEED), sd)
        # Of a speed position and velocity are not measured: any numbers will do.
        place, velocity = np.tile(SOMEWHERE, (n, 1)), np.zeros((n, 3))
        none = np.full((n, 6), np.nan)
        instants = stamps - priors.speed_delay - later
        fixes = Fixes(instants, place, velocity, none, speed, sds, np.full(n, later))
        return cls(stamps, fixes, None)

    @property
    def instants(self) -> Array:
        """Instants of validity, (m,), s."""
        return self.fixes.instants

    def after(self, begin: float) -> Epochs:
        """Those from an instant on."""
        later = self.instants >= begin
        quality = None if self.quality is None else self.quality[later]
        return Epochs(self.stamps[later], self.fixes.at(later), quality)

    def judged(
        self, run: NavigationRun, impact: float, anchor: float, priors: EntryPriors
    ) -> pd.DataFrame:
        """Record of which are used, and why the others are not."""
        if self.quality is None:
            slack = 3.0 * priors.speed_delay_sd
            why = judge_speeds(self.instants, run, impact, anchor, slack)
            return record_of_fixes(self.stamps, why, ("speed",))
        slack = 3.0 * priors.time_offset_sd
        why = judge_fixes(self.instants, self.quality, run, impact, anchor, slack)
        return record_of_fixes(self.stamps, why)


def _lengths(fixes: Fixes, end: float) -> list[float]:
    """Lengths of the drive to use in turn, s.

    A gyro bias of 0.01 rad/s turns a long record by more than is linear: a short part shows the
    bias well enough for one of twice the length.
    """
    whole = end - float(fixes.instants[0])
    lengths = [whole]
    while lengths[-1] > 2.0 * FIRST_PART:
        lengths.append(0.5 * lengths[-1])
    return [
        n
        for n in reversed(lengths)
        if n == whole or (fixes.instants >= end - n).sum() >= FIRST_FIXES
    ]


def _joined(parts: Sequence[Fixes]) -> Fixes:
    """Fixes and speeds as one sequence in time."""
    both = Fixes(*(np.concatenate([getattr(one, f.name) for one in parts]) for f in fields(Fixes)))
    return both.at(np.argsort(both.instants, kind="stable"))


def _origin(gnss: pd.DataFrame | None, epochs: Sequence[Epochs], last: float) -> Array:
    """Latitude and longitude, deg, and height, m, for gravity and the Earth's rate."""
    if gnss is None:
        return np.array(SOMEWHERE)
    here = epochs[0].instants <= last
    return np.asarray(np.nanmedian(epochs[0].fixes.place[here], axis=0))


def _between(imu: pd.DataFrame, begin: float, last: int) -> slice:
    """Rows from the last one before an instant to a row."""
    first = max(0, int(np.searchsorted(index_of(imu), begin, side="right")) - 1)
    # A step needs two samples.
    return slice(min(first, last - 1), last + 1)


def _rows(imu: pd.DataFrame, rows: slice) -> pd.DataFrame:
    piece = imu.iloc[rows]
    piece.attrs = dict(imu.attrs)
    return piece


def _turn_only(mechanization: NorthEastDown, imu: pd.DataFrame, place: Array) -> NavigationRun:
    """Navigate from a level, stationary start heading north: only changes are meaningful."""
    increments = motion_increments(imu)
    begin = float(increments.index[0] - increments["dt"].iloc[0])
    start = NavState.from_degrees(*place.tolist(), time=begin)
    return run_mechanization(mechanization, start, increments)


# Entry of each unit of a crash from the drive before it, and what the drive shows of the unit.


CONTRIBUTOR = "entry from the drive"
OTHER_PRIORS = tuple(f.name for f in fields(EntryPriors) if f.name not in ("gyro", "accel"))
#: Of a car on a road, where a speed is measured along it.
CAR = {
    "tilt_sd_deg": 5.0,
    "side_slip_sd_deg": 0.5,
    "slip_slope_sd_deg": 0.5,
    "pitch_slip_sd_deg": 1.0,
    "pitch_slope_sd_deg": 0.2,
    "no_slip_point_sd": 0.3,
}
#: Speeds are means over this, s.
SPEED_STEP = 0.25
# A delay is linear up to this, s: a jerk of 2 m/s³ then makes 1 mm/s. Beyond it the search is
# repeated with the delay that it found.
LINEAR, ROUNDS = 0.03, 3
#: Below this speed a vehicle is stationary, m/s.
STANDS = 0.2
#: Latitude and longitude, deg, and height, m, of a drive without fixes: as of `Entry`.
SOMEWHERE = (45.0, 0.0, 0.0)
# Unknowns that do less to every sample of the drive are left as stated, m/s² and rad/s.
LEAST_FORCE, LEAST_RATE = 1e-5, 1e-8
# Lines of the budget whose unknowns a drive does not determine: what acts in the crash alone, and
# a delay, of which noisy samples say little.
_OF_CRASH = frozenset((STRUCTURE, TIMING))
# A scale factor of a drive holds in the crash only so far beyond it, where no nonlinearity is
# stated.
BEYOND = 3.0
# An estimate beyond so many standard deviations of what was stated contradicts it.
SIGMAS = 4.0


@dataclass(frozen=True, eq=False)
class DriveEntry:
    """The drive before the crash, from which entry state and errors of each unit are found.

    Attributes
    ----------
    fixes : DataFrame, optional
        Gnss table, time from the common trigger.
    impact : float, s
        Samples, fixes and speeds from there on are not used.
    window : float, s
        Length of the record used before the impact.
    before : float, s
        How long before the impact the entry lies: the first sample of the crash already has
        its jerk.
    antenna : sequence of float, (3,), m
        Vehicle axes, from the vehicle's origin.
    priors : dict
        Attributes of `EntryPriors` other than those of the sensors, which come from the unit;
        points are from the reference point. With speeds, those of `CAR` unless stated.
    speeds : DataFrame, optional
        Index ``time`` as of the fixes, column ``speed``, m/s, along the vehicle: of its wheels.
    speed_sd : float, m/s
        Of each speed, beyond what the priors state.

    Raises
    ------
    ConfigError
        A number is not finite or out of range, a prior is unknown or out of range, or there are
        neither fixes nor speeds.
    """

    fixes: pd.DataFrame | None = field(default=None, repr=False)
    impact: float = 0.0
    window: float = 10.0
    before: float = 0.02
    antenna: Sequence[float] = (0.0, 0.0, 0.0)
    priors: dict[str, Any] = field(default_factory=dict)
    speeds: pd.DataFrame | None = field(default=None, repr=False)
    speed_sd: float = 0.1

    def __post_init__(self) -> None:
        for name in ("impact", "window", "before", "speed_sd"):
            if not finite(getattr(self, name)):
                raise ConfigError(
                    "crash.drive-entry-not-a-number",
                    quantity=f"entry from the drive, {name}",
                    value=getattr(self, name),
                )
        if self.fixes is None and self.speeds is None:
            raise ConfigError("crash.drive-without-fixes-or-speeds", quantity="fixes, speeds")
        if self.speed_sd <= 0.0:
            raise ConfigError(
                "crash.standard-deviation-not-positive", quantity="speed_sd", value=self.speed_sd
            )
        what = "entry from the drive"
        triple(self.antenna, f"{what}, antenna", "sensors.point-not-three-numbers")
        for name in self.priors:
            check_choice("crash.no-prior", OTHER_PRIORS, quantity=f"{what}, priors", name=name)
        self.with_sensors(TriadUncertainty(), TriadUncertainty())

    @property
    def has_speeds(self) -> bool:
        """Whether speeds along the vehicle are given."""
        return self.speeds is not None

    def stood(self) -> tuple[tuple[float, float], ...]:
        """When the vehicle stood, by the fixes or speeds, each span from its first to its last."""
        spans: list[tuple[float, float]] = []
        for table in (self.fixes, self.speeds):
            if table is None:
                continue
            if table is self.fixes:
                size = np.hypot(*values_of(table, VELOCITY[:2]).T)
                sd = np.hypot(*values_of(table, VELOCITY_SD[:2]).T)
                still = np.isfinite(sd) & (size < STANDS + 3.0 * sd)
            else:
                still = np.abs(values_of(table, ["speed"])[:, 0]) < STANDS
            stamps = index_of(table)
            for run in true_runs(still):
                spans.append((float(stamps[run.start]), float(stamps[run.stop - 1])))
        return tuple(spans)

    def with_sensors(self, gyro: TriadUncertainty, accel: TriadUncertainty) -> EntryPriors:
        """Priors of the search."""
        return EntryPriors(gyro, accel, **((CAR if self.has_speeds else {}) | self.priors))


def start_from_drive(
    at: PointKinematics, given: DriveEntry, point: Sequence[float]
) -> tuple[PointKinematics, Entry, EntryState]:
    """Estimate the entry state of a unit, and correct the unit as far as the drive shows it.

    The unknowns of the unit at the point are the unknowns of the search, with their effect on every
    sample of the drive; so a range that the drive does not reach, nonlinearity, and vibration
    rectification stay as stated. Where no nonlinearity is stated and the crash goes beyond three
    times the drive, the estimated scale factor is applied, but its standard deviation stays as
    stated: a scale factor at 4 m/s² need not hold at 300 m/s².

    Parameters
    ----------
    point : sequence of float, (3,), m
        New point of the unit, vehicle axes from the vehicle's origin.

    Returns
    -------
    at : PointKinematics
        Corrected, with the unknowns that are left: columns of the lower triangular root of their
        joint covariance, in the order sensors, biases, attitude, velocity. Each is named after
        the unknown of its diagonal.
    entry : Entry
        With the effect of the same unknowns on attitude and velocity.
    state : EntryState
        The estimate, with every fix and the reason why it was used or not.
    """
    unit = None if at.prepared is None else at.prepared.unit
    if unit is None or unit.gyro is None:
        raise DataError("crash.mean-several-units-no-sensors", file=at.name, quantity="entry")
    if at.assumed_axes:
        raise DataError(
            "crash.assumed-not-measured-nothing-carries",
            file=at.name,
            quantity="entry",
            assumed_axes=at.assumed_axes,
        )
    anchor = given.impact - given.before
    antenna = tuple(float(a - p) for a, p in zip(given.antenna, point, strict=True))
    given = replace(given, antenna=antenna)
    check_arguments(at.imu, given.fixes, given.impact, given.window, anchor, antenna)
    time = at.time
    window = (time >= anchor - given.window) & (time <= anchor)
    # Angles of a level that the drive does not use have no other effect.
    shown = _shown(at.effects, window)
    errors = _sensor_errors(at, shown)
    priors = given.with_sensors(*_left_by_preparation(at))
    found = _estimated(at.imu, given, priors, anchor, errors=errors)
    state, best = found.state, found.best
    corrected = errors.off_table(at.imu, best.parameters)
    at = replace(at, imu=biases_off(corrected, best.own_bias[:3], best.own_bias[3:]))
    if at.rest is None or at.rest.grade == "steady":
        # The errors of a quiet drive are part of those of the attitude: count them once.
        roll, pitch, _ = state.state.roll_pitch_heading.tolist()
        at = replace(at, rest=None, rest_accel_sd=0.0, levelling=Levelling(roll, pitch, 0.0, False))
    level = rotation.dcm_from_quaternion(state.state.q_nb)
    effects, unknowns, more = _left(at, shown, best.joint, level, window)
    table, said = _calibration(at, best, priors, shown, more)
    state = replace(state, calibration=table, findings=(*state.findings, *said))
    north, east, down = (float(v) for v in state.state.v_n)
    roll, pitch, heading = (float(x) for x in state.roll_pitch_heading)
    turned = math.radians(given.priors.get("heading_sd_deg") or 0.0)
    if given.fixes is None and turned:
        across = (-turned * east, turned * north, 0.0)
        unknowns.append(("heading", "heading", (0.0, 0.0, turned, *across, 0.0, 0.0, 0.0)))
    entry = Entry(
        time=state.state.time,
        velocity=(north, east, down),
        heading_deg=heading % 360.0,
        unknowns=tuple(unknowns),
        attitude_deg=(roll, pitch),
        lat_deg=float(np.degrees(state.state.lat)),
        lon_deg=float(np.degrees(state.state.lon)),
        alt=state.state.alt,
        source="GNSS before the crash" if given.fixes is not None else "speeds before the crash",
    )
    return replace(at, effects=effects), entry, state


def _shown(effects: SampleEffects, window: NDArray[np.bool_]) -> list[int]:
    """Unknowns that act on the samples of the drive."""
    force = np.abs(effects.force[:, window]).max(axis=(1, 2), initial=0.0)
    rate = np.abs(effects.rate[:, window]).max(axis=(1, 2), initial=0.0)
    acts = (force > LEAST_FORCE) | (rate > LEAST_RATE)
    return [k for k in np.flatnonzero(acts).tolist() if effects.contributors[k] not in _OF_CRASH]


def _sensor_errors(at: PointKinematics, shown: Sequence[int]) -> SensorErrors:
    """Unknowns of a unit as errors of its samples, in standard deviations."""
    prepared, effects = at.prepared, at.effects
    assert prepared is not None
    rotations = np.zeros((3, len(shown)))
    # Only a unit with its own gyro turns as a whole, and only its whole reading does.
    whole = prepared.unit.lender is None and prepared.bias_from[0] != FROM_GRAVITY
    for column, k in enumerate(shown):
        what = effects.parameters[k] if k < len(effects.parameters) else None
        if what is not None and what.quantity == "mounting" and whole:
            rotations[what.axis, column] = what.sd
    # An unknown adds to the truth what the sensor reads too little.
    return SensorErrors(
        -effects.rate[shown].transpose(1, 2, 0),
        -effects.force[shown].transpose(1, 2, 0),
        np.ones(len(shown)),
        rotations,
    )


def _left_by_preparation(at: PointKinematics) -> tuple[TriadUncertainty, TriadUncertainty]:
    """Noise of gyro and accelerometers, vehicle axes, and as bias what the preparation adds."""
    prepared = at.prepared
    assert prepared is not None and prepared.unit.gyro is not None
    C = prepared.unit.mounting.C_vs
    gyro, accel = (
        TriadUncertainty(noise_density=t.uncertainty.noise_density).turned(C)
        for t in (prepared.unit.gyro, prepared.unit.accelerometers[0])
    )
    rest = at.rest
    noise = np.zeros(3)
    if rest is not None and rest.accel_mean_sd is not None:
        noise = np.array(rest.accel_mean_sd)
        if prepared.gravity_matched and prepared.bias_from[0] != FROM_GRAVITY:
            # The vehicle's own acceleration was taken for a part of gravity.
            noise[2] = math.hypot(noise[2], at.rest_accel_sd)
    return gyro, replace(accel, bias=triad_of(noise))


def _left(
    at: PointKinematics,
    shown: Sequence[int],
    joint: Array,
    level: Array,
    window: NDArray[np.bool_],
) -> tuple[SampleEffects, list[tuple[str, str, tuple[float, ...]]], Array]:
    """Unknowns that are left: on the samples, at the entry, and the variance kept, (q,).

    `level`, (3, 3): from vehicle axes into local level at the entry.
    """
    effects, q = at.effects, len(shown)
    order = np.r_[STATES : STATES + q, 9:STATES, ATTITUDE, VELOCITY_COLUMNS]
    root = lower_root(joint[np.ix_(order, order)])
    names = [effects.names[k] for k in shown]
    contributors = [effects.contributors[k] for k in shown]
    names += [f"{at.name} {what} left {axis}" for what in ("gyro bias", "bias") for axis in "xyz"]
    contributors += [GYRO_BIAS] * 3 + [ACCEL_BIAS] * 3
    names += [f"{CONTRIBUTOR} {k + 1}" for k in range(6)]
    contributors += [CONTRIBUTOR] * 6
    # Larger than estimated leaves less for the motion.
    force = (
        np.einsum("kpi,kj->jpi", effects.force[shown], root[:q]) - root[q + 3 : q + 6].T[:, None]
    )
    rate = np.einsum("kpi,kj->jpi", effects.rate[shown], root[:q]) - root[q : q + 3].T[:, None]
    unknowns = [
        (name, contributor, (*column[-6:].tolist(), 0.0, 0.0, 0.0))
        for name, contributor, column in zip(names, contributors, root.T, strict=True)
        if column[-6:].any()
    ]
    acts = [k for k in range(len(names)) if root[: q + 6, k].any()]
    names, contributors = [names[k] for k in acts], [contributors[k] for k in acts]
    force, rate = force[acts], rate[acts]

    kept = np.diagonal(joint)[STATES:].copy()
    beyond = [k for k in range(q) if _goes_beyond(at, shown[k], window) and kept[k] < 1.0]
    for k in beyond:
        more = math.sqrt(1.0 - kept[k])
        names.append(f"{effects.names[shown[k]]} beyond the drive")
        contributors.append(effects.contributors[shown[k]])
        force = np.concatenate([force, more * effects.force[[shown[k]]]])
        rate = np.concatenate([rate, more * effects.rate[[shown[k]]]])
        kept[k] = 1.0

    others = [
        k
        for k, contributor in enumerate(effects.contributors)
        if k not in shown and contributor != LEVELLING
    ]
    at_rest = np.zeros((len(force), 3))
    if at.rest is not None:
        rest = (at.time >= at.rest.start - 1e-9) & (at.time <= at.rest.end + 1e-9)
        at_rest = force[:, rest].mean(axis=1) if rest.any() else at_rest
    else:
        # Gravity in the attitude at the entry: minus C'g, with C' = C (I - [phi x]).
        turns = root[q + 6 : q + 9, acts].T
        at_rest[: len(acts)] = np.cross(turns, [0.0, 0.0, STANDARD_GRAVITY]) @ level
    return (
        SampleEffects(
            (*names, *(effects.names[k] for k in others)),
            (*contributors, *(effects.contributors[k] for k in others)),
            np.concatenate([force, effects.force[others]]),
            np.concatenate([rate, effects.rate[others]]),
            np.concatenate([at_rest, effects.rest_force[others]]),
            # The attitude is that of the drive.
            np.zeros((len(names) + len(others), 3)),
            effects.force_noise,
            effects.rate_noise,
        ),
        unknowns,
        kept,
    )


def _goes_beyond(at: PointKinematics, unknown: int, window: NDArray[np.bool_]) -> bool:
    """Whether a scale factor is used beyond the drive, and no nonlinearity bounds it there."""
    effects, unit = at.effects, at.prepared.unit if at.prepared is not None else None
    what = effects.parameters[unknown] if unknown < len(effects.parameters) else None
    if unit is None or what is None or what.quantity not in ("scale", "gyro scale"):
        return False
    of_gyro = what.quantity == "gyro scale"
    gyro = (unit.lender or unit).gyro
    name = f"{unit.name} "
    triads = [gyro] if of_gyro else [t for t in unit.accelerometers if name + t.name == what.of]
    bend = max((t.uncertainty.axis("nonlinearity_2")[what.axis] for t in triads if t), default=0.0)
    felt = np.abs(effects.rate[unknown] if of_gyro else effects.force[unknown]).max(axis=1)
    return bend == 0.0 and bool(felt.max() > BEYOND * felt[window].max())


def lower_root(covariance: Array) -> Array:
    """Lower triangular root of a covariance; columns of unknowns without variance are zero."""
    out = np.zeros_like(covariance)
    for k in range(len(out)):
        left = covariance[k:, k] - out[k:, :k] @ out[k, :k]
        if left[0] > 1e-12 * covariance[k, k]:
            out[k:, k] = left / math.sqrt(left[0])
    return out


def _removed(at: PointKinematics, what: Parameter) -> float:
    """Bias that the preparation took off already, along the axis of the sensor."""
    prepared = at.prepared
    assert prepared is not None
    unit, lender = prepared.unit, prepared.unit.lender or prepared.unit
    if what.quantity == "gyro bias":
        turn = lender.mounting.C_vs.T @ unit.mounting.C_vs
        return float((turn @ prepared.gyro_bias)[what.axis])
    if what.quantity == "bias":
        return float((unit.mounting.C_vs.T @ prepared.force_bias)[what.axis])
    return 0.0


def _calibration(
    at: PointKinematics,
    best: Estimate,
    priors: EntryPriors,
    shown: Sequence[int],
    kept: Array,
) -> tuple[pd.DataFrame, list[Finding]]:
    """Errors of the unit as estimated from the drive, and findings."""
    effects, sd = at.effects, np.sqrt(np.diag(best.joint)[STATES:])
    rows: list[tuple[str, int, str, float, float, float, float]] = []
    held: list[str] = []
    said: list[Finding] = []
    for column, k in enumerate(shown):
        what = effects.parameters[k] if k < len(effects.parameters) else None
        if what is None:
            continue
        size, own = float(best.parameters[column]), float(sd[column])
        in_crash = what.sd * math.sqrt(float(kept[column]))
        error = what.sd * (size if what.quantity == "mounting" else -size)
        error += _removed(at, what)
        if what.quantity in ("scale", "gyro scale"):
            # The search takes off a share of the reading; a scale factor is a share of the truth.
            error /= 1.0 - error
        rows.append((what.quantity, what.axis, what.of, error, what.sd * own, what.sd, in_crash))
        axis = "xyz"[what.axis]
        if kept[column] == 1.0 and own < NARROWED:
            held.append(f"{what.of} {axis}")
        if contradicts(size, own):
            said.append(_contradiction(what.of, what.quantity, axis, size))
    if held:
        add_note(said, "crash.drive-below-crash", file=at.name, quantity="scale", held=held)
    constants = best.constants[-3:], best.constants_sd[-3:]
    for name, size, own, stated in zip(
        ("speed scale", "speed delay"),
        *(values[:2].tolist() for values in constants),
        (priors.speed_scale_sd, priors.speed_delay_sd),
        strict=True,
    ):
        if stated > 0.0 and contradicts(size / stated, own / stated):
            said.append(_contradiction("speeds", name, "x", size / stated))
        if stated > 0.0 and own < stated:
            shift = priors.speed_delay if name == "speed delay" else 0.0
            rows.append((name, 0, "speeds", shift + size, own, stated, stated))
    columns = ["quantity", "axis", "of", "error", "sd", "stated", "in_crash"]
    return pd.DataFrame(rows, columns=columns), said


def contradicts(size: float, left: float) -> bool:
    """Whether an estimate is beyond chance; it and what is `left` in stated standard deviations.

    By what is stated an estimate scatters by the root of one less the square of what is left.
    """
    return abs(size) > SIGMAS * math.sqrt(1.0 - min(left, NARROWED) ** 2)


def _contradiction(of: str, quantity: str, axis: str, size: float) -> Finding:
    return Finding(
        "crash.drive-contradicts-stated",
        file=of,
        quantity=quantity,
        axis=axis,
        sigmas=abs(size),
    )


# Initial guesses of the entry state.


# At lower speeds the direction of travel is noise.
LEAST_SPEED = 1.0  # m/s
# Number of last fixes that give the initial velocity.
_LAST = 5
# Smallest change of velocity with a usable direction, m/s.
_LEAST_CHANGE = 0.5
# Guesses nearer than this converge to the same solution, deg.
_SAME = 30.0


def first_guesses(
    turned: NavigationRun, fixes: Fixes, priors: EntryPriors
) -> tuple[list[NavState], list[Finding]]:
    """Guess position and velocity from the last fixes, and one or two headings.

    `turned` runs from a level, stationary start heading north up to the anchor. Headings: of the
    priors, or the direction of travel; and, where it differs, the one for which the velocity
    changes of the sensors agree best with those of the fixes.
    """
    if not fixes.of_receiver.any():
        return [_by_speed(fixes, priors, float(turned.time[-1]))], []
    fixes = fixes.at(fixes.of_receiver)
    velocity = _velocities(fixes)
    late = np.median(velocity[-_LAST:], axis=0)
    end = float(turned.time[-1])
    ahead = late * (end - fixes.instants[-1])
    place = geodetic_from_ned(ahead, fixes.place[-1])
    speed = math.hypot(late[0], late[1])
    findings: list[Finding] = []
    headings: list[float] = []
    if priors.heading_deg is not None:
        headings = [priors.heading_deg]
    else:
        if speed >= LEAST_SPEED:
            headings.append(math.degrees(math.atan2(late[1], late[0])))
        by_change = _heading_by_changes(turned, fixes.instants, velocity)
        if by_change is not None and not any(_near(by_change, h) for h in headings):
            headings.append(by_change)
        if speed < LEAST_SPEED:
            add_warning(
                findings, "crash.fixes-before-anchor-say-too", quantity="heading", speed=speed
            )
    guesses = [
        NavState.from_degrees(
            *place.tolist(),
            v_n=late,
            roll_deg=priors.roll_deg,
            pitch_deg=priors.pitch_deg,
            heading_deg=h % 360.0,
            time=end,
        )
        for h in (headings or [0.0])
    ]
    return guesses, findings


def _by_speed(fixes: Fixes, priors: EntryPriors, end: float) -> NavState:
    """State with the last speeds along the heading that is stated, somewhere on the Earth."""
    heading = math.radians(priors.heading_deg or 0.0)
    speed = float(np.median(fixes.speed[-_LAST:]))
    return NavState.from_degrees(
        *SOMEWHERE,
        v_n=speed * np.array([math.cos(heading), math.sin(heading), 0.0]),
        roll_deg=priors.roll_deg,
        pitch_deg=priors.pitch_deg,
        heading_deg=math.degrees(heading) % 360.0,
        time=end,
    )


def _velocities(fixes: Fixes) -> Array:
    """Velocity of each fix; from neighboring positions where it was not measured."""
    told = np.isfinite(fixes.sd[:, 3:])
    if told.all():
        return fixes.velocity
    moved = place_difference(fixes.place, fixes.place[0], ellipsoid=WGS84)
    return np.where(told, fixes.velocity, np.gradient(moved, fixes.instants, axis=0))


def _heading_by_changes(turned: NavigationRun, instants: Array, velocity: Array) -> float | None:
    """Heading at the end from changes of the level velocity, deg; None if there are none."""
    felt = between(turned.time, turned.history[:, 3:5], instants)
    felt = felt - felt.mean(axis=0)
    seen = velocity[:, :2] - velocity[:, :2].mean(axis=0)
    if min(float(np.sqrt((x * x).sum(axis=1).mean())) for x in (felt, seen)) < _LEAST_CHANGE:
        return None
    begun, _ = rigid_fit(felt, seen)
    return math.degrees(begun) + float(rotation.euler_from_quaternion(turned.history[-1, 6:10])[2])


def _near(a: float, b: float) -> bool:
    return bool(np.abs(rotation.within_half_turn(np.array(a - b))) < _SAME)


# Argument checks of the entry state.


# Shortest part of a longer drive that the search begins with, s, and fixes in it.
FIRST_PART, FIRST_FIXES = 8.0, 10
# Minimum data for an entry state.
LEAST_FIXES = 3
LEAST_SPAN = 1.0  # s
LONGEST_WINDOW = 60.0  # s


def check_arguments(
    imu: pd.DataFrame,
    gnss: pd.DataFrame | None,
    impact: float,
    window: float,
    anchor: float,
    antenna: Sequence[float],
) -> None:
    """Refuse tables and arguments that cannot give an entry state."""
    check_imu(imu)
    if gnss is not None:
        check_gnss(gnss)
    if ACCEL[0] not in imu.columns:
        raise DataError(
            "crash.no-accelerometer-nothing-carries-velocity",
            file=imu.attrs.get("source"),
            quantity="accel",
        )
    if not (math.isfinite(impact) and math.isfinite(anchor) and anchor <= impact):
        raise ConfigError("crash.anchor-impact", quantity="anchor", anchor=anchor, impact=impact)
    if not 1.0 <= window <= LONGEST_WINDOW:
        raise ConfigError(
            "crash.gnss-window-out-of-range",
            quantity="window",
            window=window,
            longest_window=LONGEST_WINDOW,
        )
    if len(antenna) != 3 or not all(math.isfinite(x) for x in antenna):
        raise ConfigError("crash.antenna-not-three-numbers", quantity="antenna", antenna=antenna)
    sensed = index_of(imu)
    step = float(np.median(np.diff(sensed)))
    if not sensed[0] < anchor <= sensed[-1] + step:
        raise DataError(
            "crash.goes-anchor",
            file=imu.attrs.get("source"),
            quantity="time",
            sensed=sensed[0],
            sensed_2=sensed[-1],
            anchor=anchor,
        )
    if gnss is None:
        return
    sd = values_of(gnss, [*POSITION_SD, *VELOCITY_SD])
    if (sd == 0.0).any():
        row, column = (int(i) for i in np.argwhere(sd == 0.0)[0])
        raise DataError(
            "crash.standard-deviation-zero-nothing-measured",
            file=gnss.attrs.get("source"),
            row=row + 1,
            quantity=[*POSITION_SD, *VELOCITY_SD][column],
        )


def check_enough(fixes: Fixes, why: list[tuple[Finding, ...]], source: str | None) -> None:
    """Refuse too few fixes, with the reasons for which the others were excluded."""
    span = float(np.ptp(fixes.instants)) if len(fixes.instants) else 0.0
    placed = int((np.isfinite(fixes.sd[:, :3]).all(axis=1) | np.isfinite(fixes.speed_sd)).sum())
    if min(len(fixes.instants), placed) >= LEAST_FIXES and span >= LEAST_SPAN:
        return
    # The first finding of each kind represents all of its kind.
    counts = Counter(f.code for found in why for f in found)
    first = {f.code: f for found in reversed(why) for f in found}
    refused = [
        Finding("crash.fixes-refused", severity="note", count=count, reason=first[code])
        for code, count in counts.items()
    ]
    raise DataError(
        "crash.too-few-fixes" if refused else "crash.too-few-fixes-given",
        file=source,
        quantity="fixes",
        count=len(fixes.instants),
        span=span,
        placed=placed,
        refused=refused,
        least_fixes=LEAST_FIXES,
        least_span=LEAST_SPAN,
    )


# Findings on an entry state.


# Heading standard deviations above this are reported.
WIDE_HEADING = 5.0  # deg
# A misfit of all fixes with a probability below this is reported.
UNLIKELY = 1e-4
#: Reasons that are not reported: these fixes do not belong to the drive before the impact.
LATE = frozenset(
    ("crash.fix-after-impact", "crash.fix-perhaps-after-impact", "crash.fix-after-anchor")
)


def say_outliers(record: pd.DataFrame, names: Sequence[str] = ("position", "velocity")) -> None:
    """Add to each down-weighted fix a finding with its misfit."""
    why: list[tuple[Finding, ...]] = record["why"].tolist()
    for name in names:
        lower = record["used"] & (record[f"{name}_weight"] < 1.0)
        misfits = record.loc[lower, f"{name}_misfit"].to_numpy(dtype=np.float64)
        for row, misfit in zip(np.flatnonzero(lower), misfits.tolist(), strict=True):
            reason = Finding(f"crash.fix-{name}-misfit", severity="note", misfit=misfit)
            why[row] = (*why[row], reason)
    record["why"] = pd.Series(why, index=record.index, dtype=object)


def findings_on_fixes(record: pd.DataFrame, source: str | None, impact: float) -> list[Finding]:
    """Return the findings on the fixes, or speeds, that were rejected or down-weighted."""
    found: list[Finding] = []
    late = record["why"].map(lambda why: any(f.code in LATE for f in why))
    refused = record[~record["used"] & ~late]
    if len(refused):
        add_warning(
            found,
            "crash.fixes-before-impact-not-believed",
            file=source,
            quantity="fixes",
            count=len(refused),
            time=refused.index[0],
            reasons=refused["why"].iloc[0],
        )
    lower = record[record["used"] & (record["why"].map(len) > 0)]
    if len(lower):
        add_warning(
            found,
            "crash.fixes-less-weight-or-none",
            file=source,
            quantity="fixes",
            count=len(lower),
            time=lower.index[0],
            reasons=lower["why"].iloc[0],
        )
    used = record.index[record["used"]]
    if len(used) and impact - used[-1] > 2.0:
        add_note(
            found,
            "crash.last-fix-used-before-anchor",
            file=source,
            quantity="fixes",
            impact=impact - used[-1],
        )
    return found


def findings(best: Estimate, source: str | None, priors: EntryPriors) -> list[Finding]:
    """Return the findings on an estimate."""
    found = []
    if priors.side_slip_sd_deg is not None and not best.slip_fixes:
        found.append(Finding("crash.side-slip-not-used-no", file=source, quantity="heading"))
    heading_sd = math.degrees(math.sqrt(best.covariance[8, 8]))
    if heading_sd > WIDE_HEADING:
        add_warning(
            found,
            "crash.heading-known-only-drive-vehicle",
            file=source,
            quantity="heading",
            heading_sd=min(heading_sd, 180.0),
        )
    if unlikely(best.chi_square, best.degrees_of_freedom):
        add_warning(
            found,
            "crash.fixes-fit-worse-than-their",
            file=source,
            quantity="fixes",
            chi_square=best.chi_square,
            degrees_of_freedom=best.degrees_of_freedom,
            variance_factor=best.chi_square / best.degrees_of_freedom,
            sd_factor=math.sqrt(best.chi_square / best.degrees_of_freedom),
        )
    return found


def unlikely(chi_square: float, degrees_of_freedom: int) -> bool:
    """Whether the probability of a misfit this large is below `UNLIKELY`."""
    if degrees_of_freedom <= 0:
        return False
    return bool(chi_square_above(max(chi_square, 0.0), degrees_of_freedom) < UNLIKELY)

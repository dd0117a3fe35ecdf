"""Vehicle state at the impact, estimated from GNSS fixes before it."""

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
from strapdown.crash.entry import ACCEL_BIAS, ATTITUDE, GYRO_BIAS, Entry, EntryState
from strapdown.crash.entry import VELOCITY as VELOCITY_COLUMNS
from strapdown.crash.entry_estimate import (
    AVERAGED,
    RECOVERY,
    EntryPriors,
    Estimate,
    Fixes,
    between,
    estimate,
    judge_fixes,
    record_of_fixes,
)
from strapdown.crash.measuring_point import PointKinematics
from strapdown.dsp.chi_square import chi_square_above
from strapdown.ellipsoids import WGS84
from strapdown.errors import ConfigError, DataError, Finding, check_choice
from strapdown.evaluation.control_points import rigid_fit
from strapdown.frames import geodetic_from_ned, place_difference
from strapdown.increments import motion_increments
from strapdown.mechanization import NavigationRun, NorthEastDown, run_mechanization
from strapdown.nav_state import NavState
from strapdown.sensors.triad_errors import finite, triple
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
from strapdown.tables.checks import index_of, values_of

Array = NDArray[np.float64]


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
    mechanization = NorthEastDown(ellipsoid=ellipsoid)
    at = impact if anchor is None else anchor
    check_arguments(imu, gnss, impact, window, at, antenna)
    source = gnss.attrs.get("source")
    stamps, sensed = index_of(gnss), index_of(imu)
    instants = stamps - priors.time_offset
    last = int(np.searchsorted(sensed, at, side="right")) - 1
    begin = max(at - window, float(sensed[0]))
    later = instants >= begin
    reached = later & (instants <= sensed[last])
    if not reached.any():
        raise DataError(
            "crash.no-fix-between-beginning-window",
            file=source,
            quantity="time",
            begin=begin,
            sensed=sensed[last],
        )
    first = float(instants[reached][0])
    piece = _between(imu, first, last)
    turned = _turn_only(
        mechanization, _between(imu, first - RECOVERY - 2.0 * AVERAGED, last), gnss[reached]
    )
    slack = 3.0 * priors.time_offset_sd
    why = judge_fixes(
        instants[later],
        values_of(gnss, ["quality"])[later, 0],
        turned,
        impact,
        float(sensed[last]),
        slack,
    )
    record = record_of_fixes(stamps[later], why)
    used = np.flatnonzero(later)[record["used"].to_numpy()]
    fixes = Fixes(
        instants[used],
        values_of(gnss, GEODETIC)[used],
        values_of(gnss, VELOCITY)[used],
        np.hstack([values_of(gnss, POSITION_SD)[used], values_of(gnss, VELOCITY_SD)[used]]),
    )
    check_enough(fixes, why, source)

    guesses, found = first_guesses(turned, fixes, priors)
    arm = np.asarray(antenna, dtype=np.float64)
    best = estimate(mechanization, piece, fixes, guesses[0], priors, arm)
    for other in guesses[1:]:
        # A drive backward, or with the axes turned, fits only from the opposite heading.
        if unlikely(best.cost, best.degrees_of_freedom):
            next_best = estimate(mechanization, piece, fixes, other, priors, arm)
            best = min(best, next_best, key=lambda e: e.cost)
    for name, weights, misfits in (
        ("position", best.weights[:, 0], best.misfits[:, 0]),
        ("velocity", best.weights[:, 1], best.misfits[:, 1]),
    ):
        record.loc[record["used"], f"{name}_weight"] = weights
        record.loc[record["used"], f"{name}_misfit"] = misfits
    say_outliers(record)
    return EntryState(
        state=best.state,
        gyro_bias=tuple(best.gyro_bias.tolist()),
        accel_bias=tuple(best.accel_bias.tolist()),
        covariance=best.covariance,
        mean_rate=tuple(best.mean_rate.tolist()),
        mean_specific_force=tuple(best.mean_force.tolist()),
        fixes=record,
        chi_square=best.chi_square,
        degrees_of_freedom=best.degrees_of_freedom,
        iterations=best.iterations,
        findings=(*found, *findings(best, record, source, priors, at)),
    )


def _between(imu: pd.DataFrame, begin: float, last: int) -> pd.DataFrame:
    """Rows from the last one before an instant to a row."""
    first = max(0, int(np.searchsorted(index_of(imu), begin, side="right")) - 1)
    # A step needs two samples.
    piece = imu.iloc[min(first, last - 1) : last + 1]
    piece.attrs = dict(imu.attrs)
    return piece


def _turn_only(
    mechanization: NorthEastDown, imu: pd.DataFrame, gnss: pd.DataFrame
) -> NavigationRun:
    """Navigate from a level, stationary start heading north: only changes are meaningful."""
    increments = motion_increments(imu)
    begin = float(increments.index[0] - increments["dt"].iloc[0])
    at = gnss[GEODETIC].median()
    start = NavState.from_degrees(at["lat"], at["lon"], at["alt"], time=begin)
    return run_mechanization(mechanization, start, increments)


# Entry state from GNSS fixes before the crash, and the path from there.


CONTRIBUTOR = "entry from GNSS"
# Contributors to the error budget that the entry state replaces.
BIASES = ("accelerometer bias", "gyro bias", "levelling")
OTHER_PRIORS = tuple(f.name for f in fields(EntryPriors) if f.name not in ("gyro", "accel"))


@dataclass(frozen=True, eq=False)
class GnssEntry:
    """GNSS fixes before the crash, from which the entry state and biases of each unit are found.

    Attributes
    ----------
    fixes : DataFrame
        Gnss table, time from the common trigger.
    impact : float, s
        Samples and fixes from there on are not used.
    window : float, s
        Length of the record used before the impact.
    before : float, s
        How long before the impact the entry lies: the first sample of the crash already has
        its jerk.
    antenna : sequence of float, (3,), m
        Vehicle axes, from the vehicle's origin.
    priors : dict
        Attributes of `EntryPriors` other than those of the sensors, which come from the unit.

    Raises
    ------
    ConfigError
        A number is not finite or out of range, or a prior is unknown or out of range.
    """

    fixes: pd.DataFrame = field(repr=False)
    impact: float = 0.0
    window: float = 10.0
    before: float = 0.02
    antenna: Sequence[float] = (0.0, 0.0, 0.0)
    priors: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name in ("impact", "window", "before"):
            if not finite(getattr(self, name)):
                raise ConfigError(
                    "crash.gnss-entry-not-a-number",
                    quantity=f"GNSS entry, {name}",
                    value=getattr(self, name),
                )
        triple(self.antenna, "GNSS entry, antenna", "sensors.point-not-three-numbers")
        for name in self.priors:
            check_choice("crash.no-prior", OTHER_PRIORS, quantity="GNSS entry, priors", name=name)
        EntryPriors(gyro=TriadUncertainty(), accel=TriadUncertainty(), **self.priors)


def start_from_gnss(
    at: PointKinematics, given: GnssEntry, point: Sequence[float]
) -> tuple[PointKinematics, Entry, EntryState]:
    """Estimate the entry state of a unit and remove the biases estimated with it.

    Parameters
    ----------
    point : sequence of float, (3,), m
        New point of the unit, vehicle axes from the vehicle's origin.

    Returns
    -------
    at : PointKinematics
        Corrected for the biases. Its bias unknowns are removed; each other unknown counts only
        for its deviation from its mean over the window, because the estimated bias has absorbed
        the mean. The mounting error in roll and pitch is absorbed by the attitude as well, but is
        kept in full: the bound is conservative there.
    entry : Entry
        With joint covariance of attitude, velocity and biases.
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
    C_vs = unit.mounting.C_vs
    anchor = given.impact - given.before
    state = entry_state_from_gnss(
        at.imu,
        given.fixes,
        impact=given.impact,
        anchor=anchor,
        window=given.window,
        antenna=tuple(float(a - p) for a, p in zip(given.antenna, point, strict=True)),
        priors=EntryPriors(
            gyro=unit.gyro.uncertainty.turned(C_vs),
            accel=unit.accelerometers[0].uncertainty.turned(C_vs),
            **given.priors,
        ),
    )
    return _without_biases(at, state, anchor - given.window), _entry(state), state


def _entry(state: EntryState) -> Entry:
    order = np.r_[ATTITUDE, VELOCITY_COLUMNS, GYRO_BIAS, ACCEL_BIAS]
    values, vectors = np.linalg.eigh(state.covariance[np.ix_(order, order)])
    columns = (vectors * np.sqrt(np.maximum(values, 0.0))).T
    roll, pitch, heading = (float(x) for x in state.roll_pitch_heading)
    north, east, down = (float(v) for v in state.state.v_n)
    nothing = np.zeros(3)
    return Entry(
        time=state.state.time,
        velocity=(north, east, down),
        heading_deg=heading % 360.0,
        unknowns=tuple(
            # A larger bias than estimated leaves less for the motion.
            (f"{CONTRIBUTOR} {k + 1}", CONTRIBUTOR, (*np.r_[c[:6], nothing, -c[6:]].tolist(),))
            for k, c in enumerate(columns)
        ),
        attitude_deg=(roll, pitch),
        lat_deg=float(np.degrees(state.state.lat)),
        lon_deg=float(np.degrees(state.state.lon)),
        alt=state.state.alt,
        source="GNSS before the crash",
    )


def _without_biases(at: PointKinematics, state: EntryState, begin: float) -> PointKinematics:
    effects = at.effects
    time = at.imu.index.to_numpy(dtype=np.float64)
    window = (time >= begin) & (time <= state.state.time)
    keep = [k for k, c in enumerate(effects.contributors) if c not in BIASES]
    force = effects.force[keep] - effects.force[keep][:, window].mean(axis=1, keepdims=True)
    rate = effects.rate[keep] - effects.rate[keep][:, window].mean(axis=1, keepdims=True)
    return replace(
        at,
        imu=state.with_biases_off(at.imu),
        effects=replace(
            effects,
            names=tuple(effects.names[k] for k in keep),
            contributors=tuple(effects.contributors[k] for k in keep),
            force=force,
            rate=rate,
            rest_force=np.zeros((len(keep), 3)),
            tilt=np.zeros((len(keep), 3)),
        ),
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
    velocity = _velocities(fixes)
    late = np.median(velocity[-_LAST:], axis=0)
    end = float(turned.time[-1])
    ahead = late * (end - fixes.instants[-1])
    place = geodetic_from_ned(ahead, fixes.place[-1])
    speed = math.hypot(late[0], late[1])
    findings = []
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
            findings.append(
                Finding("crash.fixes-before-anchor-say-too", quantity="heading", speed=speed)
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


# Minimum data for an entry state.
LEAST_FIXES = 3
LEAST_SPAN = 1.0  # s
LONGEST_WINDOW = 60.0  # s


def check_arguments(
    imu: pd.DataFrame,
    gnss: pd.DataFrame,
    impact: float,
    window: float,
    anchor: float,
    antenna: Sequence[float],
) -> None:
    """Refuse tables and arguments that cannot give an entry state."""
    check_imu(imu)
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
    placed = int(np.isfinite(fixes.sd[:, :3]).all(axis=1).sum())
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


def say_outliers(record: pd.DataFrame) -> None:
    """Add to each down-weighted fix a finding with its misfit."""
    why: list[tuple[Finding, ...]] = record["why"].tolist()
    for name in ("position", "velocity"):
        lower = record["used"] & (record[f"{name}_weight"] < 1.0)
        misfits = record.loc[lower, f"{name}_misfit"].to_numpy(dtype=np.float64)
        for row, misfit in zip(np.flatnonzero(lower), misfits.tolist(), strict=True):
            reason = Finding(f"crash.fix-{name}-misfit", severity="note", misfit=misfit)
            why[row] = (*why[row], reason)
    record["why"] = pd.Series(why, index=record.index, dtype=object)


def findings(
    best: Estimate, record: pd.DataFrame, source: str | None, priors: EntryPriors, impact: float
) -> list[Finding]:
    """Return the findings on an estimate."""
    found = []
    late = record["why"].map(lambda why: any(f.code in LATE for f in why))
    refused = record[~record["used"] & ~late]
    if len(refused):
        found.append(
            Finding(
                "crash.fixes-before-impact-not-believed",
                file=source,
                quantity="fixes",
                count=len(refused),
                time=refused.index[0],
                reasons=refused["why"].iloc[0],
            )
        )
    lower = record[record["used"] & (record["why"].map(len) > 0)]
    if len(lower):
        found.append(
            Finding(
                "crash.fixes-less-weight-or-none",
                file=source,
                quantity="fixes",
                count=len(lower),
                time=lower.index[0],
                reasons=lower["why"].iloc[0],
            )
        )
    used = record.index[record["used"]]
    if impact - used[-1] > 2.0:
        found.append(
            Finding(
                "crash.last-fix-used-before-anchor",
                severity="note",
                file=source,
                quantity="fixes",
                impact=impact - used[-1],
            )
        )
    if priors.side_slip_sd_deg is not None and not best.slip_fixes:
        found.append(Finding("crash.side-slip-not-used-no", file=source, quantity="heading"))
    heading_sd = math.degrees(math.sqrt(best.covariance[8, 8]))
    if heading_sd > WIDE_HEADING:
        found.append(
            Finding(
                "crash.heading-known-only-drive-vehicle",
                file=source,
                quantity="heading",
                heading_sd=min(heading_sd, 180.0),
            )
        )
    if unlikely(best.chi_square, best.degrees_of_freedom):
        found.append(
            Finding(
                "crash.fixes-fit-worse-than-their",
                file=source,
                quantity="fixes",
                chi_square=best.chi_square,
                degrees_of_freedom=best.degrees_of_freedom,
                variance_factor=best.chi_square / best.degrees_of_freedom,
                sd_factor=math.sqrt(best.chi_square / best.degrees_of_freedom),
            )
        )
    return found


def unlikely(chi_square: float, degrees_of_freedom: int) -> bool:
    """Whether the probability of a misfit this large is below `UNLIKELY`."""
    if degrees_of_freedom <= 0:
        return False
    return bool(chi_square_above(max(chi_square, 0.0), degrees_of_freedom) < UNLIKELY)

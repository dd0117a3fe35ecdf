"""Entry state by iterated least squares from fixes or speeds of the drive before a crash.

Error = true - estimated. With phi about local level axes (``C_true = exp([phi x]) C``), f the
specific force and e the sensor errors, it grows by

``phi' = -C e_g``, ``v' = phi x C f - C e_f``, ``p' = v``,

and is integrated backward from the anchor. Neglected are the Earth and transport rates and the
change of gravity: a relative error of ``2 w t + (g/R) t²``, 2e-3 over 10 s, 1e-2 over a minute.
This affects only the standard deviations: the estimate itself solves the full equations.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.crash.entry import ACCEL_BIAS, GYRO_BIAS, STATES, biases_off, rotated
from strapdown.dsp.chi_square import chi_square_above, chi_square_exceeded
from strapdown.dsp.samples import running_integral
from strapdown.ellipsoids import find_ellipsoid
from strapdown.errors import ConfigError, DivergenceError, Finding
from strapdown.evaluation.trajectory_differences import trajectory_at
from strapdown.frames import antenna_motion, geodetic_from_ned, place_difference
from strapdown.increments import motion_increments
from strapdown.mechanization import NavigationRun, NorthEastDown, run_mechanization
from strapdown.nav_state import NavState
from strapdown.rotation import cross_matrix
from strapdown.sensors.triad_errors import ZERO, Triad
from strapdown.sensors.uncertainty import TriadUncertainty
from strapdown.tables import ACCEL, EULER, GEODETIC, GYRO, VELOCITY
from strapdown.tables.checks import Array, values_of

# Noise between two fixes is approximated by impulses at most this far apart, s.
PIECE = 0.25


@dataclass(frozen=True, eq=False)
class Course:
    """A run at n stamps ending at the anchor: attitude, rate and force without biases."""

    time: Array
    C_nb: Array
    rate: Array
    force: Array


@dataclass(frozen=True, eq=False)
class SensorErrors:
    """What q parameters beyond the biases add to rate and force, (n, 3, q), and their sd.

    `rotation`, (3, q), rad: of parameters that turn the sensors in the vehicle; the rotation vector
    that turns what was read into the vehicle's axes, where it is more than small.
    """

    gyro: Array
    accel: Array
    sd: Array
    rotation: Array

    def off_table(self, imu: pd.DataFrame, size: Array) -> pd.DataFrame:
        """An Imu table of as many rows without parameters of the size given, (q,)."""
        C = rotation.dcm_from_rotation_vector(self.rotation @ size)
        straight = np.where(self.rotation.any(axis=0), 0.0, size)
        values = values_of(imu, [*GYRO, *ACCEL])
        out = imu[[*GYRO, *ACCEL]].copy()
        out.attrs = dict(imu.attrs)
        out[GYRO] = (values[:, :3] - self.gyro @ straight) @ C.T
        out[ACCEL] = (values[:, 3:] - self.accel @ straight) @ C.T
        return out

    def rows(self, kept: slice) -> SensorErrors:
        """The same, at some of the samples."""
        return replace(self, gyro=self.gyro[kept], accel=self.accel[kept])

    def about(self, course: Course, size: Array, bias: Array | None) -> SensorErrors:
        """The effects about parameters of the size given, that are off the course already.

        `bias`, (6,), rad/s and m/s²: off it as well, after what was read was turned. None: turns
        and biases are taken as small.
        """
        whole = self.rotation @ size
        C = rotation.dcm_from_rotation_vector(whole)
        gyro, accel = C @ self.gyro, C @ self.accel
        # One more parameter turns by the left Jacobian of the rotation vector; to second order.
        once = cross_matrix(np.zeros(3) if bias is None else whole)
        bias = np.zeros(6) if bias is None else bias
        turned = (np.eye(3) + once / 2.0 + once @ once / 6.0) @ self.rotation
        for k in np.flatnonzero(self.rotation.any(axis=0)):
            gyro[:, :, k] = -np.cross(turned[:, k], course.rate + bias[:3])
            accel[:, :, k] = -np.cross(turned[:, k], course.force + bias[3:])
        return replace(self, gyro=gyro, accel=accel)


def sensor_errors(gyro: TriadUncertainty, accel: TriadUncertainty, course: Course) -> SensorErrors:
    """Collect scale, misalignment and g-sensitivity where they are not zero."""
    n = len(course.time)
    columns: list[tuple[int, int, Array, float]] = []
    for triad, (spec, felt) in enumerate(((gyro, course.rate), (accel, course.force))):
        scale, tilted, g_felt = (
            spec.axis(name) for name in ("scale", "misalignment", "g_sensitivity")
        )
        for i in range(3):
            columns.append((triad, i, felt[:, i], scale[i]))
            columns += [(triad, i, felt[:, j], tilted[i]) for j in range(3) if j != i]
            if triad == 0:
                columns += [(triad, i, course.force[:, j], g_felt[i]) for j in range(3)]
    columns = [c for c in columns if c[3] > 0.0]
    maps = np.zeros((2, n, 3, len(columns)))
    for k, (triad, axis, values, _) in enumerate(columns):
        maps[triad, :, axis, k] = values
    return SensorErrors(
        maps[0], maps[1], np.array([c[3] for c in columns]), np.zeros((3, len(columns)))
    )


def at_fixes(course: Course, errors: SensorErrors, instants: Array) -> Array:
    """Derivatives, (m, 9, 15 + q), of position, velocity and attitude at instants, (m,), s.

    By the 15 states of `EntryState.covariance` at the anchor, and by q sensor parameters.
    """
    n, q = len(course.time), len(errors.sd)
    pushed = np.einsum("nij,nj->ni", course.C_nb, course.force)
    phi = np.zeros((n, 3, 15 + q))
    phi[:, :, 9:12] = -course.C_nb
    phi[:, :, 15:] = -course.C_nb @ errors.gyro
    phi = back_integral(course.time, phi)
    phi[:, :, 6:9] += np.eye(3)
    v = -cross_matrix(pushed) @ phi
    v[:, :, 12:15] -= course.C_nb
    v[:, :, 15:] -= course.C_nb @ errors.accel
    v = back_integral(course.time, v)
    v[:, :, 3:6] += np.eye(3)
    p = back_integral(course.time, v)
    p[:, :, 0:3] += np.eye(3)
    return between(course.time, np.concatenate([p, v, phi], axis=1), instants)


def noise_between_fixes(
    course: Course, gyro: TriadUncertainty, accel: TriadUncertainty, instants: Array
) -> tuple[Array, Array]:
    """Effect of sensor noise on position, velocity and attitude, integrated backward.

    `instants`, (m,), s, decreasing from the end of the course. Returns the error transition from
    the preceding instant to each, (m, 9, 9), of the first from the anchor; and the covariance of
    the noise added between them, as impulses at the middle of intervals.
    """
    pushed = np.einsum("nij,nj->ni", course.C_nb, course.force)
    gained = back_integral(course.time, pushed)
    moved = back_integral(course.time, gained)

    def effect(s: Array, t: Array) -> tuple[Array, Array]:
        """Effect of an attitude error at s on velocity and position at the earlier t."""
        v_s, v_t = between(course.time, gained, s), between(course.time, gained, t)
        s_s, s_t = between(course.time, moved, s), between(course.time, moved, t)
        return cross_matrix(v_s - v_t), -cross_matrix(v_s * (s - t)[:, None] - (s_s - s_t))

    before = np.concatenate([course.time[-1:], instants[:-1]])
    carry = np.zeros((len(instants), 9, 9))
    carry[:] = np.eye(9)
    carry[:, 3:6, 6:9], carry[:, 0:3, 6:9] = effect(before, instants)
    carry[:, 0:3, 3:6] = -(before - instants)[:, None, None] * np.eye(3)

    count = np.maximum(1, np.ceil((before - instants) / PIECE).astype(np.int64))
    which = np.repeat(np.arange(len(instants)), count)
    place = np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count)
    lasted = ((before - instants) / count)[which]
    middle = instants[which] + (place + 0.5) * lasted
    near = np.clip(np.searchsorted(course.time, middle), 0, len(course.time) - 1)
    root = np.sqrt(lasted)[:, None, None]
    turn = course.C_nb[near] * np.array(gyro.axis("noise_density")) * root
    push = course.C_nb[near] * np.array(accel.axis("noise_density")) * root
    by_v, by_p = effect(middle, instants[which])
    shift = np.zeros((len(which), 9, 6))
    shift[:, 0:3, 0:3] = by_p @ turn
    shift[:, 0:3, 3:6] = -(middle - instants[which])[:, None, None] * push
    shift[:, 3:6, 0:3] = by_v @ turn
    shift[:, 3:6, 3:6] = push
    shift[:, 6:9, 0:3] = turn
    driven = np.zeros((len(instants), 9, 9))
    np.add.at(driven, which, shift @ shift.transpose(0, 2, 1))
    return carry, driven


def back_integral(time: Array, values: Array) -> Array:
    """Minus the integral from each stamp to the last, by trapezoids."""
    out = running_integral(time, values)
    out -= out[-1].copy()
    return out


def between(time: Array, values: Array, instants: Array) -> Array:
    """Values at instants, interpolated linearly between the stamps."""
    after = np.clip(np.searchsorted(time, instants), 1, len(time) - 1)
    share = (instants - time[after - 1]) / (time[after] - time[after - 1])
    share = share.reshape((-1,) + (1,) * (values.ndim - 1))
    return np.asarray(values[after - 1] * (1.0 - share) + values[after] * share)


# Priors of the sensors, the vehicle and the receiver.


def _positive(value: float, name: str, code: str) -> None:
    if not (math.isfinite(value) and value > 0.0):
        raise ConfigError(code, quantity=name, value=value)


@dataclass(frozen=True)
class FixCorrelation:
    """Time correlation of the errors of fixes.

    `share`, 0 to 1, of the receiver's stated variance is a Gauss-Markov process of correlation time
    (1/e) `time`, s; the rest is independent for each fix. `ConfigError`: a number is out of range.
    """

    share: float
    time: float

    def __post_init__(self) -> None:
        if not 0.0 <= self.share <= 1.0:
            raise ConfigError("crash.no-share", quantity="share", share=self.share)
        _positive(self.time, "time", "crash.correlation-time-not-positive")


_NOT_NEGATIVE = (
    "antenna_sd",
    "time_offset_sd",
    "no_slip_point_sd",
    "slip_slope_sd_deg",
    "pitch_slope_sd_deg",
    "speed_scale_sd",
    "speed_delay_sd",
    "speed_slip_sd",
)


@dataclass(frozen=True)
class EntryPriors:
    """Priors of an entry state: normal, independent, zero mean, given by standard deviations.

    Attributes
    ----------
    gyro, accel : TriadUncertainty
        Of the Imu table, in vehicle axes: noise and residual biases, scale, misalignment,
        g-sensitivity. Nonlinearity, vibration rectification and range are negligible in normal
        driving before a crash.
    roll_deg, pitch_deg, tilt_sd_deg : float, deg
        Of the vehicle at the anchor; if unknown, the slope of a road and more.
    heading_deg, heading_sd_deg : float, deg, optional
        From another source, such as marks on the road; both or neither.
    side_slip_sd_deg : float, deg, optional
        The vehicle travels along its forward axis within this: standard deviation of the
        side-slip angle at `no_slip_point`, once for the whole window and once more from fix to
        fix, where the speed exceeds 3 m/s and the lateral acceleration, speed times yaw rate, is
        below 2 m/s² (tires slip even within grip). Without it the heading follows from
        accelerations alone.
    no_slip_point : triad, m
        In vehicle axes; for a car the middle of the rear axle.
    no_slip_point_sd : float, m
        Of its forward coordinate.
    slip_slope_sd_deg : float, deg per m/s²
        Of the side slip that grows with lateral acceleration: 0.3 to 0.7 for the rear axle of a
        car (Gillespie 1992, Fundamentals of Vehicle Dynamics, chapter 6).
    pitch_slip_sd_deg : float, deg, optional
        As `side_slip_sd_deg`, of the angle between the direction of travel and the plane of the
        forward and right axes: suspension and slope of the road under the vehicle.
    pitch_slope_sd_deg : float, deg per m/s²
        Of its part that grows with forward acceleration: squat and dive.
    speed_scale_sd : float
        Relative, of speeds: tires and wheel circumference.
    speed_delay, speed_delay_sd : float, s
        A speed stamped t belongs to the instant ``t - speed_delay``.
    speed_slip_sd : float, per m/s²
        Of the relative excess of speeds by driven or braked wheels.
    antenna_sd : float, m
        Of each coordinate of the antenna.
    time_offset, time_offset_sd : float, s
        A fix stamped t belongs to the instant ``t - time_offset``.
    position_correlation, velocity_correlation : FixCorrelation
        Positions of a stand-alone receiver wander over a minute with most of their error, which
        the defaults assume. Velocities are independent, unless the receiver filters them.

    Raises
    ------
    ConfigError
        A number is out of range.
    """

    gyro: TriadUncertainty
    accel: TriadUncertainty
    roll_deg: float = 0.0
    pitch_deg: float = 0.0
    tilt_sd_deg: float = 30.0
    heading_deg: float | None = None
    heading_sd_deg: float | None = None
    side_slip_sd_deg: float | None = None
    no_slip_point: Triad = ZERO
    no_slip_point_sd: float = 0.0
    slip_slope_sd_deg: float = 0.0
    pitch_slip_sd_deg: float | None = None
    pitch_slope_sd_deg: float = 0.0
    speed_scale_sd: float = 0.02
    speed_delay: float = 0.1
    speed_delay_sd: float = 0.1
    speed_slip_sd: float = 0.002
    antenna_sd: float = 0.0
    time_offset: float = 0.0
    time_offset_sd: float = 0.0
    position_correlation: FixCorrelation = FixCorrelation(0.9, 60.0)
    velocity_correlation: FixCorrelation = FixCorrelation(0.0, 1.0)

    def __post_init__(self) -> None:
        if (self.heading_deg is None) != (self.heading_sd_deg is None):
            raise ConfigError(
                "crash.heading-worth-something-only-standard",
                quantity="heading_deg, heading_sd_deg",
            )
        for name in ("roll_deg", "pitch_deg", "heading_deg", "time_offset", "speed_delay"):
            value = getattr(self, name)
            if value is not None and not math.isfinite(value):
                raise ConfigError("crash.not-finite-number", quantity=name, value=value)
        for name in ("tilt_sd_deg", "heading_sd_deg", "side_slip_sd_deg", "pitch_slip_sd_deg"):
            if getattr(self, name) is not None:
                _positive(getattr(self, name), name, "crash.standard-deviation-not-positive")
        for name in _NOT_NEGATIVE:
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0.0):
                raise ConfigError("crash.standard-deviation-negative", quantity=name, value=value)
        if len(self.no_slip_point) != 3 or not all(map(math.isfinite, self.no_slip_point)):
            raise ConfigError(
                "crash.no-slip-point-not-three-numbers",
                quantity="no_slip_point",
                no_slip_point=self.no_slip_point,
            )


# Selection of fixes before a crash, from the motion that the inertial sensors measured.


#: Limits beyond which fixes are rejected: m/s², without gravity, and m/s³.
LARGEST_ACCELERATION = 50.0
LARGEST_JERK = 20.0
#: Acceleration is the mean over this many seconds, jerk the change between two successive such
#: means divided by their distance: first and second difference of the velocity.
AVERAGED = 0.05
#: Fixes are also rejected for this long after an excess, s.
RECOVERY = 1.0


def strain(run: NavigationRun) -> tuple[Array, Array]:
    """Acceleration, m/s², and jerk, m/s³, of a run, free of gravity, (n,) each.

    Lengths of ``(v(t) - v(t-h)) / h`` and ``(v(t) - 2 v(t-h) + v(t-2h)) / h²`` with h = 50 ms; zero
    where the run begins later. White noise of density N gives a jerk of ``√(2/h) N/h`` on each
    axis: 3.6 m/s³ for 0.028 m/s²/√Hz. The first zero of the mean is at 20 Hz.
    """
    time, velocity = run.time, run.history[:, 3:6]

    def at(t: Array) -> Array:
        return np.column_stack([np.interp(t, time, v) for v in velocity.T])

    once, twice = at(time - AVERAGED), at(time - 2.0 * AVERAGED)
    acceleration = np.linalg.norm(velocity - once, axis=1) / AVERAGED
    jerk = np.linalg.norm(velocity - 2.0 * once + twice, axis=1) / AVERAGED**2
    acceleration[time < time[0] + AVERAGED] = 0.0
    jerk[time < time[0] + 2.0 * AVERAGED] = 0.0
    return acceleration, jerk


def judge_fixes(
    instants: Array, quality: Array, run: NavigationRun, impact: float, anchor: float, slack: float
) -> list[tuple[Finding, ...]]:
    """Return for each fix, by its instant of validity in s, the reasons why it is rejected.

    `run` goes up to the anchor; `slack`, s, is the possible error of an instant.
    """
    acceleration, jerk = strain(run)
    hard, rough = acceleration > LARGEST_ACCELERATION, jerk > LARGEST_JERK
    strained = np.flatnonzero(hard | rough)
    why: list[tuple[Finding, ...]] = []
    for t, q in zip(instants, quality, strict=True):
        if t >= impact:
            why.append((_reason("crash.fix-after-impact"),))
        elif t >= impact - slack:
            why.append((_reason("crash.fix-perhaps-after-impact"),))
        elif t > anchor:
            why.append((_reason("crash.fix-after-anchor"),))
        elif q == 0:
            why.append((_reason("crash.fix-without-quality"),))
        else:
            recent = strained[
                (run.time[strained] >= t - RECOVERY) & (run.time[strained] <= t + slack)
            ]
            why.append(_excess(run.time, acceleration, jerk, recent))
    return why


#: A wheel slips by more than `EntryPriors.speed_slip_sd` allows for beyond this, m/s², and for this
#: long after; the acceleration is the mean over as long.
LARGEST_OF_WHEELS, OF_WHEELS = 4.0, 0.5


def judge_speeds(
    instants: Array, run: NavigationRun, impact: float, anchor: float, slack: float
) -> list[tuple[Finding, ...]]:
    """Return for each speed, by its instant of validity in s, the reasons why it is rejected.

    `run` and `slack` as `judge_fixes`.
    """
    velocity = np.column_stack(
        [np.interp(run.time - OF_WHEELS, run.time, v) for v in run.history[:, 3:5].T]
    )
    acceleration = np.linalg.norm(run.history[:, 3:5] - velocity, axis=1) / OF_WHEELS
    acceleration[run.time < run.time[0] + OF_WHEELS] = 0.0
    strained = np.flatnonzero(acceleration > LARGEST_OF_WHEELS)
    why: list[tuple[Finding, ...]] = []
    for t in instants:
        recent = strained[(run.time[strained] >= t - OF_WHEELS) & (run.time[strained] <= t + slack)]
        if t >= impact - slack:
            why.append((_reason("crash.fix-after-impact"),))
        elif t > anchor:
            why.append((_reason("crash.fix-after-anchor"),))
        elif recent.size:
            most, last = float(acceleration[recent].max()), float(run.time[recent[-1]])
            why.append((_reason("crash.speed-of-slipping-wheels", acceleration=most, last=last),))
        else:
            why.append(())
    return why


def _reason(code: str, **values: float) -> Finding:
    return Finding(code, severity="note", data=values)


def _excess(
    time: Array, acceleration: Array, jerk: Array, at: NDArray[np.intp]
) -> tuple[Finding, ...]:
    """Quantities above their limit at these stamps, and the last time of each excess."""
    if not at.size:
        return ()
    most, roughest = float(acceleration[at].max()), float(jerk[at].max())
    said = {"acceleration": most, "jerk": roughest, "last": float(time[at[-1]])}
    if most > LARGEST_ACCELERATION and roughest > LARGEST_JERK:
        return (_reason("crash.fix-under-acceleration-and-jerk", **said),)
    hard = most > LARGEST_ACCELERATION
    return (_reason("crash.fix-under-acceleration" if hard else "crash.fix-under-jerk", **said),)


def record_of_fixes(
    stamps: Array, why: list[tuple[Finding, ...]], kinds: Sequence[str] = ("position", "velocity")
) -> pd.DataFrame:
    """Begin the record of the fixes: rejected ones have zero weight."""
    used = np.array([not w for w in why], dtype=np.bool_)
    columns: dict[str, object] = {
        "used": used,
        "why": pd.Series(why, index=stamps, dtype=object),
    }
    columns |= {f"{kind}_weight": used.astype(np.float64) for kind in kinds}
    columns |= {f"{kind}_misfit": np.full(len(why), np.nan) for kind in kinds}
    return pd.DataFrame(columns, index=pd.Index(stamps, name="time"))


# Iterated least squares of an entry state from accepted GNSS fixes.


MOST_ITERATIONS = 60
# Convergence: steps below this fraction of a standard deviation.
CONVERGED = 1e-3
# Convergence for data without noise, m, m/s, rad.
_TINY = 1e-10
# Standard deviation of an unknown heading: uniform over the circle.
ANY_HEADING = 180.0 / math.sqrt(3.0)  # deg
# Sensitivities are recomputed when the attitude has changed by this, rad: their relative error is
# of that size.
STALE = 0.01
# Limits of the weight iteration.
MOST_WEIGHINGS, SAME_WEIGHT = 15, 0.01
# Prior standard deviation of unknowns, in standard deviations of the fixes: limited by rounding,
# and centered on the current parameters so that it does not bias them.
UNKNOWN = 1e3
# Likewise of the velocity by speeds alone, m/s.
SPEED_STRIDE = 3.0
# Conditions for using the side-slip constraint.
LEAST_SLIP_SPEED, MOST_LATERAL = 3.0, 2.0  # m/s, m/s²
# Rows of an epoch: position, velocity, side slip, pitch slip, speed.
SIDE_SLIP, PITCH_SLIP, SPEED, ROWS = 6, 7, 8, 9
GROUPS = np.array([0, 0, 0, 1, 1, 1, -1, -1, 2])
# Unknown constants of vehicle and receiver, in order: antenna (3), time offset, side slip and its
# slope, no-slip point, pitch slip and its slope, scale, delay and wheel slip of speeds.
OWN, DELAY = 12, 10
# Attitude steps are limited to this, rad: beyond it the linear model does not hold.
LONGEST_TURN = 0.5


@dataclass(frozen=True, eq=False)
class Fixes:
    """Accepted epochs in order: GNSS fixes, and speeds along the vehicle.

    `instants`, (m,), s; `place`, (m, 3), deg, m; `velocity`, (m, 3), m/s; `sd`, (m, 6), m, m/s;
    `speed`, `speed_sd`, (m,), m/s: of wheels; `later`, (m,), s: delay of speeds beyond the stated
    one, by which their instants are moved already. A standard deviation that is NaN: not measured.
    """

    instants: Array
    place: Array
    velocity: Array
    sd: Array
    speed: Array
    speed_sd: Array
    later: Array

    def at(self, rows: slice | NDArray[np.intp] | NDArray[np.bool_]) -> Fixes:
        """Some of the epochs, or all in another order."""
        return Fixes(*(getattr(self, f.name)[rows] for f in fields(self)))

    @property
    def of_receiver(self) -> NDArray[np.bool_]:
        """Epochs that are fixes."""
        return np.asarray(np.isfinite(self.sd).any(axis=1))


@dataclass(frozen=True, eq=False)
class Estimate:
    """Result from one guess; attributes as of `EntryState`, weights and misfits (m, 3).

    `own_bias`, (6,), rad/s and m/s²: without the effect of `parameters`, (q,), in standard
    deviations of their priors where the sensor errors were given. `constants`, (12,): of vehicle
    and receiver (`OWN`), with their standard deviations. `joint`: covariance of the 15 states and
    the parameters.
    """

    state: NavState
    gyro_bias: Array
    accel_bias: Array
    covariance: Array
    mean_rate: Array
    mean_force: Array
    weights: Array
    misfits: Array
    chi_square: float
    degrees_of_freedom: int
    iterations: int
    slip_fixes: int
    cost: float
    own_bias: Array
    parameters: Array
    constants: Array
    constants_sd: Array
    joint: Array


def estimate(
    mechanization: NorthEastDown,
    imu: pd.DataFrame,
    fixes: Fixes,
    guess: NavState,
    priors: EntryPriors,
    arm: Array,
    errors: SensorErrors | None = None,
    start: Estimate | None = None,
) -> Estimate:
    """Estimate the state at the end of a record and the other unknowns from a guess there.

    `arm`, (3,), m: lever arm of the antenna. `errors`: of the sensors, at the rows of the record,
    instead of those that the priors state; noise that turns out larger than stated is then taken as
    that large. `start`: from which the search begins, as of a shorter record; the priors remain
    those about the guess. `DivergenceError`: the iteration does not converge, or a run diverges.
    """
    search = _Search(mechanization, imu, fixes, guess, priors, arm, errors)
    if start is not None:
        search.state, search.bias = start.state, start.own_bias
        search.further = np.concatenate([start.parameters, start.constants])
    weights, settled = np.ones((len(fixes.instants), 3)), 0
    for iteration in range(1, MOST_ITERATIONS + 1):
        problem = search.problem()
        step = adjust(problem, weights)
        # Far from the solution weights only reject gross errors; weights that oscillate are frozen
        # after a while.
        changed = not search.near
        if not search.near or settled < MOST_WEIGHINGS:
            found, _ = weigh(problem, step, weights)
            changed |= bool(np.abs(found - weights).max() > SAME_WEIGHT)
            settled += search.near
            if (found != weights).any():
                weights = found
                step = adjust(problem, weights)
        if search.take(step) and not changed:
            best = search.result(weights, iteration)
            misfit, degrees = max(best.chi_square, 0.0), max(best.degrees_of_freedom, 1)
            likely = chi_square_above(misfit, degrees) > KEPT
            if errors is None or search.first is not None or likely:
                return best
            # Vibration that the sensors fold is not among the stated noise.
            search.inflation, search.first = misfit / degrees, best
    raise DivergenceError(
        "crash.search-entry-state-not-come",
        file=imu.attrs.get("source"),
        quantity="entry state",
        most_iterations=MOST_ITERATIONS,
    )


class _Search:
    """Current parameters and the quantities derived from them."""

    def __init__(
        self,
        mechanization: NorthEastDown,
        imu: pd.DataFrame,
        fixes: Fixes,
        guess: NavState,
        priors: EntryPriors,
        arm: Array,
        errors: SensorErrors | None,
    ) -> None:
        self.mechanization, self.imu, self.given = mechanization, imu, errors
        # From the anchor backward, in the direction in which errors grow.
        self.fixes = fixes.at(slice(None, None, -1))
        self.rolled = np.where(np.isfinite(self.fixes.speed_sd), self.fixes.speed, np.nan)
        self.inflation = 1.0
        # Position and velocity have no prior; speeds alone leave the position as it was guessed.
        self.free = 6 if fixes.of_receiver.any() else 3
        self.first: Estimate | None = None
        self.priors, self.arm = priors, arm
        self.ellipsoid = find_ellipsoid(mechanization.ellipsoid)
        self.state, self.at_first = guess, guess.q_nb
        self.bias = np.zeros(6)
        self.near = False
        self.late = 0.0
        self.further = np.zeros(0)
        self._moved = math.inf

    def problem(self) -> Problem:
        """Rows and priors at the current parameters."""
        course, now = self._run()
        if self._moved > STALE:
            self._linearise(course, now)
            self._moved = 0.0
        residuals = self._residuals(now)
        # Sensor errors that were given are off the samples.
        left = 0 if self.given is None else len(self.errors.sd)
        by_own = self.linear.by_constants[:, :, STATES + left :]
        residuals += by_own[:, :, DELAY - OWN] * self.fixes.later[:, None]
        residuals -= by_own @ self.further[left:]
        away = rotation.rotation_vector_from_quaternion(
            rotation.compose(self.at_first, rotation.conjugate(self.state.q_nb))
        )
        before = np.concatenate([np.zeros(6), away, -self.bias, -self.further])
        linear = replace(self.linear, residuals=residuals, prior_residuals=before)
        if self.inflation == 1.0:
            return linear
        names = ("noise", "variance", "driven", "first")
        return replace(linear, **{n: self.inflation * getattr(linear, n) for n in names})

    def take(self, adjustment: Adjustment) -> bool:
        """Add a step; return whether it was below the convergence limit."""
        step = adjustment.step.copy()
        turn = float(np.linalg.norm(step[6:9]))
        if turn > LONGEST_TURN:
            step *= LONGEST_TURN / turn
        lat_deg, lon_deg = math.degrees(self.state.lat), math.degrees(self.state.lon)
        place = geodetic_from_ned(
            step[:3], [lat_deg, lon_deg, self.state.alt], ellipsoid=self.ellipsoid
        )
        self.state = NavState(
            time=self.state.time,
            lat=math.radians(place[0]),
            lon=math.radians(place[1]),
            alt=float(place[2]),
            v_n=self.state.v_n + step[3:6],
            q_nb=rotated(self.state.q_nb, step[6:9]),
        )
        self.bias = self.bias + step[9:15]
        self.further = self.further + step[STATES:]
        sd = np.sqrt(np.diag(adjustment.covariance))
        self._moved += turn
        if self.given is not None:
            mounted = self.given.rotation @ step[STATES : STATES + len(self.given.sd)]
            self._moved += float(np.linalg.norm(mounted))
        self.near = turn < 0.05
        return bool((np.abs(step) <= np.maximum(CONVERGED * sd, _TINY)).all())

    def result(self, weights: Array, iterations: int) -> Estimate:
        """Return the estimate; biases at the mean rate and force."""
        self._moved = math.inf
        problem = self.problem()
        last = adjust(problem, weights)
        _, misfits = weigh(problem, last, weights)
        plain = last if (weights == 1.0).all() else adjust(problem, np.ones(weights.shape))
        q = len(self.errors.sd)
        to = np.eye(STATES, len(problem.prior_sd))
        to[GYRO_BIAS, STATES : STATES + q] = self.errors.gyro.mean(axis=0)
        to[ACCEL_BIAS, STATES : STATES + q] = self.errors.accel.mean(axis=0)
        bias = self.bias + to[9:15, STATES:] @ self.further
        # The misfit is that with the noise as stated.
        told = self.first
        means = values_of(self.imu, [*GYRO, *ACCEL]).mean(axis=0) - bias
        return Estimate(
            state=self.state,
            gyro_bias=bias[:3],
            accel_bias=bias[3:],
            covariance=to @ last.covariance @ to.T,
            mean_rate=means[:3],
            mean_force=means[3:],
            weights=weights[::-1],
            misfits=misfits[::-1],
            chi_square=last.chi_square if told is None else told.chi_square,
            degrees_of_freedom=int(problem.there.sum()) - self.free,
            iterations=iterations,
            slip_fixes=int(problem.there[:, SIDE_SLIP].sum()),
            cost=plain.chi_square if told is None else told.cost,
            own_bias=self.bias,
            parameters=self.further[:q],
            constants=self.further[q:],
            constants_sd=np.sqrt(np.diag(last.covariance)[STATES + q :]),
            joint=last.covariance[: STATES + q, : STATES + q],
        )

    def _run(self) -> tuple[Course, AtFixes]:
        imu = self.imu
        if self.given is not None and self.further.size:
            imu = self.given.off_table(imu, self.further[: len(self.given.sd)])
        imu = biases_off(imu, self.bias[:3], self.bias[3:])
        run = run_mechanization(
            self.mechanization, self.state, motion_increments(imu), backward=True
        )
        kept = slice(len(imu) - len(run.time), None)
        sensed = values_of(imu, [*GYRO, *ACCEL])[kept]
        self.kept = kept
        course = Course(
            run.time,
            rotation.dcm_from_quaternion(run.history[:, 6:10]),
            sensed[:, :3],
            sensed[:, 3:],
        )
        # A mean sample belongs on average to half a step before its stamp.
        step = float(np.median(np.diff(run.time)))
        self.late = 0.5 * step * (imu.attrs["sampling"] == "mean")
        return course, state_at_fixes(run, course, self.fixes.instants, self.late)

    def _residuals(self, now: AtFixes) -> Array:
        place, velocity = antenna_motion(
            now.place, now.velocity, now.q_nb, now.rate, self.arm, ellipsoid=self.ellipsoid
        )
        own = point_velocity(now, self.priors)
        return np.hstack(
            [
                place_difference(self.fixes.place, place, ellipsoid=self.ellipsoid),
                self.fixes.velocity - velocity,
                -slips(own, self.rolled),
                (self.fixes.speed - own[:, 0])[:, None],
            ]
        )

    def _linearise(self, course: Course, now: AtFixes) -> None:
        """Sensitivities, noise and priors at the current parameters."""
        p, fixes = self.priors, self.fixes
        self.errors = (
            sensor_errors(p.gyro, p.accel, course)
            if self.given is None
            else self.given.rows(self.kept)
        )
        if self.further.size and self.given is not None:
            size = self.further[: len(self.errors.sd)]
            self.errors = self.errors.about(course, size, self.bias)
        q, m = len(self.errors.sd), len(fixes.instants)
        C_nb = rotation.dcm_from_quaternion(now.q_nb)
        look = np.zeros((m, ROWS, 9))
        look[:, 0:3, 0:3] = look[:, 3:6, 3:6] = np.eye(3)
        look[:, 0:3, 6:] = -rotation.cross_matrix(C_nb @ self.arm)
        look[:, 3:6, 6:] = -rotation.cross_matrix(
            np.einsum("mij,mj->mi", C_nb, np.cross(now.rate, self.arm))
        )
        look[:, SIDE_SLIP:] = by_state(now, C_nb, p, self.rolled)
        # Derivatives by the constants of `OWN`.
        own = np.zeros((m, ROWS, STATES + q + OWN))
        own[:, :, : STATES + q] = look @ at_fixes(course, self.errors, fixes.instants)
        # A rate also swings antenna and axle about the reference point.
        sensed = between(course.time, self.errors.gyro, fixes.instants + self.late)
        swung = np.concatenate([np.tile(np.eye(3), (m, 1, 1)), sensed], axis=2)
        rates = np.r_[GYRO_BIAS, STATES : STATES + q]
        own[:, 3:6, rates] += C_nb @ rotation.cross_matrix(self.arm) @ swung
        axle = rotation.cross_matrix(np.asarray(p.no_slip_point, dtype=np.float64))
        own[:, SIDE_SLIP:, rates] += by_point(now, p, self.rolled) @ axle @ swung
        more = own[:, :, STATES + q :]
        more[:, 0:3, 0:3] = C_nb
        more[:, 3:6, 0:3] = C_nb @ rotation.cross_matrix(now.rate)
        more[:, 0:3, 3], more[:, 3:6, 3] = -now.velocity, -now.acceleration
        ahead = point_velocity(now, p)[:, 0]
        gained = np.einsum("mij,mi->mj", C_nb, now.acceleration)[:, 0]
        moving = np.where(np.abs(ahead) < LEAST_SLIP_SPEED, np.inf, ahead)
        more[:, SIDE_SLIP, 4:7] = np.column_stack(
            [np.ones(m), -ahead * now.rate[:, 2], now.rate[:, 2] / moving]
        )
        more[:, PITCH_SLIP, 7:9] = np.column_stack([np.ones(m), gained])
        more[:, SPEED, 9:12] = np.column_stack([ahead, -gained, ahead * gained])

        slides = self._slides(now)
        there = np.column_stack([np.isfinite(fixes.sd), slides, np.isfinite(fixes.speed_sd)])
        slip_sd = math.radians(p.side_slip_sd_deg or 0.0)
        pitch_sd = math.radians(p.pitch_slip_sd_deg or 0.0)
        measured = np.column_stack([fixes.sd, np.tile([slip_sd, pitch_sd], (m, 1)), fixes.speed_sd])
        sd = np.where(there, measured, 0.0)
        spec = (p.position_correlation,) * 3 + (p.velocity_correlation,) * 3
        share = np.array([c.share for c in spec])
        noise = sd**2
        noise[:, :6] *= 1.0 - share
        # The gyro sample beside a fix also moves the antenna.
        swing = (max(p.gyro.axis("noise_density")) * float(np.linalg.norm(self.arm))) ** 2
        noise[:, 3:6] += swing / float(np.median(np.diff(course.time)))
        by_states = np.concatenate([look, np.zeros((m, ROWS, 6))], axis=2)
        for axis in range(6):
            by_states[:, axis, 9 + axis] = sd[:, axis] * math.sqrt(share[axis])

        grown, shaken = noise_between_fixes(course, p.gyro, p.accel, fixes.instants)
        carry, driven = np.zeros((2, m, 15, 15))
        carry[:, :9, :9], driven[:, :9, :9] = grown, shaken
        lasted = -np.diff(fixes.instants, prepend=course.time[-1])
        for axis in range(6):
            a = np.exp(-lasted / spec[axis].time)
            carry[:, 9 + axis, 9 + axis], driven[:, 9 + axis, 9 + axis] = a, 1.0 - a * a
        bounded = sd[:, :6].max(axis=0)
        loose = UNKNOWN * np.where(bounded > 0.0, bounded, np.tile(bounded[:3].max(), 6))
        heading = math.radians(p.heading_sd_deg or ANY_HEADING)
        if self.free == 3:
            # Speeds alone determine neither position nor heading: both are as guessed. The
            # components of velocity that they do not measure must not drift in a bend.
            loose[3:6], heading = SPEED_STRIDE, 0.0
        prior_sd = np.concatenate(
            [
                loose,
                np.radians([p.tilt_sd_deg, p.tilt_sd_deg]),
                [heading],
                p.gyro.axis("bias"),
                p.accel.axis("bias"),
                self.errors.sd,
                [p.antenna_sd] * 3,
                [p.time_offset_sd, slip_sd, math.radians(p.slip_slope_sd_deg)],
                [p.no_slip_point_sd, pitch_sd, math.radians(p.pitch_slope_sd_deg)],
                [p.speed_scale_sd, p.speed_delay_sd, p.speed_slip_sd],
            ]
        )
        self.further = self.further if self.further.size else np.zeros(q + OWN)
        self.linear = Problem(
            np.zeros((m, ROWS)),
            own,
            by_states,
            noise,
            sd**2,
            there,
            GROUPS,
            carry,
            driven,
            np.diag([0.0] * 9 + [1.0] * 6),
            prior_sd,
            np.zeros_like(prior_sd),
        )

    def _slides(self, now: AtFixes) -> NDArray[np.bool_]:
        """Where the vehicle travels along its axis, (m, 2): the conditions on side and pitch slip.

        The condition on a locked wheel restricts neither.
        """
        speed = np.where(
            np.isfinite(self.rolled), self.rolled, np.linalg.norm(now.velocity, axis=1)
        )
        steady = (speed > LEAST_SLIP_SPEED) & (np.abs(speed * now.rate[:, 2]) < MOST_LATERAL)
        stated = [self.priors.side_slip_sd_deg, self.priors.pitch_slip_sd_deg]
        return np.asarray(steady[:, None] & np.array([sd is not None for sd in stated]))


# Generalized least squares over correlated fixes, fix by fix.
#
# The unknown constants and the two processes that correlate the fixes (accumulated inertial sensor
# noise and wander of the receiver) form one state of a linear filter, which runs from the last fix
# to the first. For normal errors this equals the batch solution with the full covariance of all
# rows, at a cost linear in their number instead of cubic.


#: A block keeps full weight while the probability of its misfit is above the first value, and
#: gets zero weight below the second.
KEPT, DROPPED = 1e-3, 1e-6
# Variance factor of a block with zero weight.
_LARGEST = 1e8
# Blocks whose misfits are at least this fraction of the largest are down-weighted together: the
# others may be affected by them.
_TOGETHER = 0.7


@dataclass(frozen=True, eq=False)
class Problem:
    """Linearized fixes and priors: m fixes of up to w rows in filter order, p constants, s states.

    `residuals`, (m, w), with their derivatives `by_constants`, (m, w, p), and `by_states`, (m, w,
    s); `noise`, (m, w): variance independent from fix to fix, `variance` the total that weights
    scale; `there`: components that were measured; `groups`, (w,): rows weighted together, -1 for
    full weight; `carry`, `driven`, (m, s, s): transition from the preceding fix, and noise added on
    the way; `first`, (s, s): covariance at zero time; `prior_residuals`, (p,): prior minus current
    parameters.
    """

    residuals: Array
    by_constants: Array
    by_states: Array
    noise: Array
    variance: Array
    there: NDArray[np.bool_]
    groups: NDArray[np.int64]
    carry: Array
    driven: Array
    first: Array
    prior_sd: Array
    prior_residuals: Array


@dataclass(frozen=True, eq=False)
class Adjustment:
    """One least-squares step of the constants, (p,), with covariance and chi-square.

    The chi-square is over all rows and the priors; degrees of freedom: number of rows less number
    of constants without prior. `apart`, (m, w): difference of each row from the prediction by all
    others and the priors, times `certainty`, (m, w, w), the inverse of its covariance.
    """

    step: Array
    covariance: Array
    chi_square: float
    apart: Array
    certainty: Array


def adjust(problem: Problem, weights: Array) -> Adjustment:
    """Solve for one step of the constants; a group of weight w has additional noise ``1/w - 1``.

    Covariance filter; `apart` and `certainty` by the backward recursion of the smoothations (de
    Jong 1989, Journal of the American Statistical Association 84, 1085): with innovation v of
    covariance F, gain K and ``L = I - K H``, ``u = F^-1 v - K^T r``, ``M = F^-1 + K^T N K``, ``r <-
    H^T F^-1 v + L^T r``, ``N <- H^T F^-1 H + L^T N L``, r and N carried back by the transposed
    transition.
    """
    m, _, p = problem.by_constants.shape
    s = problem.by_states.shape[2]
    state = np.concatenate([problem.prior_residuals, np.zeros(s)])
    P = np.zeros((p + s, p + s))
    P[:p, :p] = np.diag(problem.prior_sd**2)
    P[p:, p:] = problem.first
    noise = problem.noise + problem.variance * extra_noise(problem.groups, weights)
    kept, chi_square = [], 0.0
    for k in range(m):
        T = problem.carry[k]
        state[p:] = T @ state[p:]
        P[p:] = T @ P[p:]
        P[:, p:] = P[:, p:] @ T.T
        P[p:, p:] += problem.driven[k]
        rows = problem.there[k]
        H = np.hstack([problem.by_constants[k, rows], problem.by_states[k, rows]])
        PH = P @ H.T
        inverse = np.linalg.inv(H @ PH + np.diag(noise[k, rows]))
        v = problem.residuals[k, rows] - H @ state
        K = PH @ inverse
        state = state + K @ v
        P -= K @ PH.T
        P = 0.5 * (P + P.T)
        kept.append((H, K, inverse, v))
        chi_square += float(v @ inverse @ v)
    r, N = np.zeros(p + s), np.zeros((p + s, p + s))
    apart = np.zeros(problem.residuals.shape)
    certainty = np.zeros((*problem.residuals.shape, problem.residuals.shape[1]))
    for k in range(m - 1, -1, -1):
        H, K, inverse, v = kept[k]
        rows = np.flatnonzero(problem.there[k])
        u = inverse @ v - K.T @ r
        apart[k, rows] = u
        certainty[k, rows[:, None], rows] = inverse + K.T @ N @ K
        r = r + H.T @ u
        # This symmetric form keeps N positive semidefinite.
        L = np.eye(p + s) - K @ H
        N = L.T @ N @ L + H.T @ inverse @ H
        T = problem.carry[k]
        r[p:] = T.T @ r[p:]
        N[p:] = T.T @ N[p:]
        N[:, p:] = N[:, p:] @ T
    return Adjustment(state[:p], P[:p, :p], chi_square, apart, certainty)


def weigh(problem: Problem, adjustment: Adjustment, weights: Array) -> tuple[Array, Array]:
    """Compute the robust weights, (m, g), of the groups for the next step, and their misfits.

    Misfit: root of the squared Mahalanobis distance of each group, at full weight, from the
    prediction by all others at theirs; NaN where not measured. IGG III (Yang, Song and Xu 2002,
    Journal of Geodesy 76, 353), ``k0/t ((k1 - t)/(k1 - k0))²`` from k0 to k1, with chi-square
    quantiles as k0 and k1. A group still at full weight loses weight only if no other has a much
    larger misfit, so that a false fix does not take its neighbors with it.
    """
    more = problem.variance * extra_noise(problem.groups, weights)
    misfits = np.full(weights.shape, np.nan)
    wanted = np.ones(weights.shape)
    sizes = np.array([1, 2, 3])
    kept, dropped = (np.sqrt(chi_square_exceeded(q, sizes)) for q in (KEPT, DROPPED))
    excess = np.zeros(weights.shape)
    for k, g in np.ndindex(*weights.shape):
        rows = np.flatnonzero((problem.groups == g) & problem.there[k])
        if not rows.size:
            continue
        spread = np.linalg.inv(adjustment.certainty[k][np.ix_(rows, rows)])
        off = spread @ adjustment.apart[k, rows]
        # Without the noise added by its own weight.
        t = float(np.sqrt(off @ np.linalg.solve(spread - np.diag(more[k, rows]), off)))
        k0, k1 = kept[rows.size - 1], dropped[rows.size - 1]
        misfits[k, g], excess[k, g] = t, t / k0
        if t > k0:
            wanted[k, g] = k0 / t * (max(0.0, k1 - t) / (k1 - k0)) ** 2
    fresh = (weights == 1.0) & (wanted < 1.0)
    fresh &= excess < _TOGETHER * np.max(excess, where=fresh, initial=0.0)
    return np.where(fresh, 1.0, wanted), misfits


def extra_noise(groups: NDArray[np.int64], weights: Array) -> Array:
    """Noise that weights add, in variances of the row, (m, w)."""
    with np.errstate(divide="ignore"):
        more = np.minimum(1.0 / weights - 1.0, _LARGEST)
    return np.asarray(np.where(groups >= 0, more[:, np.maximum(groups, 0)], 0.0))


# State and side slip of a run at the instants of the fixes.


@dataclass(frozen=True, eq=False)
class AtFixes:
    """The vehicle's reference point at the instants of the fixes."""

    place: Array
    velocity: Array
    acceleration: Array
    q_nb: Array
    rate: Array


def state_at_fixes(run: NavigationRun, course: Course, instants: Array, late: float) -> AtFixes:
    """Interpolate position by Hermite cubics, velocity and attitude by their rates."""
    # Interpolation requires increasing instants; a speed may be of the instant of a fix.
    once, back = np.unique(instants, return_inverse=True)
    there = trajectory_at(run.trajectory, once, find_ellipsoid(run.mechanization.ellipsoid))
    there = there.iloc[back]
    pushed = np.gradient(run.history[:, 3:6], run.time, axis=0)
    return AtFixes(
        there[GEODETIC].to_numpy(dtype=np.float64),
        there[VELOCITY].to_numpy(dtype=np.float64),
        between(run.time, pushed, instants),
        rotation.quaternion_from_euler(there[EULER].to_numpy(dtype=np.float64)),
        between(course.time, course.rate, instants + late),
    )


def point_velocity(now: AtFixes, priors: EntryPriors) -> Array:
    """Velocity of the point without side slip, (m, 3), m/s, vehicle axes."""
    own = rotation.rotate(rotation.conjugate(now.q_nb), now.velocity)
    return np.asarray(own + np.cross(now.rate, np.asarray(priors.no_slip_point)))


def slips(v: Array, rolled: Array) -> Array:
    """Side-slip and pitch-slip angle of a velocity in vehicle axes, (m, 2), rad.

    `rolled`, (m,), m/s: speed by the wheels. Where it is there, the angle is the part of the
    velocity over it, and so linear in the velocity: with an angle of a poor guess the search
    overshoots.
    """
    known, ahead = _rolling(rolled)
    return np.column_stack(
        [np.where(known, v[:, k] / ahead, np.arctan2(v[:, k], v[:, 0])) for k in (1, 2)]
    )


def _rolling(rolled: Array) -> tuple[NDArray[np.bool_], Array]:
    """Where the wheels show a speed that can be divided by, and that speed."""
    known = np.isfinite(rolled) & (np.abs(rolled) > LEAST_SLIP_SPEED)
    return known, np.where(known, rolled, 1.0)


def by_point(now: AtFixes, priors: EntryPriors, rolled: Array) -> Array:
    """Derivative of the slips and of the speed by the point's velocity, vehicle axes, (m, 3, 3)."""
    v = point_velocity(now, priors)
    known, ahead = _rolling(rolled)
    out = np.zeros((len(v), 3, 3))
    for row, axis in enumerate((1, 2)):
        square = np.maximum(v[:, 0] ** 2 + v[:, axis] ** 2, 1e-6)
        out[:, row, 0] = np.where(known, 0.0, -v[:, axis] / square)
        out[:, row, axis] = np.where(known, 1.0 / ahead, v[:, 0] / square)
    out[:, 2, 0] = 1.0
    return out


def by_state(now: AtFixes, C_nb: Array, priors: EntryPriors, rolled: Array) -> Array:
    """Derivative of the slips and of the speed by position, velocity and attitude, (m, 3, 9)."""
    back = by_point(now, priors, rolled) @ C_nb.transpose(0, 2, 1)
    out = np.zeros((len(back), 3, 9))
    out[:, :, 3:6] = back
    out[:, :, 6:9] = back @ rotation.cross_matrix(now.velocity)
    return out

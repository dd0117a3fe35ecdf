"""Sensitivity of the state at fixes to the state at the anchor, sensor errors and noise.

Error = true - estimated. With phi about local level axes (``C_true = exp([phi x]) C``), f the
specific force and e the sensor errors, it grows by

``phi' = -C e_g``, ``v' = phi x C f - C e_f``, ``p' = v``,

and is integrated backward from the anchor. Neglected are the Earth and transport rates and the
change of gravity: a relative error of ``2 w t + (g/R) t²``, 2e-3 over 10 s, 1e-2 over a minute.
This affects only the standard deviations: the estimate itself solves the full equations.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.dsp.running_integral import running_integral
from strapdown.errors import ConfigError, Finding
from strapdown.mechanization import NavigationRun
from strapdown.rotation import cross_matrix
from strapdown.sensors.triad_errors import ZERO, Triad
from strapdown.sensors.uncertainty import TriadUncertainty

Array = NDArray[np.float64]

# Noise between two fixes is approximated by impulses at most this far apart, s.
PIECE = 0.25


@dataclass(frozen=True, eq=False)
class Course:
    """A run reduced to the data for the sensitivities, at n stamps ending at the anchor.

    Attributes
    ----------
    time : ndarray, (n,), s
    C_nb : ndarray, (n, 3, 3)
    rate, force : ndarray, (n, 3), rad/s, m/s²
        Corrected for the biases estimated so far.
    """

    time: Array
    C_nb: Array
    rate: Array
    force: Array


@dataclass(frozen=True, eq=False)
class SensorErrors:
    """Unknown constants of the two triads beyond their biases, as linear maps.

    Attributes
    ----------
    gyro, accel : ndarray, (n, 3, q)
        Effect of unit parameters on the rate and the specific force at each stamp.
    sd : ndarray, (q,)
    """

    gyro: Array
    accel: Array
    sd: Array


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
    return SensorErrors(maps[0], maps[1], np.array([c[3] for c in columns]))


def at_fixes(course: Course, errors: SensorErrors, instants: Array) -> Array:
    """Derivatives of position, velocity and attitude at instants.

    Parameters
    ----------
    course : Course
    errors : SensorErrors
        Of q parameters.
    instants : ndarray, (m,), s

    Returns
    -------
    ndarray, (m, 9, 15 + q)
        By the 15 states of `EntryState.covariance` at the anchor, and by the parameters.
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

    Parameters
    ----------
    course : Course
    gyro, accel : TriadUncertainty
    instants : ndarray, (m,), s
        Decreasing, from the end of the course.

    Returns
    -------
    carry : ndarray, (m, 9, 9)
        Error transition from the preceding instant, in this order, to each; of the first from
        the anchor.
    driven : ndarray, (m, 9, 9)
        Covariance of the noise added between them, as impulses at the middle of intervals.
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

    Attributes
    ----------
    share : float
        Fraction of the receiver's stated variance, 0 to 1, that is a Gauss-Markov process; the
        rest is independent for each fix.
    time : float, s
        Correlation time (1/e).

    Raises
    ------
    ConfigError
        A number is out of range.
    """

    share: float
    time: float

    def __post_init__(self) -> None:
        if not 0.0 <= self.share <= 1.0:
            raise ConfigError("crash.no-share", quantity="share", share=self.share)
        _positive(self.time, "time", "crash.correlation-time-not-positive")


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
        for name in ("roll_deg", "pitch_deg", "heading_deg", "time_offset"):
            value = getattr(self, name)
            if value is not None and not math.isfinite(value):
                raise ConfigError("crash.not-finite-number", quantity=name, value=value)
        for name in ("tilt_sd_deg", "heading_sd_deg", "side_slip_sd_deg"):
            if getattr(self, name) is not None:
                _positive(getattr(self, name), name, "crash.standard-deviation-not-positive")
        for name in ("antenna_sd", "time_offset_sd"):
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
    """Acceleration and jerk of a run, free of gravity.

    Parameters
    ----------
    run : NavigationRun
        Heading and velocity are arbitrary: only changes of the velocity count.

    Returns
    -------
    acceleration, jerk : ndarray, (n,), m/s², m/s³
        At each stamp, from the samples up to it: lengths of ``(v(t) - v(t-h)) / h`` and of
        ``(v(t) - 2 v(t-h) + v(t-2h)) / h²`` with h = 50 ms; zero where the run begins later.
        White noise of density N gives a jerk of ``√(2/h) N/h`` on each axis: 3.6 m/s³ for
        0.028 m/s²/√Hz. The first zero of the mean is at 20 Hz.
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
    """Return for each fix the reasons why it is rejected.

    Parameters
    ----------
    instants : ndarray, (m,), s
        Instants of validity of the fixes, from the beginning of the run on.
    quality : ndarray, (m,)
    run : NavigationRun
        Up to the anchor.
    impact, anchor : float, s
    slack : float, s
        Possible error of an instant.

    Returns
    -------
    list of tuple of Finding
        Empty where the fix is accepted.
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


def record_of_fixes(stamps: Array, why: list[tuple[Finding, ...]]) -> pd.DataFrame:
    """Begin the record of the fixes: rejected ones have zero weight."""
    used = np.array([not w for w in why], dtype=np.bool_)
    return pd.DataFrame(
        {
            "used": used,
            "why": pd.Series(why, index=stamps, dtype=object),
            "position_weight": used.astype(np.float64),
            "velocity_weight": used.astype(np.float64),
            "position_misfit": np.full(len(why), np.nan),
            "velocity_misfit": np.full(len(why), np.nan),
        },
        index=pd.Index(stamps, name="time"),
    )

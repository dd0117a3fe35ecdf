"""Time offset between a GNSS receiver and the inertial sensors."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown._kernels import piecewise
from strapdown.dsp.samples import spline
from strapdown.errors import DataError, Finding
from strapdown.frames import place_difference
from strapdown.navigation.measurements.gnss_course import LEAST_STEPS, courses, integrals
from strapdown.tables import ACCEL, GEODETIC, GYRO, POSITION_SD, VELOCITY, VELOCITY_SD, usable
from strapdown.tables.checks import RELATIVE, Array, index_of, source_of, values_of

WEEK = 604_800.0
#: Unix time of the first second of GPS time, and its lead over UTC since 2017, s.
GPS_EPOCH, LEAP = 315_964_800.0, 18.0
#: Unix time in 1995 and in 2040, s.
UNIX = (7.9e8, 2.21e9)
#: Range of offsets, s, the step of the search, and of the fit about its result.
LARGEST, STEP, FINE_STEP = 20.0, 0.1, 0.025
#: Steps about the result: whose misfits count, and to which a parabola is fitted.
AROUND, FITTED = 20, 4
#: Below this speed, m/s, a course is not usable; of velocities that are measured, below so many of
#: their standard deviations and the speed of a slow walk. An offset less certain than this, s, is
#: not known.
LEAST_SPEED, PRECISE, SLOW_WALK, UNCLEAR = 3.0, 10.0, 0.7, 0.5
#: Lever arm of an antenna from the unsteered axle, m, one standard deviation of an element; the
#: time over which a rate at an instant is taken, s; and the standard deviation of a result from
#: steps whose residuals are correlated over that from independent ones.
ARM, ABOUT, CORRELATED = 1.0, 0.1, 2.0
#: Fraction of the changes that the sensors must explain; and factor by which the best offset's
#: residual must be below that of any other more than a second from it.
LEAST_SHARE, CLEAR = 0.6, 1.3
#: Share of a sum of squares that normal equations round to.
ROUNDED = 1e-14
#: Of more steps the first are used: two hours of fixes each second know an offset to milliseconds.
MOST_STEPS = 7200
LONGEST_STEP = 1.5
#: A part that is the whole record, s.
WHOLE = (-math.inf, math.inf)
#: An offset is reported from so many standard deviations, and at least this, s.
SURE, LEAST_OFFSET = 3.0, 0.02


@dataclass(frozen=True)
class TimeOffset:
    """Time stamps of a receiver minus the time of the inertial sensors.

    Attributes
    ----------
    offset, sd : float, s
    share : float or None
        Of the changes of that course or speed that the sensors explain; None of windows alone.
    by : {'course', 'speed', 'windows'}
        Main source of the estimate.
    """

    offset: float
    sd: float
    share: float | None
    by: str


def check_overlap(
    gnss: pd.DataFrame,
    imu: pd.DataFrame,
    offset: float = 0.0,
    part: tuple[float, float] = WHOLE,
) -> list[Finding]:
    """Refuse fixes that do not overlap the inertial record in time.

    Parameters
    ----------
    offset : float, s
        Time stamps of the receiver minus the time of the sensors, as configured.
    part : (2,), s
        Of the record that was asked for: fixes beyond it are not counted.

    Returns
    -------
    list of Finding
        An outage at the start or at the end, and fixes beyond the record.
    """
    time, stamps = index_of(gnss) - offset, index_of(imu)
    source = source_of(gnss)
    within = (time >= stamps[0]) & (time <= stamps[-1])
    if not within.any():
        clock = gnss.attrs.get("clock", RELATIVE)
        shared = clock != RELATIVE and clock == imu.attrs.get("clock")
        code, clocks = _difference(time, stamps, shared=shared)
        raise DataError(
            code,
            file=source,
            quantity="time",
            begin=time[0],
            end=time[-1],
            record_begin=stamps[0],
            record_end=stamps[-1],
            **clocks,
        )
    found = []
    inside = np.flatnonzero(within)
    usual = float(np.median(np.diff(time))) if len(time) > 1 else 1.0
    slack = 3.0 * usual + 1.0
    for late, row, code in (
        (float(time[inside[0]] - stamps[0]), int(inside[0]), "navigation.fixes-begin-late"),
        (float(stamps[-1] - time[inside[-1]]), int(inside[-1]), "navigation.fixes-end-early"),
    ):
        if late > slack:
            found.append(Finding(code, file=source, row=row + 1, quantity="time", apart=late))
    asked = (time >= part[0]) & (time <= part[1])
    count, outside = int(asked.sum()), int((asked & ~within).sum())
    if outside > 0.2 * count:
        found.append(
            Finding(
                "navigation.fixes-outside-inertial-record",
                file=source,
                quantity="time",
                outside=outside,
                count=count,
            )
        )
    return found


def time_offset(
    gnss: pd.DataFrame, imu: pd.DataFrame, velocity_delay: float = 0.0
) -> TimeOffset | None:
    """Find the offset at which the gyros explain the course, or the specific force the speed.

    Accurate to some hundredths of a second: the nominal value of an estimated state.

    Parameters
    ----------
    velocity_delay : float, s
        Of the receiver (`gnss_delay.velocity_delay`). Without measured velocities the mean
        between positions is used instead.

    Returns
    -------
    TimeOffset or None
        None if the vehicle neither turns nor changes its speed, another offset fits about as
        well, or course and speed disagree.

    Notes
    -----
    Over a step between fixes, the course changes by a linear function of the integral of the three
    rates, whatever the mounting, as long as the vehicle does not tilt by much; its speed by one of
    the integral of force. The velocity of the antenna is another by its lever arm, in proportion
    to the rates: a meter before the rear axle the course is ahead of the heading by a meter over
    the speed, and on a roof it follows the rolling of a rough road. For every offset of a grid the
    coefficients are fitted by least squares, with a prior for the arm; the least misfit is refined
    by a parabola, whose curvature gives the standard deviation.
    """
    told = courses(gnss, velocity_delay)
    if told is None:
        return None
    at, velocity = told
    speed = np.hypot(velocity[:, 0], velocity[:, 1])
    course = np.unwrap(np.arctan2(velocity[:, 1], velocity[:, 0]))
    steps = np.diff(at)
    least = LEAST_SPEED
    if (measured := usable(gnss, VELOCITY_SD[:2])).any():
        sd = float(np.median(values_of(gnss, VELOCITY_SD[:2])[measured]))
        least = min(LEAST_SPEED, max(SLOW_WALK, PRECISE * sd))
    ready = (steps <= LONGEST_STEP) & (np.minimum(speed[1:], speed[:-1]) > least)
    turns = np.abs(np.diff(course)) < 0.5 * math.pi
    if not ready.any():
        return None
    slow = np.maximum(speed, least)
    found = [
        one
        for name, change, columns, used, per_rate in (
            ("course", np.diff(course), GYRO, ready & turns, 1.0 / slow),
            ("speed", np.diff(speed), ACCEL, ready, np.ones(len(at))),
        )
        if (one := _best(at, change, used, imu, columns, per_rate, name)) is not None
    ]
    if not found:
        return None
    weights = np.array([one.sd**-2 for one in found])
    offsets = np.array([one.offset for one in found])
    offset, sd = float(weights @ offsets / weights.sum()), float(weights.sum() ** -0.5)
    if np.ptp(offsets) > 4.0 * math.hypot(*(one.sd for one in found)) or sd > UNCLEAR:
        return None
    best = found[int(np.argmax(weights))]
    return TimeOffset(offset, sd, best.share, best.by)


def find_time_offset(
    gnss: pd.DataFrame, found: TimeOffset | None, assumed: float = 0.0, assumed_sd: float = 0.0
) -> list[Finding]:
    """Report an offset that is significant, and beyond the assumed one.

    Parameters
    ----------
    found : TimeOffset or None
        Of these fixes, as of `time_offset`.
    assumed, assumed_sd : float, s
        As configured; an offset within three standard deviations is left to the filter.

    Returns
    -------
    list of Finding
        With the option that removes it; empty without a significant offset.
    """
    if found is None or abs(found.offset - assumed) < max(
        SURE * found.sd, LEAST_OFFSET, 3.0 * assumed_sd
    ):
        return []
    leap = abs(abs(found.offset - assumed) - LEAP) < 0.5
    return [
        Finding(
            "navigation.receiver-clock-off-leap-seconds"
            if leap
            else "navigation.receiver-clock-off",
            file=source_of(gnss),
            quantity="time",
            offset=found.offset,
            sd=found.sd,
            configured=assumed,
            explained_by=found.by,
            share=found.share,
            sd_to_set=max(0.05, 2.0 * found.sd),
        )
    ]


def _best(
    at: Array,
    change: Array,
    used: NDArray[np.bool_],
    imu: pd.DataFrame,
    columns: list[str],
    per_rate: Array,
    by: str,
) -> TimeOffset | None:
    """The offset at which the integrals of three channels best explain a change.

    `per_rate`: of the value that changes by a rate times a lever arm.
    """
    stamps = index_of(imu)
    if not set(columns) <= set(imu.columns):
        return None
    # Every offset is judged by the same steps: those within the record at all the offsets.
    most = min(LARGEST, 0.25 * float(stamps[-1] - stamps[0]))
    begin, end = at[:-1], at[1:]
    room = most + ABOUT
    used = used & (begin - room >= stamps[0]) & (end + room <= stamps[-1])
    if used.sum() < LEAST_STEPS:
        return None
    if used.sum() > MOST_STEPS:
        first, *_, last = np.flatnonzero(used)[:MOST_STEPS].tolist()
        at, per_rate = at[first : last + 2], per_rate[first : last + 2]
        change, used = change[first : last + 1], used[first : last + 1]
        begin, end = at[:-1], at[1:]
        imu = imu.iloc[slice(*np.searchsorted(stamps, [at[0] - room, at[-1] + room]))]
        stamps = index_of(imu)
    # A course is as accurate as it is fast.
    weight = 1.0 / (0.5 * (per_rate[1:] + per_rate[:-1]))[used]
    change, lasting = weight * change[used], weight * (end - begin)[used]
    means = imu.attrs["sampling"] == "mean"
    nodes, sums = integrals(stamps, imu, columns, means)
    turned = sums
    if columns != GYRO:
        turned = integrals(stamps, imu, GYRO, means)[1]

    between, before, after = (np.empty((len(at), 3)) for _ in range(3))
    X = np.empty((len(change), 7))
    X[:, 3] = lasting

    def fit_at(offset: float) -> tuple[Array, Array]:
        """Fill X; return the normal equations."""
        piecewise.lines(nodes, sums, at - offset, between)
        X[:, :3] = np.diff(between, axis=0)[used] * weight[:, None]
        piecewise.lines(nodes, turned, at - offset - 0.5 * ABOUT, before)
        piecewise.lines(nodes, turned, at - offset + 0.5 * ABOUT, after)
        rate = (after - before) * (per_rate / ABOUT)[:, None]
        X[:, 4:] = np.diff(rate, axis=0)[used] * weight[:, None]
        return X.T @ X, X.T @ change

    def fitted(normal: Array, product: Array, stiff: float) -> tuple[Array, float]:
        """Coefficients, and their sum of squares as far as the normal equations have digits."""
        normal = normal + np.diag([0.0, 0.0, 0.0, 0.0, stiff, stiff, stiff])
        fit, *_ = np.linalg.lstsq(normal, product, rcond=None)
        left = squares + float(fit @ (normal @ fit - 2.0 * product))
        return np.asarray(fit), max(left, ROUNDED * squares)

    def misfit(offset: float, stiff: float) -> float:
        """Sum of squares, of the residuals themselves."""
        fit, _ = fitted(*fit_at(offset), stiff)
        return float(np.square(change - X @ fit).sum() + stiff * (fit[4:] @ fit[4:]))

    squares = float(change @ change)
    whole = float(np.square(change - change.mean()).sum())
    grid = np.arange(-most, most + 0.5 * STEP, STEP)
    fits = [fit_at(float(one)) for one in grid]
    least = min(fitted(*fit, 0.0)[1] for fit in fits)
    variance = CORRELATED**2 * least / max(len(change) - 8, 1)
    stiff = variance / ARM**2
    costs = np.array([fitted(*fit, stiff)[1] for fit in fits])
    k = int(np.argmin(costs))
    share = 1.0 - float(costs[k]) / whole if whole > 0.0 else 0.0
    away = np.abs(grid - grid[k]) > 1.0
    if (
        share < LEAST_SHARE
        or not 0 < k < len(grid) - 1
        or not (away.any() and costs[away].min() > CLEAR * costs[k])
    ):
        return None
    # Again near the minimum, with a step that is wide against its noise and narrow against motions.
    fine = grid[k] + np.arange(-AROUND, AROUND + 1) * FINE_STEP
    near = np.array([misfit(float(one), stiff) for one in fine])
    best = min(max(int(np.argmin(near)), FITTED), len(fine) - 1 - FITTED)
    part = slice(best - FITTED, best + FITTED + 1)
    second, first, level = np.polyfit(fine[part] - fine[best], near[part], 2)
    if not second > 0.0:
        return None
    off = -0.5 * first / second
    least = float(level - second * off**2)
    # Where the misfit grows by less farther away, as where an arm explains it, the widest parabola.
    away = np.abs(fine - fine[best] - off)
    away[part] = 0.0
    flat = float(np.max(np.square(away) / np.maximum(near - least, 1e-9 * least)))
    sd = math.sqrt(variance * max(1.0 / second, flat))
    offset = float(fine[best] + off)
    return TimeOffset(offset, sd, share, by)


def _difference(time: Array, stamps: Array, *, shared: bool) -> tuple[str, dict[str, Any]]:
    """The finding code of the difference of two clocks, and its data.

    `shared`: both are stated to be of one clock, such as that of 1970.
    """
    apart = float(time[0] - stamps[0])
    span = max(float(time[-1] - time[0]), float(stamps[-1] - stamps[0]), 60.0)
    found = None if shared else _of_two_clocks(time, stamps, apart, span)
    if found is not None:
        return found
    for length, code in (
        (WEEK, "navigation.no-fix-in-record-weeks-apart"),
        (86_400.0, "navigation.no-fix-in-record-days-apart"),
        (3600.0, "navigation.no-fix-in-record-hours-apart"),
    ):
        count = round(apart / length)
        if count and abs(apart - count * length) < min(span, 0.2 * length):
            return code, {"count": abs(count), "shift": count * length}
    return "navigation.no-fix-in-record", {"apart": abs(apart), "shift": apart}


def _of_two_clocks(
    time: Array, stamps: Array, apart: float, span: float
) -> tuple[str, dict[str, Any]] | None:
    """The finding code of two clocks or units, and its data; None if there is only one."""
    known = (
        (GPS_EPOCH - LEAP, "navigation.no-fix-in-record-unix-and-gps-time"),
        (GPS_EPOCH, "navigation.no-fix-in-record-unix-and-since-1980"),
    )
    for size, code in known:
        if abs(abs(apart) - size) < span:
            return code, {"shift": math.copysign(size, apart)}
    for ratio, unit in ((1e3, "ms"), (1e6, "µs"), (1e9, "ns")):
        for scaled, other, code in (
            (time, stamps, "navigation.no-fix-in-record-unit-of-fixes"),
            (stamps, time, "navigation.no-fix-in-record-unit-of-record"),
        ):
            if abs(scaled[0] / ratio - other[0]) < span / ratio + span and other[0] > span:
                return code, {"unit": unit, "ratio": ratio}
    kinds = [_kind(float(x[0]), span) for x in (time, stamps)]
    if kinds[0] != kinds[1]:
        clocks = {"clock": kinds[0], "record_clock": kinds[1]}
        if kinds == [UNIX_TIME, GPS_WEEK]:
            shift = {"shift": _to_week(time)}
            return "navigation.no-fix-in-record-fixes-in-unix-time", {**clocks, **shift}
        if kinds == [GPS_WEEK, UNIX_TIME]:
            shift = {"shift": _to_week(stamps)}
            return "navigation.no-fix-in-record-record-in-unix-time", {**clocks, **shift}
        return "navigation.no-fix-in-record-two-clocks", clocks
    return None


UNIX_TIME, GPS_WEEK = "Unix time", "seconds of the GPS week"


def _kind(first: float, span: float) -> str:
    """Name of the clock that a first time stamp suggests."""
    if UNIX[0] <= first <= UNIX[1]:
        return UNIX_TIME
    if abs(first) < max(span, 100.0):
        return "seconds from its own start"
    if 0.0 <= first <= WEEK:
        return GPS_WEEK
    return "another clock"


def _to_week(unix: Array) -> float:
    """Seconds from Unix time to the second of the GPS week."""
    gps = float(unix[0]) - GPS_EPOCH + LEAP
    return math.floor(gps / WEEK) * WEEK + GPS_EPOCH - LEAP


# Delay of a receiver's velocity against its own positions.


#: Range of the searched delays, s.
GNSS_DELAY_LARGEST = 2.0
#: Number of steps from fix to fix that are needed, and the longest, s: over a longer step
#: the velocity is not representative.
GNSS_DELAY_LEAST_STEPS, GNSS_DELAY_LONGEST_STEP = 20, 1.5
#: Length of the segments over which positions and velocities are compared, s: long against their
#: noise, short against the correlation time of position errors.
PIECE = 2.0
#: A residual of so many medians has no weight, and a usual one nearly all.
FAULT = 6.0
#: A delay is reported from so many standard deviations, if it matters: if the velocity error by it
#: is at least this part of the stated standard deviation.
GNSS_DELAY_SURE, MATTERS = 4.0, 0.5


@dataclass(frozen=True)
class VelocityDelay:
    """Delay of the velocity against the positions of the same rows.

    Attributes
    ----------
    delay, sd : float, s
    changing : float, m/s²
        Root mean square of the acceleration that makes the delay observable.
    """

    delay: float
    sd: float
    changing: float
    steps: int


def velocity_delay(table: pd.DataFrame) -> VelocityDelay | None:
    """Find the delay at which the integral of the velocity best fits the positions.

    Parameters
    ----------
    table : DataFrame
        Gnss table.

    Returns
    -------
    VelocityDelay or None
        None without 20 steps of at most 1.5 s with both, or without acceleration.

    Notes
    -----
    A position changes by ``V(t_k + d) - V(t_j + d)``, V the integral of the velocity by its stamps
    (a cubic spline), d the delay, and k as many steps after j as make 2 s. The sum of the squared
    residuals is least at the true d, found by Gauss-Newton from the best of a grid. The standard
    deviation allows for correlation, as of overlapping segments (Newey and West, Econometrica 55
    (1987) 703).
    """
    # Many receivers output speed and course only.
    good, axes = usable(table, [*POSITION_SD, *VELOCITY_SD]), 3
    level = usable(table, [*POSITION_SD[:2], *VELOCITY_SD[:2]])
    if 2 * good.sum() < level.sum():
        good, axes = level, 2
    if good.sum() <= GNSS_DELAY_LEAST_STEPS:
        return None
    time = index_of(table)[good]
    time = time - time[0]
    place, velocity = values_of(table, GEODETIC)[good], values_of(table, VELOCITY)[good, :axes]
    steps = np.diff(time)
    apart = max(1, round(PIECE / float(np.median(steps))))
    if len(time) <= GNSS_DELAY_LEAST_STEPS + apart:
        return None
    moved = place_difference(place[apart:], place[:-apart])[:, :axes]
    speed = spline(time, velocity)
    way = speed.integral()
    # In a gap, or beyond its end, the spline is not valid.
    holes = time[:-1][steps > GNSS_DELAY_LONGEST_STEP], time[1:][steps > GNSS_DELAY_LONGEST_STEP]
    begin, end = time[:-apart] - GNSS_DELAY_LARGEST, time[apart:] + GNSS_DELAY_LARGEST
    near = (begin >= time[0]) & (end <= time[-1])
    for left_of, right_of in zip(*holes, strict=True):
        near &= (end <= left_of) | (begin >= right_of)
    if near.sum() < GNSS_DELAY_LEAST_STEPS:
        return None

    def between(values: Array) -> Array:
        return np.asarray((values[apart:] - values[:-apart])[near])

    def left(delay: float) -> Array:
        return np.asarray(moved[near] - between(way(time + delay)))

    def weights(residuals: Array) -> Array:
        """Redescending weights by the size of a residual: a fault of some seconds has none."""
        size = np.linalg.norm(residuals, axis=1)
        scale = max(float(np.median(size)), 1e-9)
        return np.asarray(np.square(np.maximum(1.0 - np.square(size / (FAULT * scale)), 0.0)))

    grid = np.arange(-GNSS_DELAY_LARGEST, GNSS_DELAY_LARGEST + 1e-9, 0.05)
    delay = float(grid[np.argmin([np.linalg.norm(left(d), axis=1).sum() for d in grid])])
    for _ in range(6):
        gained = between(speed(time + delay))
        weight = weights(left(delay))[:, None]
        power = float((weight * np.square(gained)).sum())
        if power == 0.0:
            return None
        delay += float((weight * gained * left(delay)).sum()) / power
        delay = min(max(delay, -GNSS_DELAY_LARGEST), GNSS_DELAY_LARGEST)
    score = (weight * gained * left(delay)).sum(axis=1)
    variance, lags = float(score @ score), 2 * apart
    # With negatively correlated residuals the sum may vanish.
    least = 0.05 * variance
    for lag in range(1, min(lags, len(score) - 1) + 1):
        variance += 2.0 * (1.0 - lag / (lags + 1)) * float(score[lag:] @ score[:-lag])
    changing = float(np.sqrt(power / np.square(between(time)).sum()))
    return VelocityDelay(
        delay, float(np.sqrt(max(variance, least))) / power, changing, int(near.sum())
    )


def sure_delay(table: pd.DataFrame) -> float:
    """Return the delay of the velocity, s, as far as it is significant, and zero otherwise."""
    found = velocity_delay(table)
    return 0.0 if found is None or found.delay < GNSS_DELAY_SURE * found.sd else found.delay


def find_velocity_delay(table: pd.DataFrame, assumed: float = 0.0) -> list[Finding]:
    """Report a delay that is significant and matters.

    Parameters
    ----------
    table : DataFrame
        Gnss table.
    assumed : float, s
        Delay in the configuration.

    Returns
    -------
    list of Finding
        With the option that removes it; empty without a significant delay.
    """
    found = velocity_delay(table)
    if found is None:
        return []
    off = found.delay - assumed
    sds = values_of(table, VELOCITY_SD)
    stated = float(np.median(sds[np.isfinite(sds)]))
    if abs(off) < GNSS_DELAY_SURE * found.sd or abs(off) * found.changing < MATTERS * stated:
        return []
    return [
        Finding(
            "navigation.velocity-later-than-position"
            if found.delay > 0.0
            else "navigation.velocity-earlier-than-position",
            file=source_of(table),
            quantity="VN, VE, VD",
            delay=abs(found.delay),
            sd=found.sd,
            configured=assumed,
            steps=found.steps,
        )
    ]

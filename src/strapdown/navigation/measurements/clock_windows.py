"""Clock offset of a receiver in windows of a drive: its value, its significance, and its steps."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from strapdown.alignment.alignment import Site
from strapdown.alignment.course_sums import Antenna
from strapdown.alignment.gnss_course import GnssCourse
from strapdown.errors import DataError, DivergenceError, Finding
from strapdown.frames import place_difference, ways_between
from strapdown.navigation.measurements.gnss_clock import TimeOffset, time_offset
from strapdown.sensors.uncertainty import ImuUncertainty
from strapdown.tables import ACCEL, GEODETIC, GYRO, VELOCITY, VELOCITY_SD
from strapdown.tables.checks import Array, index_of, source_of, values_of

#: Length of a window, s, and the largest number of them.
WINDOW, MOST = 60.0, 10
#: Offset before a fit, s, one standard deviation, and the rounds with the stamps corrected by the
#: last: the fit is linear in the offset.
UNKNOWN, ROUNDS = 0.5, 3
#: Windows end where the vehicle moves: if not, so many times earlier by so much, s.
EARLIER = (0.0, 7.0, 15.0)
#: Nothing is known in advance of how the unit is mounted, deg.
MOUNTING = 20.0
#: Nor where it is: a course that is ahead of the heading by d / v looks like an offset, m.
AXLE = 10.0
#: Nor where the antenna is: on a rough road the roof sways, and so does its course, m.
ARM = 2.0
#: Samples are averaged to this rate, Hz: motions of a vehicle are slower.
FAST = 20.0
#: The distance between two fixes shows a step of the receiver's clock to this fraction.
AGREES = 0.3
#: A window beyond so many standard deviations of the others has a fault of its own; a step of the
#: clock is found from so many, from this size, s, and from so many windows on each side.
STRAYS, CLEAR, LEAST_STEP, SIDE = 4.0, 6.0, 0.2, 2
#: Part of the windows that agrees, at least: where more stray, the model is wrong, as of a
#: boat in a stream, whose course is not its heading.
MAJORITY = 2.0 / 3.0
#: Two estimates of an offset agree within so many standard deviations.
AGREED = 3.0
#: Stamps are regular where all but a few intervals are whole multiples of the usual one, to this
#: part of it and to so many standard deviations of the others; fewest fixes that show it.
IRREGULAR, BEYOND, FEW, FEWEST = 0.05, 6.0, 3, 20
#: Largest step that is looked for, s, and longest interval in which the way can show it, intervals
#: and s; numbers of fixes on a line that show a velocity.
LARGEST, SHORT, SHORT_S, LINES = 2.0, 5.0, 3.0, (2, 3, 5, 8)
#: Differences of chi-square: a step, or none, is certain; lost fixes without another sign of a step
#: are that; fixes are lost just where a clock steps.
CERTAIN, LOST, COINCIDENCE = 16.0, 25.0, 9.0
#: 90 % quantile of chi-square with two degrees of freedom; most that the windows contribute.
NINETY, MOST_BY_WINDOWS = 4.605, 25.0


@dataclass(frozen=True)
class ClockStep:
    """Step of the offset between two clocks: size in s, and the interval in which it occurs.

    `in_stamps`: the stamps of the receiver show it; `certain`: so that they can be corrected by it.
    """

    size: float
    sd: float
    after: float
    before: float
    in_stamps: bool = False
    certain: bool = False


@dataclass(frozen=True, eq=False)
class Offsets:
    """Offsets (w,) s of windows that begin and end at times (w, 2) s, with standard deviations."""

    spans: Array
    offset: Array
    sd: Array

    def joint(self) -> tuple[float, float] | None:
        """Offset of all windows and its standard deviation; windows that stray do not count.

        A part of the errors is common to the windows, as those of biases: what their scatter lacks
        of their standard deviations. It does not fall with their number. None without two windows
        that agree, and a `MAJORITY`.
        """
        if len(self.offset) < 2:
            return None
        order = np.argsort(self.offset)
        part = np.cumsum(self.sd[order] ** -2)
        middle = float(self.offset[order][np.searchsorted(part, 0.5 * part[-1])])
        used = np.abs(self.offset - middle) < STRAYS * np.maximum(self.sd, np.median(self.sd))
        if used.sum() < max(2.0, MAJORITY * len(used)):
            return None
        weight = self.sd[used] ** -2
        offset = float(weight @ self.offset[used] / weight.sum())
        share = float(weight @ np.square(self.offset[used] - offset)) / (used.sum() - 1)
        common = max(0.0, 1.0 - share) * used.sum()
        return offset, float(np.sqrt((share + common) / weight.sum()))

    def drift(self) -> tuple[float, float] | None:
        """Drift of the offset and its standard deviation, s/s; None without three windows."""
        if len(self.offset) < 3:
            return None
        middle = self.spans.mean(axis=1)
        weight = self.sd**-2.0
        past = middle - float(weight @ middle / weight.sum())
        spread = float(weight @ np.square(past))
        rate = float((weight * past) @ self.offset) / spread
        level = float(weight @ self.offset / weight.sum())
        off = (self.offset - level - rate * past) / self.sd
        scatter = max(1.0, float(off @ off) / (len(off) - 2))
        return rate, float(np.sqrt(scatter / spread))

    def step(self) -> ClockStep | None:
        """The most likely single step, if it is significant beside the scatter about it."""
        best, found = np.inf, None
        for k in range(SIDE, len(self.offset) - SIDE + 1):
            left = Offsets(self.spans[:k], self.offset[:k], self.sd[:k]).joint()
            right = Offsets(self.spans[k:], self.offset[k:], self.sd[k:]).joint()
            if left is None or right is None:
                continue
            level = np.where(np.arange(len(self.offset)) < k, left[0], right[0])
            far = np.abs(self.offset - level) / self.sd
            cost = float(np.minimum(np.square(far), STRAYS**2).sum())
            if cost < best:
                scatter = max(1.0, cost / (len(far) - 2))
                sd = float(np.sqrt(scatter * (left[1] ** 2 + right[1] ** 2)))
                best = cost
                found = ClockStep(right[0] - left[0], sd, self.spans[k - 1, 0], self.spans[k, 1])
        if found is None or abs(found.size) < max(CLEAR * found.sd, LEAST_STEP):
            return None
        return found


def window_offsets(
    gnss: pd.DataFrame,
    imu: pd.DataFrame,
    sensors: ImuUncertainty,
    start: float = 0.0,
    antenna: Antenna = Antenna(),  # noqa: B008
) -> Offsets:
    """Fit the offset in windows of a drive, with attitude, velocity and biases.

    Parameters
    ----------
    start : float, s
        Stamps of the receiver minus the time of the sensors, near the answer: the fit of a window
        converges from a second away.
    antenna : Antenna
        Its delay and its correlated errors.

    Returns
    -------
    Offsets
        Of the windows that allow an alignment by course; others do not show an offset.

    Notes
    -----
    The offset is an unknown of `GnssCourse`, which shifts each fix by its velocity, or changes its
    velocity by the acceleration. The prior of `UNKNOWN` is taken off the answer.
    """
    time, stamps = index_of(imu), index_of(gnss) - start
    begin, end = max(time[0], stamps[0]), min(time[-1], stamps[-1])
    count = int(min(MOST, max(1.0, (end - begin) // WINDOW)))
    ends = begin + (end - begin) * (np.arange(count) + 1.0) / count
    imu = _thinned(imu)
    spans, found = [], []
    for last in ends.tolist():
        for earlier in EARLIER:
            span = max(begin, last - WINDOW - earlier), last - earlier
            one = _window(gnss, imu, sensors, span, start, antenna)
            if one is not None:
                spans.append(span)
                found.append(one)
                break
    values = np.array(found, dtype=np.float64).reshape(-1, 2)
    return Offsets(np.array(spans).reshape(-1, 2), values[:, 0], values[:, 1])


def receiver_clock(
    gnss: pd.DataFrame,
    imu: pd.DataFrame,
    sensors: ImuUncertainty | None = None,
    antenna: Antenna = Antenna(),  # noqa: B008
) -> tuple[TimeOffset | None, Offsets | None]:
    """Find the offset of a receiver's clock by the whole record and by windows of it.

    Parameters
    ----------
    sensors : ImuUncertainty, optional
        Of a vehicle that drives, whose windows show the offset; without it the whole record does.
    antenna : Antenna
        Its delay and its correlated errors.

    Returns
    -------
    offset : TimeOffset or None
        None where nothing shows it, or both contradict each other. Their errors are common in part:
        the standard deviation is the smaller one.
    windows : Offsets or None
        None without `sensors`.
    """
    scan = time_offset(gnss, imu, antenna.velocity_delay)
    if sensors is None:
        return scan, None
    windows = window_offsets(gnss, imu, sensors, 0.0 if scan is None else scan.offset, antenna)
    joint = windows.joint()
    if joint is None:
        return scan, windows
    offset, sd = joint
    if scan is None:
        return TimeOffset(offset, sd, None, "windows"), windows
    if abs(scan.offset - offset) > AGREED * math.hypot(scan.sd, sd):
        return None, windows
    share = sd**2 / (scan.sd**2 + sd**2)
    offset, sd = share * scan.offset + (1.0 - share) * offset, min(scan.sd, sd)
    return replace(scan, offset=offset, sd=sd), windows


def _thinned(imu: pd.DataFrame) -> pd.DataFrame:
    """Means over as many samples as leave `FAST` a second."""
    time = index_of(imu)
    each = max(1, int(1.0 / (FAST * float(np.median(np.diff(time))))))
    if each == 1:
        return imu
    count = len(time) // each
    columns = [*GYRO, *ACCEL]
    values = values_of(imu, columns)[: count * each].reshape(count, each, -1).mean(axis=1)
    # A rate at its stamp is a mean over the steps about it.
    late = 0.0 if imu.attrs["sampling"] == "mean" else 0.5 * float(np.median(np.diff(time)))
    out = pd.DataFrame(values, pd.Index(time[each - 1 : count * each : each] + late, name="time"))
    out.columns, out.attrs = columns, {**imu.attrs, "sampling": "mean"}
    return out


def _window(
    gnss: pd.DataFrame,
    imu: pd.DataFrame,
    sensors: ImuUncertainty,
    span: tuple[float, float],
    start: float,
    antenna: Antenna,
) -> tuple[float, float] | None:
    """Offset and standard deviation of one window; None where it does not show one."""
    part = imu.loc[span[0] : span[1]]
    stamps, offset = index_of(gnss), start
    if len(part) < 2:
        return None
    found = None
    for _ in range(ROUNDS):
        near = (stamps - offset >= span[0]) & (stamps - offset <= span[1])
        fixes = gnss[near].set_axis(stamps[near] - offset)
        fixes.index.name, fixes.attrs = "time", dict(gnss.attrs)
        if len(fixes) < 2:
            return None
        site = Site(*np.median(values_of(fixes, GEODETIC), axis=0).tolist())
        unknown = replace(antenna, time_offset_sd=UNKNOWN, lever_arm_sd=ARM)
        way = GnssCourse(mounting_yaw_sd_deg=MOUNTING, axle_sd=AXLE)
        try:
            found = way.fit(part, site, sensors, fixes, unknown).search(found)
        except (DataError, DivergenceError):
            return None
        more, sd = found.offset
        known = 1.0 - (sd / UNKNOWN) ** 2
        if not known > 0.5:
            return None
        more, sd = more / known, sd / float(np.sqrt(known))
        offset += more
        if abs(more) < 0.3 * sd:
            break
    return offset, sd


def stamp_step(
    gnss: pd.DataFrame, windows: Callable[[], Offsets] | None = None
) -> ClockStep | None:
    """The first step of the receiver's clock that its stamps and its way show.

    Parameters
    ----------
    windows : callable, optional
        Gives `window_offsets`; called where the way does not decide.

    Returns
    -------
    ClockStep or None
        Certain, or possible where stamps that were regular before and after change between two
        fixes and nothing decides. None of a receiver without regular stamps.

    Notes
    -----
    A receiver measures at whole multiples of an interval. Where its stamps do not go on with them,
    either its clock stepped, by the rest to one of these multiples, or it measured at another time.
    The way from the last fix before to the first one after, at the velocities before and after,
    determines which multiple, or that the stamps are right. Its standard deviation is that of the
    same difference in the rest of the record.
    """
    steps = np.diff(index_of(gnss))
    usual, lone = _irregular(steps)
    if usual is None:
        return None
    lost = ~lone & (np.round(steps / usual) > 1.0) & (steps < SHORT_S)
    ways = _Ways(gnss, usual)
    for k in np.flatnonzero(lone | lost).tolist():
        found = _stamp_step(ways, k, bool(lone[k]), windows)
        if found is not None:
            return found
    return None


def unsure_steps(gnss: pd.DataFrame) -> list[tuple[float, float]]:
    """Times of outages over which regular stamps change, and a standard deviation of the step.

    The receiver began anew, and its clock may have stepped: by the rest to a multiple of its
    interval, of which no way over an outage says which. The least two are within one interval.
    """
    time = index_of(gnss)
    steps = np.diff(time)
    usual, lone = _irregular(steps)
    if usual is None:
        return []
    long = np.flatnonzero(lone & (steps > SHORT * usual))
    sd = min(max(usual, LEAST_STEP), LARGEST)
    return [(float(0.5 * (time[k] + time[k + 1])), sd) for k in long.tolist()]


def _irregular(steps: Array) -> tuple[float | None, NDArray[np.bool_]]:
    """Usual interval of regular stamps, s, and the few intervals that are not a multiple of it.

    None where stamps are not regular.
    """
    if len(steps) < FEWEST - 1:
        return None, np.zeros(0, np.bool_)
    usual = float(np.median(steps))
    counts = np.maximum(np.round(steps / usual), 1.0)
    off = np.abs(steps - usual * counts)
    odd = off > max(IRREGULAR * usual, BEYOND * 1.4826 * float(np.median(off)))
    odd[[0, -1]] = False
    lone = odd & ~np.roll(odd, 1) & ~np.roll(odd, -1)
    if odd.sum() > FEW or (odd & ~lone).any():
        return None, lone
    return usual, lone


def _stamp_step(
    ways: _Ways, k: int, irregular: bool, windows: Callable[[], Offsets] | None
) -> ClockStep | None:
    """Step between fixes k and k + 1, if there is one; `irregular`: their interval is."""
    time, usual = ways.time, ways.usual
    interval = float(time[k + 1] - time[k])
    # Of no step, and of each whole number of intervals that there can have been.
    whole = usual * np.arange(1.0, np.ceil((interval + LARGEST) / usual) + 1.0)
    size = np.concatenate([[0.0], interval - whole])
    size = size[np.abs(size) <= LARGEST]
    if not irregular:
        # Fixes are lost more often than clocks step, by just as much, and forward.
        size = np.array([0.0, interval - usual])
    cost = ways.misfit(k, interval - size, usually=irregular)
    # A clock that goes back repeats stamps, which are left out; one that goes forward loses none.
    cost[(size != 0.0) & (interval > usual) & (interval - size > 1.5 * usual)] += COINCIDENCE
    if not irregular:
        cost[size != 0.0] += LOST
    if windows is not None and _undecided(cost, size):
        cost += _by_windows(windows(), time[k], time[k + 1], size)
    best = int(np.argmin(cost))
    if size[best] == 0.0:
        if not irregular or cost[1:].min(initial=np.inf) > cost[0] + CERTAIN:
            return None
        if interval > SHORT * usual:
            return None
        best = 1 + int(np.argmin(cost[1:]))
    elif cost[0] < cost[best] + CERTAIN and (not irregular or interval > SHORT * usual):
        return None
    likely = cost < cost[best] + CERTAIN
    return ClockStep(
        float(size[best]),
        float(np.ptp(size[likely])),
        float(time[k]),
        float(time[k + 1]),
        in_stamps=True,
        certain=not _undecided(cost, size),
    )


def _undecided(cost: Array, size: Array) -> bool:
    """Whether another step, or none, is nearly as likely as the best."""
    return bool((cost < cost.min() + CERTAIN).sum() > 1)


def _by_windows(windows: Offsets, before: float, after: float, size: Array) -> Array:
    """Chi-square of each size of a step by the offsets of windows before and after it."""
    sides = [
        Offsets(windows.spans[at], windows.offset[at], windows.sd[at])
        for at in (windows.spans[:, 1] <= before, windows.spans[:, 0] >= after)
    ]
    found = [
        (float(one.offset[0]), float(one.sd[0])) if len(one.sd) == 1 else one.joint()
        for one in sides
    ]
    if found[0] is None or found[1] is None:
        return np.zeros(len(size))
    (left, left_sd), (right, right_sd) = found[0], found[1]
    square = np.square((right - left - size) / np.hypot(left_sd, right_sd))
    return np.asarray(np.minimum(square, MOST_BY_WINDOWS))


class _Ways:
    """Ways between fixes, beside those that the way before and after explains.

    From a line through some fixes before, and one through as many after: half way between them
    both are wrong by the same, half the acceleration times the square of the time. The number is
    the one that explains best in the rest of the record; or the velocities are measured.
    """

    def __init__(self, gnss: pd.DataFrame, usual: float) -> None:
        self.time, self.usual = index_of(gnss), usual
        place = values_of(gnss, GEODETIC)
        place = place_difference(place, place[0])[:, :2]
        self._regular = np.abs(np.diff(self.time) - usual) < IRREGULAR * usual
        #: Place and velocity at each fix, by those up to it and from it on, (2, n, 2) each.
        self._lines = [
            self._line(place, count) for count in LINES if count * FEW < len(place) - FEW
        ]
        measured = np.isfinite(values_of(gnss, VELOCITY_SD[:2])).all(axis=1)
        if measured.all():
            velocity = values_of(gnss, VELOCITY)[:, :2]
            self._lines.append((np.stack([place, place]), np.stack([velocity, velocity])))

    def _line(self, place: Array, count: int) -> tuple[Array, Array]:
        past = np.arange(1.0 - count, 1.0)
        rate = (past - past.mean()) / np.square(past - past.mean()).sum()
        here = 1.0 / count - past.mean() * rate
        at, speed = np.full((2, len(place), 2), np.nan), np.full((2, len(place), 2), np.nan)
        ends = np.flatnonzero(sliding_window_view(self._regular, count - 1).all(axis=1))
        of = sliding_window_view(place, count, axis=0)[ends]
        at[0, ends + count - 1], speed[0, ends + count - 1] = of @ here, of @ rate / self.usual
        at[1, ends], speed[1, ends] = of[:, :, ::-1] @ here, of[:, :, ::-1] @ -rate / self.usual
        return at, speed

    def misfit(self, k: int, elapsed: Array, *, usually: bool) -> Array:
        """Chi-square of the way from fix k to the next if it took each of these times, s.

        By the usual differences, or by the largest one of the record.
        """
        counts = np.maximum(np.round(elapsed / self.usual), 1.0).astype(int)
        out = np.zeros(len(elapsed))
        for i, count in enumerate(counts.tolist()):
            best = np.inf
            for place, rate in self._lines:
                way = place[1, k + 1] - place[0, k]
                off = way - elapsed[i] * 0.5 * (rate[0, k] + rate[1, k + 1])
                variance = self._variance(place, rate, count, usually)
                if np.isfinite(off).all() and variance < best:
                    best, out[i] = variance, float(off @ off) / variance
        return out

    def _variance(self, place: Array, rate: Array, count: int, usually: bool) -> float:
        """Variance of the difference, m², in the rest of the record; infinite if too short."""
        if count >= len(self._regular):
            return np.inf
        begin = np.flatnonzero(sliding_window_view(self._regular, count).all(axis=1))
        way = place[1, begin + count] - place[0, begin]
        off = way - 0.5 * count * self.usual * (rate[0, begin] + rate[1, begin + count])
        square = np.square(off[np.isfinite(off).all(axis=1)]).sum(axis=1)
        if len(square) < FEWEST // 2:
            return np.inf
        found = float(np.quantile(square, 0.9)) / NINETY
        if not usually:
            # The largest of n of chi-square with two degrees of freedom is 2 ln n.
            found = max(found, float(square.max()) / (2.0 * np.log(len(square))))
        return found + float(np.finfo(float).tiny)


def step_finding(
    gnss: pd.DataFrame, imu: pd.DataFrame, step: ClockStep, *, corrected: bool = False
) -> Finding:
    """The finding of a step, dated by the stamps or the way between fixes that show it."""
    codes = {
        "receiver": "navigation.clock-step-of-receiver",
        "sensors": "navigation.clock-step-of-sensors",
    }
    begin, end, which = (
        (step.after, step.before, "receiver") if step.in_stamps else _date(gnss, imu, step)
    )
    return Finding(
        "navigation.clock-step-corrected" if corrected else codes[which],
        file=source_of(gnss),
        quantity="time",
        size=step.size,
        sd=step.sd,
        time=0.5 * (begin + end),
        begin=begin,
        end=end,
    )


def _date(gnss: pd.DataFrame, imu: pd.DataFrame, step: ClockStep) -> tuple[float, float, str]:
    """Between which instants a step occurs, and of which clock it is.

    At a step of the receiver's clock the way from a fix to the next does not go with their stamps
    and the ways before and after. Otherwise the step is of the sensors' clock, at their longest
    interval, or in the middle where they have none.
    """
    stamps = index_of(gnss)
    rows = np.flatnonzero((stamps >= step.after) & (stamps <= step.before))
    time, place = stamps[rows], values_of(gnss, GEODETIC)[rows]
    if len(rows) > 4:
        steps = np.diff(time)
        way = ways_between(place)
        padded = np.pad(way / steps, 2, "edge")
        near = np.median(np.lib.stride_tricks.sliding_window_view(padded, 5), axis=1)
        # Time that the way takes beyond its stamps, at the speed about it.
        beyond = np.where(near > 1.0, way / np.maximum(near, 1.0) - steps, 0.0)
        k = int(np.argmin(np.abs(beyond + step.size)))
        if abs(beyond[k] + step.size) < AGREES * abs(step.size):
            return float(time[k]), float(time[k + 1]), "receiver"
    own = index_of(imu)
    near_own = own[(own >= step.after) & (own <= step.before)]
    gaps = np.diff(near_own)
    if len(gaps) and gaps.max() > 5.0 * np.median(gaps):
        k = int(np.argmax(gaps))
        return float(near_own[k]), float(near_own[k + 1]), "sensors"
    return float(step.after), float(step.before), "sensors"

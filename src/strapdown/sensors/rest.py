"""Stationary stretches of a log, and the gyro bias from them."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from strapdown._kernels.sums import window_moments
from strapdown.constants import Indices, Triple
from strapdown.dsp.samples import occupied_grid
from strapdown.errors import DataError
from strapdown.sensors.triad_errors import triad_of
from strapdown.tables import ACCEL, GYRO, MAG
from strapdown.tables.checks import Array, view_of
from strapdown.tables.on_disk import let_go

# Window length: long enough for a meaningful standard deviation, short enough to detect a pause of
# a second.
WINDOW = 0.5  # s
LEAST_SAMPLES = 5
LEAST_LENGTH = 1.0  # s
# The quietest twentieth of the windows defines the noise of this sensor; the sensor is stationary
# within three times that.
QUIET_QUANTILE = 0.05
QUIET_FACTOR = 3.0
# Consumer sensors at rest stay below this and every hand exceeds it, so that the quietest moment of
# a log in continuous motion is not taken for rest.
MAX_GYRO_SD = 0.03  # rad/s, of the three axes together
MAX_ACCEL_SD = 0.3  # m/s²
# A vehicle that speeds up or turns smoothly shakes neither sensor: specific force or rate changes
# over seconds by more than biases do and than four standard deviations of the means of windows.
LAGS = (1.0, 2.0, 4.0, 8.0)  # s
MAX_ACCEL_CHANGE = 0.1  # m/s²
MAX_RATE_CHANGE = 0.0035  # rad/s, 0.2 deg/s
# What remains beside such a change is a rest where it does not continue it: where the three inner
# ones of five parts differ by a tenth of that in 8 s at most, beyond noise.
PARTS_BESIDE, SHARE_BESIDE = 5, 0.1
# A stretch too short for that is a rest where it changes by a share of its mean rate at most: a
# turning point of 10 deg/s bends by more within a second, tremor on a bias of some deg/s by less.
SHARE_OF_MEAN = 0.03
# The zero-rate output of a low-cost gyro may be off by 20 deg/s (MPU-6050 data sheet, revision 3.4,
# section 6.1).
MAX_MEAN_RATE = 0.36  # rad/s
SAME_BIAS = 0.01  # rad/s: rests of one log share their bias to within this
# A mean rate about the vertical is a bias or a steady turn. Gyros of phones are specified to
# 1 deg/s or less (ICM-42688-P: 0.5; LSM6DSO: 1), older hobby parts show several.
COULD_TURN = 0.0175  # rad/s, 1 deg/s
# Parts of a rest whose mean fields are compared; a share of the field by which they may differ.
TURN_PARTS, TURNED = 8, 0.1
# A noise-free (simulated) sensor is at rest where it is constant to rounding.
ROUNDING = 1e-9  # rad/s
# Number of parts of a rest whose means give the standard deviation of the overall mean.
TINY = 1e-300
LEAST_PARTS, MOST_PARTS = 4, 20


@dataclass(frozen=True)
class RestStretch:
    """An interval in which the sensor did not rotate.

    Attributes
    ----------
    start, end : float, s
    gyro_mean : tuple of float, rad/s
        Mean of each gyro: its bias, where the Earth's 15 deg/h is negligible.
    gyro_sd : tuple of float, rad/s
    accel_mean : tuple of float or None, m/s²
    gyro_mean_sd : tuple of float or None, rad/s
        Standard deviation of the mean, from the scatter of the means of its parts, so that
        vibration and slow drift count; not from the samples as if they were independent.
    accel_sd, accel_mean_sd : tuple of float or None, m/s²
        As for the gyro.
    grade : {'still', 'shaking', 'steady', 'stated'}
        Quiet within the noise of the sensor; shaken about one attitude, so that only the
        means are those of a stationary sensor; quiet and without rotation, but perhaps at
        speed; or stated by the user.
    """

    start: float
    end: float
    gyro_mean: Triple
    gyro_sd: Triple
    accel_mean: Triple | None
    gyro_mean_sd: Triple | None = None
    accel_sd: Triple | None = None
    accel_mean_sd: Triple | None = None
    grade: str = "still"


@dataclass(frozen=True)
class GyroBiasCourse:
    """Gyro bias over a log, from its stationary intervals.

    Attributes
    ----------
    time : tuple of float, s
        Middle of each interval.
    mean, sd : tuple of three float per interval, rad/s
        Bias in each interval, and its standard deviation.
    average, average_sd : tuple of float, rad/s
        Weighted mean over the intervals. The sd is inflated if the intervals scatter by more
        than their own.
    drift, drift_sd : tuple of float or None, rad/s²
        Slope of a line through the intervals; None for a single one.
    scatter : tuple of float or None
        Root mean square distance of the intervals from the average, in units of their own
        sd: near 1 for a constant bias, far above for a drifting one. None for a single
        one.
    """

    time: tuple[float, ...]
    mean: tuple[Triple, ...]
    sd: tuple[Triple, ...]
    average: Triple
    average_sd: Triple
    drift: Triple | None
    drift_sd: Triple | None
    scatter: Triple | None


def find_rests(imu: pd.DataFrame) -> tuple[RestStretch, ...]:
    """Find the stationary stretches of a log from its own noise.

    Parameters
    ----------
    imu : DataFrame
        An Imu table.

    Returns
    -------
    tuple of RestStretch
        In order of time, each at least 1 s long. A rate that changes by 0.2 deg/s or a specific
        force that changes by 0.1 m/s² within 8 s, beyond noise, is motion. A single stretch does
        not distinguish a rotation at a constant rate about the vertical from a bias: it is rejected
        only if another stretch of the log has a bias that differs by more than 0.01 rad/s; see
        `could_be_a_turn`. Neither is a steady acceleration distinguished from a tilt.
    """
    time, gyro, accel = _signals(imu)
    return of_one_bias([_stretch(time, gyro, accel, *rows) for rows in _runs_of(time, gyro, accel)])


def begins_at_rest(rests: Sequence[RestStretch], begin: float) -> RestStretch | None:
    """Return the rest that levels a log: the first, if it begins within a second of `begin`, s."""
    return rests[0] if rests and rests[0].start - begin <= 1.0 else None


def find_rest_spans(imu: pd.DataFrame) -> tuple[tuple[float, float], ...]:
    """Begin and end, s, of the rests of `find_rests`, without the statistics of each."""
    time, gyro, accel = _signals(imu)
    rows = _runs_of(time, gyro, accel)
    if len(rows) > 1:  # one has no other to differ from
        means = [triad_of(_of_columns(np.mean, gyro[a:b])) for a, b in rows]
        rows = [one for one, same in zip(rows, _share_bias(means), strict=True) if same]
    return tuple((float(time[a]), float(time[b - 1])) for a, b in rows)


def _signals(imu: pd.DataFrame) -> tuple[Array, Array, Array | None]:
    accel = _triad(imu, ACCEL) if set(ACCEL) <= set(imu.columns) else None
    return imu.index.to_numpy(dtype=np.float64), _triad(imu, GYRO), accel


def _runs_of(time: Array, gyro: Array, accel: Array | None) -> list[tuple[int, int]]:
    """First and one-past-last sample of each stationary stretch."""
    starts, ends = _windows(time)
    if not len(starts):
        return []
    rate, variance = _window_moments(gyro, starts, ends)
    gyro_sd = np.sqrt(variance.sum(axis=1))
    quiet = max(QUIET_FACTOR * float(np.quantile(gyro_sd, QUIET_QUANTILE)), ROUNDING)
    still = gyro_sd <= min(quiet, MAX_GYRO_SD)
    still &= np.abs(rate).max(axis=1) <= MAX_MEAN_RATE
    begins, count = time[starts], ends - starts
    slow = [(rate, _sd_beside_slope(begins, rate, gyro_sd, count), MAX_RATE_CHANGE)]
    if accel is not None:
        force, variance = _window_moments(accel, starts, ends)
        accel_sd = np.sqrt(variance.sum(axis=1))
        still &= accel_sd <= MAX_ACCEL_SD
        sd = _sd_beside_slope(begins, force, accel_sd, count)
        slow.append((force, sd, MAX_ACCEL_CHANGE))
    drifts = _drifts(begins, slow, still)
    joined = begins[1:] - time[ends[:-1] - 1] < LEAST_LENGTH
    return [
        (int(starts[a]), int(ends[b]))
        for a, b in _runs(still & ~drifts, joined)
        if time[ends[b] - 1] - begins[a] >= LEAST_LENGTH
        and not _bends(begins, slow, a, b)
        and not _continues(begins, slow, drifts, np.arange(a, b + 1))
    ]


def _windows(time: Array) -> tuple[Indices, Indices]:
    """First and one-past-last sample of windows that overlap by half."""
    first: list[Indices] = [np.empty(0, dtype=np.int64)]
    past: list[Indices] = [np.empty(0, dtype=np.int64)]
    # Segment by segment, because a grid across a clock reset could be arbitrarily long.
    holes = np.flatnonzero(np.diff(time) > LEAST_LENGTH) + 1
    for piece in np.split(np.arange(time.size), holes):
        end = time[piece[-1]]
        grid = np.arange(time[piece[0]], end - WINDOW, 0.5 * WINDOW)
        last = max(int(np.searchsorted(time, end - WINDOW)), int(piece[0]))
        first += [np.searchsorted(time, grid), np.array([last])]
        past += [np.searchsorted(time, grid + WINDOW), piece[-1:] + 1]
    starts, ends = np.concatenate(first), np.concatenate(past)
    enough = ends - starts >= LEAST_SAMPLES
    return starts[enough].astype(np.int64), ends[enough].astype(np.int64)


def _triad(imu: pd.DataFrame, columns: list[str]) -> Array:
    """Columns of a triad, (n, 3), without a copy where each is contiguous, as of a log."""
    view = view_of(imu, columns)
    return view if _by_column(view) else imu[columns].to_numpy(dtype=np.float64)


def _by_column(values: Array) -> bool:
    return values.strides[0] == values.itemsize


def _window_moments(values: Array, starts: Indices, ends: Indices) -> tuple[Array, Array]:
    """Means and variances, (m, k), of columns (n, k) over windows."""
    windows = np.array(starts), np.array(ends)
    width = 1 if _by_column(values) else values.shape[1]
    parts = []
    for k in range(0, values.shape[1], width):
        mean, variance = (np.empty((len(starts), width)) for _ in range(2))
        window_moments(np.ascontiguousarray(values[:, k : k + width]), *windows, mean, variance)
        let_go(values)
        parts.append((mean, variance))
    mean, variance = (np.hstack(both) for both in zip(*parts, strict=True))
    return mean, variance


def _of_columns(statistic: Callable[..., Array], values: Array, **options: int) -> Array:
    """A statistic of each column; of contiguous ones in turn, which needs the memory of one."""
    if not _by_column(values):
        return statistic(values, axis=0, **options)
    found = [statistic(column, **options) for column in values.T]
    let_go(values)
    return np.array(found)


def _sd_beside_slope(start: Array, mean: Array, sd: Array, count: Indices) -> Array:
    """Standard deviation of the means of windows, (n,), without what their slope adds to it.

    A smooth motion is a slope within half a second: as noise it would hide itself. `start` ((n,),
    s), `mean` ((n, 3)) and `sd` ((n,)) of each window, `count` of its samples. A slope is that
    between the windows before and after.
    """
    before, after = (np.clip(np.arange(len(start)) + k, 0, len(start) - 1) for k in (-1, 1))
    span = np.maximum(start[after] - start[before], 0.5 * WINDOW)
    slope = np.linalg.norm(mean[after] - mean[before], axis=1) / span
    of_slope = np.square(slope * WINDOW) / 12.0
    return np.asarray(np.sqrt(np.maximum(np.square(sd) - of_slope, 0.0) / count))


def _drifts(
    start: Array,
    slow: Sequence[tuple[Array, Array, float]],
    still: NDArray[np.bool_],
    lags: Sequence[float] = LAGS,
) -> NDArray[np.bool_]:
    """Whether, within still windows, the mean of some is not that of others up to 8 s later.

    `start` ((n,), s) of each window; `slow`: means ((n, 3)), their standard deviations ((n,)), and
    the change of a stationary sensor. Both means are over half a lag, so that a jolt is not taken
    for drift. Windows between two that differ are marked, at the shortest lag first; marked ones
    are not compared over a longer lag.
    """
    index, left = np.arange(len(start)), still.copy()
    totals = [np.vstack([np.zeros(3), np.cumsum(mean, axis=0)]) for mean, _, _ in slow]
    for lag in lags:
        past = np.maximum(np.searchsorted(start, start + 0.5 * lag - 1e-9), index + 1)
        ahead = np.minimum(np.searchsorted(start, start + lag - 1e-9), len(start) - 1)
        last, count = past[ahead] - 1, np.cumsum(left)
        together = left & (count[last] - count == last - index)
        together &= start[last] - start <= 1.5 * lag + WINDOW
        changes = np.zeros(len(start) + 1, dtype=np.int64)
        for total, (_, sd, most) in zip(totals, slow, strict=True):
            average = (total[past] - total[:-1]) / (past - index)[:, None]
            limit = most + 4.0 * np.sqrt(sd**2 + sd[ahead] ** 2)
            moved = together & (np.linalg.norm(average[ahead] - average, axis=1) > limit)
            np.add.at(changes, np.flatnonzero(moved), 1)
            np.add.at(changes, last[moved] + 1, -1)
        left &= np.cumsum(changes)[:-1] == 0
    return np.asarray(still & ~left)


def _bends(start: Array, slow: Sequence[tuple[Array, Array, float]], first: int, last: int) -> bool:
    """Whether a run of windows too short for `_drifts` differs at begin, middle and end.

    By more than a share of the mean rate, which is a bias then, unless it is below 1 deg/s: a hand
    that keeps still moves by less, the turning point of a motion by more.
    """
    rate = float(np.linalg.norm(slow[0][0][first : last + 1].mean(axis=0)))
    if start[last] - start[first] > 1.5 * LAGS[0] or rate < COULD_TURN:
        return False
    at = np.array([first, (first + last) // 2, last])
    for (mean, sd, most), of_mean in zip(slow, (SHARE_OF_MEAN * rate, 0.0), strict=False):
        for one, other in itertools.combinations(at, 2):
            limit = most + of_mean + 4.0 * math.hypot(sd[one], sd[other])
            if np.linalg.norm(mean[other] - mean[one]) > limit:
                return True
    return False


def _continues(
    start: Array,
    slow: Sequence[tuple[Array, Array, float]],
    drifts: NDArray[np.bool_],
    run: Indices,
) -> bool:
    """Whether a run of windows is beside a drift and continues it; see `_drifts`."""
    if not drifts[max(run[0] - 1, 0) : run[-1] + 2].any():
        return False
    if run.size < PARTS_BESIDE:
        return True
    inner = np.array_split(run, PARTS_BESIDE)[1:-1]
    middle = [float(start[part].mean()) for part in inner]
    for mean, sd, most in slow:
        noise = 4.0 * math.sqrt(2.0 / min(part.size for part in inner)) * float(sd[run].max())
        means = [mean[part].mean(axis=0) for part in inner]
        for one, other in ((0, 1), (1, 2), (0, 2)):
            slowly = max((middle[other] - middle[one]) / LAGS[-1], 1.0)
            change = np.linalg.norm(means[other] - means[one])
            if change > SHARE_BESIDE * most * slowly + noise:
                return True
    return False


def _runs(still: NDArray[np.bool_], joined: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First and last window of each run of quiet windows, without gaps of a second."""
    runs: list[tuple[int, int]] = []
    for k in np.flatnonzero(still).tolist():
        if runs and runs[-1][1] == k - 1 and joined[k - 1]:
            runs[-1] = (runs[-1][0], k)
        else:
            runs.append((k, k))
    return runs


def rest_between(
    imu: pd.DataFrame, start: float, end: float, *, grade: str = "stated"
) -> RestStretch:
    """Make a rest from a given stretch of a log, without testing it.

    Parameters
    ----------
    imu : DataFrame
        An Imu table.
    start, end : float, s
        First and last stamp, both included.
    grade : str, optional
        Grade assigned to it.

    Returns
    -------
    RestStretch
        Its ``*_mean_sd`` are the standard deviations of the means: they show a hand that holds the
        sensor.

    Raises
    ------
    DataError
        The stretch has fewer than five samples.
    """
    time = imu.index.to_numpy(dtype=np.float64)
    a, b = int(np.searchsorted(time, start)), int(np.searchsorted(time, end, side="right"))
    if b - a < LEAST_SAMPLES:
        raise DataError(
            "sensors.samples-between-too-few-mean",
            file=imu.attrs.get("source"),
            quantity="rest",
            b=max(b - a, 0),
            start=start,
            end=end,
            least_samples=LEAST_SAMPLES,
        )
    gyro = _triad(imu, GYRO)
    accel = _triad(imu, ACCEL) if set(ACCEL) <= set(imu.columns) else None
    return replace(_stretch(time, gyro, accel, a, b), grade=grade)


def sd_of_mean(time: Array, values: Array) -> Array:
    """Standard deviation of the mean of a stretch.

    `time` ((n,), s). `values` ((n, k)). Returns (k,): the larger of ``sd / sqrt(n)``, valid for
    white noise, and the estimate from the means of 4 to 20 parts of at least half a second, valid
    for noise correlated over less than a part (batch means; Law and Kelton 1984,
    doi:10.1287/opre.32.6.1241). A stretch of less than 2 s is too short for that: its n values
    count as ``n (1 - r) / (1 + r)``, with r the autocorrelation from value to value.
    """
    return _sd_of_mean(time, values, _of_columns(_squares, values))


def _squares(values: Array, axis: int = 0) -> Array:
    """Sum of squares about the mean, of (n,) or (n, k)."""
    off = values - values.mean(axis=axis)
    return np.asarray(np.multiply(off, off, out=off).sum(axis=axis))


def _sd_of_mean(time: Array, values: Array, squares: Array) -> Array:
    """Return `sd_of_mean`; `squares`: of the values about their mean."""
    n = len(values)
    white = np.sqrt(squares / (n - 1)) / np.sqrt(n)
    parts = min(MOST_PARTS, int((time[-1] - time[0]) / WINDOW))
    edges = np.linspace(0, n, max(parts, 1) + 1).astype(np.int64)
    if parts < LEAST_PARTS or np.diff(edges).min() < 1:
        off = values - values.mean(axis=0)
        power = np.maximum(np.square(off).sum(axis=0), TINY)
        r = np.clip((off[1:] * off[:-1]).sum(axis=0) / power, 0.0, 1.0 - 2.0 / n)
        return np.asarray(white * np.sqrt((1.0 + r) / (1.0 - r)), dtype=np.float64)
    means, _ = _window_moments(values, edges[:-1], edges[1:])
    return np.asarray(np.maximum(white, means.std(axis=0, ddof=1) / np.sqrt(parts)))


def could_be_a_turn(rest: RestStretch) -> bool:
    """Whether the mean rate of a rest could be that of a steady turn about the vertical.

    About another axis than the vertical a turn would tilt the specific force. True as well if the
    rate exceeds 1 deg/s and specific force is missing.
    """
    mean = np.array(rest.gyro_mean)
    if rest.accel_mean is None:
        return bool(np.linalg.norm(mean) > COULD_TURN)
    force = np.array(rest.accel_mean)
    return bool(abs(mean @ force) > COULD_TURN * np.linalg.norm(force))


def field_turned(imu: pd.DataFrame, rest: RestStretch) -> bool:
    """Whether the magnetic field turns in a rest: it is a steady, slow turn then."""
    if not set(MAG) <= set(imu.columns):
        return False
    mag = imu.loc[rest.start : rest.end, MAG].dropna().to_numpy(dtype=np.float64)
    parts = [part.mean(axis=0) for part in np.array_split(mag, TURN_PARTS) if len(part)]
    if len(parts) < TURN_PARTS:
        return False
    off = np.linalg.norm(np.array(parts) - parts[0], axis=1)
    return bool(off.max() > TURNED * np.linalg.norm(parts[0]))


def _stretch(time: Array, gyro: Array, accel: Array | None, a: int, b: int) -> RestStretch:
    of_gyro = _moments(time[a:b], gyro[a:b])
    of_accel = (None, None, None) if accel is None else _moments(time[a:b], accel[a:b])
    means, spreads, errors = zip(of_gyro, of_accel, strict=True)
    return RestStretch(
        float(time[a]),
        float(time[b - 1]),
        means[0],
        spreads[0],
        means[1],
        errors[0],
        spreads[1],
        errors[1],
    )


def _moments(time: Array, values: Array) -> tuple[Triple, Triple, Triple]:
    """Mean, standard deviation, and that of the mean of a stretch."""
    squares = _of_columns(_squares, values)
    return (
        triad_of(_of_columns(np.mean, values)),
        triad_of(np.sqrt(squares / len(values))),
        triad_of(_sd_of_mean(time, values, squares)),
    )


def of_one_bias(rests: list[RestStretch]) -> tuple[RestStretch, ...]:
    """Select rests whose bias agrees with the smallest; a steady slow rotation is not a rest."""
    alike = _share_bias([r.gyro_mean for r in rests])
    return tuple(r for r, same in zip(rests, alike, strict=True) if same)


def _share_bias(means: Sequence[Triple]) -> list[bool]:
    """Whether the mean rate of each rest agrees with the smallest."""
    if not means:
        return []
    least = min(means, key=lambda mean: float(np.linalg.norm(mean)))
    return [bool(np.linalg.norm(np.subtract(mean, least)) <= SAME_BIAS) for mean in means]


# Stationary but vibrating: a parked car with people in it, a sensor on a running machine.

# Vibration about one attitude leaves half-second means constant; driving does not. In a car at 2 to
# 14 m/s on streets and in one on a motorway, no window of 4 s had means that scatter by less than
# 0.33 deg/s and 0.084 m/s² (root of the summed variances of the axes). In a parked car with people
# getting in and doors slammed they scatter by 0.03 to 0.19 deg/s and 0.004 to 0.061 m/s².
SHAKING_WINDOW = 4.0  # s
BLOCKS = 8
STEP = 1.0  # s
SHAKING_LAGS = (4.0, 8.0)  # s
MAX_GYRO_SCATTER = 0.0044  # rad/s, 0.25 deg/s: root of the summed variances of the block means
MAX_ACCEL_SCATTER = 0.065  # m/s²
# A hand or a foot exceeds these regardless of its means, and so does a vibrating motor mount.
SHAKING_MAX_GYRO_SD = 0.1  # rad/s
SHAKING_MAX_ACCEL_SD = 1.0  # m/s²
NEAR_GRAVITY = (0.8 * 9.81, 1.2 * 9.81)  # m/s²


def find_shaking_rests(imu: pd.DataFrame) -> tuple[RestStretch, ...]:
    """Find stretches that vibrate about one attitude, from the slow part of the signals.

    Parameters
    ----------
    imu : DataFrame
        An Imu table with acceleration.

    Returns
    -------
    tuple of RestStretch
        In order of time, each at least 4 s long, of grade ``shaking``. They include those that
        `sensors.rest.find_rests` finds, if long enough. Empty without an accelerometer, because a
        gyro alone does not distinguish a parked car from a straight road.

    Notes
    -----
    A window of 4 s is divided into eight parts. It is a rest where the means of the parts stay
    within 0.25 deg/s for the gyro and 65 mm/s² for the specific force. Constant velocity on a
    perfectly smooth road is indistinguishable for an inertial sensor. The limits are therefore set
    below the scatter on real roads, and the grade marks the remaining risk.
    """
    if not set(ACCEL) <= set(imu.columns):
        return ()
    time = imu.index.to_numpy(dtype=np.float64)
    values = imu[[*GYRO, *ACCEL]].to_numpy(dtype=np.float64)
    end = time[-1] - SHAKING_WINDOW + 1e-9
    starts = occupied_grid(time, end, STEP, SHAKING_WINDOW)
    shakes, mean, sd = _shaking_means(time, values, starts)
    if not shakes.any():
        return ()
    slow = [
        (mean[:, :3], sd[:, 0], MAX_RATE_CHANGE),
        (mean[:, 3:], sd[:, 1], MAX_ACCEL_CHANGE),
    ]
    drifts = _drifts(starts, slow, shakes, SHAKING_LAGS)
    spans: list[tuple[float, float]] = []
    kept = np.flatnonzero(shakes & ~drifts)
    # Windows that overlap or touch are of one rest, if they agree: it may have moved between them.
    apart = np.diff(starts[kept]) > SHAKING_WINDOW
    for means, sd_of, most in slow:
        noise = 4.0 * np.hypot(sd_of[kept[1:]], sd_of[kept[:-1]])
        apart |= np.linalg.norm(np.diff(means[kept], axis=0), axis=1) > most + noise
    for run in np.split(kept, np.flatnonzero(apart) + 1):
        if run.size and not _continues(starts, slow, drifts, run):
            begin, end = float(starts[run[0]]), float(starts[run[-1]]) + SHAKING_WINDOW
            spans.append((max(begin, spans[-1][1]) if spans else begin, end))
    spans = [(a, b) for a, b in spans if b - a >= LEAST_LENGTH]
    return of_one_bias([rest_between(imu, a, b, grade="shaking") for a, b in spans])


def _shaking_means(
    time: Array, values: Array, starts: Array
) -> tuple[NDArray[np.bool_], Array, Array]:
    """Windows that vibrate about one attitude, (m,); means (m, 6), and sd of either triad (m, 2).

    Both are zero for other windows.
    """
    shakes, count = np.zeros(len(starts), dtype=np.bool_), len(starts)
    mean, sd = np.zeros((count, 6)), np.zeros((count, 2))
    offsets = np.linspace(0.0, SHAKING_WINDOW, BLOCKS + 1)
    edges = np.searchsorted(time, starts[:, None] + offsets)
    full = np.flatnonzero(np.diff(edges, axis=1).min(axis=1) >= 3)
    edges = edges[full]
    of, variance = _window_moments(values, edges[:, 0], edges[:, -1])
    means, _ = _window_moments(values, edges[:, :-1].ravel(), edges[:, 1:].ravel())
    means = means.reshape(-1, BLOCKS, 6)
    scatter = means.var(axis=1)
    size, largest = np.linalg.norm(of[:, 3:], axis=1), np.linalg.norm(of[:, :3], axis=1)
    good = (
        (np.sqrt(variance[:, :3].sum(axis=1)) <= SHAKING_MAX_GYRO_SD)
        & (np.sqrt(variance[:, 3:].sum(axis=1)) <= SHAKING_MAX_ACCEL_SD)
        & (size >= NEAR_GRAVITY[0])
        & (size <= NEAR_GRAVITY[1])
        & (largest <= MAX_MEAN_RATE)
        & (np.sqrt(scatter[:, :3].sum(axis=1)) <= MAX_GYRO_SCATTER)
        & (np.sqrt(scatter[:, 3:].sum(axis=1)) <= MAX_ACCEL_SCATTER)
    )
    # From block to block, so that drift does not count as noise.
    noise = 0.5 * np.square(np.diff(means[good], axis=1)).mean(axis=1)
    shakes[full[good]], mean[full[good]] = True, of[good]
    sd[full[good]] = np.sqrt(noise.reshape(-1, 2, 3).sum(axis=2) / BLOCKS)
    return shakes, mean, sd


def find_rests_of_every_grade(imu: pd.DataFrame) -> tuple[RestStretch, ...]:
    """Find the ``still`` rests of a log, and between them those with vibration.

    Parameters
    ----------
    imu : DataFrame
        An Imu table.

    Returns
    -------
    tuple of RestStretch
        In order of time, without overlaps. A shaking rest that touches a still one is merged with
        it into one rest over both, of grade ``shaking``, if it is longer by more than a window on
        either side; otherwise the still one is unchanged.
    """
    still = list(find_rests(imu))
    found: list[RestStretch] = []
    for shaking in find_shaking_rests(imu):
        inside = [r for r in still if r.start < shaking.end and shaking.start < r.end]
        start = min([shaking.start, *(r.start for r in inside)])
        end = max([shaking.end, *(r.end for r in inside)])
        covered = math.fsum(r.end - r.start for r in inside)
        if inside and end - start - covered <= SHAKING_WINDOW:
            continue
        still = [r for r in still if r not in inside]
        whole = rest_between(imu, start, end, grade="shaking") if inside else shaking
        found.append(replace(whole, grade="shaking"))
    # A still rest may reach into two shaking ones.
    return _apart(sorted([*still, *found], key=lambda r: r.start), imu)


def _apart(rests: list[RestStretch], imu: pd.DataFrame) -> tuple[RestStretch, ...]:
    apart: list[RestStretch] = []
    for rest in rests:
        if apart and rest.start <= apart[-1].end:
            last = apart.pop()
            rest = rest_between(imu, last.start, max(last.end, rest.end), grade="shaking")
        apart.append(rest)
    return tuple(apart)


# Gyro bias over a log, from its rests.

# In a noise-free simulation the means are exact to rounding.
LEAST_SD = 1e-12  # rad/s


def gyro_bias_from_rests(rests: Sequence[RestStretch]) -> GyroBiasCourse:
    """Estimate the bias of a gyro, and its drift, from the rests of a log.

    Parameters
    ----------
    rests : sequence of RestStretch
        At least one, in order of time. The estimate includes the Earth's rate: up to 15 deg/h, and
        different in different attitudes.

    Returns
    -------
    GyroBiasCourse
        A weighted average, a straight line by least squares, and the rests themselves, between
        which `gyro_bias_at` interpolates. Where the rests scatter by more than their own sd, the sd
        of average and slope are scaled by the ratio (Birge 1932, doi:10.1103/PhysRev.40.207).

    Raises
    ------
    DataError
        The rests are empty or not in order of time.
    """
    if not rests:
        raise DataError("sensors.no-stationary-stretch-found-take", quantity="gyro bias")
    time = np.array([0.5 * (r.start + r.end) for r in rests])
    if (np.diff(time) <= 0.0).any():
        raise DataError("sensors.rests-not-order-time", quantity="gyro bias")
    mean = np.array([r.gyro_mean for r in rests], dtype=np.float64)
    # A rest made directly may have no sd of its mean; that of its samples is larger.
    sds = [r.gyro_sd if r.gyro_mean_sd is None else r.gyro_mean_sd for r in rests]
    sd = np.maximum(np.array(sds), LEAST_SD)
    weight = sd**-2.0
    average = (weight * mean).sum(axis=0) / weight.sum(axis=0)
    average_sd = weight.sum(axis=0) ** -0.5
    course: list[Triple | None] = [None] * 3
    if len(rests) > 1:
        scatter = np.sqrt((weight * (mean - average) ** 2).sum(axis=0) / (len(rests) - 1))
        course = [triad_of(x) for x in (*_slope(time, mean, weight), scatter)]
        average_sd = average_sd * np.maximum(1.0, scatter)
    return GyroBiasCourse(
        tuple(time.tolist()),
        tuple(triad_of(row) for row in mean),
        tuple(triad_of(row) for row in sd),
        triad_of(average),
        triad_of(average_sd),
        *course,
    )


def _slope(time: Array, mean: Array, weight: Array) -> tuple[Array, Array]:
    middle = (weight * time[:, None]).sum(axis=0) / weight.sum(axis=0)
    from_middle = time[:, None] - middle
    lever = (weight * from_middle**2).sum(axis=0)
    slope = (weight * from_middle * mean).sum(axis=0) / lever
    sd = lever**-0.5
    if len(time) > 2:
        level = (weight * mean).sum(axis=0) / weight.sum(axis=0)
        left = mean - level - slope * from_middle
        sd = sd * np.maximum(1.0, np.sqrt((weight * left**2).sum(axis=0) / (len(time) - 2)))
    return slope, sd


def gyro_bias_at(course: GyroBiasCourse, time: ArrayLike) -> Array:
    """Gyro bias at given instants.

    Parameters
    ----------
    course : GyroBiasCourse
    time : array_like, (n,), s

    Returns
    -------
    ndarray, (n, 3), rad/s
        Linear between the midpoints of the rests; constant before the first and after the last.
    """
    at, mean = np.asarray(time, dtype=np.float64), np.array(course.mean)
    return np.column_stack([np.interp(at, course.time, mean[:, k]) for k in range(3)])


def without_gyro_bias(imu: pd.DataFrame, course: GyroBiasCourse) -> pd.DataFrame:
    """Subtract the bias from the rates of a log.

    Parameters
    ----------
    imu : DataFrame
        An Imu table; not changed.
    course : GyroBiasCourse

    Returns
    -------
    DataFrame
        An Imu table.
    """
    out = imu.copy()
    out.attrs = dict(imu.attrs)
    out[GYRO] = imu[GYRO].to_numpy(dtype=np.float64) - gyro_bias_at(course, imu.index)
    return out

"""Common parts of the health tests: channels, block statistics, stationary blocks."""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from strapdown.constants import Flags, Indices
from strapdown.errors import DataError, Finding
from strapdown.sensors.rest import MAX_ACCEL_SD, MAX_GYRO_SD, QUIET_FACTOR, QUIET_QUANTILE, ROUNDING
from strapdown.sensors.uncertainty import ImuUncertainty
from strapdown.tables import ACCEL, GYRO
from strapdown.tables.checks import (
    Array,
    check_columns,
    check_time,
    index_of,
    source_of,
    view_of,
)
from strapdown.tables.on_disk import let_go, parts_of, room

# Long enough for a standard deviation and a mean, short enough to locate a fault.
BLOCK = 1.0  # s
LEAST_BLOCK = 32  # samples
#: With fewer blocks the typical behavior of a channel is unknown.
LEAST_SAMPLES = 2 * LEAST_BLOCK
# A body is stationary where at least this many of the other channels are quiet.
LEAST_WITNESSES = 3
WORDS = {
    "gyro_x": "the gyro about x (forward)",
    "gyro_y": "the gyro about y (right)",
    "gyro_z": "the gyro about z (down)",
    "accel_x": "the accelerometer along x (forward)",
    "accel_y": "the accelerometer along y (right)",
    "accel_z": "the accelerometer along z (down)",
}


@dataclass(frozen=True)
class ChannelFault:
    """A defect of a channel.

    `channel`: ``gyro_x`` to ``accel_z``, or ``gyro``, ``accel`` for the triad as a whole. `kind`: a
    key of `imu_health.TESTS`, or ``dead``, ``burst``. `begin`, `end` (s): stamps of the first and
    last affected sample. `first`, `last`: the same as row numbers of the table, from 0, both
    included. `size`, `limit`: measured value and its limit.
    """

    channel: str
    kind: str
    begin: float
    end: float
    first: int
    last: int
    size: float
    limit: float
    finding: Finding


@dataclass(frozen=True, eq=False)
class Blocks:
    """Statistics of blocks with equal numbers of samples, (blocks, channels).

    `samples`: per block. `noise`: standard deviation of a sample from second differences: the white
    part, without slow motion. `white`: squared ratio of that to the estimate from first
    differences: one for white noise, less for signals slower than a quarter of the rate. `valid`:
    block without missing samples and without samples known to be faulty.
    """

    samples: int
    mean: Array
    sd: Array
    noise: Array
    white: Array
    valid: Flags


@dataclass(frozen=True, eq=False)
class HealthLog:
    """A log under test.

    `time` ((n,), s). `names`: names of the c channels. `values` ((c, n)): as recorded, NaN where
    missing. `wrong` ((c, n)): samples excluded by an earlier test. `gravity` (m/s²): smallest and
    largest possible value. `false_alarm`: probability per channel, test and record.
    """

    source: str | None
    time: Array
    names: tuple[str, ...]
    values: Array
    wrong: Flags
    sensors: ImuUncertainty | None
    gravity: tuple[float, float]
    false_alarm: float
    blocks: Blocks = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "blocks", _blocks(self))

    @property
    def rate(self) -> float:
        """Mean sample rate, Hz."""
        return float((self.time.size - 1) / (self.time[-1] - self.time[0]))

    def triad(self, channel: int) -> list[int]:
        """Channels of the same triad, including the channel itself."""
        kind = self.names[channel].split("_")[0]
        return [k for k, name in enumerate(self.names) if name.startswith(kind)]

    def stated(self, channel: int, attribute: str, otherwise: float = 0.0) -> float:
        """Stated value of a channel, an attribute of `TriadUncertainty`."""
        if self.sensors is None:
            return otherwise
        name = self.names[channel]
        triad = self.sensors.gyro if name in GYRO else self.sensors.accel
        return triad.axis(attribute)["xyz".index(name[-1])]

    def quiet(self) -> Flags:
        """Blocks in which each channel is as quiet as in its quietest, (blocks, channels).

        Blocks in which a channel is not valid count as quiet.
        """
        b = self.blocks
        out = np.ones(b.sd.shape, dtype=bool)
        for k, name in enumerate(self.names):
            own = b.valid[:, k]
            if not own.any():
                continue
            most = MAX_GYRO_SD if name in GYRO else MAX_ACCEL_SD
            least = float(np.quantile(b.sd[own, k], QUIET_QUANTILE))
            # Coarsely quantized channels that rarely change have quiet blocks with zero scatter.
            step = float(np.median(b.sd[own, k])) if least <= ROUNDING else 0.0
            limit = min(max(QUIET_FACTOR * least, QUIET_FACTOR * step, ROUNDING), most)
            out[own, k] = b.sd[own, k] <= limit
        return out

    def rests(self, channel: int | None = None) -> Flags:
        """Stationary blocks according to all channels, or to all but one, (blocks,)."""
        others = [k for k in range(len(self.names)) if k != channel]
        quiet, valid = self.quiet()[:, others], self.blocks.valid[:, others]
        return np.asarray(quiet.all(axis=1) & (valid.sum(axis=1) >= LEAST_WITNESSES))

    def fault(
        self,
        channel: int | str,
        kind: str,
        span: tuple[int, int],
        size: float,
        limit: float,
        code: str,
        **values: Any,
    ) -> ChannelFault:
        """Make a fault of samples ``span[0]`` to ``span[1]``, both included.

        The data of its finding are `values`, plus the ``channel`` in words, ``begin`` and ``end``
        in s, ``size`` and ``limit``, and the ``unit`` of the channel.
        """
        name = channel if isinstance(channel, str) else self.names[channel]
        a, b = span
        begin, end = float(self.time[a]), float(self.time[b])
        data = {
            "channel": WORDS.get(name, name),
            "begin": begin,
            "end": end,
            "size": size,
            "limit": limit,
            "unit": "rad/s" if name.startswith("gyro") else "m/s²",
        }
        finding = Finding(code, file=self.source, row=a + 1, quantity=name, data={**data, **values})
        return ChannelFault(name, kind, begin, end, a, b, size, limit, finding)

    def span_of(self, first: int, last: int) -> tuple[int, int]:
        """First and last sample of blocks `first` to `last`, both included."""
        return first * self.blocks.samples, (last + 1) * self.blocks.samples - 1


def health_log(
    imu: pd.DataFrame,
    sensors: ImuUncertainty | None,
    gravity: tuple[float, float],
    false_alarm: float,
) -> HealthLog:
    """Prepare a table for testing; its values may be NaN.

    DataError: a column is missing, time does not increase, or there are too few samples.
    """
    source = source_of(imu)
    check_columns(imu, GYRO, source)
    names = [*GYRO, *(ACCEL if ACCEL[0] in imu.columns else [])]
    check_columns(imu, names, source)
    time = index_of(imu)
    if time.size < LEAST_SAMPLES:
        raise DataError(
            "sensors.samples-too-few-tell-channel",
            file=source,
            quantity="time",
            size=time.size,
            least_samples=LEAST_SAMPLES,
        )
    check_time(time, source)
    values = view_of(imu, names).T
    if values.strides[-1] != values.itemsize:
        values = np.ascontiguousarray(values)
    wrong = room(values.shape, np.bool_)
    for channel, out in zip(values, wrong, strict=True):
        np.logical_not(np.isfinite(channel), out=out)
        let_go(values)
        let_go(wrong)
    return HealthLog(source, time, tuple(names), values, wrong, sensors, gravity, false_alarm)


def intervals_of(flags: Flags, join: int = 0) -> list[tuple[int, int]]:
    """First and last index of each run of true; gaps of at most `join` false are bridged."""
    edges = np.diff(np.r_[False, flags, False].astype(np.int8))
    starts, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1) - 1
    if not starts.size:
        return []
    apart = starts[1:] - ends[:-1] - 1 > join
    return list(
        zip(starts[np.r_[True, apart]].tolist(), ends[np.r_[apart, True]].tolist(), strict=True)
    )


def _blocks(log: HealthLog) -> Blocks:
    n = log.time.size
    size = min(max(LEAST_BLOCK, round(BLOCK * log.rate)), n // 2)
    count = n // size
    shape = (count, len(log.names))
    mean, sd, noise, white = (np.zeros(shape) for _ in range(4))
    valid = np.ones(shape, dtype=bool)
    for k in range(len(log.names)):
        for at in parts_of(count, size):
            span = slice(at.start * size, at.stop * size)
            cut = log.values[k, span].reshape(-1, size)
            bad = log.wrong[k, span].reshape(-1, size).any(axis=1)
            valid[at, k] = ~bad
            mean[at, k] = np.where(bad, 0.0, cut.mean(axis=1))
            cut = cut - mean[at, k, None]
            first = np.diff(cut, axis=1)
            ones = (first**2).mean(axis=1) / 2.0
            twos = (np.diff(first, axis=1) ** 2).mean(axis=1) / 6.0
            sd[at, k] = np.sqrt((cut**2).mean(axis=1))
            noise[at, k] = np.sqrt(twos)
            white[at, k] = np.divide(twos, ones, out=np.zeros_like(ones), where=ones > 0.0)
            let_go(log.values)
            let_go(log.wrong)
    for array in (sd, noise, white):
        array[~valid] = 0.0
    return Blocks(size, mean, sd, noise, white, valid)


def usual(values: Array) -> float:
    """Median, NaN for an empty array."""
    return float(np.median(values)) if values.size else math.nan


# Chance limit of a quantity, extrapolated from the tail of its own values over a record.


def tail_limit(
    values: ArrayLike, near: int, far: int, false_alarm: float, *, slack: float = 1.0
) -> float:
    """Extrapolate the upper tail of a record's own values.

    `values` ((m,)): mostly from sound samples. `near`, `far`: ranks from the largest,
    ``near > far``, between which the tail is estimated. Fewer than `far` faulty values hardly
    change it. `false_alarm`: probability that the largest sound value exceeds the limit. `slack`:
    factor on the scale of the tail. Returns ``u + slack e ln(far / false_alarm)`` with u of rank
    `far` and the scale ``e = (u - v) / ln(near / far)``, v of rank `near`: exact for a geometric or
    exponential tail, too high for a normal one. Infinite with fewer than `near` values, or where
    `far` is zero.

    Peaks over a threshold with shape parameter zero (Coles 2001, An Introduction to Statistical
    Modeling of Extreme Values, section 4.2); the scale is from two order statistics, which are
    robust to a few outliers.
    """
    x = np.asarray(values, dtype=np.float64)
    if far < 1 or near <= far or x.size < near:
        return math.inf
    ordered = np.partition(x, [x.size - near, x.size - far])
    v, u = float(ordered[x.size - near]), float(ordered[x.size - far])
    return u + slack * (u - v) / math.log(near / far) * math.log(far / false_alarm)


# Runs of repeated values, and their lengths without a fault.


def equal_runs(v: Array) -> tuple[Indices, Indices, int]:
    """Starts and lengths of runs of equal values, of two at least, and the number of all runs.

    `v` ((n,)): a NaN equals no other value. Returns `starts`, `lengths` ((m,)).
    """
    edges = np.zeros(v.size + 1, dtype=np.int8)
    repeats = 0
    for part in parts_of(v.size - 1, 1):
        same = np.diff(v[part.start : part.stop + 1]) == 0.0
        repeats += int(np.count_nonzero(same))
        # One where a run begins, less one after its last repetition.
        edges[part] += same
        edges[part.start + 1 : part.stop + 1] -= same
        let_go(v)
    starts, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    return starts.astype(np.int64), (ends - starts + 1).astype(np.int64), v.size - repeats


def longest_by_chance(repeats: Array, samples: int, false_alarm: float) -> Array:
    """Length that a run of independent repetitions exceeds with at most a given probability.

    `repeats` ((k,)): probability that a sample repeats the previous one, from 0 to 1. `samples`:
    number of samples of the record; a run may start at each. `false_alarm`: probability that any
    run of the record is longer. Returns (k,): ``1 + ln(false_alarm / n) / ln(r)``, for which the
    expected number of runs of L or more samples, ``n (1 - r) r^(L-1)``, is below `false_alarm`.
    Infinite for r = 1.
    """
    r = np.clip(repeats, 1e-300, 1.0)
    with np.errstate(divide="ignore"):
        limit = 1.0 + math.log(false_alarm / samples) / np.log(r)
    return np.where(r < 1.0, limit, np.inf)


# Median without NaN.


def known_median(values: Array, axis: int) -> Array:
    """Return the median of the non-NaN values along an axis; NaN, without a warning, if none."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)
        return np.asarray(np.nanmedian(values, axis=axis))

"""Channels whose level steps although nothing moves."""

from __future__ import annotations

import math
from dataclasses import replace
from statistics import NormalDist

import numpy as np
from numpy.typing import NDArray

from strapdown.sensors.channel_health import ABRUPT
from strapdown.sensors.health_log import ChannelFault, HealthLog, Mask, intervals_of
from strapdown.sensors.tail_limit import tail_limit
from strapdown.tables import ACCEL, GYRO

Array = NDArray[np.float64]

__all__ = ["find_jumps"]

# Blocks whose mean is taken before and after the one in which a step may lie.
SIDE = 3
# Windows at rest that tell what is usual: fewer have no tail.
LEAST_WINDOWS = 40
# Of what a turn would make of the specific force: that much is seen, by so many of its sd.
SEEN, SURE = 0.5, 3.0
# Of the step: how well the means at both its sides are known where its abruptness is judged.
KNOWN = 0.05


def find_jumps(log: HealthLog) -> list[ChannelFault]:
    """Steps of the mean of three seconds and more between blocks at rest by the others' word.

    The limit is what the tail of the record's own changes over the same time tells, those about
    the step left out (`tail_limit` of those that a fifth and a fiftieth exceed), and no less than
    what noise from sample to sample and the stated drift give. A step of an accelerometer must
    also be left when the turning that the gyros tell in between is taken off, and one of a gyro is
    none where the accelerometers turn with it, or where it takes time: a body needs some to begin
    to turn.
    """
    if log.blocks.sd.shape[0] < 2 * SIDE + 1:
        return []
    tilted = _tilted(log)
    faults = []
    for k, name in enumerate(log.names):
        rest = log.rests(k) & log.blocks.valid[:, k]
        windows = np.lib.stride_tricks.sliding_window_view(rest, 2 * SIDE + 1)
        still = np.asarray(windows.all(axis=1))
        if still.sum() < LEAST_WINDOWS:
            continue
        change = _change(log.blocks.mean[:, k])
        left = change
        if name in ACCEL and tilted is not None:
            left = change - tilted[:, ACCEL.index(name)]
        size = np.where(still, np.abs(change), 0.0)
        least = _least(log, k, int(still.sum()))
        for first, last in intervals_of(size > least):
            at = first + int(np.argmax(size[first : last + 1]))
            limit = max(least, _usual(size, still, at, log.false_alarm))
            step = float(change[at])
            if abs(step) <= limit or abs(left[at]) <= max(
                least, _usual(np.abs(left), still, at, log.false_alarm)
            ):
                continue
            where = _where(log, k, at + SIDE, step)
            if where is None or (name in GYRO and _turned(log, k, at, step)):
                continue
            faults.append(_fault(log, k, where, step, limit))
    return _until_next(log, faults)


def _change(mean: Array) -> Array:
    """Mean of the three blocks after less that of the three before each block that has them."""
    sums = np.concatenate([[0.0], np.cumsum(mean - mean[0])])
    of_three = (sums[SIDE:] - sums[:-SIDE]) / SIDE
    return np.asarray(of_three[SIDE + 1 :] - of_three[: -SIDE - 1])


def _least(log: HealthLog, k: int, count: int) -> float:
    """What white noise, the steps of the output and the stated drift give."""
    b = log.blocks
    noise = float(np.median(b.noise[:, k][b.valid[:, k]]))
    white = noise * math.sqrt(2.0 / (SIDE * b.samples))
    chance = -NormalDist().inv_cdf(0.5 * log.false_alarm / count)
    return max(chance * math.hypot(white, _quantum(log, k) / math.sqrt(12.0)), _drift(log, k))


def _usual(size: Array, still: Mask, at: int, false_alarm: float) -> float:
    """What the changes elsewhere in the record tell."""
    elsewhere = still.copy()
    elsewhere[max(at - 2 * SIDE, 0) : at + 2 * SIDE + 1] = False
    others = size[elsewhere]
    return tail_limit(others, others.size // 5, max(others.size // 50, 1), false_alarm)


def _quantum(log: HealthLog, k: int) -> float:
    """Step of the output where its noise is less than that, so that means do not average it."""
    stated = log.stated(k)
    step = 0.0 if stated is None else stated[0].axis("quantization")[stated[1]]
    if step == 0.0:
        part = log.values[k, : 20 * log.blocks.samples]
        distinct = np.unique(part[np.isfinite(part)])
        step = float(np.diff(distinct).min()) if distinct.size > 1 else 0.0
    noise = float(np.median(log.blocks.noise[:, k]))
    return step if noise < 0.5 * step else 0.0


def _drift(log: HealthLog, k: int) -> float:
    """What the stated wandering of the bias gives over the 4 blocks between both means."""
    if log.sensors is None:
        return 0.0
    name = log.names[k]
    drift = log.sensors.gyro_drift if name in GYRO else log.sensors.accel_drift
    sd = drift.triad["xyz".index(name[-1])]
    lag = (SIDE + 1) * log.blocks.samples / log.rate
    moved = sd * math.sqrt(2.0 * -math.expm1(-lag / drift.correlation_time))
    return -NormalDist().inv_cdf(0.5 * log.false_alarm / log.blocks.sd.shape[0]) * moved


def _tilted(log: HealthLog) -> Array | None:
    """Change of the specific force that the gyros' turning between both means makes, (b - 6, 3)."""
    if ACCEL[0] not in log.names:
        return None
    mean = log.blocks.mean
    rest = log.rests()
    if not rest.any():
        return None
    block = log.blocks.samples / log.rate
    gyro = mean[:, :3] - np.median(mean[rest, :3], axis=0)
    force = mean[:, 3:]
    # From the middle of the three before to the middle of the three after.
    edges = np.vstack([np.zeros(3), np.cumsum(gyro, axis=0)]) * block
    middle = 0.5 * (edges[1:] + edges[:-1])
    of_three = np.lib.stride_tricks.sliding_window_view(middle, SIDE, axis=0).mean(axis=2)
    turned = of_three[SIDE + 1 :] - of_three[: -SIDE - 1]
    before = np.lib.stride_tricks.sliding_window_view(force, SIDE, axis=0).mean(axis=2)
    # Axes that turn by θ see a constant vector turn by -θ.
    return np.asarray(-np.cross(turned, before[: -SIDE - 1]))


def _turned(log: HealthLog, k: int, at: int, step: float) -> bool:
    """Whether the accelerometers have turned as this step of a gyro tells."""
    if ACCEL[0] not in log.names:
        return False
    block = log.blocks.samples / log.rate
    force = log.blocks.mean[:, 3:]
    before, after = force[at : at + SIDE].mean(axis=0), force[at + SIDE + 1 : at + 2 * SIDE + 1]
    axis = np.zeros(3)
    axis[k] = 1.0
    # Half a block of the one in which it steps, and the blocks after.
    angles = step * block * (0.5 + 0.5 + np.arange(SIDE))
    told = -np.cross(axis, before)
    seen = after - before
    told_size = float(told @ told)
    if told_size < 1e-6 * float(before @ before):
        return False  # about the vertical: nothing is seen
    share = float((seen @ told) @ angles) / (told_size * float(angles @ angles))
    # Where their noise would say so by chance they say nothing.
    noise = float(np.median(log.blocks.noise[:, 3:].max(axis=1))) / math.sqrt(log.blocks.samples)
    unsure = noise / math.sqrt(told_size * float(angles @ angles))
    return share > SEEN and SURE * unsure < SEEN


def _where(log: HealthLog, k: int, block: int, step: float) -> int | None:
    """Sample from which the level is another, or None where it changes slowly."""
    size = log.blocks.samples
    a, b = (block - 1) * size, (block + 2) * size
    y = log.values[k, a:b] - log.values[k, a:b].mean()
    # Change point of the least squares of two levels.
    n = y.size
    sums = np.cumsum(y)[:-1]
    places = np.arange(1, n)
    at = int(np.argmax(np.sign(-step) * sums / np.sqrt(places * (n - places) / n))) + 1
    noise = float(np.median(log.blocks.noise[:, k]))
    side = min(max(math.ceil(2.0 * (noise / (KNOWN * step)) ** 2), 2), size)
    whole = y[max(at - size, 0) : at].mean(), y[at : at + size].mean()
    near = y[max(at - side, 0) : at].mean(), y[at : at + side].mean()
    if (near[1] - near[0]) < ABRUPT * (whole[1] - whole[0]) and step > 0.0:
        return None
    if (near[1] - near[0]) > ABRUPT * (whole[1] - whole[0]) and step < 0.0:
        return None
    return a + at


def _fault(log: HealthLog, k: int, at: int, step: float, limit: float) -> ChannelFault:
    name = log.names[k]
    code = "sensors.gyro-zero-jumps" if name in GYRO else "sensors.accelerometer-zero-jumps"
    return log.fault(k, "jump", (at, log.time.size - 1), abs(step), limit, code, step=step)


def _until_next(log: HealthLog, faults: list[ChannelFault]) -> list[ChannelFault]:
    """Each jump ends where the same channel jumps again."""
    out = []
    for fault in faults:
        later = [f.first for f in faults if f.channel == fault.channel and f.first > fault.first]
        last = min(later) - 1 if later else fault.last
        out.append(replace(fault, last=last, end=float(log.time[last])))
    return out

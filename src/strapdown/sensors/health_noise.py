"""Channels that are noisier than their data sheet, their neighbours or their own past."""

from __future__ import annotations

import math
from statistics import NormalDist

import numpy as np
from numpy.typing import NDArray

from strapdown.constants import MAD_TO_SD
from strapdown.sensors.health_log import (
    ChannelFault,
    HealthLog,
    Mask,
    intervals_of,
    usual,
)
from strapdown.sensors.known_median import known_median

Array = NDArray[np.float64]

__all__ = ["find_noisy"]

# Data sheets that state noise by axis have one axis with twice that of another, and units differ
# from one another by half.
NOISE_FACTOR = 3.0
# Blocks in a row, where not all of a rest; a slammed door passes within less.
LASTING = 3
# Of the second over the first differences of white noise, squared, one block being known to a
# tenth or so; what is slower than 0.28 of the rate has less.
WHITE = 0.8
# Of the scatter of its own ratio to the others over the record.
OWN_SCATTER = 6.0
# In noise all second differences are large, in a burst those about the outliers alone: a quarter of
# those of normal noise is below 0.3186 of their rms.
OUTLIER, LEAST_OUTLIERS = 6.0, 3
QUARTER, BURST_SHARE = 0.3186, 0.5
SAME_FAULT = 10  # blocks
# Variance of a median over that of a mean, of normal values.
MEDIAN = math.pi / 2.0


def find_noisy(log: HealthLog) -> list[ChannelFault]:
    """Blocks whose noise from sample to sample is beyond 3 times what it may be.

    At rest, by the word of the other channels: beyond the data sheet's (with the noise of its
    quantization), or the middle one of its triad. Anywhere, if it is white: beyond its own middle
    over the record, each block being held against what the other channels do in it, and beyond 6
    times the scatter of that ratio. All blocks of the rest together, or three blocks of a second
    in a row; a single one, where it is a handful of outliers (``burst``).

    The rms of the second differences of n white samples is known to 0.99/√n (their correlations are
    -2/3 and 1/6): limits are raised by the quantile of that.
    """
    faults = []
    b = log.blocks
    relative = _relative(log)
    for k in range(len(log.names)):
        own = b.valid[:, k]
        rest = log.rests(k) & own
        noise = b.noise[:, k]
        slack = NOISE_FACTOR * (1.0 + _quantile(log, LASTING) * math.sqrt(1.0 / b.samples))
        limit = np.full(noise.shape, np.inf)
        reason = np.zeros(noise.size, dtype=np.int64)
        stated = _stated(log, k)
        if stated > 0.0:
            limit[rest] = slack * stated
        fellows = [j for j in log.triad(k) if b.valid[rest, j].all()] if rest.any() else []
        if len(fellows) == 3:
            middle = slack * np.median(b.noise[:, fellows], axis=1)
            better = rest & (middle > 0.0) & (middle < limit)
            limit[better], reason[better] = middle[better], 1
        past = _past(log, k, relative[:, k], slack)
        better = own & (b.white[:, k] >= WHITE) & (past < limit)
        limit[better], reason[better] = past[better], 2
        high = own & (noise > limit)
        sizes = noise.copy()
        lasting = _throughout(log, k, rest, fellows, stated, limit, reason, sizes)
        high |= lasting
        for first, last in intervals_of(high):
            if last - first + 1 >= LASTING:
                lasting[first : last + 1] = True
        base = usual(noise[rest & ~high]) if (rest & ~high).any() else usual(noise[own & ~high])
        flags = lasting.copy()
        alone = np.flatnonzero(high & rest & ~lasting)
        flags[alone] = _struck(_second(log, k, alone), base)
        for first, last in intervals_of(flags, SAME_FAULT):
            within = np.flatnonzero(flags[first : last + 1]) + first
            kind = "burst" if _is_burst(_second(log, k, within).ravel()) else "noisy"
            faults.append(_fault(log, k, kind, (first, last), flags, sizes, limit, reason))
    return faults


def _throughout(
    log: HealthLog,
    k: int,
    rest: Mask,
    fellows: list[int],
    stated: float,
    limit: Array,
    reason: NDArray[np.int64],
    sizes: Array,
) -> Mask:
    """All blocks at rest, where they together are above a limit that is surer the more they are."""
    out = np.zeros_like(rest)
    count = int(rest.sum())
    if count < LASTING:
        return out
    # What is noisy for a part of the rest only does not move the median.
    noise = np.median(log.blocks.noise[rest], axis=0)
    known = math.sqrt(MEDIAN / (count * log.blocks.samples))
    slack = NOISE_FACTOR * (1.0 + _quantile(log, 1) * known)
    allowed = [(slack * stated, 0)] if stated > 0.0 else []
    if len(fellows) == 3:
        allowed.append((slack * float(np.median(noise[fellows])), 1))
    for most, why in allowed:
        if 0.0 < most < noise[k]:
            out = rest.copy()
            limit[rest], reason[rest], sizes[rest] = most, why, noise[k]
    return out


def _quantile(log: HealthLog, together: int) -> float:
    """Of the normal distribution, that so many blocks in a row exceed by chance once."""
    chance = log.false_alarm / max(log.blocks.sd.shape[0], 1)
    # A block's noise and the middle one's are both known to 1/√n: √2 for their ratio.
    return -math.sqrt(2.0) * NormalDist().inv_cdf(chance ** (1.0 / together))


def _stated(log: HealthLog, k: int) -> float:
    found = log.stated(k)
    if found is None:
        return 0.0
    triad, axis = found
    white = triad.axis("noise_density")[axis] * math.sqrt(log.rate)
    return math.hypot(white, triad.axis("quantization")[axis] / math.sqrt(12.0)) if white else 0.0


def _relative(log: HealthLog) -> Array:
    """Logarithm of the noise of each channel over its middle, less the middle of the others'."""
    b = log.blocks
    with np.errstate(divide="ignore", invalid="ignore"):
        size = np.where(b.valid & (b.noise > 0.0), np.log(b.noise), np.nan)
        size = size - known_median(size, 0)
        out = np.empty_like(size)
        for k in range(size.shape[1]):
            out[:, k] = size[:, k] - known_median(np.delete(size, k, axis=1), 1)
    return out


def _past(log: HealthLog, k: int, relative: Array, slack: float) -> Array:
    """Noise of each block that its own past and the other channels allow."""
    known = np.isfinite(relative)
    if known.sum() < 4 * LASTING:
        return np.full(relative.shape, np.inf)
    middle = float(np.median(relative[known]))
    scatter = MAD_TO_SD * float(np.median(np.abs(relative[known] - middle)))
    room = max(math.log(slack), OWN_SCATTER * scatter)
    out = np.full(relative.shape, np.inf)
    # noise e^(middle + room - relative) is where the ratio would stand at its limit.
    out[known] = log.blocks.noise[known, k] * np.exp(middle + room - relative[known])
    return out


def _second(log: HealthLog, k: int, blocks: NDArray[np.int64]) -> Array:
    """Sizes of the second differences of some blocks."""
    size, count = log.blocks.samples, log.blocks.sd.shape[0]
    cut = log.values[k, : count * size].reshape(count, size)[blocks]
    return np.abs(np.diff(cut, 2, axis=1))


def _struck(second: Array, base: float) -> Mask:
    """Blocks with a few outliers among samples that are as they were."""
    if not base > 0.0:
        return np.zeros(len(second), dtype=bool)
    large = second > OUTLIER * math.sqrt(6.0) * base
    # An outlier is in three second differences.
    few = large.sum(axis=1) >= 3 * LEAST_OUTLIERS
    few[few] = [_is_burst(row) for row in second[few]]
    return np.asarray(few)


def _is_burst(second: Array) -> bool:
    """Whether the quieter half is much quieter than all are: so it is not where all is noise."""
    return float(np.quantile(second, 0.25)) / QUARTER < BURST_SHARE * float(
        np.sqrt((second**2).mean())
    )


def _fault(
    log: HealthLog,
    k: int,
    kind: str,
    blocks: tuple[int, int],
    flags: Mask,
    sizes: Array,
    limits: Array,
    reasons: NDArray[np.int64],
) -> ChannelFault:
    first, last = blocks
    at = np.flatnonzero(flags[first : last + 1]) + first
    worst = int(at[np.argmax(sizes[at] / limits[at])])
    size, limit = float(sizes[worst]), float(limits[worst])
    than = ("data-sheet", "triad", "past")[int(reasons[worst])]
    # Of a burst, that is `sensors.burst-beyond-triad` and so on.
    code = f"sensors.{kind}-beyond-{than}"
    ratio = NOISE_FACTOR * size / limit
    return log.fault(k, kind, log.span_of(first, last), size, limit, code, ratio=ratio)

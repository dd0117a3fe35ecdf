"""Health tests of the channels of an inertial log of minutes to hours, any sensor grade."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from statistics import NormalDist

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.constants import MAD_TO_SD, Flags
from strapdown.earth import gravity as normal_gravity
from strapdown.ellipsoids import WGS84
from strapdown.errors import ConfigError, Finding
from strapdown.sensors.health_log import (
    ChannelFault,
    HealthLog,
    equal_runs,
    health_log,
    intervals_of,
    known_median,
    longest_by_chance,
    tail_limit,
    usual,
)
from strapdown.sensors.sampling_health import held_starts
from strapdown.sensors.saturation import find_limits
from strapdown.sensors.uncertainty import ImuUncertainty
from strapdown.tables import ACCEL, GYRO
from strapdown.tables.checks import Array
from strapdown.tables.on_disk import let_go, room, stored

# Saturated samples closer together than this are one fault.
SAME_FAULT = 1.0  # s


def find_saturated(log: HealthLog) -> list[ChannelFault]:
    """Find samples at the stated full scale, or on a flat top (`saturation.find_limits`)."""
    faults = []
    join = max(round(SAME_FAULT * log.rate), 1)
    for k in range(len(log.names)):
        let_go(log.values)
        known = ~log.wrong[k]
        let_go(log.wrong)
        # Two samples do not form a flat top, nor does a channel that is constant.
        if known.sum() < 3:
            continue
        full, step = log.stated(k, "full_scale", np.inf), log.stated(k, "quantization")
        # Without a copy of a sound channel: a long log takes a large part of the memory.
        used = slice(None) if known.all() else known
        values = log.values[k, used]
        if float(values.min()) == float(values.max()):
            continue
        limits = find_limits(
            log.time[used],
            values[:, None],
            np.array([full]),
            np.array([step]),
            longest_flat=math.inf,
        )
        clipped = np.zeros(log.time.size, dtype=bool)
        clipped[known] = limits.clipped[:, 0]
        starts = _held(log, k) if clipped.any() else None
        if starts is not None:
            # A sample that is repeated is one: as often as there is a new one, it may be clipped.
            limits = find_limits(
                log.time[starts],
                log.values[k, starts][:, None],
                np.array([full]),
                np.array([step]),
                longest_flat=math.inf,
            )
            lengths = np.diff(np.append(starts, log.time.size))
            clipped = np.repeat(limits.clipped[:, 0], lengths)
        code = "sensors.saturated-flat-top" if limits.found[0] else "sensors.saturated-at-range"
        for a, b in intervals_of(clipped, join):
            count = int(clipped[a : b + 1].sum())
            size = float(np.abs(log.values[k, a : b + 1][clipped[a : b + 1]]).max())
            faults.append(log.fault(k, "saturated", (a, b), size, size, code, count=count))
    return faults


def _held(log: HealthLog, k: int) -> NDArray[np.int64] | None:
    """First rows of the samples of a channel's triad, if they are repeated and none is missing."""
    triad = [j for j, name in enumerate(log.names) if (name in GYRO) == (log.names[k] in GYRO)]
    if any(log.wrong[j].any() for j in triad):
        return None
    return held_starts(np.column_stack([log.values[j] for j in triad]))


# Consistency of the means at rest with gravity and the Earth's rate.

# Consecutive stationary blocks required for a mean.
LEAST_REST = 3


def find_implausible(log: HealthLog) -> list[ChannelFault]:
    """Find means at rest that differ from gravity or the Earth's rate beyond the stated errors.

    A single channel reads at most gravity (the Earth's rate) plus its errors; the length of the
    vector equals that, to within the errors along its direction. Requires a stated uncertainty, and
    uses the longest stretch that all channels show as stationary.
    """
    if log.sensors is None:
        return []
    rest = log.rests() & log.blocks.valid.all(axis=1)
    spans = [s for s in intervals_of(rest) if s[1] - s[0] + 1 >= LEAST_REST]
    if not spans:
        return []
    first, last = max(spans, key=lambda s: s[1] - s[0])
    middle = log.blocks.mean[first : last + 1].mean(axis=0)
    span = log.span_of(first, last)
    k_sd = -NormalDist().inv_cdf(0.5 * log.false_alarm)
    faults = _triad(log, middle, span, GYRO, (WGS84.rotation_rate, WGS84.rotation_rate), k_sd)
    if ACCEL[0] in log.names:
        faults += _triad(log, middle, span, ACCEL, log.gravity, k_sd)
    return faults


def _triad(
    log: HealthLog,
    means: Array,
    span: tuple[int, int],
    columns: list[str],
    size: tuple[float, float],
    k_sd: float,
) -> list[ChannelFault]:
    at = [log.names.index(c) for c in columns]
    mean = means[at]
    sd = _sd(log, columns, mean, size[1], float(log.time[span[1]] - log.time[span[0]]))
    kind = "gyro" if columns is GYRO else "accel"
    faults = []
    for axis, channel in enumerate(at):
        limit = size[1] + k_sd * float(sd[axis])
        if abs(mean[axis]) > limit:
            read, code = float(mean[axis]), f"sensors.{kind}-implausible-at-rest"
            faults.append(
                log.fault(channel, "implausible", span, abs(read), limit, code, read=read)
            )
    if faults:
        return faults
    length = float(np.sqrt(mean @ mean))
    along = mean / length if length > 0.0 else np.zeros(3)
    spread = float(np.sqrt((along**2) @ (sd**2)))
    # Errors across the vector increase its length by their square over twice the length: chi-square
    # with two degrees of freedom.
    across = float((sd**2).max()) * k_sd**2 / (2.0 * size[0])
    low, high = size[0] - k_sd * spread, size[1] + k_sd * spread + across
    if columns is GYRO and low <= 0.0:
        # Gyros of this grade cannot measure the Earth's rate; their biases were tested above.
        return []
    if low <= length <= high:
        return []
    limit = high if length > high else low
    said = {"low": low, "high": high}
    code = f"sensors.{kind}-triad-implausible-at-rest"
    return [log.fault(kind, "implausible", span, length, limit, code, **said)]


def _sd(log: HealthLog, columns: list[str], mean: Array, size: float, duration: float) -> Array:
    """Stated standard deviation of the mean at rest, per axis."""
    assert log.sensors is not None
    gyro = columns is GYRO
    triad = log.sensors.gyro if gyro else log.sensors.accel
    drift = log.sensors.gyro_drift if gyro else log.sensors.accel_drift
    out = np.zeros(3)
    for axis in range(3):
        across = math.sqrt(max(size**2 - min(float(mean[axis]) ** 2, size**2), 0.0))
        terms = [
            triad.axis("noise_density")[axis] / math.sqrt(duration),
            triad.axis("bias")[axis],
            drift.triad[axis],
            triad.axis("scale")[axis] * min(abs(float(mean[axis])), size),
            triad.axis("misalignment")[axis] * across,
            triad.axis("quantization")[axis] / math.sqrt(12.0),
        ]
        full = triad.axis("full_scale")[axis]
        if math.isfinite(full):
            terms.append(triad.axis("nonlinearity_2")[axis] * size**2 / full)
        if gyro:
            terms.append(triad.axis("g_sensitivity")[axis] * log.gravity[1])
        out[axis] = math.sqrt(math.fsum(t * t for t in terms))
    return out


# Channels noisier than their data sheet, their neighbors or their own past.

# In data sheets that state noise by axis, one axis has twice that of another, and units differ from
# one another by half.
NOISE_FACTOR = 3.0
# Consecutive blocks, other than a whole stationary stretch; a slammed door is shorter.
LASTING = 3
# Limit of the squared ratio of second to first differences: one for white noise, known to a tenth
# or so in one block, and lower for signals slower than 0.28 of the rate.
WHITE = 0.8
# Standard deviations of the channel's own noise ratio to the others over the record.
OWN_SCATTER = 6.0
# Share of the blocks whose noise is that of a quiet channel: at most half are faulty.
QUIET_SHARE = 0.25
# In noise all second differences are large, in a burst only those about the outliers: a quarter of
# those of normal noise is below 0.3186 of their rms.
OUTLIER, LEAST_OUTLIERS = 6.0, 3
QUARTER, BURST_SHARE = 0.3186, 0.5
SAME_NOISE = 10  # blocks
# Variance of a median over that of a mean, for normal values.
MEDIAN = math.pi / 2.0


def find_noisy(log: HealthLog) -> list[ChannelFault]:
    """Find blocks with more than 3 times the allowed sample-to-sample noise.

    At rest according to the other channels, the limit is from the data sheet (including
    quantization noise) or from the median channel of the triad. Anywhere, if the noise is white, it
    is from the channel's own median over the record, relative to the other channels in the block,
    and at least 6 times the scatter of that ratio. A fault is all stationary blocks together, or
    three consecutive blocks of a second; a single block, if it contains only a few outliers
    (``burst``).

    The rms of the second differences of n white samples has a relative standard deviation of
    0.99/√n (their correlations are -2/3 and 1/6); the limits are raised by its quantile.
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
        stated = log.stated(k, "noise_density") * math.sqrt(log.rate)
        if stated:
            stated = math.hypot(stated, log.stated(k, "quantization") / math.sqrt(12.0))
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
        for first, last in intervals_of(flags, SAME_NOISE):
            within = np.flatnonzero(flags[first : last + 1]) + first
            kind = "burst" if _is_burst(_second(log, k, within).ravel()) else "noisy"
            faults.append(_fault(log, k, kind, (first, last), flags, sizes, limit, reason))
    return faults


def _throughout(
    log: HealthLog,
    k: int,
    rest: Flags,
    fellows: list[int],
    stated: float,
    limit: Array,
    reason: NDArray[np.int64],
    sizes: Array,
) -> Flags:
    """Test all stationary blocks together, with a margin that decreases with their number."""
    out = np.zeros_like(rest)
    count = int(rest.sum())
    if count < LASTING:
        return out
    # Noise in less than half of the stationary blocks does not change the median.
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
    """Normal quantile that this many consecutive blocks exceed by chance once per record."""
    chance = log.false_alarm / max(log.blocks.sd.shape[0], 1)
    # The noise of a block and of the median block both have a relative error of 1/√n: √2 in the
    # ratio.
    return -math.sqrt(2.0) * NormalDist().inv_cdf(chance ** (1.0 / together))


def _relative(log: HealthLog) -> Array:
    """Logarithm of each channel's noise over its median, minus the median of the other channels."""
    b = log.blocks
    with np.errstate(divide="ignore", invalid="ignore"):
        size = np.where(b.valid & (b.noise > 0.0), np.log(b.noise), np.nan)
        size = size - known_median(size, 0)
        out = np.empty_like(size)
        for k in range(size.shape[1]):
            out[:, k] = size[:, k] - known_median(np.delete(size, k, axis=1), 1)
    return out


def _past(log: HealthLog, k: int, relative: Array, slack: float) -> Array:
    """Noise limit of each block from the channel's own past and the other channels.

    Never below the limit of its own quiet blocks: where the other channels become quiet, as those
    that feel the road when a car stops, a channel that does not change is not reported as noisier.
    """
    known = np.isfinite(relative)
    if known.sum() < 4 * LASTING:
        return np.full(relative.shape, np.inf)
    middle = float(np.median(relative[known]))
    scatter = MAD_TO_SD * float(np.median(np.abs(relative[known] - middle)))
    room = max(math.log(slack), OWN_SCATTER * scatter)
    out = np.full(relative.shape, np.inf)
    # At noise e^(middle + room - relative) the ratio equals its limit.
    noise = log.blocks.noise[known, k]
    quiet = slack * float(np.quantile(noise, QUIET_SHARE))
    out[known] = np.maximum(noise * np.exp(middle + room - relative[known]), quiet)
    return out


def _second(log: HealthLog, k: int, blocks: NDArray[np.int64]) -> Array:
    """Absolute second differences of given blocks."""
    size, count = log.blocks.samples, log.blocks.sd.shape[0]
    cut = log.values[k, : count * size].reshape(count, size)[blocks]
    return np.abs(np.diff(cut, 2, axis=1))


def _struck(second: Array, base: float) -> Flags:
    """Blocks with a few outliers among otherwise unchanged samples."""
    if not base > 0.0:
        return np.zeros(len(second), dtype=bool)
    large = second > OUTLIER * math.sqrt(6.0) * base
    # An outlier affects three second differences.
    few = large.sum(axis=1) >= 3 * LEAST_OUTLIERS
    few[few] = [_is_burst(row) for row in second[few]]
    return np.asarray(few)


def _is_burst(second: Array) -> bool:
    """Whether the lower quartile is well below the rms, unlike in noise throughout."""
    return float(np.quantile(second, 0.25)) / QUARTER < BURST_SHARE * float(
        np.sqrt((second**2).mean())
    )


def _fault(
    log: HealthLog,
    k: int,
    kind: str,
    blocks: tuple[int, int],
    flags: Flags,
    sizes: Array,
    limits: Array,
    reasons: NDArray[np.int64],
) -> ChannelFault:
    first, last = blocks
    at = np.flatnonzero(flags[first : last + 1]) + first
    worst = int(at[np.argmax(sizes[at] / limits[at])])
    size, limit = float(sizes[worst]), float(limits[worst])
    than = ("data-sheet", "triad", "past")[int(reasons[worst])]
    # For a burst, the code is `sensors.burst-beyond-triad` and so on.
    code = f"sensors.{kind}-beyond-{than}"
    ratio = NOISE_FACTOR * size / limit
    return log.fault(k, kind, log.span_of(first, last), size, limit, code, ratio=ratio)


# Stuck or dead channels: one value repeated for longer than the noise allows.

# Samples about a run from which the fraction of repetitions is estimated.
AROUND = 256
LEAST_RUN = 10  # samples
# Ranks of the run lengths that define the tail: ten stuck runs hardly change the 20th longest,
# whose position in a geometric tail has a relative error of a fifth; run lengths are also integers.
NEAR_RANK, FAR_RANK, TAIL_SLACK = 200, 20, 1.5
# Standard deviations added to the fraction of repetitions from so few samples.
SHARE_SLACK = 4.0
# Dropouts closer together than this are one burst.
SAME_BURST = 1.0  # s


def find_missing(log: HealthLog) -> list[ChannelFault]:
    """Find samples that are not finite; bursts within a second are merged."""
    faults = []
    join = max(round(SAME_BURST * log.rate), 1)
    for k in range(len(log.names)):
        let_go(log.values)
        gone = ~np.isfinite(log.values[k])
        if not gone.any():
            continue
        at = np.flatnonzero(gone)
        for part in np.split(at, np.flatnonzero(np.diff(at) > join) + 1):
            a, b = int(part[0]), int(part[-1])
            code, said = "sensors.samples-missing", {"count": part.size, "of": b - a + 1}
            faults.append(log.fault(k, "missing", (a, b), float(part.size), 0.0, code, **said))
    return faults


def find_stuck(log: HealthLog) -> list[ChannelFault]:
    """Find runs of one value that neither noise nor quantization nor rest explains.

    A run is stuck if it is longer than each of

    - ``1 + ln(P/n)/ln(r)``, with r the fraction of samples that repeat the previous one: for the
      channel in the 256 samples before and after the run (for independent samples, the sum of the
      squares of their histogram), and for its two neighbors during the run, because a rest in
      coarse quantization steps keeps all three constant;
    - the limit from the tail of its own runs over the record (`tail_limit` of the 200th and the
      20th longest; with fewer than 2000, of those exceeded by a tenth and a hundredth);
    - 10 samples.
    """

    @cache
    def repeats() -> NDArray[np.int32]:
        """How many samples of each channel repeat the one before, up to each."""
        sums = room((len(log.names), log.time.size + 1), np.int32)
        for values, upto in zip(log.values, sums, strict=True):
            upto[:2] = 0
            np.cumsum(values[1:] == values[:-1], out=upto[2:])
            let_go(values)
            let_go(sums)
        return sums

    faults = []
    for k in range(len(log.names)):
        let_go(log.values)
        faults += _stuck_runs(log, k, repeats)
    return faults


def _stuck_runs(
    log: HealthLog, k: int, repeats: Callable[[], NDArray[np.int32]]
) -> list[ChannelFault]:
    n = log.time.size
    starts, lengths, count = equal_runs(log.values[k])
    whole = int(lengths.max(initial=1)) >= int(np.isfinite(log.values[k]).sum())
    tail = 0.0 if whole else _tail(lengths, count, log.false_alarm)
    most = np.flatnonzero(lengths >= max(LEAST_RUN, math.ceil(tail)))
    if not most.size:
        return []
    sums = repeats()
    a, b = starts[most], starts[most] + lengths[most]  # one past the last
    limit = np.maximum(
        longest_by_chance(_around(sums[k], a, b, n), n, log.false_alarm), max(tail, LEAST_RUN)
    )
    for other in log.triad(k):
        constant = bool(sums[other, n] >= n - 1)
        if other != k and not log.wrong[other].all() and not constant:
            # Pairs within the run, without its first sample.
            shared = (sums[other, b] - sums[other, a + 1]) / np.maximum(b - a - 1, 1)
            limit = np.maximum(limit, longest_by_chance(shared, n, log.false_alarm))
    found = lengths[most] > limit
    return [
        _stuck_fault(log, k, int(x), int(y) - 1, float(lim))
        for x, y, lim in zip(a[found], b[found], limit[found], strict=True)
        if _others_live(sums, k, int(x), int(y))
    ]


def _tail(lengths: NDArray[np.int64], count: int, false_alarm: float) -> float:
    """Limit of so many lengths, of which those not given are one."""
    near, far = min(NEAR_RANK, count // 10), min(FAR_RANK, count // 100)
    longest = np.concatenate([np.ones(near), lengths])
    longest = np.partition(longest, lengths.size)[lengths.size :] if near else longest
    limit = tail_limit(longest, near, far, false_alarm, slack=TAIL_SLACK)
    # Fewer than 100 runs do not define a tail; the other limits apply.
    return limit if math.isfinite(limit) else 0.0


def _around(sums: NDArray[np.int32], a: NDArray[np.int64], b: NDArray[np.int64], n: int) -> Array:
    """Upper bound of the fraction of repetitions about each run."""
    left, right = np.maximum(a - AROUND, 0), np.minimum(b + AROUND, n)
    repeats = sums[a] - sums[left] + sums[right] - sums[b]
    pairs = a - left + right - b
    share = repeats / np.maximum(pairs, 1)
    # Allow for at least one repetition, because none among so few samples does not prove zero. A
    # run over the whole record has no samples about it; then only its neighbors are used.
    least = 1.0 / np.maximum(pairs, 1)
    bound = np.minimum(share + SHARE_SLACK * np.sqrt(np.maximum(share, least) * least), 1.0)
    return np.asarray(np.where(pairs > LEAST_RUN, bound, 0.0))


def _others_live(sums: NDArray[np.int32], k: int, a: int, b: int) -> bool:
    """Whether any other channel changes meanwhile; otherwise the whole log is constant."""
    moved = (sums[:, b] - sums[:, a + 1]) < b - a - 1
    moved[k] = False
    return bool(moved.any())


def _stuck_fault(log: HealthLog, k: int, a: int, b: int, limit: float) -> ChannelFault:
    n, value, count = log.time.size, float(log.values[k, a]), b - a + 1
    if value == 0.0 and (a == 0 or b == n - 1):
        if a > 0:
            code = "sensors.dead-to-end"
        else:
            code = "sensors.dead-throughout" if b == n - 1 else "sensors.dead-at-start"
        return log.fault(k, "dead", (a, b), float(count), limit, code, count=count)
    code = "sensors.stuck-beyond-noise" if math.isfinite(limit) else "sensors.stuck"
    said = {"value": value, "count": count, "duration": log.time[b] - log.time[a]}
    return log.fault(k, "stuck", (a, b), float(count), limit, code, **said)


# Level jumps of a channel while the body is stationary.

# Blocks averaged before and after the block in which a step may lie.
SIDE = 3
# Fewest stationary windows that define a typical change; fewer have no tail.
LEAST_WINDOWS = 40
# Fraction of the specific force change due to a rotation that must be seen, and the required number
# of its standard deviations.
SEEN, SURE = 0.5, 3.0
# Relative standard deviation of the means on both sides of a step when its abruptness is tested.
KNOWN = 0.05
# Fraction of the step between the near sixths of both windows, 1.3 ms apart; a rotating head takes
# longer.
ABRUPT = 0.8


def find_jumps(log: HealthLog) -> list[ChannelFault]:
    """Find steps of the mean over three or more seconds between stationary blocks.

    The other channels determine which blocks are stationary. The limit is the tail of the record's
    own changes over the same time, without those about the step (`tail_limit` of those exceeded by
    a fifth and a fiftieth), and at least the effect of sample-to-sample noise and the stated drift.
    A step of an accelerometer must remain after subtraction of the rotation measured by the gyros
    in between. A step of a gyro is rejected if the accelerometers rotate with it, or if it is
    gradual, as the start of a real rotation is.
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
            kind = "gyro" if name in GYRO else "accelerometer"
            code, span = f"sensors.{kind}-zero-jumps", (where, log.time.size - 1)
            faults.append(log.fault(k, "jump", span, abs(step), limit, code, step=step))
    return _until_next(log, faults)


def _change(mean: Array) -> Array:
    """Mean of the three blocks after minus the mean of the three before, for each such block."""
    sums = np.concatenate([[0.0], np.cumsum(mean - mean[0])])
    of_three = (sums[SIDE:] - sums[:-SIDE]) / SIDE
    return np.asarray(of_three[SIDE + 1 :] - of_three[: -SIDE - 1])


def _least(log: HealthLog, k: int, count: int) -> float:
    """Change due to white noise, the output quantization and the stated drift."""
    b = log.blocks
    noise = float(np.median(b.noise[:, k][b.valid[:, k]]))
    white = noise * math.sqrt(2.0 / (SIDE * b.samples))
    chance = -NormalDist().inv_cdf(0.5 * log.false_alarm / count)
    return max(chance * math.hypot(white, _quantum(log, k) / math.sqrt(12.0)), _drift(log, k))


def _usual(size: Array, still: Flags, at: int, false_alarm: float) -> float:
    """Limit from the changes elsewhere in the record."""
    elsewhere = still.copy()
    elsewhere[max(at - 2 * SIDE, 0) : at + 2 * SIDE + 1] = False
    others = size[elsewhere]
    return tail_limit(others, others.size // 5, max(others.size // 50, 1), false_alarm)


def _quantum(log: HealthLog, k: int) -> float:
    """Output quantization step where the noise is smaller, so that means do not average it."""
    step = log.stated(k, "quantization")
    if step == 0.0:
        part = log.values[k, : 20 * log.blocks.samples]
        distinct = np.unique(part[np.isfinite(part)])
        step = float(np.diff(distinct).min()) if distinct.size > 1 else 0.0
    noise = float(np.median(log.blocks.noise[:, k]))
    return step if noise < 0.5 * step else 0.0


def _drift(log: HealthLog, k: int) -> float:
    """Change due to the stated bias drift over the 4 blocks between both means."""
    if log.sensors is None:
        return 0.0
    name = log.names[k]
    drift = log.sensors.gyro_drift if name in GYRO else log.sensors.accel_drift
    sd = drift.triad["xyz".index(name[-1])]
    lag = (SIDE + 1) * log.blocks.samples / log.rate
    moved = sd * math.sqrt(2.0 * -math.expm1(-lag / drift.correlation_time))
    return -NormalDist().inv_cdf(0.5 * log.false_alarm / log.blocks.sd.shape[0]) * moved


def _tilted(log: HealthLog) -> Array | None:
    """Specific force change due to the gyros' rotation between both means, (b - 6, 3)."""
    if ACCEL[0] not in log.names:
        return None
    mean = log.blocks.mean
    rest = log.rests()
    if not rest.any():
        return None
    block = log.blocks.samples / log.rate
    gyro = mean[:, :3] - np.median(mean[rest, :3], axis=0)
    force = mean[:, 3:]
    # From the midpoint of the three blocks before to the midpoint of the three after.
    edges = np.vstack([np.zeros(3), np.cumsum(gyro, axis=0)]) * block
    middle = 0.5 * (edges[1:] + edges[:-1])
    of_three = np.lib.stride_tricks.sliding_window_view(middle, SIDE, axis=0).mean(axis=2)
    turned = of_three[SIDE + 1 :] - of_three[: -SIDE - 1]
    before = np.lib.stride_tricks.sliding_window_view(force, SIDE, axis=0).mean(axis=2)
    # In axes that rotate by θ a constant vector rotates by -θ.
    return np.asarray(-np.cross(turned, before[: -SIDE - 1]))


def _turned(log: HealthLog, k: int, at: int, step: float) -> bool:
    """Whether the accelerometers confirm the rotation indicated by this step of a gyro."""
    if ACCEL[0] not in log.names:
        return False
    block = log.blocks.samples / log.rate
    force = log.blocks.mean[:, 3:]
    before, after = force[at : at + SIDE].mean(axis=0), force[at + SIDE + 1 : at + 2 * SIDE + 1]
    axis = np.zeros(3)
    axis[k] = 1.0
    # Half the block that contains the step, and the blocks after.
    angles = step * block * (0.5 + 0.5 + np.arange(SIDE))
    told = -np.cross(axis, before)
    seen = after - before
    told_size = float(told @ told)
    if told_size < 1e-6 * float(before @ before):
        return False  # rotation about the vertical: not observable
    share = float((seen @ told) @ angles) / (told_size * float(angles @ angles))
    # Inconclusive where accelerometer noise could confirm the rotation by chance.
    noise = float(np.median(log.blocks.noise[:, 3:].max(axis=1))) / math.sqrt(log.blocks.samples)
    unsure = noise / math.sqrt(told_size * float(angles @ angles))
    return share > SEEN and SURE * unsure < SEEN


def _where(log: HealthLog, k: int, block: int, step: float) -> int | None:
    """First sample of the new level, or None for a gradual change."""
    size = log.blocks.samples
    a, b = (block - 1) * size, (block + 2) * size
    y = log.values[k, a:b] - log.values[k, a:b].mean()
    # Least-squares change point between two levels.
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


def _until_next(log: HealthLog, faults: list[ChannelFault]) -> list[ChannelFault]:
    """End each jump where the same channel jumps again."""
    out = []
    for fault in faults:
        later = [f.first for f in faults if f.channel == fault.channel and f.first > fault.first]
        last = min(later) - 1 if later else fault.last
        out.append(replace(fault, last=last, end=float(log.time[last])))
    return out


#: Probability per test, channel and record, for limits set by chance.
FALSE_ALARM = 1e-6
# Range of heights at which a sensor may rest.
LOWEST, HIGHEST = -500.0, 9000.0  # m
# Gravity anomalies are smaller; none in NGA's EGM2008 reaches 1000 mGal.
ANOMALY = 0.005  # m/s²


#: Tests by kind, in this order, because noise and level are defined only for valid samples.
TESTS: dict[str, Callable[[HealthLog], list[ChannelFault]]] = {
    "missing": find_missing,
    "stuck": find_stuck,
    "saturated": find_saturated,
    "noisy": find_noisy,
    "jump": find_jumps,
    "implausible": find_implausible,
}


@dataclass(frozen=True, eq=False)
class ImuHealth:
    """Test results of a log.

    Attributes
    ----------
    channels : tuple of str
        Tested channels.
    faults : tuple of ChannelFault
        In order of time.
    rest_time : float, s
        Time for which the body was stationary according to all sound channels. The tests of noise
        against the neighbors, of jumps, and against gravity use only this time.
    noise : dict of str to float, rad/s or m/s²
        Sample-to-sample standard deviation, median over the record.
    """

    channels: tuple[str, ...]
    faults: tuple[ChannelFault, ...]
    rest_time: float
    noise: dict[str, float]

    @property
    def findings(self) -> tuple[Finding, ...]:
        """One finding per fault."""
        return tuple(f.finding for f in self.faults)

    @property
    def healthy(self) -> tuple[str, ...]:
        """Channels without a fault of their own or of their triad."""
        bad = {f.channel for f in self.faults}
        return tuple(c for c in self.channels if c not in bad and c.split("_")[0] not in bad)

    def of(self, channel: str) -> tuple[ChannelFault, ...]:
        """Faults of one channel."""
        return tuple(f for f in self.faults if f.channel == channel)

    def sound(self, imu: pd.DataFrame) -> pd.DataFrame:
        """Samples not covered by any fault.

        Parameters
        ----------
        imu : DataFrame
            The table that was tested.

        Returns
        -------
        DataFrame of bool
            One row per row of the table, one column per channel.
        """
        out = np.ones((len(imu), len(self.channels)), dtype=bool)
        for fault in self.faults:
            for k, name in enumerate(self.channels):
                if fault.channel in (name, name.split("_")[0]):
                    out[fault.first : fault.last + 1, k] = False
        return pd.DataFrame(out, index=imu.index, columns=list(self.channels))


def check_imu_channels(
    imu: pd.DataFrame,
    sensors: ImuUncertainty | None = None,
    *,
    gravity: float | None = None,
    false_alarm: float = FALSE_ALARM,
) -> ImuHealth:
    """Test each channel of an inertial log by itself, against the others and its data sheet.

    Parameters
    ----------
    imu : DataFrame
        Columns of an Imu table, rad/s and m/s²; NaN values are reported. Accelerometers may be
        absent.
    sensors : ImuUncertainty, optional
        Stated uncertainty. If not given, a channel is compared with itself and the others.
    gravity : float, m/s², optional
        Gravity at the site. If not given, any value from the equator at 9 km to a pole.
    false_alarm : float
        Probability that a sound channel fails one test over the whole record, for limits set by
        chance (`TESTS`).

    Raises
    ------
    DataError
        A column is missing, time does not increase, or there are fewer than 64 samples.
    ConfigError
        `false_alarm` or `gravity` is invalid.

    Notes
    -----
    A fault of one channel can be separated from motion only at rest, or where no motion can cause
    it: a moving vehicle with a single unit has no test for a bias jump (`redundant_units` has one).
    Changes common to all channels are attributed to motion. The last incomplete block of less than
    a second is not tested for noise and jumps.

    The cost is about 30 operations per sample and channel: 1 h at 1 kHz takes seconds.
    """
    if not 0.0 < false_alarm < 0.5:
        raise ConfigError(
            "sensors.no-rate-false-alarms", quantity="false_alarm", false_alarm=false_alarm
        )
    if gravity is None:
        least = float(normal_gravity(0.0, HIGHEST)[2]) - ANOMALY
        most = float(normal_gravity(90.0, LOWEST)[2]) + ANOMALY
    elif math.isfinite(gravity) and gravity > 0.0:
        least = most = float(gravity)
    else:
        raise ConfigError("sensors.no-gravity", quantity="gravity", gravity=gravity)
    log = health_log(imu, sensors, (least, most), false_alarm)
    faults: list[ChannelFault] = []
    for kind, find in TESTS.items():
        found = find(log)
        faults += found
        # Later tests exclude the samples; an implausible mean excludes none.
        if found and kind != "implausible":
            wrong = stored(log.wrong)
            for fault in found:
                wrong[log.names.index(fault.channel), fault.first : fault.last + 1] = True
            log = replace(log, wrong=wrong)
    b = log.blocks
    noise = {
        name: float(np.median(b.noise[b.valid[:, k], k])) if b.valid[:, k].any() else math.nan
        for k, name in enumerate(log.names)
    }
    return ImuHealth(
        log.names,
        tuple(sorted(faults, key=lambda f: (f.first, f.channel))),
        float(log.rests().sum() * b.samples / log.rate),
        noise,
    )

"""Merging of accelerometer ranges into one signal, and their consistency."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from strapdown.constants import STANDARD_GRAVITY, Flags
from strapdown.errors import ConfigError, DataError, Finding, add_warning
from strapdown.sensors.crash_unit import CrashUnit
from strapdown.sensors.pre_crash import BiasEstimate
from strapdown.sensors.rest import sd_of_mean
from strapdown.sensors.saturation import RangeLimits
from strapdown.sensors.triad_errors import ZERO, Triad, triad_of
from strapdown.tables.checks import Array, check_rows, check_time

# After saturation the filter before the sampler still contains the clipped part: e⁻⁵ = 0.7 % after
# five of its time constants.
MEMORY = 5.0


@dataclass(frozen=True, eq=False)
class Range:
    """One range of a triad.

    `values` ((n, 3), u): as recorded. `limits`: from `saturation.find_limits`. `noise` ((n, 3), u):
    standard deviation of each sample. `bandwidth` (Hz): of the low-pass before the sampler. `bias`
    ((3,), u): subtracted after the saturation test, so that the ranges join without a step.
    """

    values: Array
    limits: RangeLimits
    noise: Array
    bandwidth: float = math.inf
    bias: Array | Triad = ZERO


@dataclass(frozen=True, eq=False)
class MergedRanges:
    """One triad merged from several ranges.

    `values` ((n, 3), u). `noise` ((n, 3), u): standard deviation of each sample. `spoken` ((n, 3)):
    range used; within a cross-fade, the one with the larger weight. `clipped` ((n, 3)): whether
    even that range was saturated. `step` ((m - 1, 3), u): mean difference of neighboring ranges at
    their switch-overs in each axis, upper minus lower; zero where the lower range is always used.
    `step_sd` ((m - 1, 3), u): standard deviation of that, from the noise of both. `switches` ((m -
    1, 3)): number of switch-overs between them.
    """

    values: Array
    noise: Array
    spoken: NDArray[np.int8]
    clipped: Flags
    step: Array
    step_sd: Array
    switches: NDArray[np.int64]


def merge_ranges(
    time: Array,
    ranges: Sequence[Range],
    *,
    margin: float = 0.1,
    hysteresis: float = 0.1,
    fade: float = 0.0,
) -> MergedRanges:
    """Use the lowest range while it is clear of its end, and the next one beyond.

    `time` ((n,), s). `ranges`: in increasing order, all at the same stamps in the same axes.
    `margin`: fraction of full scale from its end at which a range is left. `hysteresis`: fraction
    of full scale by which a range must be further inside before it is used again, so that noise
    about the threshold does not cause repeated switching. `fade` (s): length of the cross-fade, on
    the side where both ranges are clear; zero for none. DataError: a value is not finite, time does
    not increase, or shapes disagree. ConfigError: margins are not within [0, 1), or the fade is
    negative.

    Each axis is treated separately. The higher range is also used for the sample before an
    excursion, and afterwards for one sample and for five time constants ``1 / (2 pi bandwidth)``,
    because a filter behind the saturated element still outputs the clipped signal. Within a
    cross-fade with weight w the variance is ``w² s_low² + (1 - w)² s_high²``.
    """
    _check(time, ranges, margin, hysteresis, fade)
    count, n = len(ranges), time.size
    out = np.empty((n, 3))
    sd = np.empty((n, 3))
    spoken = np.zeros((n, 3), dtype=np.int8)
    clipped = np.zeros((n, 3), dtype=bool)
    step, step_sd = np.zeros((count - 1, 3)), np.zeros((count - 1, 3))
    switches = np.zeros((count - 1, 3), dtype=np.int64)
    for k in range(3):
        # From the top down: the signal merged so far is used wherever the next lower range is not
        # clear.
        top = ranges[-1]
        y, s = top.values[:, k] - top.bias[k], np.array(top.noise[:, k])
        who, cut = np.full(n, count - 1, dtype=np.int8), top.limits.clipped[:, k].copy()
        for j in range(count - 2, -1, -1):
            one = ranges[j]
            clear = _clear(time, one, k, margin, hysteresis)
            low, noise = one.values[:, k] - one.bias[k], one.noise[:, k]
            step[j, k], step_sd[j, k], switches[j, k] = _step(clear, y - low, s**2 + noise**2)
            weight = _weight(time, clear, fade)
            y = weight * low + (1.0 - weight) * y
            s = np.hypot(weight * noise, (1.0 - weight) * s)
            who[weight > 0.5] = j
            cut[weight > 0.5] = one.limits.clipped[weight > 0.5, k]
        out[:, k], sd[:, k], spoken[:, k], clipped[:, k] = y, s, who, cut
    return MergedRanges(out, sd, spoken, clipped, step, step_sd, switches)


def _clear(time: Array, one: Range, k: int, margin: float, hysteresis: float) -> Flags:
    """Where an axis is clear of its end, with hysteresis, neighbors and the filter's memory."""
    y, limits = one.values[:, k], one.limits
    low, high = float(limits.lower[k]), float(limits.upper[k])
    if not (math.isfinite(low) or math.isfinite(high)):
        return np.ones(y.size, dtype=np.bool_)
    # Position in the range as a fraction of the full scale of that side.
    with np.errstate(invalid="ignore"):
        part = np.maximum(y / high, y / low)
    near = (part > 1.0 - margin) | limits.clipped[:, k]
    back = part <= 1.0 - margin - hysteresis
    # Between the two thresholds the state is that of the last sample outside them.
    known = near | back
    last = np.maximum.accumulate(np.where(known, np.arange(y.size), -1))
    away = np.where(last >= 0, near[np.maximum(last, 0)], False)
    away[:-1] |= away[1:].copy()
    bad = np.flatnonzero(away)
    if bad.size:
        previous = np.searchsorted(bad, np.arange(y.size), side="right") - 1
        there = previous >= 0
        memory = MEMORY / (2.0 * math.pi * one.bandwidth)
        since = np.full(y.size, math.inf)
        at = bad[np.maximum(previous, 0)]
        since[there] = (time - time[at])[there]
        away |= (since <= memory) | (there & (np.arange(y.size) - at <= 1))
    return np.asarray(~away, dtype=np.bool_)


def _weight(time: Array, clear: Flags, fade: float) -> Array:
    """Weight of the lower range: one where it is clear, decreasing toward a switch-over."""
    if fade <= 0.0 or clear.all() or not clear.any():
        return clear.astype(np.float64)
    bad = time[~clear]
    at = np.searchsorted(bad, time)
    before = time - np.where(at > 0, bad[np.maximum(at - 1, 0)], -math.inf)
    after = np.where(at < bad.size, bad[np.minimum(at, bad.size - 1)], math.inf) - time
    return np.where(clear, np.clip(np.minimum(before, after) / fade, 0.0, 1.0), 0.0)


def _step(clear: Flags, difference: Array, variance: Array) -> tuple[float, float, int]:
    """Weighted mean difference at the switch-overs, its sd, and their number."""
    change = np.diff(clear.astype(np.int8))
    rows = np.r_[np.flatnonzero(change == -1), np.flatnonzero(change == 1) + 1]
    if not rows.size:
        return 0.0, 0.0, 0
    weight = 1.0 / np.maximum(variance[rows], 1e-30)
    mean = float((weight * difference[rows]).sum() / weight.sum())
    return mean, float(weight.sum() ** -0.5), int(rows.size)


def _check(
    time: Array, ranges: Sequence[Range], margin: float, hysteresis: float, fade: float
) -> None:
    check_time(time, None)
    for j, one in enumerate(ranges):
        y = one.values
        if y.shape != (time.size, 3) or one.noise.shape != y.shape:
            raise DataError(
                "sensors.range-shape-noise-stamps",
                quantity="ranges",
                j=j,
                shape=y.shape,
                shape_2=one.noise.shape,
                size=time.size,
            )
        check_rows(y, [f"range {j} {axis}" for axis in "xyz"], None)
    if not (0.0 <= margin < 1.0 and 0.0 <= hysteresis < 1.0 - margin):
        raise ConfigError(
            "sensors.margin-hysteresis-leave-no-range",
            quantity="margin",
            margin=margin,
            hysteresis=hysteresis,
        )
    if not fade >= 0.0:
        raise ConfigError("sensors.no-length-cross-fade", quantity="fade", fade=fade)


# Whether two ranges of one unit measure the same motion along the same axes.

# Rows of the regression with a larger standard deviation are inconclusive.
MOST_SD = 0.1
# A larger deviation from the unit matrix means swapped or inverted axes, not a scale factor.
OTHER_AXIS = 0.5
LEAST_SAMPLES = 20
# An axis that moves less than this fraction of another is dominated by errors of the other.
LEAST_PART = 0.05
# Scale factors differ by less than this.
NEAR_G = 0.15


def regress_range(higher: Array, lower: Array) -> tuple[Array, Array]:
    """Regress each axis of the higher range on the axes of the lower range.

    `higher`, `lower` ((n, 3)): where both are clear of their ends. Returns `matrix` ((3, 3)):
    least-squares solution of ``higher = matrix lower + constant``; the identity if they agree; `sd`
    ((3, 3)): from the residuals; infinite where the lower range did not vary.
    """
    x = lower - lower.mean(axis=0)
    y = higher - higher.mean(axis=0)
    normal = x.T @ x
    # An axis without motion carries no information.
    values, vectors = np.linalg.eigh(normal)
    seen = values > 1e-12 * max(float(values[-1]), 1e-300)
    inverse = (vectors[:, seen] / values[seen]) @ vectors[:, seen].T
    matrix = (inverse @ (x.T @ y)).T
    left = y - x @ matrix.T
    freedom = max(len(x) - 4, 1)
    variance = (left**2).sum(axis=0) / freedom
    # Filters and quantization correlate the residuals; this is the number of independent ones.
    power = (left**2).sum(axis=0)
    lag = (left[1:] * left[:-1]).sum(axis=0) / np.maximum(power, 1e-300)
    hangs = np.clip(lag, 0.0, 0.99)
    variance = variance * (1.0 + hangs) / (1.0 - hangs)
    sd = np.sqrt(np.maximum(variance, 1e-300)[:, None] * np.diag(inverse)[None, :])
    unseen = (vectors[:, ~seen] ** 2).sum(axis=1) > 1e-6
    sd[:, unseen] = np.inf
    return matrix, sd


def agreement_findings(unit: CrashUnit, ranges: Sequence[Range]) -> list[Finding]:
    """Find ranges with swapped or inverted axes, or that are never both unsaturated.

    Empty if the motion is insufficient: gravity alone is, because the bias
    of the higher range may be as large.
    """
    found: list[Finding] = []
    for j in range(1, len(ranges)):
        low, high = unit.accelerometers[j - 1], unit.accelerometers[j]
        source = f"{unit.name}, {high.name}"
        below, above = ranges[j - 1], ranges[j]
        clear = np.asarray(~(below.limits.clipped | above.limits.clipped).any(axis=1))
        clear[1:-1] &= clear[:-2] & clear[2:]
        if int(clear.sum()) < LEAST_SAMPLES:
            add_warning(
                found,
                "sensors.samples-both-clear-their-ends",
                file=source,
                quantity="accel",
                clear=int(clear.sum()),
                name=low.name,
            )
            continue
        upper, lower = above.values[clear], below.values[clear]
        # Noise in the lower range biases the slope toward zero: use only motion well above it.
        swing = lower.std(axis=0)
        moved = swing > np.maximum(3.0 * np.median(below.noise, axis=0), LEAST_PART * swing.max())
        matrix, sd = regress_range(upper, lower)
        for row, axis in enumerate("xyz"):
            told = (sd[row] < MOST_SD) & moved
            if low.absent:
                # Motion along the absent axis leaks into the others.
                told &= np.arange(3) == row
            wrong = told & (np.abs(matrix[row] - np.eye(3)[row]) > OTHER_AXIS)
            if not wrong.any():
                continue
            column = int(np.argmax(np.where(told, np.abs(matrix[row]), 0.0)))
            sign = "-" if matrix[row, column] < 0.0 else "+"
            felt = abs(matrix[row, column]) > OTHER_AXIS
            if _in_g(abs(float(matrix[row, row]))):
                code, column = "sensors.range-in-g", row
            elif felt:
                code = "sensors.range-follows-other-axis"
            else:
                code, column = "sensors.range-does-not-follow", row
            add_warning(
                found,
                code,
                file=source,
                quantity=f"accel_{axis}",
                name=low.name,
                axis="xyz"[column],
                sign=sign,
                ratio=matrix[row, column],
                sd=sd[row, column],
            )
    return found


def _in_g(ratio: float) -> bool:
    """Whether the ratio of two accelerations equals that of g to m/s²."""
    size = max(ratio, 1.0 / ratio) if ratio > 0.0 else 1.0
    return abs(size / STANDARD_GRAVITY - 1.0) < NEAR_G


# Bias of a high range from the range below it.

LEAST_BIAS_SAMPLES = 5
# If the input does not vary over a good part of a quantization step, averaging does not help (the
# error of the mean is below q/100 for noise above 0.7 q, and q/√12 without noise).
DITHERED = 0.5


def bias_from_lower_range(
    time: Array,
    higher: Array,
    lower: Array,
    use: Flags,
    *,
    quantization: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> BiasEstimate | None:
    """Estimate the bias of a range from the next lower one.

    `time` ((n,), s). `higher`, `lower` ((n, 3), m/s²): at the same stamps, in the same axes. `use`
    ((n, 3)): samples at which the lower range is clear of its end and the vehicle is quiet.
    `quantization` (m/s²): quantization step of the higher range. Returns bias relative to the lower
    range, whose own bias is in it; its standard deviation, from the noise of the mean and
    quantization that noise does not average out, does not include that. None if an axis has fewer
    than five usable samples.

    Mean of ``higher - lower``. Vehicle motion cancels, except for the difference of the two scale
    factors times the specific force over the stretch (gravity at rest), which appears as bias. The
    paper's bias of up to 11.91 m/s² was found this way (Tadic and Vukajlovic 2016, section 3); the
    low range's own bias, 0.2 m/s² there, remains.
    """
    bias, sd = np.zeros(3), np.zeros(3)
    for k in range(3):
        rows = np.flatnonzero(use[:, k])
        if rows.size < LEAST_BIAS_SAMPLES:
            return None
        difference = (higher[rows, k] - lower[rows, k])[:, None]
        bias[k] = difference.mean()
        noise = float(sd_of_mean(time[rows], difference)[0])
        step = float(quantization[k])
        dithered = float(higher[rows, k].std()) >= DITHERED * step
        sd[k] = np.hypot(noise, 0.0 if dithered else step / np.sqrt(12.0))
    return BiasEstimate(triad_of(bias), triad_of(sd))

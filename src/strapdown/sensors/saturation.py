"""Saturation of a sensor, also at range limits that differ from the data sheet."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from strapdown.constants import Flags
from strapdown.tables.checks import Array

# A crash saturates a sensor for tens of milliseconds; a longer flat stretch is a rest.
LONGEST_FLAT = 0.5  # s
LEAST_FLAT = 3  # samples
# The top of a smooth pulse with coarse quantization is also flat, but is left by one step.
LEAST_JUMP = 3.0  # steps
# Readings that scatter over several steps sometimes repeat, so the jump must also exceed the median
# sample-to-sample scatter.
LEAST_STANDING_OUT = 5.0
# This many repeats cannot occur between a fast rise and a slow fall, except without any noise.
SURE_FLAT = 10
# A flat extreme below this fraction of the stated range, or of the largest reading, is an end only
# if it is long, left by jumps on both sides, and this many steps off the median, because a rest
# between two pulses is also flat.
LEAST_PART = 0.1
OFF_REST = 10.0
# Values within this fraction of full scale, or within a step, are at full scale.
ROUNDING = 1e-9


@dataclass(frozen=True, eq=False)
class RangeLimits:
    """Ends of the range of a triad, and the samples there.

    `lower`, `upper` ((3,)): ends of the range, as stated or as detected, in the unit of the values.
    `clipped` ((n, 3)): samples at either end. `found` ((3,)): axes with an end detected within the
    stated range. `beyond` ((3,)): axes with readings beyond their stated full scale.
    """

    lower: Array
    upper: Array
    clipped: Flags
    found: Flags
    beyond: Flags


def find_limits(
    time: Array,
    values: Array,
    full_scale: Array,
    quantization: Array,
    held: Flags | None = None,
    *,
    longest_flat: float = LONGEST_FLAT,
) -> RangeLimits:
    """Find the ends of a triad's range and the saturated samples.

    `time` ((n,), s). `values` ((n, k)): any axes, usually three, as recorded: saturation occurs
    before any bias is removed. `full_scale` ((3,)): as stated; may be infinite. `quantization`
    ((3,)): quantization step; zero if unknown. `held` ((n, k)): samples that include saturated
    ones; there the low-pass can overshoot the end. `longest_flat` (s): longest duration of a flat
    extreme.

    A sample is clipped within a step of the stated full scale. In addition, an axis has an end
    where it repeats the extreme value of the record for three or more samples, up to
    `longest_flat`, and jumps by three or more steps on both sides (ten or more samples: on one
    side); the top of a smooth pulse is left by fewer steps. With fewer than ten samples the jump
    must also be five times the scatter, because quantized noise repeats values. Below a tenth of
    the range, or of the largest reading, ten samples and jumps on both sides are required.
    """
    lower, upper = -np.asarray(full_scale, dtype=np.float64), np.array(full_scale, dtype=np.float64)
    axes = values.shape[1]
    found, beyond = np.zeros(axes, dtype=bool), np.zeros(axes, dtype=bool)
    clipped = np.zeros(values.shape, dtype=bool)
    for k in range(axes):
        y, full = values[:, k], float(full_scale[k])
        slack = max(float(quantization[k]), ROUNDING * full) if np.isfinite(full) else 0.0
        own = y if held is None else y[~held[:, k]]
        # Not by the magnitudes of all: a long log takes a large part of the memory.
        beyond[k] = bool(max(own.max(initial=0.0), -own.min(initial=0.0)) > full + slack)
        if np.isfinite(full):
            clipped[:, k] = (np.abs(y) >= full - slack) & (np.abs(y) <= full + slack)
        for sign in (1.0, -1.0):
            flat = _flat_extreme(time, y, sign, full, longest_flat)
            if flat is None or flat.all() or (flat & ~clipped[:, k]).sum() == 0:
                continue
            end = float(y[flat][0])
            clipped[:, k] |= flat
            found[k] = True
            if sign > 0.0:
                upper[k] = end
            else:
                lower[k] = end
    return RangeLimits(lower, upper, clipped, found, beyond)


def _flat_extreme(time: Array, y: Array, sign: float, full: float, longest: float) -> Flags | None:
    """Samples at the largest or smallest value, if it appears to be an end of the range."""
    if y.size < LEAST_FLAT:
        return None
    at = y == (y.max() if sign > 0.0 else y.min())
    edges = np.diff(np.r_[False, at, False].astype(np.int8))
    starts, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    # Most records return here, before the sort below.
    if (ends - starts).max() < LEAST_FLAT:
        return None
    y = y if sign > 0.0 else -y
    top = float(y.max())
    floor = LEAST_PART * max(full if np.isfinite(full) else 0.0, float(np.abs(y).max()))
    usual = float(np.median(y))
    if top <= 0.0 or top == usual:
        return None
    # Smallest difference of two values that occur: the quantization step, or rounding.
    values = np.diff(np.unique(y))
    step, scatter = float(values.min()) if values.size else 0.0, _scatter(y)
    low = top <= floor
    if low and top - usual < OFF_REST * step:
        return None
    for a, b in zip(starts.tolist(), ends.tolist(), strict=True):
        sides = [float(y[i]) for i in (a - 1, b) if 0 <= i < y.size]
        jumps = [top - side for side in sides] or [0.0]
        short = time[b - 1] - time[a] <= longest
        # The top of a parabola that stays within a step for n samples is left by ((n + 2)/n)²
        # steps.
        n = b - a
        least = max(LEAST_JUMP - 0.5, (1.0 + 2.0 / n) ** 2 + 0.5) * step
        if n < SURE_FLAT:
            least = max(least, LEAST_STANDING_OUT * scatter)
        jump = max(jumps) if n >= SURE_FLAT and not low else min(jumps)
        enough = n >= SURE_FLAT and len(sides) == 2 if low else n >= LEAST_FLAT
        if enough and short and jump >= least:
            return np.asarray(at, dtype=np.bool_)
    return None


def _scatter(y: Array) -> float:
    """Sample-to-sample standard deviation, from the median of second differences."""
    # The second difference of three independent samples has sqrt(6) times the standard deviation of
    # one, and the median of its absolute value is 0.6745 of that.
    return float(np.median(np.abs(np.diff(y, 2)))) / (0.6745 * math.sqrt(6.0))

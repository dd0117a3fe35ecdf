"""Where a sensor is at the end of its range, also where that is not where its data sheet says."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

__all__ = ["RangeLimits", "find_limits"]

# A crash holds a sensor at its end for tens of milliseconds; what is flat for longer is a rest.
LONGEST_FLAT = 0.5  # s
LEAST_FLAT = 3  # samples
# The top of a smooth pulse in coarse steps is flat, too, but is left by one step.
LEAST_JUMP = 3.0  # steps
# Readings that scatter over several steps repeat one now and then: the jump must also stand out of
# the scatter from sample to sample, that of the middle of all.
LEAST_STANDING_OUT = 5.0
# So many cannot be where a fast rise meets a slow fall, unless there is no noise at all.
SURE_FLAT = 10
# A flat extreme below this part of the stated range, or of the largest reading, is an end only
# where it is surely flat, left by jumps on both sides, and this many steps off the usual value:
# a rest between two pulses is flat, too.
LEAST_PART = 0.1
OFF_REST = 10.0
# Of a full scale: what is nearer to it than this, or than a step, is at it.
ROUNDING = 1e-9


@dataclass(frozen=True, eq=False)
class RangeLimits:
    """Ends of the range of a triad, and who stood there.

    Attributes
    ----------
    lower, upper : ndarray, (3,)
        Ends of the range, as stated or as found, in the unit of the values.
    clipped : ndarray of bool, (n, 3)
        Samples at either end.
    found : ndarray of bool, (3,)
        Axes with an end that was found within the stated range.
    beyond : ndarray of bool, (3,)
        Axes that read more than their stated full scale.
    """

    lower: Array
    upper: Array
    clipped: Mask
    found: Mask
    beyond: Mask


def find_limits(
    time: Array,
    values: Array,
    full_scale: Array,
    quantization: Array,
    held: Mask | None = None,
    *,
    longest_flat: float = LONGEST_FLAT,
) -> RangeLimits:
    """Find the ends of a triad's range and the samples that stand there.

    Parameters
    ----------
    time : ndarray, (n,), s
    values : ndarray, (n, k)
        Any axes, usually three, as recorded: saturation happens before any bias is taken off.
    full_scale : ndarray, (3,)
        As stated; may be infinite.
    quantization : ndarray, (3,)
        Step of the output; zero where there is none.
    held : ndarray of bool, (n, k), optional
        Samples in which others count that stood at an end: a low-pass swings beyond it there.
    longest_flat : float, s
        For how long a flat extreme may last.

    Returns
    -------
    RangeLimits

    Notes
    -----
    A sample is clipped where it is within a step of the stated full scale. Besides, an axis has
    an end where it stays on the very same extreme value of the record for three samples or
    more, up to `longest_flat`, and jumps by three steps or more on both sides (ten samples or more:
    on one side): the top of a smooth pulse is left by fewer steps. Fewer than ten must also jump by
    five times the scatter, for noise in steps repeats a number. Below a tenth of the range,
    or of the largest reading, it needs ten samples and jumps on both sides.
    """
    lower, upper = -np.asarray(full_scale, dtype=np.float64), np.array(full_scale, dtype=np.float64)
    axes = values.shape[1]
    found, beyond = np.zeros(axes, dtype=bool), np.zeros(axes, dtype=bool)
    clipped = np.zeros(values.shape, dtype=bool)
    for k in range(axes):
        y, full = values[:, k], float(full_scale[k])
        slack = max(float(quantization[k]), ROUNDING * full) if np.isfinite(full) else 0.0
        own = y if held is None else y[~held[:, k]]
        beyond[k] = bool(np.abs(own).max(initial=0.0) > full + slack)
        if np.isfinite(full):
            clipped[:, k] = (np.abs(y) >= full - slack) & (np.abs(y) <= full + slack)
        for sign in (1.0, -1.0):
            flat = _flat_extreme(time, sign * y, full, longest_flat)
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


def _flat_extreme(time: Array, y: Array, full: float, longest: float) -> Mask | None:
    """Samples on the largest value, where it looks like an end of the range."""
    if y.size < LEAST_FLAT:
        return None
    top = float(y.max())
    at = y == top
    edges = np.diff(np.r_[False, at, False].astype(np.int8))
    starts, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    # Most records stop here, before all that is sorted.
    if (ends - starts).max() < LEAST_FLAT:
        return None
    floor = LEAST_PART * max(full if np.isfinite(full) else 0.0, float(np.abs(y).max()))
    usual = float(np.median(y))
    if top <= 0.0 or top == usual:
        return None
    step, scatter = _least_step(y), _scatter(y)
    low = top <= floor
    if low and top - usual < OFF_REST * step:
        return None
    for a, b in zip(starts.tolist(), ends.tolist(), strict=True):
        sides = [float(y[i]) for i in (a - 1, b) if 0 <= i < y.size]
        jumps = [top - side for side in sides] or [0.0]
        short = time[b - 1] - time[a] <= longest
        # The top of a parabola that stays within a step for n samples is left by ((n + 2)/n)².
        n = b - a
        least = max(LEAST_JUMP - 0.5, (1.0 + 2.0 / n) ** 2 + 0.5) * step
        if n < SURE_FLAT:
            least = max(least, LEAST_STANDING_OUT * scatter)
        jump = max(jumps) if n >= SURE_FLAT and not low else min(jumps)
        enough = n >= SURE_FLAT and len(sides) == 2 if low else n >= LEAST_FLAT
        if enough and short and jump >= least:
            return np.asarray(at, dtype=np.bool_)
    return None


def _least_step(y: Array) -> float:
    """Smallest difference of two values that occur: the converter's step, or rounding."""
    gaps = np.diff(np.unique(y))
    return float(gaps.min()) if gaps.size else 0.0


def _scatter(y: Array) -> float:
    """Standard deviation from sample to sample, by the median of second differences."""
    if y.size < LEAST_FLAT:
        return 0.0
    # Of three independent samples the second difference has sqrt(6) times one's, and the median
    # of its size is 0.6745 of that.
    return float(np.median(np.abs(np.diff(y, 2)))) / (0.6745 * math.sqrt(6.0))

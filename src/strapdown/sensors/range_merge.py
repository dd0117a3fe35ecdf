"""One signal from sensors of several ranges."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import ConfigError, DataError
from strapdown.sensors.saturation import RangeLimits
from strapdown.tables.checks import check_rows, check_time

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

__all__ = ["MergedRanges", "merge_ranges"]

# After an end the filter before the sampler still holds what was cut off: e⁻⁵ = 0.7 % of it
# after five of its time constants.
MEMORY = 5.0


@dataclass(frozen=True, eq=False)
class MergedRanges:
    """One triad made of several.

    Attributes
    ----------
    values : ndarray, (n, 3), u
    noise : ndarray, (n, 3), u
        Standard deviation of each sample.
    spoken : ndarray of int8, (n, 3)
        Which range spoke; within a cross-fade the one with more weight.
    clipped : ndarray of bool, (n, 3)
        Whether even the one that spoke was at its end.
    step : ndarray, (m - 1, 3), u
        Mean difference of two neighbouring ranges at their switch-overs in each axis, what lies
        above minus the lower; zero where the lower one always speaks.
    step_sd : ndarray, (m - 1, 3), u
        Of that, from the noise of both.
    switches : ndarray of int, (m - 1, 3)
        How often the lower one fell silent or spoke again.
    """

    values: Array
    noise: Array
    spoken: NDArray[np.int8]
    clipped: Mask
    step: Array
    step_sd: Array
    switches: NDArray[np.int64]


def merge_ranges(
    time: Array,
    values: Sequence[Array],
    limits: Sequence[RangeLimits],
    noise: Sequence[Array],
    *,
    bias: Sequence[Array] | None = None,
    bandwidth: Sequence[float] | None = None,
    margin: float = 0.1,
    hysteresis: float = 0.1,
    fade: float = 0.0,
) -> MergedRanges:
    """Let the lowest range speak while it is clear of its end, and the next beyond.

    Parameters
    ----------
    time : ndarray, (n,), s
    values : sequence of ndarray, (n, 3), u
        As recorded, the lowest range first, all at the same stamps in the same axes.
    limits : sequence of RangeLimits
        As `saturation.find_limits` gives them.
    noise : sequence of ndarray, (n, 3), u
        Standard deviation of each sample.
    bias : sequence of ndarray, (3,), u, optional
        Taken off each range after it was judged, so that the ranges meet without a step.
    bandwidth : sequence of float, Hz, optional
        Of the low-pass before each sampler.
    margin : float
        Part of the full scale: a range is left within this of its end.
    hysteresis : float
        Part of the full scale: it speaks again once it is this much further inside, so that
        noise about the threshold does not make it chatter.
    fade : float, s
        Length over which the weight goes from the one range to the other, on the side where
        both are clear; zero for none.

    Returns
    -------
    MergedRanges

    Notes
    -----
    Each axis is on its own. The sample before an excursion is left to the higher range, too,
    and so is what follows it, for one sample and for five time constants ``1 / (2 pi
    bandwidth)``: a filter behind the element that was held at its end still gives out what was
    cut. Within a cross-fade with weight w the variance is ``w² s_low² + (1 - w)² s_high²``.

    Raises
    ------
    DataError
        A value is not a finite number, time does not advance, or shapes disagree.
    ConfigError
        Margins are not within [0, 1), or the fade is negative.
    """
    _check(time, values, limits, noise, margin, hysteresis, fade)
    count, n = len(values), time.size
    offsets = [np.zeros(3) if bias is None else np.asarray(bias[j]) for j in range(count)]
    memory = [0.0 if bandwidth is None else _memory(bandwidth[j]) for j in range(count)]
    out = np.empty((n, 3))
    sd = np.empty((n, 3))
    spoken = np.zeros((n, 3), dtype=np.int8)
    clipped = np.zeros((n, 3), dtype=bool)
    step, step_sd = np.zeros((count - 1, 3)), np.zeros((count - 1, 3))
    switches = np.zeros((count - 1, 3), dtype=np.int64)
    for k in range(3):
        # From the top down: what is merged so far speaks wherever the next lower may not.
        top = count - 1
        y, s = values[top][:, k] - offsets[top][k], np.array(noise[top][:, k])
        who, cut = np.full(n, top, dtype=np.int8), limits[top].clipped[:, k].copy()
        for j in range(count - 2, -1, -1):
            clear = _clear(time, values[j][:, k], limits[j], k, margin, hysteresis, memory[j])
            low = values[j][:, k] - offsets[j][k]
            step[j, k], step_sd[j, k], switches[j, k] = _step(
                clear, y - low, s**2 + noise[j][:, k] ** 2
            )
            weight = _weight(time, clear, fade)
            y = weight * low + (1.0 - weight) * y
            s = np.hypot(weight * noise[j][:, k], (1.0 - weight) * s)
            who[weight > 0.5] = j
            cut[weight > 0.5] = limits[j].clipped[weight > 0.5, k]
        out[:, k], sd[:, k], spoken[:, k], clipped[:, k] = y, s, who, cut
    return MergedRanges(out, sd, spoken, clipped, step, step_sd, switches)


def _memory(bandwidth: float) -> float:
    return MEMORY / (2.0 * math.pi * bandwidth) if bandwidth > 0.0 else 0.0


def _clear(
    time: Array,
    y: Array,
    limits: RangeLimits,
    k: int,
    margin: float,
    hysteresis: float,
    memory: float,
) -> Mask:
    """Where a range is clear of its end, with hysteresis, neighbours and the filter's memory."""
    low, high = float(limits.lower[k]), float(limits.upper[k])
    if not (math.isfinite(low) or math.isfinite(high)):
        return np.ones(y.size, dtype=np.bool_)
    # How far out, as part of the full scale of that side.
    with np.errstate(invalid="ignore"):
        part = np.maximum(y / high, y / low)
    near = (part > 1.0 - margin) | limits.clipped[:, k]
    back = part <= 1.0 - margin - hysteresis
    # Between the two thresholds the state stays what it was at the last sample outside them.
    known = near | back
    last = np.maximum.accumulate(np.where(known, np.arange(y.size), -1))
    away = np.where(last >= 0, near[np.maximum(last, 0)], False)
    away[:-1] |= away[1:].copy()
    bad = np.flatnonzero(away)
    if bad.size:
        previous = np.searchsorted(bad, np.arange(y.size), side="right") - 1
        there = previous >= 0
        since = np.full(y.size, math.inf)
        at = bad[np.maximum(previous, 0)]
        since[there] = (time - time[at])[there]
        away |= (since <= memory) | (there & (np.arange(y.size) - at <= 1))
    return np.asarray(~away, dtype=np.bool_)


def _weight(time: Array, clear: Mask, fade: float) -> Array:
    """Weight of the lower range: one where it is clear, falling towards a switch-over."""
    if fade <= 0.0 or clear.all() or not clear.any():
        return clear.astype(np.float64)
    bad = time[~clear]
    at = np.searchsorted(bad, time)
    before = time - np.where(at > 0, bad[np.maximum(at - 1, 0)], -math.inf)
    after = np.where(at < bad.size, bad[np.minimum(at, bad.size - 1)], math.inf) - time
    return np.where(clear, np.clip(np.minimum(before, after) / fade, 0.0, 1.0), 0.0)


def _step(clear: Mask, difference: Array, variance: Array) -> tuple[float, float, int]:
    """Weighted mean difference at the switch-overs, its sd, and how many there are."""
    change = np.diff(clear.astype(np.int8))
    rows = np.r_[np.flatnonzero(change == -1), np.flatnonzero(change == 1) + 1]
    if not rows.size:
        return 0.0, 0.0, 0
    weight = 1.0 / np.maximum(variance[rows], 1e-30)
    mean = float((weight * difference[rows]).sum() / weight.sum())
    return mean, float(weight.sum() ** -0.5), int(rows.size)


def _check(
    time: Array,
    values: Sequence[Array],
    limits: Sequence[RangeLimits],
    noise: Sequence[Array],
    margin: float,
    hysteresis: float,
    fade: float,
) -> None:
    if not values or not len(values) == len(limits) == len(noise):
        raise DataError(
            "sensors.ranges-limits-noise",
            quantity="ranges",
            count=len(values),
            count_2=len(limits),
            count_3=len(noise),
        )
    check_time(time, None)
    for j, y in enumerate(values):
        if y.shape != (time.size, 3) or noise[j].shape != y.shape:
            raise DataError(
                "sensors.range-shape-noise-stamps",
                quantity="ranges",
                j=j,
                shape=y.shape,
                shape_2=noise[j].shape,
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

"""Samples of a signal: checks before filters, runs of flags, white noise, moving mean, integral."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from strapdown._kernels import piecewise
from strapdown.constants import Array
from strapdown.errors import ConfigError, DataError

# Stamps printed to a tenth of a step still count as an even grid.
JITTER = 0.1


def occupied_grid(time: Array, end: float, step: float, reach: float) -> Array:
    """Return the instants of an even grid after which samples follow.

    `time` ((n,), s): increasing; the grid begins with it. `end`, `step` (s): of the grid. `reach`
    (s): within which a sample follows, a few steps. At most reach/step + 2 instants for each
    sample, however long the pauses are; without long ones the whole grid.
    """
    if end - time[0] <= 2.0 * step * time.size:
        return np.arange(time[0], end, step)
    cells = np.floor((time - time[0]) / step)
    before = np.arange(math.ceil(reach / step) + 1.0)
    grid = time[0] + step * np.unique((cells[:, None] - before).ravel())
    return np.asarray(grid[(grid >= time[0]) & (grid < end)])


def noise_free(values: Array) -> bool:
    """Whether channels, (n, k), are of a simulation without noise.

    Of white noise the fourth differences exceed the second 3.4 times, of a smooth motion they are
    far below.
    """
    second = np.diff(values, n=2, axis=0)
    fourth = np.diff(second, n=2, axis=0)
    return bool((np.square(fourth).mean(axis=0) <= np.square(second).mean(axis=0)).all())


def constant_beside_noise(
    channels: Sequence[Array], fewest: int, some: int | None = None
) -> list[bool]:
    """Whether each channel, (n,), never changes, beside others that have the noise of a sensor.

    Parameters
    ----------
    fewest : int
        Samples of a channel; fewer may be alike by chance.
    some : int, optional
        So many at the beginning show whether the others have noise; by default all.
    """
    constant = [
        c.size >= fewest and bool((c[:some] == c[0]).all() and (c == c[0]).all()) for c in channels
    ]
    if not any(constant):
        return constant
    others = [c for c, same in zip(channels, constant, strict=True) if not same]
    noisy = any(c.size >= fewest and not noise_free(c[:some, None]) for c in others)
    return constant if noisy else [False] * len(constant)


def as_channels(values: ArrayLike, quantity: str = "values") -> Array:
    """Convert samples to floats of shape (n, k), all finite.

    `values` ((n,) or (n, k)). `quantity`: name for messages. DataError: the shape is wrong, or a
    value is not finite.
    """
    try:
        array = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError):
        array = np.empty((0, 0, 0))
    if array.ndim not in (1, 2) or array.size == 0:
        raise DataError("dsp.these-no-samples-shape-n", quantity=quantity)
    array = array.reshape(len(array), -1)
    bad = ~np.isfinite(array)
    if bad.any():
        row, channel = (int(i) for i in np.argwhere(bad)[0])
        raise DataError(
            "dsp.channel-sample-such-all-would",
            row=row + 1,
            quantity=quantity,
            channel=channel,
            array=array[row, channel],
            at_row=row,
            bad=int(bad.sum()),
        )
    return array


def check_segment(values: Array, first: int) -> None:
    """Check that every value of a further chunk is finite.

    `values` ((k, c)). `first`: index of its first sample, from the start of the record. DataError:
    a value is not finite. The message names the row, counted from 1 over the whole record, and the
    channel.
    """
    # A sum is finite only if every term is.
    with np.errstate(invalid="ignore", over="ignore"):
        total = values.sum()
    if np.isfinite(total) or np.isfinite(values).all():
        return
    row, channel = (int(i) for i in np.argwhere(~np.isfinite(values))[0])
    raise DataError(
        "dsp.channel",
        row=first + row + 1,
        quantity="values",
        channel=channel,
        values=values[row, channel],
    )


def positive_step(step: float) -> float:
    """Return the sampling interval in s.

    ConfigError: the interval is not positive and finite.
    """
    if not (math.isfinite(step) and step > 0.0):
        raise ConfigError("dsp.no-distance-samples", quantity="step", step=step)
    return float(step)


def even_step(time: ArrayLike, quantity: str = "time") -> float:
    """Return the step of evenly spaced stamps.

    `time` ((n,), s). `quantity`: name for messages. Returns s: last minus first stamp, divided by
    the number of steps. Stamps may be off the grid by a tenth of a step, as printed ones are.
    DataError: fewer than two stamps, time does not advance, or the stamps are not even.
    """
    stamps = as_channels(time, quantity)[:, 0]
    if len(stamps) < 2:
        raise DataError("dsp.stamp-no-step", quantity=quantity, count=len(stamps))
    steps = np.diff(stamps)
    if not steps.min() > 0.0:
        row = int(np.argmax(steps <= 0.0)) + 1
        raise DataError(
            "dsp.time-does-not-advance-followed-2",
            row=row + 1,
            quantity=quantity,
            stamps=stamps[row - 1],
            stamps_2=stamps[row],
        )
    step = float(stamps[-1] - stamps[0]) / (len(stamps) - 1)
    off = np.abs(stamps - stamps[0] - step * np.arange(len(stamps)))
    if off.max() > JITTER * step:
        row = int(np.argmax(np.abs(steps - np.median(steps)))) + 1
        raise DataError(
            "dsp.samples-not-evenly-spaced-usual",
            row=row + 1,
            quantity=quantity,
            median=np.median(steps),
            stamps=stamps[row - 1],
            stamps_2=stamps[row],
        )
    return step


def true_runs(flags: NDArray[np.bool_]) -> list[slice]:
    """Return the runs of true values, in order: `flags` ((n,)) is true over each slice."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(np.int8)))
    return [slice(begin, end) for begin, end in edges.reshape(-1, 2).tolist()]


def white_sd(values: Array) -> Array:
    """Estimate the standard deviation of white noise by second differences, per channel.

    They have six times its variance, and remove what changes linearly. `values` ((n, ...)): at
    equal steps. Returns (...), in their unit.
    """
    return np.asarray(np.sqrt(np.square(np.diff(values, n=2, axis=0)).mean(axis=0) / 6.0))


def moving_mean(values: Array, width: int) -> Array:
    """Average over the `width` samples about each; the first and last samples continue beyond.

    `values` ((n, ...)). Returns (n, ...): ``scipy.ndimage.uniform_filter1d(mode="nearest")`` to the
    last bit, without its import, which takes longer than reading a log.
    """
    before = width // 2
    ends = (np.repeat(values[:1], before, axis=0), np.repeat(values[-1:], width - 1 - before, 0))
    padded = np.concatenate([ends[0], values, ends[1]])
    steps = padded[width:] - padded[:-width]
    first = np.cumsum(padded[:width], axis=0)[-1:]
    return np.asarray(np.cumsum(np.concatenate([first, steps]), axis=0) / width)


#: Numbers that are integrated at a time.
AT_ONCE = 1 << 16


def running_integral(time: Array, values: Array, *, means: bool = False) -> Array:
    """Integrate samples from the first stamp to each.

    `time` ((n,), s): at least one stamp, any spacing. `values` ((n, ...)): in any unit. `means`: a
    sample is the mean over the interval that ends at its stamp, and the first is unused. Otherwise
    it is the value at its stamp, linear in between (trapezoids; error of second order in the step).
    Returns (n, ...), unit of the values times s: zero at the first stamp.

    The trapezoids equal `scipy.integrate.cumulative_trapezoid` to the last bit; importing that
    takes a fifth of a second, for every log with velocities.
    """
    out = np.empty(values.shape)
    out[0] = 0.0
    columns, sums = values.reshape(len(out), -1), out.reshape(len(out), -1)
    # Part by part: a long log takes a large part of the memory.
    rows = max(AT_ONCE // max(columns.shape[1], 1), 1)
    for at in range(0, len(out) - 1, rows):
        part = columns[at : at + rows + 1]
        lengths = np.diff(time[at : at + rows + 1])[:, None]
        # Half of a length is exact.
        steps = part[1:] * lengths if means else (part[1:] + part[:-1]) * (0.5 * lengths)
        if at:
            steps[0] += sums[at]
        np.cumsum(steps, axis=0, out=sums[at + 1 : at + rows + 1])
    return out


# --- cubics: through values and slopes, or the spline through values alone --------------
# In the operations of scipy's `CubicHermiteSpline`, `CubicSpline` and `PPoly`, whose package takes
# 0.3 s to load: to the last bit the same numbers.


@dataclass(frozen=True, eq=False)
class Polynomials:
    """Polynomials between knots; the outermost ones go on.

    Attributes
    ----------
    knots : ndarray, (n,)
        Increasing.
    coefficients : ndarray, (terms, n - 1, m)
        Highest power first, of the distance from the knot to the left.
    """

    knots: Array
    coefficients: Array

    def __call__(self, at: Array) -> Array:
        """Values, (k, m), at (k,)."""
        k = np.clip(np.searchsorted(self.knots, at, side="right") - 1, 0, len(self.knots) - 2)
        since = (at - self.knots[k])[:, None]
        value, power = self.coefficients[-1, k], since
        for coefficient in self.coefficients[-2::-1]:
            value = value + coefficient[k] * power
            power = power * since
        return np.asarray(value)

    def integral(self) -> Self:
        """From the first knot."""
        terms = len(self.coefficients)
        divided = self.coefficients / np.arange(terms, 0.0, -1.0)[:, None, None]
        step = np.diff(self.knots)[:, None]
        parts, power = [], step
        for coefficient in divided[::-1]:
            parts.append(coefficient * power)
            power = power * step
        # One after the other, as when each constant is the value at the end of the piece before.
        total = np.cumsum(np.stack(parts, axis=1).reshape(-1, step.shape[1] * divided.shape[2]), 0)
        constant = np.concatenate([np.zeros_like(total[:1]), total[terms - 1 : -1 : terms]])
        return type(self)(self.knots, np.concatenate([divided, constant[None]]))


def hermite(knots: Array, values: Array, slopes: Array) -> Polynomials:
    """Cubics through values and slopes, (n, m), at knots, (n,)."""
    step = np.diff(knots)[:, None]
    chord = np.diff(values, axis=0) / step
    bend = (slopes[:-1] + slopes[1:] - 2.0 * chord) / step
    parts = (bend / step, (chord - slopes[:-1]) / step - bend, slopes[:-1], values[:-1])
    return Polynomials(knots, np.stack(parts))


def spline(knots: Array, values: Array) -> Polynomials:
    """Cubic spline through values, (n, m), at knots, (n,), of which there are four or more.

    Two neighbors at either end share a cubic ("not a knot").
    """
    step = np.diff(knots)
    column = step[:, None]
    chord = np.diff(values, axis=0) / column
    first, last = knots[2] - knots[0], knots[-1] - knots[-3]
    diagonal = np.concatenate([step[1:2], 2.0 * (step[:-1] + step[1:]), step[-2:-1]])
    upper = np.concatenate([[first], step[:-1]])
    lower = np.concatenate([step[1:], [last]])
    slopes = np.empty(values.shape)
    slopes[1:-1] = 3.0 * (column[1:] * chord[:-1] + column[:-1] * chord[1:])
    slopes[0] = (step[0] + 2.0 * first) * step[1] * chord[0] + step[0] ** 2 * chord[1]
    slopes[-1] = step[-1] ** 2 * chord[-2] + (2.0 * last + step[-1]) * step[-2] * chord[-1]
    slopes[[0, -1]] /= np.array([[first], [last]])
    piecewise.solve_tridiagonal(lower, diagonal, upper, slopes)
    return hermite(knots, values, slopes)

"""Random errors of a triad, each kind and axis from a stream of its own."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from strapdown.sensors.triad_errors import Triad

Array = NDArray[np.float64]
Seed = int | np.random.SeedSequence

# Places in the tree of seeds. A number is never given to another kind: what a seed draws would
# change. "Mean" kinds hold what a mean over an interval knows beyond the value at its end.
NOISE, INSTABILITY, INSTABILITY_MEAN, WALK, WALK_MEAN, JITTER = range(6)

# Below this ratio of step to correlation time, the closed form of the integral's variance
# loses more than half its digits, and its series is used.
SERIES_LIMIT = 0.1


def child(seed: Seed, *place: int) -> np.random.SeedSequence:
    """Return the seed at a place in the tree that hangs below another.

    Parameters
    ----------
    seed : int or SeedSequence
        A SeedSequence is not changed.
    *place : int
        As successive calls of ``SeedSequence.spawn`` would number it.
    """
    root = seed if isinstance(seed, np.random.SeedSequence) else np.random.SeedSequence(seed)
    return np.random.SeedSequence(root.entropy, spawn_key=(*root.spawn_key, *place))


def normal(seed: Seed, kind: int, count: int, axes: int = 3) -> Array:
    """Standard normal numbers, (count, axes), each axis from its own stream."""
    out = np.empty((count, axes))
    for axis in range(axes):
        generator = np.random.Generator(np.random.PCG64(child(seed, kind, axis)))
        out[:, axis] = generator.standard_normal(count)
    return out


def white_noise(seed: Seed, steps: Array, density: Triad) -> Array:
    """White noise of the given density over intervals of the given lengths.

    The mean of white noise of density N over an interval dt has the standard deviation
    ``N / √dt``; an instantaneous sample is taken to be limited to half the sampling rate, which
    gives the same.
    """
    sd = np.asarray(density) / np.sqrt(steps)[:, None]
    return np.asarray(normal(seed, NOISE, steps.size) * sd, dtype=np.float64)


def random_walk(seed: Seed, steps: Array, density: Triad, mean: bool) -> Array:
    """Brownian motion at the end of each step, or its mean over each step.

    Instantaneous: zero at the first sample. Mean: zero at the start of the first step. With
    ``x1 - x0 = K √dt w1``, the mean over the step is ``x0 + K √dt (w1/2 + w2/√12)``.
    """
    root = np.sqrt(steps)[:, None]
    moves = root * normal(seed, WALK, steps.size)
    if not mean:
        moves[0] = 0.0
        return np.asarray(np.cumsum(moves, axis=0) * np.asarray(density), dtype=np.float64)
    before = np.cumsum(moves, axis=0) - moves
    inside = 0.5 * moves + root * normal(seed, WALK_MEAN, steps.size) / np.sqrt(12.0)
    return np.asarray((before + inside) * np.asarray(density), dtype=np.float64)


def gauss_markov(seed: Seed, steps: Array, sd: Triad, correlation: float, mean: bool) -> Array:
    """A stationary Gauss-Markov process at the end of each step, or its mean over each step.

    Exact for every step length: with ``h = dt/τ`` and ``a = exp(-h)``,
    ``x1 = a x0 + sd √(1 - a²) w1``. The integral over the step, in units of sd τ, has given x0
    the mean ``(1 - a) x0/sd``, the variance ``2h - 3 + 4a - a²`` and the covariance
    ``(1 - a)²`` with x1 (Gillespie 1996, Physical Review E 54, 2084).
    """
    from strapdown._kernels.recursion import first_order

    h = steps / correlation
    a = np.exp(-h)
    spread = np.sqrt(-np.expm1(-2.0 * h))
    w1 = normal(seed, INSTABILITY, steps.size)
    drive = spread[:, None] * w1
    first = np.zeros(3)
    if mean:
        # The process begins, stationary, at the start of the first step; that number is the
        # first of the second stream.
        further = normal(seed, INSTABILITY_MEAN, steps.size + 1)
        first = further[0].copy()
    else:
        # The first sample itself is drawn from the stationary distribution.
        a[0], drive[0] = 0.0, w1[0]
    x = np.empty_like(drive)
    first_order(a, drive, first, x)
    if not mean:
        return np.asarray(x * np.asarray(sd), dtype=np.float64)
    before = np.vstack([first, x[:-1]])
    given_start = -np.expm1(-h)
    # Part of the integral that the end tells, and what is left.
    told = np.divide(given_start**2, spread, out=np.zeros_like(h), where=spread > 0.0)
    left = np.sqrt(np.maximum(integral_variance(h) - told**2, 0.0))
    integral = given_start[:, None] * before + told[:, None] * w1 + left[:, None] * further[1:]
    small = np.divide(1.0, h, out=np.ones_like(h), where=h > 0.0)[:, None]
    out = np.where(h[:, None] > 0.0, integral * small, before)
    return np.asarray(out * np.asarray(sd), dtype=np.float64)


def integral_variance(h: Array) -> Array:
    """``2h - 3 + 4 exp(-h) - exp(-2h)``, to rounding on both sides of the series' limit."""
    closed = 2.0 * h - 3.0 + 4.0 * np.exp(-h) - np.exp(-2.0 * h)
    series = np.zeros_like(h)
    small = np.minimum(h, SERIES_LIMIT)
    power = small * small / 2.0
    for n in range(3, 16):
        power = power * small / n
        series += (-1.0) ** n * (4.0 - 2.0**n) * power
    return np.where(h < SERIES_LIMIT, series, closed)

"""Error model of a triad: apply its errors to true values, and compensate the known ones.

The order is that of a real signal chain, from the motion to the output:

1. the sampler's clock: `jitter`;
2. the low-pass between motion and sampler: `bandwidth`;
3. the directions of the sensors: ``v = (I + misalignment) u``;
4. the effect of specific force on a gyro: ``v + g_sensitivity f``;
5. the sensor's transfer curve: `scale`, `nonlinearity_2`, `nonlinearity_3`;
6. the drifts: `bias`, `trend`, `warm_up`, `vibration_rectification`, `bias_instability`,
   `random_walk`;
7. `noise_density`;
8. the converter: `full_scale`, then `quantization`.

`compensate` inverts 3 to 5 and the bias, trend, warm-up and rectification of 6. The others are
random or not invertible.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from strapdown.errors import ConfigError, DataError
from strapdown.sensors.triad_errors import Triad, TriadErrors
from strapdown.tables import check_sampling_kind
from strapdown.tables.checks import Array

# With larger jitter, instants could overtake one another.
MOST_JITTER = 0.1


def apply(
    errors: TriadErrors,
    time: ArrayLike,
    true: ArrayLike,
    *,
    sampling: str = "instantaneous",
    seed: Seed = 0,
    specific_force: ArrayLike | None = None,
    sampled: bool = False,
    vibration: ArrayLike | None = None,
) -> Array:
    """Apply the errors of a triad to true values.

    Parameters
    ----------
    errors : TriadErrors
    time : array_like, (n,), s
        Increasing stamps, any spacing.
    true : array_like, (n, 3), u
        Readings of an ideal triad in body axes.
    sampling : {'instantaneous', 'mean'}
        Whether a row is the value at its stamp or the mean over the interval that ends there; the
        first interval is assumed as long as the second.
    seed : int or SeedSequence
        Each kind of error and each axis has its own stream, so that enabling one does not change
        the draws of the others.
    specific_force : array_like, (n, 3), m/s², optional
        Required where `g_sensitivity` is not zero.
    sampled : bool
        The values already include the effects before the sampler, jitter and low-pass, as from
        `simulate_imu`, which evaluates the motion between the samples. Otherwise the values are
        interpolated linearly (means: their integral).
    vibration : array_like, (n, 3), (m/s²)², optional
        Mean square vibration about each sample, which `vibration_rectification` converts to a bias
        shift; default, none.

    Returns
    -------
    ndarray, (n, 3), u

    Raises
    ------
    DataError
        Shapes disagree or time does not increase.
    ConfigError
        `sampling` is unknown, the specific force is missing, or the jitter exceeds a tenth of
        an interval.
    """
    t, u = _rows(time, true, "true")
    mean = _is_mean(sampling)
    steps = intervals(t)
    if not sampled:
        u = _through_clock(errors, t, u, steps, mean, seed)
        u = _through_filter(errors, t, u, steps, mean)
    v = u + u @ np.asarray(errors.misalignment).T + _g_effect(errors, u, specific_force)
    y = np.column_stack([transfer(v[:, k], *_curve(errors, k)) for k in range(3)])
    y += known_drift(errors, t, steps, mean) + _rectified(errors, y, vibration)
    if any(errors.axis("bias_instability")):
        y += gauss_markov(
            seed, steps, errors.axis("bias_instability"), errors.correlation_time, mean
        )
    if any(errors.axis("random_walk")):
        y += random_walk(seed, steps, errors.axis("random_walk"), mean)
    if any(errors.axis("noise_density")):
        y += white_noise(seed, steps, errors.axis("noise_density"))
    full, quantum = np.asarray(errors.full_scale), np.asarray(errors.quantization)
    y = np.clip(y, -full, full)
    coarse = quantum > 0.0
    y[:, coarse] = np.rint(y[:, coarse] / quantum[coarse]) * quantum[coarse]
    return y


def compensate(
    errors: TriadErrors,
    time: ArrayLike,
    measured: ArrayLike,
    *,
    sampling: str = "instantaneous",
    specific_force: ArrayLike | None = None,
    vibration: ArrayLike | None = None,
) -> Array:
    """Remove the known errors from measured values.

    Parameters
    ----------
    errors : TriadErrors
        The specification given to `apply`, or a calibration.
    time : array_like, (n,), s
    measured : array_like, (n, 3), u
    sampling : {'instantaneous', 'mean'}
    specific_force : array_like, (n, 3), m/s², optional
        Required where `g_sensitivity` is not zero; compensate the accelerometer first.
    vibration : array_like, (n, 3), (m/s²)², optional
        As of `apply`.

    Returns
    -------
    ndarray, (n, 3), u
        Corrected for bias, trend, warm-up, rectification, scale factor, nonlinearity, g-sensitivity
        and misalignment, to rounding.

    Raises
    ------
    DataError, ConfigError
        As `apply`.
    """
    t, y = _rows(time, measured, "measured")
    mean = _is_mean(sampling)
    y = y - known_drift(errors, t, intervals(t), mean) - _rectified(errors, y, vibration)
    v = np.column_stack([input_of(y[:, k], *_curve(errors, k)) for k in range(3)])
    v -= _g_effect(errors, v, specific_force)
    directions = np.eye(3) + np.asarray(errors.misalignment)
    return np.ascontiguousarray(np.linalg.solve(directions, v.T).T)


def intervals(time: Array) -> Array:
    """Length of the interval of each sample; the first as the second."""
    steps = np.diff(time)
    return np.concatenate([steps[:1], steps])


def jitter(errors: TriadErrors, steps: Array, seed: Seed) -> Array:
    """Delay of each sampling instant after its stamp, (n,), s.

    ConfigError: the standard deviation is more than a tenth of an interval.
    """
    shortest = float(steps.min())
    if errors.jitter > MOST_JITTER * shortest:
        raise ConfigError(
            "sensors.jitter-more-than-tenth-interval",
            quantity="jitter",
            jitter=errors.jitter,
            shortest=shortest,
        )
    if errors.jitter == 0.0:
        return np.zeros(steps.size)
    return errors.jitter * normal(seed, JITTER, steps.size, axes=1)[:, 0]


def _rows(time: ArrayLike, values: ArrayLike, name: str) -> tuple[Array, Array]:
    t, v = np.asarray(time, dtype=np.float64), np.asarray(values, dtype=np.float64)
    if t.ndim != 1 or t.size < 2 or v.shape != (t.size, 3):
        raise DataError("sensors.time-shape-values", quantity=name, shape=t.shape, shape_2=v.shape)
    if not (np.isfinite(t).all() and (np.diff(t) > 0.0).all()):
        raise DataError("sensors.times-do-not-advance", quantity="time")
    return t, v


def _is_mean(sampling: str) -> bool:
    check_sampling_kind(sampling)
    return sampling == "mean"


def _through_clock(
    errors: TriadErrors, t: Array, u: Array, steps: Array, mean: bool, seed: Seed
) -> Array:
    if errors.jitter == 0.0:
        return u
    late = t + jitter(errors, steps, seed)
    if not mean:
        return np.column_stack([np.interp(late, t, u[:, k]) for k in range(3)])
    ends = np.concatenate([[t[0] - steps[0]], t])
    total = np.vstack([np.zeros(3), np.cumsum(u * steps[:, None], axis=0)])
    # The edge before the first interval has no jitter; beyond the last, no data exist.
    places = np.concatenate([ends[:1], late])
    read = np.column_stack([np.interp(places, ends, total[:, k]) for k in range(3)])
    return np.asarray(np.diff(read, axis=0) / steps[:, None], dtype=np.float64)


def _through_filter(errors: TriadErrors, t: Array, u: Array, steps: Array, mean: bool) -> Array:
    if math.isinf(errors.bandwidth):
        return u
    if not mean:
        return low_pass(t, u, errors.bandwidth)
    # A mean is held over its interval, so the input is constant within each step.
    edges = np.concatenate([[t[0] - steps[0]], t])
    out = _held(edges, u, errors.bandwidth)
    return mean_of_filtered(out, u, steps, errors.bandwidth)


def _held(edges: Array, u: Array, bandwidth: float) -> Array:
    """Filter output at the end of each step, with the input held within the step."""
    from strapdown._kernels.signals import first_order

    h = np.diff(edges) / time_constant(bandwidth)
    out = np.empty_like(u)
    drive = -np.expm1(-h)[:, None] * u
    first_order(np.exp(-h), np.ascontiguousarray(drive), np.ascontiguousarray(u[0]), out)
    return out


def _g_effect(errors: TriadErrors, like: Array, specific_force: ArrayLike | None) -> Array:
    matrix = np.asarray(errors.g_sensitivity)
    if not matrix.any():
        return np.zeros_like(like)
    if specific_force is None:
        raise ConfigError("sensors.triad-feels-specific-force-none", quantity="g_sensitivity")
    f = _alike(specific_force, like, "specific_force")
    return np.asarray(f @ matrix.T, dtype=np.float64)


def _rectified(errors: TriadErrors, like: Array, vibration: ArrayLike | None) -> Array:
    if vibration is None:
        return np.zeros_like(like)
    shaken = _alike(vibration, like, "vibration")
    return np.asarray(shaken * errors.axis("vibration_rectification"), dtype=np.float64)


def _alike(values: ArrayLike, like: Array, name: str) -> Array:
    out = np.asarray(values, dtype=np.float64)
    if out.shape != like.shape:
        raise DataError("sensors.shape-values", quantity=name, shape=out.shape, shape_2=like.shape)
    return out


def _curve(errors: TriadErrors, axis: int) -> tuple[float, float, float, float]:
    return (
        errors.axis("scale")[axis],
        errors.axis("nonlinearity_2")[axis],
        errors.axis("nonlinearity_3")[axis],
        errors.axis("full_scale")[axis],
    )


def known_drift(errors: TriadErrors, t: Array, steps: Array, mean: bool) -> Array:
    """Bias, trend and warm-up; the mean of a trend over an interval is its midpoint value."""
    middle = t - 0.5 * steps if mean else t
    drift = np.asarray(errors.bias) + np.outer(middle, np.asarray(errors.trend))
    if any(errors.axis("warm_up")):
        left = np.exp(-t / errors.warm_up_time)
        if mean:
            # Mean of exp(-s/T) over the interval that ends at t.
            h = steps / errors.warm_up_time
            left *= np.divide(np.expm1(h), h, out=np.ones_like(h), where=h > 0.0)
        drift += np.outer(left, errors.axis("warm_up"))
    return np.asarray(drift, dtype=np.float64)


# Single-pole low-pass for samples with variable spacing.


def time_constant(bandwidth: float) -> float:
    """Time constant in s of a single pole with its -3 dB point at `bandwidth` Hz."""
    return 1.0 / (2.0 * math.pi * bandwidth)


def low_pass(time: Array, values: Array, bandwidth: float) -> Array:
    """Apply the low-pass, exactly for an input linear between samples.

    `time` ((n,), s). `values` ((n, 3)). `bandwidth` (Hz): -3 dB frequency; with infinity the output
    equals the input. Returns (n, 3): output at the stamps, settled at the first value before the
    first stamp. With ``h = dt/τ`` and ``a = exp(-h)``, a step goes from y0 to
    ``a y0 + ((1-a)/h - a) u0 + (1 - (1-a)/h) u1``, the solution of ``τ y' = u - y`` for u linear in
    between.
    """
    if math.isinf(bandwidth):
        return values
    from strapdown._kernels.signals import first_order

    h = np.diff(time) / time_constant(bandwidth)
    a = np.exp(-h)
    held = -np.expm1(-h) / h
    drive = (held - a)[:, None] * values[:-1] + (1.0 - held)[:, None] * values[1:]
    out = np.empty_like(values)
    out[0] = values[0]
    first_order(a, np.ascontiguousarray(drive), np.ascontiguousarray(values[0]), out[1:])
    return out


def mean_of_filtered(ends: Array, mean: Array, steps: Array, bandwidth: float) -> Array:
    """Mean of the filter output over each step, from the mean of its input.

    ``τ y' = u - y`` integrated over a step: ``mean(y) = mean(u) - τ (y1 - y0)/dt``.

    `ends` ((n, 3)): output at the end of each step; before the first step the filter is settled at
    its mean. `mean` ((n, 3)): mean of the input over each step. `steps` ((n,), s). `bandwidth`
    (Hz).
    """
    before = np.vstack([ends[:1], ends[:-1]])
    return np.asarray(
        mean - time_constant(bandwidth) * (ends - before) / steps[:, None], dtype=np.float64
    )


# Transfer curve of one sensor axis, scale factor and nonlinearity, and its inverse.

# Each step at least halves the bracket and at best squares the error; a double has 53 bits.
MOST_ITERATIONS = 60


def transfer(x: Array, scale: float, second: float, third: float, full: float) -> Array:
    """Output of an axis for a given input.

    `x` ((n,), u). `scale`, `second`, `third`: from `TriadErrors`:
    ``y/F = (1 + scale) x/F + second (x/F)² + third (x/F)³`` up to full scale, ``|x| <= F``, and
    linear along the tangent beyond, so that the inverse is unique. `full` (u): F. Returns (n,), u.
    """
    from strapdown._kernels.unit_rates import curve

    out = x.copy()
    curve(out, scale, second, third, full)
    return out


def input_of(y: Array, scale: float, second: float, third: float, full: float) -> Array:
    """Input of an axis for a given output: the inverse of `transfer`, to rounding.

    Newton's method within a bracket; the curve is monotone, so the solution stays inside.
    """
    gain = 1.0 + scale
    if second == 0.0 and third == 0.0:
        return y / gain
    r = y / full
    ends = {end: end * (gain + end * (second + end * third)) for end in (-1.0, 1.0)}
    low, high = np.full_like(r, -1.0), np.full_like(r, 1.0)
    target = np.clip(r, ends[-1.0], ends[1.0])
    x = np.clip(target / gain, -1.0, 1.0)
    for _ in range(MOST_ITERATIONS):
        excess = x * (gain + x * (second + x * third)) - target
        high, low = np.where(excess > 0.0, x, high), np.where(excess <= 0.0, x, low)
        step = x - excess / (gain + x * (2.0 * second + x * 3.0 * third))
        step = np.where((step >= low) & (step <= high), step, 0.5 * (low + high))
        settled = bool(np.all(np.abs(step - x) <= 2.0**-53 * np.abs(x)))
        x = step
        if settled:
            break
    for end, value in ends.items():
        slope = gain + end * (2.0 * second + end * 3.0 * third)
        beyond = r > value if end > 0.0 else r < value
        x = np.where(beyond, end + (r - value) / slope, x)
    return np.asarray(x * full, dtype=np.float64)


# Random errors of a triad; each kind and axis has its own stream.

Seed = int | np.random.SeedSequence

# Keys in the seed tree. A number is never reused for another kind, because that would change the
# draws of a seed. "Mean" kinds hold the part of an interval's mean that is independent of the value
# at its end.
NOISE, INSTABILITY, INSTABILITY_MEAN, WALK, WALK_MEAN, JITTER = range(6)

# Below this ratio of step to correlation time, the closed form of the integral's variance loses
# more than half its digits, and its series is used.
SERIES_LIMIT = 0.1


def child(seed: Seed, *place: int) -> np.random.SeedSequence:
    """Return the child seed at a path below another seed.

    `seed` (int or SeedSequence): a SeedSequence is not changed. `*place`: path, numbered as by
    successive calls of ``SeedSequence.spawn``.
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
    """White noise of a given density over intervals of given lengths.

    The mean of white noise of density N over an interval dt has the standard deviation ``N / √dt``.
    An instantaneous sample is assumed band-limited to half the sampling rate, which gives the same.
    """
    sd = np.asarray(density) / np.sqrt(steps)[:, None]
    return np.asarray(normal(seed, NOISE, steps.size) * sd, dtype=np.float64)


def random_walk(seed: Seed, steps: Array, density: Triad, mean: bool) -> Array:
    """Random walk at the end of each step, or its mean over each step.

    Instantaneous: zero at the first sample. Mean: zero at the start of the first step. With
    ``x1 - x0 = K √dt w1``, the mean over the step is ``x0 + K √dt (w1/2 + w2/√12)``.
    """
    more = normal(seed, WALK_MEAN, steps.size) if mean else None
    return walk_of(normal(seed, WALK, steps.size), more, steps, density)


def walk_of(first: Array, more: Array | None, steps: Array, density: ArrayLike) -> Array:
    """`random_walk` from its standard normal numbers, (n, c) each; `more`: for means only."""
    root = np.sqrt(steps)[:, None]
    moves = root * first
    if more is None:
        moves[0] = 0.0
        return np.asarray(np.cumsum(moves, axis=0) * np.asarray(density), dtype=np.float64)
    before = np.cumsum(moves, axis=0) - moves
    inside = 0.5 * moves + root * more / np.sqrt(12.0)
    return np.asarray((before + inside) * np.asarray(density), dtype=np.float64)


def gauss_markov(seed: Seed, steps: Array, sd: Triad, correlation: float, mean: bool) -> Array:
    """Stationary Gauss-Markov process at the end of each step, or its mean over each step.

    Exact for every step length: with ``h = dt/τ`` and ``a = exp(-h)``,
    ``x1 = a x0 + sd √(1 - a²) w1``. Given x0, the integral over the step, in units of sd τ, has the
    mean ``(1 - a) x0/sd``, the variance ``2h - 3 + 4a - a²`` and the covariance ``(1 - a)²`` with
    x1 (Gillespie 1996, Physical Review E 54, 2084).
    """
    further = normal(seed, INSTABILITY_MEAN, steps.size + 1) if mean else None
    return gauss_markov_of(normal(seed, INSTABILITY, steps.size), further, steps, sd, correlation)


def gauss_markov_of(
    w1: Array, further: Array | None, steps: Array, sd: ArrayLike, correlation: float
) -> Array:
    """`gauss_markov` from its standard normal numbers: (n, c), and for means alone (n + 1, c)."""
    from strapdown._kernels.signals import first_order

    h = steps / correlation
    a = np.exp(-h)
    spread = np.sqrt(-np.expm1(-2.0 * h))
    drive = spread[:, None] * w1
    first = np.zeros(w1.shape[1])
    if further is not None:
        # The process starts, stationary, at the start of the first step, with the first number of
        # the second stream.
        first = further[0].copy()
    else:
        # The first sample itself is drawn from the stationary distribution.
        a[0], drive[0] = 0.0, w1[0]
    x = np.empty_like(drive)
    first_order(a, drive, first, x)
    if further is None:
        return np.asarray(x * np.asarray(sd), dtype=np.float64)
    before = np.vstack([first, x[:-1]])
    given_start = -np.expm1(-h)
    # Part of the integral determined by the end value, and the independent remainder.
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

"""Errors of a triad put on true values, and what is known of them taken off again.

The order is that of a real chain, from the motion to the number that is read:

1. the sampler's clock: `jitter`;
2. the low-pass between motion and sampler: `bandwidth`;
3. the directions of the sensors: ``v = (I + misalignment) u``;
4. what the specific force does to a gyro: ``v + g_sensitivity f``;
5. the sensor's curve: `scale`, `nonlinearity_2`, `nonlinearity_3`;
6. the drifts: `bias`, `trend`, `warm_up`, `vibration_rectification`, `bias_instability`,
   `random_walk`;
7. `noise_density`;
8. the converter: `full_scale`, then `quantization`.

`compensate` undoes 3 to 5 and the bias, trend, warm-up and rectification of 6. The others are
random, or lose what they take.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from strapdown.errors import ConfigError, DataError
from strapdown.sensors.error_draws import (
    JITTER,
    Seed,
    gauss_markov,
    normal,
    random_walk,
    white_noise,
)
from strapdown.sensors.low_pass import low_pass, mean_of_filtered
from strapdown.sensors.transfer_curve import input_of, transfer
from strapdown.sensors.triad_errors import TriadErrors
from strapdown.tables import SAMPLINGS

Array = NDArray[np.float64]

# Beyond this part of the interval, instants would begin to overtake one another.
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
    """Put the errors of a triad on true values.

    Parameters
    ----------
    errors : TriadErrors
    time : array_like, (n,), s
        Increasing stamps, any spacing.
    true : array_like, (n, 3), u
        What an ideal triad in body axes reads.
    sampling : {'instantaneous', 'mean'}
        Whether a row holds the value at its stamp or the mean over the interval that ends there;
        the first interval is taken as long as the second.
    seed : int or SeedSequence
        Each kind of error and each axis has a stream of its own, so that switching one on or
        off leaves the draws of the others.
    specific_force : array_like, (n, 3), m/s², optional
        Needed where `g_sensitivity` is not zero.
    sampled : bool
        The values already have what comes before the sampler, jitter and low-pass: where a
        motion is known between the samples, `simulate_imu` evaluates it there. Otherwise the
        values are taken to run linearly (means: their integral) from one to the next.
    vibration : array_like, (n, 3), (m/s²)², optional
        Mean square of the vibration about each sample, which `vibration_rectification` turns
        into a shift; none, if not given.

    Returns
    -------
    ndarray, (n, 3), u

    Raises
    ------
    DataError
        Shapes disagree or time does not advance.
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
    y += _known_drift(errors, t, steps, mean) + _rectified(errors, y, vibration)
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
    """Take the known part of the errors off what was measured.

    Parameters
    ----------
    errors : TriadErrors
        The specification that `apply` was given, or a calibration.
    time : array_like, (n,), s
    measured : array_like, (n, 3), u
    sampling : {'instantaneous', 'mean'}
    specific_force : array_like, (n, 3), m/s², optional
        Needed where `g_sensitivity` is not zero; compensate the accelerometer first.
    vibration : array_like, (n, 3), (m/s²)², optional
        As of `apply`.

    Returns
    -------
    ndarray, (n, 3), u
        Free of bias, trend, warm-up, rectification, scale factor, nonlinearity, g-sensitivity and
        misalignment to rounding.

    Raises
    ------
    DataError, ConfigError
        As `apply`.
    """
    t, y = _rows(time, measured, "measured")
    mean = _is_mean(sampling)
    y = y - _known_drift(errors, t, intervals(t), mean) - _rectified(errors, y, vibration)
    v = np.column_stack([input_of(y[:, k], *_curve(errors, k)) for k in range(3)])
    v -= _g_effect(errors, v, specific_force)
    directions = np.eye(3) + np.asarray(errors.misalignment)
    return np.ascontiguousarray(np.linalg.solve(directions, v.T).T)


def intervals(time: Array) -> Array:
    """Length of the interval that each sample stands for; the first as the second."""
    steps = np.diff(time)
    return np.concatenate([steps[:1], steps])


def jitter(errors: TriadErrors, steps: Array, seed: Seed) -> Array:
    """How far each sampling instant lies after its stamp, (n,), s.

    Raises
    ------
    ConfigError
        The standard deviation is more than a tenth of an interval.
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
    if sampling not in SAMPLINGS:
        raise ConfigError(
            "sensors.no-kind-sampling", quantity="sampling", sampling=sampling, samplings=SAMPLINGS
        )
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
    # The edge before the first interval keeps its place; beyond the last, nothing is known.
    places = np.concatenate([ends[:1], late])
    read = np.column_stack([np.interp(places, ends, total[:, k]) for k in range(3)])
    return np.asarray(np.diff(read, axis=0) / steps[:, None], dtype=np.float64)


def _through_filter(errors: TriadErrors, t: Array, u: Array, steps: Array, mean: bool) -> Array:
    if math.isinf(errors.bandwidth):
        return u
    if not mean:
        return low_pass(t, u, errors.bandwidth)
    # A mean is held over its interval: the input is constant within each step.
    edges = np.concatenate([[t[0] - steps[0]], t])
    out = _held(edges, u, errors.bandwidth)
    return mean_of_filtered(out, u, steps, errors.bandwidth)


def _held(edges: Array, u: Array, bandwidth: float) -> Array:
    """The filter's output at the end of each step, the input held within it."""
    from strapdown._kernels.recursion import first_order
    from strapdown.sensors.low_pass import time_constant

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


def _known_drift(errors: TriadErrors, t: Array, steps: Array, mean: bool) -> Array:
    """Bias, trend and warm-up; the mean of a trend over an interval is its value in the middle."""
    middle = t - 0.5 * steps if mean else t
    drift = np.asarray(errors.bias) + np.outer(middle, np.asarray(errors.trend))
    if any(errors.axis("warm_up")):
        left = np.exp(-t / errors.warm_up_time)
        if mean:
            # The mean of exp(-s/T) over the interval that ends at t.
            h = steps / errors.warm_up_time
            left *= np.divide(np.expm1(h), h, out=np.ones_like(h), where=h > 0.0)
        drift += np.outer(left, errors.axis("warm_up"))
    return np.asarray(drift, dtype=np.float64)

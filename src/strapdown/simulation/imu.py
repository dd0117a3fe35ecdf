"""Simulated gyro and accelerometer samples of a known motion."""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.errors import ConfigError
from strapdown.sensors import error_chain
from strapdown.sensors.triad_errors import ImuErrors, TriadErrors
from strapdown.simulation.motion import Motion
from strapdown.tables import attitude_table, check_sampling_kind, imu_table
from strapdown.tables.checks import Array

# Samples that fit in a few gigabytes of memory with all derived arrays.
MOST_SAMPLES = 5_000_000
# Samples of one motion that are kept for other units, and how many of such arrays.
MOST_KEPT, KEPT = 500_000, 4
# Keys of the triads in the seed tree.
GYRO_SEED, ACCEL_SEED = 0, 1


def simulate_imu(
    motion: Motion,
    errors: ImuErrors,
    *,
    rate: float,
    sampling: str = "instantaneous",
    seed: int = 0,
    source: str | None = None,
    accelerometer: bool = True,
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Simulate the IMU samples of a motion.

    Parameters
    ----------
    errors : ImuErrors
        Applied in the order of `sensors.error_chain`. Jitter and low-pass act on the motion itself,
        which is evaluated at the jittered instants and between the samples.
    rate : float, Hz
        Samples fall on ``k / rate``, from zero to the last within the motion.
    sampling : {'instantaneous', 'mean'}
        The value at each stamp, or the mean over the interval that ends there. Mean rates are
        exact, from the motion's angle; mean specific forces use 8-node Gauss-Legendre quadrature,
        divided at the motion's `cuts` (for ringing). The first row of means holds the value at
        time zero.
    seed : int
        Seed of all random draws; the same seed gives the same samples on every machine.
    source : str, optional
        Name for messages.
    accelerometer : bool
        Whether to simulate an accelerometer.

    Returns
    -------
    imu : DataFrame
        Imu table, body axes: rad/s and, with an accelerometer, the specific force in m/s².
    truth : DataFrame
        Attitude table at the same stamps, exact.

    Raises
    ------
    ConfigError
        The rate is not positive or gives fewer than two samples, `sampling` is unknown, or the
        jitter is too large for the rate.
    """
    time = _stamps(motion, rate, sampling)
    wants_force = accelerometer or bool(np.any(np.asarray(errors.gyro.g_sensitivity)))
    plain = None
    if wants_force:
        plain = _sampled(motion, TriadErrors(), time, sampling, 0, 0.0, of_force=True)
    gyro = sample_gyro(
        motion,
        errors.gyro,
        time,
        sampling=sampling,
        seed=error_chain.child(seed, GYRO_SEED),
        specific_force=plain,
    )
    accel = plain if accelerometer else None
    if accel is not None and errors.accel is not None:
        accel = sample_accelerometer(
            motion,
            errors.accel,
            time,
            sampling=sampling,
            seed=error_chain.child(seed, ACCEL_SEED),
            specific_force=plain,
        )
    return (
        imu_table(time, gyro, accel, sampling=sampling, source=source),
        attitude_table(time, motion.attitude(time), source=source),
    )


def sample_gyro(
    motion: Motion,
    errors: TriadErrors,
    time: Array,
    *,
    sampling: str = "instantaneous",
    seed: error_chain.Seed = 0,
    straight: float = 0.0,
    specific_force: Array | None = None,
) -> Array:
    """Simulate a triad of gyros; (n, 3), rad/s.

    `time` ((n,), s): equally spaced, within the motion. `sampling` ({'instantaneous', 'mean'}).
    `seed`: seed of the triad. `straight` (rad/s): largest deviation from a straight line between
    two samples at which the low-pass treats the rate as linear (`low_passed`); zero
    disables this. `specific_force` ((n, 3), m/s²): specific force in body axes, if already
    computed.
    """
    plain = specific_force
    if plain is None and np.any(np.asarray(errors.g_sensitivity)):
        plain = _sampled(motion, TriadErrors(), time, sampling, 0, 0.0, of_force=True)
    return error_chain.apply(
        errors,
        time,
        _sampled(motion, errors, time, sampling, seed, straight, of_force=False),
        sampling=sampling,
        seed=seed,
        specific_force=plain,
        sampled=True,
    )


def sample_accelerometer(
    motion: Motion,
    errors: TriadErrors,
    time: Array,
    *,
    sampling: str = "instantaneous",
    seed: error_chain.Seed = 0,
    straight: float = 0.0,
    vibration: Array | None = None,
    specific_force: Array | None = None,
) -> Array:
    """Simulate a triad of accelerometers; (n, 3), m/s².

    `motion`, `errors`, `time`, `sampling`, `seed`: as of `sample_gyro`. `straight` (m/s²): as of
    `sample_gyro`. `vibration` ((n, 3), (m/s²)²): as of `sensors.error_chain.apply`.
    `specific_force` ((n, 3), m/s²): as of `sample_gyro`.
    """
    plain = specific_force
    if plain is None:
        plain = _sampled(motion, TriadErrors(), time, sampling, 0, 0.0, of_force=True)
    true = plain
    if errors.jitter > 0.0 or np.isfinite(errors.bandwidth):
        true = _sampled(motion, errors, time, sampling, seed, straight, of_force=True)
    return error_chain.apply(
        errors,
        time,
        true,
        sampling=sampling,
        seed=seed,
        specific_force=plain,
        sampled=True,
        vibration=vibration,
    )


def _stamps(motion: Motion, rate: float, sampling: str) -> Array:
    check_sampling_kind(sampling)
    if not (np.isfinite(rate) and rate * motion.duration >= 1.0):
        raise ConfigError(
            "simulation.hz-gives-fewer-than-two",
            quantity="rate",
            rate=rate,
            duration=motion.duration,
            duration_2=1.0 / motion.duration,
        )
    # Keep the last sample where rounding puts the product just below an integer.
    samples = np.floor(rate * motion.duration * (1.0 + 1e-12)) + 1.0
    if samples > MOST_SAMPLES:
        raise ConfigError(
            "simulation.hz-gives-samples",
            quantity="rate",
            rate=rate,
            samples=samples,
            duration=motion.duration,
            most_samples=MOST_SAMPLES / motion.duration,
        )
    return np.arange(int(samples)) / rate


def _sampled(
    motion: Motion,
    errors: TriadErrors,
    time: Array,
    sampling: str,
    seed: error_chain.Seed,
    straight: float,
    *,
    of_force: bool,
) -> Array:
    """Rate or specific force at the jittered instants, or its means, after the low-pass."""
    if errors.jitter == 0.0 and time.size <= MOST_KEPT:
        assert isinstance(motion, Hashable)
        return _exact(motion, errors.bandwidth, _Stamps(time), sampling, straight, of_force)
    return _measured(motion, errors, time, sampling, seed, straight, of_force=of_force)


class _Stamps:
    """Stamps that compare by value."""

    def __init__(self, time: Array) -> None:
        self.time = time

    def __hash__(self) -> int:
        return hash((self.time.size, float(self.time[0]), float(self.time[-1])))

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Stamps) and np.array_equal(self.time, other.time)


@lru_cache(maxsize=KEPT)
def _exact(
    motion: Any,
    bandwidth: float,
    stamps: _Stamps,
    sampling: str,
    straight: float,
    of_force: bool,
) -> Array:
    """Return what a triad without errors but for its low-pass reads, and keep it.

    Many units along one motion differ in their errors alone, and the motion costs the most.
    """
    ideal = TriadErrors(bandwidth=bandwidth)
    values = _measured(motion, ideal, stamps.time, sampling, 0, straight, of_force=of_force)
    values.setflags(write=False)
    return values


def _measured(
    motion: Motion,
    errors: TriadErrors,
    time: Array,
    sampling: str,
    seed: error_chain.Seed,
    straight: float,
    *,
    of_force: bool,
) -> Array:
    step, at = float(time[1] - time[0]), time
    if errors.jitter > 0.0:
        # The motion is known from zero to its end.
        at = time + error_chain.jitter(errors, np.full(time.size, time[1] - time[0]), seed)
        at = np.clip(at, 0.0, motion.duration)
    quantity: Quantity = motion.specific_force if of_force else motion.rate
    cuts: Sequence[float] = getattr(motion, "cuts", ()) if of_force else ()
    if sampling == "instantaneous":
        return low_passed_at(quantity, at, errors.bandwidth, cuts, straight)
    if of_force:
        mean = np.vstack([quantity(at[:1]), mean_between(quantity, at, cuts)])
        if errors.jitter > 0.0:
            # The sensor divides the accumulated increment by its nominal interval.
            mean[1:] *= np.diff(at)[:, None] / step
    else:
        mean = np.vstack([quantity(at[:1]), np.diff(motion.angle(at), axis=0) / step])
    if np.isinf(errors.bandwidth):
        return mean
    ends = low_passed_at(quantity, at, errors.bandwidth, cuts, straight)
    return error_chain.mean_of_filtered(ends, mean, np.full(at.size, step), errors.bandwidth)


# Low-pass and means of a continuous quantity, as a sampler sees it.

Quantity = Callable[[Array], Array]

# Gauss-Legendre nodes per stretch: n nodes are exact for polynomials up to degree 2n - 1.
MEAN_NODES = 8
FILTER_NODES = 6
# With a tolerance: 5e-7 of the amplitude for a rotation of 1 rad per time constant.
ROUGH_NODES = 3
# exp(-40) is below the rounding error of the sum.
MEMORY = 40.0  # time constants
# Stretches longer than a time constant where the memory fades, from the instant back: their ends
# in time constants, and nodes. The error for a rotation of ρ rad per time constant, on a stretch
# that begins at a and has the length L and n nodes, is L^(2n+1) n!⁴ / ((2n+1) (2n)!³)
# |1 + iρ|^(2n) e^-a: at ρ = 2 3e-12 as in the newest time constant, which has 6 nodes.
FADING = ((1.0, 6), (2.0, 6), (6.0, 10), (14.0, 14), (30.0, 18), (MEMORY, 8))
# Probe positions within a step, irregular so that a vibration is not zero at all three.
PROBES = (0.23, 0.57, 0.81)
# Instants evaluated per batch, to bound memory.
TOGETHER = 200_000


def mean_over(quantity: Quantity, starts: Array, ends: Array) -> Array:
    """Mean over each interval, by Gauss-Legendre quadrature with 8 nodes, (n, 3).

    Exact for polynomials up to order 15; for a sine with one period in the interval, to 1e-9.
    """
    nodes, weights = np.polynomial.legendre.leggauss(MEAN_NODES)
    parts = []
    for chunk in _chunks(starts.size, MEAN_NODES):
        a, b = starts[chunk, None], ends[chunk, None]
        at = 0.5 * (a + b) + 0.5 * (b - a) * nodes
        values = quantity(at.ravel()).reshape(*at.shape, 3)
        parts.append(0.5 * np.einsum("nmk,m->nk", values, weights))
    return np.concatenate(parts)


def mean_between(quantity: Quantity, instants: Array, cuts: Sequence[float]) -> Array:
    """Mean from each instant to the next, as `mean_over`, divided at cuts; (n - 1, 3).

    `instants` ((n,), s): increasing. `cuts` (s): instants where the quantity is not smooth, dense
    enough for it to be smooth between them. Returns (n - 1, 3).
    """
    edges, at = _cut(instants, cuts)
    means = mean_over(quantity, edges[:-1], edges[1:])
    if edges.size == instants.size:
        return means
    sums = np.add.reduceat(means * np.diff(edges)[:, None], at[:-1])
    return np.asarray(sums / np.diff(instants)[:, None])


def low_passed_at(
    quantity: Quantity,
    instants: Array,
    bandwidth: float,
    cuts: Sequence[float],
    straight: float = 0.0,
) -> Array:
    """Output of a low-pass, as `low_passed`, with stretches that end at cuts; (n, 3)."""
    if math.isinf(bandwidth):
        return quantity(instants)
    edges, at = _cut(instants, cuts)
    return np.asarray(low_passed(quantity, edges, bandwidth, straight)[at])


def low_passed(
    quantity: Quantity, instants: Array, bandwidth: float, straight: float = 0.0
) -> Array:
    """Output of a single-pole low-pass at increasing instants, (n, 3).

    `quantity`: maps (n,) instants to (n, 3) values. `instants` ((n,), s): until the first instant
    the filter is settled at the value there. `bandwidth` (Hz): -3 dB frequency. `straight`: a
    quantity within this of a straight line between two instants is treated as linear, and the
    quadrature elsewhere has 3 nodes; zero disables both. This saves evaluations where the quantity
    changes little. Returns (n, 3), ``y1 = exp(-dt/τ) y0 + ∫ exp(-(t1 - s)/τ) u(s) ds/τ`` from
    instant to instant, with the integral by Gauss-Legendre quadrature, with 6 nodes in stretches no
    longer than τ, and with longer ones where the memory has faded (`FADING`).
    Smooth motion is exact to rounding; a jump of u is spread over its stretch.
    """
    if math.isinf(bandwidth):
        return quantity(instants)
    from strapdown._kernels.signals import first_order

    tau = error_chain.time_constant(bandwidth)
    steps = np.diff(instants)
    out = np.empty((instants.size, 3))
    drive = np.empty((steps.size, 3))
    curved = np.arange(steps.size)
    if straight > 0.0:
        values = quantity(instants)
        out[:1] = values[:1]
        curved = _curved(quantity, instants, values, straight)
        h = (steps / tau)[:, None]
        a = np.exp(-h)
        held = -np.expm1(-h) / h
        # As `error_chain.low_pass` does between samples.
        drive[:] = (held - a) * values[:-1] + (1.0 - held) * values[1:]
    else:
        out[:1] = quantity(instants[:1])
    if curved.size:
        nodes = FILTER_NODES if straight == 0.0 else ROUGH_NODES
        drive[curved] = _weighted(quantity, instants[1:][curved], steps[curved], tau, nodes)
    first_order(np.exp(-steps / tau), drive, out[0].copy(), out[1:])
    return out


def _weighted(quantity: Quantity, ends: Array, steps: Array, tau: float, count: int) -> Array:
    """``∫ exp(-(t1 - s)/τ) u(s) ds/τ`` over the step that ends at each instant, (n, 3)."""
    window = np.minimum(steps, MEMORY * tau)
    place, weight = _nodes(float(window.max()) / tau, count)
    parts = []
    for chunk in _chunks(steps.size, place.size):
        back = window[chunk, None] * (1.0 - place)
        values = quantity((ends[chunk, None] - back).ravel()).reshape(*back.shape, 3)
        share = weight * np.exp(-back / tau) * window[chunk, None] / tau
        parts.append(np.einsum("nm,nmk->nk", share, values))
    return np.concatenate(parts)


def _nodes(window: float, count: int) -> tuple[Array, Array]:
    """Nodes within a window of so many time constants, from 0 to 1 at the instant, and weights."""
    if count == FILTER_NODES and window > FADING[2][0]:
        ends = [end for end, _ in FADING if end < window] + [window]
        counts = [count for _, count in FADING[: len(ends)]]
        edges = 1.0 - np.array([0.0, *ends])[::-1] / window
        counts.reverse()
    else:
        stretches = max(1, math.ceil(window))
        edges, counts = np.arange(stretches + 1) / stretches, [count] * stretches
    place, weight = [], []
    for k, number in enumerate(counts):
        nodes, weights = np.polynomial.legendre.leggauss(number)
        length = edges[k + 1] - edges[k]
        place.append(edges[k] + 0.5 * length * (1.0 + nodes))
        weight.append(0.5 * length * weights)
    return np.concatenate(place), np.concatenate(weight)


def _curved(
    quantity: Quantity, instants: Array, values: Array, straight: float
) -> NDArray[np.intp]:
    """Steps in which the quantity deviates from the straight line, and their neighbors."""
    steps = np.diff(instants)
    bent = np.zeros(steps.size, dtype=bool)
    at = (instants[:-1, None] + steps[:, None] * np.array(PROBES)).ravel()
    found = quantity(at).reshape(steps.size, len(PROBES), 3)
    for k, part in enumerate(PROBES):
        line = values[:-1] + part * (values[1:] - values[:-1])
        bent |= (np.abs(found[:, k] - line) > straight).any(axis=1)
    # Probes may miss a change that starts late in a step; it then shows in the next step.
    near = bent.copy()
    near[:-1] |= bent[1:]
    near[1:] |= bent[:-1]
    return np.flatnonzero(near)


def _cut(instants: Array, cuts: Sequence[float]) -> tuple[Array, NDArray[np.intp]]:
    """Instants merged with the cuts between them, and the indices of the instants."""
    inner = np.asarray(cuts, dtype=np.float64)
    inner = inner[(inner > instants[0]) & (inner < instants[-1])]
    edges = np.unique(np.concatenate([instants, inner])) if inner.size else instants
    return edges, np.asarray(np.searchsorted(edges, instants), dtype=np.intp)


def _chunks(count: int, each: int) -> list[slice]:
    rows = max(1, TOGETHER // each)
    return [slice(k, k + rows) for k in range(0, count, rows)]

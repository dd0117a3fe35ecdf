"""Samples of gyros and accelerometers that move in a known way."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.errors import ConfigError
from strapdown.sensors.error_chain import apply, jitter
from strapdown.sensors.error_draws import Seed, child
from strapdown.sensors.low_pass import mean_of_filtered
from strapdown.sensors.triad_errors import ImuErrors, TriadErrors
from strapdown.simulation.between_samples import (
    Quantity,
    low_passed_at,
    mean_between,
)
from strapdown.simulation.motion import Motion
from strapdown.tables import SAMPLINGS, attitude_table, imu_table

Array = NDArray[np.float64]

# What a few gigabytes of memory hold with everything that is made of them.
MOST_SAMPLES = 5_000_000
# Places of the triads in the tree of seeds.
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
    """Sample a motion.

    Parameters
    ----------
    motion : Motion
    errors : ImuErrors
        Put on in the order of `sensors.error_chain`. Jitter and low-pass act on the motion
        itself, which is evaluated at the jittered instants and between the samples.
    rate : float, Hz
        Samples fall on ``k / rate``, from zero to the last that is within the motion.
    sampling : {'instantaneous', 'mean'}
        The value at each stamp, or the mean over the interval that ends there: of rates exact,
        from the motion's angle; of specific force by Gauss-Legendre quadrature with 8 nodes, cut
        where the motion asks for it (`cuts`), as one that rings does.
        Before time zero there is no motion: the first row of means holds the value at zero.
    seed : int
        Of everything that is random; the same seed gives the same samples on every machine.
    source : str, optional
        Name for messages.
    accelerometer : bool
        Whether there is one.

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
        plain = _force(motion, TriadErrors(), time, 1.0 / rate, sampling, 0, 0.0)
    gyro = sample_gyro(
        motion,
        errors.gyro,
        time,
        sampling=sampling,
        seed=child(seed, GYRO_SEED),
        specific_force=plain,
    )
    accel = plain if accelerometer else None
    if accel is not None and errors.accel is not None:
        accel = sample_accelerometer(
            motion,
            errors.accel,
            time,
            sampling=sampling,
            seed=child(seed, ACCEL_SEED),
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
    seed: Seed = 0,
    straight: float = 0.0,
    specific_force: Array | None = None,
) -> Array:
    """Read a triad of gyros.

    Parameters
    ----------
    motion : Motion
    errors : TriadErrors
    time : ndarray, (n,), s
        Equally spaced, within the motion.
    sampling : {'instantaneous', 'mean'}
    seed : int or SeedSequence
        Of the triad.
    straight : float, rad/s
        How far the rate may be from a straight line between two samples for the low-pass to
        take it as one (`between_samples.low_passed`); zero is never.
    specific_force : ndarray, (n, 3), m/s², optional
        What an ideal accelerometer reads, where it is at hand.

    Returns
    -------
    ndarray, (n, 3), rad/s
    """
    step = float(time[1] - time[0])
    plain = specific_force
    if plain is None and np.any(np.asarray(errors.g_sensitivity)):
        plain = _force(motion, TriadErrors(), time, step, sampling, 0, 0.0)
    return apply(
        errors,
        time,
        _rate(motion, errors, time, step, sampling, seed, straight),
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
    seed: Seed = 0,
    straight: float = 0.0,
    vibration: Array | None = None,
    specific_force: Array | None = None,
) -> Array:
    """Read a triad of accelerometers.

    Parameters
    ----------
    motion, errors, time, sampling, seed
        As of `sample_gyro`.
    straight : float, m/s²
        As of `sample_gyro`.
    vibration : ndarray, (n, 3), (m/s²)², optional
        As of `sensors.error_chain.apply`.
    specific_force : ndarray, (n, 3), m/s², optional
        As of `sample_gyro`.

    Returns
    -------
    ndarray, (n, 3), m/s²
    """
    step = float(time[1] - time[0])
    plain = specific_force
    if plain is None:
        plain = _force(motion, TriadErrors(), time, step, sampling, 0, 0.0)
    true = plain
    if errors.jitter > 0.0 or np.isfinite(errors.bandwidth):
        true = _force(motion, errors, time, step, sampling, seed, straight)
    return apply(
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
    if sampling not in SAMPLINGS:
        raise ConfigError(
            "simulation.no-kind-sampling",
            quantity="sampling",
            sampling=sampling,
            samplings=SAMPLINGS,
        )
    if not (np.isfinite(rate) and rate * motion.duration >= 1.0):
        raise ConfigError(
            "simulation.hz-gives-fewer-than-two",
            quantity="rate",
            rate=rate,
            duration=motion.duration,
            duration_2=1.0 / motion.duration,
        )
    # The last sample still belongs where rounding puts the product just under a whole number.
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


def _instants(motion: Motion, errors: TriadErrors, time: Array, seed: Seed) -> Array:
    """When the sampler really looks; the motion is known from zero to its end."""
    if errors.jitter == 0.0:
        return time
    steps = np.full(time.size, time[1] - time[0])
    return np.clip(time + jitter(errors, steps, seed), 0.0, motion.duration)


def _rate(
    motion: Motion,
    errors: TriadErrors,
    time: Array,
    step: float,
    sampling: str,
    seed: Seed,
    straight: float,
) -> Array:
    at = _instants(motion, errors, time, seed)
    if sampling == "instantaneous":
        return low_passed_at(motion.rate, at, errors.bandwidth, (), straight)
    angle = motion.angle(at)
    mean = np.vstack([motion.rate(at[:1]), np.diff(angle, axis=0) / step])
    return _filtered_mean(motion.rate, at, mean, step, errors.bandwidth, (), straight)


def _force(
    motion: Motion,
    errors: TriadErrors,
    time: Array,
    step: float,
    sampling: str,
    seed: Seed,
    straight: float,
) -> Array:
    at, force = _instants(motion, errors, time, seed), motion.specific_force
    cuts: Sequence[float] = getattr(motion, "cuts", ())
    if sampling == "instantaneous":
        return low_passed_at(force, at, errors.bandwidth, cuts, straight)
    mean = np.vstack([force(at[:1]), mean_between(force, at, cuts)])
    if errors.jitter > 0.0:
        # The sensor divides what it has gathered by the interval that it knows of.
        mean[1:] *= np.diff(at)[:, None] / step
    return _filtered_mean(force, at, mean, step, errors.bandwidth, cuts, straight)


def _filtered_mean(
    quantity: Quantity,
    at: Array,
    mean: Array,
    step: float,
    bandwidth: float,
    cuts: Sequence[float],
    straight: float,
) -> Array:
    if np.isinf(bandwidth):
        return mean
    ends = low_passed_at(quantity, at, bandwidth, cuts, straight)
    return mean_of_filtered(ends, mean, np.full(at.size, step), bandwidth)

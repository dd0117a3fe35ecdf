"""Gyro samples of a known motion, with the errors that Alexiev's generator gives them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

from strapdown.exceptions import ConfigError
from strapdown.simulation.motion import Array, PulseMotion
from strapdown.tables import SAMPLINGS, attitude_table, imu_table

# What a few gigabytes of memory hold with everything that is made of them.
MOST_SAMPLES = 5_000_000

Triad = tuple[float, float, float]


@dataclass(frozen=True)
class GyroErrors:
    """Errors of a gyro triad, the same meaning at every rate.

    Attributes
    ----------
    noise_density : float, rad/s/√Hz
        White noise: a sample at rate f has the standard deviation `noise_density` √f, and the
        integral walks by `noise_density` √t.
    bias : tuple of float, rad/s
    trend : tuple of float, rad/s²
        Growth of the bias with time, one per axis.
    """

    noise_density: float = 0.0
    bias: Triad = (0.0, 0.0, 0.0)
    trend: Triad = (0.0, 0.0, 0.0)


def simulate_gyro(
    motion: PulseMotion,
    errors: GyroErrors,
    *,
    rate: float,
    sampling: str = "instantaneous",
    seed: int = 0,
    source: str | None = None,
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Sample a motion.

    Parameters
    ----------
    motion : PulseMotion
    errors : GyroErrors
    rate : float, Hz
        Samples fall on ``k / rate``, from zero to the last that is within the motion.
    sampling : {'instantaneous', 'mean'}
        The rate at each stamp, or the exact mean over the interval that ends there.
    seed : int
        Of the noise; the same seed gives the same samples on every machine.
    source : str, optional
        Name for messages.

    Returns
    -------
    imu : DataFrame
        Imu table, rad/s, body axes.
    truth : DataFrame
        Attitude table at the same stamps, exact.

    Raises
    ------
    ConfigError
        The rate is not positive or gives fewer than two samples, or `sampling` is unknown.
    """
    if sampling not in SAMPLINGS:
        raise ConfigError(
            f"'{sampling}' is no kind of sampling",
            quantity="sampling",
            remedy=f"use {' or '.join(SAMPLINGS)}",
        )
    if not (np.isfinite(rate) and rate * motion.duration >= 1.0):
        raise ConfigError(
            f"{rate:g} Hz gives fewer than two samples in {motion.duration:g} s",
            quantity="rate",
            remedy=f"use at least {1.0 / motion.duration:.3g} Hz",
        )
    # The last sample still belongs where rounding puts the product just under a whole number.
    count = int(np.floor(rate * motion.duration * (1.0 + 1e-12))) + 1
    if count > MOST_SAMPLES:
        raise ConfigError(
            f"{rate:g} Hz gives {count} samples in {motion.duration:g} s",
            quantity="rate",
            remedy=f"use at most {MOST_SAMPLES / motion.duration:.3g} Hz",
        )
    time = np.arange(count) / rate
    gyro = (
        motion.rate(time) if sampling == "instantaneous" else _mean_rate(motion, time, 1.0 / rate)
    )
    gyro = gyro + np.asarray(errors.bias) + np.outer(time, errors.trend)
    if sampling == "mean":
        gyro -= np.asarray(errors.trend) * 0.5 / rate
    if errors.noise_density > 0.0:
        noise = np.random.Generator(np.random.PCG64(seed)).standard_normal(gyro.shape)
        gyro += errors.noise_density * np.sqrt(rate) * noise
    return (
        imu_table(time, gyro, sampling=sampling, source=source),
        attitude_table(time, motion.attitude(time), source=source),
    )


def _mean_rate(motion: PulseMotion, time: Array, step: float) -> Array:
    before = motion.angle(np.concatenate([[time[0] - step], time[:-1]]))
    return (motion.angle(time) - before) / step

"""How well the means of rate and specific force of a body at rest are known."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from strapdown.sensors.imu_uncertainty import BiasDrift, ImuUncertainty
from strapdown.sensors.triad_errors import Triad

Array = NDArray[np.float64]

__all__ = ["force_covariance", "gravity_change", "mean_of_drift", "rate_covariance"]


def rate_covariance(sensors: ImuUncertainty, length: float, rate: Array, force: Array) -> Array:
    """Covariance of a mean rate.

    Parameters
    ----------
    sensors : ImuUncertainty
    length : float, s
        Time over which it is a mean.
    rate, force : ndarray, (3,), rad/s and m/s²
        The means.

    Returns
    -------
    ndarray, (3, 3), (rad/s)²
    """
    gyro = sensors.gyro
    variance = gyro.variance_by_input(rate)
    variance += np.array(gyro.axis("g_sensitivity")) ** 2 * float(force @ force)
    variance += _own(gyro.axis("bias"), gyro.axis("noise_density"), sensors.gyro_drift, length)
    return np.diag(variance)


def force_covariance(sensors: ImuUncertainty, length: float, force: Array) -> Array:
    """Covariance of a mean specific force; (3, 3), (m/s²)², as `rate_covariance`."""
    accel = sensors.accel
    variance = accel.variance_by_input(force)
    variance += _own(accel.axis("bias"), accel.axis("noise_density"), sensors.accel_drift, length)
    return np.diag(variance)


def gravity_change(force: Array, covariance: Array, gravity: Array) -> tuple[float, float]:
    """Size of a mean specific force against gravity, relative, and its standard deviation.

    Parameters
    ----------
    force : ndarray, (3,), m/s²
    covariance : ndarray, (3, 3), (m/s²)²
        In the same axes.
    gravity : ndarray, (3,), m/s²
        In any.

    Returns
    -------
    change, sd : float
    """
    size, g = (float(np.sqrt(x @ x)) for x in (force, gravity))
    return size / g - 1.0, float(np.sqrt(force @ covariance @ force)) / (size * g)


def mean_of_drift(drift: BiasDrift, length: float) -> Array:
    """Variance of the mean of a Gauss-Markov process over a time, (3,), its unit squared.

    With x the time over the correlation time: ``2 sd² (x - 1 + exp(-x))/x²``.
    """
    x = length / drift.correlation_time
    part = 1.0 if x < 1e-4 else 2.0 * (x + math.expm1(-x)) / (x * x)
    return np.asarray(np.square(drift.triad) * part)


def _own(bias: Triad, density: Triad, drift: BiasDrift, length: float) -> Array:
    noise = np.square(density) / length
    return np.asarray(np.square(bias) + noise + mean_of_drift(drift, length))

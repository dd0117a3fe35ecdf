"""What the sensors of a body at rest may be off by, as states of a filter."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from strapdown.estimation.sensor_blocks import accel_bias, gyro_bias, random_walk
from strapdown.estimation.sensor_states import SensorStates
from strapdown.sensors.imu_uncertainty import BiasDrift, ImuUncertainty
from strapdown.sensors.triad_uncertainty import TriadUncertainty

__all__ = ["resting_sd", "resting_states"]

Array = NDArray[np.float64]


def resting_sd(sensors: ImuUncertainty, rate: ArrayLike, force: ArrayLike) -> tuple[Array, Array]:
    """Return what gyros and accelerometers may read too much while rate and force stay the same.

    Scale factors, misalignments and g-sensitivities are then a part of the bias: no rest can tell
    them from it.

    Parameters
    ----------
    sensors : ImuUncertainty
    rate : array_like, (3,), rad/s
        Mean rate in body axes.
    force : array_like, (3,), m/s²
        Mean specific force in body axes.

    Returns
    -------
    gyro, accel : ndarray, (3,), rad/s and m/s²
        Standard deviations.
    """
    w, f = np.asarray(rate, dtype=np.float64), np.asarray(force, dtype=np.float64)
    sensitivity = np.asarray(sensors.gyro.axis("g_sensitivity")) * math.sqrt(float(f @ f))
    gyro = _resting(sensors.gyro, sensors.gyro_drift, w)
    accel = _resting(sensors.accel, sensors.accel_drift, f)
    return np.sqrt(gyro + sensitivity**2), np.sqrt(accel)


def resting_states(
    sensors: ImuUncertainty, rate: ArrayLike, force: ArrayLike
) -> tuple[SensorStates, SensorStates]:
    """Return the biases of a body that stays as it stands, as states.

    Parameters
    ----------
    sensors, rate, force
        As `resting_sd`.

    Returns
    -------
    gyro_bias, accel_bias : SensorStates
        Random walks: over a time that is short beside its correlation time a Gauss-Markov process
        of deviation s is one, with the drive ``s sqrt(2 / correlation time)``.
    """
    gyro, accel = resting_sd(sensors, rate, force)
    return (
        random_walk(gyro_bias(tuple(gyro)), _walk(sensors.gyro_drift)),
        random_walk(accel_bias(tuple(accel)), _walk(sensors.accel_drift)),
    )


def _resting(triad: TriadUncertainty, drift: BiasDrift, value: Array) -> Array:
    """Variance of each axis."""
    constant = np.square(triad.axis("bias")) + np.square(drift.triad)
    return np.asarray(constant + triad.variance_by_input(value))


def _walk(drift: BiasDrift) -> tuple[float, float, float]:
    part = 0.0 if math.isinf(drift.correlation_time) else math.sqrt(2.0 / drift.correlation_time)
    x, y, z = drift.triad
    return (part * x, part * y, part * z)

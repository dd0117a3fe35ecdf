"""What the errors of the sensors do to an answer that is linear in them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from strapdown.alignment.inertial_sums import InertialSums
from strapdown.sensors.imu_uncertainty import BiasDrift, ImuUncertainty

Array = NDArray[np.float64]

__all__ = ["sensor_covariance", "sensor_noise"]


def sensor_noise(sums: InertialSums, turn: Array, push: Array, sensors: ImuUncertainty) -> Array:
    """Covariance that white noise alone makes; arguments and result as `sensor_covariance`."""
    gyro = _noise(turn, sums, sensors.gyro.axis("noise_density"))
    return gyro + _noise(push, sums, sensors.accel.axis("noise_density"))


def sensor_covariance(
    sums: InertialSums, turn: Array, push: Array, sensors: ImuUncertainty
) -> Array:
    """Covariance of an answer of k numbers from everything that stays or drifts in the sensors.

    Parameters
    ----------
    sums : InertialSums
    turn, push : ndarray, (m, k, 3)
        What an error of the angle, and one of the velocity gained, within a node do to it; the
        error in the body's axes at the first instant.
    sensors : ImuUncertainty
        Biases, their drift, scale, misalignment and g-sensitivity; nonlinearity and the
        rectification of vibration are not in it.

    Returns
    -------
    ndarray, (k, k)
    """
    gyro, accel = sensors.gyro, sensors.accel
    total = _biases(turn, sums, gyro.axis("bias"), sensors.gyro_drift)
    total += _biases(push, sums, accel.axis("bias"), sensors.accel_drift)
    for response, inputs, scale, across in (
        (turn, sums.turns, gyro.axis("scale"), gyro.axis("misalignment")),
        (push, sums.pushes, accel.axis("scale"), accel.axis("misalignment")),
        (turn, sums.pushes, gyro.axis("g_sensitivity"), gyro.axis("g_sensitivity")),
    ):
        sd = np.where(np.eye(3, dtype=np.bool_), np.diag(scale), np.array(across)[:, None])
        if sd.any():
            effect = np.einsum("mkh,mhij->kij", response, inputs) * sd
            flat = effect.reshape(len(effect), 9)
            total += flat @ flat.T
    return np.asarray(total)


def _noise(response: Array, sums: InertialSums, density: tuple[float, float, float]) -> Array:
    """White noise: independent from node to node."""
    turns = sums.times / sums.node_length[:, None, None]
    effect = (response @ turns) * np.array(density)
    return np.asarray(np.einsum("mki,mli,m->kl", effect, effect, sums.node_length))


def _biases(
    response: Array, sums: InertialSums, sd: tuple[float, float, float], drift: BiasDrift
) -> Array:
    by_node = response @ sums.times
    whole = by_node.sum(axis=0) * np.array(sd)
    total = whole @ whole.T
    if any(drift.triad):
        t = sums.middles
        like = np.exp(-np.abs(t[:, None] - t[None, :]) / drift.correlation_time)
        changing = by_node * np.array(drift.triad)
        total += np.einsum("mki,mn,nli->kl", changing, like, changing, optimize=True)
    return np.asarray(total)

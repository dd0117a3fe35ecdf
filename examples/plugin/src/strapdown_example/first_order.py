"""An attitude algorithm: the quaternion's differential equation by Euler's method."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from strapdown._kernels.increments import HEAD, take_sample
from strapdown.attitude.algorithm import Accuracy, Array, AttitudeAlgorithm, unit_quaternions


@njit
def first_order_step(q, tx, ty, tz):
    """``q <- normalize(q + q (0, theta) / 2)``, of (4,) and rad."""
    w = q[0] - 0.5 * (q[1] * tx + q[2] * ty + q[3] * tz)
    x = q[1] + 0.5 * (q[0] * tx + q[2] * tz - q[3] * ty)
    y = q[2] + 0.5 * (q[0] * ty + q[3] * tx - q[1] * tz)
    z = q[3] + 0.5 * (q[0] * tz + q[1] * ty - q[2] * tx)
    norm = (w * w + x * x + y * y + z * z) ** 0.5
    q[0], q[1], q[2], q[3] = w / norm, x / norm, y / norm, z / norm


@njit
def first_order_advance(state, dt, theta, dtheta, history, a, b):
    """Advance over increments, writing the attitude after each into `history`."""
    for k in range(theta.shape[0]):
        first_order_step(state, theta[k, 0], theta[k, 1], theta[k, 2])
        history[k] = state


@njit
def first_order_update(record, time, rate):
    """Advance by one sample; both loops call one step, so that they give the same bits."""
    dt, tx, ty, tz, _, _, _ = take_sample(record, time, rate)
    if dt > 0.0:
        first_order_step(record[HEAD:], tx, ty, tz)
    return dt


@dataclass(frozen=True)
class FirstOrder(AttitudeAlgorithm):
    """Quaternion integrated by Euler's method, and normalized after each step."""

    name = "first_order"
    title = "First-order quaternion"
    equations = ""
    source = "Euler's method"
    summary = "the quaternion's differential equation by Euler's method"
    width = 4
    advance_kernel = staticmethod(first_order_advance)
    update_kernel = staticmethod(first_order_update)

    def begin(self, q_nb: Array) -> Array:
        """Return the quaternion itself."""
        return np.array(q_nb, dtype=np.float64)

    def quaternions(self, history: Array) -> Array:
        """Return the rows with norm 1."""
        return unit_quaternions(history)

    @property
    def accuracy(self) -> Accuracy:
        """Second order: what the normalization leaves of the angle is its third power."""
        return Accuracy(increments=2, rates=2, coning=2)

    def kernel_options(self) -> tuple[float, float]:
        """There are no options."""
        return 0.0, 0.0

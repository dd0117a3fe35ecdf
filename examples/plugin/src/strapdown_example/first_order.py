"""An attitude algorithm: the quaternion's differential equation by Euler's method."""

from __future__ import annotations

import math
from dataclasses import dataclass

from strapdown._kernels.compilation import njit
from strapdown._kernels.increments import HEAD, OPTIONS, take_sample
from strapdown.attitude_algorithms.algorithm import Accuracy, AttitudeAlgorithm


@njit()
def first_order_step(state, dt, tx, ty, tz, dx, dy, dz, a, b):
    """``q <- normalize(q + q (0, theta) / 2)``, of (4,) and rad; every step has these arguments."""
    w = state[0] - 0.5 * (state[1] * tx + state[2] * ty + state[3] * tz)
    x = state[1] + 0.5 * (state[0] * tx + state[2] * tz - state[3] * ty)
    y = state[2] + 0.5 * (state[0] * ty + state[3] * tx - state[1] * tz)
    z = state[3] + 0.5 * (state[0] * tz + state[1] * ty - state[2] * tx)
    norm = math.sqrt(w * w + x * x + y * y + z * z)
    state[0] = w / norm
    state[1] = x / norm
    state[2] = y / norm
    state[3] = z / norm


@njit()
def first_order_advance(state, dt, theta, dtheta, history, a, b):
    """Advance over increments, writing the attitude after each into `history`."""
    for k in range(theta.shape[0]):
        tx, ty, tz = theta[k, 0], theta[k, 1], theta[k, 2]
        dx, dy, dz = dtheta[k, 0], dtheta[k, 1], dtheta[k, 2]
        first_order_step(state, dt[k], tx, ty, tz, dx, dy, dz, a, b)
        for i in range(4):
            history[k, i] = state[i]


@njit()
def first_order_update(record, time, rate):
    """Advance by one sample; both loops call one step, so that they give the same bits."""
    dt, tx, ty, tz, dx, dy, dz = take_sample(record, time, rate)
    if dt > 0.0:
        a, b = record[OPTIONS], record[OPTIONS + 1]
        first_order_step(record[HEAD:], dt, tx, ty, tz, dx, dy, dz, a, b)
    return dt


@dataclass(frozen=True)
class FirstOrder(AttitudeAlgorithm):
    """Quaternion integrated by Euler's method, and normalized after each step."""

    name = "first_order"
    title = "First-order quaternion"
    equations = ""
    source = "Euler's method"
    summary = "the quaternion's differential equation by Euler's method"
    advance_kernel = staticmethod(first_order_advance)
    update_kernel = staticmethod(first_order_update)

    @property
    def accuracy(self) -> Accuracy:
        """Second order: what the normalization leaves of the angle is its third power."""
        return Accuracy(increments=2, rates=2, coning=2)

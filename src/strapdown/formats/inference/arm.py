"""Whether the force is that of a swinging arm: a function of the turn, with or without gravity.

A point at r of a body that turns feels a x r + w x (w x r), with a = dw/dt: linear in a and in the
products of w, and nothing where both vanish. Gravity is what is left there. Free coefficients
hold for every unit and for every set of axes of gyro and accelerometer.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
PIECE = 0.1  # s, short beside the period of an arm
LEAST_PIECES = 30  # of them, twice the unknowns of a fit
LARGEST = 40_000
# Slower than this, an arm of 0.7 m cannot add half of gravity to a turn of a radian.
LEAST_FREQUENCY = 2.5  # rad/s
# A constant is explained by squares to two thirds for one sine, to 6/7 for three that are not in
# step; an arm without gravity leaves the noise alone.
ARM_ALONE = 0.95
# Of the variation, that of gravity in step with the turn included.
ARM_IN_STEP = 0.97


@dataclass(frozen=True)
class Arm:
    """How much of the mean square of a force an arm explains.

    Attributes
    ----------
    alone : float
        Of the whole force, with nothing left where the turn vanishes (gravity-free).
    in_step : float
        Of its variation.
    frequency : float, rad/s
        Root mean square of the angular acceleration over that of the rate.
    """

    alone: float
    in_step: float
    frequency: float

    @property
    def hides_gravity(self) -> bool:
        """Whether the force needs no gravity at all."""
        return self.locks_turn and self.alone > ARM_ALONE

    @property
    def locks_turn(self) -> bool:
        """Whether an arm's acceleration cannot be told from gravity that turns."""
        return self.frequency > LEAST_FREQUENCY and self.in_step > ARM_IN_STEP


def fit_arm(step: float, gyro: Array, accel: Array) -> Arm | None:
    """Fit a lever arm to an accelerometer.

    Parameters
    ----------
    step : float, s
    gyro, accel : ndarray, (n, 3)
        Finite, in any units and axes.

    Returns
    -------
    Arm or None
        None where the log is too short or nothing turns.
    """
    gyro, accel = gyro[:LARGEST], accel[:LARGEST]
    size = max(round(PIECE / step), 1)
    count = len(gyro) // size
    # The mean is the bias, as far as a swing returns.
    rate = gyro - gyro.mean(axis=0) if len(gyro) else gyro
    largest = float(np.abs(rate).max(initial=0.0))
    if count < LEAST_PIECES or not largest > 0:
        return None
    rate = rate / largest
    products = np.column_stack([rate[:, i] * rate[:, j] for i in range(3) for j in range(i, 3)])
    w, p, f = (
        v[: count * size].reshape(count, size, -1).mean(axis=1) for v in (rate, products, accel)
    )
    a = (w[2:] - w[:-2]) / (2.0 * size * step)
    w, p, f = w[1:-1], p[1:-1], f[1:-1]
    moved = float(np.sum(w**2))
    if not moved > 0:
        return None
    # What is left of a bias multiplies the rate: w itself is among the regressors.
    alone = _explained(np.hstack([a, p, w]), f)
    turn = np.hstack([a, p])
    in_step = _explained(turn - turn.mean(axis=0), f - f.mean(axis=0))
    return Arm(alone, in_step, float(np.sqrt(np.sum(a**2) / moved)))


def _explained(x: Array, y: Array) -> float:
    norms = np.linalg.norm(x, axis=0)
    x = x / np.where(norms > 0, norms, 1.0)
    left = y - x @ np.linalg.lstsq(x, y, rcond=1e-6)[0]
    return 1.0 - float(np.sum(left**2)) / max(float(np.sum(y**2)), 1e-300)

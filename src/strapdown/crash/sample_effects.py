"""What the unknowns of a unit do to every sample at a point of the vehicle."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from strapdown.constants import STANDARD_GRAVITY as GRAVITY

Array = NDArray[np.float64]

#: Lines of the error budget that others look for.
GYRO_BIAS = "gyro bias"
LEVER_ARM = "lever arm"
MOUNTING = "mounting"
NO_TURNING = "assumed: no turning"
MISSING_AXIS = "assumed: missing axis"


@dataclass(frozen=True, eq=False)
class SampleEffects:
    """What one standard deviation of each of p unknowns adds to n samples, in vehicle axes.

    Attributes
    ----------
    names : tuple of str
        Of each unknown. Unknowns of one name are one unknown, in whatever unit they appear.
    contributors : tuple of str
        The line of the error budget that each belongs to.
    force : ndarray, (p, n, 3), m/s²
        Added to the specific force at the point.
    rate : ndarray, (p, n, 3), rad/s
        Added to the rate of the vehicle.
    rest_force : ndarray, (p, 3), m/s²
        Added to the mean of the specific force at rest.
    tilt : ndarray, (p, 3), rad
        Rotation vector by which it turns the attitude that the vehicle was levelled at, in local
        level with forward as north.
    force_noise : ndarray, (n, 3), m/s²
        Standard deviation of what is independent from sample to sample.
    rate_noise : ndarray, (n, 3), rad/s
    """

    names: tuple[str, ...]
    contributors: tuple[str, ...]
    force: Array
    rate: Array
    rest_force: Array
    tilt: Array
    force_noise: Array
    rate_noise: Array

    @property
    def roll_bias_sd(self) -> float:
        """Standard deviation of the bias about the forward axis, rad/s."""
        of_bias = [k for k, name in enumerate(self.contributors) if name == GYRO_BIAS]
        return float(np.sqrt((self.rate[of_bias, 0, 0] ** 2).sum()))


def level_turned_by(rest: Array, level: Array) -> Array:
    """Turn of the level by what was added to the force at rest that it was found from.

    Parameters
    ----------
    rest : ndarray, (..., 3), m/s²
        Vehicle axes.
    level : ndarray, (3, 3)
        From vehicle axes into local level, heading zero.

    Returns
    -------
    ndarray, (..., 3), rad
        Rotation vector in local level.
    """
    felt = rest @ level.T / GRAVITY
    return np.stack([-felt[..., 1], felt[..., 0], np.zeros(felt.shape[:-1])], axis=-1)

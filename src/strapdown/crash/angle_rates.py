"""How a small turn in local level changes roll, pitch and heading."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


def angle_rates(roll_pitch_heading: ArrayLike) -> Array:
    """Matrices from a small rotation vector in local level to changes of the angles.

    Parameters
    ----------
    roll_pitch_heading : array_like, (n, 3), deg

    Returns
    -------
    ndarray, (n, 3, 3), rad per rad
        Of roll, pitch, heading for a turn about north, east, down with
        ``C' = (I + [phi x]) C``. Not near a pitch of 90 deg, where it is infinite.
    """
    angles = np.radians(np.asarray(roll_pitch_heading, dtype=np.float64))
    pitch, heading = angles[:, 1], angles[:, 2]
    c, s = np.cos(heading), np.sin(heading)
    out = np.zeros((len(angles), 3, 3))
    out[:, 0, 0], out[:, 0, 1] = c / np.cos(pitch), s / np.cos(pitch)
    out[:, 1, 0], out[:, 1, 1] = -s, c
    out[:, 2, 0], out[:, 2, 1] = c * np.tan(pitch), s * np.tan(pitch)
    out[:, 2, 2] = 1.0
    return out


def angles_sd(roll_pitch_heading: ArrayLike, covariance: Array) -> Array:
    """Standard deviations of the angles, to first order.

    Parameters
    ----------
    roll_pitch_heading : array_like, (n, 3), deg
    covariance : ndarray, (n, 3, 3), rad²
        Of the rotation vector in local level, as `angle_rates` takes it.

    Returns
    -------
    ndarray, (n, 3), deg
    """
    rates = angle_rates(roll_pitch_heading)
    turned = np.einsum("nij,njk,nlk->nil", rates, covariance, rates)
    return np.asarray(np.degrees(np.sqrt(np.diagonal(turned, axis1=1, axis2=2))))

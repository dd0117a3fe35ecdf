"""Attitude of a vehicle whose nose points along its velocity."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def along_velocity(velocity: Array, acceleration: Array) -> tuple[Array, Array]:
    """3-2-1 angles of a body without roll, nose along the velocity, and their rates.

    Parameters
    ----------
    velocity : ndarray, (n, 3), m/s
        North, east, down; its horizontal part is not zero.
    acceleration : ndarray, (n, 3), m/s²
        Derivatives of its components.

    Returns
    -------
    angles, rates : ndarray, (n, 3), deg and deg/s
        Roll, pitch (up where it climbs), heading within ±180.
    """
    north, east, down = velocity.T
    d_north, d_east, d_down = acceleration.T
    level2 = north * north + east * east
    level = np.sqrt(level2)
    d_level = (north * d_north + east * d_east) / level
    still = np.zeros(len(velocity))
    angles = [still, np.arctan2(-down, level), np.arctan2(east, north)]
    rates = [
        still,
        (down * d_level - d_down * level) / (level2 + down * down),
        (north * d_east - east * d_north) / level2,
    ]
    return np.degrees(angles).T, np.degrees(rates).T

"""Roll and pitch from the specific force at rest."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from strapdown.errors import DataError

__all__ = ["level"]


def level(accel_mean: ArrayLike) -> tuple[float, float]:
    """Roll and pitch of a body at rest, from its mean specific force.

    Parameters
    ----------
    accel_mean : array_like, (3,), m/s²
        Mean specific force in body axes, forward-right-down; at rest it points up, so that a
        level body reads (0, 0, -g).

    Returns
    -------
    roll, pitch : float, deg
        Roll in (-180, 180], pitch in [-90, 90]. A tilt error of 0.1° for each 17 mm/s² of
        accelerometer bias.

    Notes
    -----
    From ``f_b = C_bn (0, 0, -g)``, whose components are ``g sin(pitch)``,
    ``-g cos(pitch) sin(roll)`` and ``-g cos(pitch) cos(roll)``.

    Raises
    ------
    DataError
        The length is not within 20 % of 9.81 m/s²: another unit, no gravity in it, or not at
        rest.
    """
    f = np.asarray(accel_mean, dtype=np.float64)
    size = float(np.sqrt(f @ f))
    if not 0.8 * 9.81 <= size <= 1.2 * 9.81:
        raise DataError("alignment.levelling-force-not-gravity", quantity="accel", size=size)
    roll = float(np.degrees(np.arctan2(0.0 - f[1], -f[2])))
    pitch = float(np.degrees(np.arctan2(f[0], np.hypot(f[1], f[2]))))
    return roll, pitch

"""Angles in degrees: between two attitudes, and brought within half a turn."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from strapdown._kernels import rotation as kernel
from strapdown.rotation.checked_rows import common_shape, unit_quaternions

__all__ = ["rotation_angle", "unit_rotation_angle", "within_half_turn"]

Array = NDArray[np.float64]


def rotation_angle(q_1: ArrayLike, q_2: ArrayLike) -> Array:
    """Angle of the rotation between two attitudes: the length of ``log(C_1^T C_2)``.

    Parameters
    ----------
    q_1, q_2 : array_like, (..., 4)
        Leading shapes are broadcast.

    Returns
    -------
    ndarray, (...), deg
        Between 0 and 180; right to about 1e-15 rad, however small.

    Raises
    ------
    DataError
        Wrong shape, a value that is not finite, or a norm that is not 1.
    """
    (a, lead_a), (b, lead_b) = unit_quaternions(q_1, "q_1"), unit_quaternions(q_2, "q_2")
    leading = common_shape(lead_a, lead_b)
    if lead_a != lead_b:
        a = np.broadcast_to(a.reshape((*lead_a, 4)), (*leading, 4)).reshape(-1, 4)
        b = np.broadcast_to(b.reshape((*lead_b, 4)), (*leading, 4)).reshape(-1, 4)
    return unit_rotation_angle(a, b).reshape(leading)


def unit_rotation_angle(q_1: Array, q_2: Array) -> Array:
    """Angle between the attitudes of two arrays of unit quaternions, which is not checked.

    Parameters
    ----------
    q_1, q_2 : ndarray, (n, 4)
        Of norm 1, as this package's own functions return them.

    Returns
    -------
    ndarray, (n,), deg
    """
    out = np.empty(len(q_1))
    kernel.quats_angle(np.ascontiguousarray(q_1), np.ascontiguousarray(q_2), out)
    return np.asarray(np.degrees(out))


def within_half_turn(angles_deg: Array) -> Array:
    """Bring angles within half a turn.

    Parameters
    ----------
    angles_deg : ndarray, (...), deg

    Returns
    -------
    ndarray, (...), deg
        From -180 to 180; what is within already keeps every digit.
    """
    wrapped = np.remainder(angles_deg + 180.0, 360.0) - 180.0
    return np.where(np.abs(angles_deg) <= 180.0, angles_deg, wrapped)

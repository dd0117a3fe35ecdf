"""Exponential and logarithm: rotation vectors to quaternions and matrices, and back."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from strapdown._kernels import rotation as kernel
from strapdown.rotation.checked_rows import apply, rows_of, unit_quaternions
from strapdown.rotation.matrices import quaternion_from_dcm

__all__ = [
    "dcm_from_rotation_vector",
    "quaternion_from_rotation_vector",
    "rotation_vector_from_dcm",
    "rotation_vector_from_quaternion",
]

Array = NDArray[np.float64]


def quaternion_from_rotation_vector(rotation_vector: ArrayLike) -> Array:
    """Exponential map: the quaternion of a rotation vector.

    Parameters
    ----------
    rotation_vector : array_like, (..., 3), rad
        Any length up to 1e150; turns beyond pi come back as the same attitude.

    Returns
    -------
    ndarray, (..., 4)
        Unit quaternions, correct to rounding at every length, zero included.

    Raises
    ------
    DataError
        The shape is wrong or a value is not finite.

    Notes
    -----
    Alexiev (2021), Eqs. (14)-(17), and the series (21)-(22) near zero, where those divide
    zero by zero.
    """
    rows, leading = rows_of(rotation_vector, (3,), "rotation vector")
    return apply(kernel.quats_from_rotvecs, rows, leading, 4)


def rotation_vector_from_quaternion(q: ArrayLike) -> Array:
    """Logarithm: the rotation vector of a quaternion, of length at most pi.

    Parameters
    ----------
    q : array_like, (..., 4)
        Quaternions of norm 1 within 1 %; they are normalized first.

    Returns
    -------
    ndarray, (..., 3), rad
        At exactly half a turn both directions are valid and one is returned.

    Raises
    ------
    DataError
        Wrong shape, a value that is not finite, or a norm that is not 1.
    """
    rows, leading = unit_quaternions(q, "quaternion")
    return apply(kernel.rotvecs_from_quats, rows, leading, 3)


def dcm_from_rotation_vector(rotation_vector: ArrayLike) -> Array:
    """Exponential map: the direction cosine matrix of a rotation vector.

    Parameters
    ----------
    rotation_vector : array_like, (..., 3), rad

    Returns
    -------
    ndarray, (..., 3, 3)

    Raises
    ------
    DataError
        The shape is wrong or a value is not finite.

    Notes
    -----
    Alexiev (2021), Eq. (12), by functions of the half angle, so that nothing cancels and
    zero needs no special case.
    """
    rows, leading = rows_of(rotation_vector, (3,), "rotation vector")
    return apply(kernel.dcms_from_rotvecs, rows, leading, 3, 3)


def rotation_vector_from_dcm(dcm: ArrayLike) -> Array:
    """Logarithm of a direction cosine matrix, of length at most pi.

    Parameters
    ----------
    dcm : array_like, (..., 3, 3)

    Returns
    -------
    ndarray, (..., 3), rad

    Raises
    ------
    DataError
        Wrong shape, a value that is not finite, or not a rotation (1 % of orthogonality).
    """
    return rotation_vector_from_quaternion(quaternion_from_dcm(dcm))

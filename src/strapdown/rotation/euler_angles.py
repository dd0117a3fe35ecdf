"""Roll, pitch and heading from and to the other forms, and their standard deviations."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from strapdown._kernels import rotation as kernel
from strapdown.rotation.checked_rows import apply, common_shape, rows_of, unit_quaternions
from strapdown.rotation.matrices import dcm_from_quaternion, quaternion_from_dcm
from strapdown.rotation.rotation_vectors import (
    quaternion_from_rotation_vector,
    rotation_vector_from_quaternion,
)

__all__ = [
    "dcm_from_euler",
    "euler_from_dcm",
    "euler_from_quaternion",
    "euler_from_rotation_vector",
    "euler_sd",
    "quaternion_from_euler",
    "rotation_angle",
    "rotation_vector_from_euler",
    "unit_rotation_angle",
    "within_half_turn",
]


Array = NDArray[np.float64]


def quaternion_from_euler(roll_pitch_heading: ArrayLike) -> Array:
    """Quaternion of 3-2-1 Euler angles.

    Parameters
    ----------
    roll_pitch_heading : array_like, (..., 3), deg
        Any finite angles.

    Returns
    -------
    ndarray, (..., 4)
        ``q_nb``, body to local level.

    Raises
    ------
    DataError
        The shape is wrong or a value is not finite.
    """
    rows, leading = rows_of(roll_pitch_heading, (3,), "roll, pitch, heading")
    return apply(kernel.quats_from_eulers, np.radians(rows), leading, 4)


def euler_from_quaternion(q: ArrayLike) -> Array:
    """Return the 3-2-1 Euler angles of a quaternion.

    Parameters
    ----------
    q : array_like, (..., 4)
        ``q_nb``, norm 1 within 1 %.

    Returns
    -------
    ndarray, (..., 3), deg
        Roll (-180, 180], pitch [-90, 90], heading [0, 360). At a pitch of exactly +-90 deg
        only heading -+ roll is defined: roll is then zero.

    Raises
    ------
    DataError
        Wrong shape, a value that is not finite, or a norm that is not 1.
    """
    rows, leading = unit_quaternions(q, "quaternion")
    return apply(kernel.eulers_degrees_from_quats, rows, leading, 3)


def dcm_from_euler(roll_pitch_heading: ArrayLike) -> Array:
    """Direction cosine matrix ``C_nb`` of 3-2-1 Euler angles.

    Parameters
    ----------
    roll_pitch_heading : array_like, (..., 3), deg

    Returns
    -------
    ndarray, (..., 3, 3)

    Raises
    ------
    DataError
        The shape is wrong or a value is not finite.

    Notes
    -----
    Alexiev (2021), Eq. (3) as corrected in the text above: ``Cz^T Cy^T Cx^T``.
    """
    return dcm_from_quaternion(quaternion_from_euler(roll_pitch_heading))


def euler_from_dcm(dcm: ArrayLike) -> Array:
    """Return the 3-2-1 Euler angles of ``C_nb``; ranges as in `euler_from_quaternion`.

    Parameters
    ----------
    dcm : array_like, (..., 3, 3)

    Returns
    -------
    ndarray, (..., 3), deg

    Raises
    ------
    DataError
        Wrong shape, a value that is not finite, or not a rotation.
    """
    return euler_from_quaternion(quaternion_from_dcm(dcm))


def rotation_vector_from_euler(roll_pitch_heading: ArrayLike) -> Array:
    """Rotation vector of 3-2-1 Euler angles, of length at most pi.

    Parameters
    ----------
    roll_pitch_heading : array_like, (..., 3), deg

    Returns
    -------
    ndarray, (..., 3), rad

    Raises
    ------
    DataError
        The shape is wrong or a value is not finite.
    """
    return rotation_vector_from_quaternion(quaternion_from_euler(roll_pitch_heading))


def euler_from_rotation_vector(rotation_vector: ArrayLike) -> Array:
    """Return the 3-2-1 Euler angles of a rotation vector; ranges as in `euler_from_quaternion`.

    Parameters
    ----------
    rotation_vector : array_like, (..., 3), rad

    Returns
    -------
    ndarray, (..., 3), deg

    Raises
    ------
    DataError
        The shape is wrong or a value is not finite.
    """
    return euler_from_quaternion(quaternion_from_rotation_vector(rotation_vector))


def euler_sd(euler_deg: ArrayLike, covariance: ArrayLike) -> Array:
    """Return the standard deviations of 3-2-1 angles, to first order.

    Near a pitch of ±90° those of roll and heading grow without bound.

    Parameters
    ----------
    euler_deg : array_like, (..., 3), deg
        Roll, pitch, heading.
    covariance : array_like, (..., 3, 3), rad²
        Of the rotation vector ``phi`` in north-east-down with
        ``C_estimated = exp([phi x]) C_true``.

    Returns
    -------
    ndarray, (..., 3), deg
    """
    _, pitch, heading = np.moveaxis(np.radians(euler_deg), -1, 0)
    # phi = rotation of the three axes of the angles: heading about down, pitch about the horizontal
    # right, roll about forward.
    s, c, cp, zero = np.sin(heading), np.cos(heading), np.cos(pitch), np.zeros_like(pitch)
    axes = np.stack(
        [
            np.stack([cp * c, -s, zero], axis=-1),
            np.stack([cp * s, c, zero], axis=-1),
            np.stack([-np.sin(pitch), zero, zero + 1.0], axis=-1),
        ],
        axis=-2,
    )
    angles = np.linalg.inv(axes)
    spread = angles @ np.asarray(covariance) @ np.swapaxes(angles, -1, -2)
    return np.asarray(np.degrees(np.sqrt(np.diagonal(spread, axis1=-2, axis2=-1))))


# Angles in degrees: between two attitudes, and brought within half a turn.


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
    """Angle between the attitudes of two arrays of unit quaternions, unchecked.

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
    """Wrap angles to within half a turn.

    Parameters
    ----------
    angles_deg : ndarray, (...), deg

    Returns
    -------
    ndarray, (...), deg
        From -180 to 180; values already within keep every digit.
    """
    wrapped = np.remainder(angles_deg + 180.0, 360.0) - 180.0
    return np.where(np.abs(angles_deg) <= 180.0, angles_deg, wrapped)

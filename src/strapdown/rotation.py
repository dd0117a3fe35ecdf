"""Rotations as arrays: quaternion, direction cosine matrix, Euler angles, rotation vector.

Conventions, here and everywhere in strapdown:

* Quaternions are Hamilton's, scalar first, ``(..., 4)``; ``q_ab`` turns a vector from frame
  ``b`` into frame ``a``: ``v_a = rotate(q_ab, v_b)``; ``q`` and ``-q`` are the same rotation.
* Matrices are ``(..., 3, 3)``: ``v_a = C_ab @ v_b``; neighbouring letters cancel.
* Euler angles are ``(..., 3)``: roll, pitch, heading in degrees, 3-2-1:
  ``C_nb = Rz(heading) Ry(pitch) Rx(roll)``; heading in [0, 360), clockwise from north seen
  from above (north-east-down axes), roll in (-180, 180], pitch in [-90, 90].
* A rotation vector is ``(..., 3)`` in rad: the turn by its length about its direction.

Alexiev (2021) prints the elementary matrices (4)-(6) as rotations of the *frame*; with them
Eq. (3) must read ``C_nb = Cz^T Cy^T Cx^T``, which is the product above, and only this reading
agrees with his kinematics (8)-(10).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from strapdown._kernels import rotation as kernel
from strapdown._kernels.increments import LARGEST as LARGEST_RATE
from strapdown.exceptions import DataError

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

Array = NDArray[np.float64]

__all__ = [
    "compose",
    "conjugate",
    "cross_matrix",
    "dcm_from_euler",
    "dcm_from_quaternion",
    "dcm_from_rotation_vector",
    "euler_from_dcm",
    "euler_from_quaternion",
    "euler_from_rotation_vector",
    "from_scipy",
    "normalise",
    "quaternion_from_dcm",
    "quaternion_from_euler",
    "quaternion_from_rotation_vector",
    "rotate",
    "rotation_angle",
    "rotation_vector_from_dcm",
    "rotation_vector_from_euler",
    "rotation_vector_from_quaternion",
    "to_scipy",
    "within_half_turn",
]

# How far a norm or C^T C may lie from one before an input is refused as no rotation. Hand
# written quaternions carry three or four digits; a mistaken order of components does not pass.
_TOLERANCE = 1e-2

#: From east-north-up to north-east-down: half a turn about the diagonal of north and east.
Q_NED_ENU = (0.0, math.sqrt(0.5), math.sqrt(0.5), 0.0)

#: Components beyond this are refused, because their squares leave the range of a double.
LARGEST = LARGEST_RATE


def _rows(values: ArrayLike, shape: tuple[int, ...], name: str) -> tuple[Array, tuple[int, ...]]:
    """Return `values` as C-contiguous rows and the leading shape."""
    array = np.asarray(values, dtype=np.float64)
    if array.shape[array.ndim - len(shape) :] != shape or array.ndim < len(shape):
        raise DataError(
            f"shape {array.shape} does not end in {shape}",
            quantity=name,
            remedy=f"pass an array of shape (..., {', '.join(map(str, shape))})",
        )
    leading = array.shape[: array.ndim - len(shape)]
    rows = np.ascontiguousarray(array.reshape(-1, int(np.prod(shape))))
    # A square that overflows is no more use than infinity.
    bad = np.flatnonzero(~(np.abs(rows) < LARGEST).all(axis=1))
    if bad.size:
        raise DataError(
            f"not a finite number below {LARGEST:g}: {rows[bad[0]].tolist()}",
            row=int(bad[0]) + 1,
            quantity=name,
            remedy="leave that row out",
        )
    return rows, leading


def _unit(q: ArrayLike, name: str) -> tuple[Array, tuple[int, ...]]:
    rows, leading = _rows(q, (4,), name)
    norm = np.sqrt((rows * rows).sum(axis=1))
    bad = np.flatnonzero(np.abs(norm - 1.0) > _TOLERANCE)
    if bad.size:
        raise DataError(
            f"a rotation needs a quaternion of norm 1, and this one has {norm[bad[0]]:.6g}",
            row=int(bad[0]) + 1,
            quantity=name,
            remedy="normalise it, and check the order: scalar first (w, x, y, z)",
        )
    return rows / norm[:, None], leading


def _proper(dcm: ArrayLike) -> tuple[Array, tuple[int, ...]]:
    rows, leading = _rows(dcm, (3, 3), "direction cosine matrix")
    matrices = rows.reshape(-1, 3, 3)
    loss = np.abs(np.swapaxes(matrices, 1, 2) @ matrices - np.eye(3)).max(axis=(1, 2), initial=0.0)
    bad = np.flatnonzero(~(loss <= _TOLERANCE) | ~(np.linalg.det(matrices) > 0))
    if bad.size:
        raise DataError(
            "not a rotation: C^T C differs from the identity by "
            f"{loss[bad[0]]:.3g}, determinant {np.linalg.det(matrices[bad[0]]):.3g}",
            row=int(bad[0]) + 1,
            quantity="direction cosine matrix",
            remedy="pass right-handed orthogonal matrices with C_nb @ v_b = v_n",
        )
    return rows, leading


def _common(a: tuple[int, ...], b: tuple[int, ...]) -> tuple[int, ...]:
    try:
        return np.broadcast_shapes(a, b)
    except ValueError:
        raise DataError(
            f"leading shapes {a} and {b} do not go together",
            remedy="pass as many of the one as of the other, or one of either",
        ) from None


def _apply(
    loop: Callable[[Array, Array], Any], rows: Array, leading: tuple[int, ...], *shape: int
) -> Array:
    out = np.empty((rows.shape[0], int(np.prod(shape))))
    loop(rows, out)
    return out.reshape(leading + shape)


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
    rows, leading = _rows(rotation_vector, (3,), "rotation vector")
    return _apply(kernel.quats_from_rotvecs, rows, leading, 4)


def rotation_vector_from_quaternion(q: ArrayLike) -> Array:
    """Logarithm: the rotation vector of a quaternion, of length at most pi.

    Parameters
    ----------
    q : array_like, (..., 4)
        Quaternions of norm 1 within 1 %; they are normalised first.

    Returns
    -------
    ndarray, (..., 3), rad
        At exactly half a turn both directions are right and one is returned.

    Raises
    ------
    DataError
        Wrong shape, a value that is not finite, or a norm that is not 1.
    """
    rows, leading = _unit(q, "quaternion")
    return _apply(kernel.rotvecs_from_quats, rows, leading, 3)


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
    rows, leading = _rows(rotation_vector, (3,), "rotation vector")
    return _apply(kernel.dcms_from_rotvecs, rows, leading, 3, 3)


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
        Wrong shape, a value that is not finite, or no rotation (1 % of orthogonality).
    """
    return rotation_vector_from_quaternion(quaternion_from_dcm(dcm))


def dcm_from_quaternion(q: ArrayLike) -> Array:
    """Direction cosine matrix of a quaternion.

    Parameters
    ----------
    q : array_like, (..., 4)
        Quaternions of norm 1 within 1 %; they are normalised first.

    Returns
    -------
    ndarray, (..., 3, 3)

    Raises
    ------
    DataError
        Wrong shape, a value that is not finite, or a norm that is not 1.
    """
    rows, leading = _unit(q, "quaternion")
    return _apply(kernel.dcms_from_quats, rows, leading, 3, 3)


def quaternion_from_dcm(dcm: ArrayLike) -> Array:
    """Quaternion of a direction cosine matrix.

    Parameters
    ----------
    dcm : array_like, (..., 3, 3)
        Rotations; up to 1 % from orthogonal is accepted.

    Returns
    -------
    ndarray, (..., 4)
        Unit quaternions; the sign is free.

    Raises
    ------
    DataError
        Wrong shape, a value that is not finite, or no rotation.

    Notes
    -----
    From the largest of the four components (Shepperd 1978, doi:10.2514/3.55767b), so that no
    attitude loses accuracy.
    """
    rows, leading = _proper(dcm)
    return _apply(kernel.quats_from_dcms, rows, leading, 4)


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
    rows, leading = _rows(roll_pitch_heading, (3,), "roll, pitch, heading")
    return _apply(kernel.quats_from_eulers, np.radians(rows), leading, 4)


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
    rows, leading = _unit(q, "quaternion")
    return _apply(kernel.eulers_degrees_from_quats, rows, leading, 3)


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
        Wrong shape, a value that is not finite, or no rotation.
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


def compose(q_ab: ArrayLike, q_bc: ArrayLike) -> Array:
    """Compose rotations: ``q_ac = q_ab q_bc``.

    Parameters
    ----------
    q_ab, q_bc : array_like, (..., 4)
        Leading shapes are broadcast.

    Returns
    -------
    ndarray, (..., 4)

    Raises
    ------
    DataError
        Wrong shape, a value that is not finite, or a norm that is not 1.
    """
    a, lead_a = _unit(q_ab, "q_ab")
    b, lead_b = _unit(q_bc, "q_bc")
    leading = _common(lead_a, lead_b)
    left, right = (
        np.ascontiguousarray(np.broadcast_to(q.reshape((*lead, 4)), (*leading, 4)).reshape(-1, 4))
        for q, lead in ((a, lead_a), (b, lead_b))
    )
    out = np.empty_like(left)
    kernel.quats_multiply(left, right, out)
    return out.reshape((*leading, 4))


def conjugate(q_ab: ArrayLike) -> Array:
    """Reverse a rotation: ``q_ba`` from ``q_ab``.

    Parameters
    ----------
    q_ab : array_like, (..., 4)

    Returns
    -------
    ndarray, (..., 4)

    Raises
    ------
    DataError
        Wrong shape, a value that is not finite, or a norm that is not 1.
    """
    rows, leading = _unit(q_ab, "quaternion")
    q_ba: Array = rows * np.array([1.0, -1.0, -1.0, -1.0])
    return q_ba.reshape((*leading, 4))


def normalise(q_ab: ArrayLike) -> Array:
    """Scale quaternions to norm 1.

    Parameters
    ----------
    q_ab : array_like, (..., 4)
        Norm 1 within 1 %.

    Returns
    -------
    ndarray, (..., 4)

    Raises
    ------
    DataError
        Wrong shape, a value that is not finite, or a norm that is not 1.
    """
    rows, leading = _unit(q_ab, "quaternion")
    return rows.reshape((*leading, 4))


def rotate(q_ab: ArrayLike, v_b: ArrayLike) -> Array:
    """Turn vectors from frame ``b`` into frame ``a``.

    Parameters
    ----------
    q_ab : array_like, (..., 4)
    v_b : array_like, (..., 3), any unit
        Leading shapes are broadcast.

    Returns
    -------
    ndarray, (..., 3), the unit of `v_b`

    Raises
    ------
    DataError
        Wrong shape, a value that is not finite, or a norm that is not 1.
    """
    q, lead_q = _unit(q_ab, "quaternion")
    v, lead_v = _rows(v_b, (3,), "vector")
    leading = _common(lead_q, lead_v)
    quats = np.broadcast_to(q.reshape((*lead_q, 4)), (*leading, 4)).reshape(-1, 4)
    vectors = np.broadcast_to(v.reshape((*lead_v, 3)), (*leading, 3)).reshape(-1, 3)
    out = np.empty((len(vectors), 3))
    kernel.quats_rotate(np.ascontiguousarray(quats), np.ascontiguousarray(vectors), out)
    return out.reshape((*leading, 3))


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
    (a, lead_a), (b, lead_b) = _unit(q_1, "q_1"), _unit(q_2, "q_2")
    leading = _common(lead_a, lead_b)
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


def to_scipy(q: ArrayLike) -> Rotation:
    """Turn quaternions into a `scipy.spatial.transform.Rotation` (scalar last inside).

    Parameters
    ----------
    q : array_like, (..., 4)

    Returns
    -------
    scipy.spatial.transform.Rotation
        A stack of rotations, or a single one.

    Raises
    ------
    DataError
        Wrong shape, a value that is not finite, or a norm that is not 1.
    """
    from scipy.spatial.transform import Rotation

    rows, leading = _unit(q, "quaternion")
    return Rotation.from_quat(rows.reshape((*leading, 4))[..., [1, 2, 3, 0]])


def from_scipy(rotation: Rotation) -> Array:
    """Turn a `scipy.spatial.transform.Rotation` into quaternions, scalar first.

    Parameters
    ----------
    rotation : scipy.spatial.transform.Rotation

    Returns
    -------
    ndarray, (..., 4)
    """
    q: Array = np.ascontiguousarray(rotation.as_quat()[..., [3, 0, 1, 2]], dtype=np.float64)
    return q


def cross_matrix(vectors: Array) -> Array:
    """Matrices of the cross product with vectors, ``[v x] u = v x u``.

    Parameters
    ----------
    vectors : ndarray, (..., 3)

    Returns
    -------
    ndarray, (..., 3, 3)
    """
    out = np.zeros((*vectors.shape, 3))
    x, y, z = vectors[..., 0], vectors[..., 1], vectors[..., 2]
    out[..., 0, 1], out[..., 0, 2], out[..., 1, 2] = -z, y, -x
    return np.asarray(out - np.swapaxes(out, -1, -2))


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
    # phi = turning of the three axes by which the angles turn: heading about down, pitch about
    # the horizontal right, roll about forward.
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

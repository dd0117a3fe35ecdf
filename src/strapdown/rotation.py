"""Rotations as arrays: quaternion, direction cosine matrix, Euler angles, rotation vector.

Conventions, here and everywhere in strapdown:

* Quaternions are Hamilton's, scalar first, ``(..., 4)``; ``q_ab`` rotates a vector from frame
  ``b`` into frame ``a``: ``v_a = rotate(q_ab, v_b)``; ``q`` and ``-q`` are the same rotation.
* Matrices are ``(..., 3, 3)``: ``v_a = C_ab @ v_b``; neighboring letters cancel.
* Euler angles are ``(..., 3)``: roll, pitch, heading in degrees, 3-2-1:
  ``C_nb = Rz(heading) Ry(pitch) Rx(roll)``; heading in [0, 360), clockwise from north seen
  from above (north-east-down axes), roll in (-180, 180], pitch in [-90, 90].
* A rotation vector is ``(..., 3)`` in rad: rotation by its length about its direction.

Arguments are array-likes of any leading shape. A wrong shape, a value that is not finite, a norm
that is not 1 within 1 %, or a matrix that is not a rotation within 1 % raises DataError.

Alexiev (2021) prints the elementary matrices (4)-(6) as rotations of the *frame*; with them
Eq. (3) must read ``C_nb = Cz^T Cy^T Cx^T``, which is the product above, and only this reading
agrees with his kinematics (8)-(10).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from strapdown._kernels import rotation as kernel
from strapdown._kernels.increments import LARGEST
from strapdown.constants import Array
from strapdown.errors import DataError

__all__ = [
    "Q_NED_ENU",
    "compose",
    "conjugate",
    "cross_matrix",
    "dcm_from_euler",
    "dcm_from_quaternion",
    "dcm_from_rotation_vector",
    "euler_from_dcm",
    "euler_from_quaternion",
    "euler_from_rotation_vector",
    "euler_sd",
    "level",
    "normalise",
    "quaternion_from_dcm",
    "quaternion_from_euler",
    "quaternion_from_rotation_vector",
    "rotate",
    "rotation_angle",
    "rotation_vector_from_dcm",
    "rotation_vector_from_euler",
    "rotation_vector_from_quaternion",
    "unit_rotation_angle",
    "within_half_turn",
]

#: From east-north-up to north-east-down: half a turn about the diagonal of north and east.
Q_NED_ENU = (0.0, math.sqrt(0.5), math.sqrt(0.5), 0.0)

# Tolerance of a norm or of C^T C before an input is refused as not a rotation. Handwritten
# quaternions carry three or four digits; a mistaken order of components does not pass.
_TOLERANCE = 1e-2


def compose(q_ab: ArrayLike, q_bc: ArrayLike) -> Array:
    """Compose rotations: ``q_ac = q_ab q_bc``.

    Parameters
    ----------
    q_ab, q_bc : array_like, (..., 4)
        Leading shapes are broadcast.

    Returns
    -------
    ndarray, (..., 4)
    """
    a, b, leading = _broadcast(_unit_quaternions(q_ab, "q_ab"), _unit_quaternions(q_bc, "q_bc"))
    out = np.empty_like(a)
    kernel.quats_multiply(a, b, out)
    return out.reshape((*leading, 4))


def conjugate(q_ab: ArrayLike) -> Array:
    """Reverse a rotation: ``q_ba`` from ``q_ab``.

    Parameters
    ----------
    q_ab : array_like, (..., 4)

    Returns
    -------
    ndarray, (..., 4)
    """
    rows, leading = _unit_quaternions(q_ab, "quaternion")
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
    """
    rows, leading = _unit_quaternions(q_ab, "quaternion")
    return rows.reshape((*leading, 4))


def rotate(q_ab: ArrayLike, v_b: ArrayLike) -> Array:
    """Rotate vectors from frame ``b`` into frame ``a``.

    Parameters
    ----------
    q_ab : array_like, (..., 4)
    v_b : array_like, (..., 3), any unit
        Leading shapes are broadcast.

    Returns
    -------
    ndarray, (..., 3), the unit of `v_b`
    """
    rotations, vectors = _unit_quaternions(q_ab, "quaternion"), _rows_of(v_b, (3,), "vector")
    q, v, leading = _broadcast(rotations, vectors)
    out = np.empty_like(v)
    kernel.quats_rotate(q, v, out)
    return out.reshape((*leading, 3))


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

    Notes
    -----
    From the largest of the four components (Shepperd 1978, doi:10.2514/3.55767b), so that no
    attitude loses accuracy.
    """
    rows, leading = _proper_matrices(dcm)
    return _apply(kernel.quats_from_dcms, rows, leading, 4)


def dcm_from_quaternion(q: ArrayLike) -> Array:
    """Direction cosine matrix of a quaternion.

    Parameters
    ----------
    q : array_like, (..., 4)
        Quaternions of norm 1 within 1 %; they are normalized first.

    Returns
    -------
    ndarray, (..., 3, 3)
    """
    rows, leading = _unit_quaternions(q, "quaternion")
    return _apply(kernel.dcms_from_quats, rows, leading, 3, 3)


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

    Notes
    -----
    Alexiev (2021), Eqs. (14)-(17), and the series (21)-(22) near zero, where those divide
    zero by zero.
    """
    rows, leading = _rows_of(rotation_vector, (3,), "rotation vector")
    return _apply(kernel.quats_from_rotvecs, rows, leading, 4)


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
    """
    rows, leading = _unit_quaternions(q, "quaternion")
    return _apply(kernel.rotvecs_from_quats, rows, leading, 3)


def dcm_from_rotation_vector(rotation_vector: ArrayLike) -> Array:
    """Exponential map: the direction cosine matrix of a rotation vector.

    Parameters
    ----------
    rotation_vector : array_like, (..., 3), rad

    Returns
    -------
    ndarray, (..., 3, 3)

    Notes
    -----
    Alexiev (2021), Eq. (12), by functions of the half angle, so that no digits are lost and
    zero needs no special case.
    """
    rows, leading = _rows_of(rotation_vector, (3,), "rotation vector")
    return _apply(kernel.dcms_from_rotvecs, rows, leading, 3, 3)


def rotation_vector_from_dcm(dcm: ArrayLike) -> Array:
    """Logarithm of a direction cosine matrix, of length at most pi.

    Parameters
    ----------
    dcm : array_like, (..., 3, 3)

    Returns
    -------
    ndarray, (..., 3), rad
    """
    return rotation_vector_from_quaternion(quaternion_from_dcm(dcm))


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
    """
    rows, leading = _rows_of(roll_pitch_heading, (3,), "roll, pitch, heading")
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
    """
    rows, leading = _unit_quaternions(q, "quaternion")
    return _apply(kernel.eulers_degrees_from_quats, rows, leading, 3)


def dcm_from_euler(roll_pitch_heading: ArrayLike) -> Array:
    """Direction cosine matrix ``C_nb`` of 3-2-1 Euler angles.

    Parameters
    ----------
    roll_pitch_heading : array_like, (..., 3), deg

    Returns
    -------
    ndarray, (..., 3, 3)

    Notes
    -----
    Alexiev (2021), Eq. (3) as corrected above: ``Cz^T Cy^T Cx^T``.
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
    """
    a, b, leading = _broadcast(_unit_quaternions(q_1, "q_1"), _unit_quaternions(q_2, "q_2"))
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
    kernel.quats_angle(*(np.require(q, requirements=["C", "W"]) for q in (q_1, q_2)), out)
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


# Arguments as rows for the kernels.


#: Rows, and the leading shape.
Rows = tuple[Array, tuple[int, ...]]


def _rows_of(values: ArrayLike, shape: tuple[int, ...], name: str) -> Rows:
    """Return `values` as rows for the kernels, and the leading shape."""
    array = np.asarray(values, dtype=np.float64)
    depth = array.ndim - len(shape)
    if depth < 0 or array.shape[depth:] != shape:
        raise DataError(
            "geodesy.shape-does-not-end-2", quantity=name, shape=array.shape, shape_2=shape
        )
    # C-contiguous and writable: numba compiles a kernel again for other arrays.
    rows = array.reshape(-1, math.prod(shape))
    if not (rows.flags.c_contiguous and rows.flags.writeable):
        rows = rows.copy()
    # A square that overflows is as useless as infinity.
    if rows.size and not (rows.max() < LARGEST and rows.min() > -LARGEST):
        good = np.abs(rows) < LARGEST
        bad = int(np.argmin(good.all(axis=1)))
        raise DataError(
            "geodesy.not-finite-number-below",
            row=bad + 1,
            quantity=name,
            largest=LARGEST,
            rows=rows[bad].tolist(),
        )
    return rows, array.shape[:depth]


def _unit_quaternions(q: ArrayLike, name: str) -> Rows:
    """Return quaternions as rows of norm 1 and the leading shape; norms must be 1 within 1 %."""
    rows, leading = _rows_of(q, (4,), name)
    unit = np.empty_like(rows)
    far = kernel.unit_quats(rows, _TOLERANCE, unit)
    if far >= 0:
        norm = float(np.sqrt(rows[far] @ rows[far]))
        raise DataError(
            "geodesy.rotation-needs-quaternion-norm", row=far + 1, quantity=name, norm=norm
        )
    return unit, leading


def _proper_matrices(dcm: ArrayLike) -> Rows:
    """Return matrices as rows of nine and the leading shape; rotations within 1 %."""
    rows, leading = _rows_of(dcm, (3, 3), "direction cosine matrix")
    matrices = rows.reshape(-1, 3, 3)
    loss = np.abs(np.swapaxes(matrices, 1, 2) @ matrices - np.eye(3)).max(axis=(1, 2), initial=0.0)
    bad = np.flatnonzero(~(loss <= _TOLERANCE) | ~(np.linalg.det(matrices) > 0))
    if bad.size:
        raise DataError(
            "geodesy.not-rotation-c-t-c",
            row=int(bad[0]) + 1,
            quantity="direction cosine matrix",
            loss=loss[bad[0]],
            det=np.linalg.det(matrices[bad[0]]),
        )
    return rows, leading


def _broadcast(one: Rows, two: Rows) -> tuple[Array, Array, tuple[int, ...]]:
    """Return the rows of both, each repeated to their common leading shape, and this shape."""
    (a, of_a), (b, of_b) = one, two
    if of_a == of_b:
        return a, b, of_a
    try:
        leading = np.broadcast_shapes(of_a, of_b)
    except ValueError:
        raise DataError("geodesy.leading-shapes-do-not-go", a=of_a, b=of_b) from None
    spread = []
    for rows, own in (one, two):
        width = rows.shape[1]
        whole = np.broadcast_to(rows.reshape((*own, width)), (*leading, width)).reshape(-1, width)
        spread.append(np.require(whole, requirements=["C", "W"]))
    return spread[0], spread[1], leading


def _apply(
    loop: Callable[[Array, Array], Any], rows: Array, leading: tuple[int, ...], *shape: int
) -> Array:
    """Apply a kernel to each row, each of `shape` below the leading one."""
    out = np.empty((rows.shape[0], math.prod(shape)))
    loop(rows, out)
    return out.reshape(leading + shape)

"""Composition, inversion and application of rotations, as quaternions."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from strapdown._kernels import rotation as kernel
from strapdown.rotation.checked_rows import common_shape, rows_of, unit_quaternions

__all__ = ["Q_NED_ENU", "compose", "conjugate", "normalise", "rotate"]

Array = NDArray[np.float64]

#: From east-north-up to north-east-down: half a turn about the diagonal of north and east.
Q_NED_ENU = (0.0, math.sqrt(0.5), math.sqrt(0.5), 0.0)


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
    a, lead_a = unit_quaternions(q_ab, "q_ab")
    b, lead_b = unit_quaternions(q_bc, "q_bc")
    leading = common_shape(lead_a, lead_b)
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
    rows, leading = unit_quaternions(q_ab, "quaternion")
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
    rows, leading = unit_quaternions(q_ab, "quaternion")
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

    Raises
    ------
    DataError
        Wrong shape, a value that is not finite, or a norm that is not 1.
    """
    q, lead_q = unit_quaternions(q_ab, "quaternion")
    v, lead_v = rows_of(v_b, (3,), "vector")
    leading = common_shape(lead_q, lead_v)
    quats = np.broadcast_to(q.reshape((*lead_q, 4)), (*leading, 4)).reshape(-1, 4)
    vectors = np.broadcast_to(v.reshape((*lead_v, 3)), (*leading, 3)).reshape(-1, 3)
    out = np.empty((len(vectors), 3))
    kernel.quats_rotate(np.ascontiguousarray(quats), np.ascontiguousarray(vectors), out)
    return out.reshape((*leading, 3))

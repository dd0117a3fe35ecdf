"""Direction cosine matrices from and to quaternions, and the matrix of a cross product."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from strapdown._kernels import rotation as kernel
from strapdown.rotation.checked_rows import apply, proper_matrices, unit_quaternions

__all__ = ["cross_matrix", "dcm_from_quaternion", "quaternion_from_dcm"]

Array = NDArray[np.float64]


def dcm_from_quaternion(q: ArrayLike) -> Array:
    """Direction cosine matrix of a quaternion.

    Parameters
    ----------
    q : array_like, (..., 4)
        Quaternions of norm 1 within 1 %; they are normalized first.

    Returns
    -------
    ndarray, (..., 3, 3)

    Raises
    ------
    DataError
        Wrong shape, a value that is not finite, or a norm that is not 1.
    """
    rows, leading = unit_quaternions(q, "quaternion")
    return apply(kernel.dcms_from_quats, rows, leading, 3, 3)


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
        Wrong shape, a value that is not finite, or not a rotation.

    Notes
    -----
    From the largest of the four components (Shepperd 1978, doi:10.2514/3.55767b), so that no
    attitude loses accuracy.
    """
    rows, leading = proper_matrices(dcm)
    return apply(kernel.quats_from_dcms, rows, leading, 4)


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

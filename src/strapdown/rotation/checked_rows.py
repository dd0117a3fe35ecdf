"""What every function here takes: checked, and laid out as rows for the kernels."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from strapdown._kernels.increments import LARGEST
from strapdown.exceptions import DataError

__all__ = ["apply", "common_shape", "proper_matrices", "rows_of", "unit_quaternions"]

Array = NDArray[np.float64]

# How far a norm or C^T C may lie from one before an input is refused as no rotation. Hand
# written quaternions carry three or four digits; a mistaken order of components does not pass.
_TOLERANCE = 1e-2


def rows_of(values: ArrayLike, shape: tuple[int, ...], name: str) -> tuple[Array, tuple[int, ...]]:
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


def unit_quaternions(q: ArrayLike, name: str) -> tuple[Array, tuple[int, ...]]:
    """Return quaternions as rows of norm 1 and the leading shape; none may be 1 % from it."""
    rows, leading = rows_of(q, (4,), name)
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


def proper_matrices(dcm: ArrayLike) -> tuple[Array, tuple[int, ...]]:
    """Return matrices as rows of nine and the leading shape; none may be 1 % from a rotation."""
    rows, leading = rows_of(dcm, (3, 3), "direction cosine matrix")
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


def common_shape(a: tuple[int, ...], b: tuple[int, ...]) -> tuple[int, ...]:
    """Return the leading shape that both are broadcast to."""
    try:
        return np.broadcast_shapes(a, b)
    except ValueError:
        raise DataError(
            f"leading shapes {a} and {b} do not go together",
            remedy="pass as many of the one as of the other, or one of either",
        ) from None


def apply(
    loop: Callable[[Array, Array], Any], rows: Array, leading: tuple[int, ...], *shape: int
) -> Array:
    """Return what a kernel makes of each row, each of `shape` below the leading one."""
    out = np.empty((rows.shape[0], int(np.prod(shape))))
    loop(rows, out)
    return out.reshape(leading + shape)

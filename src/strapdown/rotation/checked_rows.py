"""Check the arguments of rotation functions, and arrange them as rows for the kernels."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from strapdown._kernels.increments import LARGEST
from strapdown.errors import DataError

__all__ = ["apply", "common_shape", "proper_matrices", "rows_of", "unit_quaternions"]

Array = NDArray[np.float64]

# Tolerance of a norm or of C^T C before an input is refused as not a rotation. Handwritten
# quaternions carry three or four digits; a mistaken order of components does not pass.
_TOLERANCE = 1e-2


def rows_of(values: ArrayLike, shape: tuple[int, ...], name: str) -> tuple[Array, tuple[int, ...]]:
    """Return `values` as C-contiguous rows and the leading shape."""
    array = np.asarray(values, dtype=np.float64)
    if array.shape[array.ndim - len(shape) :] != shape or array.ndim < len(shape):
        raise DataError(
            "geodesy.shape-does-not-end-2", quantity=name, shape=array.shape, shape_2=shape
        )
    leading = array.shape[: array.ndim - len(shape)]
    rows = np.ascontiguousarray(array.reshape(-1, int(np.prod(shape))))
    # A square that overflows is as useless as infinity.
    bad = np.flatnonzero(~(np.abs(rows) < LARGEST).all(axis=1))
    if bad.size:
        raise DataError(
            "geodesy.not-finite-number-below",
            row=int(bad[0]) + 1,
            quantity=name,
            largest=LARGEST,
            rows=rows[bad[0]].tolist(),
        )
    return rows, leading


def unit_quaternions(q: ArrayLike, name: str) -> tuple[Array, tuple[int, ...]]:
    """Return quaternions as rows of norm 1 and the leading shape; norms must be 1 within 1 %."""
    rows, leading = rows_of(q, (4,), name)
    norm = np.sqrt((rows * rows).sum(axis=1))
    bad = np.flatnonzero(np.abs(norm - 1.0) > _TOLERANCE)
    if bad.size:
        raise DataError(
            "geodesy.rotation-needs-quaternion-norm",
            row=int(bad[0]) + 1,
            quantity=name,
            norm=norm[bad[0]],
        )
    return rows / norm[:, None], leading


def proper_matrices(dcm: ArrayLike) -> tuple[Array, tuple[int, ...]]:
    """Return matrices as rows of nine and the leading shape; rotations within 1 %."""
    rows, leading = rows_of(dcm, (3, 3), "direction cosine matrix")
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


def common_shape(a: tuple[int, ...], b: tuple[int, ...]) -> tuple[int, ...]:
    """Return the common broadcast leading shape."""
    try:
        return np.broadcast_shapes(a, b)
    except ValueError:
        raise DataError("geodesy.leading-shapes-do-not-go", a=a, b=b) from None


def apply(
    loop: Callable[[Array, Array], Any], rows: Array, leading: tuple[int, ...], *shape: int
) -> Array:
    """Apply a kernel to each row, each of `shape` below the leading one."""
    out = np.empty((rows.shape[0], int(np.prod(shape))))
    loop(rows, out)
    return out.reshape(leading + shape)

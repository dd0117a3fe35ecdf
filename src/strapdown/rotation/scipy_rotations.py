"""Quaternions from and to `scipy.spatial.transform.Rotation`, which is loaded on first use."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from strapdown.rotation.checked_rows import unit_quaternions

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

__all__ = ["from_scipy", "to_scipy"]

Array = NDArray[np.float64]


def to_scipy(q: ArrayLike) -> Rotation:
    """Convert quaternions to a `scipy.spatial.transform.Rotation` (scalar last inside).

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

    rows, leading = unit_quaternions(q, "quaternion")
    return Rotation.from_quat(rows.reshape((*leading, 4))[..., [1, 2, 3, 0]])


def from_scipy(rotation: Rotation) -> Array:
    """Convert a `scipy.spatial.transform.Rotation` to quaternions, scalar first.

    Parameters
    ----------
    rotation : scipy.spatial.transform.Rotation

    Returns
    -------
    ndarray, (..., 4)
    """
    q: Array = np.ascontiguousarray(rotation.as_quat()[..., [3, 0, 1, 2]], dtype=np.float64)
    return q

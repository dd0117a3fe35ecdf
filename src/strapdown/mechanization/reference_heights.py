"""Checks of the reference heights of a damped height."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from strapdown.errors import DataError

Array = NDArray[np.float64]

#: Height options: free (by the sensors), held, damped by a reference.
HEIGHTS = ("free", "held", "damped")


def reference_heights(height: str, heights: ArrayLike | None, steps: int) -> Array:
    """Return the reference heights of a segment as a kernel takes them.

    Parameters
    ----------
    height : {'free', 'held', 'damped'}
        Height option.
    heights : array_like, (n,), m, or None
        NaN for missing ones.
    steps : int
        Steps of the segment.

    Returns
    -------
    ndarray, (n,), or (0,) where the height is not damped

    Raises
    ------
    DataError
        They are missing where the height is damped, given where it is not, infinite, or of
        another length.
    """
    if height != "damped":
        if heights is None:
            return np.empty(0)
        raise DataError("mechanization.heights-damp-height", quantity="heights", height=height)
    if heights is None:
        raise DataError("mechanization.height-damped-no-reference", quantity="heights")
    try:
        reference = np.ascontiguousarray(heights, dtype=np.float64)
    except (TypeError, ValueError):
        raise DataError("mechanization.these-no-numbers", quantity="heights") from None
    if reference.shape != (steps,):
        raise DataError(
            "mechanization.shape-steps", quantity="heights", shape=reference.shape, steps=steps
        )
    if np.isinf(reference).any():
        raise DataError(
            "mechanization.infinite",
            row=int(np.argmax(np.isinf(reference))) + 1,
            quantity="heights",
        )
    return reference

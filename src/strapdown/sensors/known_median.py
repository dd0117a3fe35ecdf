"""The median of what is known."""

from __future__ import annotations

import warnings

import numpy as np
from numpy.typing import NDArray

__all__ = ["known_median"]

Array = NDArray[np.float64]


def known_median(values: Array, axis: int) -> Array:
    """Return the median along an axis of what is no NaN; NaN, without a warning, of nothing."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)
        return np.asarray(np.nanmedian(values, axis=axis))

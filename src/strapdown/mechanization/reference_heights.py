"""Heights that a damped height is drawn to, checked."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from strapdown.exceptions import DataError

Array = NDArray[np.float64]

#: What may become of the height: it follows from the sensors; it is kept; a reference damps it.
HEIGHTS = ("free", "held", "damped")


def reference_heights(height: str, heights: ArrayLike | None, steps: int) -> Array:
    """Return the reference heights of a segment as a kernel takes them.

    Parameters
    ----------
    height : {'free', 'held', 'damped'}
        What becomes of the height.
    heights : array_like, (n,), m, or None
        NaN where there is none.
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
        raise DataError(
            f"there are heights to damp by, and the height is '{height}'",
            quantity="heights",
            remedy="use height='damped', or leave them out",
        )
    if heights is None:
        raise DataError(
            "the height is to be damped, and there is no reference for it",
            quantity="heights",
            remedy="give a height for every step, or use height='held' or 'free'",
        )
    try:
        reference = np.ascontiguousarray(heights, dtype=np.float64)
    except (TypeError, ValueError):
        raise DataError(
            "these are no numbers",
            quantity="heights",
            remedy="give one height in m for every step, NaN where there is none",
        ) from None
    if reference.shape != (steps,):
        raise DataError(
            f"its shape is {reference.shape}, and there are {steps} steps",
            quantity="heights",
            remedy="give one height in m for every step, NaN where there is none",
        )
    if np.isinf(reference).any():
        raise DataError(
            "it is infinite",
            row=int(np.argmax(np.isinf(reference))) + 1,
            quantity="heights",
            remedy="give heights in m, NaN where there is none",
        )
    return reference

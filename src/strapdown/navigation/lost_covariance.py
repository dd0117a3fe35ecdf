"""What is raised where a covariance is none any more."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import DivergenceError

__all__ = ["LostCovarianceError"]

Array = NDArray[np.float64]


class LostCovarianceError(DivergenceError):
    """A variance became negative.

    Attributes
    ----------
    place : ndarray, (3,), m²
        What stood for the variances of the place then.
    """

    def __init__(self, place: Array, what: str, *, quantity: str, remedy: str) -> None:
        super().__init__(what, quantity=quantity, remedy=remedy)
        self.place = place

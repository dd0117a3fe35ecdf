"""What is raised where a covariance is none any more."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import DivergenceError, Finding

__all__ = ["LostCovarianceError"]

Array = NDArray[np.float64]


class LostCovarianceError(DivergenceError):
    """A variance became negative.

    Attributes
    ----------
    place : ndarray, (3,), m²
        What stood for the variances of the place then.
    """

    def __init__(self, code: str | Finding, *, place: Array | None = None, **values: Any) -> None:
        super().__init__(code, **values)
        self.place = np.zeros(3) if place is None else place

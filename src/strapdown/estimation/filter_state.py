"""What a filter remembers from one step to the next."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["FilterState"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class FilterState:
    """Everything that a filter remembers: from here it goes on.

    Attributes
    ----------
    time : float, s
    mechanization : ndarray
        State of the mechanization, errors taken off.
    row : ndarray
        Its row of a history.
    sensors : ndarray, (k,)
        Estimates of the sensors' errors, in the order of the model's `sensors`.
    covariance : ndarray, (n, n)
        State of the covariance form.
    """

    time: float
    mechanization: Array
    row: Array
    sensors: Array
    covariance: Array

"""What a filter is told, beside what it computed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Observation:
    """Computed less observed, and how it depends on the physical errors.

    Attributes
    ----------
    name : str
        Of whatever observes; two receivers have two names.
    z : ndarray, (l,)
        Computed less observed.
    H : ndarray, (l, p)
        ``z = H physical + noise``: columns as `ErrorModel` has the physical errors, nine and those
        of the sensors, in level axes.
    R : ndarray, (l,)
        Variances of the noise; its components are independent.
    labels : tuple of str
        One a component, with its unit.
    """

    name: str
    z: Array
    H: Array
    R: Array
    labels: tuple[str, ...]

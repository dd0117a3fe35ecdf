"""The level plane at the start of a run, in the unit of its plan."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.frames import ned_from_geodetic
from strapdown.navigation.record import Span
from strapdown.report.navigation_told import NavigationTold
from strapdown.tables import places_of

__all__ = ["Plane", "within_span"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Plane:
    """East and north in the unit of the plan about the start.

    Attributes
    ----------
    origin : ndarray, (3,)
        The start: latitude and longitude in deg, height in m.
    told : NavigationTold
    unit : str
        ``m`` or ``km``.
    scale : float
        From m to it.
    """

    origin: Array
    told: NavigationTold
    unit: str
    scale: float

    def of(self, table: pd.DataFrame) -> tuple[Array, Array]:
        """East and north of the rows of a table of places, each (n,)."""
        ned = ned_from_geodetic(places_of(table), self.origin, ellipsoid=self.told.ellipsoid)
        return self.scale * ned[:, 1], self.scale * ned[:, 0]


def within_span(time: Array, span: Span) -> NDArray[np.bool_]:
    """Which instants are within a span."""
    return np.asarray((time >= span.begin) & (time <= span.end))

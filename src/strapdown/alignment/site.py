"""Where a body stands while it is aligned."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from strapdown.earth import earth_rate, gravity, rows
from strapdown.ellipsoids import WGS84, Ellipsoid

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Site:
    """A place on the Earth.

    Attributes
    ----------
    lat_deg, lon_deg : float, deg
        Geodetic, north and east positive.
    alt : float, m
        Over the ellipsoid.
    ellipsoid : Ellipsoid

    Raises
    ------
    DataError
        A latitude beyond 90 deg, a longitude of more than a turn, or no finite number.
    """

    lat_deg: float
    lon_deg: float
    alt: float = 0.0
    ellipsoid: Ellipsoid = WGS84

    def __post_init__(self) -> None:
        rows(lat_deg=self.lat_deg, lon_deg=self.lon_deg, alt=self.alt)

    @property
    def gravity(self) -> Array:
        """Normal gravity north, east, down, (3,), m/s²."""
        return gravity(self.lat_deg, self.alt, ellipsoid=self.ellipsoid)

    @property
    def earth_rate(self) -> Array:
        """Rate of the Earth north, east, down, (3,), rad/s."""
        return earth_rate(self.lat_deg, ellipsoid=self.ellipsoid)

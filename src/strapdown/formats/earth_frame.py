"""Where north, east and down point at a place that is given in ECEF."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from strapdown import rotation

Array = NDArray[np.float64]

# WGS 84 (NGA.STND.0036): semi-major axis in m, and flattening.
_A = 6378137.0
_F = 1.0 / 298.257223563
_E2 = _F * (2.0 - _F)
# Farther out no vehicle goes, and powers leave the range of doubles in the end.
_FARTHEST = 1e9  # m


def latitude_longitude(position: ArrayLike) -> tuple[Array, Array]:
    """Geodetic latitude and longitude, WGS 84.

    The closed form of Vermeille, J. Geodesy 76 (2002) 451-454, which has no iteration.

    Parameters
    ----------
    position : array_like, (n, 3), m
        Earth-centred, earth-fixed; farther than 43 km from the centre, inside of which the
        normal to the ellipsoid is not unique, and nearer than 1e9 m.

    Returns
    -------
    latitude, longitude : ndarray, (n,), rad
        NaN elsewhere.
    """
    places = np.array(position, dtype=np.float64).reshape(-1, 3)
    places[~(np.abs(places) < _FARTHEST).all(axis=1)] = np.nan
    x, y, z = places.T
    e4 = _E2 * _E2
    p = (x * x + y * y) / (_A * _A)
    q = (1.0 - _E2) * z * z / (_A * _A)
    r = (p + q - e4) / 6.0
    r = np.where(r > 0.0, r, np.nan)
    s = e4 * p * q / (4.0 * r**3)
    t = np.cbrt(1.0 + s + np.sqrt(s * (2.0 + s)))
    u = r * (1.0 + t + 1.0 / t)
    v = np.sqrt(u * u + e4 * q)
    w = _E2 * (u + v - q) / (2.0 * v)
    k = np.sqrt(u + v + w * w) - w
    d = k * np.hypot(x, y) / (k + _E2)
    return 2.0 * np.arctan2(z, d + np.hypot(d, z)), np.arctan2(y, x)


def ned_from_ecef(position: ArrayLike) -> Array:
    """Quaternion ``q_ne`` from ECEF to north-east-down at each place.

    Parameters
    ----------
    position : array_like, (n, 3), m
        As in `latitude_longitude`.

    Returns
    -------
    ndarray, (n, 4)
        Hamilton, scalar first; NaN where the position is none.
    """
    latitude, longitude = latitude_longitude(position)
    known = np.isfinite(latitude) & np.isfinite(longitude)
    sin_lat, cos_lat = np.sin(latitude[known]), np.cos(latitude[known])
    sin_lon, cos_lon = np.sin(longitude[known]), np.cos(longitude[known])
    zero = np.zeros_like(sin_lat)
    north = np.column_stack([-sin_lat * cos_lon, -sin_lat * sin_lon, cos_lat])
    east = np.column_stack([-sin_lon, cos_lon, zero])
    down = np.column_stack([-cos_lat * cos_lon, -cos_lat * sin_lon, -sin_lat])
    q = np.full((latitude.size, 4), np.nan)
    if known.any():
        q[known] = rotation.quaternion_from_dcm(np.stack([north, east, down], axis=1))
    return q

"""Places as earth-centred, earth-fixed metres and back, for tables of trajectories.

The functions are called as those of `frames`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from strapdown import rotation
from strapdown._kernels.earth import radii
from strapdown.ellipsoids import WGS84, Ellipsoid

Array = NDArray[np.float64]

__all__ = ["ecef_from_geodetic", "geodetic_from_ecef", "place_difference", "q_ne"]


def _transverse(sine: Array, ellipsoid: Ellipsoid) -> Array:
    """Radius of the prime vertical, m."""
    a, e2 = ellipsoid.semi_major_axis, ellipsoid.eccentricity_squared
    return np.array([radii(s, a, e2)[1] for s in sine.tolist()])


def ecef_from_geodetic(place: Array, *, ellipsoid: Ellipsoid = WGS84) -> Array:
    """Earth-centred, earth-fixed position.

    Parameters
    ----------
    place : ndarray, (n, 3)
        Geodetic latitude and longitude in deg, height over the ellipsoid in m.
    ellipsoid : Ellipsoid

    Returns
    -------
    ndarray, (n, 3), m
    """
    lat, lon = np.radians(place[:, 0]), np.radians(place[:, 1])
    sine, alt = np.sin(lat), place[:, 2]
    transverse = _transverse(sine, ellipsoid)
    across = (transverse + alt) * np.cos(lat)
    up = (transverse * (1.0 - ellipsoid.eccentricity_squared) + alt) * sine
    return np.column_stack([across * np.cos(lon), across * np.sin(lon), up])


def geodetic_from_ecef(position: Array, *, ellipsoid: Ellipsoid = WGS84) -> Array:
    """Geodetic place of an earth-centred, earth-fixed position.

    Parameters
    ----------
    position : ndarray, (n, 3), m
        Within a thousand kilometres of the surface.
    ellipsoid : Ellipsoid

    Returns
    -------
    ndarray, (n, 3)
        Latitude and longitude in deg, height in m, right to rounding, the poles included.

    Notes
    -----
    Bowring, Survey Review 23 (1976) 323-327, is right to 1e-7 rad here. Each of the four steps
    after it, ``tan lat = (z + e² N sin lat)/p``, leaves less than 0.007 of an error.
    """
    a, b, e2 = ellipsoid.semi_major_axis, ellipsoid.semi_minor_axis, ellipsoid.eccentricity_squared
    x, y, z = position.T
    p = np.hypot(x, y)
    reduced = np.arctan2(a * z, b * p)
    lat = np.arctan2(
        z + e2 / (1.0 - e2) * b * np.sin(reduced) ** 3, p - e2 * a * np.cos(reduced) ** 3
    )
    for _ in range(4):
        sine = np.sin(lat)
        lat = np.arctan2(z + e2 * _transverse(sine, ellipsoid) * sine, p)
    sine = np.sin(lat)
    # Along the normal: no quotient of two small numbers at the poles.
    alt = p * np.cos(lat) + z * sine - a * a / _transverse(sine, ellipsoid)
    return np.column_stack([np.degrees(lat), np.degrees(np.arctan2(y, x)), alt])


def q_ne(lat_deg: Array, lon_deg: Array) -> Array:
    """Quaternion from earth-centred, earth-fixed to north-east-down axes.

    Parameters
    ----------
    lat_deg, lon_deg : ndarray, (n,), deg
        Geodetic.

    Returns
    -------
    ndarray, (n, 4)
        ``C_ne = (Rz(lon) Ry(-90° - lat))^T``, scalar first.
    """
    level = np.column_stack([np.zeros_like(lat_deg), -90.0 - lat_deg, lon_deg])
    return rotation.conjugate(rotation.quaternion_from_euler(level))


def place_difference(place: Array, reference: Array, *, ellipsoid: Ellipsoid = WGS84) -> Array:
    """Place minus reference, in metres north, east and down.

    Parameters
    ----------
    place, reference : ndarray, (n, 3)
        Geodetic latitude and longitude in deg, height in m.
    ellipsoid : Ellipsoid

    Returns
    -------
    ndarray, (n, 3), m
        The straight line from the reference to the place, along north, east and down midway, where
        the vertical is the mean of both verticals. Its length is the distance; exchanged places
        give exactly the opposite; the date line and the poles are no special places. Along
        the axes of either end, places of one height would seem to differ in it by
        ``d²/2R``, 785 m at a distance of 100 km; midway, `down` is the difference of heights
        times the cosine of half the angle between the verticals, 1 - 3e-5 at 100 km. The
        line is shorter than the way along the ground by ``d³/24R²``, 1 m at 100 km. Rounding is
        2e-9 m.
    """
    normals = np.zeros((len(place), 3))
    for end in (place, reference):
        lat, lon = np.radians(end[:, 0]), np.radians(end[:, 1])
        normals += np.column_stack(
            [np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)]
        )
    x, y, z = normals.T
    to_level = q_ne(np.degrees(np.arctan2(z, np.hypot(x, y))), np.degrees(np.arctan2(y, x)))
    start = ecef_from_geodetic(reference, ellipsoid=ellipsoid)
    return rotation.rotate(to_level, ecef_from_geodetic(place, ellipsoid=ellipsoid) - start)

"""Geodetic coordinates, Earth-centred coordinates, and the axes of the local level between them.

Angles in rad, lengths in m; ``a`` is the semi-major axis and ``e2`` the first eccentricity
squared of the ellipsoid.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from strapdown._kernels.earth import E2, A, radii


@njit(cache=True)
def ecef_from_geodetic(s_lat, c_lat, s_lon, c_lon, alt, a, e2):
    """Earth-centred, earth-fixed x, y, z: Heiskanen and Moritz 1967, Eq. (5-3)."""
    _, transverse = radii(s_lat, a, e2)
    from_axis = (transverse + alt) * c_lat
    return from_axis * c_lon, from_axis * s_lon, (transverse * (1.0 - e2) + alt) * s_lat


@njit(cache=True)
def geodetic_from_ecef(x, y, z, a, e2):
    """Latitude, longitude and height, without iteration: Vermeille, J. Geodesy 76 (2002) 451-454.

    NaN within ``a e2``, 43 km, of the centre, where more than one normal goes through a point.
    """
    e4 = e2 * e2
    p = (x * x + y * y) / (a * a)
    q = (1.0 - e2) * z * z / (a * a)
    r = (p + q - e4) / 6.0
    if not r > 0.0:
        return math.nan, math.nan, math.nan
    s = e4 * p * q / (4.0 * r * r * r)
    t = np.cbrt(1.0 + s + math.sqrt(s * (2.0 + s)))
    u = r * (1.0 + t + 1.0 / t)
    v = math.sqrt(u * u + e4 * q)
    w = e2 * (u + v - q) / (2.0 * v)
    k = math.sqrt(u + v + w * w) - w
    d = k * math.hypot(x, y) / (k + e2)
    normal = math.hypot(d, z)
    return (
        2.0 * math.atan2(z, d + normal),
        math.atan2(y, x),
        (k + e2 - 1.0) / k * normal,
    )


@njit(cache=True)
def ned_from_ecef(lat, lon):
    """Quaternion ``q_ne`` that turns vectors from ECEF to north-east-down axes.

    The conjugate of a turn about z by the longitude, then about y by ``-(lat + 90 deg)``.
    """
    half_lon = 0.5 * lon
    tip = 0.5 * lat + 0.25 * math.pi
    c_lon, s_lon = math.cos(half_lon), math.sin(half_lon)
    c_tip, s_tip = math.cos(tip), math.sin(tip)
    return c_lon * c_tip, -s_lon * s_tip, c_lon * s_tip, -s_lon * c_tip


@njit(cache=True)
def displacement(lat, lon, alt, lat0, lon0, alt0, a, e2):
    """Straight line to a place from another, in north-east-down of the place; to 1e-9 m."""
    s, c = math.sin(lat), math.cos(lat)
    s_lon, c_lon = math.sin(lon), math.cos(lon)
    x, y, z = ecef_from_geodetic(s, c, s_lon, c_lon, alt, a, e2)
    x0, y0, z0 = ecef_from_geodetic(
        math.sin(lat0), math.cos(lat0), math.sin(lon0), math.cos(lon0), alt0, a, e2
    )
    x, y, z = x - x0, y - y0, z - z0
    outward = c_lon * x + s_lon * y
    return c * z - s * outward, c_lon * y - s_lon * x, -c * outward - s * z


@njit(cache=True)
def places_from_ecef(positions, ellipsoid, out):
    """Columns latitude, longitude, height of rows x, y, z."""
    for i in range(positions.shape[0]):
        out[i, 0], out[i, 1], out[i, 2] = geodetic_from_ecef(
            positions[i, 0], positions[i, 1], positions[i, 2], ellipsoid[A], ellipsoid[E2]
        )


@njit(cache=True)
def quats_ned_from_ecef(lats, lons, out):
    """Rows ``q_ne`` of latitudes and longitudes."""
    for i in range(lats.size):
        out[i, 0], out[i, 1], out[i, 2], out[i, 3] = ned_from_ecef(lats[i], lons[i])

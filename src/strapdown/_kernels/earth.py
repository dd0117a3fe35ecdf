"""Ellipsoidal Earth: radii of curvature, normal gravity, rates of the local level.

An ellipsoid comes as a float64 array whose places are named here. ``s`` and ``c`` are sine and
cosine of the geodetic latitude; vectors are north, east, down.
"""

from __future__ import annotations

import math

from numba import njit

# Places in the array of an ellipsoid: semi-major axis in m, first eccentricity squared, normal
# gravity at the equator in m/s², Somigliana's k, rate of rotation in rad/s, flattening, and the
# ratio of centrifugal force to gravity at the equator.
A, E2, GAMMA, K, RATE, F, M = 0, 1, 2, 3, 4, 5, 6
SIZE = 7


@njit(cache=True)
def radii(s, a, e2):
    """Radii of curvature of the surface: of the meridian, and of the prime vertical, m."""
    w2 = 1.0 - e2 * s * s
    transverse = a / math.sqrt(w2)
    return transverse * (1.0 - e2) / w2, transverse


@njit(cache=True)
def gravity(s, c, alt, a, e2, gamma, k, f, m):
    """North and down components of normal gravity, m/s²; the east one is zero.

    Down: Somigliana's formula, continued upward by the second order of the height (Heiskanen and
    Moritz 1967, Eq. (2-124)). North: that the field has no curl makes of it
    ``-1/(R_M + h) int dgamma/dlat dh`` from the surface up, here with the derivative of the
    surface.
    """
    s2 = s * s
    w2 = 1.0 - e2 * s2
    w = math.sqrt(w2)
    numerator = 1.0 + k * s2
    surface = gamma * numerator / w
    x = alt / a
    down = surface * (1.0 - x * (2.0 * (1.0 + f + m - 2.0 * f * s2) - 3.0 * x))
    slope = gamma * s * c * (2.0 * k + e2 * numerator / w2) / w
    meridian = a * (1.0 - e2) / (w2 * w)
    return -slope * alt / (meridian + alt), down


@njit(cache=True)
def centrifugal(s, c, alt, transverse, rate):
    """North and down components of the centrifugal acceleration, m/s²."""
    outward = rate * rate * (transverse + alt) * c
    return -outward * s, -outward * c


@njit(cache=True)
def earth_rate(s, c, rate):
    """North and down components of the Earth's rate, rad/s: Tadic and Vukajlovic 2016, Eq. (7)."""
    return rate * c, -rate * s


@njit(cache=True)
def transport_rate(s, c, v_n, v_e, meridian, transverse):
    """Rate of north-east-down relative to the Earth, rad/s, from radii that include the height.

    Tadic and Vukajlovic 2016, Eq. (8), whose third component lacks its minus in print.
    """
    east_angle = v_e / transverse
    return east_angle, -v_n / meridian, -east_angle * s / c

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


@njit(cache=True, error_model="numpy", inline="always")
def radii(s, a, e2):
    """Radii of curvature of the surface: of the meridian, and of the prime vertical, m."""
    w = 1.0 / math.sqrt(1.0 - e2 * s * s)
    return a * (1.0 - e2) * w * w * w, a * w


@njit(cache=True, error_model="numpy", inline="always")
def gravity_around(s, c, alt, w, curvature, a, e2, gamma, k, f, m):
    """Normal gravity at a place and how it changes around it.

    `w` is the prime vertical's radius over a, `curvature` that of the meridian at the height.
    Returns the north and down components in m/s², the change of each with latitude and with
    height, and the square term of the down component in the height: by it the down component is
    exact in the height, and the rest is of the second order of a displacement.

    Down: Somigliana's formula, continued upward by the second order of the height (Heiskanen and
    Moritz 1967, Eq. (2-124)). North: that the field has no curl makes of it
    ``-1/(R_M + h) int dgamma/dlat dh`` from the surface up, here with the derivative of the
    surface.
    """
    s2 = s * s
    inverse_a = 1.0 / a
    numerator = 1.0 + k * s2
    equator = gamma * w
    surface = equator * numerator
    steep = equator * (2.0 * k + e2 * numerator * w * w)
    sc = s * c
    slope = steep * sc
    x = alt * inverse_a
    linear = 2.0 * (1.0 + f + m) - 4.0 * f * s2
    upward = alt * curvature
    return (
        -slope * upward,
        surface * (1.0 - x * (linear - 3.0 * x)),
        -steep * (c * c - s2) * upward,
        -slope * curvature,
        slope * (1.0 - x * linear) + 8.0 * f * x * sc * surface,
        -surface * inverse_a * (linear - 6.0 * x),
        3.0 * inverse_a * inverse_a * surface,
    )


@njit(cache=True)
def gravity(s, c, alt, a, e2, gamma, k, f, m):
    """North and down components of normal gravity, m/s²; the east one is zero."""
    meridian, transverse = radii(s, a, e2)
    north, down, _, _, _, _, _ = gravity_around(
        s, c, alt, transverse / a, 1.0 / (meridian + alt), a, e2, gamma, k, f, m
    )
    return north, down


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

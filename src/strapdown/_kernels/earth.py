"""Ellipsoidal Earth: radii of curvature, normal gravity, rates of the local level.

An ellipsoid comes as a float64 array whose places are named here. ``s`` and ``c`` are sine and
cosine of the geodetic latitude; vectors are north, east, down. The loops at the end take
latitudes in rad.
"""

from __future__ import annotations

import math

from numba import njit

# Places in the array of an ellipsoid: semi-major axis in m, first eccentricity squared, normal
# gravity at the equator in m/s², Somigliana's k, rate of rotation in rad/s, flattening, and the
# ratio of centrifugal acceleration to gravity at the equator.
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

    On the surface Somigliana's formula, which is exact. Above it, with ``x = alt / a``:

    * Down is ``surface / (1 + y)²``, the form of a sphere, for which y = x. The first power of
      x in y is exact, from Bruns' formula for the gradient of gravity on a level surface,
      ``-gravity (1/R_M + 1/R_N) - 2 rate²`` (Heiskanen and Moritz 1967, sec. 2-3); its last term
      has ``1 - k s²`` for ``1 / (1 + k s²)``, a part in 1e8. The second and third have the
      flattening to first order, from
      ``GM/r² (1 - 3 J2 (a/r)² P2) - rate² r cos²`` with ``r = a (1 - f s²) + alt`` and
      ``3 J2 = 2 f - m``.
    * North is ``-1/(R_M + alt) int d(down)/d(lat) d(alt)``, as the field has no curl. The first
      power of x has the exact slope of the surface; the second and third are those of the same
      first-order potential.

    What is left out are terms of ``f² x²``.
    """
    s2 = s * s
    w2 = 1.0 - e2 * s2
    w = math.sqrt(w2)
    inverse = 1.0 / w2
    numerator = 1.0 + k * s2
    surface = gamma * numerator * w * inverse
    slope = gamma * w * inverse * (2.0 * k + e2 * numerator * inverse)
    meridian = (1.0 - e2) * w * inverse * inverse
    x = alt / a
    first = 0.5 * w * (1.0 + w2 * (1.0 / (1.0 - e2))) + m * w * (1.0 - k * s2)
    form = 0.25 * (2.0 * f - m) * (3.0 * s2 - 1.0)
    spin = 0.5 * m * (1.0 - s2)
    y = 1.0 + x * (first + x * (form + 6.0 * spin + x * (4.0 * spin - form)))
    bend = surface * (6.0 * f - 5.0 * m) * x * (1.0 - 2.0 * x)
    # From zero, so that on the surface there is no zero with a minus.
    return 0.0 - s * c * (slope + bend) * x / (meridian + x), surface / (y * y)


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


@njit(cache=True)
def all_radii(lats, ellipsoid, out):
    """Radii of curvature: columns meridian, prime vertical."""
    for i in range(lats.size):
        out[i, 0], out[i, 1] = radii(math.sin(lats[i]), ellipsoid[A], ellipsoid[E2])


@njit(cache=True)
def gravities(lats, alts, ellipsoid, out):
    """Normal gravity: columns north, east, down."""
    for i in range(lats.size):
        out[i, 0], out[i, 2] = gravity(
            math.sin(lats[i]),
            math.cos(lats[i]),
            alts[i],
            ellipsoid[A],
            ellipsoid[E2],
            ellipsoid[GAMMA],
            ellipsoid[K],
            ellipsoid[F],
            ellipsoid[M],
        )
        out[i, 1] = 0.0


@njit(cache=True)
def centrifugals(lats, alts, ellipsoid, out):
    """Centrifugal acceleration: columns north, east, down."""
    for i in range(lats.size):
        s, c = math.sin(lats[i]), math.cos(lats[i])
        _, transverse = radii(s, ellipsoid[A], ellipsoid[E2])
        out[i, 0], out[i, 2] = centrifugal(s, c, alts[i], transverse, ellipsoid[RATE])
        out[i, 1] = 0.0


@njit(cache=True)
def earth_rates(lats, ellipsoid, out):
    """Rate of the Earth: columns north, east, down."""
    for i in range(lats.size):
        out[i, 0], out[i, 2] = earth_rate(math.sin(lats[i]), math.cos(lats[i]), ellipsoid[RATE])
        out[i, 1] = 0.0


@njit(cache=True)
def transport_rates(lats, alts, velocities, ellipsoid, out):
    """Transport rate: columns north, east, down."""
    for i in range(lats.size):
        s, c = math.sin(lats[i]), math.cos(lats[i])
        meridian, transverse = radii(s, ellipsoid[A], ellipsoid[E2])
        out[i, 0], out[i, 1], out[i, 2] = transport_rate(
            s, c, velocities[i, 0], velocities[i, 1], meridian + alts[i], transverse + alts[i]
        )

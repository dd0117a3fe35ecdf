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


@njit(cache=True, error_model="numpy", inline="always")
def radii(s, a, e2):
    """Radii of curvature of the surface: of the meridian, and of the prime vertical, m."""
    w = 1.0 / math.sqrt(1.0 - e2 * s * s)
    return a * (1.0 - e2) * w * w * w, a * w


@njit(cache=True, error_model="numpy", inline="always")
def gravity_parts(s2, alt, w, curvature, a, e2, gamma, k, f, m):
    """Normal gravity and its changes as numbers that know of no direction.

    `s2` is the squared sine of the latitude, `w` the prime vertical's radius over a, `curvature`
    that of the meridian at the height. With sine s and the horizontal part k of the Earth's axis,
    whose length is the cosine, gravity is ``-s slope alt k`` and ``down``. With a change n of the
    normal and one of the height it changes by ``-slope (alt (k (k . n) - s² n) + s k d(alt))`` and
    ``s steep (k . n) + loss d(alt)``. Returns slope, down, steep, loss and half the second
    derivative of down with height.

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

    What is left out are terms of ``f² x²``; in the derivatives, those that are a part in 1e3 of
    them.
    """
    w2 = 1.0 - e2 * s2
    inverse_a = 1.0 / a
    numerator = 1.0 + k * s2
    equator = gamma * w
    surface = equator * numerator
    steep = equator * (2.0 * k + e2 * numerator * w * w)
    x = alt * inverse_a
    first = w2 * w * (0.5 * (1.0 + w2 * (1.0 / (1.0 - e2))) + m * (1.0 - k * s2))
    form = 0.25 * (2.0 * f - m) * (3.0 * s2 - 1.0)
    spin = 0.5 * m * (1.0 - s2)
    second = form + 6.0 * spin
    third = 4.0 * spin - form
    y = 1.0 / (1.0 + x * (first + x * (second + x * third)))
    down = surface * y * y
    shrink = y * inverse_a * (first + x * (2.0 * second + 3.0 * x * third))
    loss = -down * shrink
    bend = surface * (6.0 * f - 5.0 * m) * x
    slope = (steep + bend * (1.0 - 2.0 * x)) * curvature
    return slope, down, steep + bend * (2.0 - 6.0 * x), 2.0 * loss, -3.0 * loss * shrink


@njit(cache=True, error_model="numpy", inline="always")
def gravity_around(s, c, alt, w, curvature, a, e2, gamma, k, f, m):
    """Normal gravity at a place and how it changes around it, north and down: `gravity_parts`.

    Returns the north and down components in m/s²; the change of each with latitude and with
    height; and half the second derivative of the down component with height.
    """
    s2 = s * s
    slope, down, steep, loss, bend = gravity_parts(s2, alt, w, curvature, a, e2, gamma, k, f, m)
    sc = s * c
    return (
        # From zero, so that on the surface there is no zero with a minus.
        0.0 - sc * slope * alt,
        down,
        -(c * c - s2) * slope * alt,
        -sc * slope,
        sc * steep,
        loss,
        bend,
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

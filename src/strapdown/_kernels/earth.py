"""Ellipsoidal Earth: radii, normal gravity, rates, coordinates, and true sensor inputs.

An ellipsoid is a float64 array with the indices below. ``s`` and ``c`` are sine and cosine of the
geodetic latitude; vectors are north, east, down; angles in rad, lengths in m.
"""

from __future__ import annotations

import math

import numpy as np

from strapdown._kernels.compilation import njit
from strapdown._kernels.rotation import dcm_from_quat

# Indices of the array of an ellipsoid: semi-major axis in m, first eccentricity squared, normal
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

    Neglected: terms of ``f² x²``; in the derivatives, a thousandth of the terms that are
    kept.
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
    """Normal gravity at a position and its gradient, north and down: `gravity_parts`.

    Returns the north and down components in m/s²; the change of each with latitude and with
    height; and half the second derivative of the down component with height.
    """
    s2 = s * s
    slope, down, steep, loss, bend = gravity_parts(s2, alt, w, curvature, a, e2, gamma, k, f, m)
    sc = s * c
    return (
        # Added to zero, to avoid a negative zero on the surface.
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


# Geodetic and Earth-centered coordinates; ``a`` is the semi-major axis and ``e2`` the first
# eccentricity squared of the ellipsoid.


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
    """Straight line to a position from another, in north-east-down at the former; to 1e-9 m."""
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


# True inputs of sensors on a vehicle. Position rows: latitude and longitude in rad, height in m.


@njit(cache=True)
def place_rates(place, velocity, p, out):
    """Fill the rates of latitude, longitude and height, (n, 3), for given velocities."""
    for i in range(place.shape[0]):
        s, c = math.sin(place[i, 0]), math.cos(place[i, 0])
        meridian, transverse = radii(s, p[A], p[E2])
        out[i, 0] = velocity[i, 0] / (meridian + place[i, 2])
        out[i, 1] = velocity[i, 1] / ((transverse + place[i, 2]) * c)
        out[i, 2] = -velocity[i, 2]


@njit(cache=True)
def velocities(place, first, second, p, velocity, acceleration):
    """Fill velocity and its time derivative from the derivatives of the position, (n, 3) each.

    The radii change with latitude: ``dR_N/dlat = e2 s c R_N^3/a^2`` and
    ``dR_M/dlat = 3 e2 s c R_M R_N^2/a^2``.
    """
    for i in range(place.shape[0]):
        s, c = math.sin(place[i, 0]), math.cos(place[i, 0])
        d_lat, d_lon, d_alt = first[i, 0], first[i, 1], first[i, 2]
        meridian, transverse = radii(s, p[A], p[E2])
        slope = p[E2] * s * c * (transverse / p[A]) * (transverse / p[A]) * d_lat
        d_meridian = 3.0 * meridian * slope + d_alt
        d_transverse = transverse * slope + d_alt
        meridian += place[i, 2]
        transverse += place[i, 2]
        velocity[i, 0] = meridian * d_lat
        velocity[i, 1] = transverse * c * d_lon
        velocity[i, 2] = -d_alt
        acceleration[i, 0] = d_meridian * d_lat + meridian * second[i, 0]
        acceleration[i, 1] = (
            d_transverse * c - transverse * s * d_lat
        ) * d_lon + transverse * c * second[i, 1]
        acceleration[i, 2] = -second[i, 2]


@njit(cache=True)
def feel(place, velocity, acceleration, q_nb, turning, p, rate, force):
    """Fill what gyros and accelerometers read in body axes, (n, 3) each.

    `acceleration` is the derivative of the velocity's components, `turning` the rate of the body
    relative to local level in body axes. ``f_n = v' + (2 w_ie + w_en) x v - g_n`` and
    ``w_ib = w_nb + C_nb^T (w_ie + w_en)``.
    """
    for i in range(place.shape[0]):
        alt = place[i, 2]
        s, c = math.sin(place[i, 0]), math.cos(place[i, 0])
        v_n, v_e, v_d = velocity[i, 0], velocity[i, 1], velocity[i, 2]
        meridian, transverse = radii(s, p[A], p[E2])
        g_n, g_d = gravity(s, c, alt, p[A], p[E2], p[GAMMA], p[K], p[F], p[M])
        earth_n, earth_d = earth_rate(s, c, p[RATE])
        move_n, move_e, move_d = transport_rate(s, c, v_n, v_e, meridian + alt, transverse + alt)
        x, y, z = 2.0 * earth_n + move_n, move_e, 2.0 * earth_d + move_d
        f_n = acceleration[i, 0] + (y * v_d - z * v_e) - g_n
        f_e = acceleration[i, 1] + (z * v_n - x * v_d)
        f_d = acceleration[i, 2] + (x * v_e - y * v_n) - g_d
        w_n, w_e, w_d = earth_n + move_n, move_e, earth_d + move_d
        m = dcm_from_quat(q_nb[i, 0], q_nb[i, 1], q_nb[i, 2], q_nb[i, 3])
        for j in range(3):
            force[i, j] = m[j] * f_n + m[3 + j] * f_e + m[6 + j] * f_d
            rate[i, j] = turning[i, j] + (m[j] * w_n + m[3 + j] * w_e + m[6 + j] * w_d)


@njit(cache=True)
def swing(place, velocity, acceleration, q_nb, turning, swinging, p, out):
    """Fill the derivative of the body rate relative to inertial space, in body axes, (n, 3).

    `swinging` is the derivative of the components of `turning`; the rest as in `feel`. With
    ``w_in = w_ie + w_en``, ``w_ib' = w_nb' + C_nb^T w_in' - w_nb x (C_nb^T w_in)``, where w_in'
    are the derivatives of the components north, east, down, and the radii change as in
    `velocities`.
    """
    for i in range(place.shape[0]):
        alt, d_alt = place[i, 2], -velocity[i, 2]
        s, c = math.sin(place[i, 0]), math.cos(place[i, 0])
        meridian, transverse = radii(s, p[A], p[E2])
        d_lat = velocity[i, 0] / (meridian + alt)
        slope = p[E2] * s * c * (transverse / p[A]) * (transverse / p[A]) * d_lat
        d_meridian = 3.0 * meridian * slope + d_alt
        d_transverse = transverse * slope + d_alt
        meridian += alt
        transverse += alt
        earth_n, earth_d = earth_rate(s, c, p[RATE])
        move_n, move_e, move_d = transport_rate(
            s, c, velocity[i, 0], velocity[i, 1], meridian, transverse
        )
        d_move_n = (acceleration[i, 1] - move_n * d_transverse) / transverse
        d_n = earth_d * d_lat + d_move_n
        d_e = -(acceleration[i, 0] + move_e * d_meridian) / meridian
        d_d = -earth_n * d_lat - d_move_n * s / c - move_n * d_lat / (c * c)
        w_n, w_e, w_d = earth_n + move_n, move_e, earth_d + move_d
        m = dcm_from_quat(q_nb[i, 0], q_nb[i, 1], q_nb[i, 2], q_nb[i, 3])
        x = m[0] * w_n + m[3] * w_e + m[6] * w_d
        y = m[1] * w_n + m[4] * w_e + m[7] * w_d
        z = m[2] * w_n + m[5] * w_e + m[8] * w_d
        t_x, t_y, t_z = turning[i, 0], turning[i, 1], turning[i, 2]
        out[i, 0] = swinging[i, 0] + (m[0] * d_n + m[3] * d_e + m[6] * d_d) - (t_y * z - t_z * y)
        out[i, 1] = swinging[i, 1] + (m[1] * d_n + m[4] * d_e + m[7] * d_d) - (t_z * x - t_x * z)
        out[i, 2] = swinging[i, 2] + (m[2] * d_n + m[5] * d_e + m[8] * d_d) - (t_x * y - t_y * x)

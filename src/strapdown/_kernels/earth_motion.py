"""What sensors on a vehicle feel on an ellipsoidal Earth that turns.

Rows: latitude and longitude in rad and height in m; vectors north, east, down; an ellipsoid as in
`earth`.
"""

from __future__ import annotations

import math

from numba import njit

from strapdown._kernels.earth import (
    E2,
    GAMMA,
    RATE,
    A,
    F,
    K,
    M,
    earth_rate,
    gravity,
    radii,
    transport_rate,
)
from strapdown._kernels.rotation import dcm_from_quat


@njit(cache=True)
def place_rates(place, velocity, p, out):
    """Fill the rates of latitude, longitude and height, (n, 3), of a velocity."""
    for i in range(place.shape[0]):
        s, c = math.sin(place[i, 0]), math.cos(place[i, 0])
        meridian, transverse = radii(s, p[A], p[E2])
        out[i, 0] = velocity[i, 0] / (meridian + place[i, 2])
        out[i, 1] = velocity[i, 1] / ((transverse + place[i, 2]) * c)
        out[i, 2] = -velocity[i, 2]


@njit(cache=True)
def velocities(place, first, second, p, velocity, acceleration):
    """Fill velocity and its derivative by time from the derivatives of the place, (n, 3) each.

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

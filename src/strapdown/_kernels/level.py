"""Level rows: the state of any mechanization as a filter needs it, and its corrections.

Level axes l are those of a mechanization's velocity: north-east-down, or the axes of a wander
azimuth (up is then +z). A row holds the quaternion body to level, the velocity relative to the
Earth in level axes, the unit vector of the Earth's axis (towards the north pole) in level axes, the
height, and the rate of the level relative to the Earth in level axes.
"""

from __future__ import annotations

import math

import numpy as np

from strapdown._kernels.compilation import IN_PLACE, njit
from strapdown._kernels.earth import E2, A, displacement, ned_from_ecef, radii, transport_rate
from strapdown._kernels.ned import ALT as NED_ALT
from strapdown._kernels.ned import LAT, LON, Q, V, displace, level_turn, turn_back
from strapdown._kernels.rotation import (
    DEGREES,
    euler_degrees_from_quat,
    quat_from_rotvec,
    quat_multiply,
    quat_normalise,
    rotvec_from_quat,
    wrap_pi,
)
from strapdown._kernels.wander import ALT as WANDER_ALT
from strapdown._kernels.wander import (
    LOW_EW,
    LOW_IB,
    PRIME,
    Q_EW,
    Q_IB,
    Q_WB,
    SPIN,
    STATE,
    curving,
    earth_axis,
    level_with,
    put,
    shift,
    tilt,
)
from strapdown._kernels.wander import V as V_W

Q_LB, V_L, AXIS, ALT, OMEGA_EL = 0, 4, 7, 10, 11
LEVEL = 14


@njit(cache=True, error_model="numpy", inline="always")
def curvatures(sine, alt, a, e2):
    """Curvature of the level surface across the meridian, and the excess along the meridian.

    The normal turns by ``across r + along k (k . r)`` over a horizontal displacement r, where k is
    the horizontal part of the Earth's axis (cos lat long): regular at the poles.
    """
    w2 = 1.0 / (1.0 - e2 * sine * sine)
    prime = a * math.sqrt(w2)
    meridian = prime * (1.0 - e2) * w2
    across = 1.0 / (prime + alt)
    return across, e2 * prime * w2 * across / (meridian + alt)


# North-east-down.


@njit(**IN_PLACE)
def ned_levels(history, earth, out):
    """Fill level rows from rows of a history."""
    for i in range(history.shape[0]):
        s, c = math.sin(history[i, LAT]), math.cos(history[i, LAT])
        alt = history[i, NED_ALT]
        meridian, transverse = radii(s, earth[A], earth[E2])
        vn, ve, vd = history[i, V], history[i, V + 1], history[i, V + 2]
        for j in range(4):
            out[i, Q_LB + j] = history[i, Q + j]
        out[i, V_L], out[i, V_L + 1], out[i, V_L + 2] = vn, ve, vd
        out[i, AXIS], out[i, AXIS + 1], out[i, AXIS + 2] = c, 0.0, -s
        out[i, ALT] = alt
        out[i, OMEGA_EL], out[i, OMEGA_EL + 1], out[i, OMEGA_EL + 2] = transport_rate(
            s, c, vn, ve, meridian + alt, transverse + alt
        )


@njit(**IN_PLACE)
def ned_correct(row, error, earth):
    """Remove an error from position, velocity and attitude of a row of a history, in place.

    `error`, computed - true in level axes of the row: position in m; velocity as a vector in m/s;
    and the rotation vector ``psi`` of the attitude relative to the Earth, ``C_row = exp([psi x])
    C_true``, in rad.
    """
    a, e2 = earth[A], earth[E2]
    s, c, alt = math.sin(row[LAT]), math.cos(row[LAT]), row[NED_ALT]
    meridian, transverse = radii(s, a, e2)
    curvature = 1.0 / (meridian + alt)
    parallel = 1.0 / ((transverse + alt) * c)
    change = 1.5 * e2 * s * c * meridian * curvature / (1.0 - e2 * s * s)
    dlat, dlon, dalt = displace(s, c, curvature, parallel, change, -error[0], -error[1], -error[2])
    fw, fx, fy, fz, _, _ = level_turn(s, c, dlat, dlon)
    vn, ve, vd = turn_back(
        fw, fx, fy, fz, row[V] - error[3], row[V + 1] - error[4], row[V + 2] - error[5]
    )
    bw, bx, by, bz = quat_from_rotvec(-error[6], -error[7], -error[8])
    bw, bx, by, bz = quat_multiply(bw, bx, by, bz, row[Q], row[Q + 1], row[Q + 2], row[Q + 3])
    bw, bx, by, bz = quat_multiply(fw, -fx, -fy, -fz, bw, bx, by, bz)
    bw, bx, by, bz = quat_normalise(bw, bx, by, bz)
    row[LAT], row[LON], row[NED_ALT] = row[LAT] + dlat, row[LON] + dlon, alt + dalt
    row[V], row[V + 1], row[V + 2] = vn, ve, vd
    row[Q], row[Q + 1], row[Q + 2], row[Q + 3] = bw, bx, by, bz


@njit(**IN_PLACE)
def ned_correct_rows(rows, errors, earth):
    """Remove an error from each row, in place."""
    for i in range(rows.shape[0]):
        ned_correct(rows[i], errors[i], earth)


@njit(cache=True, error_model="numpy")
def state_error(row, true, earth, out):
    """Fill the error of a row of a history from a true one, (9,), as `ned_correct` removes it.

    `row`, `true`, of both the first ten numbers: latitude, longitude, height, velocity and
    quaternion.
    """
    out[0], out[1], out[2] = displacement(
        row[LAT],
        row[LON],
        row[NED_ALT],
        true[LAT],
        true[LON],
        true[NED_ALT],
        earth[A],
        earth[E2],
    )
    aw, ax, ay, az = ned_from_ecef(row[LAT], row[LON])
    bw, bx, by, bz = ned_from_ecef(true[LAT], true[LON])
    # From the true local level to that of the row.
    fw, fx, fy, fz = quat_multiply(aw, ax, ay, az, bw, -bx, -by, -bz)
    vn, ve, vd = turn_back(fw, -fx, -fy, -fz, true[V], true[V + 1], true[V + 2])
    out[3], out[4], out[5] = row[V] - vn, row[V + 1] - ve, row[V + 2] - vd
    tw, tx, ty, tz = quat_multiply(fw, fx, fy, fz, true[Q], true[Q + 1], true[Q + 2], true[Q + 3])
    dw, dx, dy, dz = quat_multiply(row[Q], row[Q + 1], row[Q + 2], row[Q + 3], tw, -tx, -ty, -tz)
    dw, dx, dy, dz = quat_normalise(dw, dx, dy, dz)
    out[6], out[7], out[8] = rotvec_from_quat(dw, dx, dy, dz)


# Wander azimuth, and its conversion from and to north-east-down.


# Closer to a pole than this, in rad, a quaternion does not determine the longitude.
AT_POLE = 4e-16
ROOT = math.sqrt(0.5)


@njit(cache=True)
def wander_from_geodetic(lat, lon, angle):
    """Quaternion q_ew of a position and a wander angle, in rad.

    The product of rotations about the Earth's axis, by the colatitude, and about zeta.
    """
    half = 0.25 * math.pi - 0.5 * lat
    # As a sine it is zero at the south pole, which a cosine of a rounded right angle is not.
    near, far = math.sin(0.25 * math.pi + 0.5 * lat), math.sin(half)
    one = 0.5 * (lon + angle) + 0.25 * math.pi
    two = 0.5 * (lon - angle) + 0.25 * math.pi
    return near * math.cos(one), far * math.cos(two), far * math.sin(two), near * math.sin(one)


@njit(cache=True)
def geodetic_from_wander(w, x, y, z):
    """Latitude, longitude and wander angle, in rad.

    At a pole, to rounding, only their sum (north) or difference (south) is defined: the wander
    angle is then set to zero.
    """
    near, far = math.hypot(w, z), math.hypot(x, y)
    lat = math.atan2((near - far) * (near + far), 2.0 * near * far)
    one, two = math.atan2(z, w), math.atan2(y, x)
    if far < 0.5 * AT_POLE:
        two = one
    elif near < 0.5 * AT_POLE:
        one = two
    return lat, wrap_pi(one + two - 0.5 * math.pi), wrap_pi(one - two)


@njit(cache=True)
def level_from_north(angle, vx, vy, vz, w, x, y, z):
    """Velocity and quaternion of xi, eta, zeta from those of north, east, down, or back.

    East turned by the angle anticlockwise is xi: ``V_E = V_xi cos A - V_eta sin A`` and
    ``V_N = V_xi sin A + V_eta cos A``, whose plus is a minus in print. As a rotation it is half a
    turn about the line between xi and north, which is its own inverse.
    """
    c, s = math.cos(angle), math.sin(angle)
    half = 0.5 * angle
    # Halfway between north and xi.
    p = ROOT * (math.cos(half) + math.sin(half))
    q = ROOT * (math.cos(half) - math.sin(half))
    w, x, y, z = quat_multiply(0.0, p, q, 0.0, w, x, y, z)
    return vx * s + vy * c, vx * c - vy * s, -vz, w, x, y, z


@njit(cache=True)
def wander_places(history, out):
    """Latitude, longitude, height, velocity and quaternion north-east-down of rows, (n, 10)."""
    for i in range(history.shape[0]):
        lat, lon, angle = geodetic_from_wander(
            history[i, 0], history[i, 1], history[i, 2], history[i, 3]
        )
        out[i, 0], out[i, 1], out[i, 2] = lat, lon, history[i, WANDER_ALT]
        put(
            out[i],
            3,
            level_from_north(
                angle,
                history[i, V_W],
                history[i, V_W + 1],
                history[i, V_W + 2],
                # Half a turn and half a turn is a turn, of which the quaternion is -1.
                -history[i, Q_WB],
                -history[i, Q_WB + 1],
                -history[i, Q_WB + 2],
                -history[i, Q_WB + 3],
            ),
        )


@njit(cache=True)
def wander_trajectory(history, out):
    """Rows of a Trajectory table, as `ned.trajectory_rows`."""
    places = np.empty((history.shape[0], 10))
    wander_places(history, places)
    for i in range(history.shape[0]):
        out[i, 0], out[i, 1] = places[i, 0] * DEGREES, places[i, 1] * DEGREES
        for j in range(2, 6):
            out[i, j] = places[i, j]
        out[i, 6], out[i, 7], out[i, 8] = euler_degrees_from_quat(
            places[i, 6], places[i, 7], places[i, 8], places[i, 9]
        )


@njit(cache=True)
def inertial_from_body(history, half_angles, out):
    """Quaternions q_ib of rows of a history, from halves of the Earth's angle in rad."""
    for i in range(history.shape[0]):
        c, s = math.cos(half_angles[i]), math.sin(half_angles[i])
        put(out[i], 0, _inertial(history[i], c, s))


@njit(cache=True)
def _inertial(row, c, s):
    w, x, y, z = quat_multiply(
        row[Q_EW],
        row[Q_EW + 1],
        row[Q_EW + 2],
        row[Q_EW + 3],
        row[Q_WB],
        row[Q_WB + 1],
        row[Q_WB + 2],
        row[Q_WB + 3],
    )
    return c * w - s * z, c * x - s * y, c * y + s * x, c * z + s * w


@njit(cache=True, error_model="numpy")
def wander_levels(history, earth, out):
    """Fill level rows from rows of a history."""
    for i in range(history.shape[0]):
        px, py, pz = earth_axis(history[i, 0], history[i, 1], history[i, 2], history[i, 3])
        vx, vy, vz = (
            history[i, V_W],
            history[i, V_W + 1],
            history[i, V_W + 2],
        )
        across, along = curvatures(pz, history[i, WANDER_ALT], earth[A], earth[E2])
        toward = along * (px * vx + py * vy)
        for j in range(4):
            out[i, Q_LB + j] = history[i, Q_WB + j]
        out[i, V_L], out[i, V_L + 1], out[i, V_L + 2] = vx, vy, vz
        out[i, AXIS], out[i, AXIS + 1], out[i, AXIS + 2] = px, py, pz
        out[i, ALT] = history[i, WANDER_ALT]
        out[i, OMEGA_EL] = -(across * vy + toward * py)
        out[i, OMEGA_EL + 1] = across * vx + toward * px
        out[i, OMEGA_EL + 2] = 0.0


@njit(cache=True, error_model="numpy")
def wander_correct(state, error, earth):
    """Remove an error from a state, in place; `error` as in `ned_correct`."""
    a, e2 = earth[A], earth[E2]
    w, x, y, z = state[0], state[1], state[2], state[3]
    px, py, pz = earth_axis(w, x, y, z)
    over = 1.0 / math.sqrt(1.0 - e2 * pz * pz)
    far, slope, across, curvature = curving(over, state[WANDER_ALT], a, e2)
    tx, ty, t2, up = shift(
        px,
        py,
        pz,
        over,
        far,
        slope,
        across,
        curvature,
        e2,
        -error[0],
        -error[1],
        -error[2],
    )
    fd, fx, fy = tilt(tx, ty, t2)
    fw = 1.0 + fd
    put(state, Q_EW, quat_normalise(*quat_multiply(w, x, y, z, fw, fx, fy, 0.0)))
    state[WANDER_ALT] += up
    vx, vy, vz = (
        state[V_W] - error[3],
        state[V_W + 1] - error[4],
        state[V_W + 2] - error[5],
    )
    put(state, V_W, level_with(tx, ty, t2, vx, vy, vz))
    bw, bx, by, bz = quat_from_rotvec(-error[6], -error[7], -error[8])
    bw, bx, by, bz = quat_multiply(
        bw, bx, by, bz, state[Q_WB], state[Q_WB + 1], state[Q_WB + 2], state[Q_WB + 3]
    )
    bw, bx, by, bz = quat_multiply(fw, -fx, -fy, 0.0, bw, bx, by, bz)
    put(state, Q_WB, quat_normalise(bw, bx, by, bz))
    put(state, Q_IB, _inertial(state, state[SPIN], state[SPIN + 1]))
    put(state, LOW_EW, (0.0, 0.0, 0.0, 0.0))
    put(state, LOW_IB, (0.0, 0.0, 0.0, 0.0))
    sine = earth_axis(state[0], state[1], state[2], state[3])[2]
    state[PRIME] = 1.0 / math.sqrt(1.0 - e2 * sine * sine)


@njit(cache=True, error_model="numpy")
def wander_correct_rows(rows, errors, earth):
    """Remove an error from each row of a history, in place."""
    state = np.zeros(STATE)
    # The Earth's turn since the start, which only the kernel's memory needs.
    state[SPIN] = 1.0
    for i in range(rows.shape[0]):
        for j in range(rows.shape[1]):
            state[j] = rows[i, j]
        wander_correct(state, errors[i], earth)
        for j in range(rows.shape[1]):
            rows[i, j] = state[j]


# Position and level axes of the state of either mechanization.


# Mechanizations.
NED, WANDER = 0, 1


@njit(cache=True, error_model="numpy")
def level_place(which, state, turn):
    """Latitude, longitude and height; fills C_nl, level to north-east-down, (3, 3)."""
    for i in range(3):
        for j in range(3):
            turn[i, j] = 0.0
    if which == WANDER:
        lat, lon, angle = geodetic_from_wander(state[0], state[1], state[2], state[3])
        s, c = math.sin(angle), math.cos(angle)
        turn[0, 0], turn[0, 1], turn[1, 0], turn[1, 1], turn[2, 2] = s, c, c, -s, -1.0
        return lat, lon, state[WANDER_ALT]
    turn[0, 0] = turn[1, 1] = turn[2, 2] = 1.0
    return state[LAT], state[LON], state[NED_ALT]

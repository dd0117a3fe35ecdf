"""A wander azimuth from north-east-down and back, and as a filter sees it."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from strapdown._kernels.earth import E2, A
from strapdown._kernels.level import ALT as LEVEL_ALT
from strapdown._kernels.level import AXIS, OMEGA_EL, Q_LB, V_L, curvatures
from strapdown._kernels.rotation import (
    DEGREES,
    euler_degrees_from_quat,
    quat_from_rotvec,
    quat_multiply,
    quat_normalise,
    wrap_pi,
)
from strapdown._kernels.wander import (
    ALT,
    LOW_EW,
    LOW_IB,
    PRIME,
    Q_EW,
    Q_IB,
    Q_WB,
    SPIN,
    STATE,
    V,
    put,
)
from strapdown._kernels.wander_geometry import curving, earth_axis, level_with, shift, tilt

# Nearer to a pole than this, in rad, a quaternion does not know the longitude.
AT_POLE = 4e-16
ROOT = math.sqrt(0.5)


@njit(cache=True)
def wander_from_geodetic(lat, lon, angle):
    """Quaternion q_ew of a place and a wander angle, in rad.

    A turn about the Earth's axis, one by the colatitude, and one about zeta, multiplied out.
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

    At a pole, to rounding, only their sum (north) or difference (south) is known: the wander angle
    is taken to be zero.
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
        out[i, 0], out[i, 1], out[i, 2] = lat, lon, history[i, ALT]
        put(
            out[i],
            3,
            level_from_north(
                angle,
                history[i, V],
                history[i, V + 1],
                history[i, V + 2],
                # Half a turn and half a turn is a turn, of which the quaternion is -1.
                -history[i, Q_WB],
                -history[i, Q_WB + 1],
                -history[i, Q_WB + 2],
                -history[i, Q_WB + 3],
            ),
        )


@njit(cache=True)
def wander_trajectory(history, out):
    """Rows of a Trajectory table: `trajectory.trajectory_rows`."""
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
        vx, vy, vz = history[i, V], history[i, V + 1], history[i, V + 2]
        across, along = curvatures(pz, history[i, ALT], earth[A], earth[E2])
        toward = along * (px * vx + py * vy)
        for j in range(4):
            out[i, Q_LB + j] = history[i, Q_WB + j]
        out[i, V_L], out[i, V_L + 1], out[i, V_L + 2] = vx, vy, vz
        out[i, AXIS], out[i, AXIS + 1], out[i, AXIS + 2] = px, py, pz
        out[i, LEVEL_ALT] = history[i, ALT]
        out[i, OMEGA_EL] = -(across * vy + toward * py)
        out[i, OMEGA_EL + 1] = across * vx + toward * px
        out[i, OMEGA_EL + 2] = 0.0


@njit(cache=True, error_model="numpy")
def wander_correct(state, error, earth):
    """Take an error off a state, in place; `error` as in `ned_level.ned_correct`."""
    a, e2 = earth[A], earth[E2]
    w, x, y, z = state[0], state[1], state[2], state[3]
    px, py, pz = earth_axis(w, x, y, z)
    over = 1.0 / math.sqrt(1.0 - e2 * pz * pz)
    far, slope, across, curvature = curving(over, state[ALT], a, e2)
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
    state[ALT] += up
    vx, vy, vz = state[V] - error[3], state[V + 1] - error[4], state[V + 2] - error[5]
    put(state, V, level_with(tx, ty, t2, vx, vy, vz))
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
    """Take an error off each row of a history, in place."""
    state = np.zeros(STATE)
    # Of the Earth's turn since the start, which only the memory of the kernel needs.
    state[SPIN] = 1.0
    for i in range(rows.shape[0]):
        state[: rows.shape[1]] = rows[i]
        wander_correct(state, errors[i], earth)
        rows[i] = state[: rows.shape[1]]

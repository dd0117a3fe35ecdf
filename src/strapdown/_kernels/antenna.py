"""Position, velocity and acceleration of an antenna, and their sensitivity to a filter's errors.

With the arm r in level axes, ``W = C_lb w_ib - w_ie`` the rate of the body relative to the Earth,
and f the specific force, relative to the Earth

    position     p + r
    velocity     v + W x r
    acceleration f + g - 2 w_ie x v + W x (W x r)

Gravity g includes the centrifugal part. The angular acceleration term, ``W' x r``, is unknown and
neglected, as is the change of g with position.
"""

from __future__ import annotations

import math

import numpy as np

from strapdown._kernels.compilation import njit
from strapdown._kernels.earth import E2, GAMMA, RATE, A, F, K, M, gravity
from strapdown._kernels.level import ALT, AXIS, Q_LB, V_L
from strapdown._kernels.rotation import dcm_from_quat
from strapdown._kernels.rotation_vector import cross

# What is computed: the position, the velocity too, the acceleration too.
POSITION, VELOCITY, ACCELERATION = 0, 1, 2
# Columns of the errors of velocity, of rotation, and of the sensors.
SPEED, ROTATION, SENSORS = 3, 6, 9


@njit(cache=True, error_model="numpy", inline="always")
def turned(c, x, y, z):
    """Return a vector in level axes: `c` has the rows of C_lb."""
    return (
        c[0] * x + c[1] * y + c[2] * z,
        c[3] * x + c[4] * y + c[5] * z,
        c[6] * x + c[7] * y + c[8] * z,
    )


@njit(cache=True, error_model="numpy")
def antenna(level, up, earth, arm, arm_at, gyro_terms, accel_terms, felt, steady, upto, value, H):
    """Fill values (3, 3) and derivatives (3, 3, p) of position, velocity and acceleration.

    `level`: a level row, whose third axis is `up` times the upward vertical. `arm`: body axes, its
    error in the columns from `arm_at` on, if that is not negative. `felt`, `steady`: rate and
    specific force in body axes, of the velocity and of the acceleration. The value of the position
    is the arm; the others are relative to the Earth; all are filled up to `upto`.
    """
    c = dcm_from_quat(level[Q_LB], level[Q_LB + 1], level[Q_LB + 2], level[Q_LB + 3])
    rx, ry, rz = turned(c, arm[0], arm[1], arm[2])
    columns = H.shape[2]
    for i in range(upto + 1):
        for k in range(3):
            for j in range(columns):
                H[i, k, j] = 0.0
    # Derivatives of the arm, in rows, and of W.
    moves, spins = H[POSITION], np.zeros((3, columns))
    add_turn(1.0, rx, ry, rz, ROTATION, moves)
    if arm_at >= 0:
        for j in range(3):
            for k in range(3):
                moves[k, arm_at + j] = c[3 * k + j]
    value[POSITION, 0], value[POSITION, 1], value[POSITION, 2] = rx, ry, rz
    if upto >= VELOCITY:
        sx, sy = earth[RATE] * level[AXIS], earth[RATE] * level[AXIS + 1]
        sz = earth[RATE] * level[AXIS + 2]
        ix, iy, iz = turned(c, felt[0], felt[1], felt[2])
        wx, wy, wz = ix - sx, iy - sy, iz - sz
        # The attitude turns what the gyros measure.
        add_turn(1.0, ix, iy, iz, ROTATION, spins)
        add_errors(gyro_terms, felt, c, spins)
        vx, vy, vz = level[V_L], level[V_L + 1], level[V_L + 2]
        qx, qy, qz = swept(wx, wy, wz, rx, ry, rz, moves, spins, H[VELOCITY])
        value[VELOCITY, 0], value[VELOCITY, 1], value[VELOCITY, 2] = vx + qx, vy + qy, vz + qz
        if upto >= ACCELERATION:
            fx, fy, fz = turned(c, steady[3], steady[4], steady[5])
            ix, iy, iz = turned(c, steady[0], steady[1], steady[2])
            wx, wy, wz = ix - sx, iy - sy, iz - sz
            gx, gy, gz = level_gravity(level, up, earth)
            kx, ky, kz = cross(sx, sy, sz, vx, vy, vz)
            once = np.zeros((3, columns))
            qx, qy, qz = swept(wx, wy, wz, rx, ry, rz, moves, spins, once)
            ax, ay, az = swept(wx, wy, wz, qx, qy, qz, once, spins, H[ACCELERATION])
            value[ACCELERATION, 0] = fx + gx - 2.0 * kx + ax
            value[ACCELERATION, 1] = fy + gy - 2.0 * ky + ay
            value[ACCELERATION, 2] = fz + gz - 2.0 * kz + az
            add_turn(1.0, fx, fy, fz, ROTATION, H[ACCELERATION])
            add_turn(2.0, sx, sy, sz, SPEED, H[ACCELERATION])
            add_errors(accel_terms, felt, c, H[ACCELERATION])
        for k in range(3):
            H[VELOCITY, k, SPEED + k] += 1.0
    for k in range(3):
        H[POSITION, k, k] += 1.0


@njit(cache=True, error_model="numpy", inline="always")
def add_turn(factor, x, y, z, at, out):
    """Add ``factor (e_j x v)`` of a vector v to the columns from `at` on: e_j is the j-th axis."""
    for j in range(3):
        ex, ey, ez = 1.0 * (j == 0), 1.0 * (j == 1), 1.0 * (j == 2)
        tx, ty, tz = cross(ex, ey, ez, x, y, z)
        out[0, at + j] += factor * tx
        out[1, at + j] += factor * ty
        out[2, at + j] += factor * tz


@njit(cache=True, error_model="numpy", inline="always")
def add_errors(terms, felt, c, out):
    """Add the errors of a triad in level axes, by its terms at a rate and a force."""
    for e in range(terms.shape[0]):
        m, axis, j = int(terms[e, 0]), int(terms[e, 1]), SENSORS + int(terms[e, 2])
        weight = terms[e, 3] if m == 0 else terms[e, 3] * felt[m - 1]
        for k in range(3):
            out[k, j] += weight * c[3 * k + axis]


@njit(cache=True, error_model="numpy", inline="always")
def swept(wx, wy, wz, rx, ry, rz, moves, spins, out):
    """Return ``W x r``, and fill its derivative, (3, p), by those of r and W."""
    for j in range(out.shape[1]):
        ax, ay, az = cross(wx, wy, wz, moves[0, j], moves[1, j], moves[2, j])
        bx, by, bz = cross(spins[0, j], spins[1, j], spins[2, j], rx, ry, rz)
        out[0, j], out[1, j], out[2, j] = ax + bx, ay + by, az + bz
    return cross(wx, wy, wz, rx, ry, rz)


@njit(cache=True, error_model="numpy", inline="always")
def level_gravity(level, up, earth):
    """Return gravity in level axes at a level row, m/s²."""
    s, c = up * level[AXIS + 2], math.hypot(level[AXIS], level[AXIS + 1])
    north, down = gravity(
        s, c, level[ALT], earth[A], earth[E2], earth[GAMMA], earth[K], earth[F], earth[M]
    )
    # North is where the Earth's axis points; at a pole there is no horizontal gravity.
    share = north / c if c > 0.0 else 0.0
    return share * level[AXIS], share * level[AXIS + 1], -up * down

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
    for j in range(3):
        ex, ey, ez = 1.0 * (j == 0), 1.0 * (j == 1), 1.0 * (j == 2)
        moves[0, 6 + j], moves[1, 6 + j], moves[2, 6 + j] = cross(ex, ey, ez, rx, ry, rz)
        if arm_at >= 0:
            for k in range(3):
                moves[k, arm_at + j] = c[3 * k + j]
    value[POSITION, 0], value[POSITION, 1], value[POSITION, 2] = rx, ry, rz
    if upto >= VELOCITY:
        sx, sy = earth[RATE] * level[AXIS], earth[RATE] * level[AXIS + 1]
        sz = earth[RATE] * level[AXIS + 2]
        ix, iy, iz = turned(c, felt[0], felt[1], felt[2])
        wx, wy, wz = ix - sx, iy - sy, iz - sz
        for j in range(3):
            ex, ey, ez = 1.0 * (j == 0), 1.0 * (j == 1), 1.0 * (j == 2)
            # The attitude turns what the gyros measure.
            spins[0, 6 + j], spins[1, 6 + j], spins[2, 6 + j] = cross(ex, ey, ez, ix, iy, iz)
        for e in range(gyro_terms.shape[0]):
            m, axis, j = int(gyro_terms[e, 0]), int(gyro_terms[e, 1]), 9 + int(gyro_terms[e, 2])
            weight = gyro_terms[e, 3] if m == 0 else gyro_terms[e, 3] * felt[m - 1]
            for k in range(3):
                spins[k, j] += weight * c[3 * k + axis]
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
            of = H[ACCELERATION]
            for j in range(3):
                ex, ey, ez = 1.0 * (j == 0), 1.0 * (j == 1), 1.0 * (j == 2)
                tx, ty, tz = cross(ex, ey, ez, fx, fy, fz)
                ux, uy, uz = cross(sx, sy, sz, ex, ey, ez)
                of[0, 6 + j], of[0, 3 + j] = of[0, 6 + j] + tx, of[0, 3 + j] - 2.0 * ux
                of[1, 6 + j], of[1, 3 + j] = of[1, 6 + j] + ty, of[1, 3 + j] - 2.0 * uy
                of[2, 6 + j], of[2, 3 + j] = of[2, 6 + j] + tz, of[2, 3 + j] - 2.0 * uz
            for e in range(accel_terms.shape[0]):
                m, axis, j = int(accel_terms[e, 0]), int(accel_terms[e, 1]), int(accel_terms[e, 2])
                weight = accel_terms[e, 3] if m == 0 else accel_terms[e, 3] * felt[m - 1]
                for k in range(3):
                    of[k, 9 + j] += weight * c[3 * k + axis]
        for k in range(3):
            H[VELOCITY, k, 3 + k] += 1.0
    for k in range(3):
        H[POSITION, k, k] += 1.0


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

"""North-east-down as a filter sees it, and errors taken off its state."""

from __future__ import annotations

import math

from numba import njit

from strapdown._kernels.earth import E2, A, radii, transport_rate
from strapdown._kernels.given_arrays import GIVEN
from strapdown._kernels.level import ALT as LEVEL_ALT
from strapdown._kernels.level import AXIS, OMEGA_EL, Q_LB, V_L
from strapdown._kernels.ned import (
    ALT,
    LAT,
    LON,
    Q,
    V,
    displace,
    level_turn,
    turn_back,
)
from strapdown._kernels.rotation import quat_from_rotvec, quat_multiply, quat_normalise


@njit(**GIVEN)
def ned_levels(history, earth, out):
    """Fill level rows from rows of a history."""
    for i in range(history.shape[0]):
        s, c = math.sin(history[i, LAT]), math.cos(history[i, LAT])
        alt = history[i, ALT]
        meridian, transverse = radii(s, earth[A], earth[E2])
        vn, ve, vd = history[i, V], history[i, V + 1], history[i, V + 2]
        for j in range(4):
            out[i, Q_LB + j] = history[i, Q + j]
        out[i, V_L], out[i, V_L + 1], out[i, V_L + 2] = vn, ve, vd
        out[i, AXIS], out[i, AXIS + 1], out[i, AXIS + 2] = c, 0.0, -s
        out[i, LEVEL_ALT] = alt
        out[i, OMEGA_EL], out[i, OMEGA_EL + 1], out[i, OMEGA_EL + 2] = transport_rate(
            s, c, vn, ve, meridian + alt, transverse + alt
        )


@njit(**GIVEN)
def ned_correct(row, error, earth):
    """Take an error off the place, velocity and attitude of a row of a history, in place.

    `error` holds, in level axes of the row, how far its place is from the true one, in m; the
    difference of the velocities as vectors, in m/s; and the rotation vector ``psi`` of the attitude
    relative to the Earth, ``C_row = exp([psi x]) C_true``, in rad.
    """
    a, e2 = earth[A], earth[E2]
    s, c, alt = math.sin(row[LAT]), math.cos(row[LAT]), row[ALT]
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
    row[LAT], row[LON], row[ALT] = row[LAT] + dlat, row[LON] + dlon, alt + dalt
    row[V], row[V + 1], row[V + 2] = vn, ve, vd
    row[Q], row[Q + 1], row[Q + 2], row[Q + 3] = bw, bx, by, bz


@njit(**GIVEN)
def ned_correct_rows(rows, errors, earth):
    """Take an error off each row, in place."""
    for i in range(rows.shape[0]):
        ned_correct(rows[i], errors[i], earth)

"""What the variables of `wander_errors` are of the components of quaternions, and physically."""

from __future__ import annotations

import math

from numba import njit

from strapdown._kernels.earth import E2, A
from strapdown._kernels.growth import CORE
from strapdown._kernels.level import ALT, AXIS, V_L, curvatures
from strapdown._kernels.rotation import quat_multiply
from strapdown._kernels.wander import Q_EW, Q_WB, four, put
from strapdown._kernels.wander_errors import DV, EPS, THETA

#: Places of the states: velocity, components of q_ib, components of q_ew; and of the variables
#: that are nothing physical, after the core: the norms.
VELOCITY, BODY, PLACE, STATES = 0, 3, 7, 11
NORM_BODY, NORM_PLACE = CORE, CORE + 1


@njit(cache=True)
def component_columns(row, turn, out):
    """Fill the states of each variable, (11, 11), at a row of a wander azimuth's history.

    `turn` is the Earth's angle in rad. Columns are orthogonal, of length 1 for velocity and 1/2
    for the others.
    """
    out[:, :] = 0.0
    place, body = four(row, Q_EW), four(row, Q_WB)
    c, s = math.cos(0.5 * turn), math.sin(0.5 * turn)
    w, x, y, z = place
    level = (c * w - s * z, c * x - s * y, c * y + s * x, c * z + s * w)
    for j in range(3):
        out[VELOCITY + j, DV + j] = 1.0
    for j in range(4):
        # 1, i, j, k, halved.
        a = 0.5 if j == 0 else 0.0
        b = 0.5 if j == 1 else 0.0
        d = 0.5 if j == 2 else 0.0
        e = 0.5 if j == 3 else 0.0
        at = NORM_PLACE if j == 0 else THETA + j - 1
        put(out[:, at], PLACE, quat_multiply(w, x, y, z, a, b, d, e))
        f, g, h, k = quat_multiply(level[0], level[1], level[2], level[3], a, b, d, e)
        at = NORM_BODY if j == 0 else EPS + j - 1
        put(out[:, at], BODY, quat_multiply(f, g, h, k, body[0], body[1], body[2], body[3]))


@njit(cache=True)
def invert_columns(columns, out):
    """Fill the inverse of `component_columns`."""
    for i in range(STATES):
        for j in range(STATES):
            out[j, i] = columns[i, j] * (1.0 if i < BODY else 4.0)


@njit(cache=True)
def turn_gauge(level, turn, out):
    """Add to `out` (3,) what a turn of the level axes about zeta adds to velocity's components."""
    out[0] += turn * level[V_L + 1]
    out[1] -= turn * level[V_L]


@njit(cache=True)
def fix_gauge(level, phi):
    """Take the turn of the level axes about zeta out of rows of variables, in place.

    The same errors with other axes of the truth: those without it.
    """
    for j in range(phi.shape[1]):
        turn_gauge(level, -phi[THETA + 2, j], phi[DV : DV + 3, j])
        phi[THETA + 2, j] = 0.0


@njit(cache=True, error_model="numpy")
def physical_of_variables(level, earth, out):
    """Fill the nine physical errors of each variable of the core, (9, 9).

    The normal is off by ``theta x zeta``, which is the tensor of curvature times the displacement;
    velocity as a vector by ``dV + theta x V``; the rotation is eps.
    """
    out[:, :] = 0.0
    kx, ky = level[AXIS], level[AXIS + 1]
    vx, vy, vz = level[V_L], level[V_L + 1], level[V_L + 2]
    across, along = curvatures(level[AXIS + 2], level[ALT], earth[A], earth[E2])
    radius = 1.0 / across
    less = along * radius / (across + along * (kx * kx + ky * ky))
    out[0, THETA + 1], out[0, THETA] = radius - less * kx * kx, less * kx * ky
    out[1, THETA + 1], out[1, THETA] = -less * kx * ky, less * ky * ky - radius
    for j in range(3):
        out[3 + j, DV + j] = out[6 + j, EPS + j] = 1.0
    out[3, THETA + 1], out[3, THETA + 2] = vz, -vy
    out[4, THETA], out[4, THETA + 2] = -vz, vx
    out[5, THETA], out[5, THETA + 1] = vy, -vx


@njit(cache=True, error_model="numpy")
def variables_of_physical(level, earth, held, out):
    """Fill the variables of the core of each physical error, (9, 9).

    Without a turn about zeta; a vertical displacement is lost, and with a height that is held the
    vertical velocity.
    """
    out[:, :] = 0.0
    kx, ky = level[AXIS], level[AXIS + 1]
    vx, vy, vz = level[V_L], level[V_L + 1], level[V_L + 2]
    across, along = curvatures(level[AXIS + 2], level[ALT], earth[A], earth[E2])
    xx, xy, yy = across + along * kx * kx, along * kx * ky, across + along * ky * ky
    out[THETA, 0], out[THETA, 1] = -xy, -yy
    out[THETA + 1, 0], out[THETA + 1, 1] = xx, xy
    for j in range(3):
        out[DV + j, 3 + j] = out[EPS + j, 6 + j] = 1.0
    for j in range(2):
        # V x theta.
        out[DV, j] = -vz * out[THETA + 1, j]
        out[DV + 1, j] = vz * out[THETA, j]
        out[DV + 2, j] = vx * out[THETA + 1, j] - vy * out[THETA, j]
    if held:
        out[DV + 2, :] = 0.0

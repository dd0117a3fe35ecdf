"""Growth of the errors of a wander-azimuth mechanization, by the variation of its equations.

Chernodarov 2009: ``2 q0' = q0 (x) w_ib`` (1), ``2 q1' = q1 (x) w_ew`` (2) and
``V' = C_wb f + g - (2 W + w_ew) x V`` (4), with w_ew of V through the curvature of the level
surface and without a vertical part. Their variation is written in variables that are left of the
errors of the quaternions when the rotation of the axes is taken out, without any approximation:
``dq1 = 1/2 q1 (x) (n1, theta)`` and ``dq0 = 1/2 q_iw (x) (n0, eps) (x) q_wb``. The norms n0 and n1
do not change. theta and eps, in level axes w, are the rotations of the computed level relative to
the Earth and of the computed body relative to inertial space:

    theta' = -w_ew x theta + dw
    dV'    = -(C f) x (eps - theta) + C df + dg - (2 W + w_ew) x dV - (2 dW + dw) x V
    eps'   = -(W + w_ew) x eps + C dw_ib

The level axes have the Earth's axis p (unit vector) where the true ones have p - dp,
``dp = p x theta``; so dW is the Earth's rate along it, dg the slopes of gravity along p, whose
third component is the sine of the latitude, and dw has a part from dV and one from dp. States:
theta (3), dV (3), eps (3), then k states of the sensors. The height has no state.
"""

from __future__ import annotations

import math

from strapdown._kernels.compilation import njit
from strapdown._kernels.earth import E2, GAMMA, RATE, A, F, K, M, gravity_parts, radii
from strapdown._kernels.growth import CORE, compose_growth, growth_of_step, unfold_growth
from strapdown._kernels.level import ALT, AXIS, LEVEL, OMEGA_EL, Q_LB, V_L, curvatures
from strapdown._kernels.psi_model import couple, means_of_steps, minus_cross
from strapdown._kernels.rotation import quat_multiply
from strapdown._kernels.wander import Q_EW, Q_WB, four, put

THETA, DV, EPS = 0, 3, 6


@njit(cache=True, error_model="numpy", inline="always")
def curvature_slopes(sine, alt, a, e2, across, along):
    """Derivatives of the two curvatures of `level.curvatures` by the sine of the latitude."""
    w2 = 1.0 / (1.0 - e2 * sine * sine)
    prime = a * math.sqrt(w2)
    meridian = prime * (1.0 - e2) * w2
    growth = e2 * sine * w2
    return (
        -across * across * prime * growth,
        along * growth * (3.0 - across * prime - 3.0 * meridian / (meridian + alt)),
    )


@njit(cache=True, error_model="numpy")
def add_gravity_slopes(level, earth, by_p):
    """Add the derivatives of gravity, components in w, with respect to the Earth's axis.

    On the ellipsoid gravity is along -zeta; above, it has a part along the horizontal part of the
    axis.
    """
    sine, alt = level[AXIS + 2], level[ALT]
    w = 1.0 / math.sqrt(1.0 - earth[E2] * sine * sine)
    meridian, _ = radii(sine, earth[A], earth[E2])
    slope, _, steep, _, _ = gravity_parts(
        sine * sine,
        alt,
        w,
        1.0 / (meridian + alt),
        earth[A],
        earth[E2],
        earth[GAMMA],
        earth[K],
        earth[F],
        earth[M],
    )
    by_p[0, 0] -= slope * alt * sine
    by_p[1, 1] -= slope * alt * sine
    by_p[0, 2] -= slope * alt * level[AXIS]
    by_p[1, 2] -= slope * alt * level[AXIS + 1]
    by_p[2, 2] -= sine * steep


@njit(cache=True, error_model="numpy")
def turn_of_level(level, earth, by_v, by_p):
    """Fill the derivatives of w_ew by V and by the Earth's axis, each (3, 3).

    ``w_ew = zeta x B V`` with B the tensor of curvature: ``across + along k k'``, k the horizontal
    part of the axis.
    """
    kx, ky, sine = level[AXIS], level[AXIS + 1], level[AXIS + 2]
    vx, vy = level[V_L], level[V_L + 1]
    across, along = curvatures(sine, level[ALT], earth[A], earth[E2])
    across_s, along_s = curvature_slopes(sine, level[ALT], earth[A], earth[E2], across, along)
    north = kx * vx + ky * vy
    by_v[:, :] = 0.0
    by_v[0, 0], by_v[0, 1] = -along * kx * ky, -(across + along * ky * ky)
    by_v[1, 0], by_v[1, 1] = across + along * kx * kx, along * kx * ky
    by_p[:, :] = 0.0
    by_p[0, 0], by_p[0, 1] = -along * ky * vx, -along * (north + ky * vy)
    by_p[1, 0], by_p[1, 1] = along * (north + kx * vx), along * kx * vy
    by_p[0, 2] = -(across_s * vy + along_s * ky * north)
    by_p[1, 2] = across_s * vx + along_s * kx * north


@njit(cache=True, error_model="numpy")
def plus_product(f, row, column, matrix, x, y, z, sign):
    """Add ``sign matrix [(x, y, z) x]`` to the block at (row, column)."""
    for i in range(3):
        a, b, c = matrix[i, 0], matrix[i, 1], matrix[i, 2]
        f[row + i, column] += sign * (b * z - c * y)
        f[row + i, column + 1] += sign * (c * x - a * z)
        f[row + i, column + 2] += sign * (a * y - b * x)


@njit(cache=True, error_model="numpy")
def wander_dynamics(
    f, level, matrix, specific, rate, force, gyro, accel, held, earth, by_v, by_p, turn
):
    """Fill the first nine rows of F, (9, 9 + k); arguments as of `psi_model.psi_dynamics`.

    The last three are work arrays, (3, 3) each. With a held height the vertical velocity is known.
    """
    wx, wy, wz = level[OMEGA_EL], level[OMEGA_EL + 1], level[OMEGA_EL + 2]
    spin = earth[RATE]
    px, py, pz = level[AXIS], level[AXIS + 1], level[AXIS + 2]
    vx, vy, vz = level[V_L], level[V_L + 1], level[V_L + 2]
    turn_of_level(level, earth, by_v, by_p)
    f[:, :] = 0.0
    minus_cross(f, THETA, THETA, wx, wy, wz)
    plus_product(f, THETA, THETA, by_p, px, py, pz, 1.0)
    for i in range(3):
        for j in range(3):
            f[THETA + i, DV + j] = by_v[i, j]
    minus_cross(f, DV, DV, 2.0 * spin * px + wx, 2.0 * spin * py + wy, 2.0 * spin * pz + wz)
    # V x dw, and V x (2 dW + dw) by the axis.
    for j in range(3):
        a, b, c = by_v[0, j], by_v[1, j], by_v[2, j]
        f[DV, DV + j] += vy * c - vz * b
        f[DV + 1, DV + j] += vz * a - vx * c
        f[DV + 2, DV + j] += vx * b - vy * a
        by_p[j, j] += 2.0 * spin
        a, b, c = by_p[0, j], by_p[1, j], by_p[2, j]
        turn[0, j] = vy * c - vz * b
        turn[1, j] = vz * a - vx * c
        turn[2, j] = vx * b - vy * a
    add_gravity_slopes(level, earth, turn)
    minus_cross(f, DV, THETA, -specific[0], -specific[1], -specific[2])
    plus_product(f, DV, THETA, turn, px, py, pz, 1.0)
    minus_cross(f, DV, EPS, specific[0], specific[1], specific[2])
    minus_cross(f, EPS, EPS, spin * px + wx, spin * py + wy, spin * pz + wz)
    couple(f, DV, matrix, accel, rate, force)
    couple(f, EPS, matrix, gyro, rate, force)
    if held:
        f[DV + 2, :] = 0.0
        f[:, DV + 2] = 0.0


@njit(cache=True, error_model="numpy")
def wander_transitions(
    levels,
    rows,
    longest,
    gyro,
    accel,
    decay,
    drive,
    gyro_noise,
    accel_noise,
    held,
    earth,
    phi,
    q,
    f,
    step,
    added,
    growth,
    room,
    work,
    matrix,
    level,
):
    """Fill the transition and the covariance of noise, as `psi_model.psi_transitions`.

    `gyro` and `accel` are terms; `matrix` (15, 3) and `level` (one row) are work arrays.
    """
    n = phi.shape[0]
    for i in range(n):
        for j in range(n):
            phi[i, j] = 1.0 if i == j else 0.0
            q[i, j] = 0.0
    if held:
        phi[DV + 2, DV + 2] = 0.0
    at = 0
    while at < rows.shape[0]:
        end, dt = means_of_steps(levels, Q_LB, rows, at, longest, matrix[:6])
        for j in range(LEVEL):
            level[j] = 0.5 * (levels[at, j] + levels[end, j])
        wander_dynamics(
            f,
            level,
            matrix,
            matrix[3],
            matrix[4],
            matrix[5],
            gyro,
            accel,
            held,
            earth,
            matrix[6:9],
            matrix[9:12],
            matrix[12:15],
        )
        growth_of_step(f, decay, dt, matrix, gyro_noise, accel_noise, drive, 0, growth, room)
        unfold_growth(growth, step, added)
        if held:
            for j in range(n):
                added[DV + 2, j] = added[j, DV + 2] = 0.0
        compose_growth(step, added, phi, q, work)
        at = end


# The variables in components of quaternions, and as physical errors.


#: Indices of the states: velocity, components of q_ib, components of q_ew; and of the variables
#: without physical meaning, after the core: the norms.
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
    """Add to `out` (3,) the change of the velocity components by a turn about zeta."""
    out[0] += turn * level[V_L + 1]
    out[1] -= turn * level[V_L]


@njit(cache=True)
def fix_gauge(level, phi):
    """Remove the turn of the level axes about zeta from rows of variables, in place.

    The same errors, expressed in other axes of the truth.
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

"""Growth of the errors of a strapdown mechanization, as vectors relative to the Earth.

With the errors taken as vectors in Earth-fixed axes (displacement dr, velocity dv, rotation psi of
the computed attitude, ``C_computed = exp([psi x]) C``) the equations of motion
``p' = u, u' = C f + g(p) - 2 W x u, C' = C [w_ib x] - [W x] C`` have the variation
``dr' = dv, dv' = -(C f) x psi + C df + (dg/dp) dr - 2 W x dv, psi' = -W x psi + C dw``: Benson's
psi-angle model (IEEE AES-11 (1975) 447), regular everywhere. In level axes l each also turns
by ``-w_el x``. States: dr (3), dv (3), psi (3), then k states of the sensors.
"""

from __future__ import annotations

import math

from strapdown._kernels.compilation import IN_PLACE, njit
from strapdown._kernels.earth import E2, GAMMA, RATE, A, F, K, M, gravity_around
from strapdown._kernels.growth import CORE, compose_growth, growth_of_step, unfold_growth
from strapdown._kernels.level import ALT, AXIS, OMEGA_EL, Q_LB, curvatures
from strapdown._kernels.rotation import dcm_from_quat
from strapdown._kernels.rotation_vector import cross

# Bits of vertical displacement and velocity, which are constant where the height is held.
HELD_ROWS = (1 << 2) | (1 << 5)
# Below this cosine of the latitude north is undefined, and so is a slope along it.
NO_MERIDIAN = 1e-9


@njit(cache=True, inline="always")
def minus_cross(f, row, column, x, y, z):
    """Set the block at (row, column) to ``-[(x, y, z) x]``."""
    f[row, column] = f[row + 1, column + 1] = f[row + 2, column + 2] = 0.0
    f[row, column + 1], f[row, column + 2] = z, -y
    f[row + 1, column], f[row + 1, column + 2] = -z, x
    f[row + 2, column], f[row + 2, column + 1] = y, -x


@njit(**IN_PLACE)
def gravity_gradient(f, row, column, level, up, earth):
    """Set the block at (row, column) to the change of gravity, as a vector, with position.

    Over the level surface gravity turns with the normal and grows towards the poles; with height
    its length changes by Bruns' formula, ``-g (sum of the curvatures) - 2 W²``, and its direction
    by as much as the length does over the surface, as the field has no curl. Returns gravity.
    """
    kx, ky, kz = level[AXIS], level[AXIS + 1], level[AXIS + 2]
    sine = kz * up
    cosine2 = kx * kx + ky * ky
    across, along = curvatures(sine, level[ALT], earth[A], earth[E2])
    curvature = across + along * cosine2
    cosine = max(math.sqrt(cosine2), NO_MERIDIAN)
    w = 1.0 / math.sqrt(1.0 - earth[E2] * sine * sine)
    _, g, _, _, steep, _, _ = gravity_around(
        sine,
        cosine,
        level[ALT],
        w,
        curvature,
        earth[A],
        earth[E2],
        earth[GAMMA],
        earth[K],
        earth[F],
        earth[M],
    )
    # Steep has the factor cosine, which turns k into the unit vector to the north.
    steep *= -up * curvature / cosine
    f[row, column] = -g * (across + along * kx * kx)
    f[row, column + 1] = f[row + 1, column] = -g * along * kx * ky
    f[row + 1, column + 1] = -g * (across + along * ky * ky)
    f[row, column + 2] = f[row + 2, column] = steep * kx
    f[row + 1, column + 2] = f[row + 2, column + 1] = steep * ky
    f[row + 2, column + 2] = g * (2.0 * across + along * cosine2) + 2.0 * earth[RATE] ** 2
    return g


@njit(**IN_PLACE)
def couple(f, row, matrix, terms, rate, force):
    """Add to the sensors' columns of three rows ``matrix @ coupling(rate, force)``.

    `terms` lists the nonzero elements of a coupling: factor (0 none, 1 to 3 rate, 4 to 6 force),
    axis, state, value.
    """
    for e in range(terms.shape[0]):
        m, axis, j = int(terms[e, 0]), int(terms[e, 1]), CORE + int(terms[e, 2])
        weight = terms[e, 3]
        if m > 3:
            weight *= force[m - 4]
        elif m > 0:
            weight *= rate[m - 1]
        for i in range(3):
            f[row + i, j] += weight * matrix[i, axis]


@njit(**IN_PLACE)
def psi_dynamics(f, level, up, matrix, specific, rate, force, gyro, accel, held, earth):
    """Fill the first nine rows of F, (9, w).

    `matrix` is C_lb and `specific` C_lb f, both means; `rate` and `force` are those of the body.
    With a held height nothing moves vertically.
    """
    wx, wy, wz = level[OMEGA_EL], level[OMEGA_EL + 1], level[OMEGA_EL + 2]
    spin = earth[RATE]
    ex, ey, ez = spin * level[AXIS], spin * level[AXIS + 1], spin * level[AXIS + 2]
    for i in range(f.shape[0]):
        for j in range(f.shape[1]):
            f[i, j] = 0.0
    minus_cross(f, 0, 0, wx, wy, wz)
    f[0, 3] = f[1, 4] = f[2, 5] = 1.0
    g = gravity_gradient(f, 3, 0, level, up, earth)
    minus_cross(f, 3, 3, 2.0 * ex + wx, 2.0 * ey + wy, 2.0 * ez + wz)
    minus_cross(f, 3, 6, specific[0], specific[1], specific[2])
    minus_cross(f, 6, 6, ex + wx, ey + wy, ez + wz)
    couple(f, 3, matrix, accel, rate, force)
    couple(f, 6, matrix, gyro, rate, force)
    if held:
        # The force that holds the height turns with the normal as gravity does: together they
        # equal the vertical specific force.
        bearing = up * specific[2] / g
        for i in range(3, 5):
            for j in range(2):
                f[i, j] *= bearing
        for j in range(f.shape[1]):
            f[2, j] = f[5, j] = 0.0


@njit(**IN_PLACE)
def means_of_steps(states, q_at, rows, at, longest, matrix):
    """Fill `matrix` (6, 3) with means over the steps from `at` on, up to `longest` seconds.

    `states` hold the quaternion q_lb of each side of the steps from column `q_at` on.

    Rows 0 to 2: C_lb; row 3: C_lb f; rows 4 and 5: rate and force of the body. Returns the first
    step that is not among them, and their time.
    """
    dt = 0.0
    for i in range(6):
        for j in range(3):
            matrix[i, j] = 0.0
    end = at
    count = rows.shape[0]
    while end < count and (end == at or dt + rows[end, 0] <= longest * 1.000001):
        h = rows[end, 0]
        aw, ax = states[end, q_at], states[end, q_at + 1]
        ay, az = states[end, q_at + 2], states[end, q_at + 3]
        bw, bx = states[end + 1, q_at], states[end + 1, q_at + 1]
        by, bz = states[end + 1, q_at + 2], states[end + 1, q_at + 3]
        # Mean of the two ends; the sign of a quaternion is arbitrary.
        sign = 1.0
        if aw * bw + ax * bx + ay * by + az * bz < 0.0:
            sign = -1.0
        qw, qx, qy, qz = aw + sign * bw, ax + sign * bx, ay + sign * by, az + sign * bz
        norm = 1.0 / math.sqrt(qw * qw + qx * qx + qy * qy + qz * qz)
        c = dcm_from_quat(norm * qw, norm * qx, norm * qy, norm * qz)
        # Velocity increments are in the axes of the start of their step: to those of its middle.
        x, y, z = rows[end, 4], rows[end, 5], rows[end, 6]
        px, py, pz = 0.5 * rows[end, 1], 0.5 * rows[end, 2], 0.5 * rows[end, 3]
        tx, ty, tz = cross(px, py, pz, x, y, z)
        sx, sy, sz = cross(px, py, pz, tx, ty, tz)
        x, y, z = x - tx + 0.5 * sx, y - ty + 0.5 * sy, z - tz + 0.5 * sz
        for i in range(3):
            for j in range(3):
                matrix[i, j] += h * c[3 * i + j]
            matrix[3, i] += c[3 * i] * x + c[3 * i + 1] * y + c[3 * i + 2] * z
            matrix[4, i] += rows[end, 1 + i]
        matrix[5, 0] += x
        matrix[5, 1] += y
        matrix[5, 2] += z
        dt += h
        end += 1
    for i in range(6):
        for j in range(3):
            matrix[i, j] /= dt
    return end, dt


@njit(**IN_PLACE)
def psi_transitions(
    levels,
    rows,
    up,
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
):
    """Fill the transition and the covariance of noise over increments `rows`.

    `levels` are level rows at both sides of every step; steps are grouped up to `longest` seconds,
    with the means of attitude, force and rate over them. `gyro` and `accel` are terms of couplings
    (`couple`). The rest are work arrays: `f` (9, `growth.padded_width`); `step`, `added` and `work`
    (n, n); `growth` and `room` of `growth`; `matrix` (6, 3).
    """
    n = phi.shape[0]
    for i in range(n):
        for j in range(n):
            phi[i, j] = 1.0 if i == j else 0.0
            q[i, j] = 0.0
    at = 0
    count = rows.shape[0]
    still = HELD_ROWS if held else 0
    while at < count:
        end, dt = means_of_steps(levels, Q_LB, rows, at, longest, matrix)
        # The level row of the middle; attitude and force are means already.
        middle = levels[(at + end) // 2]
        psi_dynamics(
            f, middle, up, matrix, matrix[3], matrix[4], matrix[5], gyro, accel, held, earth
        )
        growth_of_step(f, decay, dt, matrix, gyro_noise, accel_noise, drive, still, growth, room)
        unfold_growth(growth, step, added)
        compose_growth(step, added, phi, q, work)
        at = end

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

from numba import njit

from strapdown._kernels.earth import E2, GAMMA, RATE, A, F, K, M, gravity_around
from strapdown._kernels.level import ALT, AXIS, OMEGA_EL, Q_LB, curvatures
from strapdown._kernels.rotation import dcm_from_quat
from strapdown._kernels.rotation_vector import cross

CORE = 9
# Below this cosine of the latitude there is no direction to the north, and no slope along it.
NO_MERIDIAN = 1e-9


@njit(cache=True, inline="always")
def minus_cross(f, row, column, x, y, z):
    """Set the block at (row, column) to ``-[(x, y, z) x]``."""
    f[row, column] = f[row + 1, column + 1] = f[row + 2, column + 2] = 0.0
    f[row, column + 1], f[row, column + 2] = z, -y
    f[row + 1, column], f[row + 1, column + 2] = -z, x
    f[row + 2, column], f[row + 2, column + 1] = y, -x


@njit(cache=True, error_model="numpy")
def gravity_gradient(f, row, column, level, up, earth):
    """Set the block at (row, column) to the change of gravity, as a vector, with the place.

    Over the level surface gravity turns with the normal and grows towards the poles; with height
    its length changes as Bruns' formula has it, ``-g (sum of the curvatures) - 2 W²``, and its
    direction by as much as the length does over the surface, as the field has no curl. Returns
    gravity.
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


@njit(cache=True, error_model="numpy")
def couple(f, row, matrix, coupling, rate, force):
    """Set the sensors' columns of three rows to ``matrix @ coupling(rate, force)``."""
    k = coupling.shape[2]
    for j in range(k):
        b0 = b1 = b2 = 0.0
        for i in range(7):
            weight = 1.0
            if i > 3:
                weight = force[i - 4]
            elif i > 0:
                weight = rate[i - 1]
            b0 += weight * coupling[i, 0, j]
            b1 += weight * coupling[i, 1, j]
            b2 += weight * coupling[i, 2, j]
        for i in range(3):
            f[row + i, CORE + j] = matrix[i, 0] * b0 + matrix[i, 1] * b1 + matrix[i, 2] * b2


@njit(cache=True, error_model="numpy")
def psi_dynamics(f, level, up, matrix, specific, rate, force, gyro, accel, held, earth):
    """Fill the first nine rows of F, (9, 9 + k).

    `matrix` is C_lb and `specific` C_lb f, both means; `rate` and `force` are those of the body.
    With a height that is held nothing moves vertically.
    """
    wx, wy, wz = level[OMEGA_EL], level[OMEGA_EL + 1], level[OMEGA_EL + 2]
    spin = earth[RATE]
    ex, ey, ez = spin * level[AXIS], spin * level[AXIS + 1], spin * level[AXIS + 2]
    f[:, :] = 0.0
    minus_cross(f, 0, 0, wx, wy, wz)
    f[0, 3] = f[1, 4] = f[2, 5] = 1.0
    g = gravity_gradient(f, 3, 0, level, up, earth)
    minus_cross(f, 3, 3, 2.0 * ex + wx, 2.0 * ey + wy, 2.0 * ez + wz)
    minus_cross(f, 3, 6, specific[0], specific[1], specific[2])
    minus_cross(f, 6, 6, ex + wx, ey + wy, ez + wz)
    couple(f, 3, matrix, accel, rate, force)
    couple(f, 6, matrix, gyro, rate, force)
    if held:
        # What holds the height turns with the normal as gravity does: together they are as large
        # as the vertical force that is felt.
        bearing = up * specific[2] / g
        for i in range(3, 5):
            for j in range(2):
                f[i, j] *= bearing
        f[2, :] = 0.0
        f[5, :] = 0.0


@njit(cache=True, error_model="numpy")
def exponential(f, decay, dt, phi, work):
    """Fill ``phi = exp(F dt)`` to third order in its first nine rows; `decay` is exact.

    Third order, because drift reaches the place through tilt and velocity.
    """
    n = f.shape[1]
    for i in range(n):
        for j in range(n):
            phi[i, j] = 1.0 if i == j else 0.0
    # Of Horner's scheme 1 + F dt (1 + F dt/2 (1 + F dt/3)) the inner brackets. Rows are added to
    # rows, which a processor does several numbers at a time.
    for order in range(3, 0, -1):
        part = dt / order
        for i in range(CORE):
            for j in range(CORE):
                work[i, j] = 0.0
            for j in range(CORE, n):
                work[i, j] = part * f[i, j] * phi[j, j]
            for m in range(CORE):
                weight = part * f[i, m]
                if weight != 0.0:
                    for j in range(n):
                        work[i, j] += weight * phi[m, j]
        for i in range(CORE):
            for j in range(n):
                phi[i, j] = work[i, j]
            phi[i, i] += 1.0
        for j in range(CORE, n):
            phi[j, j] = 1.0 - part * decay[j - CORE] * phi[j, j]
    for j in range(CORE, n):
        phi[j, j] = math.exp(-decay[j - CORE] * dt)


@njit(cache=True, error_model="numpy")
def compose_transition(step, added, phi, q, work):
    """Let a step follow: ``phi <- step phi`` and ``q <- step q step' + added``.

    Below its first nine rows `step` is diagonal.
    """
    n = phi.shape[0]
    for i in range(CORE):
        for j in range(n):
            work[i, j] = 0.0
        for m in range(n):
            weight = step[i, m]
            if weight != 0.0:
                for j in range(n):
                    work[i, j] += weight * phi[m, j]
    for i in range(CORE):
        for j in range(n):
            phi[i, j] = work[i, j]
    for i in range(CORE, n):
        for j in range(n):
            phi[i, j] *= step[i, i]
            work[i, j] = step[i, i] * q[i, j]
    for i in range(CORE):
        for j in range(n):
            work[i, j] = 0.0
        for m in range(n):
            weight = step[i, m]
            if weight != 0.0:
                for j in range(n):
                    work[i, j] += weight * q[m, j]
    for i in range(n):
        for j in range(i, n):
            total = added[i, j]
            if j < CORE:
                for m in range(n):
                    total += work[i, m] * step[j, m]
            else:
                total += work[i, j] * step[j, j]
            q[i, j] = total
    for i in range(n):
        for j in range(i):
            q[i, j] = q[j, i]


@njit(cache=True, error_model="numpy")
def noise_of_step(f, matrix, dt, gyro_noise, accel_noise, decay, drive, held, added, gamma, lift):
    """Fill the covariance that white noise adds over a step.

    The noise enters at the middle of the step, ``exp(F dt/2) G q G' exp(F dt/2)' dt``, which holds
    its correlations to second order and is positive semidefinite; `gamma` (n, 6 + k) and `lift`
    (n, n) are room to work in.
    """
    n = f.shape[1]
    k = n - CORE
    exponential(f, decay, 0.5 * dt, lift, added)
    gamma[:, :] = 0.0
    root = math.sqrt(dt)
    for i in range(n):
        for j in range(3):
            a = g = 0.0
            if i < CORE:
                for m in range(3):
                    a += lift[i, 3 + m] * matrix[m, j]
                    g += lift[i, 6 + m] * matrix[m, j]
            gamma[i, j] = root * accel_noise[j] * a
            gamma[i, 3 + j] = root * gyro_noise[j] * g
        for j in range(k):
            if i < CORE or i == CORE + j:
                gamma[i, 6 + j] = root * drive[j] * lift[i, CORE + j]
    if held:
        gamma[2, :] = 0.0
        gamma[5, :] = 0.0
    for i in range(n):
        for j in range(i, n):
            total = 0.0
            for m in range(6 + k):
                total += gamma[i, m] * gamma[j, m]
            added[i, j] = added[j, i] = total


@njit(cache=True, error_model="numpy")
def means_of_steps(levels, rows, at, longest, matrix):
    """Fill `matrix` (6, 3) with means over the steps from `at` on, up to `longest` seconds.

    Rows 0 to 2: C_lb; row 3: C_lb f; rows 4 and 5: rate and force of the body. Returns the first
    step that is not among them, and their time.
    """
    dt = 0.0
    matrix[:, :] = 0.0
    end = at
    count = rows.shape[0]
    while end < count and (end == at or dt + rows[end, 0] <= longest * 1.000001):
        h = rows[end, 0]
        a, b = levels[end], levels[end + 1]
        # Between the two ends; the sign of a quaternion is not its own.
        sign = 1.0
        if (
            a[Q_LB] * b[Q_LB]
            + a[Q_LB + 1] * b[Q_LB + 1]
            + a[Q_LB + 2] * b[Q_LB + 2]
            + a[Q_LB + 3] * b[Q_LB + 3]
            < 0.0
        ):
            sign = -1.0
        qw, qx = a[Q_LB] + sign * b[Q_LB], a[Q_LB + 1] + sign * b[Q_LB + 1]
        qy, qz = a[Q_LB + 2] + sign * b[Q_LB + 2], a[Q_LB + 3] + sign * b[Q_LB + 3]
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


@njit(cache=True, error_model="numpy")
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
    gamma,
    work,
    matrix,
):
    """Fill the transition and the covariance of noise over increments `rows`.

    `levels` are level rows at both sides of every step; steps are taken together up to `longest`
    seconds, with the means of attitude, force and rate over them. The rest is room to work in.
    """
    n = phi.shape[0]
    for i in range(n):
        for j in range(n):
            phi[i, j] = 1.0 if i == j else 0.0
            q[i, j] = 0.0
    at = 0
    count = rows.shape[0]
    while at < count:
        end, dt = means_of_steps(levels, rows, at, longest, matrix)
        # The level row of the middle; attitude and force are means already.
        middle = levels[(at + end) // 2]
        psi_dynamics(
            f, middle, up, matrix, matrix[3], matrix[4], matrix[5], gyro, accel, held, earth
        )
        noise_of_step(
            f, matrix, dt, gyro_noise, accel_noise, decay, drive, held, added, gamma, step
        )
        exponential(f, decay, dt, step, work)
        compose_transition(step, added, phi, q, work)
        at = end

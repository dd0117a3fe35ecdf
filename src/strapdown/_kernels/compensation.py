"""Removal of sensor errors from motion increments."""

from __future__ import annotations

from strapdown._kernels.compilation import IN_PLACE, njit
from strapdown._kernels.rotation_vector import cross

#: Iterations; each evaluates the errors at the inputs found by the previous one.
ROUNDS = 5


@njit(**IN_PLACE)
def errors_of_states(terms, states, out):
    """Fill (7, 3): the effect of coupling states, given by their terms, on a triad's readings."""
    for i in range(7):
        for j in range(3):
            out[i, j] = 0.0
    for e in range(terms.shape[0]):
        m, axis, j = int(terms[e, 0]), int(terms[e, 1]), int(terms[e, 2])
        out[m, axis] += terms[e, 3] * states[j]


@njit(cache=True, error_model="numpy", inline="always")
def reading(errors, varies, rate, force):
    """Error of a triad: its constant part, and the parts proportional to rate and force."""
    x, y, z = errors[0, 0], errors[0, 1], errors[0, 2]
    if varies:
        for m in range(3):
            a, b = rate[m], force[m]
            x += a * errors[1 + m, 0] + b * errors[4 + m, 0]
            y += a * errors[1 + m, 1] + b * errors[4 + m, 1]
            z += a * errors[1 + m, 2] + b * errors[4 + m, 2]
    return x, y, z


@njit(cache=True, error_model="numpy", inline="always")
def changes(errors):
    """Whether a triad's error depends on rate or force."""
    for m in range(1, 7):
        if errors[m, 0] != 0.0 or errors[m, 1] != 0.0 or errors[m, 2] != 0.0:
            return True
    return False


@njit(cache=True, error_model="numpy", inline="always")
def of_inputs(gyro, of_gyros, accel, of_accels, rate, force):
    """Errors of both triads with true inputs, from the measured inputs.

    A scale factor multiplies the true input, which is the reading less the error itself. Applied to
    the reading, a bias and a scale factor of a constant input would not compensate each other as
    they do in the covariance: the unobservable part would be seen, and a filter that corrects it
    would diverge. Errors of 5 % are found to 1e-6 of the input.
    """
    dx, dy, dz, ex, ey, ez = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for _ in range(ROUNDS if of_gyros or of_accels else 1):
        true_rate = (rate[0] - dx, rate[1] - dy, rate[2] - dz)
        true_force = (force[0] - ex, force[1] - ey, force[2] - ez)
        dx, dy, dz = reading(gyro, of_gyros, true_rate, true_force)
        ex, ey, ez = reading(accel, of_accels, true_rate, true_force)
    return dx, dy, dz, ex, ey, ez


@njit(**IN_PLACE)
def true_inputs(readings, gyro, accel, out):
    """Fill rate and force (6,) of readings without errors (7, 3) of gyros and accelerometers."""
    rate = (readings[0], readings[1], readings[2])
    force = (readings[3], readings[4], readings[5])
    dx, dy, dz, ex, ey, ez = of_inputs(gyro, changes(gyro), accel, changes(accel), rate, force)
    out[0], out[1], out[2] = rate[0] - dx, rate[1] - dy, rate[2] - dz
    out[3], out[4], out[5] = force[0] - ex, force[1] - ey, force[2] - ez


@njit(**IN_PLACE)
def compensate(rows, gyro, accel, out):
    """Fill increments without the errors (7, 3) of gyros and accelerometers (`errors_of_states`).

    To first order in the errors: over a step the body turns by phi, so that a constant force error
    e adds ``(e + phi x e / 2) dt`` to the velocity in the axes of the start, and a rate error d
    turns it by half of its turn of the body.
    """
    of_gyros, of_accels = changes(gyro), changes(accel)
    for i in range(rows.shape[0]):
        dt = rows[i, 0]
        px, py, pz = rows[i, 1], rows[i, 2], rows[i, 3]
        ux, uy, uz = rows[i, 4], rows[i, 5], rows[i, 6]
        rate, force = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
        if of_gyros or of_accels:
            # The force that the sensors measured, without the turn of the body.
            tx, ty, tz = cross(px, py, pz, ux, uy, uz)
            rate = (px / dt, py / dt, pz / dt)
            force = ((ux - 0.5 * tx) / dt, (uy - 0.5 * ty) / dt, (uz - 0.5 * tz) / dt)
        dx, dy, dz, ex, ey, ez = of_inputs(gyro, of_gyros, accel, of_accels, rate, force)
        dx, dy, dz = dx * dt, dy * dt, dz * dt
        ex, ey, ez = ex * dt, ey * dt, ez * dt
        tx, ty, tz = cross(px, py, pz, ex, ey, ez)
        sx, sy, sz = cross(dx, dy, dz, ux, uy, uz)
        out[i, 0] = dt
        out[i, 1], out[i, 2], out[i, 3] = px - dx, py - dy, pz - dz
        out[i, 4] = ux - ex - 0.5 * (tx + sx)
        out[i, 5] = uy - ey - 0.5 * (ty + sy)
        out[i, 6] = uz - ez - 0.5 * (tz + sz)
        # Distance: half the step of a constant, a third where it grows with time.
        out[i, 7] = rows[i, 7] - dt * (0.5 * ex + (tx + sx) / 6.0)
        out[i, 8] = rows[i, 8] - dt * (0.5 * ey + (ty + sy) / 6.0)
        out[i, 9] = rows[i, 9] - dt * (0.5 * ez + (tz + sz) / 6.0)

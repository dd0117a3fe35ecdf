"""Errors of the sensors taken off motion increments."""

from __future__ import annotations

from numba import njit

from strapdown._kernels.rotation_vector import cross


@njit(cache=True, error_model="numpy")
def compensate(rows, gyro, accel, states, out):
    """Fill increments without the errors that `states` of couplings (7, 3, k) put into them.

    To first order in the errors: over a step the body turns by phi, so that a constant error of
    force e adds ``(e + phi x e / 2) dt`` to the velocity in the axes of the start, and one of rate
    d turns it by half of what it turns the body.
    """
    k = states.size
    for i in range(rows.shape[0]):
        dt = rows[i, 0]
        px, py, pz = rows[i, 1], rows[i, 2], rows[i, 3]
        ux, uy, uz = rows[i, 4], rows[i, 5], rows[i, 6]
        # The force that the sensors measured, without the turn of the body.
        tx, ty, tz = cross(px, py, pz, ux, uy, uz)
        force = (ux - 0.5 * tx, uy - 0.5 * ty, uz - 0.5 * tz)
        dx = dy = dz = ex = ey = ez = 0.0
        for m in range(7):
            weight = 1.0
            if m > 3:
                weight = force[m - 4] / dt
            elif m > 0:
                weight = rows[i, m] / dt
            for j in range(k):
                part = weight * states[j]
                dx += part * gyro[m, 0, j]
                dy += part * gyro[m, 1, j]
                dz += part * gyro[m, 2, j]
                ex += part * accel[m, 0, j]
                ey += part * accel[m, 1, j]
                ez += part * accel[m, 2, j]
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

"""Rate and force without the shaking: means that fade, in the axes of the body as it turns."""

from __future__ import annotations

import math

from numba import njit

from strapdown._kernels.rotation_vector import cross

#: Numbers that are remembered: rate, force, and whether anything was.
STEADY = 7


@njit(cache=True, error_model="numpy")
def steady_motion(rows, memory_time, memory, out):
    """Fill rates and forces, (k, 6), at the ends of steps; `memory` goes on with them.

    The force that is remembered is turned against the turn of the body, so that one that stays in
    inertial axes, as gravity does, is not changed by a turn.
    """
    for i in range(rows.shape[0]):
        dt = rows[i, 0]
        px, py, pz = rows[i, 1], rows[i, 2], rows[i, 3]
        if memory[6] == 0.0:
            for k in range(6):
                memory[k] = rows[i, 1 + k] / dt
            memory[6] = 1.0
        fx, fy, fz = memory[3], memory[4], memory[5]
        ax, ay, az = cross(px, py, pz, fx, fy, fz)
        bx, by, bz = cross(px, py, pz, ax, ay, az)
        memory[3], memory[4], memory[5] = fx - ax + 0.5 * bx, fy - ay + 0.5 * by, fz - az + 0.5 * bz
        part = 1.0 - math.exp(-dt / memory_time)
        for k in range(6):
            memory[k] += part * (rows[i, 1 + k] / dt - memory[k])
            out[i, k] = memory[k]

"""Many runs of one record, each with its own errors put on the increments and on the start."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from strapdown._kernels.earth import radii
from strapdown._kernels.ned import ALT, COSINE, DONE, LAT, LON, PRIME, ROW, SINE, Q, V, ned_advance
from strapdown._kernels.rotation import quat_from_rotvec, quat_multiply


@njit(cache=True, error_model="numpy", nogil=True)
def perturbed_runs(
    state, rows, nominal, start, effects, used, noise_sd, draws, noise, earth, options, out
):
    """Navigate once for each row of `draws`; returns how many runs were whole.

    `state` is the kernel's at the start, `rows` the increments (k, 10), `nominal` the states
    that follow from them, with the first (k + 1, 10). One standard deviation of unknown p puts
    `start[p]` (rotation vector in level, velocity, metres north, east, down) on the start and
    `effects[p]` (6, k) on angle and velocity of each step, where `used[p]` (6) says that there is
    any. `noise_sd` (6, k) times `noise` (n, 6, k) comes on top. `out` (n, k + 1, 9) takes what a
    run differs by from the nominal one, as in `error_growth`.
    """
    steps, unknowns = rows.shape[0], start.shape[0]
    added = np.empty((6, steps))
    mine = np.empty((steps, rows.shape[1]))
    history = np.empty((steps, ROW))
    own = np.empty(state.shape[0])
    first = np.empty(9)
    nothing = np.empty(0)
    meridian, transverse = radii(math.sin(state[LAT]), earth[0], earth[1])
    north, east = meridian + state[ALT], (transverse + state[ALT]) * math.cos(state[LAT])
    whole = 0
    for n in range(draws.shape[0]):
        for j in range(6):
            for i in range(steps):
                added[j, i] = noise_sd[j, i] * noise[n, j, i]
        first[:] = 0.0
        for p in range(unknowns):
            x = draws[n, p]
            for j in range(9):
                first[j] += x * start[p, j]
            for j in range(6):
                if used[p, j]:
                    for i in range(steps):
                        added[j, i] += x * effects[p, j, i]
        for i in range(steps):
            half = 0.5 * rows[i, 0]
            mine[i, 0] = rows[i, 0]
            for j in range(6):
                mine[i, 1 + j] = rows[i, 1 + j] + added[j, i]
            for j in range(3):
                mine[i, 7 + j] = rows[i, 7 + j] + half * added[3 + j, i]
        own[:] = state
        own[LAT] += first[6] / north
        own[LON] += first[7] / east
        own[ALT] -= first[8]
        for j in range(3):
            own[V + j] += first[3 + j]
        bw, bx, by, bz = quat_from_rotvec(first[0], first[1], first[2])
        own[Q], own[Q + 1], own[Q + 2], own[Q + 3] = quat_multiply(
            bw, bx, by, bz, state[Q], state[Q + 1], state[Q + 2], state[Q + 3]
        )
        own[SINE], own[COSINE] = math.sin(own[LAT]), math.cos(own[LAT])
        own[PRIME] = 1.0 / math.sqrt(1.0 - earth[1] * own[SINE] * own[SINE])
        for j in range(9):
            out[n, 0, j] = first[j]
        made, why = ned_advance(own, mine, nothing, earth, options, history)
        if why == DONE:
            whole += 1
        for i in range(made):
            w, x, y, z = quat_multiply(
                history[i, Q],
                history[i, Q + 1],
                history[i, Q + 2],
                history[i, Q + 3],
                nominal[i + 1, Q],
                -nominal[i + 1, Q + 1],
                -nominal[i + 1, Q + 2],
                -nominal[i + 1, Q + 3],
            )
            # Errors of attitude are far below a radian: the rotation vector is twice the vector
            # part to within a part in 24 of its square.
            twice = 2.0 if w > 0.0 else -2.0
            out[n, i + 1, 0], out[n, i + 1, 1], out[n, i + 1, 2] = twice * x, twice * y, twice * z
            for j in range(3):
                out[n, i + 1, 3 + j] = history[i, V + j] - nominal[i + 1, V + j]
            out[n, i + 1, 6] = (history[i, LAT] - nominal[i + 1, LAT]) * north
            out[n, i + 1, 7] = (history[i, LON] - nominal[i + 1, LON]) * east
            out[n, i + 1, 8] = nominal[i + 1, ALT] - history[i, ALT]
        for i in range(made, steps):
            out[n, i + 1, :] = math.nan
    return whole

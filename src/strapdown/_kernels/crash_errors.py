"""Errors of a crash path: first-order growth of small errors, and perturbed runs.

An error is nine numbers: a rotation vector in local level, with ``C_true = (I + [phi x]) C``
(Tadic and Vukajlovic 2016, Eqs. (20), (21)), velocity and position. Over a path of seconds the
Earth's rate and the change of gravity with position are neglected: their effect is 1e-4 of an error
per second.
"""

from __future__ import annotations

import math

import numpy as np

from strapdown._kernels.compilation import njit
from strapdown._kernels.earth import radii
from strapdown._kernels.ned import ALT, COSINE, DONE, LAT, LON, PRIME, ROW, SINE, Q, V, ned_advance
from strapdown._kernels.rotation import quat_from_rotvec, quat_multiply


@njit(cache=True, error_model="numpy")
def grow_errors(attitude, rows, start, theta, force, out):
    """Propagate the errors of p unknowns.

    `attitude` is (k, 3, 3), body to level at the start of each step; `rows` are motion increments;
    `start` is (p, 9); `theta` and `force` (p, 3, k) are the effects of an unknown on the angle and
    the velocity of each step, body axes of its start; `out` is (p, k + 1, 9).
    """
    steps = rows.shape[0]
    for p in range(start.shape[0]):
        for j in range(9):
            out[p, 0, j] = start[p, j]
        for i in range(steps):
            dt = rows[i, 0]
            c = attitude[i]
            tx, ty, tz = _turned(c, theta[p, 0, i], theta[p, 1, i], theta[p, 2, i])
            ux, uy, uz = _turned(c, force[p, 0, i], force[p, 1, i], force[p, 2, i])
            vx, vy, vz = _turned(c, rows[i, 4], rows[i, 5], rows[i, 6])
            rx, ry, rz = _turned(c, rows[i, 7], rows[i, 8], rows[i, 9])
            x, y, z = out[p, i, 0], out[p, i, 1], out[p, i, 2]
            out[p, i + 1, 0] = x + tx
            out[p, i + 1, 1] = y + ty
            out[p, i + 1, 2] = z + tz
            out[p, i + 1, 3] = out[p, i, 3] + y * vz - z * vy + ux
            out[p, i + 1, 4] = out[p, i, 4] + z * vx - x * vz + uy
            out[p, i + 1, 5] = out[p, i, 5] + x * vy - y * vx + uz
            half = 0.5 * dt
            out[p, i + 1, 6] = out[p, i, 6] + dt * out[p, i, 3] + y * rz - z * ry + half * ux
            out[p, i + 1, 7] = out[p, i, 7] + dt * out[p, i, 4] + z * rx - x * rz + half * uy
            out[p, i + 1, 8] = out[p, i, 8] + dt * out[p, i, 5] + x * ry - y * rx + half * uz


@njit(cache=True, error_model="numpy")
def grow_noise(attitude, rows, theta, force, start, out):
    """Propagate the covariance of noise that is independent from step to step.

    `theta` and `force` (3, k) are standard deviations of the noise of each step; `start` (9, 9)
    is the covariance at the start; `out` is (k + 1, 9, 9).
    """
    steps = rows.shape[0]
    for a in range(9):
        for b in range(9):
            out[0, a, b] = start[a, b]
    for i in range(steps):
        dt = rows[i, 0]
        c = attitude[i]
        vx, vy, vz = _turned(c, rows[i, 4], rows[i, 5], rows[i, 6])
        rx, ry, rz = _turned(c, rows[i, 7], rows[i, 8], rows[i, 9])
        now, then = out[i], out[i + 1]
        # The transition is I + N, from the left and from the right; N fills six rows.
        for a in range(9):
            for b in range(9):
                then[a, b] = now[a, b]
        for b in range(9):
            x, y, z = now[0, b], now[1, b], now[2, b]
            then[3, b] += y * vz - z * vy
            then[4, b] += z * vx - x * vz
            then[5, b] += x * vy - y * vx
            then[6, b] += dt * now[3, b] + y * rz - z * ry
            then[7, b] += dt * now[4, b] + z * rx - x * rz
            then[8, b] += dt * now[5, b] + x * ry - y * rx
        for a in range(9):
            x, y, z = then[a, 0], then[a, 1], then[a, 2]
            sx, sy, sz = then[a, 3], then[a, 4], then[a, 5]
            then[a, 3] += y * vz - z * vy
            then[a, 4] += z * vx - x * vz
            then[a, 5] += x * vy - y * vx
            then[a, 6] += dt * sx + y * rz - z * ry
            then[a, 7] += dt * sy + z * rx - x * rz
            then[a, 8] += dt * sz + x * ry - y * rx
        for a in range(3):
            for b in range(3):
                turned, felt = 0.0, 0.0
                for j in range(3):
                    turned += c[a, j] * c[b, j] * theta[j, i] * theta[j, i]
                    felt += c[a, j] * c[b, j] * force[j, i] * force[j, i]
                then[a, b] += turned
                then[3 + a, 3 + b] += felt
                then[3 + a, 6 + b] += 0.5 * dt * felt
                then[6 + a, 3 + b] += 0.5 * dt * felt
                then[6 + a, 6 + b] += 0.25 * dt * dt * felt


@njit(cache=True, error_model="numpy")
def _turned(c, x, y, z):
    return (
        c[0, 0] * x + c[0, 1] * y + c[0, 2] * z,
        c[1, 0] * x + c[1, 1] * y + c[1, 2] * z,
        c[2, 0] * x + c[2, 1] * y + c[2, 2] * z,
    )


# Runs of one record, each with its own errors of the increments and of the start.


#: Runs whose errors are formed together, and steps of a tile: what unknowns add to them stays in
#: the first cache from run to run.
GROUP, TILE = 16, 64


@njit(cache=True, error_model="numpy")
def _errors_of_runs(low, high, effects, used, noise_sd, draws, noise, order, added):
    """Errors of angle and velocity of each step of the runs from `low` to before `high`."""
    steps = effects.shape[2]
    for j in range(6):
        count = 0
        for p in range(effects.shape[0]):
            if used[p, j]:
                order[count] = p
                count += 1
        # Four at a time: a quarter of the loads and stores of what they are added to.
        fours = count - count % 4
        for begin in range(0, steps, TILE):
            end = min(begin + TILE, steps)
            for n in range(low, high):
                sums = added[n - low, j, begin:end]
                for i in range(begin, end):
                    sums[i - begin] = noise_sd[j, i] * noise[n, j, i]
                for k in range(0, fours, 4):
                    a, b, c, d = order[k], order[k + 1], order[k + 2], order[k + 3]
                    _add_four(
                        sums,
                        effects[a, j, begin:end],
                        effects[b, j, begin:end],
                        effects[c, j, begin:end],
                        effects[d, j, begin:end],
                        draws[n, a],
                        draws[n, b],
                        draws[n, c],
                        draws[n, d],
                    )
                for k in range(fours, count):
                    p = order[k]
                    x = draws[n, p]
                    for i in range(begin, end):
                        sums[i - begin] += x * effects[p, j, i]


@njit(cache=True, error_model="numpy")
def _add_four(sums, a, b, c, d, w, x, y, z):
    """Add four multiples, in this order."""
    for i in range(sums.shape[0]):
        sums[i] = sums[i] + w * a[i] + x * b[i] + y * c[i] + z * d[i]


@njit(cache=True, error_model="numpy", nogil=True)
def perturbed_runs(
    state, rows, nominal, start, effects, used, noise_sd, draws, noise, earth, options, kept, out
):
    """Navigate once for each row of `draws`; returns the number of complete runs.

    `state` is the kernel's at the start, `rows` the increments (k, 10), `nominal` the resulting
    states, beginning with the first (k + 1, 10). One standard deviation of unknown p adds
    `start[p]` (rotation vector in level, velocity, meters north, east, down) to the start and
    `effects[p]` (6, k) to angle and velocity of each step, where `used[p]` (6) is set. `noise_sd`
    (6, k) times `noise` (n, 6, k) is added. `out` (n, m, 9) takes the difference of a run from the
    nominal one, as in `grow_errors`, after `kept` (m) steps: 0 is the start.
    """
    steps, unknowns, runs = rows.shape[0], start.shape[0], draws.shape[0]
    added = np.empty((GROUP, 6, steps))
    mine = np.empty((steps, rows.shape[1]))
    history = np.empty((steps, ROW))
    own = np.empty(state.shape[0])
    first = np.empty(9)
    nothing = np.empty(0)
    order = np.empty(unknowns, dtype=np.int64)
    meridian, transverse = radii(math.sin(state[LAT]), earth[0], earth[1])
    north, east = meridian + state[ALT], (transverse + state[ALT]) * math.cos(state[LAT])
    whole = 0
    for n in range(runs):
        if n % GROUP == 0:
            _errors_of_runs(
                n, min(n + GROUP, runs), effects, used, noise_sd, draws, noise, order, added
            )
        errors = added[n % GROUP]
        first[:] = 0.0
        for p in range(unknowns):
            for j in range(9):
                first[j] += draws[n, p] * start[p, j]
        for i in range(steps):
            half = 0.5 * rows[i, 0]
            mine[i, 0] = rows[i, 0]
            for j in range(6):
                mine[i, 1 + j] = rows[i, 1 + j] + errors[j, i]
            for j in range(3):
                mine[i, 7 + j] = rows[i, 7 + j] + half * errors[3 + j, i]
        for j in range(own.shape[0]):
            own[j] = state[j]
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
        made, why = ned_advance(own, mine, nothing, earth, options, history)
        if why == DONE:
            whole += 1
        for m in range(kept.shape[0]):
            i = kept[m] - 1
            if i < 0:
                for j in range(9):
                    out[n, m, j] = first[j]
                continue
            if i >= made:
                out[n, m, :] = math.nan
                continue
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
            out[n, m, 0], out[n, m, 1], out[n, m, 2] = twice * x, twice * y, twice * z
            for j in range(3):
                out[n, m, 3 + j] = history[i, V + j] - nominal[i + 1, V + j]
            out[n, m, 6] = (history[i, LAT] - nominal[i + 1, LAT]) * north
            out[n, m, 7] = (history[i, LON] - nominal[i + 1, LON]) * east
            out[n, m, 8] = nominal[i + 1, ALT] - history[i, ALT]
    return whole

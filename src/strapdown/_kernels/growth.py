"""From the dynamics of errors to their transition and their noise over a step.

Matrices are padded with zeros, to rows by threes and columns by fours (`padded`), so that rows are
added to rows three at a time and a processor takes several numbers of them at once. Of n states
the first nine have dynamics F, (9, n); each of the others decays by itself.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numba import njit

CORE = 9
SIXTH = 1.0 / 6.0
# Numbers in a line of the cache.
LINE = 8


@njit(cache=True)
def padded(n):
    """Rows and columns of a padded matrix of n states."""
    rows = (n + 2) // 3 * 3
    return rows, (rows + 3) // 4 * 4


def growth_room(n: int) -> tuple[Any, ...]:
    """Arrays to work in, for n states."""
    rows, width = padded(n)
    return side_by_side([(m, width) for m in (9, 9, 9, 9, 9, 6, 6, 9, rows)])


def side_by_side(shapes: Sequence[tuple[int, int]]) -> tuple[Any, ...]:
    """Return arrays of zeros in one block, each from the begin of a line of the cache on.

    Four numbers that a processor takes at once are then never of two lines.
    """
    sizes = [-(-a * b // LINE) * LINE for a, b in shapes]
    whole = np.zeros(sum(sizes) + LINE)
    at = -whole.ctypes.data % (8 * LINE) // 8
    out = []
    for (a, b), size in zip(shapes, sizes, strict=True):
        out.append(whole[at : at + a * b].reshape(a, b))
        at += size
    return tuple(out)


@njit(cache=True, error_model="numpy", fastmath={"contract"}, inline="always")
def add_block(out, i, left, m, rows):
    """Add to three rows of `out` from i on the block (i, m) of `left` times three rows from m on.

    A block of zeros costs nothing.
    """
    a0, a1, a2 = left[i, m], left[i, m + 1], left[i, m + 2]
    b0, b1, b2 = left[i + 1, m], left[i + 1, m + 1], left[i + 1, m + 2]
    c0, c1, c2 = left[i + 2, m], left[i + 2, m + 1], left[i + 2, m + 2]
    if (
        a0 != 0.0
        or a1 != 0.0
        or a2 != 0.0
        or b0 != 0.0
        or b1 != 0.0
        or b2 != 0.0
        or c0 != 0.0
        or c1 != 0.0
        or c2 != 0.0
    ):
        for j in range(rows.shape[1]):
            x, y, z = rows[m, j], rows[m + 1, j], rows[m + 2, j]
            out[i, j] += a0 * x + a1 * y + a2 * z
            out[i + 1, j] += b0 * x + b1 * y + b2 * z
            out[i + 2, j] += c0 * x + c1 * y + c2 * z


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def powers(f, decay, dt, one, two, three):
    """Fill the core's rows of F dt and of its square and cube; `f` and they are (9, w)."""
    k = decay.shape[0]
    for i in range(CORE):
        for j in range(f.shape[1]):
            one[i, j] = dt * f[i, j]
            two[i, j] = 0.0
            three[i, j] = 0.0
    for i in range(0, CORE, 3):
        for m in range(0, CORE, 3):
            add_block(two, i, one, m, one)
    for j in range(k):
        fading = -decay[j] * dt
        if fading != 0.0:
            for i in range(CORE):
                two[i, CORE + j] += fading * one[i, CORE + j]
                three[i, CORE + j] += fading * fading * one[i, CORE + j]
    for i in range(0, CORE, 3):
        for m in range(0, CORE, 3):
            add_block(three, i, one, m, two)


@njit(cache=True, error_model="numpy", fastmath={"contract"}, inline="always")
def series(one, two, three, whole, half):
    """Fill ``exp(F dt)`` and ``exp(F dt/2)`` to third order from the powers of F dt."""
    for i in range(CORE):
        for j in range(one.shape[1]):
            a, b, c = one[i, j], two[i, j], three[i, j]
            whole[i, j] = a + 0.5 * b + SIXTH * c
            half[i, j] = 0.5 * a + 0.125 * b + 0.125 * SIXTH * c
        whole[i, i] += 1.0
        half[i, i] += 1.0


@njit(cache=True, error_model="numpy", fastmath={"contract"}, inline="always")
def weighted_by_noise(lift, at, matrix, noise, dt, turned, out, to):
    """Fill three columns of `out` with those of `lift` from `at` on times ``C diag(noise²) C' dt``.

    `turned` (6, w) is room to work in.
    """
    if noise[0] == noise[1] and noise[1] == noise[2]:
        # C C' is one.
        scale = dt * noise[0] * noise[0]
        for i in range(CORE):
            for j in range(3):
                out[i, to + j] = scale * lift[i, at + j]
        return
    for i in range(3):
        for j in range(3):
            total = 0.0
            for m in range(3):
                total += matrix[i, m] * matrix[j, m] * noise[m] * noise[m]
            turned[i, j] = dt * total
    for i in range(CORE):
        for j in range(3):
            out[i, to + j] = (
                lift[i, at] * turned[0, j]
                + lift[i, at + 1] * turned[1, j]
                + lift[i, at + 2] * turned[2, j]
            )


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def growth_of_step(f, decay, dt, matrix, gyro_noise, accel_noise, drive, still, phi, tail, q, room):
    """Fill transition and noise of a step of dynamics f, (9, w).

    `phi` (9, w) takes the core's rows of ``exp(F dt)`` to third order, as drift reaches the place
    through tilt and velocity; `tail` (k,) the exact decay of the others. `q` (rows, w) takes the
    covariance that white noise adds, of which only the upper half is filled: it
    enters at the middle of the step, ``exp(F dt/2) G q G' exp(F dt/2)' dt``, which holds its
    correlations to second order and is positive semidefinite. `matrix` is C_lb; rows that are
    `still`, a bit each, take no noise. `room` is of `growth_room`.
    """
    k, w = decay.shape[0], f.shape[1]
    one, two, three, lift, weighted, across, turned, _, _ = room
    powers(f, decay, dt, one, two, three)
    series(one, two, three, phi, lift)
    for i in range(CORE):
        if still & (1 << i):
            for j in range(w):
                lift[i, j] = 0.0
    weighted_by_noise(lift, 3, matrix, accel_noise, dt, turned, weighted, 0)
    weighted_by_noise(lift, 6, matrix, gyro_noise, dt, turned, weighted, 3)
    for m in range(6):
        for j in range(w):
            across[m, j] = 0.0
        for i in range(CORE):
            across[m, i] = lift[i, 3 + m]
    for i in range(q.shape[0]):
        for j in range(w):
            q[i, j] = 0.0
    for i in range(0, CORE, 3):
        for at in range(0, 6, 3):
            add_block(q, i, weighted, at, across)
    for j in range(k):
        tail[j] = math.exp(-decay[j] * dt) if decay[j] != 0.0 else 1.0
        if drive[j] != 0.0:
            spread = dt * drive[j] * drive[j]
            own = math.exp(-0.5 * decay[j] * dt)
            for i in range(CORE):
                share = spread * lift[i, CORE + j]
                if share != 0.0:
                    for m in range(CORE):
                        q[i, m] += share * lift[m, CORE + j]
                    q[i, CORE + j] += share * own
            q[CORE + j, CORE + j] += spread * own * own


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def grown_covariance(P, phi, tail, q, out, room):
    """Fill ``Phi P Phi' + Q``, exactly symmetric; all are padded, `room` is of `growth_room`.

    Return -1, or the first state whose variance is no number or negative.
    """
    k, rows, w = tail.shape[0], P.shape[0], P.shape[1]
    n = CORE + k
    half, turned = room[7], room[8]
    for i in range(rows):
        for j in range(w):
            turned[i, j] = 0.0
    for i in range(CORE):
        for j in range(n):
            turned[j, i] = phi[i, j]
        for j in range(w):
            half[i, j] = 0.0
            out[i, j] = q[i, j]
    for i in range(0, CORE, 3):
        for m in range(0, rows, 3):
            add_block(half, i, phi, m, P)
    for j in range(k):
        turned[CORE + j, CORE + j] = tail[j]
    for i in range(0, CORE, 3):
        for m in range(0, rows, 3):
            add_block(out, i, half, m, turned)
    bad = -1
    for i in range(n):
        if i >= CORE:
            for j in range(i, n):
                out[i, j] = tail[i - CORE] * tail[j - CORE] * P[i, j] + q[i, j]
        for j in range(i):
            out[i, j] = out[j, i]
        if bad < 0 and not 0.0 <= out[i, i] < math.inf:
            bad = i
    return bad


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def compose_growth(step, tail, added, phi, q, work):
    """Let a step follow: ``phi <- step phi`` and ``q <- step q step' + added``.

    `phi`, `q` and `work` are (n, n); `step` (9, w), `tail` (k,) and `added` are of
    `growth_of_step`.
    """
    n = phi.shape[0]
    for i in range(n):
        for j in range(n):
            total = 0.0
            if i < CORE:
                for m in range(n):
                    total += step[i, m] * phi[m, j]
            else:
                total = tail[i - CORE] * phi[i, j]
            work[i, j] = total
    phi[:, :] = work
    for i in range(n):
        for j in range(n):
            total = 0.0
            if i < CORE:
                for m in range(n):
                    total += step[i, m] * q[m, j]
            else:
                total = tail[i - CORE] * q[i, j]
            work[i, j] = total
    for i in range(n):
        for j in range(i, n):
            total = added[i, j]
            if j < CORE:
                for m in range(n):
                    total += work[i, m] * step[j, m]
            else:
                total += work[i, j] * tail[j - CORE]
            q[i, j] = q[j, i] = total

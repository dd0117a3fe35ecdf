"""From the dynamics of errors to their transition and their noise over a step.

Of n states the first nine, the core, have dynamics F, (9, n); each of the others decays by itself.
The core is position, velocity and attitude in this order; the attitude depends on itself and on the
sensors alone: the blocks (position, attitude), (attitude, position) and (attitude, velocity) of F
are zero.

Matrices of the core's rows are kept in panels, (panels, 9 LANES): sixteen columns each; row i
begins at ``16 i`` and unused columns are zero. The fixed size lets the compiler take several
columns at once in loops that stay in registers; therefore they are written out.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from strapdown._kernels.compilation import IN_PLACE, njit
from strapdown._kernels.covariance import EPSILON, not_finite

CORE = 9
SIXTH = 1.0 / 6.0
# Columns of a panel, and numbers in it.
LANES = 16
PANEL = CORE * LANES
# Columns of velocity and attitude, by which white noise enters; the first sensor's.
VELOCITY, ATTITUDE, SENSORS = 3, 6, 9
# Columns of white noise; of the core with it, made even.
WHITE, WITHOUT_SENSORS = 6, 16
# Sensor states treated with the core: a bias of each axis of two triads.
WITH_CORE = 6


def padded_width(n: int) -> int:
    """Columns of a matrix of dynamics of n states, which are zero beyond n."""
    return -(-n // LANES) * LANES


def growth_arrays(n: int) -> tuple[Any, ...]:
    """Arrays that `growth_of_step` fills, for n states.

    Panels of the transition and of the map of noise to the end of the step; per column, in rows
    of LANES, the variance that enters by it; decay of the sensors over the step (k,), and over its
    second half.
    """
    count = padded_width(n) // LANES
    return (
        np.zeros((count, PANEL)),
        np.zeros((count, PANEL)),
        np.zeros((count, LANES)),
        np.ones(n - CORE),
        np.ones(n - CORE),
    )


def growth_room(n: int) -> tuple[Any, ...]:
    """Work arrays for n states: three of panels, their fading, a covariance in panels."""
    count = padded_width(n) // LANES
    return (
        np.zeros((count, PANEL)),
        np.zeros((count, PANEL)),
        np.zeros((count, PANEL)),
        np.zeros((count, LANES)),
        np.zeros((count, (n + 3) // 4 * 4, LANES)),
    )


@njit(**IN_PLACE, forceinline=True)
def driven(a, x0, x1, x2, x3, x4, x5, x6, x7, x8):
    """Change of the core by F, whose first panel is `a`: nine numbers of nine."""
    return (
        a[0] * x0 + a[1] * x1 + a[2] * x2 + a[3] * x3 + a[4] * x4 + a[5] * x5,
        a[16] * x0 + a[17] * x1 + a[18] * x2 + a[19] * x3 + a[20] * x4 + a[21] * x5,
        a[32] * x0 + a[33] * x1 + a[34] * x2 + a[35] * x3 + a[36] * x4 + a[37] * x5,
        (a[48] * x0 + a[49] * x1 + a[50] * x2 + a[51] * x3 + a[52] * x4 + a[53] * x5)
        + (a[54] * x6 + a[55] * x7 + a[56] * x8),
        (a[64] * x0 + a[65] * x1 + a[66] * x2 + a[67] * x3 + a[68] * x4 + a[69] * x5)
        + (a[70] * x6 + a[71] * x7 + a[72] * x8),
        (a[80] * x0 + a[81] * x1 + a[82] * x2 + a[83] * x3 + a[84] * x4 + a[85] * x5)
        + (a[86] * x6 + a[87] * x7 + a[88] * x8),
        a[102] * x6 + a[103] * x7 + a[104] * x8,
        a[118] * x6 + a[119] * x7 + a[120] * x8,
        a[134] * x6 + a[135] * x7 + a[136] * x8,
    )


@njit(**IN_PLACE, forceinline=True)
def to_third_order(x, y, z):
    """``exp(F dt)`` and ``exp(F dt/2)``, each less one, of F dt, its square and its cube."""
    return x + 0.5 * y + SIXTH * z, 0.5 * x + 0.125 * y + 0.125 * SIXTH * z


@njit(**IN_PLACE, forceinline=True)
def series(a, one, fading, whole, half):
    """Fill a panel of ``exp(F dt)`` and of ``exp(F dt/2)``, less one, to third order.

    `one` is the panel of F dt, `a` its first panel; `fading` is the decay that multiplies a column.
    """
    for j in range(LANES):
        d = fading[j]
        x0, x1, x2 = one[j], one[16 + j], one[32 + j]
        x3, x4, x5 = one[48 + j], one[64 + j], one[80 + j]
        x6, x7, x8 = one[96 + j], one[112 + j], one[128 + j]
        y0, y1, y2, y3, y4, y5, y6, y7, y8 = driven(a, x0, x1, x2, x3, x4, x5, x6, x7, x8)
        y0, y1, y2 = y0 + d * x0, y1 + d * x1, y2 + d * x2
        y3, y4, y5 = y3 + d * x3, y4 + d * x4, y5 + d * x5
        y6, y7, y8 = y6 + d * x6, y7 + d * x7, y8 + d * x8
        z0, z1, z2, z3, z4, z5, z6, z7, z8 = driven(a, y0, y1, y2, y3, y4, y5, y6, y7, y8)
        d *= d
        z0, z1, z2 = z0 + d * x0, z1 + d * x1, z2 + d * x2
        z3, z4, z5 = z3 + d * x3, z4 + d * x4, z5 + d * x5
        z6, z7, z8 = z6 + d * x6, z7 + d * x7, z8 + d * x8
        whole[j], half[j] = to_third_order(x0, y0, z0)
        whole[16 + j], half[16 + j] = to_third_order(x1, y1, z1)
        whole[32 + j], half[32 + j] = to_third_order(x2, y2, z2)
        whole[48 + j], half[48 + j] = to_third_order(x3, y3, z3)
        whole[64 + j], half[64 + j] = to_third_order(x4, y4, z4)
        whole[80 + j], half[80 + j] = to_third_order(x5, y5, z5)
        whole[96 + j], half[96 + j] = to_third_order(x6, y6, z6)
        whole[112 + j], half[112 + j] = to_third_order(x7, y7, z7)
        whole[128 + j], half[128 + j] = to_third_order(x8, y8, z8)


@njit(**IN_PLACE)
def turn_columns(panel, at, matrix):
    """Multiply the three columns of a panel from `at` on by a matrix, (3, 3)."""
    for i in range(at, at + PANEL, LANES):
        x, y, z = panel[i], panel[i + 1], panel[i + 2]
        panel[i] = x * matrix[0, 0] + y * matrix[1, 0] + z * matrix[2, 0]
        panel[i + 1] = x * matrix[0, 1] + y * matrix[1, 1] + z * matrix[2, 1]
        panel[i + 2] = x * matrix[0, 2] + y * matrix[1, 2] + z * matrix[2, 2]


@njit(**IN_PLACE)
def growth_of_step(f, decay, dt, matrix, gyro_noise, accel_noise, drive, still, growth, room):
    """Fill transition and noise of a step of dynamics f, (9, `padded_width`).

    The transition in `growth` (`growth_arrays`) has the core's rows of ``exp(F dt)`` to third
    order, as drift reaches the position through tilt and velocity, and the exact decay of the
    others. White noise enters at the middle of the step: its covariance is ``exp(F dt/2) G q G'
    exp(F dt/2)' dt``, which holds its correlations to second order and is positive semidefinite;
    `growth` takes its factors, lift and variances. `matrix` is C_lb; rows in the bits of `still`
    take no noise. `room` is of `growth_room`.
    """
    phi, lift, weight, tail, own = growth
    one, _, _, fading, _ = room
    count = phi.shape[0]
    for p in range(count):
        panel = one[p]
        for i in range(CORE):
            row = f[i, LANES * p : LANES * p + LANES]
            for j in range(LANES):
                panel[LANES * i + j] = dt * row[j]
    for s in range(decay.shape[0]):
        p, j = (SENSORS + s) // LANES, (SENSORS + s) % LANES
        faded = -decay[s] * dt
        fading[p, j] = faded
        weight[p, j] = dt * drive[s] * drive[s]
        if faded != 0.0:
            tail[s], own[s] = math.exp(faded), math.exp(0.5 * faded)
    for p in range(count):
        series(one[0], one[p], fading[p], phi[p], lift[p])
    for i in range(CORE):
        phi[0, (LANES + 1) * i] += 1.0
        lift[0, (LANES + 1) * i] += 1.0
    for j in range(3):
        weight[0, VELOCITY + j] = dt * accel_noise[j] * accel_noise[j]
        weight[0, ATTITUDE + j] = dt * gyro_noise[j] * gyro_noise[j]
    # Noise equal in all body axes is equal in all level axes.
    if accel_noise[0] != accel_noise[1] or accel_noise[1] != accel_noise[2]:
        turn_columns(lift[0], VELOCITY, matrix)
    if gyro_noise[0] != gyro_noise[1] or gyro_noise[1] != gyro_noise[2]:
        turn_columns(lift[0], ATTITUDE, matrix)
    if still:
        for i in range(CORE):
            if still & (1 << i):
                for p in range(count):
                    for j in range(LANES):
                        lift[p, LANES * i + j] = 0.0


@njit(**IN_PLACE, forceinline=True)
def add_product(a, m, first, second, third, fourth, out):
    """Add to a panel the columns m to m + 3 of panel `a` times four rows of LANES."""
    a0, a1, a2, a3 = a[m], a[m + 1], a[m + 2], a[m + 3]
    b0, b1, b2, b3 = a[m + 16], a[m + 17], a[m + 18], a[m + 19]
    c0, c1, c2, c3 = a[m + 32], a[m + 33], a[m + 34], a[m + 35]
    d0, d1, d2, d3 = a[m + 48], a[m + 49], a[m + 50], a[m + 51]
    e0, e1, e2, e3 = a[m + 64], a[m + 65], a[m + 66], a[m + 67]
    f0, f1, f2, f3 = a[m + 80], a[m + 81], a[m + 82], a[m + 83]
    g0, g1, g2, g3 = a[m + 96], a[m + 97], a[m + 98], a[m + 99]
    h0, h1, h2, h3 = a[m + 112], a[m + 113], a[m + 114], a[m + 115]
    i0, i1, i2, i3 = a[m + 128], a[m + 129], a[m + 130], a[m + 131]
    for j in range(LANES):
        w, x, y, z = first[j], second[j], third[j], fourth[j]
        out[j] += a0 * w + a1 * x + a2 * y + a3 * z
        out[16 + j] += b0 * w + b1 * x + b2 * y + b3 * z
        out[32 + j] += c0 * w + c1 * x + c2 * y + c3 * z
        out[48 + j] += d0 * w + d1 * x + d2 * y + d3 * z
        out[64 + j] += e0 * w + e1 * x + e2 * y + e3 * z
        out[80 + j] += f0 * w + f1 * x + f2 * y + f3 * z
        out[96 + j] += g0 * w + g1 * x + g2 * y + g3 * z
        out[112 + j] += h0 * w + h1 * x + h2 * y + h3 * z
        out[128 + j] += i0 * w + i1 * x + i2 * y + i3 * z


@njit(**IN_PLACE, forceinline=True)
def times_covariance(phi, P, wide, out):
    """Fill the panels of ``Phi P``; `wide` takes P in panels, (panels, rows by fours, LANES)."""
    n = P.shape[0]
    for p in range(wide.shape[0]):
        end = min(n - LANES * p, LANES)
        for m in range(n):
            row = P[m, LANES * p : LANES * p + end]
            for j in range(end):
                wide[p, m, j] = row[j]
    for p in range(wide.shape[0]):
        part, panel = wide[p], out[p]
        for j in range(PANEL):
            panel[j] = 0.0
        for q in range(phi.shape[0]):
            at = LANES * q
            for m in range(0, min(part.shape[0] - at, LANES), 4):
                i = at + m
                add_product(phi[q], m, part[i], part[i + 1], part[i + 2], part[i + 3], panel)


@njit(**IN_PLACE, forceinline=True)
def core_products(a, b, c, d, P):
    """Fill the upper half of the core of P: rows of panel a times rows of b, of c times d.

    Of a and b the core's columns and six sensors', of c and d those of velocity and attitude.
    """
    for i in range(CORE):
        at = LANES * i
        a0, a1, a2, a3, a4 = a[at], a[at + 1], a[at + 2], a[at + 3], a[at + 4]
        a5, a6, a7, a8, a9 = a[at + 5], a[at + 6], a[at + 7], a[at + 8], a[at + 9]
        a10, a11, a12, a13, a14 = a[at + 10], a[at + 11], a[at + 12], a[at + 13], a[at + 14]
        c3, c4, c5 = c[at + 3], c[at + 4], c[at + 5]
        c6, c7, c8 = c[at + 6], c[at + 7], c[at + 8]
        for k in range(i, CORE):
            at = LANES * k
            P[i, k] = (
                (a0 * b[at] + a1 * b[at + 1] + a2 * b[at + 2])
                + (a3 * b[at + 3] + a4 * b[at + 4] + a5 * b[at + 5])
                + (a6 * b[at + 6] + a7 * b[at + 7] + a8 * b[at + 8])
                + (a9 * b[at + 9] + a10 * b[at + 10] + a11 * b[at + 11])
                + (a12 * b[at + 12] + a13 * b[at + 13] + a14 * b[at + 14])
                + (c3 * d[at + 3] + c4 * d[at + 4] + c5 * d[at + 5])
                + (c6 * d[at + 6] + c7 * d[at + 7] + c8 * d[at + 8])
            )


@njit(**IN_PLACE)
def add_column_products(a, b, scale, j, P):
    """Add to the upper half of the core of P a column of panel a times the same of b."""
    for i in range(CORE):
        factor = scale * a[LANES * i + j]
        for k in range(i, CORE):
            P[i, k] += factor * b[LANES * k + j]


@njit(**IN_PLACE)
def grown_covariance(P, growth, room):
    """Replace P by ``Phi P Phi' + Q``, exactly symmetric; `growth` is of `growth_of_step`.

    Return -1, or the first state whose variance is not a number or is negative.
    """
    phi, lift, weight, tail, own = growth
    _, half, weighted, _, wide = room
    n, k = P.shape[0], tail.shape[0]
    times_covariance(phi, P, wide, half)
    noisy, entering, by = weighted[0], lift[0], weight[0]
    for i in range(CORE):
        for j in range(LANES):
            noisy[LANES * i + j] = entering[LANES * i + j] * by[j]
    core_products(half[0], phi[0], noisy, entering, P)
    for s in range(k):
        p, j = (SENSORS + s) // LANES, (SENSORS + s) % LANES
        if s >= WITH_CORE:
            add_column_products(half[p], phi[p], 1.0, j, P)
        spread, at = weight[p, j], SENSORS + s
        for i in range(CORE):
            P[i, at] = half[p, LANES * i + j] * tail[s]
        for m in range(s, k):
            P[at, SENSORS + m] *= tail[s] * tail[m]
        if spread != 0.0:
            add_column_products(lift[p], lift[p], spread, j, P)
            for i in range(CORE):
                P[i, at] += spread * own[s] * lift[p, LANES * i + j]
            P[at, at] += spread * own[s] * own[s]
    bad = -1
    for i in range(n):
        for j in range(i):
            P[i, j] = P[j, i]
        if bad < 0 and not 0.0 <= P[i, i] < math.inf:
            bad = i
    return bad


def factor_room(n: int) -> tuple[Any, ...]:
    """Work arrays of `grown_factors`: columns to orthogonalize, and rows of numbers of each."""
    columns, rows = WITHOUT_SENSORS + 2 * (n - CORE), (n + 3) // 4 * 4
    return np.zeros((columns, rows)), np.zeros((5, max(columns, rows)))


@njit(**IN_PLACE, forceinline=True)
def orthogonalize(columns, work, last, stop, at, end, ud):
    """Turn the rows `last` down to `stop` of a matrix W, given by columns, into U and D, in place.

    Modified weighted Gram-Schmidt (Bierman 1977, Section VI.4) over the columns from `at` to
    `end`, an even number; the others are zero in these rows. A row that others explain to rounding
    leaves D = 0 and no direction. Four rows are treated at once; that those are changed, too, which
    are done with, does no harm.
    """
    d, own, weighted, whole, share = work[0], work[1], work[2], work[3], work[4]
    for i in range(0, last + 1, 4):
        s0 = s1 = s2 = s3 = 0.0
        for c in range(at, end):
            column = columns[c]
            s0 += d[c] * (column[i] * column[i])
            s1 += d[c] * (column[i + 1] * column[i + 1])
            s2 += d[c] * (column[i + 2] * column[i + 2])
            s3 += d[c] * (column[i + 3] * column[i + 3])
        whole[i], whole[i + 1], whole[i + 2], whole[i + 3] = s0, s1, s2, s3
    for j in range(last, stop - 1, -1):
        s0 = s1 = 0.0
        for c in range(at, end, 2):
            x, y = columns[c, j], columns[c + 1, j]
            own[c], own[c + 1] = x, y
            weighted[c], weighted[c + 1] = d[c] * x, d[c + 1] * y
            s0 += weighted[c] * x
            s1 += weighted[c + 1] * y
        total = s0 + s1
        if total <= (end - at) * EPSILON * EPSILON * whole[j]:
            for i in range(j):
                ud[i, j] = 0.0
            ud[j, j] = 0.0
            continue
        ud[j, j] = total
        inverse = 1.0 / total
        for i in range(0, j, 4):
            s0 = s1 = s2 = s3 = t0 = t1 = t2 = t3 = 0.0
            for c in range(at, end, 2):
                column, w = columns[c], weighted[c]
                s0 += w * column[i]
                s1 += w * column[i + 1]
                s2 += w * column[i + 2]
                s3 += w * column[i + 3]
                column, w = columns[c + 1], weighted[c + 1]
                t0 += w * column[i]
                t1 += w * column[i + 1]
                t2 += w * column[i + 2]
                t3 += w * column[i + 3]
            s0, s1 = inverse * (s0 + t0), inverse * (s1 + t1)
            s2, s3 = inverse * (s2 + t2), inverse * (s3 + t3)
            share[i], share[i + 1], share[i + 2], share[i + 3] = s0, s1, s2, s3
            for c in range(at, end):
                part, x = columns[c, i : i + 4], own[c]
                part[0], part[1], part[2], part[3] = (
                    part[0] - s0 * x,
                    part[1] - s1 * x,
                    part[2] - s2 * x,
                    part[3] - s3 * x,
                )
        for i in range(j):
            ud[i, j] = share[i]


@njit(**IN_PLACE, forceinline=True)
def core_of_column(turned, ud, j, column):
    """Fill the core's numbers of column j of ``Phi U``; `turned` has the columns of Phi as rows."""
    row = turned[j]
    a0, a1, a2, a3 = row[0], row[1], row[2], row[3]
    a4, a5, a6, a7, a8 = row[4], row[5], row[6], row[7], row[8]
    for m in range(j):
        row, u = turned[m], ud[m, j]
        a0 += u * row[0]
        a1 += u * row[1]
        a2 += u * row[2]
        a3 += u * row[3]
        a4 += u * row[4]
        a5 += u * row[5]
        a6 += u * row[6]
        a7 += u * row[7]
        a8 += u * row[8]
    column[0], column[1], column[2], column[3] = a0, a1, a2, a3
    column[4], column[5], column[6], column[7], column[8] = a4, a5, a6, a7, a8


@njit(**IN_PLACE)
def grown_factors(ud, growth, room, columns, work):
    """Replace the factors of P by those of ``Phi P Phi' + Q`` (Thornton, by blocks).

    P = U D U'; an array holds U above its diagonal and D on it. Constant sensors at the end keep
    their rows of U and D, and their columns are those of Phi U. What is left, the core and the
    sensors before, is orthogonalized as ``[Phi U, G]``, where G are the columns by which noise
    enters. `growth` is of `growth_of_step`, `columns` and `work` of `factor_room`.

    Return -1, or the first state whose variance is not finite.
    """
    phi, lift, weight, tail, own = growth
    turned = room[4][0]
    k, rows = tail.shape[0], columns.shape[1]
    for m in range(ud.shape[0]):
        panel, at = phi[m // LANES], m % LANES
        for i in range(CORE):
            turned[m, i] = panel[LANES * i + at]
    taking = 0
    for s in range(k):
        if tail[s] != 1.0 or weight[(SENSORS + s) // LANES, (SENSORS + s) % LANES] != 0.0:
            taking = s + 1
    d, done = work[0], work[1]
    end = WITHOUT_SENSORS + 2 * taking
    if taking > 0:
        for c in range(end):
            for i in range(CORE, rows):
                columns[c, i] = 0.0
    for j in range(CORE):
        core_of_column(turned, ud, j, columns[j])
        d[j] = ud[j, j]
    # Six columns of white noise, and one to make their number even.
    for j in range(WHITE):
        column = columns[CORE + j]
        for i in range(CORE):
            column[i] = lift[0, LANES * i + VELOCITY + j]
        d[CORE + j] = weight[0, VELOCITY + j]
    for i in range(CORE):
        columns[CORE + WHITE, i] = 0.0
    d[CORE + WHITE] = 0.0
    for s in range(taking):
        p, at, j = (SENSORS + s) // LANES, (SENSORS + s) % LANES, SENSORS + s
        column, noisy = columns[WITHOUT_SENSORS + s], columns[WITHOUT_SENSORS + taking + s]
        core_of_column(turned, ud, j, column)
        for m in range(s):
            column[SENSORS + m] = tail[m] * ud[SENSORS + m, j]
        for i in range(CORE):
            noisy[i] = lift[p, LANES * i + at]
        column[j], noisy[j] = tail[s], own[s]
        d[WITHOUT_SENSORS + s] = ud[j, j]
        d[WITHOUT_SENSORS + taking + s] = weight[p, at]
    for j in range(SENSORS + taking, SENSORS + k):
        core_of_column(turned, ud, j, done)
        # A known quantity has no direction, which would grow to no end.
        by = 1.0 if ud[j, j] != 0.0 else 0.0
        for i in range(CORE):
            ud[i, j] = by * done[i]
        for m in range(taking):
            ud[SENSORS + m, j] *= by * tail[m]
    if taking == 0:
        orthogonalize(columns, work, CORE - 1, 0, 0, WITHOUT_SENSORS, ud)
    else:
        orthogonalize(columns, work, CORE + taking - 1, SENSORS, WITHOUT_SENSORS, end, ud)
        orthogonalize(columns, work, CORE - 1, 0, 0, end, ud)
    return not_finite(ud)


@njit(**IN_PLACE)
def unfold_growth(growth, Phi, Q):
    """Fill the transition and the covariance of noise of a step, (n, n) each."""
    phi, lift, weight, tail, own = growth
    n = Phi.shape[0]
    for i in range(n):
        for j in range(n):
            p, at = j // LANES, j % LANES
            Phi[i, j] = phi[p, LANES * i + at] if i < CORE else 0.0
            Q[i, j] = 0.0
        if i >= CORE:
            Phi[i, i] = tail[i - CORE]
    for m in range(VELOCITY, n):
        p, at = m // LANES, m % LANES
        spread = weight[p, at]
        if spread != 0.0:
            add_column_products(lift[p], lift[p], spread, at, Q)
            if m >= SENSORS:
                for i in range(CORE):
                    Q[i, m] += spread * own[m - CORE] * lift[p, LANES * i + at]
                Q[m, m] += spread * own[m - CORE] * own[m - CORE]
    for i in range(n):
        for j in range(i):
            Q[i, j] = Q[j, i]


@njit(**IN_PLACE)
def compose_growth(step, added, phi, q, work):
    """Append a step: ``phi <- step phi`` and ``q <- step q step' + added``; all are (n, n).

    Beyond the core `step` is diagonal.
    """
    n = phi.shape[0]
    for i in range(n):
        for j in range(n):
            total = 0.0
            if i < CORE:
                for m in range(n):
                    total += step[i, m] * phi[m, j]
            else:
                total = step[i, i] * phi[i, j]
            work[i, j] = total
    for i in range(n):
        for j in range(n):
            phi[i, j] = work[i, j]
    for i in range(n):
        for j in range(n):
            total = 0.0
            if i < CORE:
                for m in range(n):
                    total += step[i, m] * q[m, j]
            else:
                total = step[i, i] * q[i, j]
            work[i, j] = total
    for i in range(n):
        for j in range(i, n):
            total = added[i, j]
            if j < CORE:
                for m in range(n):
                    total += work[i, m] * step[j, m]
            else:
                total += work[i, j] * step[j, j]
            q[i, j] = q[j, i] = total

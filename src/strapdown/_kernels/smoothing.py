"""Fixed-interval smoother: the backward pass over the recorded history of a filter.

It carries the adjoint pair (l, L) back: the information of all later data on the errors,
``estimate = P l``, and the reduction of their covariance, ``P - P L P``, with the filter's
covariance P of that instant. Over a propagation ``l = Phi' l``, ``L = Phi' L Phi``: nothing is
inverted, whatever the noise was. Over an update the filter's covariance before it is inverted, in
units of its standard deviations.
"""

from __future__ import annotations

import math

import numpy as np

from strapdown._kernels.compilation import IN_PLACE, dot, njit
from strapdown._kernels.covariance import udu_matrix
from strapdown._kernels.growth import LANES as GROWTH_LANES
from strapdown._kernels.level import level_place

# Vector width: rows of matrices are padded with zeros to its multiple.
LANES = 8
# Pivot, relative to 1, below which a direction counts as exactly known: thousands of operations
# leave a rounding error of some 1e-14 in a covariance.
EXACT = 1e-12


@njit(cache=True)
def padded(n):
    """Columns of a work matrix for n errors."""
    return (n + LANES - 1) // LANES * LANES


@njit(cache=True, error_model="numpy")
def inverse(P, out):
    """Fill the inverse of a covariance; zero for exactly known directions."""
    n = P.shape[0]
    sd, lower = np.empty(n), np.zeros((n, n))
    for i in range(n):
        sd[i] = math.sqrt(P[i, i]) if P[i, i] > 0.0 else 0.0
    free = np.zeros(n, dtype=np.bool_)
    for j in range(n):
        if sd[j] == 0.0:
            continue
        pivot = 1.0
        for m in range(j):
            pivot -= lower[j, m] * lower[j, m]
        if pivot <= EXACT:
            continue
        free[j] = True
        lower[j, j] = math.sqrt(pivot)
        for i in range(j + 1, n):
            if sd[i] == 0.0:
                continue
            total = P[i, j] / (sd[i] * sd[j])
            for m in range(j):
                total -= lower[i, m] * lower[j, m]
            lower[i, j] = total / lower[j, j]
    # The inverse of the factor, and its square; without the rows that are not free.
    back = np.zeros((n, n))
    for j in range(n):
        if not free[j]:
            continue
        back[j, j] = 1.0 / lower[j, j]
        for i in range(j + 1, n):
            if not free[i]:
                continue
            total = 0.0
            for m in range(j, i):
                total -= lower[i, m] * back[m, j]
            back[i, j] = total / lower[i, i]
    for i in range(n):
        for j in range(i, n):
            total = 0.0
            for m in range(j, n):
                total += back[m, i] * back[m, j]
            if free[i] and free[j]:
                total /= sd[i] * sd[j]
            out[i, j] = out[j, i] = total


@njit(**IN_PLACE)
def product(A, B, n, out):
    """Fill ``A B``, (n, n) within padded matrices."""
    for i in range(n):
        for p in range(0, out.shape[1], LANES):
            for j in range(LANES):
                out[i, p + j] = 0.0
        for m in range(n):
            a = A[i, m]
            for p in range(0, out.shape[1], LANES):
                for j in range(LANES):
                    out[i, p + j] += a * B[m, p + j]


@njit(**IN_PLACE)
def sandwich(A, S, n, half, out):
    """Fill ``A S A'``, symmetric S, (n, n) within padded matrices; `half` is a work array."""
    product(A, S, n, half)
    for i in range(n):
        for j in range(i, n):
            out[i, j] = out[j, i] = dot(half[i], A[j], half.shape[1])


@njit(**IN_PLACE)
def unpack_growth(row, n, core, decay):
    """Fill the first rows of a transition, and the decay of the others, padded, from a row."""
    at = begin_of_move(n)
    for i in range(CORE):
        for j in range(n):
            core[i, j] = row[at]
            at += 1
    for i in range(CORE, n):
        decay[i] = row[at]
        at += 1


@njit(**IN_PLACE)
def estimate_of(row, told, n, out):
    """Fill ``P l`` with the covariance P of a row."""
    at = COVARIANCE
    for i in range(n):
        out[i] = 0.0
    for i in range(n):
        own = told[i]
        total = row[at] * own
        for j in range(1, n - i):
            out[i + j] += row[at + j] * own
            total += row[at + j] * told[i + j]
        out[i] += total
        at += n - i


@njit(**IN_PLACE)
def told_before_growth(core, decay, told, new):
    """Replace l by ``Phi' l``; vectors are padded."""
    for p in range(0, told.shape[0], LANES):
        for j in range(LANES):
            new[p + j] = decay[p + j] * told[p + j]
        for m in range(CORE):
            own = told[m]
            for j in range(LANES):
                new[p + j] += core[m, p + j] * own
    for j in range(told.shape[0]):
        told[j] = new[j]


@njit(**IN_PLACE)
def less_before_growth(core, decay, less, n, half):
    """Replace L by ``Phi' L Phi``, exactly symmetric; padded matrices, `half` to work in."""
    for i in range(n):
        a0, a1, a2 = less[i, 0], less[i, 1], less[i, 2]
        a3, a4, a5 = less[i, 3], less[i, 4], less[i, 5]
        a6, a7, a8 = less[i, 6], less[i, 7], less[i, 8]
        for p in range(0, less.shape[1], LANES):
            for j in range(p, p + LANES):
                half[i, j] = (
                    (decay[j] * less[i, j] + a0 * core[0, j] + a1 * core[1, j])
                    + (a2 * core[2, j] + a3 * core[3, j] + a4 * core[4, j])
                    + (a5 * core[5, j] + a6 * core[6, j])
                    + (a7 * core[7, j] + a8 * core[8, j])
                )
    for i in range(n):
        own = decay[i]
        a0, a1, a2 = core[0, i], core[1, i], core[2, i]
        a3, a4, a5 = core[3, i], core[4, i], core[5, i]
        a6, a7, a8 = core[6, i], core[7, i], core[8, i]
        for p in range(i // LANES * LANES, less.shape[1], LANES):
            for j in range(p, p + LANES):
                less[i, j] = (
                    (own * half[i, j] + a0 * half[0, j] + a1 * half[1, j])
                    + (a2 * half[2, j] + a3 * half[3, j] + a4 * half[4, j])
                    + (a5 * half[5, j] + a6 * half[6, j])
                    + (a7 * half[7, j] + a8 * half[8, j])
                )
    for i in range(n):
        for j in range(i):
            less[i, j] = less[j, i]


@njit(**IN_PLACE)
def before_carried(row, n, told, less, room):
    """Carry the adjoint pair back over a transformation of a triad's errors: its transpose."""
    back, half, new = room
    at = begin_of_move(n)
    first = int(row[at])
    for i in range(n):
        for j in range(n):
            back[j, i] = 1.0 if i == j else 0.0
            if first <= i < first + 3:
                back[j, i] = row[at + 1 + (i - first) * n + j]
    for i in range(n):
        total = 0.0
        for j in range(n):
            total += back[i, j] * told[j]
        new[i] = total
    sandwich(back, less, n, half, less)
    for i in range(n):
        told[i] = new[i]


@njit(cache=True, error_model="numpy")
def before_update(row, P, told, less, room):
    """Carry the adjoint pair back over an update with the covariance P after it."""
    n = P.shape[0]
    before, weight, A, half, added, new = room
    unpack(row, begin_of_move(n), before)
    inverse(before, weight)
    at = begin_of_taken(n)
    for i in range(n):
        for j in range(n):
            before[i, j] -= P[i, j]
    product(weight, P, n, A)
    for i in range(n):
        total = 0.0
        for j in range(n):
            total += weight[i, j] * row[at + j] + A[i, j] * told[j]
        new[i] = total
    sandwich(weight, before, n, half, added)
    sandwich(A, less, n, half, less)
    for i in range(n):
        told[i] = new[i]
        for j in range(n):
            less[i, j] += added[i, j]


@njit(cache=True, error_model="numpy")
def smooth_back(rows, n, told, less, wanted, estimates, covariances):
    """Go back over rows, from the last to the first.

    Parameters
    ----------
    rows : ndarray, (k, `row_width`)
    n : int
        Number of errors.
    told, less : ndarray, (`padded`,) and (n, `padded`)
        The adjoint pair after the last row; before the first one, when it is done.
    wanted : ndarray, (k,)
        Where the covariance goes in `covariances`, -1 where it is not wanted.
    estimates : ndarray, (k, n)
        Filled with the error that the filter's state after each has, by all data.
    covariances : ndarray, (m, n, n)
    """
    width = less.shape[1]
    P, before, weight = np.zeros((n, width)), np.zeros((n, width)), np.zeros((n, width))
    A, half, added = np.zeros((n, width)), np.zeros((n, width)), np.zeros((n, width))
    core, decay, new = np.zeros((CORE, width)), np.zeros(width), np.zeros(width)
    for k in range(rows.shape[0] - 1, -1, -1):
        row, kind = rows[k], rows[k, KIND]
        estimate_of(row, told, n, estimates[k])
        if wanted[k] >= 0 or kind == UPDATE:
            unpack(row, COVARIANCE, P)
        if wanted[k] >= 0:
            out = covariances[wanted[k]]
            sandwich(P, less, n, half, A)
            for i in range(n):
                for j in range(n):
                    out[i, j] = P[i, j] - A[i, j]
        if kind == GROWTH:
            unpack_growth(row, n, core, decay)
            told_before_growth(core, decay, told, new)
            less_before_growth(core, decay, less, n, half)
        elif kind == CARRIED:
            before_carried(row, n, told, less, (before, half, new))
        elif kind == UPDATE:
            before_update(row, P, told, less, (before, weight, A, half, added, new))
        else:
            told[:] = 0.0
            less[:, :] = 0.0


# History of a filter for its smoother, in rows: a begin, a propagation, an update, a
# transformation of the errors of a triad at one instant.
#
# Of n errors a row has its time, its kind, the rotation from north-east-down to level axes (C_ln,
# row by row), and the upper half of the covariance after it, row by row. From `begin_of_move` on, a
# propagation has the rows of its transition for position, velocity and attitude, and the decay of
# the other errors; an update has the upper half of the covariance before it, and the error that it
# removed; a transformation has the index of the first of three errors, and their rows of it.


# Kinds of rows: propagation, update, begin of a filter (independent of all before it), and
# transformation.
GROWTH, UPDATE, BEGIN, CARRIED = 0, 1, 2, 3
# Rows of a transition with more than a decay.
CORE = 9
# Indices of a row.
TIME, KIND, TURN, COVARIANCE = 0, 1, 2, 11


@njit(cache=True)
def begin_of_move(n):
    """Index in a row of n errors after the covariance."""
    return COVARIANCE + n * (n + 1) // 2


@njit(cache=True)
def begin_of_taken(n):
    """Index in an update's row after the covariance before it."""
    return begin_of_move(n) + n * (n + 1) // 2


@njit(cache=True)
def row_width(n):
    """Numbers in a row of n errors."""
    return max(begin_of_taken(n) + n, begin_of_move(n) + CORE * n + n - CORE)


@njit(**IN_PLACE)
def unpack(row, at, out):
    """Fill a symmetric matrix from its upper half, row by row, from an index of a row on."""
    n = out.shape[0]
    for i in range(n):
        for j in range(i, n):
            out[i, j] = out[j, i] = row[at]
            at += 1


@njit(**IN_PLACE)
def pack(matrix, row, at):
    """Write the upper half of a symmetric matrix, row by row, from an index of a row on."""
    n = matrix.shape[0]
    for i in range(n):
        for j in range(i, n):
            row[at] = 0.5 * (matrix[i, j] + matrix[j, i])
            at += 1


@njit(cache=True, error_model="numpy")
def pack_covariance(factored, covariance, P, row, at):
    """Write a covariance, a matrix or factors, from an index of a row on; P to work in."""
    if factored:
        udu_matrix(covariance, P)
        pack(P, row, at)
    else:
        pack(covariance, row, at)


@njit(cache=True, error_model="numpy")
def head_row(which, factored, states, time, kind, P, row):
    """Fill time, kind, rotation and covariance of a row; P, (n, n), to work in."""
    turn = row[TURN:COVARIANCE].reshape(3, 3)
    # Of either mechanization the turn is its own transpose.
    level_place(which, states[0], turn)
    row[TIME], row[KIND] = time, kind
    pack_covariance(factored, states[2], P, row, COVARIANCE)


@njit(cache=True, error_model="numpy")
def move_by_growth(growth, row, n):
    """Fill the part of a propagation (`growth.growth_of_step`) in a row of n errors."""
    phi, _, _, tail, _ = growth
    at = begin_of_move(n)
    for i in range(CORE):
        for j in range(n):
            row[at] = phi[j // GROWTH_LANES, GROWTH_LANES * i + j % GROWTH_LANES]
            at += 1
    for s in range(n - CORE):
        row[at] = tail[s]
        at += 1

"""A fixed-interval smoother's way back over what a filter kept: growths and updates.

It carries the adjoint pair (l, L) back: what the data from an instant on tell of the errors then,
``estimate = P l``, and how much less is unknown for it, ``P - P L P``, with the filter's covariance
P of that instant. Over a growth ``l = Phi' l``, ``L = Phi' L Phi``: nothing is inverted, whatever
the noise was. Over an update the filter's covariance before it is, in units of its deviations.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

# Of an entry: how the errors grew to it; what was observed at it; or that a filter begins with it,
# of which nothing before it is told.
GROWTH, UPDATE, BEGIN = 0, 1, 2
# Rows of a transition that are more than a decay.
CORE = 9
# A pivot, of 1, below which a direction is taken to be known exactly: rounding of a covariance that
# was made by thousands of operations is some 1e-14 of it.
EXACT = 1e-12


@njit(cache=True, error_model="numpy")
def unpack(packed, out):
    """Fill a symmetric matrix from its upper half, row by row."""
    n, at = out.shape[0], 0
    for i in range(n):
        for j in range(i, n):
            out[i, j] = out[j, i] = packed[at]
            at += 1


@njit(cache=True, error_model="numpy")
def pack(matrix, packed):
    """Fill the upper half of a symmetric matrix, row by row."""
    n, at = matrix.shape[0], 0
    for i in range(n):
        for j in range(i, n):
            packed[at] = 0.5 * (matrix[i, j] + matrix[j, i])
            at += 1


@njit(cache=True, error_model="numpy")
def inverse(P, out):
    """Fill the inverse of a covariance; zero for what it says is known exactly."""
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
    # The inverse of the factor, and of it the square; without the rows that are not free.
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


@njit(cache=True, error_model="numpy")
def sandwich(A, S, B, out):
    """Fill ``A S A' + B``, symmetric S and B."""
    n = S.shape[0]
    half = np.empty((n, n))
    for i in range(n):
        for j in range(n):
            half[i, j] = 0.0
        for m in range(n):
            a = A[i, m]
            if a != 0.0:
                for j in range(n):
                    half[i, j] += a * S[m, j]
    for i in range(n):
        for j in range(i, n):
            total = B[i, j]
            for m in range(n):
                total += half[i, m] * A[j, m]
            out[i, j] = out[j, i] = total


@njit(cache=True, error_model="numpy")
def transposed_growth(move, out):
    """Fill the transpose of a transition from its first rows and the decay of the others."""
    n = out.shape[0]
    for i in range(n):
        for j in range(n):
            out[j, i] = move[i * n + j] if i < CORE else 0.0
        if i >= CORE:
            out[i, i] = move[CORE * n + i - CORE]


@njit(cache=True, error_model="numpy")
def smooth_back(kind, packed, move, x, told, less, wanted, estimates, covariances):
    """Go back over entries, from the last to the first.

    Parameters
    ----------
    kind : ndarray, (k,)
    packed : ndarray, (k, n (n + 1)/2)
        Covariance after each.
    move : ndarray, (k, room)
        Of a growth its first rows and the decay of the others; of an update the covariance before.
    x : ndarray, (k, n)
        Of an update, the estimate that it took off.
    told, less : ndarray, (n,) and (n, n)
        The adjoint pair after the last entry; before the first one, when it is done.
    wanted : ndarray, (k,)
        Where the covariance goes in `covariances`, -1 where it is not wanted.
    estimates : ndarray, (k, n)
        Filled with the error that the filter's state after each has, by all data.
    covariances : ndarray, (m, n, n)
    """
    n = told.shape[0]
    P, A, B = np.empty((n, n)), np.empty((n, n)), np.empty((n, n))
    before, weight, zero = np.empty((n, n)), np.empty((n, n)), np.zeros((n, n))
    new = np.empty(n)
    for k in range(kind.shape[0] - 1, -1, -1):
        unpack(packed[k], P)
        for i in range(n):
            total = 0.0
            for j in range(n):
                total += P[i, j] * told[j]
            estimates[k, i] = total
        if wanted[k] >= 0:
            out = covariances[wanted[k]]
            sandwich(P, less, zero, out)
            for i in range(n):
                for j in range(n):
                    out[i, j] = P[i, j] - out[i, j]
        if kind[k] == GROWTH:
            transposed_growth(move[k], A)
            for i in range(n):
                total = 0.0
                for j in range(n):
                    total += A[i, j] * told[j]
                new[i] = total
            sandwich(A, less, zero, B)
        elif kind[k] == BEGIN:
            new[:] = 0.0
            B[:, :] = 0.0
        else:
            unpack(move[k], before)
            inverse(before, weight)
            for i in range(n):
                for j in range(n):
                    total = 0.0
                    for m in range(n):
                        total += weight[i, m] * P[m, j]
                    A[i, j] = total
                    before[i, j] -= P[i, j]
            for i in range(n):
                total = 0.0
                for j in range(n):
                    total += weight[i, j] * x[k, j] + A[i, j] * told[j]
                new[i] = total
            sandwich(weight, before, zero, B)
            sandwich(A, less, B, B)
        for i in range(n):
            told[i] = new[i]
            for j in range(n):
                less[i, j] = B[i, j]

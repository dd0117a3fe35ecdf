"""A covariance as ``P = U D U'``: factors, Gram-Schmidt, prediction.

U is unit upper triangular, D diagonal; an array (n, n) holds U above its diagonal, D on it and
zeros below. Formulas from Bierman (1977), Factorization Methods for Discrete Sequential Estimation.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from strapdown._kernels.given_arrays import dot

EPSILON = 2.0**-52
# What rounding leaves of a variance of one that is fully explained, in n roundings.
NOTHING = 8.0
# Further from semidefinite, as a correlation, is no rounding of who made the matrix.
INDEFINITE = 1e-9


@njit(cache=True, error_model="numpy")
def semidefinite_factor(P, G, d):
    """Write columns G, (n, n), and weights d, (n,), of ``P = G diag(d) G'``; return their number.

    Cholesky's factors with the largest remaining correlation as the pivot, which is stable for a
    matrix of any rank: without pivoting a small pivot that is mostly rounding would spoil
    all that follow. Where P is not finite or indefinite, return -1 - state. P is symmetric.
    """
    n = P.shape[0]
    C, sd, per_sd = np.zeros((n, n)), np.empty(n), np.zeros(n)
    left = np.ones(n, dtype=np.bool_)
    for i in range(n):
        if not 0.0 <= P[i, i] < math.inf:
            return -1 - i
        sd[i] = math.sqrt(P[i, i])
        if sd[i] > 0.0:
            per_sd[i] = 1.0 / sd[i]
    for i in range(n):
        d[i] = 0.0
        for j in range(n):
            G[i, j] = 0.0
            if P[i, j] != 0.0:
                C[i, j] = P[i, j] * per_sd[i] * per_sd[j]
                if not abs(C[i, j]) <= 1.0 + INDEFINITE:
                    return -1 - i
                if sd[i] == 0.0 or sd[j] == 0.0:
                    return -1 - (i if sd[i] == 0.0 else j)
        if sd[i] > 0.0:
            C[i, i] = 1.0
    rank = 0
    while rank < n:
        p, pivot = -1, NOTHING * n * EPSILON
        for i in range(n):
            if left[i] and C[i, i] > pivot:
                p, pivot = i, C[i, i]
        if p < 0:
            break
        left[p] = False
        d[rank] = pivot * P[p, p]
        G[p, rank] = 1.0
        for i in range(n):
            if left[i] and C[p, i] != 0.0:
                share = C[p, i] / pivot
                G[i, rank] = share * sd[i] * per_sd[p]
                for j in range(n):
                    C[i, j] -= share * C[p, j]
        rank += 1
    for i in range(n):
        if left[i]:
            for j in range(n):
                if left[j] and not abs(C[i, j]) <= INDEFINITE:
                    return -1 - i
    return rank


@njit(cache=True, error_model="numpy")
def udu_factor(P, out):
    """Write the U and D of a positive semidefinite P; return -1, or the state where it is not."""
    n = P.shape[0]
    G, d = np.empty((n, n)), np.empty(n)
    rank = semidefinite_factor(P, G, d)
    if rank < 0:
        return -1 - rank
    mwgs(G, d, out)
    return -1


@njit(cache=True, error_model="numpy")
def udu_matrix(ud, out):
    """Multiply the factors out: P, exactly symmetric."""
    n = ud.shape[0]
    for i in range(n):
        for j in range(i, n):
            total = ud[j, j] if i == j else ud[i, j] * ud[j, j]
            for k in range(j + 1, n):
                total += ud[i, k] * ud[k, k] * ud[j, k]
            out[i, j] = total
            out[j, i] = total


@njit(cache=True, error_model="numpy")
def mwgs(W, d, out):
    """Turn ``W diag(d) W'``, W (n, N), into U and D: modified weighted Gram-Schmidt.

    W is spoiled. D is a sum of squares times d: not negative where d is not (Bierman, VI.4).
    What is left of a row that others explain to rounding is nothing: D is 0, and no direction.
    """
    n, size = W.shape
    weighted, whole = np.empty(size), np.empty(n)
    for i in range(n):
        row = W[i]
        for k in range(size):
            weighted[k] = abs(d[k]) * row[k]
        whole[i] = dot(weighted, row, size)
    for j in range(n - 1, -1, -1):
        row = W[j]
        for k in range(size):
            weighted[k] = d[k] * row[k]
        total = dot(weighted, row, size)
        for i in range(j):
            out[j, i] = 0.0
        if abs(total) <= size * EPSILON * EPSILON * whole[j]:
            for i in range(j):
                out[i, j] = 0.0
            out[j, j] = 0.0
            continue
        out[j, j] = total
        inverse = 1.0 / total
        for i in range(j):
            other = W[i]
            share = inverse * dot(weighted, other, size)
            out[i, j] = share
            if share != 0.0:
                for k in range(size):
                    other[k] -= share * row[k]


@njit(cache=True, error_model="numpy")
def stacked(ud, Phi, Q, observations):
    """Return ``[Phi U, G]``, its weights, and the rank of Q (or -1 - state where it is indefinite).

    There is room for the columns of observations at the end, which are zero.
    """
    n = ud.shape[0]
    G, noise = np.empty((n, n)), np.empty(n)
    rank = semidefinite_factor(Q, G, noise)
    size = n + max(rank, 0) + observations
    W, d = np.zeros((n, size)), np.zeros(size)
    if rank < 0:
        return W, d, rank
    for i in range(n):
        row = W[i]
        for k in range(n):
            factor = Phi[i, k]
            if factor != 0.0:
                row[k] += factor
                for j in range(k + 1, n):
                    row[j] += factor * ud[k, j]
        for k in range(rank):
            row[n + k] = G[i, k]
        d[i] = ud[i, i]
    for k in range(rank):
        d[n + k] = noise[k]
    return W, d, rank


@njit(cache=True, error_model="numpy")
def udu_predict(ud, Phi, Q, out):
    """Write the factors of ``Phi U D U' Phi' + Q`` to `out` (Thornton; Bierman, Section VI.4).

    Return -1, or the state at which Q is indefinite, or whose variance is not finite.
    """
    W, d, rank = stacked(ud, Phi, Q, 0)
    if rank < 0:
        return -1 - rank
    mwgs(W, d, out)
    return not_finite(out)


@njit(cache=True, error_model="numpy", inline="always")
def not_finite(ud):
    """First state whose D is not finite, or -1."""
    for i in range(ud.shape[0]):
        if not math.isfinite(ud[i, i]):
            return i
    return -1

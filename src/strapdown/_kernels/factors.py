"""A covariance as ``P = U D U'``: factors, Gram-Schmidt, prediction.

U is unit upper triangular, D diagonal; an array (n, n) holds U above its diagonal, D on it and
zeros below. Formulas from Bierman (1977), Factorization Methods for Discrete Sequential Estimation.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

# A pivot that is this share of its variance, in n roundings, is what rounding left of zero.
NOTHING = 8.0
# Below zero it may be more: who made the matrix rounded as well.
BELOW = 1e3
EPSILON = 2.0**-52


@njit(cache=True, error_model="numpy")
def udu_factor(P, out):
    """Factor a positive semidefinite P, (n, n), of which the upper half is read.

    A state without variance gets zeros. Return -1, or the state at which P is seen to be
    indefinite or not finite.
    """
    n = P.shape[0]
    column = np.empty(n)
    for i in range(n):
        for j in range(i):
            out[i, j] = 0.0
        for j in range(i, n):
            out[i, j] = P[i, j]
    for j in range(n - 1, -1, -1):
        pivot, variance = out[j, j], P[j, j]
        if not (-BELOW * n * EPSILON * variance <= pivot < math.inf):
            return j
        if pivot <= NOTHING * n * EPSILON * variance:
            for i in range(j):
                if not abs(out[i, j]) <= math.sqrt(max(0.0, variance * P[i, i])):
                    return j
                out[i, j] = 0.0
            out[j, j] = 0.0
            continue
        for i in range(j):
            column[i] = out[i, j]
        for i in range(j):
            share = column[i] / pivot
            out[i, j] = share
            for k in range(i, j):
                out[i, k] -= share * column[k]
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


@njit(cache=True, error_model="numpy", fastmath={"reassoc", "contract", "nsz"})
def mwgs(W, d, out):
    """Turn ``W diag(d) W'``, W (n, N), into U and D: modified weighted Gram-Schmidt.

    W is spoiled. D is a sum of squares times d: not negative where d is not (Bierman, VI.4).
    """
    n, size = W.shape
    weighted = np.empty(size)
    for j in range(n - 1, -1, -1):
        row = W[j]
        total = 0.0
        for k in range(size):
            weighted[k] = d[k] * row[k]
            total += weighted[k] * row[k]
        for i in range(j):
            out[j, i] = 0.0
        out[j, j] = total
        inverse = 1.0 / total if total != 0.0 else 0.0
        for i in range(j):
            other = W[i]
            share = 0.0
            for k in range(size):
                share += weighted[k] * other[k]
            share *= inverse
            out[i, j] = share
            if share != 0.0:
                for k in range(size):
                    other[k] -= share * row[k]


@njit(cache=True, error_model="numpy")
def noise_rank(Q, noise):
    """Factor Q into `noise` and return how many of its pivots are not zero, or -1 - state."""
    bad = udu_factor(Q, noise)
    if bad >= 0:
        return -1 - bad
    rank = 0
    for k in range(Q.shape[0]):
        if noise[k, k] > 0.0:
            rank += 1
    return rank


@njit(cache=True, error_model="numpy")
def stacked(ud, Phi, noise, W, d):
    """Write ``[Phi U, G]`` to the first columns of W and its weights to d; the rest is zero."""
    n = W.shape[0]
    W[:] = 0.0
    d[:] = 0.0
    for i in range(n):
        row = W[i]
        for k in range(n):
            factor = Phi[i, k]
            if factor != 0.0:
                row[k] += factor
                for j in range(k + 1, n):
                    row[j] += factor * ud[k, j]
        d[i] = ud[i, i]
    at = n
    for k in range(n):
        if noise[k, k] > 0.0:
            for i in range(k):
                W[i, at] = noise[i, k]
            W[k, at] = 1.0
            d[at] = noise[k, k]
            at += 1


@njit(cache=True, error_model="numpy")
def udu_predict(ud, Phi, Q, out):
    """Write the factors of ``Phi U D U' Phi' + Q`` to `out` (Thornton; Bierman, Section VI.4).

    Return -1, or the state at which Q is indefinite, or whose variance is not finite.
    """
    n = ud.shape[0]
    rank = noise_rank(Q, out)
    if rank < 0:
        return -1 - rank
    W, d = np.empty((n, n + rank)), np.empty(n + rank)
    stacked(ud, Phi, out, W, d)
    mwgs(W, d, out)
    return not_finite(out)


@njit(cache=True, error_model="numpy", inline="always")
def not_finite(ud):
    """First state whose D is not finite, or -1."""
    for i in range(ud.shape[0]):
        if not math.isfinite(ud[i, i]):
            return i
    return -1

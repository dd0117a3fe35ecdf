"""A covariance kept as a symmetric matrix: propagation, and one observation after the other.

A step is ``K = P h' / (slope s + r)``, ``x + K moved`` and
``P <- (1 - slope K h) P (1 - slope K h)' + slope r K K'`` (Joseph), or the same with the gain's
optimality used up: ``P <- P - slope K (P h')'`` (plain).
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from strapdown._kernels.observation import expected, moved_state


@njit(cache=True, error_model="numpy")
def dense_predict(P, Phi, Q, out):
    """Write ``Phi P Phi' + Q`` to `out`, (n, n), exactly symmetric.

    Zeros of Phi cost nothing. Return -1, or the first state whose variance is no number or
    negative.
    """
    n = P.shape[0]
    turned = np.empty((n, n))
    # (Phi P)' = P Phi': the second product may then go along the rows of Phi as the first does.
    row = out[0]
    for i in range(n):
        for j in range(n):
            row[j] = 0.0
        for k in range(n):
            factor = Phi[i, k]
            if factor != 0.0:
                for j in range(n):
                    row[j] += factor * P[k, j]
        for j in range(n):
            turned[j, i] = row[j]
    for i in range(n):
        for j in range(i, n):
            out[i, j] = 0.5 * (Q[i, j] + Q[j, i])
        for k in range(n):
            factor = Phi[i, k]
            if factor != 0.0:
                for j in range(i, n):
                    out[i, j] += factor * turned[k, j]
    bad = -1
    for i in range(n):
        for j in range(i):
            out[i, j] = out[j, i]
        if bad < 0 and not 0.0 <= out[i, i] < math.inf:
            bad = i
    return bad


@njit(cache=True, error_model="numpy")
def dense_expect(P, d, x, z, H, j, work):
    """Write P h' of observation j to ``work[0]``; return innovation and ``h P h'``."""
    n = P.shape[0]
    g = work[0]
    for i in range(n):
        g[i] = 0.0
    # P is symmetric: its rows are its columns.
    for k in range(n):
        factor = H[j, k]
        if factor != 0.0:
            for i in range(n):
                g[i] += factor * P[k, i]
    s = 0.0
    for i in range(n):
        s += H[j, i] * g[i]
    return expected(x, z, H, j), s


@njit(cache=True, error_model="numpy")
def plain_take(P, d, x, H, j, work, s, moved, slope, r):
    """Change P and x by observation j, whose P h' is in ``work[0]``: ``P - slope K (P h')'``."""
    n = P.shape[0]
    g = work[0]
    gain = moved_state(x, g, s, moved, slope, r)
    for i in range(n):
        factor = slope * gain * g[i]
        for k in range(i, n):
            P[i, k] -= factor * g[k]
            P[k, i] = P[i, k]


@njit(cache=True, error_model="numpy")
def joseph_take(P, d, x, H, j, work, s, moved, slope, r):
    """Change P and x by observation j, whose P h' is in ``work[0]``: Joseph's form.

    As two changes of rank one (Bierman 1977, Section V.4): ``M = P - slope K (P h')'``, then
    ``M - slope (M h') K' + slope r K K'``. Multiplied out it would again rely on the gain.
    """
    n = P.shape[0]
    g, K, m = work[0], work[1], work[2]
    gain = moved_state(x, g, s, moved, slope, r)
    for i in range(n):
        K[i] = gain * g[i]
    for i in range(n):
        factor = slope * K[i]
        for k in range(n):
            P[i, k] -= factor * g[k]
    for i in range(n):
        m[i] = slope * r * K[i]
    for k in range(n):
        factor = slope * H[j, k]
        if factor != 0.0:
            for i in range(n):
                m[i] -= factor * P[i, k]
    for i in range(n):
        for k in range(n):
            P[i, k] += m[i] * K[k]
    # The mean of both halves: one of them alone is much further from semidefinite.
    for i in range(n):
        for k in range(i + 1, n):
            P[i, k] = 0.5 * (P[i, k] + P[k, i])
            P[k, i] = P[i, k]


@njit(cache=True, error_model="numpy")
def dense_update(P, x, z, H, R, joseph, told):
    """Take every observation in full; fill `told`: innovations and ``h P h' + R``.

    Return -1, or the first observation that cannot be used; P and x are then spoiled.
    """
    nu, s = told[0], told[1]
    work = np.empty((3, P.shape[0]))
    for j in range(z.shape[0]):
        nu[j], variance = dense_expect(P, P[0], x, z, H, j, work)
        s[j] = variance + R[j]
        if not (R[j] >= 0.0 and math.isfinite(nu[j]) and math.isfinite(s[j])):
            return j
        if joseph:
            joseph_take(P, P[0], x, H, j, work, variance, nu[j], 1.0, R[j])
        else:
            plain_take(P, P[0], x, H, j, work, variance, nu[j], 1.0, R[j])
    return -1

"""Covariance of a filter as a symmetric matrix, as U D U' and as W D W': prediction and update.

The update by one scalar observation is ``K = P h' / (slope s + r)``, ``x + K moved`` and
``P <- (1 - slope K h) P (1 - slope K h)' + slope r K K'`` (Joseph), or, relying on an optimal gain,
``P <- P - slope K (P h')'`` (plain).
"""

from __future__ import annotations

import math

import numpy as np

from strapdown._kernels.compilation import dot, fma, njit


@njit(cache=True, error_model="numpy")
def dense_predict(P, Phi, Q, out):
    """Write ``Phi P Phi' + Q`` to `out`, (n, n), exactly symmetric.

    Zeros of Phi cost nothing. Return -1, or the first state whose variance is not a number or is
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
    """Update P and x by observation j, with P h' in ``work[0]``: ``P - slope K (P h')'``."""
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
    """Update P and x by observation j, with P h' in ``work[0]``: Joseph's form.

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
    # The mean of both halves: either alone is much further from semidefinite.
    for i in range(n):
        for k in range(i + 1, n):
            P[i, k] = 0.5 * (P[i, k] + P[k, i])
            P[k, i] = P[i, k]


@njit(cache=True, error_model="numpy")
def dense_update(P, x, z, H, R, joseph, told):
    """Process every observation in full; fill `told`: innovations and ``h P h' + R``.

    Return -1, or the first invalid observation; P and x are then undefined.
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


# Common to all forms: innovation and correction of the state by one scalar observation.


@njit(cache=True, error_model="numpy", inline="always")
def expected(x, z, H, j):
    """Observation j minus its prediction."""
    nu = z[j]
    for i in range(x.shape[0]):
        nu -= H[j, i] * x[i]
    return nu


@njit(cache=True, error_model="numpy", inline="always")
def moved_state(x, g, s, moved, slope, r):
    """Move x by ``K moved`` and return the factor from ``g = P h'`` to K: ``1 / (slope s + r)``.

    An exactly known state is not moved by an exact observation.
    """
    total = slope * s + r
    gain = 1.0 / total if total != 0.0 else 0.0
    step = gain * moved
    for i in range(x.shape[0]):
        x[i] += step * g[i]
    return gain


# Factors of ``P = U D U'``: U unit upper triangular, D diagonal. An array (n, n) holds U above its
# diagonal, D on it and zeros below. Bierman (1977), Factorization Methods for Discrete Sequential
# Estimation.


EPSILON = 2.0**-52
# Rounding error, of n roundings, of a unit variance that is fully explained.
NOTHING = 8.0
# A correlation further from semidefinite is an error of the matrix, not rounding.
INDEFINITE = 1e-9


@njit(cache=True, error_model="numpy")
def semidefinite_factor(P, G, d):
    """Write columns G, (n, n), and weights d, (n,), of ``P = G diag(d) G'``; return their number.

    Cholesky's factorization with the largest remaining correlation as the pivot, which is stable
    for any rank: without pivoting a small pivot that is mostly rounding would spoil all that
    follow. Return -1 - state where P is not finite or indefinite. P is symmetric.
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

    W is overwritten. D is a sum of squares times d: not negative where d is not (Bierman, VI.4).
    A row that others explain to rounding leaves D = 0 and no direction.
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

    Zero columns at the end leave room for observations.
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


# Updates of the factors: Bierman's U-D and Chernodarov's W-D, equivalent to Joseph's form.


@njit(cache=True, error_model="numpy")
def ud_expect(ud, d, x, z, H, j, work):
    """Write ``f = U'h'`` and ``v = D f`` of observation j to `work`; return innovation and f v."""
    n = ud.shape[0]
    f, v = work[0], work[1]
    for i in range(n):
        f[i] = H[j, i]
    for i in range(n):
        factor = H[j, i]
        if factor != 0.0:
            for k in range(i + 1, n):
                f[k] += factor * ud[i, k]
    s = 0.0
    for i in range(n):
        v[i] = ud[i, i] * f[i]
        s += f[i] * v[i]
    return expected(x, z, H, j), s


@njit(cache=True, error_model="numpy")
def ud_take(ud, d, x, H, j, work, s, moved, slope, r):
    """Update U, D and x by observation j (Bierman 1977, Section V.3).

    A slope other than one is the update with the variance r / slope, written so that a zero slope,
    which changes no covariance, and a negative one need no other formula.
    """
    n = ud.shape[0]
    f, v, bend, g = work[0], work[1], work[2], work[3]
    before = r
    for k in range(n):
        after = before + slope * f[k] * v[k]
        # An exact observation adds nothing until the state is observed.
        bend[k] = -slope * f[k] / before if before != 0.0 else 0.0
        if after != 0.0:
            ud[k, k] *= before / after
        before = after
    for i in range(n):
        total = v[i]
        for k in range(i + 1, n):
            old = ud[i, k]
            ud[i, k] = old + bend[k] * total
            total += v[k] * old
        g[i] = total
    moved_state(x, g, s, moved, slope, r)


@njit(cache=True, error_model="numpy")
def ud_update(ud, x, z, H, R, told):
    """Process every observation in full; fill `told`: innovations and ``h P h' + R``.

    Return -1, or the first invalid observation; U, D and x are then undefined.
    """
    nu, s = told[0], told[1]
    work = np.empty((4, ud.shape[0]))
    for j in range(z.shape[0]):
        nu[j], variance = ud_expect(ud, ud[0], x, z, H, j, work)
        s[j] = variance + R[j]
        if not (R[j] >= 0.0 and math.isfinite(nu[j]) and math.isfinite(s[j])):
            return j
        ud_take(ud, ud[0], x, H, j, work, variance, nu[j], 1.0, R[j])
    return -1


@njit(cache=True, error_model="numpy")
def wd_begin(ud, Phi, Q, predicted, observations):
    """Return W and its weights with room for observations, and -1 or the state where Q is bad.

    ``[Phi U, G]`` if `predicted` (Chernodarov 2009, Eqs. 7 and 8), else U.
    """
    if predicted:
        W, d, rank = stacked(ud, Phi, Q, observations)
        return W, d, -1 - rank if rank < 0 else -1
    n = ud.shape[0]
    W, d = np.zeros((n, n + observations)), np.zeros(n + observations)
    for i in range(n):
        W[i, i] = 1.0
        d[i] = ud[i, i]
        for k in range(i + 1, n):
            W[i, k] = ud[i, k]
    return W, d, -1


@njit(cache=True, error_model="numpy")
def wd_expect(W, d, x, z, H, j, work):
    """Write ``f = h W`` and ``V = d f`` to `work`; return innovation and f V (Eqs. 9 and 11)."""
    n, size = W.shape
    f, V = work[0], work[1]
    for k in range(size):
        f[k] = 0.0
    for i in range(n):
        factor = H[j, i]
        if factor != 0.0:
            row = W[i]
            for k in range(size):
                f[k] = fma(factor, row[k], f[k])
    for k in range(size):
        V[k] = d[k] * f[k]
    return expected(x, z, H, j), dot(f, V, size)


@njit(cache=True, error_model="numpy")
def wd_take(W, d, x, H, j, work, s, moved, slope, r):
    """Update W, d and x by observation j: ``W <- [W - slope K f, K]``, ``d <- [d, slope r]``.

    Eqs. (12)-(14) of Chernodarov (2009), of which (14) is printed without the deflation of W.
    """
    n, size = W.shape
    f, V, g = work[0], work[1], work[2]
    for i in range(n):
        g[i] = dot(W[i], V, size)
    gain = moved_state(x, g, s, moved, slope, r)
    if slope == 0.0:
        return
    at = size - H.shape[0] + j
    for i in range(n):
        row = W[i]
        K = gain * g[i]
        factor = slope * K
        for k in range(size):
            row[k] = fma(-factor, f[k], row[k])
        row[at] = K
    d[at] = slope * r


@njit(cache=True, error_model="numpy")
def wd_finish(W, d, out):
    """Write the U and D of ``W d W'`` to `out` (Eq. 15); return -1 or the invalid state."""
    mwgs(W, d, out)
    return not_finite(out)


@njit(cache=True, error_model="numpy")
def wd_epoch(ud, Phi, Q, predicted, x, z, H, R, told, out):
    """Begin, process every observation in full, and finish.

    Return -1, or the first invalid observation; or -2 - state for an invalid prediction.
    """
    nu, s = told[0], told[1]
    W, d, bad = wd_begin(ud, Phi, Q, predicted, z.shape[0])
    if bad >= 0:
        return -2 - bad
    work = np.empty((3, W.shape[1]))
    for j in range(z.shape[0]):
        nu[j], variance = wd_expect(W, d, x, z, H, j, work)
        s[j] = variance + R[j]
        if not (R[j] >= 0.0 and math.isfinite(nu[j]) and math.isfinite(s[j])):
            return j
        wd_take(W, d, x, H, j, work, variance, nu[j], 1.0, R[j])
    bad = wd_finish(W, d, out)
    return -2 - bad if bad >= 0 else -1

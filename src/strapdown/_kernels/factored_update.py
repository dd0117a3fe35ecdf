"""Observations taken into factors of a covariance: Bierman's U-D update and Chernodarov's W-D.

Both make the step ``K = P h' / (slope s + r)``, ``x + K moved``,
``P <- (1 - slope K h) P (1 - slope K h)' + slope r K K'``.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from strapdown._kernels.factors import mwgs, not_finite, stacked
from strapdown._kernels.given_arrays import dot, fma
from strapdown._kernels.observation import expected, moved_state


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
    """Change U, D and x by observation j (Bierman 1977, Section V.3).

    With a slope other than one it is the update with the variance r / slope, written so that a
    slope of zero, which changes no covariance, and a negative one need no other formula.
    """
    n = ud.shape[0]
    f, v, bend, g = work[0], work[1], work[2], work[3]
    before = r
    for k in range(n):
        after = before + slope * f[k] * v[k]
        # Until something of the state is seen, an exact observation has nothing to say.
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
    """Take every observation in full; fill `told`: innovations and ``h P h' + R``.

    Return -1, or the first observation that cannot be used; U, D and x are then spoiled.
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
    """Change W, d and x by observation j: ``W <- [W - slope K f, K]``, ``d <- [d, slope r]``.

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
    """Write the U and D of ``W d W'`` to `out` (Eq. 15); return -1 or a bad state."""
    mwgs(W, d, out)
    return not_finite(out)


@njit(cache=True, error_model="numpy")
def wd_epoch(ud, Phi, Q, predicted, x, z, H, R, told, out):
    """Begin, take every observation in full, and finish.

    Return -1, or the first observation that cannot be used; or -2 - state for a bad prediction.
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

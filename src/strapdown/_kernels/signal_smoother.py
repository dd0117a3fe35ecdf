"""Rauch, Tung and Striebel's smoother of a level and its slope, over a fixed lag."""

from __future__ import annotations

from numba import njit


@njit(cache=True, error_model="numpy")
def smooth_fixed_lag(x, P, Phi, Q, lag, count, out):
    """Fill ``out[k]``, level and slope, for the first `count` epochs from up to `lag` later ones.

    Filtered states x, (n, 2), and their covariances P, (n, 3) as (11, 12, 22).
    """
    a, q11, q12, q22 = Phi[0, 1], Q[0, 0], Q[0, 1], Q[1, 1]
    n = x.shape[0]
    for k in range(count):
        last = min(n - 1, k + lag)
        level, slope = x[last, 0], x[last, 1]
        for j in range(last - 1, k - 1, -1):
            p11, p12, p22 = P[j, 0], P[j, 1], P[j, 2]
            # Phi P, and the covariance that is predicted.
            c12 = p12 + a * p22
            c11 = p11 + a * p12
            m11, m12, m22 = c11 + a * c12 + q11, c12 + q12, p22 + q22
            det = m11 * m22 - m12 * m12
            # G = P Phi' / M, with P Phi' = (c11, p12; c12, p22).
            g11 = (c11 * m22 - p12 * m12) / det
            g12 = (p12 * m11 - c11 * m12) / det
            g21 = (c12 * m22 - p22 * m12) / det
            g22 = (p22 * m11 - c12 * m12) / det
            d1 = level - (x[j, 0] + a * x[j, 1])
            d2 = slope - x[j, 1]
            level = x[j, 0] + g11 * d1 + g12 * d2
            slope = x[j, 1] + g21 * d1 + g22 * d2
        out[k, 0] = level
        out[k, 1] = slope

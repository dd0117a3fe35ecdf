"""What one scalar observation does to an estimate, whatever form its covariance has."""

from __future__ import annotations

from numba import njit


@njit(cache=True, error_model="numpy", inline="always")
def expected(x, z, H, j):
    """Observation j less its prediction."""
    nu = z[j]
    for i in range(x.shape[0]):
        nu -= H[j, i] * x[i]
    return nu


@njit(cache=True, error_model="numpy", inline="always")
def moved_state(x, g, s, moved, slope, r):
    """Move x by ``K moved`` and return what makes K of ``g = P h'``: ``1 / (slope s + r)``.

    What is known exactly is not moved by an observation that is exact as well.
    """
    total = slope * s + r
    gain = 1.0 / total if total != 0.0 else 0.0
    step = gain * moved
    for i in range(x.shape[0]):
        x[i] += step * g[i]
    return gain

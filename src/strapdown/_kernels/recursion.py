"""The first-order recursion that a one-pole filter and a Gauss-Markov process share."""

from __future__ import annotations

from numba import njit


@njit(cache=True)
def first_order(decay, drive, state, out):
    """Fill ``out[k] = decay[k] out[k-1] + drive[k]``, (n, 3), from ``out[-1] = state``, (3,)."""
    for j in range(3):
        x = state[j]
        for k in range(drive.shape[0]):
            x = decay[k] * x + drive[k, j]
            out[k, j] = x

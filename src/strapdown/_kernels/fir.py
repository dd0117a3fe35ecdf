"""A filter of finite length, read at every so many samples."""

from __future__ import annotations

from numba import njit


@njit(cache=True, error_model="numpy")
def fir_decimate(values, weights, first, factor, out):
    """Fill ``out[j] = sum_k weights[k] values[first + j factor + k]``, (m, c).

    Sums are made in one order, so that a record in pieces gives the same bits.
    """
    for j in range(out.shape[0]):
        at = first + j * factor
        for c in range(out.shape[1]):
            out[j, c] = 0.0
        for k in range(weights.shape[0]):
            w = weights[k]
            for c in range(out.shape[1]):
                out[j, c] += w * values[at + k, c]

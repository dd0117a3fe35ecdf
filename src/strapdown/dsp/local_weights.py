"""Outputs that are each a weighted sum of near samples: applied, and the noise they pass."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

__all__ = ["LocalWeights", "mirrored"]


@dataclass(frozen=True, eq=False)
class LocalWeights:
    """Output j is ``sum_i weights[j, i] x[first[j] + i]``.

    Attributes
    ----------
    first : ndarray of int64, (m,)
    weights : ndarray, (m, w)
    """

    first: Indices
    weights: Array

    @property
    def noise_factor(self) -> Array:
        """Standard deviation of each output per that of independent samples, (m,)."""
        return np.asarray(np.linalg.norm(self.weights, axis=1))

    def apply(self, values: Array) -> Array:
        """Outputs of samples of shape (n, k), as (m, k)."""
        near = values[self.first[:, None] + np.arange(self.weights.shape[1])]
        return np.asarray(np.einsum("ji,jik->jk", self.weights, near))

    def any_of(self, marked: NDArray[np.bool_], least: float = 0.01) -> NDArray[np.bool_]:
        """Whether a marked sample counts in each output, (m, k).

        Parameters
        ----------
        marked : ndarray of bool, (n, k)
        least : float
            A sample counts whose weight is more than this part of the output's largest.
        """
        size = np.abs(self.weights)
        counts = size > least * size.max(axis=1, keepdims=True)
        near = marked[self.first[:, None] + np.arange(self.weights.shape[1])]
        return np.asarray((counts[:, :, None] & near).any(axis=1))


def mirrored(first: Indices, weights: Array, n: int) -> LocalWeights:
    """Weights that reach beyond a record, laid back onto its samples.

    The record is continued by its point mirror about the end samples, ``x[-i] = 2 x[0] - x[i]``.

    Parameters
    ----------
    first : ndarray of int64, (m,)
        May be negative.
    weights : ndarray, (m, w)
    n : int
        Samples of the record; `weights` reach beyond it by fewer.
    """
    width = weights.shape[1]
    if first.min() >= 0 and first.max() + width <= n:
        return LocalWeights(first, weights)
    start = np.clip(first, 0, max(n - width, 0))
    out = np.zeros((len(first), min(width, n)))
    at = first[:, None] + np.arange(width)
    rows = np.broadcast_to(np.arange(len(first))[:, None], at.shape)
    for beyond, end in ((at < 0, 0), (at > n - 1, n - 1)):
        np.add.at(out, (rows[beyond], 2 * end - at[beyond] - start[rows[beyond]]), -weights[beyond])
        np.add.at(out, (rows[beyond], end - start[rows[beyond]]), 2.0 * weights[beyond])
    inside = (at >= 0) & (at <= n - 1)
    np.add.at(out, (rows[inside], (at - start[:, None])[inside]), weights[inside])
    return LocalWeights(start, out)

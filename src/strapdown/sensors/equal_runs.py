"""Runs of samples that repeat a value, and how long they are where nothing is wrong."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

__all__ = ["equal_runs", "longest_by_chance"]


def equal_runs(v: Array) -> tuple[Indices, Indices]:
    """Beginnings and lengths of runs of equal values; a NaN is equal to none.

    Parameters
    ----------
    v : ndarray, (n,)

    Returns
    -------
    starts, lengths : ndarray of int, (m,)
    """
    starts = np.flatnonzero(np.concatenate([[True], np.diff(v) != 0.0]))
    return starts.astype(np.int64), np.diff(np.append(starts, v.size)).astype(np.int64)


def longest_by_chance(repeats: Array, samples: int, false_alarm: float) -> Array:
    """Length that a run of independent repetitions exceeds with a given probability at most.

    Parameters
    ----------
    repeats : ndarray, (k,)
        Probability that a sample repeats the one before it, from 0 to 1.
    samples : int
        Of the record: a run may begin at each.
    false_alarm : float
        Probability that any run of the record is longer.

    Returns
    -------
    ndarray, (k,)
        ``1 + ln(false_alarm / n) / ln(r)``: the expected number of runs of L and more,
        ``n (1 - r) r^(L-1)``, is then below `false_alarm`. Infinite for r = 1.
    """
    r = np.clip(repeats, 1e-300, 1.0)
    with np.errstate(divide="ignore"):
        limit = 1.0 + math.log(false_alarm / samples) / np.log(r)
    return np.where(r < 1.0, limit, np.inf)

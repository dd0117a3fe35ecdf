"""Thinning of curves for a screen that keeps every extreme."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from strapdown.report.chart import Fill

__all__ = ["BUCKETS", "broken", "kept_rows", "thin_fill"]

Array = NDArray[np.float64]

#: For a curve over time: one point per two pixels of a page.
BUCKETS = 350


def kept_rows(columns: tuple[Array, ...], buckets: int = BUCKETS) -> NDArray[np.intp]:
    """Rows of the minimum and maximum of each column in each of equal runs.

    Parameters
    ----------
    columns : tuple of ndarray, (n,)
        NaN is skipped, except the first of each run of samples, which breaks a curve.
    buckets : int

    Returns
    -------
    ndarray of int
        In order, including both ends; all rows if there are few.
    """
    n = columns[0].size
    if n <= 2 * buckets:
        return np.arange(n)
    width = -(-n // buckets)
    first = np.arange(0, n, width)
    keep = [np.array([0, n - 1])]
    for column in columns:
        body = np.pad(column, (0, first.size * width - n), mode="edge").reshape(-1, width)
        gap = np.isnan(body)
        keep += [
            first + np.argmin(np.where(gap, np.inf, body), axis=1),
            first + np.argmax(np.where(gap, -np.inf, body), axis=1),
            (first + np.argmax(gap, axis=1))[gap.any(axis=1)],
        ]
    rows = np.unique(np.concatenate(keep))
    return rows[rows < n]


def thin_fill(
    name: str,
    x: Array,
    low: Array,
    high: Array,
    colour: str,
    *,
    opacity: float = 0.18,
    legend: bool = True,
    buckets: int = BUCKETS // 2,
) -> Fill:
    """Make a band of few points that keeps the lowest and highest values."""
    rows = kept_rows((low, high), buckets)
    return Fill(name, x[rows], low[rows], high[rows], colour, opacity, legend)


def broken(time: Array, *columns: Array, longest: float = 5.0) -> tuple[Array, ...]:
    """Insert a row of NaN in each gap, so that no curve bridges it.

    Parameters
    ----------
    time : ndarray, (n,), s
    *columns : ndarray, (n,)
    longest : float
        Longest step without a gap, in usual steps.

    Returns
    -------
    tuple of ndarray
        Time and the columns.
    """
    if time.size < 3:
        return (time, *columns)
    steps = np.diff(time)
    positive = steps[steps > 0.0]
    usual = float(np.median(positive)) if positive.size else 1.0
    at = np.flatnonzero(steps > longest * usual) + 1
    filled = [np.insert(column, at, np.nan) for column in columns]
    return (np.insert(time, at, 0.5 * (time[at - 1] + time[at])), *filled)

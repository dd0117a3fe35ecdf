"""Interpolation by polynomials through the six nearest samples, with the noise gain."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from strapdown.dsp.decimation import SLACK, Flags, Resampled, in_blocks
from strapdown.dsp.derivative import LocalWeights
from strapdown.dsp.samples import as_channels
from strapdown.errors import DataError

Array = NDArray[np.float64]

__all__ = ["POINTS", "interpolate", "interpolated_means"]

POINTS = 6


def interpolate(
    time: ArrayLike, values: ArrayLike, stamps: ArrayLike, marked: Flags | None = None
) -> Resampled:
    """Interpolate samples to stamps.

    Parameters
    ----------
    time : array_like, (n,), s
        Increasing, any spacing.
    values : array_like, (n,) or (n, k)
    stamps : array_like, (m,), s
        Within the record.
    marked : ndarray of bool, (n, k), optional
        As in `decimation.decimate`.

    Returns
    -------
    Resampled
        The polynomial of degree 5 through the six nearest samples, one-sided near the ends: exact
        for polynomials up to that degree, and at the samples. Midway between even samples the
        gain at f is ``150/128 cos x - 25/128 cos 3x + 3/128 cos 5x`` with ``x = π f step``: 0.9990
        at an eighth of the sampling rate, 0.950 at a quarter. The noise factor there is 0.84;
        between the first two samples it is up to 1.6.

    Raises
    ------
    DataError
        Fewer than six samples, time does not advance, a stamp is outside the record, or a number
        is not finite.
    """
    t, channels = as_channels(time, "time")[:, 0], as_channels(values)
    at = as_channels(stamps, "stamps")[:, 0]
    n = len(t)
    if n != len(channels) or n < POINTS:
        raise DataError(
            "dsp.stamps-samples-cannot-interpolated",
            quantity="time",
            n=n,
            count=len(channels),
            points=POINTS,
        )
    if not np.diff(t).min() > 0.0:
        row = int(np.argmax(np.diff(t) <= 0.0)) + 1
        raise DataError(
            "dsp.time-does-not-advance-followed",
            row=row + 1,
            quantity="time",
            t=t[row - 1],
            t_2=t[row],
        )
    slack = SLACK * float(np.median(np.diff(t)))
    off = np.maximum(t[0] - at, at - t[-1])
    if off.max() > slack:
        raise DataError(
            "dsp.lies-outside-record-goes-2",
            quantity="stamps",
            at=at[int(np.argmax(off))],
            t=t[0],
            t_2=t[-1],
        )
    first = np.clip(np.searchsorted(t, at, side="right") - POINTS // 2, 0, n - POINTS)

    def weigh(rows: slice) -> tuple[LocalWeights, Flags]:
        return (
            LocalWeights(first[rows], lagrange(t[first[rows, None] + np.arange(POINTS)], at[rows])),
            np.ones(len(first[rows]), dtype=bool),
        )

    return in_blocks(channels, len(at), POINTS, weigh, marked)


def lagrange(nodes: Array, at: Array) -> Array:
    """Compute weights (m, p) that evaluate polynomials through nodes (m, p) at points (m,)."""
    p = nodes.shape[1]
    weights = np.ones_like(nodes)
    for i in range(p):
        for j in range(p):
            if i != j:
                weights[:, i] *= (at - nodes[:, j]) / (nodes[:, i] - nodes[:, j])
    return weights


def interpolated_means(
    time: ArrayLike,
    values: ArrayLike,
    stamps: ArrayLike,
    length: float,
    marked: Flags | None = None,
) -> Resampled:
    """Average `interpolate` over intervals that end at stamps (three-point Gauss quadrature).

    Parameters
    ----------
    time, values, stamps, marked
        As in `interpolate`; the intervals lie within the record.
    length : float, s
        Length of the intervals, at most two steps of the samples.

    Returns
    -------
    Resampled
        Exact for polynomials up to degree 5.
    """
    t, channels = as_channels(time, "time")[:, 0], as_channels(values)
    at = as_channels(stamps, "stamps")[:, 0]
    node, share = np.polynomial.legendre.leggauss(3)
    points = at[:, None] + 0.5 * length * (node - 1.0)
    interpolate(t, channels, [points.min(), points.max()])
    n, width = len(t), min(POINTS + 4, len(t))
    low = np.clip(np.searchsorted(t, points[:, 0], side="right") - POINTS // 2, 0, n - width)

    def weigh(rows: slice) -> tuple[LocalWeights, Flags]:
        m = len(low[rows])
        weights = np.zeros((m, width))
        for k in range(3):
            x = points[rows, k]
            first = np.searchsorted(t, x, side="right") - POINTS // 2
            first = np.clip(first, low[rows], low[rows] + width - POINTS)
            at_node = lagrange(t[first[:, None] + np.arange(POINTS)], x)
            place = (first - low[rows])[:, None] + np.arange(POINTS)
            weights[np.arange(m)[:, None], place] += 0.5 * share[k] * at_node
        return LocalWeights(low[rows], weights), np.ones(m, dtype=bool)

    return in_blocks(channels, len(at), width, weigh, marked)

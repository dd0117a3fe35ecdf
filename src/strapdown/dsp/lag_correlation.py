"""Correlation of two signals over their lags, with gaps, and its peaks."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

__all__ = ["lag_correlation", "repeats", "top_peaks"]


def lag_correlation(
    x: Array, y: Array, known_x: Flags, known_y: Flags, least: float
) -> tuple[Array, Array]:
    """Correlation coefficient for each lag: sample k of y lies at k + lag of x.

    Parameters
    ----------
    x, y : ndarray, (n,) and (m,), or (n, k) and (m, k)
        On one step; channels are pooled, each about its own mean.
    known_x, known_y : ndarray of bool, (n,) and (m,)
        False where there is no sample.
    least : float
        Samples that both must have known at a lag.

    Returns
    -------
    lags : ndarray
        Those at which enough is shared.
    coefficient : ndarray
        -1 to 1; means and variances are those of what is shared at the lag.
    """
    from scipy.signal import correlate

    x = np.where(known_x[:, None], x.reshape(len(x), -1), 0.0)
    y = np.where(known_y[:, None], y.reshape(len(y), -1), 0.0)
    m, w = known_x.astype(np.float64), known_y.astype(np.float64)

    def slide(p: Array, q: Array) -> Array:
        return np.asarray(correlate(p, q, mode="full", method="fft"))

    count = np.maximum(np.round(slide(m, w)), 1.0)
    cross, var_x, var_y = (np.zeros(len(count)) for _ in range(3))
    for p, q in zip(x.T, y.T, strict=True):
        sum_x, sum_y = slide(p, w), slide(m, q)
        cross += slide(p, q) - sum_x * sum_y / count
        var_x += slide(p * p, w) - sum_x**2 / count
        var_y += slide(m, q * q) - sum_y**2 / count
    lags = np.arange(-(len(y) - 1), len(x), dtype=np.float64)
    # A stretch that is nearly still correlates by its noise.
    floor = 1e-3 * min(float(s.var(axis=0).sum()) * len(s) for s in (x, y))
    good = (count >= least) & (var_x > floor) & (var_y > floor)
    return lags[good], cross[good] / np.sqrt(var_x[good] * var_y[good])


def top_peaks(score: Array, most: int) -> NDArray[np.int64]:
    """Positions of the highest positive local maxima, the highest first."""
    inner = np.r_[-np.inf, score, -np.inf]
    top = np.flatnonzero((inner[1:-1] >= inner[:-2]) & (inner[1:-1] >= inner[2:]))
    order = top[np.argsort(score[top])[::-1][:most]]
    return order[score[order] > 0.0]


def repeats(best: float, runner_up: float) -> bool:
    """Whether another peak does about as well as the best.

    Twice the best misfit, and a hundredth of the whole, is no clear winner.
    """
    return 1.0 - runner_up < 2.0 * (1.0 - best) + 0.01

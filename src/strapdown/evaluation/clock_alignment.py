"""Two logs of one motion: their rates on even grids, and the coarse offset of their clocks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.dsp.lag_correlation import lag_correlation, repeats, top_peaks
from strapdown.errors import DataError
from strapdown.increments import increments_from_imu
from strapdown.tables import GYRO, THETA, find_gaps

Array = NDArray[np.float64]

__all__ = ["CoarseOffset", "EvenRates", "coarse_offset", "even_rates", "proper_rotation"]

# A Gaussian of two cells leaves 3e-9 of what is at the end of the band, so that interpolating
# between cells changes neither the signal nor the power of its noise.
SMOOTH_CELLS = 2.0
# What both logs must share for an offset to be looked at.
LEAST_OVERLAP = 5.0  # s
COARSE_STEP = 0.02  # s
PEAKS = 8
# A pause of rates below this says nothing about time.
LEAST_RATE = 0.02  # rad/s, root mean square
LEAST_CORRELATION = 0.7


@dataclass(frozen=True)
class EvenRates:
    """Smoothed rates on an even grid.

    Attributes
    ----------
    start, step : float, s
        Middle of the first cell, and the distance of cells.
    rate : ndarray, (n, 3), rad/s
    known : ndarray of bool, (n,)
        False in gaps of the log and near them.
    """

    start: float
    step: float
    rate: Array
    known: NDArray[np.bool_]

    @property
    def time(self) -> Array:
        """Middles of the cells in s."""
        return np.asarray(self.start + self.step * np.arange(len(self.rate)))


@dataclass(frozen=True)
class CoarseOffset:
    """Offset of two clocks to a cell of the grid.

    Attributes
    ----------
    offset : float, s
        Second clock less first clock.
    correlation, runner_up : float
        Share that the rates have in common there, and at the best other offset.
    """

    offset: float
    correlation: float
    runner_up: float


def even_rates(imu: pd.DataFrame, step: float) -> EvenRates:
    """Mean rates over the cells of an even grid, smoothed.

    Parameters
    ----------
    imu : DataFrame
        An Imu table, of any spacing and either kind of sampling.
    step : float, s
        Of the grid; no shorter than the usual step of the log.

    Returns
    -------
    EvenRates
        From the integral of the rates, so that stamps that come in bursts count by their
        length; then a Gaussian of two cells.
    """
    from scipy.interpolate import CubicSpline
    from scipy.ndimage import gaussian_filter1d

    time = imu.index.to_numpy(dtype=np.float64)
    rate = imu[GYRO].to_numpy(dtype=np.float64)
    origin, steps = time[0], np.diff(time)
    n = int((time[-1] - origin) / step)
    if n < 8:
        raise DataError(
            "evaluation.too-short-compared-another-log",
            file=imu.attrs.get("source"),
            quantity="time",
            time=time[-1] - origin,
            least_overlap=LEAST_OVERLAP,
        )
    edges = step * np.arange(n + 1)
    even = steps.max() < 1.5 * np.median(steps)
    if imu.attrs["sampling"] == "instantaneous" and even:
        angle = CubicSpline(time - origin, rate).antiderivative()(edges)
    else:
        # A spline overshoots where stamps are uneven; what was integrated stays in any case.
        theta = increments_from_imu(imu)[THETA].to_numpy()
        turned = np.vstack([np.zeros(3), np.cumsum(theta, axis=0)])
        if even:
            angle = CubicSpline(time - origin, turned)(edges)
        else:
            angle = np.column_stack([np.interp(edges, time - origin, c) for c in turned.T])
    smooth = gaussian_filter1d(np.diff(angle, axis=0) / step, SMOOTH_CELLS, axis=0, truncate=5.0)
    middle = edges[:-1] + 0.5 * step
    known = np.ones(n, dtype=bool)
    reach = 5.0 * SMOOTH_CELLS * step
    for gap in find_gaps(time):
        known &= ~((middle > gap.start - origin - reach) & (middle < gap.end - origin + reach))
    # At the ends the filter mirrors what it does not have.
    known[: int(4 * SMOOTH_CELLS)] = known[-int(4 * SMOOTH_CELLS) :] = False
    return EvenRates(float(origin + 0.5 * step), step, smooth, known)


def proper_rotation(product: Array) -> tuple[Array, float]:
    """Rotation that brings one set of vectors nearest to another (Wahba's problem).

    Parameters
    ----------
    product : ndarray, (3, 3)
        Sum of ``a b^T`` over the pairs.

    Returns
    -------
    C_ab : ndarray, (3, 3)
        What turns b into a with the least sum of squares, by singular values (Markley 1988,
        doi:10.1007/BF03546354).
    common : float
        Sum of ``a · C_ab b``.
    """
    u, size, vt = np.linalg.svd(product)
    sign = np.array([1.0, 1.0, np.sign(np.linalg.det(u) * np.linalg.det(vt)) or 1.0])
    return (u * sign) @ vt, float((size * sign).sum())


def coarse_offset(first: pd.DataFrame, second: pd.DataFrame) -> CoarseOffset:
    """Find how far two clocks are apart, from the rates, whatever the mounting.

    Parameters
    ----------
    first, second : DataFrame
        Imu tables of two sensors on one body.

    Returns
    -------
    CoarseOffset
        Peaks of the correlation of the rates' lengths, weighed by how much of the vectors one
        rotation brings together.

    Raises
    ------
    DataError
        There is too little motion, nothing in common, or two offsets do about as well.
    """
    usual = max(float(np.median(np.diff(t.index.to_numpy()))) for t in (first, second))
    step = max(COARSE_STEP, usual)
    a, b = even_rates(first, step), even_rates(second, step)
    for grid, name in ((a, "first"), (b, "second")):
        spread = grid.rate[grid.known] if grid.known.any() else np.zeros((1, 3))
        if float(np.sqrt(spread.var(axis=0).sum())) < LEAST_RATE:
            raise DataError(
                "evaluation.log-hardly-turns-rates-scatter",
                quantity="gyro",
                name=name,
                least_rate=LEAST_RATE,
            )
    x, y = (np.sqrt((g.rate**2).sum(axis=1)) for g in (a, b))
    least = min(LEAST_OVERLAP, 0.5 * _shorter(a, b)) / step
    lags, score = lag_correlation(x, y, a.known, b.known, least)
    if not score.size:
        raise DataError(
            "evaluation.they-share-less-than-however", quantity="time", least_overlap=LEAST_OVERLAP
        )
    weighed = [(_vector_share(a, b, lag), lag) for lag in lags[top_peaks(score, PEAKS)].astype(int)]
    best, at = max(weighed, default=(0.0, 0))
    # What is within half a second is the same peak.
    apart = int(np.ceil(0.5 / step))
    rest = [share for share, lag in weighed if abs(lag - at) > apart]
    found = CoarseOffset(b.start - a.start - at * step, best, max(rest, default=0.0))
    if best < LEAST_CORRELATION:
        raise DataError(
            "evaluation.rates-two-logs-little-common",
            quantity="gyro",
            best=best,
            least_correlation=LEAST_CORRELATION,
        )
    if repeats(best, found.runner_up):
        other = next(lag for share, lag in weighed if share == found.runner_up)
        raise DataError(
            "evaluation.offsets-do-about-well-motion",
            quantity="time",
            offset=found.offset,
            start=b.start - a.start - other * step,
            best=best,
            runner_up=found.runner_up,
        )
    return found


def _shorter(a: EvenRates, b: EvenRates) -> float:
    return min(len(a.rate) * a.step, len(b.rate) * b.step)


def _vector_share(a: EvenRates, b: EvenRates, lag: int) -> float:
    """How much of the rates one rotation brings together at a lag, 0 to 1."""
    lo, hi = max(0, lag), min(len(a.rate), len(b.rate) + lag)
    known = a.known[lo:hi] & b.known[lo - lag : hi - lag]
    x, y = a.rate[lo:hi][known], b.rate[lo - lag : hi - lag][known]
    if len(x) < 3:
        return 0.0
    x, y = x - x.mean(axis=0), y - y.mean(axis=0)
    _, common = proper_rotation(x.T @ y)
    return common / max(float(np.sqrt((x**2).sum() * (y**2).sum())), 1e-300)

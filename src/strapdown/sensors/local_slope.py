"""Slope of a sampled signal from a parabola fitted to a few neighbours, with its exact noise."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from strapdown.exceptions import ConfigError, DataError

if TYPE_CHECKING:
    from scipy.sparse import csr_array

Array = NDArray[np.float64]

__all__ = ["LocalSlope", "local_slope"]

# So many rows are solved at once: a few megabytes.
CHUNK = 20_000
LEAST_SAMPLES = 3


@dataclass(frozen=True, eq=False)
class LocalSlope:
    """Weights that make values and slopes of a signal from its samples.

    Attributes
    ----------
    first : ndarray of int, (n,)
        First sample of each row's window.
    slope, value : ndarray, (n, w)
        Weights of the samples of the window: of the slope, in 1/s, and of the value.
    bandwidth : float, Hz
        Frequency at which the slope in the middle of a record has fallen to 1/√2 of the true
        one. Its delay is zero there: the window is symmetric.
    window : float, s
        From the first to the last sample of a window.
    """

    first: NDArray[np.int64]
    slope: Array
    value: Array
    bandwidth: float
    window: float

    def slope_of(self, y: Array) -> Array:
        """Slope of samples (n, k) at each stamp, in their unit per s."""
        return self._apply(self.slope, y)

    def value_of(self, y: Array) -> Array:
        """Value of the signal (n, k) where the slopes are taken."""
        return self._apply(self.value, y)

    def weighted(self, rows: Array) -> tuple[Array, Array]:
        """Weights of the samples in sums of slopes and of values.

        Parameters
        ----------
        rows : ndarray, (m, n)
            Weights of the slopes (and values) in each of m sums.

        Returns
        -------
        slope, value : ndarray, (m, n)
            Weights of the samples of the signal.
        """
        by_slope, by_value = self._matrices
        return np.asarray(rows @ by_slope), np.asarray(rows @ by_value)

    @cached_property
    def _matrices(self) -> tuple[csr_array, csr_array]:
        """The weights as matrices (n, n), nearly empty."""
        from scipy.sparse import csr_array

        n, width = self.slope.shape
        columns = (self.first[:, None] + np.arange(width)).ravel()
        starts = np.arange(0, n * width + 1, width)
        slope = csr_array((self.slope.ravel(), columns, starts), shape=(n, n))
        return slope, csr_array((self.value.ravel(), columns, starts), shape=(n, n))

    def _apply(self, weights: Array, y: Array) -> Array:
        out = np.zeros((len(weights), y.shape[1]))
        for j in range(weights.shape[1]):
            out += weights[:, j, None] * y[self.first + j]
        return out


def local_slope(time: Array, *, window: float | None = None, delay: float = 0.0) -> LocalSlope:
    """Weights of a parabola fitted by least squares to each sample and its neighbours.

    Parameters
    ----------
    time : ndarray, (n,), s
        Increasing stamps, any spacing.
    window : float, s, optional
        Length of a window; five samples if not given, and never fewer than three.
    delay : float, s
        By how much the signal is late: value and slope are taken this much after each stamp.

    Returns
    -------
    LocalSlope
        With equal steps the Savitzky-Golay filter of order two (Savitzky and Golay 1964,
        doi:10.1021/ac60214a047). White noise s becomes ``s sqrt(sum(slope²))``. Without delay
        the values are the samples themselves.

    Raises
    ------
    DataError
        There are fewer than three samples.
    ConfigError
        The window is not positive or the delay is longer than half of it.
    """
    n = time.size
    if n < LEAST_SAMPLES:
        raise DataError(
            f"{n} samples, too few for a derivative",
            quantity="time",
            remedy=f"give at least {LEAST_SAMPLES}",
        )
    step = float(np.median(np.diff(time)))
    if window is not None and not window > 0.0:
        raise ConfigError(
            f"{window:g} s is no window",
            quantity="window",
            remedy="give the length over which the rates may be smoothed, as 0.02",
        )
    width = 5 if window is None else 2 * max(1, round(0.5 * window / step)) + 1
    width = min(width, n)
    if abs(delay) > 0.5 * width * step:
        raise ConfigError(
            f"a delay of {delay:g} s is longer than half the window of {width * step:g} s",
            quantity="delay",
            remedy="take the delay off the stamps, or use a longer window",
        )
    first = np.clip(np.arange(n) - width // 2, 0, n - width)
    slope, value = np.empty((n, width)), np.empty((n, width))
    for a in range(0, n, CHUNK):
        rows = slice(a, min(a + CHUNK, n))
        at = time[first[rows][:, None] + np.arange(width)] - time[rows][:, None] - delay
        x = at / step
        # Normal equations of 1, x, x² about the instant: value and slope are two coefficients.
        basis = np.stack([np.ones_like(x), x, x * x][: min(3, width)], axis=1)
        inverse = np.linalg.solve(basis @ basis.transpose(0, 2, 1), basis)
        value[rows], slope[rows] = inverse[:, 0], inverse[:, 1] / step
    if delay == 0.0:
        value = (first[:, None] + np.arange(width) == np.arange(n)[:, None]).astype(np.float64)
    middle = n // 2
    at = time[first[middle] + np.arange(width)] - time[middle] - delay
    span = float(time[min(n - 1, int(first[middle]) + width - 1)] - time[first[middle]])
    return LocalSlope(first, slope, value, _bandwidth(slope[middle], at, step), span)


def _bandwidth(weights: Array, at: Array, step: float) -> float:
    """Where the response falls to 1/√2 of ``i 2 pi f``."""
    f = np.linspace(1e-4, 0.5, 2000) / step
    turn = 2.0 * np.pi * np.outer(f, at)
    response = np.abs(np.exp(1j * turn) @ weights) / (2.0 * np.pi * f)
    below = np.flatnonzero(response < np.sqrt(0.5))
    return float(f[below[0]]) if below.size else float(f[-1])

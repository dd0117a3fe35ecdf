"""Means over a window that moves, exact where the record is linear between its samples."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from strapdown.dsp.running_integral import running_integral
from strapdown.errors import DataError

Array = NDArray[np.float64]


def moving_means(time: Array, values: Array, width: float) -> tuple[Array, Array]:
    """Means over every window that begins or ends at a sample.

    Parameters
    ----------
    time : ndarray, (n,), s
    values : ndarray, (n,) or (n, k)
    width : float, s
        No whole number of samples is needed.

    Returns
    -------
    starts : ndarray, (m,), s
        Where the windows begin, ascending.
    means : ndarray, (m,) or (m, k)

    Raises
    ------
    DataError
        The record is shorter than the window.
    """
    # Stamps are sums of steps: a record as long as its window may miss it by rounding.
    last = time[-1] - width
    if last < time[0] - 1e-9 * width:
        raise DataError(
            "crash.record-shorter-than-window",
            quantity="time",
            time=time[-1] - time[0],
            width=width,
        )
    last = max(float(last), float(time[0]))
    starts = np.concatenate([time[time <= last], time[time >= time[0] + width] - width, [last]])
    starts = np.unique(np.clip(starts, time[0], last))
    flat = values.reshape(values.shape[0], -1)
    total = running_integral(time, flat)
    ends = np.minimum(starts + width, time[-1])
    means = (
        _integral_at(time, flat, total, ends) - _integral_at(time, flat, total, starts)
    ) / width
    return starts, means.reshape(starts.size, *values.shape[1:])


def largest_mean(time: Array, values: Array, width: float) -> tuple[float, float]:
    """Return the mean of greatest size, with its sign, and the start of its window.

    Exact for a record that is linear between samples: between two neighbouring windows the mean
    is a parabola, whose vertex is where the values at both ends of the window are equal.

    Parameters
    ----------
    time, values : ndarray, (n,)
    width : float, s

    Returns
    -------
    mean, start : float
    """
    starts, means = moving_means(time, values, width)
    slope = np.interp(starts + width, time, values) - np.interp(starts, time, values)
    inner = np.flatnonzero(slope[:-1] * slope[1:] < 0.0)
    at = starts[inner] + (starts[inner + 1] - starts[inner]) * slope[inner] / (
        slope[inner] - slope[inner + 1]
    )
    total = running_integral(time, values[:, None])
    vertex = (
        _integral_at(time, values[:, None], total, at + width)
        - _integral_at(time, values[:, None], total, at)
    )[:, 0] / width
    starts, means = np.concatenate([starts, at]), np.concatenate([means, vertex])
    k = int(np.argmax(np.abs(means)))
    return float(means[k]), float(starts[k])


def _integral_at(time: Array, values: Array, total: Array, at: Array) -> Array:
    """Integral from the first sample to any instants, of values linear between samples."""
    k = np.clip(np.searchsorted(time, at, side="right") - 1, 0, time.size - 2)
    h = (time[k + 1] - time[k])[:, None]
    into = (at - time[k])[:, None]
    slope = (values[k + 1] - values[k]) / h
    return np.asarray(total[k] + into * (values[k] + 0.5 * into * slope))

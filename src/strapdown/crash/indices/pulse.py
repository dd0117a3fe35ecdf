"""Input of the crash indices: checks of a record and its integrals, means and filters."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from strapdown.dsp.running_integral import running_integral
from strapdown.errors import ConfigError, DataError

Array = NDArray[np.float64]
# Stamps are rounded; steps that differ by more than this fraction are not uniform.
SAME_STEP = 0.02


def checked(
    time: ArrayLike, values: ArrayLike, width: int | None, quantity: str
) -> tuple[Array, Array]:
    """Return stamps and values as arrays.

    Parameters
    ----------
    time : array_like, (n,), s
    values : array_like, (n,) or (n, width)
    width : int or None
        None for one number per sample.
    quantity : str
        For messages.

    Raises
    ------
    DataError
        The shapes disagree, a value is not finite, time does not increase, or there are fewer
        than two samples.
    """
    t, v = np.asarray(time, dtype=np.float64), np.asarray(values, dtype=np.float64)
    wanted = (t.size,) if width is None else (t.size, width)
    if t.ndim != 1 or v.shape != wanted:
        raise DataError(
            "crash.times-shape-values-needed",
            quantity=quantity,
            shape=t.shape,
            shape_2=v.shape,
            wanted=wanted,
        )
    if t.size < 2:
        raise DataError("crash.sample-no-pulse", quantity=quantity, size=t.size)
    for name, array in (("time", t), (quantity, v)):
        bad = np.flatnonzero(~np.isfinite(array).reshape(t.size, -1).all(axis=1))
        if bad.size:
            raise DataError(
                "crash.not-finite-number-sample",
                row=int(bad[0]) + 1,
                quantity=name,
                bad=int(bad[0]) + 1,
            )
    back = np.flatnonzero(np.diff(t) <= 0.0)
    if back.size:
        k = int(back[0]) + 1
        raise DataError("crash.time-goes", row=k + 1, quantity="time", t=t[k - 1], t_2=t[k])
    return t, v


def step_of(time: Array) -> float:
    """Return the uniform step of a record, for a digital filter.

    Raises
    ------
    DataError
        The steps are not uniform.
    """
    steps = np.diff(time)
    step = float(time[-1] - time[0]) / steps.size
    off = np.flatnonzero(np.abs(steps - step) > SAME_STEP * step)
    if off.size:
        k = int(off[0])
        raise DataError(
            "crash.step-not-mean", row=k + 2, quantity="time", steps=steps[k], step=step
        )
    return step


def from_start(time: Array, values: Array, start: float, quantity: str) -> tuple[Array, Array]:
    """Cut a record so that it begins at `start`, interpolated there.

    Raises
    ------
    DataError
        `start` is not within the record.
    """
    if not time[0] <= start < time[-1]:
        raise DataError(
            "crash.start-not-within-record",
            quantity=quantity,
            start=start,
            time=time[0],
            time_2=time[-1],
        )
    k = int(np.searchsorted(time, start, side="right"))
    flat = values.reshape(values.shape[0], -1)
    share = (start - time[k - 1]) / (time[k] - time[k - 1])
    first = flat[k - 1] + share * (flat[k] - flat[k - 1])
    cut = np.vstack([first, flat[k:]]).reshape(-1, *values.shape[1:])
    return np.concatenate([[start], time[k:]]), cut


def integrals(time: Array, values: Array) -> tuple[Array, Array]:
    """First and second integral from the first sample, exact for values linear between samples.

    Parameters
    ----------
    time : ndarray, (n,), s
    values : ndarray, (n,) or (n, k)

    Returns
    -------
    first, second : ndarray
        Of the shape of `values`, zero at the first sample. Over a step h from a0 to a1 the
        first grows by ``h (a0 + a1)/2`` and the second by ``h v0 + h² (2 a0 + a1)/6``.
    """
    h = np.diff(time).reshape(-1, *([1] * (values.ndim - 1)))
    first = running_integral(time, values)
    grown = h * first[:-1] + h * h * (2.0 * values[:-1] + values[1:]) / 6.0
    return first, np.concatenate([first[:1], np.cumsum(grown, axis=0)])


# First instant at which a quantity with known slope reaches a level.


def cubic(time: Array, values: Array, slopes: Array, at: float) -> tuple[float, float]:
    """Value and slope between samples, on the cubic through the two neighbors.

    Exact for the double integral of an acceleration that is linear between samples.

    Parameters
    ----------
    time, values, slopes : ndarray, (n,)
    at : float
        Within the record.
    """
    k = int(np.clip(np.searchsorted(time, at, side="right") - 1, 0, time.size - 2))
    h = float(time[k + 1] - time[k])
    u = (at - float(time[k])) / h
    y0, y1 = float(values[k]), float(values[k + 1])
    m0, m1 = h * float(slopes[k]), h * float(slopes[k + 1])
    a = 2.0 * (y0 - y1) + m0 + m1
    b = 3.0 * (y1 - y0) - 2.0 * m0 - m1
    return ((a * u + b) * u + m0) * u + y0, ((3.0 * a * u + 2.0 * b) * u + m0) / h


def first_reach(time: Array, values: Array, slopes: Array, level: float) -> float | None:
    """Return the first instant at which a quantity reaches a level from below.

    Parameters
    ----------
    time, values, slopes : ndarray, (n,)
    level : float

    Returns
    -------
    float or None
        None where it stays below. A crossing and return within one step is not detected.
    """
    above = np.flatnonzero(values >= level)
    if not above.size:
        return None
    k = int(above[0])
    if k == 0:
        return float(time[0])
    from scipy.optimize import brentq

    def short(at: float) -> float:
        return cubic(time, values, slopes, at)[0] - level

    # The value at a knot is that of the sample up to rounding: a root there has no change of sign.
    if short(float(time[k])) <= 0.0:
        return float(time[k])
    return float(brentq(short, float(time[k - 1]), float(time[k]), xtol=1e-15, rtol=1e-14))


# Means over a moving window, exact for a record that is linear between its samples.


def moving_means(time: Array, values: Array, width: float) -> tuple[Array, Array]:
    """Means over every window that begins or ends at a sample.

    Parameters
    ----------
    time : ndarray, (n,), s
    values : ndarray, (n,) or (n, k)
    width : float, s
        Need not be an integer number of samples.

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
    # Stamps are sums of steps: a record as long as its window may be shorter by rounding.
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
    """Return the mean of greatest magnitude, signed, and the start of its window.

    Exact for a record that is linear between samples: between two neighboring windows the mean
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


# Zero-phase four-pole Butterworth low-pass of EN 1317-1:2010.

#: Whether the cut-off frequency is that of the whole filter or of each pass.
CUTOFFS = ("whole", "pass")
# Length of the extension before and after the record, s, as in T/HIS for EN 1317-1:2010.
PADDING = 0.5
# Both passes together attenuate by 1/(1 + (f/each)^4), which is 3 dB at this fraction of their
# own cut-off, 0.8022.
PASS_SHARE = (math.sqrt(2.0) - 1.0) ** 0.25


def four_pole(time: Array, values: Array, frequency: float, cutoff: str = "whole") -> Array:
    """Filter forward and backward with two poles each.

    Parameters
    ----------
    time : ndarray, (n,), s
        Uniform steps.
    values : ndarray, (n,) or (n, k)
    frequency : float, Hz
    cutoff : {'whole', 'pass'}
        Whether the whole filter is 3 dB down there, or each pass (6 dB for the whole).

    Returns
    -------
    ndarray
        Of the shape of `values`. The record is extended at both ends by its point reflection,
        by 0.5 s or as much as there is, so that a record that is stationary at its ends starts
        and stops without a transient.

    Raises
    ------
    DataError
        The steps are not uniform, or the record is sampled at less than ten times the frequency.
    ConfigError
        `cutoff` is unknown.
    """
    from scipy.signal import butter, sosfiltfilt

    if cutoff not in CUTOFFS:
        raise ConfigError(
            "crash.no-kind-cut-off", quantity="cutoff", cutoff=cutoff, word=cutoff, known=CUTOFFS
        )
    step = step_of(time)
    if 1.0 / step < 10.0 * frequency:
        raise DataError(
            "crash.rate-hz-less-than-ten", quantity="time", step=1.0 / step, frequency=frequency
        )
    each = frequency / PASS_SHARE if cutoff == "whole" else frequency
    sections = butter(2, each, fs=1.0 / step, output="sos")
    padding = min(round(PADDING / step), time.size - 1)
    return np.asarray(sosfiltfilt(sections, values, axis=0, padtype="odd", padlen=padding))

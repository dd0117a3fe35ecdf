"""The record that the indices take: its checks, and what double integration makes of it."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from strapdown.dsp.running_integral import running_integral
from strapdown.errors import DataError

Array = NDArray[np.float64]
# Stamps are rounded; steps that differ by more than this share are not one rate.
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
        None for one number a sample.
    quantity : str
        For messages.

    Raises
    ------
    DataError
        The shapes disagree, a value is not finite, time does not advance, or there are fewer
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
    """Return the one step of a record, for a digital filter.

    Raises
    ------
    DataError
        The steps differ.
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

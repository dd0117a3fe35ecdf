"""Sample weights of an integral over a window: the gradient of a delta-V."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from strapdown import rotation
from strapdown.crash.acceleration import attitude_of_samples
from strapdown.errors import ConfigError, DataError
from strapdown.tables.checks import as_array, check_time
from strapdown.tables.imu import SAMPLINGS

__all__ = ["resolved_weights", "window_weights"]


Array = NDArray[np.float64]


def window_weights(
    time: ArrayLike, start: float, end: float, sampling: str = "instantaneous"
) -> Array:
    """Weights of the samples in the integral from one instant to another.

    Parameters
    ----------
    time : array_like, (n,), s
        Increasing stamps.
    start, end : float, s
        Within the record; where `end` is before `start`, the integral is negative.
    sampling : {'instantaneous', 'mean'}
        Values at the stamps: interpolated linearly (trapezoids, and parts of trapezoids at the
        ends; second-order error in the step). Means over the interval that ends at the stamp:
        exact from stamp to stamp; within an interval its mean is used throughout (for an end
        inside one: error at most h²/8 of the slope there). The first row of means belongs to
        the time before the record and has zero weight.

    Returns
    -------
    ndarray, (n,), s
        ``w``, such that the integral is ``w @ values``.

    Raises
    ------
    ConfigError
        `sampling` is unknown.
    DataError
        The window extends beyond the record, or time does not increase.
    """
    stamps = as_array(time, None, "time")
    check_time(stamps, None)
    if sampling not in SAMPLINGS:
        raise ConfigError(
            "crash.no-kind-sampling", quantity="sampling", sampling=sampling, samplings=SAMPLINGS
        )
    check_within(stamps, start, end, None)
    return _upto(stamps, end, sampling) - _upto(stamps, start, sampling)


def check_within(time: Array, start: float, end: float, source: str | None) -> None:
    """Refuse a window that is not within a record.

    Raises
    ------
    DataError
        The window is not within it, or the record has fewer than two samples.
    """
    if len(time) < 2:
        raise DataError(
            "crash.sample-change-velocity-needs-least",
            file=source,
            quantity="time",
            count=len(time),
        )
    # Instants computed from stamps may exceed the last by rounding.
    slack = 8.0 * float(np.spacing(np.abs(time[[0, -1]]).max()))
    for instant in (start, end):
        if not time[0] - slack <= instant <= time[-1] + slack:
            raise DataError(
                "crash.window-not-within-record",
                file=source,
                quantity="time",
                start=start,
                end=end,
                time=time[0],
                time_2=time[-1],
            )


def _upto(time: Array, instant: float, sampling: str) -> Array:
    """Weights of the integral from the first stamp."""
    weights = np.zeros(len(time))
    k = int(np.clip(np.searchsorted(time, instant, side="right"), 1, len(time) - 1))
    steps = np.diff(time[:k])
    step = time[k] - time[k - 1]
    u = (instant - time[k - 1]) / step
    if sampling == "mean":
        weights[1:k] = steps
        weights[k] = step * u
    else:
        weights[: k - 1] += 0.5 * steps
        weights[1:k] += 0.5 * steps
        weights[k - 1] += step * (u - 0.5 * u * u)
        weights[k] += step * 0.5 * u * u
    return weights


def resolved_weights(weights: ArrayLike, q_nb: ArrayLike, sampling: str) -> Array:
    """Gradient of a delta-V in north-east-down with respect to the samples in body axes.

    Parameters
    ----------
    weights : array_like, (n,), s
        As `window_weights`.
    q_nb : array_like, (n, 4)
        Attitude at every stamp, as `resolved_acceleration` takes it.
    sampling : {'instantaneous', 'mean'}

    Returns
    -------
    ndarray, (n, 3, 3), s
        ``G``: an error ``e[k]`` of the samples, (3,), changes the delta-V by ``sum G[k] @ e[k]``.

    Raises
    ------
    DataError
        The number of rotations differs from that of samples.
    """
    w = as_array(weights, None, "weights")
    q = attitude_of_samples(q_nb, sampling, len(w))
    turned: Array = w[:, None, None] * rotation.dcm_from_quaternion(q)
    return turned


# Sums over the unknowns of each line of an error budget.


#: Line of the errors that are independent from sample to sample.
NOISE = "sensor noise"


def by_contributor(
    values: Array, columns: Sequence[str], contributors: Sequence[str], more: Mapping[str, Array]
) -> pd.DataFrame:
    """Sum the values of each contributor.

    Parameters
    ----------
    values : ndarray, (p, k)
        Of each unknown: variances, or products.
    columns : sequence of str, (k,)
    contributors : sequence of str, (p,)
        The contributor of each unknown.
    more : dict of ndarray, (k,)
        Additional values without an unknown, by contributor.

    Returns
    -------
    DataFrame
        Indexed by contributor, in the order in which they first occur.
    """
    lines = pd.DataFrame(values, columns=list(columns))
    table = lines.groupby(list(contributors), sort=False).sum()
    for name, values_of_line in more.items():
        already = table.loc[name].to_numpy() if name in table.index else np.zeros(len(columns))
        table.loc[name] = already + values_of_line
    table.index.name = "contributor"
    return table

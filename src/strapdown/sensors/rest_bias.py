"""The bias of a gyro over a log, from its rests."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from strapdown.errors import DataError
from strapdown.results.rests import GyroBiasCourse, RestStretch
from strapdown.tables import GYRO

Array = NDArray[np.float64]

__all__ = ["gyro_bias_at", "gyro_bias_from_rests", "without_gyro_bias"]

# A simulation without noise knows its means to rounding.
LEAST_SD = 1e-12  # rad/s


def gyro_bias_from_rests(rests: Sequence[RestStretch]) -> GyroBiasCourse:
    """Estimate the bias of a gyro, and how it drifts, from the rests of a log.

    Parameters
    ----------
    rests : sequence of RestStretch
        At least one, in order of time. The rate of the Earth is part of what is found: up to
        15 deg/h, and not the same in two poses.

    Returns
    -------
    GyroBiasCourse
        A weighted average, a straight line by least squares, and the rests themselves, between
        which `gyro_bias_at` interpolates. Where the rests scatter by more than their own sd,
        the sd of average and slope are widened by the ratio (Birge 1932,
        doi:10.1103/PhysRev.40.207).

    Raises
    ------
    DataError
        There is no rest, or they are not in order of time.
    """
    if not rests:
        raise DataError("sensors.no-stationary-stretch-found-take", quantity="gyro bias")
    time = np.array([0.5 * (r.start + r.end) for r in rests])
    if (np.diff(time) <= 0.0).any():
        raise DataError("sensors.rests-not-order-time", quantity="gyro bias")
    mean = np.array([r.gyro_mean for r in rests], dtype=np.float64)
    sd = np.maximum(np.array([_mean_sd(r) for r in rests]), LEAST_SD)
    weight = sd**-2.0
    average = (weight * mean).sum(axis=0) / weight.sum(axis=0)
    average_sd = weight.sum(axis=0) ** -0.5
    if len(rests) == 1:
        return GyroBiasCourse(
            _floats(time),
            _triples(mean),
            _triples(sd),
            *_triples([average, average_sd]),
            *[None] * 3,
        )
    scatter = np.sqrt((weight * (mean - average) ** 2).sum(axis=0) / (len(rests) - 1))
    drift, drift_sd = _slope(time, mean, weight)
    average_sd = average_sd * np.maximum(1.0, scatter)
    return GyroBiasCourse(
        _floats(time),
        _triples(mean),
        _triples(sd),
        *_triples([average, average_sd]),
        *_triples([drift, drift_sd, scatter]),
    )


def _mean_sd(rest: RestStretch) -> tuple[float, float, float]:
    # A rest that was made by hand may carry no sd of its mean; that of its samples is wider.
    return rest.gyro_sd if rest.gyro_mean_sd is None else rest.gyro_mean_sd


def _slope(time: Array, mean: Array, weight: Array) -> tuple[Array, Array]:
    middle = (weight * time[:, None]).sum(axis=0) / weight.sum(axis=0)
    from_middle = time[:, None] - middle
    lever = (weight * from_middle**2).sum(axis=0)
    slope = (weight * from_middle * mean).sum(axis=0) / lever
    sd = lever**-0.5
    if len(time) > 2:
        level = (weight * mean).sum(axis=0) / weight.sum(axis=0)
        left = mean - level - slope * from_middle
        sd = sd * np.maximum(1.0, np.sqrt((weight * left**2).sum(axis=0) / (len(time) - 2)))
    return slope, sd


def _floats(values: Array) -> tuple[float, ...]:
    return tuple(float(v) for v in values)


def _triples(rows: ArrayLike) -> tuple[tuple[float, float, float], ...]:
    return tuple((float(x), float(y), float(z)) for x, y, z in np.asarray(rows))


def gyro_bias_at(course: GyroBiasCourse, time: ArrayLike) -> Array:
    """Bias at any instants.

    Parameters
    ----------
    course : GyroBiasCourse
    time : array_like, (n,), s

    Returns
    -------
    ndarray, (n, 3), rad/s
        On straight lines between the middles of the rests; that of the first rest before it,
        and that of the last after it.
    """
    at, mean = np.asarray(time, dtype=np.float64), np.array(course.mean)
    return np.column_stack([np.interp(at, course.time, mean[:, k]) for k in range(3)])


def without_gyro_bias(imu: pd.DataFrame, course: GyroBiasCourse) -> pd.DataFrame:
    """Take the bias off the rates of a log.

    Parameters
    ----------
    imu : DataFrame
        An Imu table; it is not changed.
    course : GyroBiasCourse

    Returns
    -------
    DataFrame
        An Imu table.
    """
    out = imu.copy()
    out.attrs = dict(imu.attrs)
    out[GYRO] = imu[GYRO].to_numpy(dtype=np.float64) - gyro_bias_at(course, imu.index)
    return out

"""Means over parts of a record, and whether the noise of the sensors explains their scatter."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.dsp.chi_square import chi_square_exceeded
from strapdown.dsp.running_integral import running_integral
from strapdown.sensors.imu_uncertainty import BiasDrift
from strapdown.sensors.triad_errors import Triad
from strapdown.tables import ACCEL, GYRO

Array = NDArray[np.float64]

__all__ = ["BlockMeans", "block_means", "excursion", "of_mean", "unexplained"]

#: A scatter that noise gives less often than this is not noise.
CHANCE = 1e-6


@dataclass(frozen=True, eq=False)
class BlockMeans:
    """Means over equal parts of a record.

    Attributes
    ----------
    length : float, s
        Of the record.
    rate, force : ndarray, (m, 3), rad/s and m/s²
    whole_rate, whole_force : ndarray, (3,)
        Means over all samples.
    """

    length: float
    rate: Array
    force: Array
    whole_rate: Array
    whole_force: Array


def block_means(imu: pd.DataFrame, blocks: int) -> BlockMeans:
    """Average an Imu table as a whole and by parts.

    Parameters
    ----------
    imu : DataFrame
    blocks : int
        Parts of equal time; those without a sample are left out.

    Returns
    -------
    BlockMeans
        Each sample counts for the time that it stands for.
    """
    time = imu.index.to_numpy(dtype=np.float64)
    values = imu[[*GYRO, *ACCEL]].to_numpy(dtype=np.float64)
    weight = _stands_for(time, bool(imu.attrs["sampling"] == "mean"))
    edges = np.searchsorted(time, np.linspace(time[0], time[-1], blocks + 1)[:-1])
    edges = np.unique(edges)
    sums = np.add.reduceat(values * weight[:, None], edges, axis=0)
    lasted = np.add.reduceat(weight, edges)
    there = lasted > 0.0
    means = sums[there] / lasted[there, None]
    whole = sums.sum(axis=0) / lasted.sum()
    return BlockMeans(float(lasted.sum()), means[:, :3], means[:, 3:], whole[:3], whole[3:])


def _stands_for(time: Array, mean: bool) -> Array:
    steps = np.diff(time)
    if mean:
        # The first mean belongs to an interval before the record, whose length it does not tell.
        return np.asarray(np.r_[0.0, steps])
    return np.asarray(0.5 * (np.r_[steps, 0.0] + np.r_[0.0, steps]))


def unexplained(means: Array, length: float, density: Triad, drift: BiasDrift) -> float:
    """Scatter of block means over what noise gives, where it is more than chance; else 1.

    Parameters
    ----------
    means : ndarray, (m, 3)
        Of equal parts.
    length : float, s
        Of the record.
    density : triad
        White noise, unit of `means` over √Hz.
    drift : BiasDrift

    Returns
    -------
    float
        Ratio of standard deviations of the worst axis.

    Notes
    -----
    Within a record a Gauss-Markov process walks by ``q = 2 sd²/correlation_time`` a second, and
    the means of its parts scatter about that of the whole by ``q length/6`` (variance).
    """
    m = len(means)
    if m < 2:
        return 1.0
    walk = np.square(drift.triad) * min(1.0, length / (3.0 * drift.correlation_time))
    expected = np.square(density) * m / length + walk
    measured = means.var(axis=0, ddof=1)
    # An ideal sensor at rest scatters by rounding.
    floor = 1e-24 * float(np.square(means).sum(axis=1).max())
    ratio = float(np.max(measured / np.maximum(expected, floor + 1e-300)))
    limit = chi_square_exceeded(CHANCE / 3.0, m - 1) / (m - 1)
    return math.sqrt(ratio) if ratio > limit else 1.0


def of_mean(means: Array) -> Array:
    """Covariance of a mean from the scatter of its parts.

    Parameters
    ----------
    means : ndarray, (m, k)
        Of equal parts.

    Returns
    -------
    ndarray, (k, k)
        As if the parts were independent: too large for what swings to and fro, whose parts
        take back from one another.
    """
    off = means - means.mean(axis=0)
    count = len(means)
    return np.asarray(off.T @ off / (count * (count - 1)))


def excursion(imu: pd.DataFrame, density: Triad) -> Array:
    """Covariance of the small angles by which a body swings about its mean attitude.

    Parameters
    ----------
    imu : DataFrame
    density : triad, rad/s/√Hz
        What the noise of the gyros would make of it is taken off.

    Returns
    -------
    ndarray, (3, 3), rad²
        Body axes: of the integral of the rate less its line of regression. A walk of the noise
        keeps a fifteenth of its variance at the end on average.
    """
    time = imu.index.to_numpy(dtype=np.float64)
    gyro = imu[GYRO].to_numpy(dtype=np.float64)
    angle = running_integral(time, gyro, means=imu.attrs["sampling"] == "mean")
    line = np.column_stack([np.ones_like(time), (time - time.mean()) / (time[-1] - time[0])])
    angle -= line @ np.linalg.lstsq(line, angle, rcond=None)[0]
    swing = angle.T @ angle / len(angle)
    swing -= np.diag(np.square(density)) * (time[-1] - time[0]) / 15.0
    values, vectors = np.linalg.eigh(swing)
    return np.asarray((vectors * np.maximum(values, 0.0)) @ vectors.T)

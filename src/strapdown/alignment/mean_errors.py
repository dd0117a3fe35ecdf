"""Uncertainty of the mean rate and specific force of a stationary body."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pandas as pd

from strapdown.alignment.inertial_sums import InertialSums
from strapdown.dsp.chi_square import chi_square_exceeded
from strapdown.dsp.samples import running_integral
from strapdown.sensors.triad_errors import Triad
from strapdown.sensors.uncertainty import BiasDrift, ImuUncertainty
from strapdown.tables import ACCEL, GYRO
from strapdown.tables.checks import Array


def rate_covariance(sensors: ImuUncertainty, length: float, rate: Array, force: Array) -> Array:
    """Covariance of a mean rate.

    `length` (s): time over which it is a mean. `rate`, `force` ((3,), rad/s and m/s²): the means.
    Returns (3, 3), (rad/s)².
    """
    gyro = sensors.gyro
    variance = gyro.variance_by_input(rate)
    variance += np.array(gyro.axis("g_sensitivity")) ** 2 * float(force @ force)
    variance += _own(gyro.axis("bias"), gyro.axis("noise_density"), sensors.gyro_drift, length)
    return np.diag(variance)


def force_covariance(sensors: ImuUncertainty, length: float, force: Array) -> Array:
    """Covariance of a mean specific force; (3, 3), (m/s²)², as `rate_covariance`."""
    accel = sensors.accel
    variance = accel.variance_by_input(force)
    variance += _own(accel.axis("bias"), accel.axis("noise_density"), sensors.accel_drift, length)
    return np.diag(variance)


def gravity_change(force: Array, covariance: Array, gravity: Array) -> tuple[float, float]:
    """Magnitude of a mean specific force against gravity, relative, and its standard deviation.

    `force` ((3,), m/s²). `covariance` ((3, 3), (m/s²)²): in the same axes. `gravity` ((3,), m/s²):
    in any. Returns `change`, `sd`.
    """
    size, g = (float(np.sqrt(x @ x)) for x in (force, gravity))
    return size / g - 1.0, float(np.sqrt(force @ covariance @ force)) / (size * g)


def mean_of_drift(drift: BiasDrift, length: float) -> Array:
    """Variance of the mean of a drift over a time, (3,), its unit squared.

    With x the time over the correlation time: ``2 sd² (x - 1 + exp(-x))/x²`` by the Gauss-Markov
    process, and a third of the walk's at the end.
    """
    x = length / drift.correlation_time
    part = 1.0 if x < 1e-4 else 2.0 * (x + math.expm1(-x)) / (x * x)
    return np.asarray(np.square(drift.triad) * part + np.square(drift.steps) * length / 3.0)


def _own(bias: Triad, density: Triad, drift: BiasDrift, length: float) -> Array:
    noise = np.square(density) / length
    return np.asarray(np.square(bias) + noise + mean_of_drift(drift, length))


# Means over parts of a record, and a test of their scatter against the noise of the sensors.

#: Scatter less probable than this is not noise.
CHANCE = 1e-6


@dataclass(frozen=True, eq=False)
class BlockMeans:
    """Means over equal parts of a record.

    `length` (s): of the record. `rate`, `force` ((m, 3), rad/s and m/s²). `whole_rate`,
    `whole_force` ((3,)): means over all samples.
    """

    length: float
    rate: Array
    force: Array
    whole_rate: Array
    whole_force: Array

    def scatter(self, sensors: ImuUncertainty) -> tuple[float, float]:
        """Scatter of the rate and of the force beyond their noise, as `unexplained`."""
        gyro, accel = sensors.gyro.axis("noise_density"), sensors.accel.axis("noise_density")
        return (
            unexplained(self.rate, self.length, gyro, sensors.gyro_drift),
            unexplained(self.force, self.length, accel, sensors.accel_drift),
        )


def block_means(imu: pd.DataFrame, blocks: int) -> BlockMeans:
    """Average an Imu table as a whole and by parts.

    `blocks`: parts of equal time; those without a sample are left out. Each sample is weighted by
    its time interval.
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
        # The first mean belongs to an interval before the record, of unknown length.
        return np.asarray(np.r_[0.0, steps])
    return np.asarray(0.5 * (np.r_[steps, 0.0] + np.r_[0.0, steps]))


def unexplained(means: Array, length: float, density: Triad, drift: BiasDrift) -> float:
    """Scatter of block means over that of the noise, if significant; else 1.

    `means` ((m, 3)): of equal parts. `length` (s): of the record. `density`: white noise, unit of
    `means` over √Hz. Returns ratio of standard deviations of the worst axis.

    Within a record a Gauss-Markov process walks by ``q = 2 sd²/correlation_time`` a second, beside
    a random walk, and the means of parts scatter about that of the whole by ``q length/6``
    (variance).
    """
    m = len(means)
    if m < 2:
        return 1.0
    walk = np.square(drift.triad) * min(1.0, length / (3.0 * drift.correlation_time))
    walk = walk + np.square(drift.steps) * length / 6.0
    expected = np.square(density) * m / length + walk
    measured = means.var(axis=0, ddof=1)
    # An ideal sensor at rest scatters by rounding.
    floor = 1e-24 * float(np.square(means).sum(axis=1).max())
    ratio = float(np.max(measured / np.maximum(expected, floor + 1e-300)))
    limit = chi_square_exceeded(CHANCE / 3.0, m - 1) / (m - 1)
    return math.sqrt(ratio) if ratio > limit else 1.0


def of_mean(means: Array) -> Array:
    """Covariance of a mean from the scatter of its parts.

    `means` ((m, k)): of equal parts. Returns (k, k): as if the parts were independent: too large
    for an oscillation, whose parts are negatively correlated.
    """
    off = means - means.mean(axis=0)
    count = len(means)
    return np.asarray(off.T @ off / (count * (count - 1)))


def excursion(imu: pd.DataFrame, density: Triad) -> Array:
    """Covariance of the small angles of a body's swing about its mean attitude.

    `density` (rad/s/√Hz): the effect of the gyro noise is subtracted. Returns (3, 3), rad²: body
    axes: of the integral of the rate minus its regression line. A walk of the noise keeps a
    fifteenth of its variance at the end on average.
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


# Effect of sensor errors on an estimate that is linear in them.


def sensor_noise(sums: InertialSums, turn: Array, push: Array, sensors: ImuUncertainty) -> Array:
    """Covariance by white noise alone; arguments and result as `sensor_covariance`."""
    gyro = _noise(turn, sums, sensors.gyro.axis("noise_density"))
    return gyro + _noise(push, sums, sensors.accel.axis("noise_density"))


def sensor_covariance(
    sums: InertialSums, turn: Array, push: Array, sensors: ImuUncertainty
) -> Array:
    """Covariance of an estimate of k numbers by all constant or drifting errors of the sensors.

    `turn`, `push` ((m, k, 3)): sensitivities of the estimate to an error of the angle and of the
    velocity gained within a node; the error in the body axes at the first instant. `sensors`:
    biases, their drift, scale, misalignment and g-sensitivity; nonlinearity and the rectification
    of vibration are not in it. Returns (k, k).
    """
    gyro, accel = sensors.gyro, sensors.accel
    total = _biases(turn, sums, gyro.axis("bias"), sensors.gyro_drift)
    total += _biases(push, sums, accel.axis("bias"), sensors.accel_drift)
    for response, inputs, scale, across in (
        (turn, sums.turns, gyro.axis("scale"), gyro.axis("misalignment")),
        (push, sums.pushes, accel.axis("scale"), accel.axis("misalignment")),
        (turn, sums.pushes, gyro.axis("g_sensitivity"), gyro.axis("g_sensitivity")),
    ):
        sd = np.where(np.eye(3, dtype=np.bool_), np.diag(scale), np.array(across)[:, None])
        if sd.any():
            effect = np.einsum("mkh,mhij->kij", response, inputs) * sd
            flat = effect.reshape(len(effect), 9)
            total += flat @ flat.T
    return np.asarray(total)


def _noise(response: Array, sums: InertialSums, density: tuple[float, float, float]) -> Array:
    """White noise: independent from node to node."""
    turns = sums.times / sums.node_length[:, None, None]
    effect = (response @ turns) * np.array(density)
    return np.asarray(np.einsum("mki,mli,m->kl", effect, effect, sums.node_length))


def _biases(
    response: Array, sums: InertialSums, sd: tuple[float, float, float], drift: BiasDrift
) -> Array:
    by_node = response @ sums.times
    whole = by_node.sum(axis=0) * np.array(sd)
    total = whole @ whole.T
    if any(drift.triad):
        t = sums.middles
        like = np.exp(-np.abs(t[:, None] - t[None, :]) / drift.correlation_time)
        changing = by_node * np.array(drift.triad)
        total += np.einsum("mki,mn,nli->kl", changing, like, changing, optimize=True)
    if any(drift.steps):
        since = sums.middles - sums.middles[0]
        changing = by_node * np.array(drift.steps)
        like = np.minimum(since[:, None], since[None, :])
        total += np.einsum("mki,mn,nli->kl", changing, like, changing, optimize=True)
    return np.asarray(total)

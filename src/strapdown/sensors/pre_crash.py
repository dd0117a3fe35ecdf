"""Stretch before a crash that determines biases and attitude, and the prepared unit."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.dsp.chi_square import chi_square_quantile
from strapdown.ellipsoids import WGS84
from strapdown.errors import Finding
from strapdown.sensors.crash_unit import CrashUnit
from strapdown.sensors.rest import (
    LEAST_LENGTH,
    MAX_GYRO_SD,
    MAX_MEAN_RATE,
    RestStretch,
    find_rests,
    rest_between,
)
from strapdown.sensors.triad_errors import Triad, triad_of
from strapdown.tables import ACCEL, GYRO
from strapdown.tables.checks import Array

# Block lengths for comparing means within a stretch: long for long records, short for records that
# start a tenth of a second before the impact.
LONG_BLOCK, SHORT_BLOCK = 0.5, 0.02  # s
LEAST_IN_BLOCK = 5
LEAST_STEADY = 0.04  # s
# Search range for a short stretch.
SHORT_REACH = 1.0  # s
# Quiet means within three times the noise of the quietest twentieth, as in `rest`.
QUIET_QUANTILE, QUIET_FACTOR = 0.05, 3.0
# A noise-free (simulated) sensor is quiet where it is constant to rounding.
ROUNDING_GYRO, ROUNDING_ACCEL = 1e-9, 1e-6  # rad/s, m/s²
# Driving vibrates the floor by more than this; a stationary car without its engine does not.
MAX_ACCEL_SD = 0.3  # m/s², of an axis, beyond the sensor's own noise
# Means within one stationary stretch agree to their noise plus this: people move in a car.
SAME_FORCE, SAME_FORCE_SIGMAS = 0.05, 5.0  # m/s², standard deviations
# A vehicle that moves at the impact was not stationary this shortly before.
LAST_STOP = 0.5  # s
# Biases drift with temperature, so a stationary stretch this shortly before the impact is
# preferred.
RECENT = 60.0  # s


def find_pre_crash_rest(
    imu: pd.DataFrame,
    *,
    impact: float = 0.0,
    moving_at_impact: bool = True,
    accel_noise: float = 0.0,
    gyro_noise: float = 0.0,
) -> RestStretch | None:
    """Find a stationary, or else a steady, stretch before a crash.

    `imu`: Imu table with acceleration of the lowest range. `impact` (s): samples after it are not
    used. `moving_at_impact`: a vehicle that moves at the impact was not stationary just before: a
    quiet stretch up to the impact is then coasting, grade ``steady``. False for a vehicle struck
    while stationary. `accel_noise`, `gyro_noise` (m/s² and rad/s): stated standard deviation of a
    sample of an axis: a lower limit of the noise. Of grade ``still``: the longest that ended within
    a minute before the impact, else the latest. Otherwise ``steady``: no rotation and constant
    specific force for at least 40 ms. An inertial sensor cannot distinguish constant velocity from
    rest, nor constant acceleration from a tilt. None if the record has neither.

    The gyro selects the candidates (`sensors.rest.find_rests`). Because a gyro does not sense a car
    driving off, each candidate is divided where the mean specific force changes by more than 50
    mm/s² and five standard deviations, and where it is noisier than three times the quietest part
    of the record.
    """
    before = imu[imu.index.to_numpy(dtype=np.float64) < impact]
    if len(before) < LEAST_IN_BLOCK:
        return None
    floors = (accel_noise, gyro_noise)
    stamps = before.index.to_numpy(dtype=np.float64)
    candidates = [(r.start, r.end) for r in find_rests(before[GYRO])]
    # Sample noise of a fast gyro exceeds the limit that `find_rests` applies.
    if not candidates:
        candidates = [(float(stamps[0]), float(stamps[-1]))]
    spans = [
        span
        for start, end in candidates
        for span in _parts(before[(stamps >= start) & (stamps <= end)], LONG_BLOCK, floors)
        if span[1] - span[0] >= LEAST_LENGTH
    ]
    still = [s for s in spans if s[1] < impact - LAST_STOP or not moving_at_impact]
    if still:
        recent = [s for s in still if s[1] >= impact - RECENT]
        # The longest of the recent ones, else the latest.
        best = max(recent or still, key=lambda s: s[1] - s[0] if recent else s[1])
        return rest_between(before, *best, grade="still")
    if not spans:
        late = before[stamps >= impact - SHORT_REACH]
        spans = [s for s in _parts(late, SHORT_BLOCK, floors) if s[1] - s[0] >= LEAST_STEADY]
    if not spans:
        return None
    best = max(spans, key=lambda s: s[1] - s[0])
    standing = not moving_at_impact
    return rest_between(before, *best, grade="still" if standing else "steady")


def _parts(
    imu: pd.DataFrame, block: float, floors: tuple[float, float]
) -> list[tuple[float, float]]:
    """First and last stamp of the parts that are quiet and have one mean specific force."""
    time = imu.index.to_numpy(dtype=np.float64)
    if time.size < 2 * LEAST_IN_BLOCK:
        return []
    accel, gyro = imu[ACCEL].to_numpy(dtype=np.float64), imu[GYRO].to_numpy(dtype=np.float64)
    size = max(LEAST_IN_BLOCK, round(block / float(np.median(np.diff(time)))))
    # Whole blocks; the last one ends with the stretch.
    starts = np.arange(time.size % size, time.size, size)
    if starts.size < 2:
        return []
    first = int(starts[0])
    force, rate = (v[first:].reshape(-1, size, 3) for v in (accel, gyro))
    force_sd, rate_sd = force.std(axis=1), np.sqrt(rate.var(axis=1).sum(axis=1))
    limit = _threshold(force_sd, size - 1, size, floors[0], ROUNDING_ACCEL, MAX_ACCEL_SD)
    quiet = (force_sd <= limit).all(axis=1)
    # Of the three axes combined.
    stated = math.sqrt(3.0) * floors[1]
    degrees = 3 * (size - 1)
    quiet &= rate_sd <= _threshold(rate_sd, degrees, 3 * size, stated, ROUNDING_GYRO, MAX_GYRO_SD)
    quiet &= np.abs(rate.mean(axis=1)).max(axis=1) <= MAX_MEAN_RATE
    means = force.mean(axis=1)
    noise = np.median(force_sd[quiet], axis=0) if quiet.any() else np.zeros(3)
    spans: list[tuple[float, float]] = []
    for group in _groups(quiet, means, noise / math.sqrt(size)):
        a, b = first + group[0] * size, first + (group[-1] + 1) * size - 1
        spans.append((float(time[a]), float(time[b])))
    return spans


def _threshold(
    sd: Array, degrees: int, values: int, stated: float, rounding: float, most: float
) -> Array:
    """Per column, three times the quietest or the stated noise, limited by a cap."""
    # The quietest of many short blocks is low by chance; this is the factor for normal noise.
    chance = math.sqrt(chi_square_quantile(QUIET_QUANTILE, degrees) / values)
    quietest = np.quantile(sd, QUIET_QUANTILE, axis=0) / chance
    cap = np.hypot(most, QUIET_FACTOR * stated)
    limit = np.maximum(QUIET_FACTOR * np.maximum(quietest, stated), rounding)
    return np.asarray(np.minimum(limit, cap))


def _groups(quiet: NDArray[np.bool_], means: Array, noise: Array) -> list[list[int]]:
    """Consecutive quiet blocks whose means agree with the mean of the preceding ones."""
    groups: list[list[int]] = []
    total = np.zeros(3)
    for k in range(len(means)):
        if not quiet[k]:
            continue
        if groups and groups[-1][-1] == k - 1:
            size = len(groups[-1])
            allowed = SAME_FORCE + SAME_FORCE_SIGMAS * noise * math.sqrt(1.0 + 1.0 / size)
            if (np.abs(means[k] - total / size) <= allowed).all():
                groups[-1].append(k)
                total = total + means[k]
                continue
        groups.append([k])
        total = means[k].copy()
    return groups


@dataclass(frozen=True)
class BiasEstimate:
    """Bias of a triad and its standard deviation.

    `bias`, `sd` (u).
    """

    bias: tuple[float, float, float]
    sd: tuple[float, float, float]


def gyro_bias_from(
    rest: RestStretch | None, stated: tuple[float, float, float], *, steady_rate: float = 0.01
) -> BiasEstimate:
    """Gyro bias from a stretch before the crash.

    `rest`: in the axes of the gyro. `stated` (rad/s): prior standard deviation of the bias.
    `steady_rate` (rad/s): standard deviation of the vehicle's rate over a ``steady`` stretch: 0.6
    deg/s is a bend of 1.5 km radius at 15 m/s. Without a stretch, zero with the stated sd. At rest,
    the mean and its sd; the Earth's rate, up to 7.3e-5 rad/s, is part of the bias and is included
    in the sd. Over a steady stretch the mean and the stated bias are weighted by their variances.
    """
    if rest is None:
        return BiasEstimate((0.0, 0.0, 0.0), stated)
    mean = np.asarray(rest.gyro_mean)
    noise = np.asarray(rest.gyro_sd if rest.gyro_mean_sd is None else rest.gyro_mean_sd)
    sd = np.hypot(noise, WGS84.rotation_rate / math.sqrt(3.0))
    if rest.grade == "steady":
        sd = np.hypot(sd, steady_rate)
        prior = np.asarray(stated)
        weight = prior**2 / (prior**2 + sd**2)
        mean, sd = weight * mean, np.sqrt(weight) * sd
    return BiasEstimate(triad_of(mean), triad_of(sd))


def in_axes(rest: RestStretch, C: Array) -> RestStretch:
    """Rotate a stretch into other axes.

    `C` ((3, 3)): rotates vectors into the other axes. Standard deviations are rotated as for
    independent axes.
    """
    values: dict[str, Any] = {}
    for kind in ("gyro", "accel"):
        for name in (f"{kind}_mean", f"{kind}_sd", f"{kind}_mean_sd"):
            v = getattr(rest, name)
            if v is not None:
                sd = name.endswith("_sd")
                values[name] = triad_of(
                    np.sqrt(C**2 @ np.asarray(v) ** 2) if sd else C @ np.asarray(v)
                )
    return replace(rest, **values)


# A unit after preparation: common clock, vehicle axes, one range, biases removed.

# In `PreparedUnit.bias_from`: bias from gravity in the stated attitude.
FROM_GRAVITY = -1


@dataclass(frozen=True)
class Levelling:
    """Roll and pitch of the vehicle at rest, and their source.

    Attributes
    ----------
    roll_deg, pitch_deg : float, deg
    sd_deg : float, deg
        Standard deviation of each, from the noise of the mean and the user's statement, without
        accelerometer bias. The bias is a separate contributor because it also acts later.
    from_rest : bool
        Determined from the accelerometers at rest (or at constant velocity); otherwise stated.
    """

    roll_deg: float
    pitch_deg: float
    sd_deg: float
    from_rest: bool


@dataclass(frozen=True, eq=False)
class PreparedUnit:
    """Data of a unit after all processing that precedes navigation.

    Attributes
    ----------
    unit : CrashUnit
        As recorded.
    imu : DataFrame
        Imu table in vehicle axes, at the unit's own position, time from the common trigger in s;
        estimated biases are removed.
    range_spoken : ndarray of int8, (n, 3)
        Index in `unit.accelerometers` of the range used, for each sensor axis.
    clipped : ndarray of bool, (n, 3)
        Whether even that range was saturated, for each sensor axis.
    gyro_clipped : ndarray of bool, (n, 3)
    noise : ndarray, (n, 3), m/s²
        Standard deviation of each specific force sample, in sensor axes.
    gyro_noise : ndarray, (n, 3), rad/s
        Standard deviation of each rate sample, likewise.
    rest : RestStretch or None
        Stationary (or steady) stretch before the crash, from the lowest range, in vehicle axes,
        common clock.
    rest_accel_sd : float, m/s²
        Standard deviation of the vehicle's own acceleration over it, per axis: zero at rest.
    levelling : Levelling
    gyro_bias_sd : triad, rad/s
        Remaining after the stretch; sensor axes of the unit that has the gyro.
    bias_from : tuple of int or None
        For every range, the range that its bias was taken from; `FROM_GRAVITY` for gravity in the
        stated attitude; None if its own bias was not removed.
    bias_sd : tuple of triad, m/s²
        Standard deviation of that difference (noise of the means), for every range.
    gravity_matched : bool
        Whether the specific force at rest was corrected to the magnitude of gravity.
    gravity_correction : float, m/s²
        Correction added along the specific force at rest.
    gyro_bias : triad, rad/s
        Subtracted from the rates; sensor axes of this unit.
    force_bias : triad, m/s²
        Subtracted from the specific force of the lowest range in all; vehicle axes.
    findings : tuple of Finding
    """

    unit: CrashUnit
    imu: pd.DataFrame
    range_spoken: NDArray[np.int8]
    clipped: NDArray[np.bool_]
    gyro_clipped: NDArray[np.bool_]
    noise: Array
    gyro_noise: Array
    rest: RestStretch | None
    rest_accel_sd: float
    levelling: Levelling
    gyro_bias_sd: Triad
    bias_from: tuple[int | None, ...]
    bias_sd: tuple[Triad, ...]
    gravity_matched: bool
    gravity_correction: float = 0.0
    gyro_bias: Triad = (0.0, 0.0, 0.0)
    force_bias: Triad = (0.0, 0.0, 0.0)
    findings: tuple[Finding, ...] = ()

    @property
    def noise_covariance(self) -> Array:
        """Covariance of each specific force sample, vehicle axes, (n, 3, 3), (m/s²)²."""
        return self._in_vehicle_axes(self.noise)

    @property
    def gyro_noise_covariance(self) -> Array:
        """Covariance of each rate sample, vehicle axes, (n, 3, 3), (rad/s)²."""
        return self._in_vehicle_axes(self.gyro_noise)

    def _in_vehicle_axes(self, sd: Array) -> Array:
        C = self.unit.mounting.C_vs
        return np.asarray(np.einsum("ij,nj,kj->nik", C, sd**2, C))

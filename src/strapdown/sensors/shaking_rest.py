"""Rests that are shaken: a parked car with people in it, a sensor on a running machine."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.results.rests import RestStretch
from strapdown.sensors.rest import MAX_MEAN_RATE, find_rests, of_one_bias, rest_between
from strapdown.tables import ACCEL, GYRO

Array = NDArray[np.float64]

__all__ = ["find_rests_of_every_grade", "find_shaking_rests"]

# What shakes about one attitude has means over half a second that stay; what drives does not.
# In a car of 2 to 14 m/s on streets and in one on a motorway, no window of 4 s had means that
# scatter by less than 0.33 deg/s and 0.084 m/s² (both axes' worth together); parked with people
# getting in and doors slammed they scatter by 0.03 to 0.19 deg/s and 0.004 to 0.061 m/s².
WINDOW = 4.0  # s
BLOCKS = 8
STEP = 1.0  # s
MAX_GYRO_SCATTER = 0.0044  # rad/s, 0.25 deg/s: root of the summed variances of the block means
MAX_ACCEL_SCATTER = 0.065  # m/s²
# A hand or a foot exceeds these whatever its means do, and so does a vibrating motor mount.
MAX_GYRO_SD = 0.1  # rad/s
MAX_ACCEL_SD = 1.0  # m/s²
NEAR_GRAVITY = (0.8 * 9.81, 1.2 * 9.81)  # m/s²


def find_shaking_rests(imu: pd.DataFrame) -> tuple[RestStretch, ...]:
    """Find stretches that shake about one attitude, from what is slow in the signals.

    Parameters
    ----------
    imu : DataFrame
        An Imu table with acceleration.

    Returns
    -------
    tuple of RestStretch
        In order of time, each at least 4 s long, of grade ``shaking``; those that
        `sensors.rest.find_rests` finds are found again where they last so long. Empty without
        an accelerometer: a gyro alone cannot tell a parked car from a straight road.

    Notes
    -----
    A window of 4 s is cut into eight parts. It is a rest where the means of the parts of the
    gyro stay within 0.25 deg/s, and those of the specific force within 65 mm/s². Motion at a
    constant velocity on a perfect road is the same to every inertial sensor: this is why the
    limits are what roads do not keep, and why the grade says so.
    """
    if not set(ACCEL) <= set(imu.columns):
        return ()
    time = imu.index.to_numpy(dtype=np.float64)
    values = imu[[*GYRO, *ACCEL]].to_numpy(dtype=np.float64)
    spans: list[tuple[float, float]] = []
    for start in np.arange(time[0], time[-1] - WINDOW + 1e-9, STEP):
        if not _shakes_in_place(time, values, float(start)):
            continue
        if spans and start <= spans[-1][1]:
            spans[-1] = (spans[-1][0], float(start) + WINDOW)
        else:
            spans.append((float(start), float(start) + WINDOW))
    return of_one_bias([rest_between(imu, a, b, grade="shaking") for a, b in spans])


def _shakes_in_place(time: Array, values: Array, start: float) -> bool:
    edges = np.searchsorted(time, start + np.linspace(0.0, WINDOW, BLOCKS + 1))
    if np.diff(edges).min() < 3:
        return False
    whole = values[edges[0] : edges[-1]]
    mean, variance = whole.mean(axis=0), whole.var(axis=0)
    if np.sqrt(variance[:3].sum()) > MAX_GYRO_SD or np.sqrt(variance[3:].sum()) > MAX_ACCEL_SD:
        return False
    size = float(np.sqrt(mean[3:] @ mean[3:]))
    if not NEAR_GRAVITY[0] <= size <= NEAR_GRAVITY[1]:
        return False
    if np.sqrt(mean[:3] @ mean[:3]) > MAX_MEAN_RATE:
        return False
    means = np.add.reduceat(whole, edges[:-1] - edges[0], axis=0) / np.diff(edges)[:, None]
    scatter = means.var(axis=0)
    return bool(
        np.sqrt(scatter[:3].sum()) <= MAX_GYRO_SCATTER
        and np.sqrt(scatter[3:].sum()) <= MAX_ACCEL_SCATTER
    )


def find_rests_of_every_grade(imu: pd.DataFrame) -> tuple[RestStretch, ...]:
    """Find the still rests of a log, and between them those that shake.

    Parameters
    ----------
    imu : DataFrame
        An Imu table.

    Returns
    -------
    tuple of RestStretch
        In order of time, none overlapping another. A shaking rest that meets a still one is
        one rest: it reaches as far as both do, and is of grade ``shaking``, where it is longer
        by more than a window on either side; else the still one stands as it is.
    """
    still = list(find_rests(imu))
    found: list[RestStretch] = []
    for shaking in find_shaking_rests(imu):
        inside = [r for r in still if r.start < shaking.end and shaking.start < r.end]
        start = min([shaking.start, *(r.start for r in inside)])
        end = max([shaking.end, *(r.end for r in inside)])
        covered = sum(r.end - r.start for r in inside)
        if inside and end - start - covered <= WINDOW:
            continue
        still = [r for r in still if r not in inside]
        whole = rest_between(imu, start, end, grade="shaking") if inside else shaking
        found.append(replace(whole, grade="shaking"))
    # A still rest may reach into two shaking ones.
    return _apart(sorted([*still, *found], key=lambda r: r.start), imu)


def _apart(rests: list[RestStretch], imu: pd.DataFrame) -> tuple[RestStretch, ...]:
    apart: list[RestStretch] = []
    for rest in rests:
        if apart and rest.start <= apart[-1].end:
            last = apart.pop()
            rest = rest_between(imu, last.start, max(last.end, rest.end), grade="shaking")
        apart.append(rest)
    return tuple(apart)

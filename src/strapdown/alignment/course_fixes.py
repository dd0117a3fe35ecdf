"""Velocities of the fixes of a drive, and which of them have a course."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.errors import DataError
from strapdown.tables import VELOCITY, VELOCITY_SD, check_gnss
from strapdown.tables.checks import source_of

Array = NDArray[np.float64]

__all__ = ["Antenna", "CourseFixes", "course_fixes"]

#: No receiver knows a velocity better, m/s.
LEAST_SD = 1e-6


@dataclass(frozen=True)
class Antenna:
    """Where a receiver measures, and when.

    Attributes
    ----------
    lever_arm : triad, m
        From the inertial sensors, body axes.
    velocity_delay : float, s
        By which a stated velocity is older than its stamp.
    time_offset_sd : float, s
        By which all stamps may be wrong.
    """

    lever_arm: tuple[float, float, float] = (0.0, 0.0, 0.0)
    velocity_delay: float = 0.0
    time_offset_sd: float = 0.0


@dataclass(frozen=True, eq=False)
class CourseFixes:
    """Fixes with a velocity during an inertial record.

    Attributes
    ----------
    time : ndarray, (k,), s
        At which the velocities hold.
    velocity, sd : ndarray, (k, 3), m/s
        North, east, down. The standard deviation of the last may be infinite.
    fast : ndarray of bool, (k,)
        Whether they are fast enough to have a course.
    row : ndarray of int, (k,)
        Of the table, from 1.
    source : str, optional
        Of the fixes.
    """

    time: Array
    velocity: Array
    sd: Array
    fast: NDArray[np.bool_]
    row: NDArray[np.int64]
    source: str | None

    def only(self, rows: NDArray[np.bool_]) -> CourseFixes:
        """Some of them."""
        return CourseFixes(
            self.time[rows],
            self.velocity[rows],
            self.sd[rows],
            self.fast[rows],
            self.row[rows],
            self.source,
        )


def course_fixes(
    imu: pd.DataFrame,
    gnss: pd.DataFrame | None,
    least_speed: float,
    largest_sd: float,
    velocity_delay: float = 0.0,
) -> CourseFixes:
    """Take the fixes with a velocity of a record that ends while it drives.

    Parameters
    ----------
    imu : DataFrame
    gnss : DataFrame, optional
    least_speed : float, m/s
    largest_sd : float, rad
        Of a course by the noise of the receiver.
    velocity_delay : float, s

    Returns
    -------
    CourseFixes

    Raises
    ------
    DataError
        There is no Gnss table, fewer than two fixes with a velocity during the record, or the
        last two of them are too slow.
    """
    if gnss is None:
        raise DataError("alignment.no-fixes-for-course", file=source_of(imu), quantity="gnss")
    check_gnss(gnss)
    source = source_of(gnss)
    first, last = float(imu.index[0]), float(imu.index[-1])
    time = gnss.index.to_numpy(dtype=np.float64) - velocity_delay
    velocity = gnss[VELOCITY].to_numpy(dtype=np.float64)
    sd = gnss[VELOCITY_SD].to_numpy(dtype=np.float64)
    good = (time >= first) & (time <= last) & (gnss["quality"].to_numpy() > 0.0)
    timely = int(good.sum())
    good &= np.isfinite(sd[:, :2]).all(axis=1)
    if good.sum() < 2:
        raise DataError(
            "alignment.too-few-fix-velocities",
            file=source,
            quantity="VN, VE",
            first=first,
            last=last,
            timely=timely,
            good=int(good.sum()),
        )
    rows = np.flatnonzero(good)
    time, velocity, sd = time[rows], velocity[rows], np.maximum(sd[rows], LEAST_SD)
    speed = np.hypot(velocity[:, 0], velocity[:, 1])
    course_sd = sd[:, :2].max(axis=1) / np.maximum(speed, 1e-9)
    fast = (speed >= least_speed) & (course_sd <= largest_sd)
    if not fast[-2:].all():
        k = len(fast) - 2 + int(np.flatnonzero(~fast[-2:])[-1])
        raise DataError(
            "alignment.vehicle-too-slow-for-course",
            file=source,
            row=int(rows[k]) + 1,
            quantity="VN, VE",
            speed=speed[k],
            time=time[k],
            sd=sd[k, :2].max(),
            course_sd_deg=np.degrees(min(course_sd[k], np.pi)),
            least_speed=least_speed,
            largest_sd_deg=np.degrees(largest_sd),
        )
    return CourseFixes(time, velocity, sd, fast, rows + 1, source)

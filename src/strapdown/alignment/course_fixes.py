"""Fixes of a drive laid on the stamps of its inertial record."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.alignment.inertial_sums import sum_inertially
from strapdown.exceptions import DataError
from strapdown.increments import motion_increments
from strapdown.tables import DV, VELOCITY, VELOCITY_SD, check_gnss
from strapdown.tables.checks import source_of

Array = NDArray[np.float64]

__all__ = ["CourseFixes", "course_fixes"]


@dataclass(frozen=True, eq=False)
class CourseFixes:
    """Fixes fast enough to have a course, at the inertial samples next to them.

    Attributes
    ----------
    time : ndarray, (k,), s
        Of the samples.
    velocity : ndarray, (k, 3), m/s
        North, east, down, between the fixes along lines.
    velocity_sd : ndarray, (k,), m/s
        Horizontal, of the worse axis.
    course, course_sd : ndarray, (k,), rad
    turned : ndarray, (k, 4)
        From the body's axes into those at the first sample, held still in inertial space.
    turned_end : ndarray, (4,)
        At the last sample.
    gained : ndarray, (k, 3), m/s
        Integral of the specific force, in the axes at the first sample.
    source : str, optional
        Of the fixes.
    """

    time: Array
    velocity: Array
    velocity_sd: Array
    course: Array
    course_sd: Array
    turned: Array
    turned_end: Array
    gained: Array
    source: str | None


def course_fixes(
    imu: pd.DataFrame, gnss: pd.DataFrame | None, least_speed: float, largest_sd: float
) -> CourseFixes:
    """Take the fixes of a record that have a course.

    Parameters
    ----------
    imu : DataFrame
    gnss : DataFrame, optional
    least_speed : float, m/s
    largest_sd : float, rad

    Returns
    -------
    CourseFixes
        The longest run of fixes at speed that ends with the record.

    Raises
    ------
    DataError
        There is no Gnss table, fewer than two fixes with a velocity during the record, or the
        last of them are too slow.
    """
    if gnss is None:
        raise DataError(
            "there are no fixes, and a course comes from nothing else",
            file=source_of(imu),
            quantity="gnss",
            remedy="give the Gnss table of the drive, or align at rest",
        )
    check_gnss(gnss)
    source = source_of(gnss)
    stamps = imu.index.to_numpy(dtype=np.float64)
    time = gnss.index.to_numpy(dtype=np.float64)
    velocity = gnss[VELOCITY].to_numpy(dtype=np.float64)
    sd = gnss[VELOCITY_SD].to_numpy(dtype=np.float64)[:, :2].max(axis=1)
    good = (time >= stamps[0]) & (time <= stamps[-1]) & (gnss["quality"].to_numpy() > 0.0)
    timely = int(good.sum())
    good &= np.isfinite(sd)
    if good.sum() < 2:
        raise DataError(
            f"fixes between {stamps[0]:.6g} and {stamps[-1]:.6g} s of the inertial "
            f"record: {timely}, and with a velocity that has a standard deviation: "
            f"{int(good.sum())}; two are needed",
            file=source,
            quantity="VN, VE",
            remedy="check that both clocks are the same, align over a stretch with fixes, and "
            "use a receiver that measures velocity",
        )
    rows = np.flatnonzero(good)
    time, velocity, sd = time[rows], velocity[rows], sd[rows]
    speed = np.hypot(velocity[:, 0], velocity[:, 1])
    course_sd = sd / np.maximum(speed, 1e-9)
    slow = (speed < least_speed) | (course_sd > largest_sd)
    if slow[-1] or (len(slow) > 1 and slow[-2]):
        k = len(slow) - 1 if slow[-1] else len(slow) - 2
        raise DataError(
            f"the vehicle moves at {speed[k]:.3g} m/s at {time[k]:.6g} s (standard deviation "
            f"{sd[k]:.2g}): its course is known to {np.degrees(min(course_sd[k], np.pi)):.3g} "
            f"deg; at least {least_speed:g} m/s and {np.degrees(largest_sd):.3g} deg are needed",
            file=source,
            row=int(rows[k]) + 1,
            quantity="VN, VE",
            remedy="align over a stretch that ends while it drives, or at rest by another method",
        )
    keep = int(np.flatnonzero(slow)[-1]) + 1 if slow.any() else 0
    # The sample at or after a fix, and before the last fix: velocities lie between two fixes.
    at = np.minimum(
        np.searchsorted(stamps, time[keep:]),
        np.searchsorted(stamps, time[-1], side="right") - 1,
    )
    at, kept = np.unique(at, return_index=True)
    if len(at) < 2:
        raise DataError(
            f"{len(at)} inertial samples lie between the fixes",
            file=source_of(imu),
            quantity="time",
            remedy="use an inertial record that is faster than the fixes",
        )
    there = np.column_stack([np.interp(stamps[at], time, v) for v in velocity.T])
    sums = sum_inertially(imu)
    dv = np.ascontiguousarray(motion_increments(imu)[DV].to_numpy(dtype=np.float64))
    gained = np.vstack([np.zeros((1, 3)), np.cumsum(rotation.rotate(sums.turned[:-1], dv), 0)])
    return CourseFixes(
        stamps[at],
        there,
        sd[keep:][kept],
        np.arctan2(there[:, 1], there[:, 0]),
        course_sd[keep:][kept],
        sums.turned[at],
        sums.turned[-1],
        gained[at],
        source,
    )

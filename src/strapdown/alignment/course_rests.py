"""What the gyros read while the fixes of a drive say that the vehicle stood."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.alignment.course_fixes import CourseFixes
from strapdown.results.rests import RestStretch
from strapdown.sensors.imu_uncertainty import ImuUncertainty
from strapdown.sensors.rest import rest_between
from strapdown.sensors.shaking_rest import find_rests_of_every_grade

Array = NDArray[np.float64]

__all__ = ["RestRate", "rest_rates"]

#: A velocity within so many standard deviations is none, nor one below what no one drives at.
CLEAR, CREEP = 4.0, 0.1
#: A shorter rest, s, tells less than the fixes of the drive do.
LEAST = 1.0


@dataclass(frozen=True, eq=False)
class RestRate:
    """Mean rate of a rest.

    Attributes
    ----------
    time : float, s
        Its middle.
    rate, sd : ndarray, (3,), rad/s
        The mean, and how well it tells the bias at the end of the record: what scatters within the
        rest, and what the bias drifts since.
    """

    time: float
    rate: Array
    sd: Array


def rest_rates(
    imu: pd.DataFrame, fixes: CourseFixes, sensors: ImuUncertainty
) -> tuple[RestRate, ...]:
    """Find the rests of a record in which the receiver stood, too.

    A gyro cannot tell a parked vehicle from one on a straight road; the fixes do.

    Parameters
    ----------
    imu : DataFrame
    fixes : CourseFixes
    sensors : ImuUncertainty

    Returns
    -------
    tuple of RestRate
        Nothing where no fix lies in a rest.
    """
    speed = np.hypot(fixes.velocity[:, 0], fixes.velocity[:, 1])
    slow = speed <= np.maximum(CLEAR * fixes.sd[:, :2].max(axis=1), CREEP)
    if not slow.any():
        return ()
    # One fix that is wrong neither ends a rest nor makes one.
    near = np.clip(np.arange(len(slow))[:, None] + np.arange(-1, 2), 0, len(slow) - 1)
    slow = slow[near].sum(axis=1) >= 2
    drift, out = sensors.gyro_drift, []
    for found in find_rests_of_every_grade(imu):
        rest = _while_slow(imu, found, fixes.time, slow)
        if rest is None:
            continue
        assert rest.gyro_mean_sd is not None
        since = float(imu.index[-1]) - 0.5 * (rest.start + rest.end)
        moved = -2.0 * math.expm1(-since / drift.correlation_time) * np.square(drift.triad)
        white = np.square(sensors.gyro.axis("noise_density")) / (rest.end - rest.start)
        sd = np.sqrt(np.maximum(np.square(rest.gyro_mean_sd), white) + moved)
        middle = 0.5 * (rest.start + rest.end)
        out.append(RestRate(middle, np.array(rest.gyro_mean), sd))
    return tuple(out)


def _while_slow(
    imu: pd.DataFrame, rest: RestStretch, time: Array, slow: NDArray[np.bool_]
) -> RestStretch | None:
    """The longest part of a rest between fixes that stand: gyros rest on a straight road, too."""
    inside = np.flatnonzero((time >= rest.start) & (time <= rest.end))
    runs = np.split(inside, np.flatnonzero(np.diff(slow[inside].astype(np.int64))) + 1)
    runs = [run for run in runs if len(run) > 1 and slow[run[0]]]
    if not runs:
        return None
    run = max(runs, key=lambda one: float(time[one[-1]] - time[one[0]]))
    start = rest.start if run[0] == inside[0] else float(time[run[0]])
    end = rest.end if run[-1] == inside[-1] else float(time[run[-1]])
    return rest_between(imu, start, end) if end - start >= LEAST else None

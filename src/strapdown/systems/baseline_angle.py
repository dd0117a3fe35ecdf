"""Angle of a baseline of two antennas in the vehicle, by its heading against the course."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pandas as pd

from strapdown.rotation import within_half_turn
from strapdown.tables import VELOCITY, VELOCITY_SD
from strapdown.tables.checks import Array, index_of, values_of

#: A course is used from this speed on, m/s, while it turns slower than this, deg/s, and between
#: fixes that are no farther apart than this, s.
FAST, STRAIGHT, APART = 3.0, 5.0, 2.5
#: Least time of such driving, s.
LEAST = 30.0
#: Headings that agree with the median within so many deg, and their least share: a vehicle that
#: also reverses, or a receiver with wrong ambiguities, has others.
NEAR, SHARE = 10.0, 0.9
#: Time over which deviations from the course last, s: of crosswind, camber and multipath.
LASTS = 10.0
#: Largest standard deviation of an angle that is proposed, deg.
LARGEST = 2.0


@dataclass(frozen=True)
class BaselineAngle:
    """Direction of a baseline in the vehicle, as the course shows it.

    Attributes
    ----------
    angle_deg, sd_deg : float, deg
        From forward to the right, -180 to 180, and its standard deviation.
    scatter_deg : float, deg
        Of single headings about the course.
    duration : float, s
        Of driving straight that shows it.
    """

    angle_deg: float
    sd_deg: float
    scatter_deg: float
    duration: float


def baseline_angle(headings: pd.DataFrame, fixes: pd.DataFrame) -> BaselineAngle | None:
    """Determine the angle of a baseline by the course of the fixes.

    Parameters
    ----------
    headings : DataFrame
        Heading table, on the clock of the fixes.
    fixes : DataFrame
        Gnss table.

    Returns
    -------
    BaselineAngle or None
        None where the vehicle does not drive straight for half a minute, or headings and course do
        not agree on one angle.
    """
    known = np.isfinite(values_of(fixes, VELOCITY_SD[:2])).all(axis=1)
    own = index_of(fixes)[known]
    time, heading = index_of(headings), values_of(headings, ["heading"])[:, 0]
    if own.size < 3 or not time.size:
        return None
    north, east = values_of(fixes, VELOCITY[:2])[known].T
    course = np.unwrap(np.degrees(np.arctan2(east, north)), period=360.0)
    after = np.clip(np.searchsorted(own, time), 1, own.size - 1)
    step = own[after] - own[after - 1]
    usable = (time >= own[0]) & (time <= own[-1]) & (step <= APART)
    usable &= np.interp(time, own, np.hypot(north, east)) > FAST
    usable &= np.abs(np.diff(course)[after - 1]) < STRAIGHT * step
    off: Array = np.asarray(within_half_turn(heading - np.interp(time, own, course)))[usable]
    if not off.size:
        return None
    # Each heading stands for the time until the next, but not for a gap.
    duration = float(np.minimum(np.diff(time, append=time[-1]), APART)[usable].sum())
    angle = math.degrees(math.atan2(np.sin(np.radians(off)).mean(), np.cos(np.radians(off)).mean()))
    for _ in range(3):
        rest = np.asarray(within_half_turn(off - angle))
        angle += float(np.median(rest))
    rest = np.asarray(within_half_turn(off - angle))
    near = np.abs(rest) < NEAR
    if duration < LEAST or near.mean() < SHARE:
        return None
    angle += float(rest[near].mean())
    scatter = float(rest[near].std())
    sd = scatter / math.sqrt(max(duration / LASTS, 1.0))
    if sd > LARGEST:
        return None
    angle = float(within_half_turn(np.array(angle)))
    return BaselineAngle(angle, sd, scatter, duration)

"""What 49 CFR Part 563 has a recorder say of an event's change of velocity."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pandas as pd

from strapdown.crash.acceleration import Acceleration
from strapdown.crash.crash_event import CrashEvent
from strapdown.crash.delta_v import cumulative_delta_v
from strapdown.crash.velocity_course import VelocityCourse
from strapdown.crash.window_weights import check_within

__all__ = ["MaximumDeltaV", "maximum_delta_v", "recorder_delta_v"]

#: 563.7, Table I: delta-V every 10 ms, for 250 ms or to 30 ms after the end of the event, whichever
#: is shorter; its maximum is looked for over 300 ms or the same (563.8, Table III).
RECORDED, SEARCHED, BEYOND_END, EVERY = 0.250, 0.300, 0.030, 0.010


@dataclass(frozen=True)
class MaximumDeltaV:
    """Largest cumulative changes of velocity of an event (49 CFR 563.5(b)).

    Attributes
    ----------
    longitudinal, lateral : float, m/s
        Signed.
    resultant : float, m/s
        Largest of the vector sum of the two at one instant.
    longitudinal_time, lateral_time, resultant_time : float, s
        From time zero.
    searched : float, s
        How far from time zero was looked.
    """

    longitudinal: float
    lateral: float
    resultant: float
    longitudinal_time: float
    lateral_time: float
    resultant_time: float
    searched: float


def recorder_delta_v(acceleration: Acceleration, event: CrashEvent) -> pd.DataFrame:
    """Cumulative change of velocity as a recorder keeps it.

    Parameters
    ----------
    acceleration : Acceleration
        In the frame ``body`` or ``impact``.
    event : CrashEvent

    Returns
    -------
    DataFrame
        As `cumulative_delta_v`, every 10 ms from time zero: for 250 ms, to 30 ms after the end of
        the event, or to the end of the record, whichever is least. Unrounded, where a recorder
        rounds to 1 km/h.

    Raises
    ------
    DataError
        Time zero is not within the record.
    """
    zero = event.time_zero
    stop = min(zero + RECORDED, event.end + BEYOND_END, acceleration.end)
    return cumulative_delta_v(acceleration, zero, stop, every=EVERY)


def maximum_delta_v(acceleration: Acceleration, event: CrashEvent) -> MaximumDeltaV:
    """Largest cumulative change of velocity since time zero, and the time to it.

    Parameters
    ----------
    acceleration : Acceleration
        In the frame ``body`` or ``impact``.
    event : CrashEvent

    Returns
    -------
    MaximumDeltaV
        Looked for over 300 ms, to 30 ms after the end of the event, or to the end of the
        record, whichever is least (49 CFR 563.5(b), 563.8 Table III).

    Raises
    ------
    DataError
        Time zero is not within the record.
    """
    zero = event.time_zero
    check_within(acceleration.time, zero, zero, acceleration.source)
    stop = min(zero + SEARCHED, event.end + BEYOND_END, acceleration.end)
    course = VelocityCourse(acceleration)
    at = np.array([course.largest_since(zero, stop, axes) for axes in ((0,), (1,), (0, 1))])
    change = course.velocity(at) - course.velocity(np.array([zero]))
    return MaximumDeltaV(
        float(change[0, 0]),
        float(change[1, 1]),
        math.hypot(float(change[2, 0]), float(change[2, 1])),
        float(at[0]) - zero,
        float(at[1]) - zero,
        float(at[2]) - zero,
        stop - zero,
    )

"""The steps of a record, as they are or joined to tenths of a second."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown._kernels.motion_blocks import join_blocks
from strapdown.systems.sins.intake import Intake
from strapdown.tables import ACCEL, GYRO
from strapdown.tables.checks import index_of, values_of

__all__ = ["NEAR", "JoinedSteps", "joined_steps", "steps_of"]

Array = NDArray[np.float64]

#: Increments are joined to so much, s.
JOINED = 0.1
#: Of the record that is taken at a time, s.
AT_ONCE = 60.0
#: Stamps are the same within this, s.
NEAR = 1e-6


@dataclass(frozen=True, eq=False)
class JoinedSteps:
    """Motion increments of some steps.

    Attributes
    ----------
    time : ndarray, (n,), s
        Ends of the steps.
    rows : ndarray, (n, 10)
        Motion increments.
    """

    time: Array
    rows: Array


def steps_of(intake: Intake, imu: pd.DataFrame, begin: float, end: float) -> Iterator[JoinedSteps]:
    """Give motion increments within a span as they are, a minute at a time."""
    time, values = index_of(imu), values_of(imu, [*GYRO, *ACCEL])
    state = intake.begin(imu.attrs["sampling"], None)
    cuts = np.searchsorted(
        time, [*np.arange(time[0] + AT_ONCE, time[-1], AT_ONCE), np.inf]
    ).tolist()
    at = 0
    for cut in cuts:
        state, steps = intake.advance(state, time[at:cut], values[at:cut], cut == len(time))
        at = cut
        used = (steps.time > begin + NEAR) & (steps.time <= end + NEAR)
        if used.any():
            yield JoinedSteps(steps.time[used], np.ascontiguousarray(steps.rows[used]))


def joined_steps(intake: Intake, imu: pd.DataFrame, begin: float, end: float) -> JoinedSteps:
    """Return motion increments within a span, joined to a tenth of a second.

    Parameters
    ----------
    intake : Intake
    imu : DataFrame
        Imu table.
    begin, end : float, s

    Returns
    -------
    JoinedSteps
    """
    ends, joined = [np.empty(0)], [np.empty((0, 10))]
    for steps in steps_of(intake, imu, begin, end):
        dt = np.ascontiguousarray(steps.rows[:, 0])
        last, out = np.empty(len(dt), dtype=np.int64), np.empty_like(steps.rows)
        samples = max(1, round(JOINED / float(np.median(dt))))
        count = int(join_blocks(dt, samples, steps.rows, last, out))
        ends.append(steps.time[last[:count]])
        joined.append(out[:count].copy())
    return JoinedSteps(np.concatenate(ends), np.concatenate(joined))

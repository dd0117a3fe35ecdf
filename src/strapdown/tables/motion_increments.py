"""MotionIncrements tables: how a body turned and moved over each step, ready for navigation."""

from __future__ import annotations

import pandas as pd
from numpy.typing import ArrayLike

from strapdown.tables.checks import check_steps, checked_values, joined, source_of
from strapdown.tables.columns import DR, DV, PHI

MOTION = ["dt", *PHI, *DV, *DR]


def motion_increments_table(
    time: ArrayLike,
    dt: ArrayLike,
    phi: ArrayLike,
    dv: ArrayLike,
    dr: ArrayLike,
    source: str | None = None,
) -> pd.DataFrame:
    """Make a MotionIncrements table.

    With ``C`` from the body at an instant of the step to the body at its start, relative to
    inertial space:

    Parameters
    ----------
    time : array_like, (n,), s
        End of each step.
    dt : array_like, (n,), s
        Length of each step.
    phi : array_like, (n, 3), rad
        Rotation vector of ``C`` at the end of the step: the turn with its coning.
    dv : array_like, (n, 3), m/s
        ``int C f dt`` over the step, in the body axes of its start: the velocity that specific
        force gave, with rotation and sculling.
    dr : array_like, (n, 3), m
        ``int int C f dt dt`` over the step, in the same axes: the distance that it gave, with
        scrolling.
    source : str, optional
        Name for messages.

    Returns
    -------
    DataFrame

    Raises
    ------
    DataError
        As `check_motion_increments`.
    """
    table = joined(time, MOTION, source, dt=(dt, None), phi=(phi, 3), dv=(dv, 3), dr=(dr, 3))
    check_motion_increments(table)
    return table


def check_motion_increments(table: pd.DataFrame) -> None:
    """Check a MotionIncrements table.

    Parameters
    ----------
    table : DataFrame

    Raises
    ------
    DataError
        A column is missing, a value is not finite, time does not advance, a step is not
        positive, or a step begins before the one before it has ended.
    """
    checked_values(table, MOTION)
    check_steps(table, source_of(table))

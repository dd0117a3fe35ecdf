"""Increments tables: the rate alone, step by step, before any algorithm."""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from strapdown.tables.checks import check_steps, checked_values, joined, source_of
from strapdown.tables.columns import DTHETA, THETA

INCREMENTS = ["dt", *THETA, *DTHETA]


def increments_table(
    time: ArrayLike, dt: ArrayLike, theta: ArrayLike, dtheta: ArrayLike | None = None
) -> pd.DataFrame:
    """Make an Increments table.

    Parameters
    ----------
    time : array_like, (n,), s
        End of each step.
    dt : array_like, (n,), s
        Length of each step.
    theta : array_like, (n, 3), rad
        Integral of the body rate over the step.
    dtheta : array_like, (n, 3), rad, optional
        Change of the body rate over the step times `dt`; zero, where it is not known.

    Returns
    -------
    DataFrame

    Raises
    ------
    DataError
        Shapes disagree, a value is not finite, or a step has no positive length.
    """
    change = np.zeros_like(theta, dtype=np.float64) if dtheta is None else dtheta
    table = joined(time, INCREMENTS, None, dt=(dt, None), theta=(theta, 3), dtheta=(change, 3))
    check_increments(table)
    return table


def check_increments(table: pd.DataFrame) -> None:
    """Check an Increments table.

    Parameters
    ----------
    table : DataFrame

    Raises
    ------
    DataError
        A column is missing, a value is not finite, time does not advance, a step is not
        positive, or a step begins before the one before it has ended.
    """
    checked_values(table, INCREMENTS)
    check_steps(table, source_of(table))

"""Tables of a trajectory's error, or of its standard deviation."""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from strapdown.errors import DataError
from strapdown.tables.checks import checked_values, joined, values_of
from strapdown.tables.columns import EULER, NED, VELOCITY

TRAJECTORY_ERROR = [*NED, *VELOCITY, *EULER]


def trajectory_error_table(
    time: ArrayLike,
    place: ArrayLike,
    velocity: ArrayLike,
    euler: ArrayLike,
    source: str | None = None,
) -> pd.DataFrame:
    """Make a TrajectoryError table: errors, or standard deviations.

    Parameters
    ----------
    time : array_like, (n,), s
    place : array_like, (n, 3), m
        North, east, down.
    velocity : array_like, (n, 3), m/s
        North, east, down.
    euler : array_like, (n, 3), deg
        Of roll, pitch, heading.
    source : str, optional
        Name for messages.

    Returns
    -------
    DataFrame
        An error is estimate minus truth.

    Raises
    ------
    DataError
        Shapes disagree, a value is not finite, or time does not advance.
    """
    blocks = {"place": (place, 3), "velocity": (velocity, 3), "euler": (euler, 3)}
    table = joined(time, TRAJECTORY_ERROR, source, **blocks)
    check_trajectory_error(table)
    return table


def check_trajectory_error(table: pd.DataFrame) -> None:
    """Check a TrajectoryError table that holds errors.

    Parameters
    ----------
    table : DataFrame
        Further columns are let be.

    Raises
    ------
    DataError
        A column is missing, a value is not finite, or time does not advance.
    """
    checked_values(table, TRAJECTORY_ERROR)


def check_trajectory_sd(table: pd.DataFrame) -> None:
    """Check a TrajectoryError table that holds standard deviations.

    Parameters
    ----------
    table : DataFrame
        Further columns are let be.

    Raises
    ------
    DataError
        As `check_trajectory_error`, or a value is negative.
    """
    check_trajectory_error(table)
    values = values_of(table, TRAJECTORY_ERROR)
    negative = values < 0.0
    if negative.any():
        row, column = (int(i) for i in np.argwhere(negative)[0])
        raise DataError(
            "tables.standard-deviation-negative",
            file=table.attrs.get("source"),
            row=row + 1,
            quantity=TRAJECTORY_ERROR[column],
            values=values[row, column],
        )

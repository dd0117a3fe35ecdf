"""Trajectory tables: position, velocity and attitude."""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from strapdown.rotation import within_half_turn
from strapdown.tables.checks import (
    EULER,
    GEODETIC,
    NED,
    VELOCITY,
    check_latitude,
    checked_values,
    joined,
    source_of,
)

Array = NDArray[np.float64]

TRAJECTORY = [*GEODETIC, *VELOCITY, *EULER]


def trajectory_table(
    time: ArrayLike,
    place: ArrayLike,
    velocity: ArrayLike,
    euler: ArrayLike,
    source: str | None = None,
) -> pd.DataFrame:
    """Make a Trajectory table.

    Parameters
    ----------
    time : array_like, (n,), s
    place : array_like, (n, 3)
        Geodetic latitude and longitude in deg, height over the ellipsoid in m.
    velocity : array_like, (n, 3), m/s
        Relative to the Earth: north, east, down.
    euler : array_like, (n, 3), deg
        Roll, pitch, heading; body forward-right-down to north-east-down.
    source : str, optional
        Name for messages.

    Returns
    -------
    DataFrame

    Raises
    ------
    DataError
        Shapes disagree, or as `check_trajectory`.
    """
    blocks = {"place": (place, 3), "velocity": (velocity, 3), "euler": (euler, 3)}
    table = joined(time, TRAJECTORY, source, **blocks)
    check_trajectory(table)
    return table


def places_of(trajectory: pd.DataFrame) -> Array:
    """Return latitude and longitude in deg and height in m, longitudes within a turn.

    Parameters
    ----------
    trajectory : DataFrame
        A Trajectory table. Its longitude may be unwrapped where a vehicle circles the Earth.

    Returns
    -------
    ndarray, (n, 3)
        Longitudes beyond a full turn are wrapped to within half a turn; others keep their
        digits.
    """
    place = trajectory[GEODETIC].to_numpy(dtype=np.float64, copy=True)
    over = np.abs(place[:, 1]) > 360.0
    place[over, 1] = within_half_turn(place[over, 1])
    return place


def check_trajectory(table: pd.DataFrame) -> None:
    """Check a Trajectory table.

    DataError: a column is missing, a value is not finite, time does not advance, or a latitude is
    beyond 90 deg.
    """
    lat, lon = checked_values(table, TRAJECTORY)[:, :2].T
    check_latitude(lat, lon, source_of(table))


# Tables of trajectory errors, or of their standard deviations.


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
        Roll, pitch, heading.
    source : str, optional
        Name for messages.

    Returns
    -------
    DataFrame
        Errors are estimate minus truth.

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

    `table`: further columns are ignored. DataError: a column is missing, a value is not finite, or
    time does not advance.
    """
    checked_values(table, TRAJECTORY_ERROR)

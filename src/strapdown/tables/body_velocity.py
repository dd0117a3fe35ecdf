"""BodyVelocity tables: a velocity measured along the axes of an instrument, as by Doppler."""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from strapdown.errors import DataError
from strapdown.tables.checks import checked_values, each_row, joined, source_of

BODY_VELOCITY = ["vx", "vy", "vz", "vx_sd", "vy_sd", "vz_sd"]

# What measures its velocity by Doppler or a camera is slower, m/s.
FASTEST = 400.0


def body_velocity_table(
    time: ArrayLike, velocity: ArrayLike, velocity_sd: ArrayLike, source: str | None = None
) -> pd.DataFrame:
    """Make a BodyVelocity table.

    Parameters
    ----------
    time : array_like, (n,), s
        On the clock of the inertial sensors.
    velocity : array_like, (n, 3), m/s
        Relative to the Earth, along the instrument's forward, right, down.
    velocity_sd : array_like, (n, 3) or (3,), m/s
        Infinite where an axis was not measured.
    source : str, optional
        Name for messages.

    Returns
    -------
    DataFrame

    Raises
    ------
    DataError
        Shapes disagree, or as `check_body_velocity`.
    """
    blocks = {"velocity": (velocity, 3), "velocity_sd": (each_row(velocity_sd, time, 3), 3)}
    table = joined(time, BODY_VELOCITY, source, **blocks)
    check_body_velocity(table)
    return table


def check_body_velocity(table: pd.DataFrame) -> None:
    """Check a BodyVelocity table.

    Parameters
    ----------
    table : DataFrame

    Raises
    ------
    DataError
        A column is missing, a value is not finite, time does not advance, a standard deviation is
        not above zero, or a velocity is beyond 400 m/s.
    """
    velocity = checked_values(table, BODY_VELOCITY[:3], BODY_VELOCITY[3:])
    beyond = np.argwhere(np.abs(velocity) > FASTEST)
    if len(beyond):
        row, column = (int(i) for i in beyond[0])
        raise DataError(
            "tables.faster-than-such-instrument-measures",
            file=source_of(table),
            row=row + 1,
            quantity=BODY_VELOCITY[column],
            velocity=velocity[row, column],
        )

"""Odometer tables: how fast a wheel rolls."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from strapdown.errors import ConfigError, DataError
from strapdown.tables.checks import (
    as_array,
    check_rows,
    check_same_length,
    check_time,
    checked_values,
    each_row,
    is_number,
    joined,
    source_of,
)

ODOMETER = ["speed", "speed_sd"]

# No wheel of a road vehicle or train rolls faster, m/s: what does is in km/h.
FASTEST = 100.0


def odometer_table(
    time: ArrayLike, speed: ArrayLike, speed_sd: ArrayLike, source: str | None = None
) -> pd.DataFrame:
    """Make an Odometer table.

    Parameters
    ----------
    time : array_like, (n,), s
        On the clock of the inertial sensors.
    speed : array_like, (n,), m/s
        Along the wheel, forward positive.
    speed_sd : array_like, (n,) or float, m/s
        Of the noise of each, without the scale factor; infinite where nothing was measured.
    source : str, optional
        Name for messages.

    Returns
    -------
    DataFrame

    Raises
    ------
    DataError
        Shapes disagree, or as `check_odometer`.
    """
    blocks = {"speed": (speed, None), "speed_sd": (each_row(speed_sd, time), None)}
    table = joined(time, ODOMETER, source, **blocks)
    check_odometer(table)
    return table


def odometer_from_distance(
    time: ArrayLike, distance: ArrayLike, quantum: float, source: str | None = None
) -> pd.DataFrame:
    """Make an Odometer table of a counter.

    Between two rows the wheel has rolled at a mean speed, which is that of the middle of the step
    but for ``dt² / 24`` times the derivative of its acceleration. Two counts are each wrong by up
    to half a `quantum`, evenly: the speed by ``quantum / (√6 dt)``; what one step has too much, the
    next has not, so that to take them for independent is to believe them too little.

    Parameters
    ----------
    time : array_like, (n,), s
    distance : array_like, (n,), m
        Since any instant; backwards it falls.
    quantum : float, m
        Of one count: circumference over pulses a turn.
    source : str, optional
        Name for messages.

    Returns
    -------
    DataFrame
        Of the n - 1 middles.

    Raises
    ------
    ConfigError
        The quantum is no length.
    DataError
        Shapes disagree; time does not advance; a counter was set back, or overflowed; or as
        `check_odometer`.
    """
    if not is_number(quantum) or not 0.0 < quantum < math.inf:
        raise ConfigError("tables.no-length-count", quantity="quantum", quantum=quantum)
    stamps, way = as_array(time, None, "time", source), as_array(distance, None, "distance", source)
    check_same_length(source, time=stamps, distance=way)
    check_time(stamps, source)
    check_rows(way[:, None], ["distance"], source)
    dt = np.diff(stamps)
    speed = np.diff(way) / dt
    wild = np.flatnonzero(np.abs(speed) > FASTEST)
    if wild.size == 1 and len(speed) > 1:
        row = int(wild[0]) + 1
        raise DataError(
            "tables.counter-set-back-or-overflowed",
            file=source,
            row=row + 1,
            quantity="distance",
            way=way[row - 1],
            way_2=way[row],
            dt=dt[row - 1],
        )
    sd = quantum / (math.sqrt(6.0) * dt)
    return odometer_table(0.5 * (stamps[1:] + stamps[:-1]), speed, sd, source)


def check_odometer(table: pd.DataFrame) -> None:
    """Check an Odometer table.

    Parameters
    ----------
    table : DataFrame

    Raises
    ------
    DataError
        A column is missing, a value is not finite, time does not advance, a standard deviation is
        not above zero, or a speed is beyond 100 m/s.
    """
    speed = checked_values(table, ["speed"], ["speed_sd"])[:, 0]
    beyond = np.flatnonzero(np.abs(speed) > FASTEST)
    if beyond.size:
        row = int(beyond[0])
        raise DataError(
            "tables.faster-than-wheel-rolls"
            if np.abs(speed).max() < 3.6 * FASTEST
            else "tables.faster-than-wheel-rolls-2",
            file=source_of(table),
            row=row + 1,
            quantity="speed",
            speed=speed[row],
        )

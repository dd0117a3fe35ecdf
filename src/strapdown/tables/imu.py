"""Imu tables: rates and specific force."""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from strapdown.errors import DataError
from strapdown.tables.checks import (
    as_array,
    check_columns,
    check_rows,
    check_same_length,
    check_time,
    index_of,
    source_of,
    values_of,
)
from strapdown.tables.columns import ACCEL, GYRO, MAG

SAMPLINGS = ("instantaneous", "mean")


def imu_table(
    time: ArrayLike,
    gyro: ArrayLike,
    accel: ArrayLike | None = None,
    mag: ArrayLike | None = None,
    *,
    sampling: str = "instantaneous",
    source: str | None = None,
) -> pd.DataFrame:
    """Make an Imu table.

    Parameters
    ----------
    time : array_like, (n,), s
        Increasing stamps, any origin, any spacing.
    gyro : array_like, (n, 3), rad/s
        Rate of the body relative to inertial space, in body axes (forward, right, down).
    accel : array_like, (n, 3), m/s², optional
        Specific force in body axes: about (0, 0, -9.8) at rest and level.
    mag : array_like, (n, 3), µT, optional
        Magnetic field in body axes.
    sampling : {'instantaneous', 'mean'}
        Whether a row holds the value at its stamp or the mean over the interval ending there.
    source : str, optional
        Name for messages.

    Returns
    -------
    DataFrame
        Indexed by ``time``.

    Raises
    ------
    DataError
        Shapes disagree, a value is not finite, time does not advance, or `sampling` is
        unknown.
    """
    stamps = as_array(time, None, "time", source)
    columns, values = list(GYRO), as_array(gyro, 3, "gyro", source)
    check_same_length(source, time=stamps, gyro=values)
    if accel is not None:
        force = as_array(accel, 3, "accel", source)
        check_same_length(source, time=stamps, accel=force)
        columns, values = columns + ACCEL, np.hstack([values, force])
    if mag is not None:
        field = as_array(mag, 3, "mag", source)
        check_same_length(source, time=stamps, mag=field)
        columns, values = columns + MAG, np.hstack([values, field])
    table = pd.DataFrame(
        values,
        index=pd.Index(stamps, name="time"),
        columns=columns,
        # What was put together here belongs to nobody else.
        copy=accel is None and mag is None,
    )
    table.attrs = {"sampling": sampling, "source": source, "axes": "forward-right-down"}
    check_imu(table)
    return table


def check_imu(table: pd.DataFrame) -> None:
    """Check an Imu table.

    Parameters
    ----------
    table : DataFrame

    Raises
    ------
    DataError
        A column is missing, a value is not finite, time does not advance, there are fewer
        than two samples, or ``attrs["sampling"]`` does not say how the rows were sampled.
    """
    source = source_of(table)
    check_columns(table, GYRO, source)
    if table.attrs.get("sampling") not in SAMPLINGS:
        raise DataError(
            "tables.attrs-sampling",
            file=source,
            quantity="sampling",
            get=table.attrs.get("sampling"),
        )
    columns = list(GYRO)
    for triad in (ACCEL, MAG):
        there = [c for c in triad if c in table.columns]
        if there:
            check_columns(table, triad, source)
        columns += there
    if len(table) < 2:
        raise DataError(
            "tables.sample-attitude-integral-rate-needs",
            file=source,
            quantity="time",
            count=len(table),
        )
    check_time(index_of(table), source)
    check_rows(values_of(table, columns), columns, source)

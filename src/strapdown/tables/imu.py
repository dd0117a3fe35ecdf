"""Imu tables and integrated increments: angular rate and specific force."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from strapdown.errors import DataError, check_choice
from strapdown.tables.checks import (
    ACCEL,
    DR,
    DTHETA,
    DV,
    GYRO,
    MAG,
    PHI,
    THETA,
    Array,
    as_array,
    check_columns,
    check_rows,
    check_same_length,
    check_steps,
    check_time,
    checked_values,
    index_of,
    joined,
    source_of,
    view_of,
)
from strapdown.tables.on_disk import let_go, parts_of, room

SAMPLINGS = ("instantaneous", "mean")


def check_sampling_kind(sampling: str) -> None:
    """Raise ConfigError unless it is one of `SAMPLINGS`."""
    check_choice("tables.no-kind-sampling", SAMPLINGS, quantity="sampling", sampling=sampling)


def imu_table(
    time: ArrayLike,
    gyro: ArrayLike,
    accel: ArrayLike | None = None,
    mag: ArrayLike | None = None,
    *,
    sampling: str = "instantaneous",
    source: str | None = None,
    by_column: bool = False,
) -> pd.DataFrame:
    """Make an Imu table.

    Parameters
    ----------
    time : array_like, (n,), s
        Increasing stamps, any origin, any spacing.
    gyro : array_like, (n, 3), rad/s
        Rate of the body relative to inertial space, in body axes (forward, right, down).
    accel : array_like, (n, 3), m/s², optional
        Specific force in body axes: about (0, 0, -9.8) when stationary and level.
    mag : array_like, (n, 3), µT, optional
        Magnetic field in body axes.
    sampling : {'instantaneous', 'mean'}
        Whether a row holds the value at its stamp or the mean over the interval ending there.
    source : str, optional
        Name for messages.
    by_column : bool
        Whether a column is contiguous in memory, as of a table that is read: the last bit of a sum
        over a column depends on it.

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
    given = {"accel": accel, "mag": mag}
    blocks = {"gyro": as_array(gyro, 3, "gyro", source)}
    blocks |= {name: as_array(x, 3, name, source) for name, x in given.items() if x is not None}
    check_same_length(source, time=stamps, **blocks)
    if by_column:
        values = room((3 * len(blocks), len(stamps))).T
        for k, block in enumerate(blocks.values()):
            for part in parts_of(len(stamps), 3):
                values[part, 3 * k : 3 * k + 3] = block[part]
                let_go(values)
    else:
        values = np.concatenate(list(blocks.values()), axis=1)
    columns = [f"{name}_{axis}" for name in blocks for axis in "xyz"]
    # An array of the caller can change.
    return imu_of_columns(np.array(stamps), values, columns, sampling=sampling, source=source)


def imu_of_columns(
    time: Array,
    values: Array,
    columns: Sequence[str],
    *,
    sampling: str = "instantaneous",
    source: str | None = None,
    sparse: bool = False,
) -> pd.DataFrame:
    """Make an Imu table of arrays, which it keeps without a copy; otherwise as `imu_table`.

    `time` ((n,), s). `values` ((n, m)): by `columns`, of `GYRO`, `ACCEL`, `MAG`. `sparse`: whether
    samples of the magnetometer may be missing, NaN.
    """
    index = pd.Index(time, name="time", copy=False)
    table: pd.DataFrame = pd.DataFrame(values, index=index, columns=list(columns), copy=False)
    table.attrs = {"sampling": sampling, "source": source, "axes": "forward-right-down"}
    if sparse:
        table.attrs["sparse"] = True
    check_imu(table)
    return table


def check_table_sampling(table: pd.DataFrame, source: str | None) -> None:
    """Raise DataError unless ``attrs["sampling"]`` is one of `SAMPLINGS`."""
    sampling = table.attrs.get("sampling")
    if sampling not in SAMPLINGS:
        raise DataError(
            "tables.attrs-sampling", file=source, quantity="sampling", sampling=sampling
        )


def check_imu(table: pd.DataFrame) -> None:
    """Check an Imu table.

    DataError: a column is missing, a value is not finite, time does not advance, there are fewer
    than two samples, or ``attrs["sampling"]`` is unknown.
    """
    source = source_of(table)
    check_columns(table, GYRO, source)
    check_table_sampling(table, source)
    columns = list(GYRO)
    for triad in (ACCEL, MAG):
        there = [c for c in triad if c in table.columns]
        if there:
            check_columns(table, triad, source)
        # Of a live session, in which a magnetometer may begin later.
        columns += [] if triad == MAG and table.attrs.get("sparse") else there
    if len(table) < 2:
        raise DataError(
            "tables.sample-attitude-integral-rate-needs",
            file=source,
            quantity="time",
            count=len(table),
        )
    check_time(index_of(table), source)
    check_rows(view_of(table, columns), columns, source)


# Increments tables: integrated angular rate per step, before any algorithm.


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
        Change of the body rate over the step times `dt`; zero if not given.

    Raises
    ------
    DataError
        Shapes disagree, a value is not finite, time does not advance, a step is not positive, or a
        step begins before the one before it has ended.
    """
    change = np.zeros_like(theta, dtype=np.float64) if dtheta is None else dtheta
    table = joined(time, INCREMENTS, None, dt=(dt, None), theta=(theta, 3), dtheta=(change, 3))
    check_steps(index_of(table), checked_values(table, INCREMENTS)[:, 0], None)
    return table


# MotionIncrements tables: rotation and velocity increments per step, ready for navigation.


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
        Rotation vector of ``C`` at the end of the step, with coning.
    dv : array_like, (n, 3), m/s
        ``int C f dt`` over the step, in the body axes of its start: velocity increment of
        specific force, with rotation and sculling.
    dr : array_like, (n, 3), m
        ``int int C f dt dt`` over the step, in the same axes: position increment, with
        scrolling.
    source : str, optional
        Name for messages.

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

    DataError: a column is missing, a value is not finite, time does not advance, a step is not
    positive, or a step begins before the one before it has ended.
    """
    dt = checked_values(table, MOTION)[:, 0]
    check_steps(index_of(table), dt, source_of(table))

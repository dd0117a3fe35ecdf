"""Trajectories in KF-GINS format (``.nav``): eleven columns without a header.

Each line: GPS week, seconds of week; latitude, longitude in deg, height above the ellipsoid in m;
velocity north, east, down in m/s; roll, pitch, heading in deg, heading from 0 to 360.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.errors import DataError
from strapdown.formats import csv
from strapdown.formats.clocks import GPS, WEEK, Clock, clock_of, unrolled, with_clock
from strapdown.formats.decimal_rows import write_decimals
from strapdown.formats.find_columns import Column
from strapdown.formats.numbers import numbers
from strapdown.formats.table_rows import told_by_file_rows
from strapdown.formats.trajectory_options import TrajectoryFileOptions
from strapdown.tables import TRAJECTORY, check_trajectory, trajectory_table
from strapdown.tables.checks import index_of, values_of

__all__ = ["detect", "read", "write_nav"]

Array = NDArray[np.float64]
NAMES = ("week", "time", *TRAJECTORY)
SUFFIX = ".nav"
# Decimals of the columns: 10 ns; 1e-11 deg is a micrometer; 1e-8 m and m/s; 1e-9 deg.
DECIMALS = (0, 8, 11, 11, 8, 8, 8, 8, 9, 9, 9)


def detect(path: Path) -> bool:
    """Detect by the name, or by rows of eleven numbers without a header."""
    if not path.is_file():
        return False
    if path.suffix.lower() == SUFFIX:
        return True
    if path.suffix.lower() not in csv.SUFFIXES:
        return False
    with path.open("rb") as stream:
        lines = stream.read(csv.HEAD).splitlines()
    rows = [line.split() for line in lines if line.strip() and line.lstrip()[:1] not in b"#%"]
    return bool(rows) and len(rows[0]) == len(NAMES) and all(_number(f) for f in rows[0])


def _number(field: bytes) -> bool:
    try:
        float(field)
    except ValueError:
        return False
    return True


def read(path: Path) -> pd.DataFrame:
    """Read a trajectory.

    Parameters
    ----------
    path : Path

    Returns
    -------
    DataFrame
        A Trajectory table, time in seconds of the week of the first row; week 0 means that the
        week is not known.

    Raises
    ------
    DataError
        A row has another width or a value that is not a number, or as `trajectory_table`.
    """
    raw = csv.read(path)
    if len(raw.columns) != len(NAMES):
        raise DataError(
            "io.nav-column-count",
            file=raw.name,
            row=raw.row(0),
            count=len(raw.columns),
            count_2=len(NAMES),
        )
    named = zip(NAMES, raw.columns, strict=True)
    values = {
        n: np.asarray(numbers(raw, Column(c, None, ""), n), dtype=np.float64) for n, c in named
    }
    week = values["week"]
    time = values["time"] + WEEK * (week - week[0])
    if np.isfinite(time).all():
        time, _ = unrolled(time)
    with told_by_file_rows(raw.name, raw.row):
        table = trajectory_table(
            time,
            np.column_stack([values[n] for n in TRAJECTORY[:3]]),
            np.column_stack([values[n] for n in TRAJECTORY[3:6]]),
            np.column_stack([values[n] for n in TRAJECTORY[6:]]),
            source=raw.name,
        )
    known = np.isfinite(week[0]) and week[0] > 0
    with_clock(table, Clock(GPS, 0.0, int(week[0]) if known else None))
    table.attrs["findings"] = tuple(raw.findings)
    return table


def write_nav(
    path: Path,
    trajectory: pd.DataFrame,
    *,
    name: str = "trajectory",
    options: TrajectoryFileOptions | None = None,
) -> None:
    """Write a trajectory for KF-GINS and its evaluation tools.

    Parameters
    ----------
    path : Path
    trajectory : DataFrame
        A Trajectory table. Its ``attrs`` may state the GPS week (`clocks`); otherwise it is 0.
    name : str
        Not written: the format has no field for it.
    options : TrajectoryFileOptions, optional
        Not used.

    Raises
    ------
    DataError
        The table is not valid.

    Notes
    -----
    Numbers are rounded to `DECIMALS`: positions to a micrometer, times to 10 ns.
    """
    check_trajectory(trajectory)
    time = index_of(trajectory)
    clock = clock_of(trajectory)
    week, seconds = np.zeros(time.size), time
    if clock.name == GPS and clock.week is not None:
        seconds = time + clock.origin
        more = np.floor(seconds / WEEK)
        week, seconds = clock.week + more, seconds - WEEK * more
    values = values_of(trajectory, TRAJECTORY)
    columns = [week, seconds, *values[:, :8].T, np.mod(values[:, 8], 360.0)]
    write_decimals(path, columns, DECIMALS)

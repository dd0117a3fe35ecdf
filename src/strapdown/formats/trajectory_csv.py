"""Trajectories and their differences as text tables with units, and as Parquet."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.evaluation.trajectory_differences import ROTATION_ERROR
from strapdown.formats import csv, parquet
from strapdown.formats.clocks import clock_of, time_column
from strapdown.formats.file_options import FileOptions
from strapdown.tables import (
    EULER,
    NED,
    TRAJECTORY,
    TRAJECTORY_ERROR,
    VELOCITY,
    check_trajectory,
    check_trajectory_error,
)

__all__ = [
    "DECIMALS",
    "named_columns",
    "one_line",
    "told_of",
    "write_csv",
    "write_decimals",
    "write_error_csv",
    "write_parquet",
]


#: Decimals of time, latitude, longitude, height, velocity and attitude, for fixed digits.
DECIMALS = (9, 11, 11, 6, 8, 8, 8, 9, 9, 9)

_SUFFIX = {
    **dict.fromkeys([*NED, "alt"], "_m"),
    **dict.fromkeys(VELOCITY, "_m_s"),
    **dict.fromkeys([*EULER, *ROTATION_ERROR, "lat", "lon"], "_deg"),
}


def one_line(text: str) -> str:
    """Remove line breaks, which end a comment, and characters invalid in text or XML."""
    return "".join(c for c in " ".join(text.split()) if c.isprintable())


def named_columns(table: pd.DataFrame, columns: list[str]) -> dict[str, NDArray[Any]]:
    """Return time and columns of a table under names with their units, and of its clock."""
    return time_column(table) | {
        c + _SUFFIX[c]: table[c].to_numpy(dtype=np.float64) for c in columns
    }


def told_of(options: FileOptions) -> dict[str, str]:
    """Return the statements of a file on its trajectory: name, ellipsoid, axes, epoch."""
    told = {
        "trajectory": one_line(options.name),
        "ellipsoid": options.ellipsoid.name,
        "place": "geodetic, height over the ellipsoid",
        "velocity": "relative to the Earth, north east down",
        "attitude": "body forward-right-down to north-east-down",
    }
    return told if options.epoch is None else {**told, "epoch": options.date(0.0)}


def write_csv(path: Path, trajectory: pd.DataFrame, options: FileOptions | None = None) -> None:
    """Write a Trajectory table as text.

    Parameters
    ----------
    path : Path
    trajectory : DataFrame
    options : FileOptions, optional
        Ellipsoid and epoch are written to the comments at the top. Of its `digits`, ``exact``
        writes the fewest that reproduce each number, and ``fixed`` rounds to `DECIMALS`: a
        micrometer, 10 nm/s, 1e-9 deg of attitude, 1 ns; twice as fast.

    Raises
    ------
    DataError
        The table is not valid.
    """
    chosen = options or FileOptions()
    check_trajectory(trajectory)
    columns = named_columns(trajectory, TRAJECTORY)
    comments = told_of(chosen)
    if chosen.digits == "exact":
        csv.write(path, columns, comments)
        return
    head = "".join(f"# {key}: {value}\n" for key, value in comments.items())
    write_decimals(
        path,
        list(columns.values()),
        DECIMALS,
        separator=",",
        head=f"{head}{','.join(columns)}\n",
    )


def write_error_csv(path: Path, table: pd.DataFrame, *, name: str = "error") -> None:
    """Write a TrajectoryError table as text.

    Parameters
    ----------
    path : Path
    table : DataFrame
        Errors or standard deviations; with ``phi_N phi_E phi_D`` if available.
    name : str

    Raises
    ------
    DataError
        The table is not valid.
    """
    check_trajectory_error(table)
    more = ROTATION_ERROR if set(ROTATION_ERROR) <= set(table.columns) else []
    comments = {"trajectory error": one_line(name), "sign": "estimate minus reference"}
    if more:
        comments["phi"] = "rotation vector of C_est C_ref^T about north, east, down"
    csv.write(path, named_columns(table, [*TRAJECTORY_ERROR, *more]), comments)


# Fast writing of rows of numbers with fixed decimals.


Array = NDArray[np.float64]
# Rows converted to text at once.
PIECE = 1 << 15


def write_decimals(
    path: Path,
    columns: Sequence[Array],
    decimals: Sequence[int],
    *,
    separator: str = " ",
    head: str = "",
) -> None:
    """Write columns of numbers as lines.

    `columns` ((n,)): finite numbers. `decimals`: decimals of each column, 0 to 15. The error of a
    number is at most half a unit of its last decimal, plus the precision of a double. `separator`:
    one ASCII character. `head`: header text, with its line feeds.
    """
    from strapdown._kernels.decimal_text import WIDTH, decimal_text

    count = columns[0].size
    places = np.array(decimals, dtype=np.int64)
    text = np.empty(min(count, PIECE) * len(columns) * WIDTH, dtype=np.uint8)
    with path.open("wb") as stream:
        stream.write(head.encode())
        for first in range(0, count, PIECE):
            rows = np.column_stack([c[first : first + PIECE] for c in columns])
            written = decimal_text(rows, places, ord(separator), text)
            if written < 0:
                # A number of more than 15 digits.
                form = separator.join(f"%.{d}f" for d in decimals) + "\n"
                stream.write("".join(form % tuple(row) for row in rows.tolist()).encode())
            else:
                stream.write(text[:written].data)


def write_parquet(path: Path, trajectory: pd.DataFrame, options: FileOptions | None = None) -> None:
    """Write a Trajectory table as Parquet.

    `trajectory`: further numeric columns, such as standard deviations, are written under their own
    names. `options`: ellipsoid and epoch are written to the file's metadata, like the comments of
    the CSV. DataError: the table is not valid.
    """
    chosen = options or FileOptions()
    check_trajectory(trajectory)
    columns = named_columns(trajectory, TRAJECTORY)
    columns |= {
        str(c): trajectory[c].to_numpy(dtype=np.float64)
        for c in trajectory.columns
        if c not in TRAJECTORY and trajectory[c].dtype.kind in "iuf"
    }
    clock = clock_of(trajectory)
    told: dict[str, Any] = told_of(chosen)
    told |= {"clock": clock.name, "clock_origin_s": repr(clock.origin)}
    told |= {} if clock.week is None else {"gps_week": str(clock.week)}
    parquet.write(path, columns, told)

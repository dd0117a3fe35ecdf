"""Trajectories and their differences as text tables, with the unit in each name."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

from strapdown.evaluation.trajectory_differences import ROTATION_ERROR
from strapdown.formats import csv
from strapdown.formats.trajectory_options import TrajectoryFileOptions
from strapdown.tables import (
    EULER,
    NED,
    TRAJECTORY_ERROR,
    VELOCITY,
    check_trajectory,
    check_trajectory_error,
)

__all__ = ["one_line", "write_csv", "write_error_csv"]

_SUFFIX = {
    **dict.fromkeys([*NED, "alt"], "_m"),
    **dict.fromkeys(VELOCITY, "_m_s"),
    **dict.fromkeys([*EULER, *ROTATION_ERROR, "lat", "lon"], "_deg"),
}


def one_line(text: str) -> str:
    """A name without breaks, which end a comment, and what else neither text nor XML can hold."""
    return "".join(c for c in " ".join(text.split()) if c.isprintable())


def _write(path: Path, table: pd.DataFrame, columns: list[str], comments: dict[str, str]) -> None:
    named = {"time_s": table.index.to_numpy(dtype=np.float64)}
    named |= {c + _SUFFIX[c]: table[c].to_numpy(dtype=np.float64) for c in columns}
    csv.write(path, named, comments)


def write_csv(
    path: Path,
    trajectory: pd.DataFrame,
    *,
    name: str = "trajectory",
    options: TrajectoryFileOptions | None = None,
) -> None:
    """Write a Trajectory table as text, each number in the fewest digits that give it back.

    Parameters
    ----------
    path : Path
    trajectory : DataFrame
    name : str
    options : TrajectoryFileOptions, optional
        The ellipsoid and the epoch stand in the comments at the top.

    Raises
    ------
    DataError
        The table is not valid.
    """
    chosen = options or TrajectoryFileOptions()
    check_trajectory(trajectory)
    comments = {
        "trajectory": one_line(name),
        "ellipsoid": chosen.ellipsoid.name,
        "place": "geodetic, height over the ellipsoid",
        "velocity": "relative to the Earth, north east down",
        "attitude": "body forward-right-down to north-east-down",
    }
    if chosen.epoch is not None:
        comments["epoch"] = chosen.date(0.0)
    _write(path, trajectory, ["lat", "lon", "alt", *VELOCITY, *EULER], comments)


def write_error_csv(path: Path, table: pd.DataFrame, *, name: str = "error") -> None:
    """Write a TrajectoryError table as text.

    Parameters
    ----------
    path : Path
    table : DataFrame
        Errors or standard deviations; with ``phi_N phi_E phi_D`` where it has them.
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
    _write(path, table, [*TRAJECTORY_ERROR, *more], comments)

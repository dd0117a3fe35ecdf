"""Readers of trajectory files."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.errors import ConfigError, DataError
from strapdown.formats import csv, kitti, parquet, pyins, trajectory_nav
from strapdown.formats.clocks import Clock, clock_of_name, with_clock
from strapdown.formats.find_columns import Column
from strapdown.formats.numbers import numbers, ticks_of
from strapdown.formats.quantity_columns import Found
from strapdown.formats.recording import RawLog
from strapdown.formats.table_rows import told_by_file_rows
from strapdown.formats.trajectory_columns import QUANTITIES, find_trajectory_columns
from strapdown.formats.trajectory_plausibility import judge_trajectory
from strapdown.tables import trajectory_table

Array = NDArray[np.float64]

__all__ = ["TRAJECTORY_READERS", "TrajectoryReader", "files_of_trajectory", "read_trajectory"]


@dataclass(frozen=True)
class TrajectoryReader:
    """How a format without column names is recognized and read."""

    title: str
    detect: Callable[[Path], bool]
    read: Callable[[Path], pd.DataFrame]


#: Tried before a table is read by its column names.
TRAJECTORY_READERS: dict[str, TrajectoryReader] = {
    "kf-gins": TrajectoryReader(
        "KF-GINS, eleven columns (.nav)", trajectory_nav.detect, trajectory_nav.read
    ),
    "python-ins": TrajectoryReader(
        "python-ins arrays: time, truth (.npz)", pyins.detect_truth, pyins.read_truth
    ),
    "kitti": TrajectoryReader("KITTI raw, folder oxts", kitti.detect, kitti.read_trajectory),
}

_ELLIPSOID = re.compile(r"[#%]\s*ellipsoid\s*:\s*(\S+)\s*$", re.M)


def files_of_trajectory(path: str | Path) -> tuple[Path, ...]:
    """List the files that a trajectory is read from: one, or several of a folder.

    Parameters
    ----------
    path : str or Path
    """
    given = Path(path)
    return kitti.files_of(given) if kitti.detect(given) else (given,)


def read_trajectory(path: str | Path, columns: Mapping[str, str] | None = None) -> pd.DataFrame:
    """Read a trajectory.

    Parameters
    ----------
    path : str or Path
        ``.csv``, ``.txt``, ``.tsv``, ``.dat`` or ``.parquet`` with column names, or one of
        `TRAJECTORY_READERS`.
    columns : mapping of str to str, optional
        Quantity (``time``, ``lat``, ``lon``, ``alt``, ``VN``, ``VE``, ``VD``, ``roll``, ``pitch``,
        ``heading``) to the name of its column, or its number, from 1, if not evident.

    Returns
    -------
    DataFrame
        A Trajectory table. Names may carry a unit: ``lat_deg``, ``Latitude (rad)``, ``vel_north
        [m/s]``, ``time_ms``; the defaults are degrees, meters and seconds. A velocity up is
        negated. Dates are converted to seconds since 1970. ``attrs``: ``source``, the name of the
        file; ``ellipsoid``, if a comment states it, or None; its clock (`clocks`); ``findings``,
        a tuple of Finding.

    Raises
    ------
    ConfigError
        The file does not exist, or `columns` names a column that it does not have.
    DataError
        The file is empty or not a text table, a column is missing or has no numbers, a value is
        not finite, time does not advance, a latitude is beyond the pole; or positions and
        velocities show that latitude and longitude are exchanged or in radians, or that the
        attitude is in radians.
    """
    path = Path(path)
    if not path.exists():
        raise ConfigError("io.no-such-file", file=str(path))
    if columns is None or not columns:
        for reader in TRAJECTORY_READERS.values():
            if reader.detect(path):
                return reader.read(path)
    _refuse_others(path)
    raw = parquet.read(path) if parquet.detect(path) else csv.read(path)
    found = find_trajectory_columns(raw.columns, columns or {}, raw.name)
    values = {q: _values(raw, q, found[q]) for q in QUANTITIES}
    with told_by_file_rows(raw.name, raw.row):
        table = trajectory_table(
            values["time"],
            np.column_stack([values[q] for q in ("lat", "lon", "alt")]),
            np.column_stack([values[q] for q in ("VN", "VE", "VD")]),
            np.column_stack([values[q] for q in ("roll", "pitch", "heading")]),
            source=raw.name,
        )
    judged = judge_trajectory(
        table,
        angles_stated=found["lat"].stated and found["lon"].stated,
        euler_stated=found["heading"].stated,
    )
    with path.open("rb") as stream:
        stated = _ELLIPSOID.search(stream.read(4096).decode("utf-8", "replace"))
    first = float(values["time"][0])
    dated = raw.columns[found["time"].source].dtype.kind in "MO"
    with_clock(table, Clock(clock_of_name(found["time"].source, first, dated=dated)))
    table.attrs["ellipsoid"] = stated.group(1) if stated else None
    table.attrs["findings"] = (*raw.findings, *judged)
    return table


def _refuse_others(path: Path) -> None:
    known = (*csv.SUFFIXES, *parquet.SUFFIXES, ".nav", ".npz")
    if path.is_dir() or path.suffix.lower() not in known:
        raise DataError(
            "io.trajectory-read-text-table-alone"
            if not path.is_dir()
            else "io.folder-trajectory-read-file",
            file=path.name,
            known=known,
        )


def _values(raw: RawLog, quantity: str, column: Found) -> Array:
    of = Column(column.source, None, "")
    if quantity == "time":
        ticks, dated = ticks_of(raw, of)
        return np.asarray(ticks * (1e-9 if dated else column.factor), dtype=np.float64)
    values = np.asarray(numbers(raw, of, quantity), dtype=np.float64)
    return values if column.factor == 1.0 else values * column.factor

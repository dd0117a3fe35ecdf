"""Simulation arrays of python-ins (``.npz``): rates, fixes and truth in one archive.

``time`` s and ``imu`` (n, 6): rates in rad/s and specific force in m/s², forward, right, down, at
their stamps. ``truth`` (n, 9): latitude, longitude in deg, height in m, velocity north, east, down
in m/s, roll, pitch, heading in deg. ``fix_time`` s and ``fix`` (m, 3): positions as in the truth.
"""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.errors import DataError
from strapdown.formats import numpy_files
from strapdown.formats.clocks import RELATIVE, Clock, with_clock
from strapdown.formats.gnss_fixes import Fixes
from strapdown.formats.recording import NoStreamError, RawLog
from strapdown.formats.signs import Signs
from strapdown.tables import trajectory_table

__all__ = ["detect", "read", "read_fixes", "read_truth"]

Array = NDArray[np.float64]
COLUMNS = [*(f"gyro_{a}" for a in "xyz"), *(f"accel_{a}" for a in "xyz")]


def _holds(path: Path, *names: str) -> bool:
    if not path.is_file() or path.suffix.lower() != ".npz":
        return False
    try:
        with zipfile.ZipFile(path) as archive:
            return {f"{name}.npy" for name in names} <= set(archive.namelist())
    except zipfile.BadZipFile:
        return False


STREAMS = {"imu": ("time", "imu"), "gnss": ("fix_time", "fix"), "reference": ("time", "truth")}


def _has_stream(path: Path) -> bool:
    """Whether the archive has the arrays of a stream."""
    return any(_holds(path, *names) for names in STREAMS.values())


detect = Signs(suffixes=(".npz",), also=_has_stream)


def _arrays(path: Path, stream: str, width: int) -> tuple[Array, Array]:
    time, values = STREAMS[stream]
    if not _holds(path, time, values):
        there = [name for name, names in STREAMS.items() if _holds(path, *names)]
        raise NoStreamError(path.name, stream, "python-ins arrays", there)
    arrays = numpy_files.arrays_of(path)
    stamps, block = arrays[time], arrays[values]
    numeric = stamps.dtype.kind in "iuf" and block.dtype.kind in "iuf"
    if not numeric or stamps.ndim != 1 or block.shape != (stamps.size, width):
        raise DataError(
            "io.shapes-n-n-belong",
            file=path.name,
            quantity=f"{time}, {values}",
            shape=stamps.shape,
            shape_2=block.shape,
            width=width,
        )
    return stamps.astype(np.float64), block.astype(np.float64)


def read(path: Path) -> RawLog:
    """Read the angular rates and specific force.

    Raises
    ------
    DataError
        The archive is damaged, or its arrays have the wrong shapes.
    """
    time, imu = _arrays(path, "imu", len(COLUMNS))
    units = {"gyro": "rad/s", "accel": "m/s2"}
    columns = {n: (imu[:, k], units[n.partition("_")[0]]) for k, n in enumerate(COLUMNS)}
    return RawLog.of(path, {"time": (time, "s"), **columns}, sampling="instantaneous", axes="x,y,z")


def read_fixes(path: Path) -> Fixes:
    """Read the fixes; the archive does not state standard deviations."""
    time, place = _arrays(path, "gnss", 3)
    return Fixes(path.name, time, place, np.arange(1, time.size + 1))


def read_truth(path: Path) -> pd.DataFrame:
    """Read the trajectory.

    Returns
    -------
    DataFrame
        A Trajectory table.
    """
    time, truth = _arrays(path, "reference", 9)
    table = trajectory_table(time, truth[:, :3], truth[:, 3:6], truth[:, 6:], source=path.name)
    table.attrs["findings"] = ()
    return with_clock(table, Clock(RELATIVE))

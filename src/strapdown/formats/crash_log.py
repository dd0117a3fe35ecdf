"""Logs of inertial sensors as crash records: arrays, phones, MATLAB, HDF5."""

from __future__ import annotations

from pathlib import Path

from strapdown.errors import DataError
from strapdown.formats.crash_record import CrashRecord
from strapdown.formats.crash_table import record_of

__all__ = ["detect", "read"]

# Log formats whose columns may be those of a crash.
LOGS = (
    "sensor-logger",
    "phyphox",
    "sensor-folder",
    "npy-folder",
    "npz",
    "parquet",
    "hdf5",
    "matlab",
)


def detect(path: Path) -> bool:
    """Whether the file is a log with columns in another format: .npz, .h5, of a phone."""
    from strapdown.formats import READERS

    return any(READERS[key].detect(path) for key in LOGS)


def read(path: Path) -> CrashRecord:
    """Read a log of another format.

    Parameters
    ----------
    path : Path

    Returns
    -------
    CrashRecord

    Raises
    ------
    DataError
        The file is damaged, or of none of these formats.
    """
    from strapdown.formats import READERS

    for key in LOGS:
        if READERS[key].detect(path):
            return record_of(READERS[key].read(path), path, "log")
    raise DataError(
        "io.crash-log-format-unknown",
        file=path.name,
        quantity="format",
        logs=[READERS[key].title for key in LOGS],
    )

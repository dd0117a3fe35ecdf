"""Writers of logs: one function per format, and the registry of writers.

Every format has the same content: stamps, rates, specific force if available, the kind of
sampling, the axes and, if known, the true attitude.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.errors import check_choice
from strapdown.formats import csv, hdf5, numpy_files, parquet
from strapdown.formats.clocks import GPS, UNIX, clock_of
from strapdown.tables import ACCEL, EULER, GYRO, MAG, QUATERNION

__all__ = [
    "LOG_WRITERS",
    "imu_columns",
    "log_formats",
    "table_columns",
    "write_attitude_csv",
]

_AXES = "forward-right-down"


def _arrays(imu: pd.DataFrame, truth: pd.DataFrame | None) -> dict[str, NDArray[Any]]:
    arrays: dict[str, NDArray[Any]] = {
        "time": imu.index.to_numpy(dtype=np.float64),
        "gyro": imu[GYRO].to_numpy(dtype=np.float64),
    }
    if set(ACCEL) <= set(imu.columns):
        arrays["accel"] = imu[ACCEL].to_numpy(dtype=np.float64)
    if set(MAG) <= set(imu.columns):
        arrays["mag"] = imu[MAG].to_numpy(dtype=np.float64)
    if truth is not None:
        arrays |= {q: truth[q].to_numpy(dtype=np.float64) for q in QUATERNION}
    return arrays


_UNITS = {"time": "s", "gyro": "rad/s", "accel": "m/s2", "mag": "uT"}
_SUFFIX = {"time": "_s", "gyro": "_rad_s", "accel": "_m_s2", "mag": "_uT"}


def imu_columns(
    imu: pd.DataFrame, truth: pd.DataFrame | None
) -> tuple[dict[str, NDArray[Any]], dict[str, str]]:
    """Return the columns of a table, named with their units, and what the file states beside."""
    columns: dict[str, NDArray[Any]] = {}
    for name, array in _arrays(imu, truth).items():
        if array.ndim == 2:
            for k, axis in enumerate("xyz"):
                columns[f"{name}_{axis}{_SUFFIX[name]}"] = array[:, k]
        else:
            columns[name + _SUFFIX.get(name, "")] = array
    return columns, {"sampling": imu.attrs["sampling"], "axes": _AXES}


def _write_csv(path: Path, imu: pd.DataFrame, truth: pd.DataFrame | None) -> None:
    csv.write(path, *imu_columns(imu, truth))


def _write_parquet(path: Path, imu: pd.DataFrame, truth: pd.DataFrame | None) -> None:
    parquet.write(path, *imu_columns(imu, truth))


def _write_npz(path: Path, imu: pd.DataFrame, truth: pd.DataFrame | None) -> None:
    named = {k + _SUFFIX.get(k, ""): v for k, v in _arrays(imu, truth).items()}
    meta = {"sampling": np.array(imu.attrs["sampling"]), "axes": np.array(_AXES)}
    numpy_files.write(path, named | meta)


def _write_hdf5(path: Path, imu: pd.DataFrame, truth: pd.DataFrame | None) -> None:
    hdf5.write(
        path, _arrays(imu, truth), _UNITS, {"sampling": imu.attrs["sampling"], "axes": _AXES}
    )


def _write_mat(path: Path, imu: pd.DataFrame, truth: pd.DataFrame | None) -> None:
    named = {k + _SUFFIX.get(k, ""): v for k, v in _arrays(imu, truth).items()}
    hdf5.write_matlab(path, named, {"sampling": imu.attrs["sampling"], "axes": _AXES})


LogWriter = Callable[[Path, pd.DataFrame, pd.DataFrame | None], None]

#: Suffix to writer. The truth, if given, has one row per sample.
LOG_WRITERS: dict[str, LogWriter] = {
    "csv": _write_csv,
    "parquet": _write_parquet,
    "npz": _write_npz,
    "h5": _write_hdf5,
    "mat": _write_mat,
}


def log_formats(names: Sequence[str]) -> tuple[str, ...]:
    """Look up formats by name.

    `names`: keys of `LOG_WRITERS`; ``all`` selects every format. ConfigError: a format does not
    exist.
    """
    for name in names:
        check_choice("io.unknown-writer", (*LOG_WRITERS, "all"), quantity="--format", name=name)
    return tuple(LOG_WRITERS) if "all" in names else tuple(names)


def table_columns(table: pd.DataFrame) -> dict[str, NDArray[Any]]:
    """Return the columns of a table by time, named after its clock and with their units."""
    clock = clock_of(table).name
    name = {GPS: "gps_sow_s", UNIX: "unix_time_s"}.get(clock, "time_s")
    columns = {name: table.index.to_numpy(dtype=np.float64)}
    week = table.attrs.get("gps_week")
    if clock == GPS and week is not None:
        columns["week"] = np.full(len(table), float(week))
    for column in table.columns:
        unit = _OF_TABLES.get(str(column).removesuffix("_sd"), "")
        columns[f"{column}{unit}"] = table[column].to_numpy(dtype=np.float64)
    return columns


_OF_TABLES = {
    **dict.fromkeys(("lat", "lon", "roll", "pitch", "heading"), "_deg"),
    **dict.fromkeys(("alt", "north", "east", "down", "height"), "_m"),
    **dict.fromkeys(("VN", "VE", "VD", "speed", "vx", "vy", "vz"), "_m_s"),
}


def write_attitude_csv(path: Path, attitude: pd.DataFrame) -> None:
    """Write an Attitude table as text."""
    columns = {"time_s": attitude.index.to_numpy(dtype=np.float64)}
    columns |= {q: attitude[q].to_numpy() for q in QUATERNION}
    columns |= {f"{e}_deg": attitude[e].to_numpy() for e in EULER}
    csv.write(
        path, columns, {"attitude": "body forward-right-down to north-east-down, scalar first"}
    )

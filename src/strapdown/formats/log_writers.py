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
from strapdown.formats import csv, hdf5, numpy_files
from strapdown.tables import ACCEL, EULER, GYRO, QUATERNION

__all__ = [
    "LOG_WRITERS",
    "log_formats",
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
    if truth is not None:
        arrays |= {q: truth[q].to_numpy(dtype=np.float64) for q in QUATERNION}
    return arrays


_UNITS = {"time": "s", "gyro": "rad/s", "accel": "m/s2"}
_SUFFIX = {"time": "_s", "gyro": "_rad_s", "accel": "_m_s2"}


def _write_csv(path: Path, imu: pd.DataFrame, truth: pd.DataFrame | None) -> None:
    columns: dict[str, NDArray[Any]] = {}
    for name, array in _arrays(imu, truth).items():
        if array.ndim == 2:
            for k, axis in enumerate("xyz"):
                columns[f"{name}_{axis}{_SUFFIX[name]}"] = array[:, k]
        else:
            columns[name + _SUFFIX.get(name, "")] = array
    csv.write(path, columns, {"sampling": imu.attrs["sampling"], "axes": _AXES})


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


def write_attitude_csv(path: Path, attitude: pd.DataFrame) -> None:
    """Write an Attitude table as text."""
    columns = {"time_s": attitude.index.to_numpy(dtype=np.float64)}
    columns |= {q: attitude[q].to_numpy() for q in QUATERNION}
    columns |= {f"{e}_deg": attitude[e].to_numpy() for e in EULER}
    csv.write(
        path, columns, {"attitude": "body forward-right-down to north-east-down, scalar first"}
    )

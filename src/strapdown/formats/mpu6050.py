"""Folders of MPU-6050 recordings, stored by buffers in MATLAB files.

The layout of https://github.com/sunsided/sensor-fusion: ``mpu6050_gyroscope.mat`` with
``gyroBuffer`` (time in s, then deg/s) and ``mpu6050_accelerometer.mat`` with ``accelBuffer``
(time in s, then g).
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import DataError, Finding
from strapdown.formats import hdf5
from strapdown.formats.recording import RawLog
from strapdown.formats.signs import Signs

GYRO_FILE = "mpu6050_gyroscope.mat"
ACCEL_FILE = "mpu6050_accelerometer.mat"
# Lying with z up the board reads +1 g on z, and with its x mark up -1 g on x: forward is -x.
# The triads as read are right-handed: of the eight choices of sign for the gyro, (+, +, +) predicts
# the measured direction of gravity best in each of the three recorded rotations, by far in the one
# about y (verified by a test). Right is therefore +y.
AXES = "-x,y,-z"


def _has_gyro(folder: Path) -> bool:
    return (folder / GYRO_FILE).is_file()


detect = Signs(folder=_has_gyro)


def read(path: Path) -> RawLog:
    """Read the gyro, and the accelerometer if there is one.

    Parameters
    ----------
    path : Path
        The folder.

    Returns
    -------
    RawLog
        An accelerometer with its own stamps is interpolated to those of the gyro. The unused
        tail of a buffer is dropped.

    Raises
    ------
    DataError
        A file is damaged or has another layout.
    """
    findings: list[Finding] = []
    gyro = _buffer(path / GYRO_FILE, "gyroBuffer", findings)
    columns = {"time": gyro[:, 0]} | {f"gyro[{k}]": gyro[:, k + 1] for k in range(3)}
    stated = {"time": ("time", "s")} | {
        f"gyro[{k}]": (f"gyro_{'xyz'[k]}", "deg/s") for k in range(3)
    }
    files = [path / GYRO_FILE]
    if (path / ACCEL_FILE).is_file():
        files.append(path / ACCEL_FILE)
        accel = _buffer(path / ACCEL_FILE, "accelBuffer", findings)
        if len(accel) > 1:
            columns |= _accel_columns(accel, gyro[:, 0], findings)
            stated |= {f"accel[{k}]": (f"accel_{'xyz'[k]}", "g") for k in range(3)}
    return RawLog(
        name=path.resolve().name,
        files=tuple(files),
        columns=columns,
        stated=stated,
        sampling="instantaneous",
        axes=AXES,
        findings=findings,
    )


def _accel_columns(
    accel: NDArray[Any], time: NDArray[Any], findings: list[Finding]
) -> dict[str, NDArray[Any]]:
    """Interpolate the accelerometer to the stamps of the gyro; NaN in its gaps."""
    if not np.array_equal(accel[:, 0], time):
        order = np.argsort(accel[:, 0], kind="stable")
        accel = np.column_stack(
            [time] + [np.interp(time, accel[order, 0], accel[order, k]) for k in (1, 2, 3)]
        )
        findings.append(
            Finding(
                "io.interpolated-stamps-gyro-not-own-2",
                file=ACCEL_FILE,
                quantity="accel",
                severity="note",
            )
        )
    return {f"accel[{k}]": accel[:, k + 1] for k in range(3)}


def _buffer(path: Path, name: str, findings: list[Finding]) -> NDArray[Any]:
    arrays = (hdf5.read_arrays(path) if hdf5.detect(path) else hdf5.read_matlab_arrays(path))[0]
    if name not in arrays or 4 not in arrays[name].shape or arrays[name].ndim != 2:
        raise DataError(
            "io.no-four-rows-holds",
            file=path.name,
            name=name,
            arrays=", ".join(arrays) or "nothing",
        )
    buffer = arrays[name]
    rows = buffer.T if buffer.shape[0] == 4 else buffer
    used = np.flatnonzero((rows != 0).any(axis=1))
    end = int(used[-1]) + 1 if used.size else 0
    if end < len(rows):
        findings.append(
            Finding(
                "io.last-rows-all-zero-tail",
                file=path.name,
                row=end + 1,
                severity="note",
                count=len(rows) - end,
                count_2=len(rows),
            )
        )
    return np.asarray(rows[:end], dtype=np.float64)

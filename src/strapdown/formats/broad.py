"""Trials of BROAD (Laidig, Caruso, Cereatti, Seel, Data 2021 6(7):72), with optical truth."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np

from strapdown import rotation
from strapdown.exceptions import DataError
from strapdown.formats import hdf5
from strapdown.formats.arrays import raw_log
from strapdown.formats.recording import RawLog, TruthInSensorAxes

# East-north-up to north-east-down: half a turn about the diagonal between north and east.
_Q_NED_ENU = (0.0, np.sqrt(0.5), np.sqrt(0.5), 0.0)


def detect(path: Path) -> bool:
    """Tell whether this is an HDF5 file with the datasets of BROAD."""
    if path.suffix.lower() not in hdf5.SUFFIXES or not hdf5.detect(path):
        return False
    import h5py

    try:
        with h5py.File(path, "r") as file:
            return {"imu_gyr", "imu_acc", "opt_quat"} <= set(file)
    except OSError:
        return False


def read(path: Path) -> RawLog:
    """Read a trial: sensor, optical attitude, and the samples that count.

    Parameters
    ----------
    path : Path

    Returns
    -------
    RawLog
        Sensor axes taken as forward, left, up, for which the truth is turned alike, so that
        no error angle depends on that.

    Raises
    ------
    DataError
        The file is damaged, or a dataset has another length than the gyro's.
    """
    arrays, _, meta = hdf5.read_arrays(path)
    raw = raw_log(path, {k: arrays[k] for k in ("imu_gyr", "imu_acc")}, {}, meta)
    samples = len(arrays["imu_gyr"])
    movement = arrays.get("movement", np.ones(samples, dtype=bool)).astype(bool)
    q_enu = arrays["opt_quat"]
    if q_enu.shape != (samples, 4) or movement.shape != (samples,):
        raise DataError(
            f"opt_quat has shape {q_enu.shape} and movement {movement.shape}, for {samples} "
            "samples of the gyro",
            file=path.name,
            remedy="get the trial again from its source",
        )
    if raw.rate is None:
        raise DataError(
            "the attribute sampling_rate is missing",
            file=path.name,
            quantity="time",
            remedy="state it with --rate",
        )
    known = np.isfinite(q_enu).all(axis=1)
    q_ns = np.full((samples, 4), np.nan)
    q_ns[known] = rotation.compose(_Q_NED_ENU, q_enu[known])
    return dataclasses.replace(
        raw,
        stated={f"imu_gyr[{k}]": (f"gyro_{'xyz'[k]}", "rad/s") for k in range(3)}
        | {f"imu_acc[{k}]": (f"accel_{'xyz'[k]}", "m/s2") for k in range(3)},
        sampling="instantaneous",
        axes="x,-y,-z",
        truth=TruthInSensorAxes(q_ns, movement & known),
    )

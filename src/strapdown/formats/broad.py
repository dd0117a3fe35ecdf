"""Trials of BROAD (Laidig, Caruso, Cereatti, Seel, Data 2021 6(7):72), with optical truth."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np

from strapdown import rotation
from strapdown.errors import DataError
from strapdown.formats import hdf5
from strapdown.formats.arrays import raw_log
from strapdown.formats.assemble import LOST
from strapdown.formats.recording import RawLog, TruthInSensorAxes
from strapdown.formats.signs import Signs
from strapdown.rotation import Q_NED_ENU


def _has_trial(path: Path) -> bool:
    """Whether HDF5 has the datasets of BROAD."""
    import h5py

    try:
        with h5py.File(path, "r") as file:
            return {"imu_gyr", "imu_acc", "opt_quat"} <= set(file)
    except OSError:
        return False


detect = Signs(suffixes=hdf5.SUFFIXES, also=_has_trial)


def read(path: Path) -> RawLog:
    """Read a trial: sensor, optical attitude, and the samples that are scored.

    Returns
    -------
    RawLog
        Sensor axes are taken as forward, left, up. The truth is rotated alike, so that
        error angles do not depend on this choice.

    Raises
    ------
    DataError
        The file is damaged, or a dataset differs in length from the gyro's.
    """
    arrays, _, meta = hdf5.read_arrays(path)
    shapes = {n: arrays.get(n, np.empty(0)).shape for n in ("imu_gyr", "imu_acc", "opt_quat")}
    samples = max((s[0] for s in shapes.values() if s), default=0)
    movement = np.asarray(arrays.get("movement", np.ones(samples, dtype=bool))).astype(bool)
    wanted = {"imu_gyr": (samples, 3), "imu_acc": (samples, 3), "opt_quat": (samples, 4)}
    if samples < 2 or shapes != wanted or movement.shape != (samples,):
        raise DataError(
            "io.broad-shapes", file=path.name, values=shapes.values(), shape=movement.shape
        )
    sensors = {"imu_gyr": ("gyro", "rad/s"), "imu_acc": ("accel", "m/s2")}
    # In some exports the magnetometer is slower than the gyro: read only if on the gyro's stamps.
    if arrays.get("imu_mag", np.empty(0)).shape == (samples, 3):
        sensors["imu_mag"] = ("mag", "uT")
    raw = raw_log(path, {k: arrays[k] for k in sensors}, {}, meta)
    q_enu = arrays["opt_quat"].astype(np.float64)
    # Zeros, like NaN, mark lost markers.
    known = np.isfinite(q_enu).all(axis=1) & (np.abs(q_enu).max(axis=1) > LOST)
    q_ns = np.full((samples, 4), np.nan)
    q_ns[known] = rotation.compose(Q_NED_ENU, q_enu[known])
    return dataclasses.replace(
        raw,
        stated={
            f"{name}[{k}]": (f"{triad}_{'xyz'[k]}", unit)
            for name, (triad, unit) in sensors.items()
            for k in range(3)
        },
        sampling="instantaneous",
        axes="x,-y,-z",
        truth=TruthInSensorAxes(q_ns, movement & known),
    )

"""The shared recordings as bare columns: no unit, no axes, no statement of what they are."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import h5py
import numpy as np
from scipy.io import loadmat

from strapdown.formats.recording import RawLog


@dataclass(frozen=True)
class Bare:
    """Arrays, and what they truly are."""

    name: str
    time: np.ndarray
    gyro: np.ndarray
    accel: np.ndarray
    mag: np.ndarray | None = None

    def scaled(self, gyro: float = 1.0, accel: float = 1.0, time: float = 1.0) -> Bare:
        return replace(self, gyro=self.gyro * gyro, accel=self.accel * accel, time=self.time * time)

    def turned(self, matrix: np.ndarray) -> Bare:
        mag = None if self.mag is None else self.mag @ matrix.T
        return replace(self, gyro=self.gyro @ matrix.T, accel=self.accel @ matrix.T, mag=mag)

    def log(self) -> RawLog:
        columns = {"time": self.time}
        for triad, values in (("gyro", self.gyro), ("accel", self.accel), ("mag", self.mag)):
            if values is not None:
                columns |= {f"{triad}_{a}": values[:, k] for k, a in enumerate("xyz")}
        return RawLog(self.name, (), columns)


def broad(path: Path) -> Bare:
    with h5py.File(path) as file:
        gyro, accel, mag = (file[k][()].astype(float) for k in ("imu_gyr", "imu_acc", "imu_mag"))
        rate = float(file.attrs["sampling_rate"])
    good = np.isfinite(np.hstack([gyro, accel])).all(axis=1)
    time = np.arange(len(gyro)) / rate
    return Bare(path.stem, time[good], gyro[good], accel[good], mag[good])


def mpu6050(folder: Path) -> Bare:
    def buffer(name: str, key: str) -> np.ndarray:
        with h5py.File(folder / name) as file:
            rows = file[key][()]
        rows = rows.T if rows.shape[0] == 4 else rows
        return rows[: np.flatnonzero((rows != 0).any(axis=1))[-1] + 1].astype(float)

    gyro = buffer("mpu6050_gyroscope.mat", "gyroBuffer")
    accel = buffer("mpu6050_accelerometer.mat", "accelBuffer")
    at = np.column_stack([np.interp(gyro[:, 0], accel[:, 0], accel[:, k]) for k in (1, 2, 3)])
    return Bare(folder.name, gyro[:, 0], gyro[:, 1:], at)


def car(path: Path) -> Bare:
    rows = np.loadtxt(path, delimiter=",", comments="#")
    return Bare(path.stem, rows[:, 0], rows[:, 1:4], rows[:, 4:7])


def ring_laser(path: Path, scaled: bool) -> Bare:
    rows = np.loadtxt(path, comments="%", skiprows=0, usecols=range(6), max_rows=None)[3:]
    gyro, accel = rows[:, :3], rows[:, 3:6]
    if scaled:
        gyro, accel = gyro * np.radians(0.1 / 3600.0), accel * 125e-6 * 9.780327
    return Bare(path.stem, np.arange(len(rows)) * 0.01, gyro, accel)


def phone(folder: Path) -> Bare:
    def load(name: str) -> np.ndarray:
        return np.load(folder / f"IMU__{name}.npy").astype(float)

    time, gyro = load("gyro__t"), load("gyro__value")

    def at(name: str) -> np.ndarray:
        t, v = load(f"{name}__t"), load(f"{name}__value")
        return np.column_stack([np.interp(time, t, v[:, k]) for k in range(3)])

    return Bare("phone", time, gyro, at("accelerometer"), at("magnetometer"))


def foot(path: Path) -> Bare:
    data = loadmat(path)
    imu = data["imu_data"].astype(float)
    return Bare("foot", data["timestamps"].astype(float).ravel(), imu[:, 3:6], imu[:, :3])


def crash_heads(folder: Path) -> list[Bare]:
    """Accelerations in g and rates in deg/s of the two heads."""

    def channel(number: int) -> np.ndarray:
        return np.loadtxt(folder / f"v10146.{number:03d}")

    out = []
    for name, first, rates in (("driver", 1, 101), ("passenger", 47, 104)):
        acc = [channel(first + k) for k in range(3)]
        gyr = [channel(rates + k) for k in range(3)]
        n = min(len(c) for c in acc + gyr)
        out.append(
            Bare(
                name,
                gyr[0][:n, 0],
                np.column_stack([c[:n, 1] for c in gyr]),
                np.column_stack([c[:n, 1] for c in acc]),
            )
        )
    return out

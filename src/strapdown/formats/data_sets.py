"""Published data sets of inertial sensors: BROAD, RoNIN, an MPU-6050, smartLoc, units on shoes."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.errors import DataError, Finding, add_note
from strapdown.formats import hdf5
from strapdown.formats.arrays import raw_log
from strapdown.formats.assemble import LOST
from strapdown.formats.clocks import GPS
from strapdown.formats.known_formats import AXES, column, selected, stated_by, under
from strapdown.formats.recording import RawLog, TruthInSensorAxes
from strapdown.formats.signs import Signs
from strapdown.rotation import Q_NED_ENU
from strapdown.tables.checks import Array

# Trials of BROAD (Laidig, Caruso, Cereatti, Seel, Data 2021 6(7):72), with optical truth.


detect_broad = Signs(
    suffixes=hdf5.SUFFIXES,
    also=lambda path: hdf5.outline(path)[0] >= {"imu_gyr", "imu_acc", "opt_quat"},
)


def read_broad(path: Path) -> RawLog:
    """Read a trial: sensor, optical attitude, and the samples that are scored.

    Sensor axes are taken as forward, left, up. The truth is rotated alike, so that error angles do
    not depend on this choice.
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


# RoNIN: HDF5 files of a carried phone, with another phone on the chest.
#
# ``synced/time`` in s, ``synced/gyro`` in rad/s, ``synced/acce`` in m/s² and ``synced/magnet`` in
# µT are of the carried phone, at 200 Hz, in its own axes (Herath, Yan and Furukawa, RoNIN, ICRA
# 2020; source/preprocessing/compile_dataset_h5.py and gen_dataset_v2.py of
# https://github.com/Sachini/ronin). ``pose/tango_ori`` is the attitude of the phone on the chest,
# not of the carried one; ``synced/game_rv`` is the attitude that the carried phone computes
# itself.


TIME, GYRO, FORCE, MAG = "synced/time", "synced/gyro", "synced/acce", "synced/magnet"
TRIADS = {GYRO: ("gyro", "rad/s"), FORCE: ("accel", "m/s2"), MAG: ("mag", "uT")}
CHEST = "pose/tango_ori"


detect_ronin = Signs(
    suffixes=hdf5.SUFFIXES, also=lambda path: hdf5.outline(path)[0] >= {TIME, GYRO, FORCE}
)


def read_ronin(path: Path) -> RawLog:
    """Read rates, specific force and, if present, the magnetic field."""
    arrays, _, _ = hdf5.read_arrays(path, (TIME, *TRIADS))
    for name in (TIME, GYRO, FORCE):
        if name not in arrays:
            raise DataError(
                "io.no-such-array", file=path.name, quantity=name, name=name, arrays=list(arrays)
            )
    samples = arrays[TIME].size
    for name in TRIADS:
        if name in arrays and arrays[name].shape != (samples, 3):
            raise DataError(
                "io.shape-stamps",
                file=path.name,
                name=name,
                shape=arrays[name].shape,
                samples=samples,
            )
    raw = raw_log(path, arrays, {}, {})
    stated: dict[str, tuple[str, str | None]] = {TIME: ("time", "s")}
    for name, (triad, unit) in TRIADS.items():
        if name in arrays:
            stated |= {f"{name}[{k}]": (f"{triad}_{a}", unit) for k, a in enumerate("xyz")}
    if CHEST in hdf5.outline(path)[0]:
        add_note(
            raw.findings,
            "io.attitude-of-other-phone",
            file=path.name,
            quantity="attitude",
            name=CHEST,
        )
    raw.stated, raw.axes = stated, AXES
    return raw


# Folders of MPU-6050 recordings, stored by buffers in MATLAB files.
#
# The layout of https://github.com/sunsided/sensor-fusion: ``mpu6050_gyroscope.mat`` with
# ``gyroBuffer`` (time in s, then deg/s) and ``mpu6050_accelerometer.mat`` with ``accelBuffer``
# (time in s, then g).


GYRO_FILE = "mpu6050_gyroscope.mat"
ACCEL_FILE = "mpu6050_accelerometer.mat"
# Lying with z up the board reads +1 g on z, and with its x mark up -1 g on x: forward is -x.
# The triads as read are right-handed: of the eight choices of sign for the gyro, (+, +, +) predicts
# the measured direction of gravity best in each of the three recorded rotations, by far in the one
# about y (verified by a test). Right is therefore +y.
MPU_AXES = "-x,y,-z"


detect_mpu = Signs(folder=lambda path: (path / GYRO_FILE).is_file())


def read_mpu(path: Path) -> RawLog:
    """Read the gyro, and the accelerometer if there is one.

    An accelerometer with its own stamps is interpolated to those of the gyro. The unused tail of a
    buffer is dropped.
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
        axes=MPU_AXES,
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
        add_note(
            findings, "io.interpolated-stamps-gyro-not-own-2", file=ACCEL_FILE, quantity="accel"
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
        add_note(
            findings,
            "io.last-rows-all-zero-tail",
            file=path.name,
            row=end + 1,
            count=len(rows) - end,
            count_2=len(rows),
        )
    return np.asarray(rows[:end], dtype=np.float64)


# smartLoc of TU Chemnitz (https://www.tu-chemnitz.de/projekt/smartLoc): CSV of raw GNSS data.
#
# A row is one pseudorange, preceded by the reference at its epoch, of a NovAtel SPAN system:
# ``GPSWeek [weeks]``, ``GPSSecondsOfWeek [s]``, longitude and latitude in degrees, height above
# the ellipsoid, heading in rad from east, counterclockwise, speed along it, acceleration and yaw
# rate. One rate and one acceleration are not three axes: the file gives positions, once an epoch.


FIRST = ("GPSWeek [weeks]", "GPSSecondsOfWeek [s]")
LAT, LON = "Latitude (GT Lat) [deg]", "Longitude (GT Lon) [deg]"
ALT, SPEED = "Height above ellipsoid (GT Height) [m]", "Velocity (GT Velocity) [m/s]"


detect_smartloc = Signs(text=r"\A" + "".join(f"(?=.*{re.escape(n)})" for n in (*FIRST, LAT, LON)))


def read_smartloc_fixes(path: Path) -> RawLog:
    """Read position and velocity of the reference, once an epoch."""
    raw = under(path)
    heading = next((n for n in raw.columns if n.startswith("Heading (0° = East, counterc")), "")
    held = {
        "week": (column(raw, FIRST[0]), None),
        "time": (column(raw, FIRST[1]), "s"),
        "lat": (column(raw, LAT), "deg"),
        "lon": (column(raw, LON), "deg"),
        "alt": (column(raw, ALT), "m"),
        "speed": (column(raw, SPEED), "m/s"),
        "course": (np.mod(90.0 - np.degrees(column(raw, heading or "Heading")), 360.0), "deg"),
    }
    log = stated_by(raw, held, clock=GPS)
    epochs = held["time"][0] + 604_800.0 * held["week"][0]
    log = selected(log, np.diff(epochs, prepend=-np.inf) != 0.0)
    add_note(log.findings, "io.smartloc-reference", file=path.name, quantity="lat, lon, alt")
    return log


# MATLAB files of a foot-mounted unit, with surveyed control points.
#
# Layout of https://github.com/mtahakoroglu/LLIO-aided-iPyShoe: ``imu_data`` (n, 6), specific
# force in m/s² and rates in rad/s along forward, right, down; ``timestamps`` s. With control
# points: ``GCP`` (m, 2), north and east in m from an arbitrary origin and direction, and
# ``strideIndex``, the sample, counted from zero, at which the foot was on each point.


LOG, POINTS = ("timestamps", "imu_data"), ("strideIndex", "GCP")
COLUMNS = [*(f"accel_{a}" for a in "xyz"), *(f"gyro_{a}" for a in "xyz")]


detect_foot = Signs(suffixes=(".mat",), also=lambda path: set(LOG) <= _names(path))


def detect_foot_points(path: Path) -> bool:
    """Detect by the names of the arrays."""
    return {*LOG, *POINTS} <= _names(path)


def _names(path: Path) -> set[str]:
    return (
        {name for name, _ in hdf5.contents_of_matlab(path)} if hdf5.detect_matlab(path) else set()
    )


def _arrays(path: Path, *names: str) -> dict[str, Any]:
    arrays, _ = hdf5.read_matlab_arrays(path)
    for name in names:
        if name not in arrays:
            raise DataError(
                "io.no-such-array", file=path.name, quantity=name, name=name, arrays=list(arrays)
            )
    return {name: arrays[name].astype(np.float64) for name in names}


def _log(path: Path) -> tuple[Array, Array]:
    arrays = _arrays(path, *LOG)
    time, imu = arrays["timestamps"].reshape(-1), arrays["imu_data"]
    if imu.shape != (time.size, len(COLUMNS)):
        raise DataError(
            "io.shapes-n-stamps-n-belong",
            file=path.name,
            quantity="timestamps, imu_data",
            shape=arrays["timestamps"].shape,
            shape_2=imu.shape,
        )
    return time, imu


def read_foot(path: Path) -> RawLog:
    """Read rates and specific force."""
    time, imu = _log(path)
    units = {"gyro": "rad/s", "accel": "m/s2"}
    columns = {n: (imu[:, k], units[n.partition("_")[0]]) for k, n in enumerate(COLUMNS)}
    return RawLog.of(path, {"time": (time, "s"), **columns}, sampling="instantaneous", axes="x,y,z")


def read_foot_points(path: Path) -> tuple[Array, Array]:
    """Read the control points.

    Returns `time` ((m,), s): times at which the foot was on each point; `places` ((m, 2), m): north
    and east.
    """
    time, _ = _log(path)
    arrays = _arrays(path, *POINTS)
    at, places = arrays["strideIndex"].reshape(-1), arrays["GCP"]
    if places.shape != (at.size, 2):
        raise DataError(
            "io.samples-control-points-shape",
            file=path.name,
            quantity="strideIndex, GCP",
            size=at.size,
            shape=places.shape,
        )
    within = (at >= 0) & (at < time.size) & (at == np.floor(at))
    if not within.all():
        k = int(np.argmin(within))
        raise DataError(
            "io.control-point-outside",
            file=path.name,
            row=k + 1,
            quantity="strideIndex",
            at=at[k],
            size=time.size,
        )
    return time[at.astype(np.intp)], places

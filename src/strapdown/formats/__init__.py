"""Readers and writers: one module per format, and the registry of readers."""

from __future__ import annotations

import dataclasses
import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from strapdown.errors import ConfigError, DataError, StrapdownError
from strapdown.formats import (
    asl,
    broad,
    comma2k19,
    csv,
    foot_mounted,
    gnss_logger,
    hdf5,
    join,
    kf_gins,
    kitti,
    mpu6050,
    numpy_files,
    parquet,
    phyphox,
    psins,
    pyins,
    ronin,
    sensor_folder,
    sensor_logger,
    sensorlog,
    sensorstream,
    xsens,
)
from strapdown.formats.assemble import assemble
from strapdown.formats.columns import read_name
from strapdown.formats.recording import RawLog, ReadOptions, Recording
from strapdown.plugins import plugin, plugins

_log = logging.getLogger("strapdown")

__all__ = ["READERS", "ReadOptions", "Reader", "Recording", "read_joined", "read_log", "read_raw"]


@dataclass(frozen=True)
class Reader:
    """How one format is recognized and read."""

    title: str
    detect: Callable[[Path], bool]
    read: Callable[[Path], RawLog]


#: In the order of detection: formats of known recordings first, general formats last.
READERS: dict[str, Reader] = {
    "mpu6050": Reader("folder of an MPU-6050 in MATLAB files", mpu6050.detect, mpu6050.read),
    "broad": Reader("BROAD trial, HDF5 with optical truth", broad.detect, broad.read),
    "comma2k19": Reader(
        "comma2k19 segment, with its pose as truth", comma2k19.detect, comma2k19.read
    ),
    "kitti": Reader("KITTI raw, folder oxts", kitti.detect, kitti.read),
    "ronin": Reader("RoNIN, HDF5 of a phone", ronin.detect, ronin.read),
    "asl": Reader("EuRoC, TUM VI: data.csv of imu0, or folder mav0", asl.detect, asl.read),
    "xsens": Reader("Xsens MT Manager export (.txt .csv)", xsens.detect, xsens.read),
    "sensorstream": Reader("Sensorstream IMU+GPS", sensorstream.detect, sensorstream.read),
    "sensor-logger": Reader(
        "Sensor Logger: zip, folder, CSV, JSON", sensor_logger.detect, sensor_logger.read
    ),
    "sensorlog": Reader("SensorLog of iOS, wide CSV", sensorlog.detect, sensorlog.read),
    "gnss-logger": Reader(
        "GnssLogger of Android, device_imu.csv", gnss_logger.detect, gnss_logger.read
    ),
    "phyphox": Reader("phyphox: CSV, zip, folder", phyphox.detect, phyphox.read),
    "sensor-folder": Reader(
        "folder or zip of one text table a sensor", sensor_folder.detect, sensor_folder.read
    ),
    "kf-gins": Reader(
        "KF-GINS increments, seven columns without a header", kf_gins.detect, kf_gins.read
    ),
    "psins": Reader("PSINS increments (.imu)", psins.detect, psins.read),
    "npy-folder": Reader(
        "folder of NumPy arrays (.npy)", numpy_files.detect_folder, numpy_files.read_folder
    ),
    "csv": Reader("text table (.csv .txt .tsv .dat)", csv.detect, csv.read),
    "python-ins": Reader("python-ins arrays: time, imu (.npz)", pyins.detect, pyins.read),
    "npz": Reader("NumPy archive (.npz)", numpy_files.detect, numpy_files.read),
    "parquet": Reader("Parquet (.parquet .pq)", parquet.detect, parquet.read),
    "hdf5": Reader("HDF5 (.h5 .hdf5) and MATLAB v7.3 (.mat)", hdf5.detect, hdf5.read),
    "foot-mounted": Reader(
        "unit on a shoe: timestamps, imu_data (.mat)", foot_mounted.detect, foot_mounted.read
    ),
    "matlab": Reader("MATLAB up to v7 (.mat)", hdf5.detect_matlab, hdf5.read_matlab),
}


def read_raw(path: Path, form: str | None = None) -> RawLog:
    """Read the raw columns of a log.

    `path`: a file, or the folder of a known recording. `form`: a key of `READERS`; detected from
    the file if not given. ConfigError: the file does not exist, or the format is unknown.
    DataError: the format is not recognized, or the file is damaged.
    """
    if not path.exists():
        raise ConfigError("io.no-such-log", file=str(path))
    if path.is_file() and path.stat().st_size == 0:
        raise DataError("io.file-empty", file=path.name)
    if form is not None:
        named: Reader | None = READERS.get(form) or plugin("reader", form, Reader)
        if named is None:
            raise ConfigError(
                "io.unknown-format-of-log", quantity="format", form=form, word=form, known=READERS
            )
        return named.read(path)
    for name, reader in READERS.items():
        if reader.detect(path):
            _log.info("%s: read as %s (%s)", path.name, name, reader.title)
            return reader.read(path)
    others, broken = plugins("reader", Reader)
    for other in others.values():
        if other.detect(path):
            raw: RawLog = other.read(path)
            return raw
    for one in broken:
        _log.warning("%s", one)
    kinds = "; ".join(r.title for r in READERS.values())
    if path.is_dir():
        raise _no_recording(path)
    raise DataError("io.ending-no-known-format", file=path.name, suffix=path.suffix, kinds=kinds)


#: Most names of a folder that are searched, and that a message lists.
MOST_NAMES, MOST_SHOWN = 1000, 6
#: Largest file that is searched for a gyro or an accelerometer, bytes.
MOST_BYTES = 64 * 1024 * 1024


def _no_recording(path: Path) -> DataError:
    """Make the error for a folder without a recording; it names the logs in the folder."""
    inside = sorted(path.iterdir())[:MOST_NAMES]
    may_be = [p for p in inside if any(r.detect(p) for r in READERS.values())]
    logs = [p.name for p in may_be if _has_sensors(p)]
    shown = logs or [p.name for p in inside]
    names = ", ".join(shown[:MOST_SHOWN]) + (" …" if len(shown) > MOST_SHOWN else "")
    if not logs:
        return DataError(
            "io.folder-no-known-recording-holds", file=path.resolve().name, names=names or "nothing"
        )
    return DataError(
        "io.folder-of-one-recording" if len(logs) == 1 else "io.folder-of-recordings",
        file=path.resolve().name,
        count=len(logs),
        names=names,
        path=path / logs[0],
    )


def _has_sensors(path: Path) -> bool:
    """Whether a log has a gyro or an accelerometer; a table of fixes has neither."""
    if path.is_file() and path.stat().st_size > MOST_BYTES:
        return True
    try:
        raw = read_raw(path)
    except StrapdownError:
        return False
    said = [quantity for quantity, _ in raw.stated.values()]
    said += [str(read_name(column).quantity) for column in raw.columns]
    return any(quantity.startswith(("gyro", "accel")) for quantity in said)


def read_joined(paths: Sequence[str | Path], options: ReadOptions | None = None) -> Recording:
    """Read logs of single sensors on one clock into one recording.

    Parameters
    ----------
    paths : sequence of str or Path
        One has the gyro; the others are interpolated to its stamps.
    options : ReadOptions, optional
        User's statements about the logs. A column is named as in its log, or as
        ``log/column``.

    Raises
    ------
    ConfigError
        A file does not exist, an option names a column that no log has, or two logs have the
        same quantity.
    DataError
        A log cannot be used, no log has a gyro, or the clocks do not overlap.
    """
    asked = options or ReadOptions()
    logs = [read_raw(Path(path), asked.format) for path in paths]
    if len(logs) == 1:
        return assemble(logs[0], asked)
    raw = join.join(join.with_columns(logs, asked), " + ".join(log.name for log in logs))
    return assemble(raw, dataclasses.replace(asked, columns={}))


def read_log(path: str | Path, options: ReadOptions | None = None) -> Recording:
    """Read a log into body axes and SI units.

    Parameters
    ----------
    path : str or Path
        A file, or the folder of a known recording.
    options : ReadOptions, optional
        User's statements about the log.

    Raises
    ------
    ConfigError
        The file does not exist, or an option names a column that it does not have.
    DataError
        The log cannot be used; the message names file, row, quantity and remedy.
    """
    asked = options or ReadOptions()
    return assemble(read_raw(Path(path), asked.format), asked)

"""APDM Opal: CSV and HDF5 of Motion Studio, one or several monitors.

CSV: ``Test Name:`` and ``Sample Rate:`` above the names ``Monitor/Angular Velocity/X`` …, their
units under them, and rows that may have one more, empty field. HDF5 (attribute
``FileFormatVersion``): ``Sensors/<id>/`` with ``Time`` in µs since 1970, ``Accelerometer`` in m/s²,
``Gyroscope`` in rad/s and ``Magnetometer`` in µT, each (n, 3); before version 5
``<id>/Calibrated/Accelerometers`` … and ``<id>/Time`` (APDM, Motion Studio user guide, "Working
with HDF5"). The first monitor is read; the columns of the others can be named. Axes are those
printed on the monitor.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np

from strapdown.errors import DataError, Finding
from strapdown.formats.clocks import UNIX
from strapdown.formats.hdf5 import SIGNATURE, read_arrays
from strapdown.formats.known_formats import column, lacking, split, under
from strapdown.formats.recording import RawLog
from strapdown.formats.signs import Signs, first_bytes, head
from strapdown.units import unit_of

TITLE = "APDM Opal"
TRIADS = {"Angular Velocity": "gyro", "Acceleration": "accel", "Magnetic Field": "mag"}
SETS = {
    "gyro": ("Gyroscope", "rad/s"),
    "accel": ("Accelerometer", "m/s2"),
    "mag": ("Magnetometer", "uT"),
}


def _has_monitor(path: Path) -> bool:
    """Whether there are lines of Motion Studio above a table, or groups of it in HDF5."""
    if first_bytes(path, 8) == SIGNATURE:
        return bool(_groups(path))
    text = head(path)
    return text.startswith("Test Name:") and "/Angular Velocity/X" in text


detect = Signs(
    first=rb"\A(?:" + re.escape(SIGNATURE) + rb"|(?:\xef\xbb\xbf)?Test Name:|\xff\xfe|\xfe\xff)",
    also=_has_monitor,
)


def read(path: Path) -> RawLog:
    """Read the first monitor."""
    with path.open("rb") as stream:
        return _hdf5(path) if stream.read(8) == SIGNATURE else _csv(path)


def _csv(path: Path) -> RawLog:
    lines = head(path, 1 << 16).splitlines()
    top = next((k for k, line in enumerate(lines) if line.startswith("Time,")), None)
    if top is None or len(lines) < top + 3:
        raise DataError("io.csv-without-rows", file=path.name, row=len(lines))
    names, units = (split(lines[top + k], ",") for k in (0, 1))
    # Rows may end in a comma, which the names do not.
    more = split(lines[top + 2], ",")[len(names) :]
    header = ",".join([*names, *(f"unnamed {k}" for k in range(len(more)))])
    raw = under(path, top, header=header, drop=1)
    said = dict(zip(names, units, strict=False))
    monitors = list(dict.fromkeys(n.split("/")[0] for n in names if "/Angular Velocity/" in n))
    stated: dict[str, tuple[str, str | None]] = {"Time": ("time", unit_of(said["Time"]))}
    for kind, triad in TRIADS.items():
        for axis in "XYZ":
            if (name := f"{monitors[0]}/{kind}/{axis}") in raw.columns:
                column(raw, name)
                stated[name] = (f"{triad}_{axis.lower()}", unit_of(said[name].replace("^", "")))
    raw.columns = {n: c for n, c in raw.columns.items() if not n.startswith("unnamed ")}
    raw.stated = stated
    raw.units = {
        n: u for n, said_unit in said.items() if (u := unit_of(said_unit.replace("^", "")))
    }
    return _told(raw, monitors)


def _told(raw: RawLog, monitors: list[str]) -> RawLog:
    if len(monitors) > 1:
        raw.findings.append(
            Finding("io.first-of-monitors", file=raw.name, quantity="gyro", monitors=monitors)
        )
    return raw


def _groups(path: Path) -> dict[str, str]:
    """Return the monitors of an HDF5 file, each with its group; none if it is of another kind."""
    import h5py

    try:
        with h5py.File(path, "r") as file:
            if "Sensors" in file and "FileFormatVersion" in file.attrs:
                return {str(name): f"Sensors/{name}" for name in file["Sensors"]}
            old = [name for name in file if f"{name}/Calibrated/Gyroscopes" in file]
            return {str(name): str(name) for name in old}
    except Exception:  # a damaged file can break the library anywhere
        return {}


def _hdf5(path: Path) -> RawLog:
    groups = _groups(path)
    group = next(iter(groups.values()), "")
    new = group.startswith("Sensors/")
    sets = {t: f"{group}/{n}" if new else f"{group}/Calibrated/{n}s" for t, (n, _) in SETS.items()}
    arrays, _, _ = read_arrays(path, (f"{group}/Time", *sets.values()))
    if f"{group}/Time" not in arrays or sets["gyro"] not in arrays:
        raise lacking(path, "imu", TITLE, [])
    held: dict[str, tuple[Any, str | None]] = {"time": (np.ravel(arrays[f"{group}/Time"]), "us")}
    for triad, name in sets.items():
        if name in arrays:
            block = arrays[name]
            if block.shape != (held["time"][0].size, 3):
                raise DataError(
                    "io.rows-not-those-of-stamps",
                    file=path.name,
                    quantity=triad,
                    size=len(block),
                    count=held["time"][0].size,
                )
            held |= {f"{triad}_{a}": (block[:, k], SETS[triad][1]) for k, a in enumerate("xyz")}
    return _told(RawLog.of(path, held, clock=UNIX), list(groups))

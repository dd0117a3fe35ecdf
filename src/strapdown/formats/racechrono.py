"""RaceChrono CSV (format 3): a table of fixes, laps and sensors of a phone.

``This file is created using RaceChrono …``, lines of a name and a value, then ``timestamp,…``, a
line of units (``unix time``, ``m``, ``deg``, ``G``, ``deg/s``) and one of the sources (``100:
gps``, ``calc``, ``101: acc``, ``102: gyro``). A field is empty where its source has no new value.
Neither the reference of the altitude nor the axes and the sign of the accelerometer are stated.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import DataError
from strapdown.formats.clocks import UNIX
from strapdown.formats.join import join
from strapdown.formats.known_formats import column, lacking, selected, split, stated_by, under
from strapdown.formats.recording import RawLog
from strapdown.formats.signs import Signs, head
from strapdown.units import OF_TABLES, unit_of

TITLE = "RaceChrono CSV"
TRIADS = {"gyro": ("gyro", "{}_rate_of_rotation"), "accel": ("acc", "{}_acc")}
FIXES = {
    "lat": "latitude",
    "lon": "longitude",
    "alt_unstated": "altitude",
    "speed": "speed",
    "course": "bearing",
    "horizontal_accuracy": "accuracy",
}


detect = Signs(text=r"\AThis file is created using RaceChrono")


def read(path: Path) -> RawLog:
    """Read the gyro, with the accelerometer interpolated to its stamps."""
    raw, units = _table(path)
    logs = [log for triad in TRIADS if (log := _sensor(raw, units, triad)) is not None]
    if not logs or "gyro_x" not in logs[0].columns:
        raise lacking(path, "imu", TITLE, ["gnss"] if "latitude gps" in raw.columns else [])
    out = join(logs, path.name, (path,))
    out.clock = UNIX
    return out


def read_fixes(path: Path) -> RawLog:
    """Read the rows with a new position."""
    raw, units = _table(path)
    if not {"latitude gps", "longitude gps"} <= raw.columns.keys():
        raise lacking(path, "gnss", TITLE, ["imu"])
    held: dict[str, tuple[NDArray[Any], str | None]] = {"time": (column(raw, "timestamp"), "s")}
    for quantity, name in FIXES.items():
        if f"{name} gps" in raw.columns:
            held[quantity] = (column(raw, f"{name} gps"), unit_of(units[f"{name} gps"], OF_TABLES))
    log = stated_by(raw, held, clock=UNIX)
    return selected(log, np.isfinite(held["lat"][0] + held["lon"][0]))


def _table(path: Path) -> tuple[RawLog, dict[str, str]]:
    """Return the columns, named with their sources, and their units."""
    lines = head(path, 1 << 16).splitlines()
    top = next((k for k, line in enumerate(lines) if line.startswith("timestamp,")), None)
    if top is None or len(lines) < top + 3 or not lines[top + 1].startswith("unix time"):
        raise DataError("io.racechrono-header", file=path.name, row=(top or 0) + 1)
    names, units, sources = (split(lines[top + k], ",") for k in range(3))
    if not len(names) == len(units) == len(sources):
        raise DataError("io.racechrono-header", file=path.name, row=top + 1)
    full = [
        f"{n} {s.rpartition(':')[2].strip()}".strip() for n, s in zip(names, sources, strict=True)
    ]
    # A name may occur twice, such as device_update_rate of every source.
    raw = under(path, top, header=",".join(f'"{n}"' for n in full), drop=2)
    return raw, dict(zip(raw.columns, units, strict=False))


def _sensor(raw: RawLog, units: dict[str, str], triad: str) -> RawLog | None:
    source, pattern = TRIADS[triad]
    names = [f"{pattern.format(a)} {source}" for a in "xyz"]
    if any(n not in raw.columns for n in names):
        return None
    held: dict[str, tuple[NDArray[Any], str | None]] = {"time": (column(raw, "timestamp"), "s")}
    for axis, name in zip("xyz", names, strict=True):
        unit = unit_of(units[name]) or units[name]
        # At rest some devices write gravity upward, others downward.
        held[f"{triad}_{axis}"] = (column(raw, name), "g or -g" if unit == "g" else unit)
    log = selected(stated_by(raw, held), np.isfinite(held[f"{triad}_x"][0]))
    log.name = f"{raw.name}/{source}"
    return log if log.columns["time"].size else None

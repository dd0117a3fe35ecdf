"""MATLAB Mobile: sensor logs of a phone, as timetables in a ``.mat`` or as CSV.

The application writes timetables ``Acceleration`` (m/s², with gravity), ``AngularVelocity``
(rad/s), ``MagneticField`` (µT) and ``Position`` (degrees, ``altitude`` in m, ``speed`` in m/s,
``course``, ``hacc`` in m) (MathWorks, "Sensor Data Collection with MATLAB Mobile"). MATLAB alone
opens the objects of a ``.mat``; ``writetimetable`` writes each as CSV: ``Timestamp,X,Y,Z`` with
``14-Apr-2021 15:33:42.123`` of a day in no stated time zone. Axes are those of the phone; the
reference of the altitude is not stated: phones with Android give it over the ellipsoid (Android
reference, ``Location.getAltitude``), those with iOS over the sea (Apple, ``CLLocation.altitude``).
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from strapdown.errors import DataError
from strapdown.formats.clocks import RELATIVE
from strapdown.formats.join import join
from strapdown.formats.known_formats import column, lacking, optional, sensor_log, stated_by, under
from strapdown.formats.recording import RawLog
from strapdown.formats.signs import Signs, head

TITLE = "timetables of MATLAB Mobile"
TABLES = {
    "AngularVelocity": ("gyro", "rad/s"),
    "Acceleration": ("accel", "m/s2"),
    "MagneticField": ("mag", "uT"),
}
FIXES: dict[str, tuple[str, str | None]] = {
    "lat": ("latitude", "deg"),
    "lon": ("longitude", "deg"),
    "alt_unstated": ("altitude", "m"),
    "speed": ("speed", "m/s"),
    "course": ("course", "deg"),
    "horizontal_accuracy": ("hacc", "m"),
}
_DATE = "%d-%b-%Y %H:%M:%S.%f"


def _has_tables(folder: Path) -> bool:
    """Whether a folder has tables whose stamps have the months of MATLAB's dates."""
    return any(_table(folder, name) for name in ("AngularVelocity", "Position"))


detect = Signs(folder=_has_tables)


def _has_objects(path: Path) -> bool:
    """Whether there are objects of MATLAB, which nothing else opens."""
    from scipy.io import whosmat

    try:
        return any(kind == "opaque" for _, _, kind in whosmat(path))
    except Exception:  # of another version, or damaged
        return False


detect_objects = Signs(suffixes=(".mat",), also=_has_objects)


def refuse(path: Path) -> RawLog:
    """Refuse objects, and say how they are written as tables."""
    raise DataError("io.matlab-objects", file=path.name)


def _table(path: Path, name: str) -> Path | None:
    """Return the table of a sensor, if its stamps are dates of MATLAB."""
    for file in sorted(path.glob(f"{name}*.csv")):
        lines = head(file, 4096).splitlines()
        if len(lines) > 1 and lines[0].startswith("Timestamp") and lines[1][2:3] == "-":
            return file
    return None


def files_of(path: Path) -> tuple[Path, ...]:
    """List the tables that are read."""
    return tuple(t for name in (*TABLES, "Position") if (t := _table(path, name)))


def read(path: Path) -> RawLog:
    """Read the angular velocity, with the other sensors interpolated to its stamps."""
    logs = []
    for name, (triad, unit) in TABLES.items():
        if (file := _table(path, name)) is not None:
            raw = _dated(file)
            xyz = {a: column(raw, a.upper()) for a in "xyz"}
            held = {"time": raw.columns["Timestamp"], **xyz}
            logs.append(
                sensor_log(
                    f"{path.name}/{file.name}",
                    file,
                    held,
                    triad,
                    unit,
                    time=("time", "ns"),
                    rows=raw.rows,
                    findings=raw.findings,
                )
            )
    if _table(path, "AngularVelocity") is None:
        raise lacking(path, "imu", TITLE, ["gnss"])
    out = join(logs, path.resolve().name)
    out.clock = RELATIVE
    return out


def read_fixes(path: Path) -> RawLog:
    """Read the positions."""
    file = _table(path, "Position")
    if file is None:
        raise lacking(path, "gnss", TITLE, ["imu"])
    raw = _dated(file)
    held: dict[str, Any] = {"time": (raw.columns["Timestamp"], "ns")}
    return stated_by(raw, held | optional(raw, FIXES), clock=RELATIVE)


def _dated(file: Path) -> RawLog:
    """Read a table, with its stamps in ns."""
    # The header has no comma between date and time; the separator is that of the names.
    raw = under(file)
    texts = pd.Series([str(t) for t in raw.columns.get("Timestamp", np.empty(0))])
    texts = texts.where(texts.str.contains(".", regex=False), texts + ".0")
    dates = pd.to_datetime(texts, format=_DATE, errors="coerce")
    bad = np.flatnonzero(dates.isna().to_numpy())
    if bad.size or not len(texts):
        raise DataError(
            "io.not-date-time-like-those",
            file=raw.name,
            row=raw.row(int(bad[0])) if bad.size else 1,
            quantity="time",
            values=texts[bad[0]] if bad.size else "",
            source="Timestamp",
        )
    raw.columns["Timestamp"] = dates.to_numpy().astype("datetime64[ns]").astype(np.int64)
    return raw


__all__ = ["detect", "detect_objects", "files_of", "read", "read_fixes", "refuse"]

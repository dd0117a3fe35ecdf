"""Text files of loggers with a head of their own: VBOX, FlySight 2, Gyroflow.

Each states names and units of its columns; the rows are read as those of any text table.
"""

from __future__ import annotations

import re
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import DataError
from strapdown.formats import csv
from strapdown.formats.clocks import GPS_EPOCH, UNIX, WEEK, leap_seconds
from strapdown.formats.known_formats import column, lacking, selected, stated_by
from strapdown.formats.recording import RawLog
from strapdown.formats.signs import Signs
from strapdown.formats.text_columns import decoded
from strapdown.tables.checks import Array
from strapdown.units import OF_TABLES, SPEEDS, unit_of


def _lines(path: Path) -> list[str]:
    text, _ = decoded(path.read_bytes(), path.name)
    return text.splitlines()


def _table(path: Path, rows: list[tuple[int, str]], names: str) -> RawLog:
    """Read rows, each with its line in the file, as a text table under these names."""
    if not rows:
        raise DataError("io.csv-without-rows", file=path.name, row=1)
    text = "\n".join([names, *(line for _, line in rows)])
    raw = csv.parse(text.encode(), path.name, (path,))
    if raw.rows is not None:
        raw.rows = np.array([rows[k - 2][0] for k in raw.rows], dtype=np.int64)
    return raw


# VBO of Racelogic (VBOX, Performance Box, and programs that imitate them): sections in square
# brackets; ``[column names]`` names the fields of ``[data]``, separated by blanks.
#
# ``time`` is UTC as HHMMSS.SS, ``lat`` and ``long`` are minutes, ``long`` positive to the west;
# ``velocity`` is in km/h unless the section ``[header]`` has it in knots or mph. ``sats`` has 64
# added for a differential fix and 128 for a pressed brake (Racelogic, VBO file format). The level
# of ``height`` is not stated. The date is that of the line ``File created on``, in local time.


VBO_TITLE = "VBO of Racelogic"
_CREATED = re.compile(r"File created on (\d\d)/(\d\d)/(\d{4})(?: (?:at|@) (\d\d):(\d\d))?", re.I)
_DAY = 86_400.0
_DIGITS = "digits"
_MINUTES, _DIFFERENTIAL, _SATELLITES = 1.0 / 60.0, 64, 63


detect_vbo = Signs(
    text=r"^\[column names\][ \t]*\r?$", also=lambda p: "[data]" in " ".join(_lines(p))
)


def read_vbo_fixes(path: Path) -> RawLog:
    """Read the fixes; rows without satellites are left out."""
    lines = [line.strip() for line in _lines(path)]
    names = next((lines[k + 1] for k, n in enumerate(lines[:-1]) if n == "[column names]"), "")
    begin = lines.index("[data]") + 1
    rows = [(k, line) for k, line in enumerate(lines[begin:], begin + 1) if line]
    # Under the name of a clock the digits of a time of day would be read as one already.
    words = [_DIGITS if name == "time" else name for name in names.lower().split()]
    raw = _table(path, rows, " ".join(words))
    seconds, days = _day_of_vbo(raw, lines)
    held: dict[str, tuple[NDArray[Any], str | None]] = {
        "time": (seconds + days, "s"),
        "lat": (column(raw, "lat") * _MINUTES, "deg"),
        "lon": (column(raw, "long") * -_MINUTES, "deg"),
    }
    if "height" in raw.columns:
        held["alt_unstated"] = (column(raw, "height"), "m")
    if "velocity" in raw.columns:
        head = next((n for n in lines if n.lower().startswith("velocity ")), "velocity kmh")
        unit = unit_of(head.split()[1].strip("()[]"), OF_TABLES)
        held["speed"] = (column(raw, "velocity"), unit if unit in SPEEDS else "km/h")
    if "heading" in raw.columns:
        held["course"] = (column(raw, "heading"), "deg")
    count = column(raw, "sats").astype(np.int64) if "sats" in raw.columns else None
    if count is not None:
        held["quality"] = (np.where(count & _DIFFERENTIAL, 2.0, 1.0), None)
    log = stated_by(raw, held, clock=UNIX if days else None)
    fixed = np.isfinite(held["lat"][0]) & (np.abs(held["lat"][0]) + np.abs(held["lon"][0]) > 0.0)
    return selected(log, fixed if count is None else fixed & (count & _SATELLITES > 0))


def read_vbo(path: Path) -> RawLog:
    """Refuse: channels of inertial sensors have no stated axes in this format."""
    raise lacking(path, "imu", VBO_TITLE, ["gnss"])


def _day_of_vbo(raw: RawLog, lines: list[str]) -> tuple[Array, float]:
    """Return the seconds of the day, counted on past midnight, and the begin of that day.

    The day is the one by which the first row is nearest to the creation of the file, whose clock
    is local; 0 if that is not stated.
    """
    stamps = column(raw, _DIGITS).astype(np.float64)
    hours, rest = np.divmod(stamps, 10_000.0)
    minutes, seconds = np.divmod(rest, 100.0)
    of_day = hours * 3600.0 + minutes * 60.0 + seconds
    of_day = of_day + _DAY * np.concatenate([[0.0], np.cumsum(np.diff(of_day) < -0.5 * _DAY)])
    made = next((m for line in lines if (m := _CREATED.match(line))), None)
    if made is None:
        return of_day, 0.0
    day, month, year, hour, minute = (int(part or 0) for part in made.groups())
    try:
        created = datetime(year, month, day, min(hour, 23), minute % 60, tzinfo=UTC).timestamp()
    except ValueError:
        return of_day, 0.0
    return of_day, _DAY * float(np.round((created - of_day[0]) / _DAY))


# SENSOR.CSV and TRACK.CSV of FlySight 2: ``$COL,KIND,names`` and ``$UNIT,KIND,units`` declare the
# rows ``$KIND,values`` that follow ``$DATA``. Stamps of the sensors count on a clock of the device;
# a row of the kind TIME has that stamp with GPS week and seconds of the week.


FLYSIGHT_TITLE = "FlySight 2"


detect_flysight = Signs(text=r"\A\$FLYS,\d")


def _of_kind(path: Path, kind: str, stream: str) -> RawLog:
    """Return the rows of one kind, under the names and units that the file declares."""
    lines = _lines(path)
    declared = {tuple(f[:2]): f[2:] for f in (line.split(",") for line in lines) if f[0] != "$DATA"}
    names, mark = declared.get(("$COL", kind)), f"${kind},"
    rows = [
        (k, line.removeprefix(mark)) for k, line in enumerate(lines, 1) if line.startswith(mark)
    ]
    if names is None or not rows:
        has = [s for s, k in (("imu", "IMU"), ("gnss", "GNSS")) if ("$COL", k) in declared]
        raise lacking(path, stream, FLYSIGHT_TITLE, has)
    raw = _table(path, rows, ",".join(names))
    units = declared.get(("$UNIT", kind), [])
    raw.units |= {n: u for n, u in zip(raw.columns, units, strict=False) if u}
    return raw


def read_flysight(path: Path) -> RawLog:
    """Read the rows of the inertial unit, on UTC where rows of the kind TIME state it."""
    raw = _of_kind(path, "IMU", "imu")
    try:
        told = _of_kind(path, "TIME", "imu")
    except DataError:
        return raw
    since_start, tow, week = (column(told, n) for n in ("time", "tow", "week"))
    gps = GPS_EPOCH + WEEK * week.astype(np.float64) + tow
    raw.epoch = float(np.median(gps - leap_seconds(gps) - since_start))
    raw.clock = UNIX
    return raw


def read_flysight_fixes(path: Path) -> RawLog:
    """Read the fixes of TRACK.CSV; heights are over the sea."""
    return _of_kind(path, "GNSS", "gnss")


# GCSV of Gyroflow, an open format for loggers beside a camera: lines ``key,value``, then
# ``t,gx,gy,gz`` with ``ax,ay,az`` and ``mx,my,mz`` or without, in counts; ``tscale`` are s,
# ``gscale`` rad/s and ``ascale`` g of one (docs.gyroflow.xyz, GCSV format). Its ``orientation``
# turns the sensor's axes to those of a picture, not to those of a body.


GYROFLOW_TITLE = "GCSV of Gyroflow"
_SCALES = {"tscale": "t", "gscale": "gyro", "ascale": "accel"}
_OF_ONE = {"gyro": "rad/s", "accel": "g"}


detect_gyroflow = Signs(text=r"\A(?:GYROFLOW IMU LOG|CAMERA IMU LOG)")


def read_gyroflow(path: Path) -> RawLog:
    """Read the samples in counts, with the values of a count."""
    lines = _lines(path)
    begin = next((k for k, line in enumerate(lines) if re.match(r"t,gx,gy,gz\b", line)), None)
    if begin is None:
        raise DataError("io.csv-without-rows", file=path.name, row=len(lines))
    keys = dict(line.split(",", 1) for line in lines[:begin] if "," in line)
    raw = _table(path, [*enumerate(lines[begin + 1 :], begin + 2)], lines[begin].strip())
    scales = {what: _positive(keys.get(key, "")) for key, what in _SCALES.items()}
    raw.columns["t"] = column(raw, "t") * (scales["t"] or 1.0)
    raw.units["t"] = "s"
    raw.triad_units = {triad: f"{scales[triad] or 1.0!r} {unit}" for triad, unit in _OF_ONE.items()}
    return raw


def _positive(text: str) -> float | None:
    try:
        value = float(text)
    except ValueError:
        return None
    return value if 0.0 < value < np.inf else None


# Messages of a CAN bus, whose signals only its database (.dbc) tells apart: candump of can-utils
# (both forms), ``.asc`` of Vector, ``.trc`` of PEAK, BUSMASTER, CSV of python-can and SavvyCAN.


detect_can = Signs(
    text=r"(?i)\A(?:\s*(?:\([\d.:\- ]+\)\s+)?[a-z]+\d+\s+[0-9A-F]{3,8}(?:#|\s+\[\d+\])"
    r"|date .*\s+base (?:hex|dec)|;\$FILEVERSION|\*{3}BUSMASTER"
    r"|time ?stamp,(?:arbitration_)?id,extended)"
)


def refuse_can(path: Path) -> RawLog:
    """Refuse messages whose signals are not decoded."""
    what, way = "a log of a CAN bus", "its signals, decoded by cantools or asammdf, as CSV"
    raise DataError("io.foreign-format", file=path.name, what=what, way=way)

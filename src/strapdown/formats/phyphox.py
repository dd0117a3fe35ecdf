"""phyphox (RWTH Aachen): CSV export as a file, or as a zip or folder with one CSV per sensor.

Column names state quantity and unit, as in ``"Time (s)","Gyroscope x (rad/s)"``; separator and
decimal sign are as chosen at the export. ``meta/time.csv`` has the starts and pauses. Units and the
meaning of the sensors are those of https://github.com/phyphox/phyphox-docs,
docs/file-format/input.md: gyroscope in rad/s, accelerometer in m/s² with gravity (9.81 when
stationary), linear acceleration without it, magnetic field in µT, pressure in hPa; axes are
Android's. Custom experiments write ``"X (rad/s)"`` in ``Gyroscope.csv``, ``Accelerometer.csv``,
``Linear Accelerometer.csv`` and ``Magnetometer.csv``. ``Location.csv`` has fixes; ``Height (m)`` is
over the geoid EGM84 (component ``z``), accuracies are radii of the system, and -1 is an unknown
velocity or direction.
"""

from __future__ import annotations

import re
from functools import partial
from pathlib import Path

import numpy as np

from strapdown.errors import DataError, Finding, add_warning
from strapdown.formats import csv
from strapdown.formats.clocks import RELATIVE
from strapdown.formats.columns import read_name
from strapdown.formats.join import join
from strapdown.formats.known_formats import AXES, XYZ, lacking
from strapdown.formats.recording import RawLog
from strapdown.formats.sensor_folder import (
    Member,
    file_member,
    first_line,
    is_container,
    members_of,
    peek,
)
from strapdown.formats.signs import Signs
from strapdown.tables import ACCEL, GYRO

_TIME = re.compile(r"time \(s\)", re.I)
_TRIADS = {
    "gyro": (re.compile(r"gyroscope ([xyz]) \(rad/s\)", re.I), "rad/s"),
    "accel": (re.compile(r"acceleration ([xyz]) \(m/s(?:\^2|²|2)\)", re.I), "m/s2"),
    "mag": (re.compile(r"magnetic field ([xyz]) \([µμu]T\)", re.I), "uT"),
}
_LINEAR = re.compile(r"linear acceleration ([xyz]) \(m/s(?:\^2|²|2)\)", re.I)
# Custom experiments name the axis alone; the sensor is the name of the table.
_PLAIN = re.compile(r"([xyz]) \((rad/s|m/s(?:\^2|²|2)|[µμu]T)\)", re.I)
_TABLES = {"gyroscope": "gyro", "accelerometer": "accel", "magnetometer": "mag"}
_LINEARS = ("linear accelerometer", "linear acceleration")
_FIXES = {
    "lat": (re.compile(r"latitude \(°\)", re.I), "deg"),
    "lon": (re.compile(r"longitude \(°\)", re.I), "deg"),
    "alt_msl": (re.compile(r"height \(m\)", re.I), "m"),
    "speed": (re.compile(r"velocity \(m/s\)", re.I), "m/s"),
    "course": (re.compile(r"direction \(°\)", re.I), "deg"),
    "horizontal_accuracy": (re.compile(r"horizontal accuracy \(m\)", re.I), "m"),
    # Written with the sign of degrees by mistake.
    "vertical_accuracy": (re.compile(r"vertical accuracy \((m|°)\)", re.I), "m"),
}
_PRESSURE = {"pressure": (re.compile(r"pressure \(hPa\)", re.I), "hPa")}
_STREAMS = {"gnss": _FIXES, "barometer": _PRESSURE}
TITLE = "recording of phyphox"
_EVENTS = "meta/time.csv"
INERTIAL = (*GYRO, *ACCEL)


def _has_sensor(path: Path) -> bool:
    """Whether a header has stamps and a sensor named as in phyphox."""
    members = peek(path)
    if not is_container(path):
        members = [file_member(path)]
        # A table that others wrote has names and units of its own beside some of phyphox.
        names = [n for m in members for n in _fields(m) if str(read_name(n).quantity) in INERTIAL]
        own = (_TRIADS["gyro"][0], _TRIADS["accel"][0], _LINEAR, _PLAIN)
        if not all(any(p.fullmatch(n) for p in own) for n in names):
            return False
    return any(_sensors(m) or _stream_of(m) for m in members)


detect = Signs(
    suffixes=csv.SUFFIXES,
    text=r"(?i)\A\s*+.*time \(s\)",
    also=_has_sensor,
    folder=_has_sensor,
    zipped=True,
)


def read(path: Path) -> RawLog:
    """Read gyro, specific force and magnetic field, joined on the stamps of the gyro."""
    name = path.resolve().name
    members = _members(path)
    logs, files, findings = [], [], []
    for member in members:
        if member.name.endswith(_EVENTS):
            files.append(member.file)
            findings += _pauses(member)
        elif _sensors(member):
            files.append(member.file)
            logs.append(_log(member))
    if not logs:
        raise lacking(path, "imu", TITLE, filter(None, map(_stream_of, members)))
    unique = tuple(dict.fromkeys(files))
    raw = join(_mention_linear(logs), name, unique, rows_of_member=True)
    raw.findings[:0] = findings
    return raw


def _read_stream(path: Path, stream: str) -> RawLog:
    members = _members(path)
    member = next((m for m in members if _stream_of(m) == stream), None)
    if member is None:
        there = [s for m in members if (s := _stream_of(m))]
        there += ["imu"] * any(_sensors(m) for m in members)
        raise lacking(path, stream, TITLE, there)
    raw = csv.parse(member.read(), member.label, (member.file,))
    stated: dict[str, tuple[str, str | None]] = {}
    for column in raw.columns:
        if _TIME.fullmatch(column):
            stated[column] = ("time", "s")
        for quantity, (pattern, unit) in _STREAMS[stream].items():
            if pattern.fullmatch(column):
                stated[column] = (quantity, unit)
    raw.stated, raw.clock = stated, RELATIVE
    return raw


read_fixes = partial(_read_stream, stream="gnss")
read_barometer = partial(_read_stream, stream="barometer")


def _members(path: Path) -> list[Member]:
    if path.is_dir() or path.suffix.lower() == ".zip":
        return members_of(path)
    return [file_member(path)]


def _fields(member: Member) -> list[str]:
    """Return the names of the columns, if the table has stamps of phyphox."""
    if member.suffix not in csv.SUFFIXES:
        return []
    fields = [f.strip().strip('"') for f in re.split(r"[\t;,]", first_line(member))]
    return fields if any(_TIME.fullmatch(f) for f in fields) else []


def _sensors(member: Member) -> bool:
    fields = _fields(member)
    plain = member.stem.lower() in (*_TABLES, *_LINEARS)
    patterns = [p for p, _ in _TRIADS.values()] + [_LINEAR] + [_PLAIN] * plain
    return any(p.fullmatch(f) for f in fields for p in patterns)


def _stream_of(member: Member) -> str | None:
    """Return the stream of a table with anything but one of the three sensors."""
    fields = _fields(member)
    for stream, known in _STREAMS.items():
        needed = ("lat", "lon") if stream == "gnss" else tuple(known)
        if all(any(known[q][0].fullmatch(f) for f in fields) for q in needed):
            return stream
    return None


def _log(member: Member) -> RawLog:
    raw = csv.parse(member.read(), member.label, (member.file,))
    stated: dict[str, tuple[str, str | None]] = {}
    for column in raw.columns:
        if _TIME.fullmatch(column):
            stated[column] = ("time", "s")
        for triad, (pattern, unit) in _TRIADS.items():
            if match := pattern.fullmatch(column):
                stated[column] = (f"{triad}_{match[1].lower()}", unit)
        table = _TABLES.get(member.stem.lower())
        if table and (match := _PLAIN.fullmatch(column)):
            stated[column] = (f"{table}_{match[1].lower()}", _TRIADS[table][1])
    raw.stated, raw.axes = stated, AXES
    return raw


def _mention_linear(logs: list[RawLog]) -> list[RawLog]:
    """Note that tables without any of the three sensors are not used."""
    wanted = {f"{triad}_{a}" for triad in _TRIADS for a in XYZ}
    for log in logs:
        if not any(q in wanted for q, _ in log.stated.values()):
            log.warn("io.left-out-acceleration-without-gravity", quantity="accel")
    return logs


def _pauses(member: Member) -> list[Finding]:
    """Report pauses of the recording, during which its clock was stopped."""
    try:
        table = csv.parse(member.read(), member.label, (member.file,)).columns
        events = [str(e).strip('"') for e in table["event"]]
        clock = np.asarray(table["experiment time"], dtype=np.float64)
        wall = np.asarray(table["system time"], dtype=np.float64)
    except (DataError, KeyError, ValueError, TypeError):
        return [Finding("io.left-out-no-starts-pauses", file=member.label, severity="note")]
    out: list[Finding] = []
    for k in range(1, len(events)):
        if events[k - 1] == "PAUSE" and events[k] == "START":
            add_warning(
                out,
                "io.recording-paused",
                file=member.label,
                row=k + 2,
                quantity="time",
                wall=wall[k] - wall[k - 1],
                clock=clock[k],
            )
    return out

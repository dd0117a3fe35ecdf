"""MicroStrain CSV (MIP Monitor, SensorConnect): lines about the session, ``DATA_START``, a table.

``GPS TFlags, GPS Week, GPS TOW, X Accel [x8004], …``: numbers in brackets are the fields of the MIP
protocol (MicroStrain MIP data reference, set 0x80): 0x8004 scaled acceleration in g, 0x8005 rates
in rad/s, 0x8006 magnetic field in gauss, 0x8007 and 0x8008 increments in rad and g s, 0x8017
pressure in mbar. SensorConnect and MSCL name the same channels ``scaledAccelX``, ``scaledGyroX``,
``deltaThetaX``, ``deltaVelX`` …; in files of SensorConnect the name of the node goes before, and
``Time`` has dates. Axes are those printed on the unit.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import DataError
from strapdown.formats.clocks import GPS, UNIX, WEEK
from strapdown.formats.known_formats import column, lacking, stated_by, under
from strapdown.formats.recording import RawLog
from strapdown.formats.signs import Signs, head

TITLE = "MicroStrain CSV"
START = "DATA_START"
FIELDS = {
    "gyro": (re.compile(r"([XYZ]) Gyro \[x8005\]|.*scaledGyro([XYZ])"), "rad/s"),
    "accel": (re.compile(r"([XYZ]) Accel \[x8004\]|.*scaledAccel([XYZ])"), "g"),
    "mag": (re.compile(r"([XYZ]) Mag \[x8006\]|.*scaledMag([XYZ])"), "gauss"),
}
SUMS = {
    "gyro": (
        re.compile(r"(?:([XYZ]) )?Delta Theta(?: ([XYZ]))? \[x8007\]|.*deltaTheta([XYZ])"),
        "rad",
    ),
    "accel": (
        re.compile(r"(?:([XYZ]) )?Delta Vel(?: ([XYZ]))? \[x8008\]|.*deltaVel([XYZ])"),
        "g*s",
    ),
}
PRESSURE = re.compile(r"(?:Ambient )?Pressure \[x8017\]|.*scaledAmbientPressure")


detect = Signs(text=rf"^[ ,;\r]*{START}[ ,;\r]*$")


def _top(path: Path) -> int | None:
    lines = head(path, 1 << 16).splitlines()
    return next((k + 1 for k, line in enumerate(lines) if line.strip(" ,;\r") == START), None)


def read(path: Path) -> RawLog:
    """Read rates and specific force, or increments where the file has those alone."""
    raw = under(path, _top(path) or 0)
    for fields in (FIELDS, {**FIELDS, **SUMS}):
        stated = _stated(raw, fields)
        if {f"gyro_{a}" for a in "xyz"} <= {quantity for quantity, _ in stated.values()}:
            time, raw.clock = _time(raw)
            for name in stated:
                column(raw, name)
            raw.columns["time"], unit = time["time"]
            raw.stated = {"time": ("time", unit), **stated}
            raw.sampling = None if fields is FIELDS else "mean"
            return raw
    raise lacking(path, "imu", TITLE, ["barometer"] if _pressure(raw) else [])


def read_barometer(path: Path) -> RawLog:
    """Read the pressure."""
    raw = under(path, _top(path) or 0)
    time, clock = _time(raw)
    if (name := _pressure(raw)) is None:
        raise lacking(path, "barometer", TITLE, ["imu"] if _stated(raw, FIELDS) else [])
    return stated_by(raw, time | {"pressure": (column(raw, name), "mbar")}, clock=clock)


def _pressure(raw: RawLog) -> str | None:
    return next((name for name in raw.columns if PRESSURE.fullmatch(name)), None)


def _stated(raw: RawLog, fields: dict[str, Any]) -> dict[str, tuple[str, str | None]]:
    """Return the columns of the sensors; their names distinguish increments from rates."""
    stated: dict[str, tuple[str, str | None]] = {}
    for name in raw.columns:
        for triad, (pattern, unit) in fields.items():
            match = pattern.fullmatch(name)
            axis = next((g for g in match.groups() if g), None) if match else None
            if axis is not None:
                stated[name] = (f"{triad}_{axis.lower()}", unit)
    return stated


def _time(raw: RawLog) -> tuple[dict[str, tuple[NDArray[Any], str | None]], str]:
    if {"GPS Week", "GPS TOW"} <= raw.columns.keys():
        week, tow = column(raw, "GPS Week"), column(raw, "GPS TOW")
        return {"time": (np.asarray(tow + WEEK * (week - week[0])), "s")}, GPS
    if "Time" in raw.columns:
        return {"time": (raw.columns["Time"], None)}, UNIX
    raise DataError("io.microstrain-without-stamps", file=raw.name, quantity="time")

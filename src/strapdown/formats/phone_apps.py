"""Recordings of applications on phones: Core Motion, Physics Toolbox, MATLAB Mobile, RaceChrono."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.constants import STANDARD_GRAVITY
from strapdown.errors import DataError, add_note
from strapdown.formats import csv
from strapdown.formats.clocks import RELATIVE, UNIX
from strapdown.formats.columns import read_name
from strapdown.formats.hdf5 import contents_of_matlab
from strapdown.formats.join import join
from strapdown.formats.known_formats import (
    AXES,
    column,
    lacking,
    names_of,
    optional,
    selected,
    sensor_log,
    stated_by,
    under,
)
from strapdown.formats.recording import RawLog
from strapdown.formats.signs import Signs, head
from strapdown.formats.text_columns import fields_of
from strapdown.units import OF_TABLES, unit_of

# Tables of Core Motion (iOS, watchOS): rotation rate, gravity and user acceleration apart.
#
# Names are those of CMDeviceMotion, in the spellings of applications and data sets:
# ``rotationRate.x``, ``motionRotationRateX``, ``rotation_rate_x(radians/s)``;
# ``userAcceleration.x``, ``user_acc_x(G)``; ``gravity.x``, ``gravity_x(G)``. Apple documents
# rad/s, and gravity and user acceleration in units of gravity, the sign opposite to specific
# force: a phone on its back has gravity -z. The length of gravity shows where an application
# converted it to m/s². Specific force is minus the sum of both.


WORDS = {
    "gyro": ("rotationrate", "motionrotationrate", "rotrate"),
    "gravity": ("gravity", "motiongravity", "grav"),
    "user": ("useracceleration", "motionuseracceleration", "useracc", "useraccel"),
}


# The first line names the three vectors.
detect_core_motion = Signs(
    text=r"(?i)\A.*grav", also=lambda path: csv.detect(path) and len(_named(names_of(path))) == 9
)


def _named(names: list[str]) -> dict[str, str]:
    """Return the columns of the vectors, by vector and axis."""
    found = {}
    for name in names:
        word = re.sub(r"[(\[].*|[^a-z]", "", name.lower())
        for vector, words in WORDS.items():
            if word[:-1] in words and word[-1] in "xyz":
                found[f"{vector}_{word[-1]}"] = name
    return found


def read_core_motion(path: Path) -> RawLog:
    """Read the rates, and specific force from gravity and user acceleration."""
    raw = under(path)
    named = _named(list(raw.columns))
    missing = [f"{v}_{a}" for v in WORDS for a in "xyz" if f"{v}_{a}" not in named]
    if missing:
        names = ", ".join(raw.columns)
        raise DataError("io.no-column-4", file=path.name, missing=missing, columns=names)
    return with_force_summed(raw)


def with_force_summed(raw: RawLog) -> RawLog:
    """Return a table of Core Motion with its specific force; any other table as it is.

    DataError: a value is not a number.
    """
    named = _named(list(raw.columns))
    if len(named) < 9:
        return raw
    gyro, gravity, user = (
        np.column_stack([column(raw, named[f"{v}_{a}"]) for a in "xyz"]) for v in WORDS
    )
    length = float(np.nanmedian(np.linalg.norm(gravity, axis=1)))
    # Standardized applications turn the sign together with the unit.
    units = {"-g": 1.0, "m/s2 or -m/s2": STANDARD_GRAVITY}
    unit = next((u for u, g in units.items() if abs(length / g - 1.0) < 0.02), None)
    held: dict[str, tuple[NDArray[Any], str | None]] = {}
    # As in timestamp(unix).
    said = {n: (read_name(n), read_name(n.partition("(")[0])) for n in raw.columns}
    times = {n: s for n, both in said.items() for s in both if s.quantity == "time"}
    if times:
        best = next((n for n, s in times.items() if s.unit), next(iter(times)))
        held["time"] = (raw.columns[best], times[best].unit)
    for k, axis in enumerate("xyz"):
        held[f"gyro_{axis}"] = (gyro[:, k], "rad/s")
        held[f"accel_{axis}"] = (gravity[:, k] + user[:, k], unit)
    log = stated_by(raw, held, axes=AXES)
    add_note(
        log.findings,
        "io.force-summed",
        file=raw.name,
        quantity="accel",
        linear=named["user_x"],
        gravity=named["gravity_x"],
        distance=0.0,
    )
    return log


# Physics Toolbox Sensor Suite (Vieyra Software): CSV of several sensors of a phone.
#
# ``time``, ``gFx, gFy, gFz`` (g-force: the accelerometer over 9.81 m/s², with gravity), ``ax, ay,
# az`` (linear acceleration in m/s², without it), ``wx, wy, wz`` in rad/s, ``Bx, By, Bz`` in µT,
# ``p`` in hPa (https://www.vieyrasoftware.net, "Multi record"). ``time`` is in seconds from the
# start, or the time of day with a fourth part of milliseconds. Axes are those of the phone; the
# sign of the g-force differs between its systems and is inferred from the numbers.


PHYSICS_TOOLBOX_TITLE = "recording of Physics Toolbox"
QUANTITIES: dict[str, tuple[str, str | None]] = {f"gyro_{a}": (f"w{a}", "rad/s") for a in "xyz"}
QUANTITIES |= {f"accel_{a}": (f"gF{a}", "g or -g") for a in "xyz"}
QUANTITIES |= {f"mag_{a}": (f"B{a}", "uT") for a in "xyz"}


# No other application has these names of the g-force.
detect_physics_toolbox = Signs(
    text=r'\A[\s"]*time\b(?=.*\bgFx\b)(?=.*\bgFy\b)(?=.*\bgFz\b)', also=csv.detect
)


def read_physics_toolbox(path: Path) -> RawLog:
    """Read rates, specific force and magnetic field."""
    raw = under(path)
    held = optional(raw, QUANTITIES)
    if "gyro_x" not in held:
        raise lacking(
            path, "imu", PHYSICS_TOOLBOX_TITLE, ["barometer"] if "p" in raw.columns else []
        )
    log = stated_by(raw, {"time": (_time(raw), "s"), **held}, axes=AXES, clock=RELATIVE)
    if "ax" in raw.columns:
        add_note(
            log.findings,
            "io.linear-acceleration-not-used",
            file=path.name,
            quantity="accel",
            source="ax, ay, az",
        )
    return log


def read_physics_toolbox_barometer(path: Path) -> RawLog:
    """Read the pressure."""
    raw = under(path)
    if "p" not in raw.columns:
        raise lacking(
            path, "barometer", PHYSICS_TOOLBOX_TITLE, ["imu"] if "wx" in raw.columns else []
        )
    held = {"time": (_time(raw), "s"), "pressure": (column(raw, "p"), "hPa")}
    return stated_by(raw, held, clock=RELATIVE)


def _time(raw: RawLog) -> NDArray[np.float64]:
    """Return seconds; times of day as ``10:11:12:345`` count on over midnight."""
    values = raw.columns["time"]
    if values.dtype.kind in "iuf" or ":" not in str(values[0]):
        return column(raw, "time").astype(np.float64)
    out = np.empty(values.size)
    for k, text in enumerate(values):
        parts = str(text).replace(",", ".").split(":")
        try:
            hours, minutes, seconds = (float(p) for p in parts[:3])
            out[k] = (
                3600 * hours + 60 * minutes + seconds + float(f"0.{parts[3]}" if parts[3:] else 0)
            )
        except ValueError:
            raise raw.fault(
                "io.value-not-a-number", "time", sample=k, values=text, source="time"
            ) from None
    return np.asarray(out + 86400.0 * np.cumsum(np.diff(out, prepend=out[0]) < -43200.0))


# MATLAB Mobile: sensor logs of a phone, as timetables in a ``.mat`` or as CSV.
#
# The application writes timetables ``Acceleration`` (m/s², with gravity), ``AngularVelocity``
# (rad/s), ``MagneticField`` (µT) and ``Position`` (degrees, ``altitude`` in m, ``speed`` in m/s,
# ``course``, ``hacc`` in m) (MathWorks, "Sensor Data Collection with MATLAB Mobile"). MATLAB
# alone opens the objects of a ``.mat``; ``writetimetable`` writes each as CSV:
# ``Timestamp,X,Y,Z`` with ``14-Apr-2021 15:33:42.123`` of a day in no stated time zone. Axes are
# those of the phone; the reference of the altitude is not stated: phones with Android give it
# over the ellipsoid (Android reference, ``Location.getAltitude``), those with iOS over the sea
# (Apple, ``CLLocation.altitude``).


MATLAB_MOBILE_TITLE = "timetables of MATLAB Mobile"
TABLES = {
    "AngularVelocity": ("gyro", "rad/s"),
    "Acceleration": ("accel", "m/s2"),
    "MagneticField": ("mag", "uT"),
}
MATLAB_MOBILE_FIXES: dict[str, tuple[str, str | None]] = {
    "lat": ("latitude", "deg"),
    "lon": ("longitude", "deg"),
    "alt_unstated": ("altitude", "m"),
    "speed": ("speed", "m/s"),
    "course": ("course", "deg"),
    "horizontal_accuracy": ("hacc", "m"),
}
_DATE = "%d-%b-%Y %H:%M:%S.%f"


# Tables whose stamps have the months of MATLAB's dates.
detect_matlab_mobile = Signs(
    folder=lambda path: any(
        _table_of_matlab_mobile(path, name) for name in ("AngularVelocity", "Position")
    )
)


# Objects of MATLAB, which nothing else opens.
detect_matlab_mobile_objects = Signs(
    suffixes=(".mat",),
    also=lambda path: any(kind == "opaque" for _, kind in contents_of_matlab(path)),
)


def refuse_matlab_mobile(path: Path) -> RawLog:
    """Refuse objects, and say how they are written as tables."""
    raise DataError("io.matlab-objects", file=path.name)


def _table_of_matlab_mobile(path: Path, name: str) -> Path | None:
    """Return the table of a sensor, if its stamps are dates of MATLAB."""
    for file in sorted(path.glob(f"{name}*.csv")):
        lines = head(file, 4096).splitlines()
        if len(lines) > 1 and lines[0].startswith("Timestamp") and lines[1][2:3] == "-":
            return file
    return None


def files_of_matlab_mobile(path: Path) -> tuple[Path, ...]:
    """List the tables that are read."""
    return tuple(t for name in (*TABLES, "Position") if (t := _table_of_matlab_mobile(path, name)))


def read_matlab_mobile(path: Path) -> RawLog:
    """Read the angular velocity, with the other sensors interpolated to its stamps."""
    logs = []
    for name, (triad, unit) in TABLES.items():
        if (file := _table_of_matlab_mobile(path, name)) is not None:
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
    if _table_of_matlab_mobile(path, "AngularVelocity") is None:
        raise lacking(path, "imu", MATLAB_MOBILE_TITLE, ["gnss"])
    out = join(logs, path.resolve().name)
    out.clock = RELATIVE
    return out


def read_matlab_mobile_fixes(path: Path) -> RawLog:
    """Read the positions."""
    file = _table_of_matlab_mobile(path, "Position")
    if file is None:
        raise lacking(path, "gnss", MATLAB_MOBILE_TITLE, ["imu"])
    raw = _dated(file)
    held: dict[str, Any] = {"time": (raw.columns["Timestamp"], "ns")}
    return stated_by(raw, held | optional(raw, MATLAB_MOBILE_FIXES), clock=RELATIVE)


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


# RaceChrono CSV (format 3): a table of fixes, laps and sensors of a phone.
#
# ``This file is created using RaceChrono …``, lines of a name and a value, then ``timestamp,…``,
# a line of units (``unix time``, ``m``, ``deg``, ``G``, ``deg/s``) and one of the sources (``100:
# gps``, ``calc``, ``101: acc``, ``102: gyro``). A field is empty where its source has no new
# value. Neither the reference of the altitude nor the axes and the sign of the accelerometer are
# stated.


RACECHRONO_TITLE = "RaceChrono CSV"
TRIADS = {"gyro": ("gyro", "{}_rate_of_rotation"), "accel": ("acc", "{}_acc")}
RACECHRONO_FIXES = {
    "lat": "latitude",
    "lon": "longitude",
    "alt_unstated": "altitude",
    "speed": "speed",
    "course": "bearing",
    "horizontal_accuracy": "accuracy",
}


detect_racechrono = Signs(text=r"\AThis file is created using RaceChrono")


def read_racechrono(path: Path) -> RawLog:
    """Read the gyro, with the accelerometer interpolated to its stamps."""
    raw, units = _table_of_racechrono(path)
    logs = [log for triad in TRIADS if (log := _sensor(raw, units, triad)) is not None]
    if not logs or "gyro_x" not in logs[0].columns:
        raise lacking(
            path, "imu", RACECHRONO_TITLE, ["gnss"] if "latitude gps" in raw.columns else []
        )
    out = join(logs, path.name, (path,))
    out.clock = UNIX
    return out


def read_racechrono_fixes(path: Path) -> RawLog:
    """Read the rows with a new position."""
    raw, units = _table_of_racechrono(path)
    if not {"latitude gps", "longitude gps"} <= raw.columns.keys():
        there = ["imu"] * (_sensor(raw, units, "gyro") is not None)
        raise lacking(path, "gnss", RACECHRONO_TITLE, there)
    held: dict[str, tuple[NDArray[Any], str | None]] = {"time": (column(raw, "timestamp"), "s")}
    for quantity, name in RACECHRONO_FIXES.items():
        if f"{name} gps" in raw.columns:
            held[quantity] = (column(raw, f"{name} gps"), unit_of(units[f"{name} gps"], OF_TABLES))
    log = stated_by(raw, held, clock=UNIX)
    return selected(log, np.isfinite(held["lat"][0] + held["lon"][0]))


def _table_of_racechrono(path: Path) -> tuple[RawLog, dict[str, str]]:
    """Return the columns, named with their sources, and their units."""
    lines = head(path, 1 << 16).splitlines()
    top = next((k for k, line in enumerate(lines) if line.startswith("timestamp,")), None)
    if top is None or len(lines) < top + 3 or not lines[top + 1].startswith("unix time"):
        raise DataError("io.racechrono-header", file=path.name, row=(top or 0) + 1)
    names, units, sources = (fields_of(lines[top + k], ",") for k in range(3))
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

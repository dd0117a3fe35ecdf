"""SensorLog of iPhones, iPads and Apple Watches: one wide table, iOS names with units.

Names are ``motionRotationRateX(rad/s)``, ``accelerometerAccelerationX(G)``,
``motionUserAccelerationX(G)``, ``motionGravityX(G)``, ``gyroRotationX(rad/s)``, as written by the
application. Every row has the latest value of every sensor, and each sensor its own stamps
(``motionTimestamp_sinceReboot(s)``, ``accelerometerTimestamp_sinceReboot(s)``), so a value may be
repeated in several rows. Core Motion reports acceleration and gravity with the sign opposite to
specific force: a phone on its back has gravity -z (Apple, CMDeviceMotion and CMAccelerometerData).

``motionMagneticFieldX(µT)`` … is the field without that of the phone, zero until it is known.

``locationLatitude(WGS84)`` … are those of CLLocation: ``locationAltitude(m)`` is over the sea, and
what is not known is negative. Their stamps count from 1970 and those of the sensors from the start
of the phone; the time of day of each row, ``loggingTime(txt)``, relates them.
"""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import Finding, add_note
from strapdown.formats import csv
from strapdown.formats.arrays import ticks_of
from strapdown.formats.clocks import RELATIVE, UNIX
from strapdown.formats.join import join
from strapdown.formats.known_formats import (
    column,
    force_of,
    lacking,
    optional,
    selected,
    sensor_log,
    stated_by,
)
from strapdown.formats.recording import RawLog
from strapdown.formats.sensor_folder import file_member, first_line
from strapdown.formats.signs import Signs
from strapdown.formats.text_columns import fields_of

MOTION, GYRO, FORCE = "motionRotationRate", "gyroRotation", "accelerometerAcceleration"
USER, GRAVITY = "motionUserAcceleration", "motionGravity"
RADIANS, GS = "(rad/s)", "(G)"
#: The calibrated magnetic field, with either letter of the micro sign.
FIELDS = tuple(("motionMagneticField", f"({micro}T)") for micro in "\u00b5\u03bc")
STAMPS = {
    MOTION: "motionTimestamp_sinceReboot(s)",
    USER: "motionTimestamp_sinceReboot(s)",
    GRAVITY: "motionTimestamp_sinceReboot(s)",
    GYRO: "gyroTimestamp_sinceReboot(s)",
    FORCE: "accelerometerTimestamp_sinceReboot(s)",
    FIELDS[0][0]: "motionTimestamp_sinceReboot(s)",
}
WALL_CLOCK = "loggingTime(txt)"
TITLE = "table of SensorLog"
FIX_TIME = "locationTimestamp_since1970(s)"
FIXES: dict[str, tuple[str, str | None]] = {
    "lat": ("locationLatitude(WGS84)", "deg"),
    "lon": ("locationLongitude(WGS84)", "deg"),
    "alt_msl": ("locationAltitude(m)", "m"),
    "speed": ("locationSpeed(m/s)", "m/s"),
    "course": ("locationCourse(°)", "deg"),
    "horizontal_accuracy": ("locationHorizontalAccuracy(m)", "m"),
    "vertical_accuracy": ("locationVerticalAccuracy(m)", "m"),
}
# Time zones differ by quarters of an hour.
ZONE = 900.0  # s


def _has_gyro(path: Path) -> bool:
    """Whether the first line names the columns of a gyro, with their unit."""
    line = first_line(file_member(path))
    names = set(fields_of(line))
    return csv.detect(path) and any(set(_three(kind, RADIANS)) <= names for kind in (MOTION, GYRO))


detect = Signs(text=r"\A\s*+.*\(rad/s\)", also=_has_gyro)


def read(path: Path) -> RawLog:
    """Read rates and specific force, joined on the stamps of the gyro.

    Rates of the fused motion, which the phone has corrected for its bias, or else of the gyro;
    specific force from user acceleration and gravity, or else the accelerometer.
    """
    raw = csv.parse(path.read_bytes(), path.name, (path,))
    have = set(raw.columns)
    gyro = next(k for k in (MOTION, GYRO) if set(_three(k, RADIANS)) <= have)
    findings: list[Finding] = []
    logs = [_log(raw, gyro, "gyro", "rad/s", findings)]
    if {*_three(USER, GS), *_three(GRAVITY, GS)} <= have:
        parts = [_log(raw, kind, "accel", "-g", findings) for kind in (USER, GRAVITY)]
        logs.append(force_of(*parts))
    elif set(_three(FORCE, GS)) <= have:
        logs.append(_log(raw, FORCE, "accel", "-g", findings))
    turned = len(logs) > 1
    # The calibrated field; zeros where the phone has not calibrated it.
    field = next((k for k in FIELDS if set(_three(*k)) <= have), None)
    if field is not None and np.any([column(raw, name) for name in _three(*field)]):
        logs.append(_log(raw, field[0], "mag", "uT", findings, field[1]))
    if turned:
        add_note(findings, "io.sign-of-ios-turned", file=path.name, quantity="accel")
    out = join(logs, path.name, (path,))
    return dataclasses.replace(out, findings=[*raw.findings, *findings, *out.findings])


def read_fixes(path: Path) -> RawLog:
    """Read the positions, each once, on the clock of the sensors if the rows relate the two."""
    raw = csv.parse(path.read_bytes(), path.name, (path,))
    if FIX_TIME not in raw.columns or FIXES["lat"][0] not in raw.columns:
        raise lacking(path, "gnss", TITLE, ["imu"])
    time = column(raw, FIX_TIME).astype(np.float64)
    held = optional(raw, FIXES)
    own = _changes(time) & np.isfinite(time) & np.isfinite(held["lat"][0])
    clock = UNIX
    motion = next((STAMPS[k] for k in (MOTION, GYRO) if STAMPS[k] in raw.columns), None)
    if motion is not None and WALL_CLOCK in raw.columns:
        wall = ticks_of(raw, WALL_CLOCK)[0] * 1e-9
        ahead = float(np.nanmedian(wall - column(raw, motion)))
        # The time of day may be that of the place.
        ahead += ZONE * round(float(np.nanmedian((time - wall)[own])) / ZONE) if own.any() else 0.0
        time, clock = time - ahead, RELATIVE
        add_note(raw.findings, "io.fixes-since-start", file=path.name, quantity="time")
    return selected(stated_by(raw, {"time": (time, "s"), **held}, clock=clock), own)


def _three(kind: str, unit: str) -> tuple[str, str, str]:
    return (f"{kind}X{unit}", f"{kind}Y{unit}", f"{kind}Z{unit}")


def _log(
    raw: RawLog, kind: str, triad: str, unit: str, findings: list[Finding], suffix: str = ""
) -> RawLog:
    """Return the samples of one sensor, without repetitions."""
    names = _three(kind, suffix or (RADIANS if triad == "gyro" else GS))
    time = _clock(raw, kind)
    stamps = raw.columns[time]
    if time == WALL_CLOCK:
        stamps, _ = ticks_of(raw, time)
    own = _changes(stamps) if time != WALL_CLOCK else np.ones(stamps.size, dtype=bool)
    if (repeated := int((~own).sum())) and triad == "gyro":
        add_note(
            findings,
            "io.rows-repeat-sample-before-stamp",
            file=raw.name,
            row=raw.row(int(np.argmin(own))),
            quantity=triad,
            repeated=repeated,
            size=own.size,
        )
    rows = np.arange(1, stamps.size + 1) if raw.rows is None else raw.rows
    return sensor_log(
        f"{raw.name}/{kind}",
        raw.files[0],
        {time: stamps[own]} | {name: raw.columns[name][own] for name in names},
        triad,
        unit,
        time=(time, "ns" if time == WALL_CLOCK else "s"),
        xyz=names,
        rows=rows[own],
    )


def _clock(raw: RawLog, kind: str) -> str:
    """Return the stamps of a sensor, else those of the motion, else times of day of the rows."""
    for name in (STAMPS[kind], STAMPS[MOTION], STAMPS[GYRO], WALL_CLOCK):
        if name in raw.columns:
            return name
    raise raw.fault("io.no-column-5", "time", stamps=STAMPS[kind], columns=list(raw.columns))


def _changes(stamps: NDArray[Any]) -> NDArray[np.bool_]:
    """Select rows whose stamp differs from that of the row before."""
    own = np.ones(stamps.size, dtype=bool)
    own[1:] = stamps[1:] != stamps[:-1]
    return own

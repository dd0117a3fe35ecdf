"""Sensor Logger (Kelvin Choi; iOS and Android): zip, folder, single CSV, or JSON.

Layout, units and axes are those of its documentation,
https://github.com/tszheichoi/awesome-sensor-logger: README.md (files, stamps, JSON, metadata),
UNITS.md, COORDINATES.md and CROSSPLATFORM.md. In short:

- ``time`` counts nanoseconds since 1970, ``seconds_elapsed`` seconds since the start; axes are
  written in the order z, y, x; each sensor has its own stamps.
- ``Accelerometer`` excludes gravity. ``TotalAcceleration``, which includes it, is written only on
  Android; elsewhere it is the sum of ``Accelerometer`` and ``Gravity``.
- On iOS these have the opposite sign: gravity of a phone lying on its back is -z, on Android +z.
  With "Standardise Units & Frames" (1.29 and later; ``standardisation`` in Metadata) iOS follows
  Android.
- ``Location`` has ``altitude`` over the ellipsoid of WGS 84, speed in m/s, ``bearing`` in degrees
  from north, ``horizontalAccuracy`` as the radius of uncertainty; what is not known is negative.
  ``Barometer`` has ``pressure`` in mbar.
- ``AccelerometerUncalibrated`` includes gravity; on iOS in g unless standardized, else in m/s².
"""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import DataError, Finding, add_note, add_warning
from strapdown.formats import csv
from strapdown.formats.clocks import UNIX
from strapdown.formats.join import join
from strapdown.formats.known_formats import AXES, force_of, lacking, sensor_log
from strapdown.formats.recording import RawLog
from strapdown.formats.sensor_folder import (
    Member,
    file_member,
    first_line,
    is_container,
    members_of,
    peek,
)
from strapdown.formats.signs import Signs, head
from strapdown.formats.text_columns import decoded

TIME = ("time", "ns")
GYROS = ("Gyroscope", "GyroscopeUncalibrated")
ACCELS = ("TotalAcceleration", "Accelerometer", "Gravity", "AccelerometerUncalibrated")
MAG = "Magnetometer"
SENSORS = (*GYROS, *ACCELS, MAG)
METADATA = "Metadata"
TITLE = "recording of Sensor Logger"
#: Quantities of the other tables, with column and unit; the fused position before the receiver's.
FIXES = {
    "lat": ("latitude", "deg"),
    "lon": ("longitude", "deg"),
    "alt": ("altitude", "m"),
    "speed": ("speed", "m/s"),
    "speed_sd": ("speedAccuracy", "m/s"),
    "course": ("bearing", "deg"),
    "horizontal_accuracy": ("horizontalAccuracy", "m"),
    "vertical_accuracy": ("verticalAccuracy", "m"),
}
STREAMS: dict[str, tuple[tuple[str, ...], dict[str, tuple[str, str]]]] = {
    "gnss": (("Location", "LocationGps"), FIXES),
    "magnetometer": ((MAG,), {f"mag_{a}": (a, "uT") for a in "xyz"}),
    "barometer": (("Barometer",), {"pressure": ("pressure", "hPa")}),
}
#: Columns of each kind of table beside ``time``.
KINDS: dict[str, tuple[str, ...]] = dict.fromkeys(SENSORS, ("x", "y", "z"))
KINDS |= {k: tuple(c for c, _ in held.values()) for ks, held in STREAMS.values() for k in ks}
# A second download of a file is called "Gyroscope (1)" or "Gyroscope-2".
_COPY = re.compile(r"[\s_-]*(\(\d+\)|\d+)$")


def _has_sensor(path: Path) -> bool:
    """Whether a table, or one in a folder or an archive, has the header of a sensor."""
    if path.suffix.lower() == ".json" and path.is_file():
        text = head(path, 4096)
        return text.lstrip().startswith("[") and '"sensor"' in text
    members = peek(path) if is_container(path) else [file_member(path)]
    return any(
        (_sensor(m) in SENSORS and _has_columns(m, "x", "y", "z"))
        or (_sensor(m) in STREAMS["gnss"][0] and _has_columns(m, "latitude", "longitude"))
        for m in members
    )


detect = Signs(
    suffixes=(".csv", ".json"),
    text=r"(?i)\A\s*+(?:\[|.*seconds_elapsed)",
    also=_has_sensor,
    folder=_has_sensor,
    zipped=True,
)


def read(path: Path) -> RawLog:
    """Read gyro, specific force and magnetic field, joined on the stamps of the gyro."""
    name = path.resolve().name
    sensors, meta, files, _ = _tables(path, SENSORS)
    if not sensors and path.is_file() and detect(path):
        raise lacking(path, "imu", TITLE, ["gnss"])
    if not any(kind in sensors for kind in GYROS):
        raise DataError(
            "io.no-gyroscope-read-here-holds",
            file=name,
            quantity="gyro",
            sensors=", ".join(sensors) or "nothing",
        )
    findings: list[Finding] = []
    logs = [_gyro(sensors, findings), *_force(sensors, meta, name, findings)]
    # The uncalibrated field includes that of the phone.
    if MAG in sensors:
        logs.append(_log(sensors[MAG], "mag", "uT"))
    raw = join(logs, name, files, rows_of_member=path.suffix.lower() != ".json")
    raw.findings[:0] = findings
    return raw


def read_magnetometer(path: Path) -> RawLog:
    """Read the magnetic field at its own stamps, about the axes of the phone."""
    raw = _read_stream(path, "magnetometer")
    raw.axes = AXES
    return raw


def _read_stream(path: Path, stream: str) -> RawLog:
    kinds, wanted = STREAMS[stream]
    tables, _, _, held = _tables(path, kinds)
    for kind in kinds:
        if kind in tables:
            raw = tables[kind]
            stated: dict[str, tuple[str, str | None]] = {"time": ("time", "ns")}
            stated |= {c: (q, u) for q, (c, u) in wanted.items() if c in raw.columns}
            raw.stated, raw.clock = stated, UNIX
            return raw
    there = [s for s, (k, _) in STREAMS.items() if set(k) & held]
    there += ["imu"] * bool(set(GYROS) & held)
    raise lacking(path, stream, TITLE, there)


read_fixes = partial(_read_stream, stream="gnss")
read_barometer = partial(_read_stream, stream="barometer")


def _sensor(member: Member) -> str:
    return _COPY.sub("", member.stem) if member.suffix == ".csv" else ""


def _has_columns(member: Member, *names: str) -> bool:
    fields = {f.strip().strip('"').lower() for f in first_line(member).split(",")}
    return {"time", "seconds_elapsed", *names} <= fields


def _tables(
    path: Path, wanted: Sequence[str]
) -> tuple[dict[str, RawLog], dict[str, str], tuple[Path, ...], set[str]]:
    """Return the tables of wanted kinds, the metadata, their files, and all kinds there are."""
    if path.is_file() and path.suffix.lower() == ".json":
        tables, meta, held = _tables_of_records(path, wanted)
        return tables, meta, (path,), held
    tables, meta, held = {}, {}, set()
    files = []
    for member in members_of(path) if is_container(path) else [file_member(path)]:
        kind = _sensor(member)
        held.add(kind)
        if kind in tables:
            raise DataError(
                "io.two-of-a-kind", file=member.label, name=tables[kind].name, kind=kind
            )
        if kind.lower() == METADATA.lower():
            table = csv.parse(member.read(), member.label, (member.file,)).columns
            meta = {n.strip().lower(): str(c[0]) for n, c in table.items()}
        elif kind in wanted:
            tables[kind] = csv.parse(member.read(), member.label, (member.file,))
        else:
            continue
        files.append(member.file)
    return tables, meta, tuple(dict.fromkeys(files)), held


def _require(name: str, columns: dict[str, NDArray[Any]]) -> None:
    missing = [n for n in ("time", "x", "y", "z") if n not in columns]
    if missing:
        raise DataError(
            "io.no-column-4", file=name, missing=missing, columns=", ".join(columns) or "none"
        )


def _records(path: Path) -> tuple[list[dict[str, Any]], list[Finding]]:
    text, found = decoded(path.read_bytes(), path.name)
    try:
        records = json.loads(text)
    except json.JSONDecodeError as error:
        raise DataError("io.no-json", file=path.name, row=error.lineno, msg=error.msg) from None
    except (RecursionError, ValueError):  # nested too deeply, or an integer of 4,301 digits
        records = None
    if not isinstance(records, list) or not all(isinstance(r, dict) for r in records):
        raise DataError("io.not-list-records", file=path.name)
    return records, found


def _tables_of_records(
    path: Path, wanted: Sequence[str]
) -> tuple[dict[str, RawLog], dict[str, str], set[str]]:
    records, found = _records(path)
    groups: dict[str, list[int]] = {}
    meta: dict[str, str] = {}
    held = set()
    for k, record in enumerate(records):
        kind = str(record.get("sensor", ""))
        held.add(kind)
        if kind == METADATA:
            meta |= {str(n).lower(): str(v) for n, v in record.items()}
        elif kind in wanted:
            groups.setdefault(kind, []).append(k)
    tables = {}
    for kind, where in groups.items():
        names = [n for n in ("time", *KINDS[kind]) if kind in SENSORS or n in records[where[0]]]
        columns = {n: _values(path, records, where, kind, n) for n in names}
        rows = np.array(where) + 1
        tables[kind] = RawLog(f"{path.name}/{kind}", (path,), columns, rows, findings=found)
        found = []
    return tables, meta, held


def _values(
    path: Path, records: list[dict[str, Any]], where: list[int], kind: str, name: str
) -> NDArray[Any]:
    """Return the values of one field, written as text; stamps stay integers."""
    out: list[float] = []
    for k in where:
        value = records[k].get(name)
        try:
            out.append(int(value) if name == "time" else float(value))  # type: ignore[arg-type]
        except (TypeError, ValueError, OverflowError):
            raise DataError(
                "io.not-number-field-record",
                file=f"{path.name}/{kind}",
                row=k + 1,
                quantity=name,
                value=value,
                name=name,
            ) from None
    try:
        return np.array(out, dtype=np.int64 if name == "time" else np.float64)
    except OverflowError:
        raise DataError(
            "io.stamp-more-than-bits", file=f"{path.name}/{kind}", quantity="time"
        ) from None


def _log(sensor: RawLog, triad: str, unit: str | None) -> RawLog:
    _require(sensor.name, sensor.columns)
    return sensor_log(
        sensor.name,
        sensor.files[0],
        sensor.columns,
        triad,
        unit,
        time=TIME,
        rows=sensor.rows,
        findings=sensor.findings,
    )


def _gyro(sensors: dict[str, RawLog], findings: list[Finding]) -> RawLog:
    kind = next(k for k in GYROS if k in sensors)
    if kind == GYROS[1]:
        add_note(
            findings, "io.uncalibrated-gyroscope-read", file=sensors[kind].name, quantity="gyro"
        )
    return _log(sensors[kind], "gyro", "rad/s")


def _force(
    sensors: dict[str, RawLog], meta: dict[str, str], name: str, findings: list[Finding]
) -> list[RawLog]:
    """Return specific force from the available files; its sign depends on the platform."""
    total, linear, gravity, raw = ACCELS
    platform = meta.get("platform", "").strip().lower()
    # Only Android writes acceleration with gravity.
    if not platform and total in sensors:
        platform = "android"
    standard = meta.get("standardisation", "").strip().lower() == "true"
    known = platform in ("android", "ios")
    turned = platform == "ios" and not standard
    unit = ("-m/s2" if turned else "m/s2") if known else "m/s2 or -m/s2"
    if total in sensors:
        logs = [_log(sensors[total], "accel", unit)]
    elif linear in sensors and gravity in sensors:
        parts = [_log(sensors[k], "accel", unit) for k in (linear, gravity)]
        logs = [force_of(*parts)]
    elif raw in sensors:
        logs = [_log(sensors[raw], "accel", "-g" if turned else unit)]
    else:
        if linear in sensors:
            add_warning(
                findings,
                "io.left-out-without-gravity-no",
                file=sensors[linear].name,
                quantity="accel",
            )
        return []
    if not known:
        add_warning(findings, "io.sensor-logger-platform-unknown", file=name, quantity="accel")
    elif turned:
        add_note(
            findings, "io.written-ios-without-standardised-frames", file=name, quantity="accel"
        )
    return logs

"""Logs of Android sensor events: one row an event of any sensor, its kind in the row.

``kind, timestamp, x, y, z`` or ``timestamp, kind, x, y, z``, further fields unused, or the kind
behind two clocks; with or without a header. A kind is the number of a SensorEvent (1 accelerometer,
2 magnetic field, 4 gyroscope, 16 gyroscope uncalibrated, 35 accelerometer uncalibrated), its string
type (``android.sensor.gyroscope``), or a short name (``gyro``, ``ACC``). Under the first two,
units, axes and the sign of gravity are those of Android: rad/s, m/s² with gravity, µT, x right, y
up, z out of the screen (developer.android.com/reference/android/hardware/SensorEvent). Linear
acceleration and gravity are used only without an accelerometer: their sum. Short names are also
those of other loggers, so that units and axes under them are left open; so are units under the
names of Android where the accelerometer has no gravity in m/s², or the rates are rather in another
unit than rad/s, as of applications that write deg/s and g. A name may state its unit: ``Gyroscope
(deg/s)``. The unit of the stamps is inferred unless the header states it; Android's own are ns.
Boards write one letter, G, W or R beside A or F, and M: kinds only where the norm in the rows of
the accelerometer is the steadier.

A table of samples is none of these: its header names axes of sensors (``ax``, ``gyro_x``). Small
whole numbers are kinds only under a name that says so or without a header, and only if the values
have decimals, the rows of the accelerometer have gravity, and those of the gyroscope have not.
"""

from __future__ import annotations

import dataclasses
import itertools
import math
import re
import statistics
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import DataError, Finding, add_note, add_warning
from strapdown.formats import csv
from strapdown.formats.columns import read_name, split_brackets
from strapdown.formats.find_columns import LOOSEST, norm_and_spread
from strapdown.formats.inference.conclusion import infer_accel
from strapdown.formats.inference.infer import Signals, infer_signals
from strapdown.formats.join import join
from strapdown.formats.known_formats import force_of, sensor_log
from strapdown.formats.recording import RawLog
from strapdown.formats.signs import Signs, head
from strapdown.formats.text_columns import are_data, decoded, fields_of, is_comment, separator_of
from strapdown.formats.triad_units import LIKELY
from strapdown.units import TIME_UNITS

KINDS = {
    "gyro": ("4", "gyro", "gyr", "gyroscope", "rotationrate", "angularvelocity"),
    "gyro uncalibrated": ("16", "gyroscopeuncalibrated", "uncalgyro", "gyrouncalibrated"),
    "accel": ("1", "acc", "accel", "accelerometer", "acce", "accelerationincludinggravity"),
    "accel uncalibrated": ("35", "accelerometeruncalibrated", "uncalaccel", "accuncalibrated"),
    "linear": ("10", "linearacceleration", "linacc", "linearaccelerometer", "lacc"),
    "gravity": ("9", "gravity", "grav"),
    "mag": ("2", "mag", "magn", "magnetometer", "magneticfield"),
}
LETTERS = {"g": "gyro", "w": "gyro", "r": "gyro", "a": "accel", "f": "accel", "m": "mag"}
UNITS = {"gyro": "rad/s", "accel": "m/s2", "mag": "uT"}
_OF = {word: kind for kind, words in KINDS.items() for word in words}
_STAMP = re.compile(r"\d+(?:\.\d+)?")
#: Names of the column of kinds in a header, where the kinds are numbers.
_HEADED = re.compile(r"(sensor|event)?[\s_-]*(type|kind|id|sensor|name|event)?", re.I)
# Specific force of most rows of an accelerometer, m/s²; a hand or a vehicle changes it less.
_GRAVITY = (6.0, 14.0)
_FORCES = ("accel", "accel uncalibrated", "gravity")
# Rows at the top that determine the layout.
TOP = 200


def kind_of(field: str) -> str | None:
    """Return the kind of sensor that a field names, with or without its unit in brackets."""
    word = split_brackets(field.strip(" \"'").lower())[0].strip()
    word = word.removeprefix("android.sensor.").removeprefix("type_")
    if "_" in word and (said := read_name(word)).unit and said.quantity in UNITS:
        word = word[: word.rindex("_")]  # gyro_dps
    # Neither -4 nor 1.6 is a kind.
    letters = re.search("[a-z]", word)
    return _OF.get(re.sub(r"[^a-z0-9]", "", word) if letters else word)


def _by_letters(rows: list[tuple[str, ...]]) -> dict[str, str]:
    """Return the kind of each field if they are letters of a gyro and an accelerometer, else none.

    `rows`: kind, x, y, z. A force varies about that of gravity, in any unit; rates vary about zero.
    """
    fields = {r[0] for r in rows}
    kinds = {f: LETTERS[word] for f in fields if (word := f.strip(" \"'").lower()) in LETTERS}
    if len(kinds) < len(fields) or len(set(kinds.values())) < len(kinds):
        return {}
    spread: dict[str, float] = {}
    for field, kind in kinds.items():
        try:
            values = np.array([r[1:] for r in rows if r[0] == field], dtype=np.float64)
        except ValueError:
            return {}
        norm, spread[kind] = norm_and_spread(list(values.T))
        if not norm > 0.0:
            return {}
    steady = spread.get("accel", np.inf) < min(LOOSEST, spread.get("gyro", 0.0))
    return kinds if steady else {}


detect = Signs(
    # A kind that is a gyroscope.
    text=r"\A[\s\S]{0,16000}?(?:(?i:gyr|rotation|angular)"
    r"|(?m:^|[,;\t |])[ \"']{0,3}(?:4|16|[gGwWrR])[ \"']{0,3}[,;\t |])",
    # A gyroscope and another sensor are among the kinds of the first rows.
    also=lambda path: csv.detect(path) and _layout(head(path, 1 << 16)) is not None,
)


def _layout(text: str) -> tuple[int, int, int, str | None, dict[str, str]] | None:
    """Return the fields of kind, stamp and first value, the unit of stamps in a header, letters."""
    lines = [line for line in text.splitlines()[:TOP] if line.strip() and not is_comment(line)]
    if len(lines) < 3:
        return None
    separator = separator_of(lines[1])
    rows = [fields_of(line, separator) for line in lines]
    header = rows[0] if len(rows[0]) >= 5 and not are_data(rows[0][2:]) else []
    # An axis of a sensor is in the header of a table of samples.
    axes = ("gyro_", "accel_", "mag_", "rate_")
    if any(str(read_name(name).quantity).startswith(axes) for name in header):
        return None
    units = [read_name(name).unit for name in rows[0][:2]]
    unit = next((u for u in units if u in TIME_UNITS), None)
    # A kind may be behind two clocks.
    orders = ((0, 1, 2), (1, 0, 2), (2, 0, 3))
    body = [r for r in rows[1:-1] if len(r) >= 5]
    # Values with labels, x=0.01, are those of printed lines.
    plain = are_data([field for row in body for field in row[2:5]])
    if len(body) < 0.9 * (len(rows) - 2) or not plain:
        return None
    for kind, stamp, first in orders[: 3 if body and len(body[0]) > 5 else 2]:
        # A counter of samples takes every number once, a kind of sensor returns.
        fields = Counter(r[kind] for r in body)
        again = {field for field, count in fields.items() if count > 1}
        letters: dict[str, str] = {}
        if all(len(field.strip(" \"'")) == 1 and not field.isdecimal() for field in again):
            letters = _by_letters([(r[kind], *r[first : first + 3]) for r in body])
        kinds = {letters.get(field) or kind_of(field) for field in again} - {None}
        usual = 2 * len(fields) <= len(body) and not any(
            "." in f and f[:1].isdigit() for f in fields
        )
        advances = all(_STAMP.fullmatch(r[stamp]) for r in body) and _advance(
            [float(r[stamp]) for r in body]
        )
        # A file of one sensor may say it in every row.
        alone = kinds == {"gyro"} and len(fields) == 1 and not min(fields).isdecimal()
        if usual and advances and (len(kinds) > 1 or (alone and header)):
            if any(field.isdecimal() and kind_of(field) for field in fields):
                named = not header or _HEADED.fullmatch(header[kind])
                signed = any(field.startswith("-") for field in fields)
                if (
                    signed
                    or not named
                    or not _are_of_android([(r[kind], *r[first : first + 3]) for r in body])
                ):
                    continue
            known = bool(kinds & {"gyro", "gyro uncalibrated"})
            return (kind, stamp, first, unit, letters) if known else None
    return None


def _are_of_android(rows: list[tuple[str, ...]]) -> bool:
    """Whether numbers are kinds: by gravity in the rows of an accelerometer, and not of a gyro.

    `rows`: kind, x, y, z. In a table of samples the rows of every number are alike. The values of
    an event are floating-point numbers and written so.
    """
    if 2 * sum("." in v for _, *values in rows for v in values) < 3 * len(rows):
        return False
    sizes: dict[str | None, list[float]] = {}
    for field, *values in rows:
        try:
            size = math.sqrt(math.fsum(float(v) ** 2 for v in values))
        except ValueError:
            return False
        sizes.setdefault(kind_of(field), []).append(size)
    usual = {kind: statistics.median(held) for kind, held in sizes.items()}
    low, high = _GRAVITY
    force = [usual[k] for k in _FORCES if k in usual]
    turns = [usual[k] for k in ("gyro", "gyro uncalibrated") if k in usual]
    return (
        bool(force)
        and all(low <= f <= high for f in force)
        and not any(low <= rate <= high for rate in turns)
    )


def _advance(stamps: list[float]) -> bool:
    """Whether numbers are stamps, and no kinds: nearly all are as late as that before, or later."""
    later = sum(b >= a for a, b in itertools.pairwise(stamps))
    return stamps[-1] > stamps[0] and later >= 0.9 * (len(stamps) - 1)


def read(path: Path) -> RawLog:
    """Read the gyro, with the other sensors interpolated to its stamps."""
    text, findings = decoded(path.read_bytes(), path.name)
    layout = _layout(text[: 1 << 16])
    if layout is None:
        raise DataError("io.no-gyroscope-holds", file=path.name, quantity="gyro", held="other rows")
    kind, stamp, first, unit, letters = layout
    separator = None
    events: dict[str, list[tuple[Any, ...]]] = {}
    names: dict[str, str] = {}
    unknown: set[str] = set()
    lines = text.splitlines()
    for row, line in enumerate(lines, 1):
        if not line.strip() or is_comment(line):
            continue
        separator = separator or separator_of(line)
        fields = fields_of(line, separator)
        which = None
        if len(fields) > kind:
            which = letters.get(fields[kind]) or kind_of(fields[kind])
        if which is None:
            if events:  # those above the rows are names
                unknown.add(fields[kind] if len(fields) > kind else line)
            continue
        if len(fields) < first + 3:
            if row == len(lines) and not text.endswith("\n"):
                add_note(findings, "io.last-line-cut-left-out", file=path.name, row=row)
                continue
            raise DataError(
                "io.fields-expected", file=path.name, row=row, count=len(fields), width=first + 3
            )
        names.setdefault(which, fields[kind])
        events.setdefault(which, []).append((row, fields[stamp], *fields[first : first + 3]))
    others = sorted(u for u in unknown if u and not read_name(u).quantity)[:6]
    if others:
        add_note(findings, "io.events-not-used", file=path.name, kinds=others)
    columns = {k: _columns(path, k, rows) for k, rows in events.items()}
    android = any(
        (word := name.strip(" \"'").lower()).isdigit()
        or word.startswith(("android.sensor.", "type_"))
        for name in names.values()
    )
    units = {k: read_name(name).unit for k, name in names.items()}
    if android and not any(units.values()) and _has_units_of_android(columns):
        units = {k: UNITS.get(k.partition(" ")[0], "m/s2") for k in names}
    return joined(path, columns, {**units, "time": unit}, findings, android=android)


def _columns(path: Path, kind: str, rows: list[tuple[Any, ...]]) -> dict[str, NDArray[Any]]:
    """Convert the fields of one kind to numbers; whole stamps stay integers."""
    whole = all(str(r[1]).isdigit() for r in rows)
    out: dict[str, NDArray[Any]] = {"row": np.array([r[0] for r in rows])}
    for k, name in enumerate(("time", "x", "y", "z"), 1):
        values: list[float] = []
        for r in rows:
            try:
                values.append(int(r[k]) if whole and k == 1 else float(r[k]))
            except ValueError:
                raise DataError(
                    "io.value-not-a-number",
                    file=path.name,
                    row=r[0],
                    quantity=kind,
                    values=r[k],
                    source=name,
                ) from None
        out[name] = np.array(values)
    return out


def _has_units_of_android(events: Mapping[str, dict[str, NDArray[Any]]]) -> bool:
    """Whether gravity, if it was measured, is in m/s², and no other unit of the rates likelier.

    Applications write values in deg/s and g under the names of Android, too.
    """
    forces = [np.column_stack([events[k][a] for a in "xyz"]) for k in _FORCES if k in events]
    usual = [float(np.median(np.linalg.norm(force, axis=1))) for force in forces]
    if not all(_GRAVITY[0] <= size <= _GRAVITY[1] for size in usual):
        return False
    gyro = next(events[k] for k in ("gyro", "gyro uncalibrated") if k in events)
    rates = np.column_stack([gyro[a] for a in "xyz"]).astype(np.float64)
    told = infer_signals(Signals(gyro["time"], rates))
    return all(i.value in (UNITS["gyro"], None) for i in told if i.quantity == "gyro_unit")


def _has_gravity(events: Mapping[str, dict[str, NDArray[Any]]]) -> bool:
    """Whether events named linear acceleration have gravity, as those of ROS do."""
    values = np.column_stack([events["linear"][a] for a in "xyz"]).astype(np.float64)
    _, _, gravity, _ = infer_accel(values[np.isfinite(values).all(axis=1)], None)
    return gravity.value == "present" and gravity.confidence >= LIKELY


def joined(
    path: Path,
    events: Mapping[str, dict[str, NDArray[Any]]],
    units: Mapping[str, str | None],
    findings: list[Finding],
    *,
    android: bool,
) -> RawLog:
    """Join the events of each kind on the stamps of the gyro.

    `units`: by kind, and of ``time``; None where left open. `android`: axes are those of Android;
    otherwise they are left open.
    """

    def log(kind: str, triad: str) -> RawLog:
        held = {n: events[kind][n] for n in ("time", "x", "y", "z")}
        return sensor_log(
            f"{path.name}/{kind}",
            path,
            held,
            triad,
            units.get(kind),
            time=("time", units["time"] or ""),
            rows=events[kind]["row"],
        )

    logs = []
    for triad in UNITS:
        kind = next((k for k in (triad, f"{triad} uncalibrated") if k in events), None)
        if kind is not None:
            logs.append(log(kind, triad))
            if kind != triad and triad == "gyro":
                add_note(findings, "io.uncalibrated-gyro", file=path.name, quantity="gyro")
        elif triad == "accel" and {"linear", "gravity"} <= events.keys():
            logs.append(force_of(log("linear", "accel"), log("gravity", "accel")))
        elif triad == "accel" and "linear" in events and not android and _has_gravity(events):
            logs.append(log("linear", "accel"))
        elif triad == "accel" and "linear" in events:
            add_warning(
                findings, "io.left-out-without-gravity-no", file=path.name, quantity="accel"
            )
    for one in logs:
        one.stated = {c: (q, u or None) for c, (q, u) in one.stated.items()}
    out = join(logs, path.name, (path,))
    out.findings[:0] = findings
    return out if android else dataclasses.replace(out, axes=None)

"""Logs of ArduPilot: DataFlash, and the telemetry of MAVLink."""

from __future__ import annotations

import json
import re
import struct
from collections.abc import Container, Iterator, Sequence
from contextlib import suppress
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.errors import DataError, Finding, add_note
from strapdown.formats.clocks import RELATIVE, Clock
from strapdown.formats.known_formats import Quantities, damage, interpolated, solution, turned
from strapdown.formats.recording import NoStreamError, RawLog
from strapdown.formats.signs import Signs, first_bytes
from strapdown.parsers import parse
from strapdown.parsers.recorders import FIRST, mavlink_frames

# ArduPilot DataFlash logs (``.bin``, or as text ``.log``): records that the log itself describes.
#
# File: https://ardupilot.org/dev/docs/code-overview-adding-a-new-log-message.html; messages:
# https://ardupilot.org/copter/docs/logmessages.html. A record begins with A3 95 and the number of
# its type; a record FMT gives each type its length, name, letters of the fields' formats, and
# names. Letters c, C, e, E mean hundredths and L 1e-7 deg. Records FMTU and UNIT name
# the units. ``TimeUS`` counts µs since the start of the autopilot. IMU: rad/s and m/s² of
# specific force, forward, right, down. GPS: ``Alt`` is over the sea; GPA has accuracies, and
# ``AEl``, the height over the ellipsoid, or in older logs ``Und``, the geoid undulation with its
# sign reversed (pull request 29904 of ArduPilot). As text a line is the name of its type and its
# values, scaled already: ``GPS, 33200000, 3, …``. MAG: milligauss. XKF1 or NKF1 and POS: the
# solution of the autopilot.


DATAFLASH_TITLE = "ArduPilot DataFlash log (.bin, .log)"
DATAFLASH_STREAMS = {"imu": "IMU", "gnss": "GPS", "reference": "POS", "magnetometer": "MAG"}
DATAFLASH_STREAMS |= {"barometer": "BARO"}
SYNC, FMT, FMT_SIZE = b"\xa3\x95", 128, 89
FORMATS = {
    "a": "(32,)<i2",
    "b": "i1",
    "B": "u1",
    "h": "<i2",
    "H": "<u2",
    "i": "<i4",
    "I": "<u4",
    "f": "<f4",
    "d": "<f8",
    "g": "<f2",
    "n": "S4",
    "N": "S16",
    "Z": "S64",
    "M": "u1",
    "c": "<i2",
    "C": "<u2",
    "e": "<i4",
    "E": "<u4",
    "L": "<i4",
    "q": "<i8",
    "Q": "<u8",
}
# Of the values of a text, where they are not numbers with a fraction.
_TYPES: dict[str, Any] = {**dict.fromkeys("bBhHiIqQ", np.int64), **dict.fromkeys("aMnNZ", "S64")}
SCALES = {"c": 0.01, "C": 0.01, "e": 0.01, "E": 0.01, "L": 1e-7}
# Status of a receiver to field 6 of NMEA GGA.
DATAFLASH_QUALITY = {2: 1, 3: 1, 4: 2, 5: 5, 6: 4}
UNITS = {"Gyr": "rad/s", "Acc": "m/s/s"}  # as UNIT spells them
Record = dict[str, NDArray[Any]]
# The description of descriptions, as text.
_TEXT = re.compile(rb"(?:\A|\n)FMT, ?128, ?89, ?FMT,")


# The first record describes itself. As mavlogdump prints it, the first message is that, or begins
# with its stamp.
detect_dataflash = Signs(
    first=rb"\A\xa3\x95\x80|\AFMT, ?128, ?89, ?FMT,|\nFMT, ?128, ?89, ?FMT,"
    rb"|(?:\A|\n)\d{4}-\d\d-\d\d [\d:.]+: \w+ \{(?:TimeUS|Type) : "
    rb'|\A\{"meta": \{"type": "\w+"[^\n]{0,80}"data": \{"(?:TimeUS|Type)": '
)


@lru_cache(maxsize=1)
def _records(path: Path, stamp: int) -> tuple[dict[str, Record], int]:
    """Read every record by name, and count the bytes between records that are none."""
    data = path.read_bytes()
    if _TEXT.search(data[:4096]):
        return _records_of_text(data.decode("ascii", "replace"))
    if not data.startswith(SYNC):
        return _dumped(data, _RECORDS)
    types: dict[int, tuple[str, list[str], str, int]] = {}
    where: dict[int, list[int]] = {}
    sizes, k, lost = {FMT: FMT_SIZE}, 0, 0
    while (k := data.find(SYNC, (start := k))) >= 0 and k + 3 <= len(data):
        lost += k - start
        size = sizes.get(data[k + 2], 0)
        if not size or k + size > len(data):
            k, lost = k + 2, lost + 2
            continue
        if data[k + 2] == FMT:
            kind, length, name, letters, names = struct.unpack_from("<BB4s16s64s", data, k + 3)
            text = [s.rstrip(b"\0").decode("ascii", "replace") for s in (name, letters, names)]
            types[kind] = (text[0], text[2].split(","), text[1], length)
            sizes[kind] = length if length > 3 else 0
        where.setdefault(data[k + 2], []).append(k)
        k += size
    out: dict[str, Record] = {}
    for kind, (name, names, letters, length) in types.items():
        if len(names) != len(letters) or not set(letters) <= set(FORMATS) or kind not in where:
            continue
        form = np.dtype([(n, FORMATS[c]) for n, c in zip(names, letters, strict=True)])
        if form.itemsize != length - 3:
            continue
        block = b"".join(data[p + 3 : p + length] for p in where[kind])
        table = np.frombuffer(block, dtype=form)
        out[name] = {
            n: table[n] * SCALES[c] if c in SCALES else table[n]
            for n, c in zip(names, letters, strict=True)
        }
        out[name]["#"] = np.full(len(table), kind)
    return out, lost


#: Records of DataFlash that are read here.
_RECORDS = frozenset({*DATAFLASH_STREAMS.values(), "GPA", "XKF1", "NKF1"})
# A message as mavlogdump of pymavlink prints it, and a name in it, before its value.
_PRINTED = re.compile(r"\d{4}-\d\d-\d\d [\d:.]+: (\w+) \{(.*)\}\s*")
_NAME = re.compile(r"(?:^|, +)(\w+) : ")


def _dumped(data: bytes, wanted: Container[str]) -> tuple[dict[str, Record], int]:
    """Read the messages of the wanted names that mavlogdump has printed, and count what is lost.

    A line each, as text or JSON; or a table, whose headings have the name before the field, and
    whose rows have the fields of one message.
    """
    lines = data.decode("utf-8", "replace").splitlines()
    held: dict[str, dict[tuple[str, ...], list[list[Any]]]] = {}
    lost = 0
    for name, fields in _of_table(lines) if lines[0].startswith("timestamp") else map(_one, lines):
        lost += not name
        if name in wanted:
            held.setdefault(name, {}).setdefault(tuple(fields), []).append([*fields.values()])
    out: dict[str, Record] = {}
    for name, forms in held.items():
        names, rows = max(forms.items(), key=lambda form: len(form[1]))
        lost += sum(map(len, forms.values())) - len(rows)
        columns = dict(zip(names, zip(*rows, strict=True), strict=True))
        out[name] = {n: array for n, c in columns.items() if (array := _as_numbers(c)) is not None}
    return out, lost


def _one(line: str) -> tuple[str, dict[str, Any]]:
    """Return name and fields of a message; an empty name if the line is none."""
    if line.startswith("{"):
        try:
            message = json.loads(line)
            return str(message["meta"]["type"]), dict(message["data"])
        except (ValueError, KeyError, TypeError, RecursionError):
            return "", {}
    match = _PRINTED.fullmatch(line)
    if match is None:
        return "", {}
    parts = _NAME.split(match[2])[1:]
    return match[1], dict(zip(parts[::2], parts[1::2], strict=True))


def _of_table(lines: Sequence[str]) -> Iterator[tuple[str, dict[str, Any]]]:
    separator = re.sub(r"[\w.]+", "", lines[0])[:1] or ","
    heads = [head.partition(".") for head in lines[0].strip().split(separator)]
    for line in lines[1:]:
        held: dict[str, dict[str, Any]] = {}
        for (name, _, field), value in zip(
            heads, line.strip("\r\n").split(separator), strict=False
        ):
            if value and field:
                held.setdefault(name, {})[field] = value
        yield from held.items()


def _as_numbers(values: Sequence[Any]) -> NDArray[Any] | None:
    """Convert a field of messages; None of a text or an array."""
    with suppress(ValueError):
        found = np.array(values)
        if found.dtype.kind == "U":
            with suppress(ValueError):
                return found.astype(np.int64)
            return found.astype(np.float64)
        return found if found.ndim == 1 and found.dtype.kind in "if" else None
    return None


def _records_of_text(text: str) -> tuple[dict[str, Record], int]:
    """Read every record of a log as text, and count the characters of lines that are none."""
    types: dict[str, tuple[int, str, list[str]]] = {}
    held: dict[str, list[list[str]]] = {}
    lost = 0
    for line in text.splitlines():
        name, *fields = [field.strip() for field in line.split(",")]
        if name == "FMT" and len(fields) > 4 and fields[0].isdecimal():
            types[fields[2]] = (int(fields[0]), fields[3], fields[4:])
        elif name in types and len(fields) == len(types[name][2]) == len(types[name][1]):
            held.setdefault(name, []).append(fields)
        elif name not in types:
            lost += len(line)
    out: dict[str, Record] = {}
    for name, rows in held.items():
        kind, letters, names = types[name]
        out[name] = {
            n: _of_letter(letter, values)
            for n, letter, values in zip(names, letters, zip(*rows, strict=True), strict=True)
        }
        out[name]["#"] = np.full(len(rows), kind)
    return out, lost


def _of_letter(letter: str, values: Sequence[str]) -> NDArray[Any]:
    """Convert the texts of a field; those that are not numbers stay texts."""
    try:
        return np.array(values, dtype=_TYPES.get(letter, np.float64))
    except ValueError:
        return np.array(values, dtype="S64")


def _log(path: Path, stream: str) -> tuple[dict[str, Record], Record, list[Finding]]:
    """Return all records, those of a stream's first instance, and findings."""
    with damage(path):
        log, lost = _records(path.resolve(), path.stat().st_mtime_ns)
    findings: list[Finding] = []
    name = DATAFLASH_STREAMS[stream]
    if name not in log:
        raise NoStreamError(
            path.name,
            stream,
            DATAFLASH_TITLE,
            [s for s, n in DATAFLASH_STREAMS.items() if n in log],
        )
    if "TimeUS" not in log[name]:
        raise DataError("io.dataflash-without-stamps", file=path.name, quantity=f"{name} time")
    if lost:
        add_note(findings, "io.bytes-left-out", file=path.name, count=lost)
    record = log[name]
    if "I" in record:
        first = int(record["I"].min())
        if (count := np.unique(record["I"]).size) > 1:
            findings.append(_several(path, name, count))
        record = {n: v[record["I"] == first] for n, v in record.items()}
    elif others := [n for n in log if n[:-1] == name and n[-1].isdigit()]:
        findings.append(_several(path, name, 1 + len(others)))
    return log, record, findings


def _several(path: Path, name: str, count: int) -> Finding:
    code = "io.first-of-instances"
    return Finding(code, file=path.name, quantity=name, severity="note", count=count)


def _unit(log: dict[str, Record], record: Record, field: str) -> str | None:
    """Name of a field's unit, if the log states it."""
    about, units = log.get("FMTU"), log.get("UNIT")
    if about is None or units is None or not record["#"].size:
        return None
    row = np.flatnonzero(about["FmtType"] == record["#"][0])
    if not row.size:
        return None
    ids = about["UnitIds"][row[0]]
    at = [n for n in record if n != "#"].index(field)
    label = units["Label"][units["Id"] == ids[at]] if at < len(ids) else []
    return label[0].decode("ascii", "replace") if len(label) else None


def read_dataflash(path: Path) -> RawLog:
    """Read rates and specific force of the first sensor."""
    log, imu, findings = _log(path, "imu")
    out: Quantities = {"time": (imu["TimeUS"].astype(np.int64), "us")}
    with damage(path):
        for head, triad, unit in (("Gyr", "gyro", "rad/s"), ("Acc", "accel", "m/s2")):
            said = _unit(log, imu, f"{head}X")
            if said not in (None, UNITS[head]):
                raise DataError("io.log-unit-unknown", file=path.name, quantity=triad, unit=said)
            out |= {f"{triad}_{a.lower()}": (imu[f"{head}{a}"], unit) for a in "XYZ"}
    return RawLog.of(path, out, axes="x,y,z", clock=RELATIVE, findings=findings)


def read_dataflash_fixes(path: Path) -> RawLog:
    """Read the fixes of the first receiver, on the clock of the sensors."""
    log, fix, findings = _log(path, "gnss")
    with damage(path):
        use = fix["Status"] >= 2
        if not use.all():
            count = int((~use).sum())
            code = "io.fixes-without-position-left-out"
            add_note(findings, code, file=path.name, count=count)
        if not use.any():
            raise DataError("io.no-usable-fix", file=path.name, quantity="lat, lon")
        fix = {n: v[use] for n, v in fix.items()}
        out: Quantities = {"time": (fix["TimeUS"].astype(np.int64), "us")}
        out |= {
            "lat": (fix["Lat"], "deg"),
            "lon": (fix["Lng"], "deg"),
            "alt_msl": (fix["Alt"], "m"),
        }
        course = np.radians(fix["GCrs"].astype(np.float64))
        down = fix["VZ"].astype(np.float64)
        velocity = (fix["Spd"] * np.cos(course), fix["Spd"] * np.sin(course), down)
        out |= {f"V{a}": (v, "m/s") for a, v in zip("NED", velocity, strict=True)}
        out["quality"] = (np.array([DATAFLASH_QUALITY.get(int(s), 1) for s in fix["Status"]]), None)
        if "NSats" in fix:
            out["satellites"] = (fix["NSats"].astype(np.float64), None)
        out |= _accuracy(log.get("GPA"), fix, int(fix["I"][0]) if "I" in fix else None)
    return RawLog.of(path, out, clock=RELATIVE, findings=findings)


def _accuracy(gpa: Record | None, fix: Record, instance: int | None) -> Quantities:
    """Return accuracies and the height over the ellipsoid, written with each fix."""
    if gpa is None:
        return {}
    if instance is not None and "I" in gpa:
        gpa = {n: v[gpa["I"] == instance] for n, v in gpa.items()}
    _, at, of = np.intersect1d(fix["TimeUS"], gpa["TimeUS"], return_indices=True)
    if at.size < fix["TimeUS"].size / 2:
        return {}

    def values(name: str) -> NDArray[Any]:
        out = np.full(fix["TimeUS"].size, np.nan)
        out[at] = np.where(gpa[name][of] > 0.0, gpa[name][of], np.nan)
        return out

    out: Quantities = {"horizontal_accuracy": (values("HAcc"), "m")}
    out["vertical_accuracy"] = (values("VAcc"), "m")
    out |= {f"V{a}_sd": (values("SAcc"), "m/s") for a in "NED"}
    height = np.full(fix["TimeUS"].size, np.nan)
    if "AEl" in gpa:
        height[at] = np.where(gpa["AEl"][of] > -1e6, gpa["AEl"][of], np.nan)
    elif "Und" in gpa:  # of the sea over the ellipsoid, with the sign reversed; 0 if unknown
        height[at] = fix["Alt"][at] - np.where(gpa["Und"][of] != 0.0, gpa["Und"][of], np.nan)
    return out | ({"alt": (height, "m")} if np.isfinite(height).all() else {})


def read_dataflash_reference(path: Path) -> pd.DataFrame:
    """Read the autopilot's own solution, if the log has heights over the ellipsoid."""
    log, place, findings = _log(path, "reference")
    state = next((log[n] for n in ("XKF1", "NKF1") if n in log), None)
    if state is None:
        raise NoStreamError(
            path.name,
            "reference",
            DATAFLASH_TITLE,
            [s for s, n in DATAFLASH_STREAMS.items() if n in log],
        )
    fixes = read_dataflash_fixes(path).columns if "GPS" in log else {}
    if "alt" not in fixes:
        raise DataError("io.reference-height-over-sea", file=path.name, quantity="alt")
    with damage(path):
        if "C" in state:
            state = {n: v[state["C"] == state["C"].min()] for n, v in state.items()}
        time, own = place["TimeUS"] * 1e-6, state["TimeUS"] * 1e-6
        alt = place["Alt"] + np.median(fixes["alt"] - fixes["alt_msl"])
        velocity = interpolated(time, own, [state[n] for n in ("VN", "VE", "VD")])
        names = ("Roll", "Pitch", "Yaw")
        angles = np.column_stack([state[n] for n in names]).astype(np.float64)
        euler = turned(time, own, rotation.quaternion_from_euler(angles))
        position = np.column_stack([place["Lat"], place["Lng"], alt])
    return solution(path, (time, position, velocity, euler), Clock(RELATIVE), findings)


def read_dataflash_magnetometer(path: Path) -> RawLog:
    """Read the magnetic field of the first compass, as corrected by the autopilot."""
    _, field, findings = _log(path, "magnetometer")
    with damage(path):
        out: Quantities = {"time": (field["TimeUS"].astype(np.int64), "us")}
        out |= {f"mag_{a.lower()}": (field[f"Mag{a}"], "mG") for a in "XYZ"}
    return RawLog.of(path, out, axes="x,y,z", clock=RELATIVE, findings=findings)


def read_dataflash_barometer(path: Path) -> RawLog:
    """Read air pressure and temperature."""
    _, baro, findings = _log(path, "barometer")
    with damage(path):
        out: Quantities = {"time": (baro["TimeUS"].astype(np.int64), "us")}
        out |= {"pressure": (baro["Press"], "Pa"), "temperature": (baro["Temp"], "degC")}
    return RawLog.of(path, out, clock=RELATIVE, findings=findings)


# Telemetry logs of MAVLink (``.tlog``), as ground stations keep them, by pymavlink.
#
# A record is the time of arrival, µs since 1970 in eight bytes, most significant first, and a
# frame of MAVLink 1 or 2 (https://mavlink.io/en/guide/serialization.html). Messages, units and
# axes are those of https://mavlink.io/en/messages/common.html, body axes forward, right, down:
#
# - IMU: HIGHRES_IMU (m/s², rad/s), else SCALED_IMU (mG, mrad/s), else RAW_IMU, whose unit MAVLink
#   leaves open;
# - fixes: GPS_RAW_INT: 1e-7 deg, mm over the sea, and in MAVLink 2 mm over the ellipsoid and
#   accuracies, which are zero where the autopilot does not fill them in;
# - reference: ATTITUDE and GLOBAL_POSITION_INT, the autopilot's own solution;
# - barometer: SCALED_PRESSURE (hPa).
#
# Stamps are those of the autopilot since its start; SYSTEM_TIME relates those of 1970 to them.
# pymavlink is under the LGPL: it is imported where it is installed (extra ``mavlink``), and no
# part is copied here.


MAVLINK_TITLE = "telemetry log of MAVLink (.tlog)"
#: Messages by their numbers.
IDS = {
    2: "SYSTEM_TIME",
    24: "GPS_RAW_INT",
    26: "SCALED_IMU",
    27: "RAW_IMU",
    29: "SCALED_PRESSURE",
    30: "ATTITUDE",
    33: "GLOBAL_POSITION_INT",
    105: "HIGHRES_IMU",
}
# Of the second and third sensor of an autopilot, where they are all there is.
IDS |= {116: "SCALED_IMU2", 129: "SCALED_IMU3"}
IMUS = ("HIGHRES_IMU", "SCALED_IMU", "RAW_IMU", "SCALED_IMU2", "SCALED_IMU3")
MAVLINK_STREAMS = {"imu": IMUS, "gnss": ("GPS_RAW_INT",), "reference": ("GLOBAL_POSITION_INT",)}
MAVLINK_STREAMS |= {"barometer": ("SCALED_PRESSURE",)}
#: Kind of a fix to field 6 of NMEA GGA.
MAVLINK_QUALITY = {2: 1, 3: 1, 4: 2, 5: 5, 6: 4, 7: 4, 8: 3}
UNKNOWN = 65535  # of a speed and a course
Fields = dict[str, NDArray[Any]]


detect_mavlink = Signs(
    first=rb"\A.{8,1023}?[\xfd\xfe]",
    # Two records, each a stamp of these decades and a frame.
    also=lambda path: len(list(mavlink_frames(first_bytes(path, 1024), most=2))) == 2,
)


# As mavlogdump prints them: text, lines of JSON, or a table of the fields of some messages.
detect_mavlogdump = Signs(
    first=rb"(?:\A|\n)\d{4}-\d\d-\d\d [\d:.]+: [A-Z][A-Z\d_]+ \{\w+ : "
    rb'|\A\{"meta": \{"type": "[A-Z][A-Z\d_]+"[^\n]{0,80}"data": \{"'
    rb"|\Atimestamp[,;\t ](?:" + "|".join(IDS.values()).encode() + rb")\.\w"
)


@lru_cache(maxsize=1)
def _messages(path: Path, stamp: int) -> tuple[dict[str, Fields], list[Finding]]:
    """Read the fields of the messages of the vehicle, by their names."""
    if detect_mavlogdump(path):
        fields, lost = _dumped(path.read_bytes(), {*IDS.values()})
        read: dict[str, Any] = {"fields": fields, "others": [], "lost": lost}
    else:
        read = parse("recorders.mavlink", path, wanted=list(IDS.items()))
    findings: list[Finding] = []
    if read["others"]:
        add_note(
            findings,
            "io.mavlink-one-of-systems",
            file=path.name,
            system=read["system"],
            others=read["others"],
        )
    if lost := read["lost"]:
        add_note(findings, "io.mavlink-frames-left-out", file=path.name, count=lost)
    return read["fields"], findings


def _of(path: Path, stream: str) -> tuple[dict[str, Fields], str, list[Finding]]:
    """Return all messages, the name of the first kind of a stream that is there, and findings."""
    with damage(path):
        log, findings = _messages(path.resolve(), path.stat().st_mtime_ns)
    kind = next((name for name in MAVLINK_STREAMS[stream] if name in log), None)
    if kind is None:
        has = [s for s, kinds in MAVLINK_STREAMS.items() if set(kinds) & set(log)]
        raise NoStreamError(path.name, stream, MAVLINK_TITLE, has or ["other messages"])
    return log, kind, list(findings)


def _time(path: Path, log: dict[str, Fields], kind: str) -> NDArray[np.int64]:
    """Return µs since the start of the autopilot."""
    fields = log[kind]
    if "time_usec" not in fields:
        return np.asarray(fields["time_boot_ms"].astype(np.int64) * 1000)
    time = fields["time_usec"].astype(np.int64)
    if (time < FIRST).all():
        return np.asarray(time)
    system = log.get("SYSTEM_TIME", {})
    known = system["time_unix_usec"] > FIRST if system else np.zeros(0, dtype=bool)
    if not known.any() or (time < FIRST).any():
        raise DataError("io.mavlink-two-clocks", file=path.name, quantity=f"{kind} time_usec")
    ahead = system["time_unix_usec"].astype(np.int64) - 1000 * system["time_boot_ms"].astype(
        np.int64
    )
    return np.asarray(time - np.int64(np.median(ahead[known])))


def read_mavlink(path: Path) -> RawLog:
    """Read rates and specific force; where the messages have one, the magnetic field."""
    log, kind, findings = _of(path, "imu")
    fields = log[kind]
    units = {
        "HIGHRES_IMU": ("rad/s", "m/s2", "gauss"),
        "RAW_IMU": (None, None, None),
    }.get(kind, ("mrad/s", "mg", "mG"))
    out: Quantities = {"time": (_time(path, log, kind), "us")}
    for triad, unit in zip(("gyro", "accel"), units[:2], strict=True):
        short = triad.removesuffix("el")
        out |= {f"{triad}_{a}": (fields[f"{a}{short}"].astype(float), unit) for a in "xyz"}
    if units[2] and any(fields[f"{a}mag"].any() for a in "xyz"):
        out |= {f"mag_{a}": (fields[f"{a}mag"].astype(float), units[2]) for a in "xyz"}
    return RawLog.of(path, out, axes="x,y,z", clock=RELATIVE, findings=findings)


def read_mavlink_fixes(path: Path) -> RawLog:
    """Read the fixes of the first receiver, on the clock of the sensors."""
    log, kind, findings = _of(path, "gnss")
    time = _time(path, log, kind)
    with damage(path):
        # A receiver's fix is sent again until it has another.
        use = (log[kind]["fix_type"] >= 2) & np.concatenate([[True], np.diff(time) > 0])
        fix = {name: values[use] for name, values in log[kind].items()}
    if not use.any():
        raise DataError("io.no-usable-fix", file=path.name, quantity="lat, lon")

    def known(name: str, scale: float, none: int = 0) -> NDArray[Any]:
        values = fix.get(name, np.zeros(use.sum()))
        return np.where(values != none, values * scale, np.nan)

    out: Quantities = {"time": (time[use], "us")}
    out |= {"lat": (fix["lat"] * 1e-7, "deg"), "lon": (fix["lon"] * 1e-7, "deg")}
    ellipsoid = known("alt_ellipsoid", 1e-3)
    if np.isfinite(ellipsoid).all():
        out["alt"] = (ellipsoid, "m")
    else:
        out["alt_msl"] = (fix["alt"] * 1e-3, "m")
    out |= {"speed": (known("vel", 0.01, UNKNOWN), "m/s")}
    out |= {"course": (known("cog", 0.01, UNKNOWN), "deg")}
    if np.isfinite(known("h_acc", 1e-3)).any():
        out["horizontal_accuracy"] = (known("h_acc", 1e-3), "m")
        out["vertical_accuracy"] = (known("v_acc", 1e-3), "m")
        out["speed_sd"] = (known("vel_acc", 1e-3), "m/s")
    out["quality"] = (np.array([MAVLINK_QUALITY.get(int(k), 1) for k in fix["fix_type"]]), None)
    return RawLog.of(path, out, clock=RELATIVE, findings=findings)


def read_mavlink_reference(path: Path) -> pd.DataFrame:
    """Read the autopilot's own solution, if the fixes have heights over the ellipsoid."""
    log, kind, findings = _of(path, "reference")
    place, attitude, fix = log[kind], log.get("ATTITUDE"), log.get("GPS_RAW_INT", {})
    if attitude is None:
        raise NoStreamError(path.name, "reference", MAVLINK_TITLE, ["imu", "gnss"])
    use = fix["alt_ellipsoid"] != 0 if "alt_ellipsoid" in fix else np.zeros(0, dtype=bool)
    if not use.any():
        raise DataError("io.reference-height-over-sea", file=path.name, quantity="alt")
    with damage(path):
        time, own = (
            np.asarray(_time(path, log, name) * 1e-6, dtype=np.float64)
            for name in (kind, "ATTITUDE")
        )
        geoid = np.median((fix["alt_ellipsoid"][use] - fix["alt"][use]) * 1e-3)
        position = np.column_stack(
            [place["lat"] * 1e-7, place["lon"] * 1e-7, place["alt"] * 1e-3 + geoid]
        )
        velocity = np.column_stack([place[n] * 0.01 for n in ("vx", "vy", "vz")])
        angles = np.degrees(np.column_stack([attitude[n] for n in ("roll", "pitch", "yaw")]))
        euler = turned(time, own, rotation.quaternion_from_euler(angles))
    return solution(path, (time, position, velocity, euler), Clock(RELATIVE), findings)


def read_mavlink_barometer(path: Path) -> RawLog:
    """Read air pressure."""
    log, kind, findings = _of(path, "barometer")
    out: Quantities = {"time": (_time(path, log, kind), "us")}
    out["pressure"] = (log[kind]["press_abs"].astype(float), "hPa")
    return RawLog.of(path, out, clock=RELATIVE, findings=findings)

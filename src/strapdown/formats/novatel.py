"""Logs of NovAtel OEM7 and OEM6 receivers (``.gps .bin``, or as text), with SPAN.

Frames: https://docs.novatel.com/OEM7/Content/Messages/Binary.htm and
Description_of_Short_Headers.htm: AA 44 12 with a header of 28 bytes or AA 44 13 with one of 12, the
GPS week and milliseconds, the message, and a CRC of 32 bits. Messages, in Content/Logs and
SPAN_Logs: BESTPOS (height over the sea and undulation), BESTVEL (speed, course, up, and its
latency), INSPVA (height over the ellipsoid; roll, pitch, azimuth of the vehicle in deg), RAWIMU and
RAWIMUX: counts of velocity and angle in each interval, z, -y, x of the sensor, scaled by the type
of the unit (table Raw IMU Scale Factors). CORRIMU is without gravity and the Earth's rate: it is
not a sensor's output, and is not read. Stamps are GPS seconds of week. As text (Content/Messages/
ASCII.htm, Abbreviated headers aside) a line is ``#BESTPOSA,…,week,seconds,…;fields*CRC``, or with a
short header ``%RAWIMUSA,week,seconds;fields*CRC``.

HEADING, HEADING2 and DUALANTENNAHEADING (Content/Logs) have the vector from the base's antenna to
the rover's, or from the primary one to the second: its length, heading from true north, pitch and
their standard deviations in deg, used where the ambiguities are fixed. Unicore's UNIHEADINGA (N4
commands manual) has the same fields from the master antenna to the second, behind a header of its
own: ``#UNIHEADINGA,idle,GPS,status,week,milliseconds,…``.

Text exports of Inertial Explorer (NovAtel Waypoint), as a reference.

A preamble (``Program: Inertial Explorer Version …``), a line of names, a line of units, rows
(Inertial Explorer User Guide, export wizard; the columns are those of the user's profile). Used are
``GPSTime`` (seconds of the week) and ``Week``; ``Latitude``, ``Longitude`` in deg or in degrees,
minutes, seconds, ``H-Ell``; ``VNorth``, ``VEast``, ``VUp``, or ``VelBdyX``, ``VelBdyY``,
``VelBdyZ`` to the right, forward, up; ``Roll``, ``Pitch``, ``Heading`` in deg: left side up, front
up, clockwise from north.
"""

from __future__ import annotations

import re
import struct
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from strapdown import rotation
from strapdown.constants import STANDARD_GRAVITY
from strapdown.errors import DataError, Finding, add_note
from strapdown.formats.clocks import GPS, WEEK, Clock
from strapdown.formats.known_formats import (
    Quantities,
    damage,
    or_headings,
    or_sentences,
    solution,
)
from strapdown.formats.recording import NoStreamError, RawLog
from strapdown.formats.signs import Signs, first_bytes
from strapdown.formats.text_columns import decoded
from strapdown.units import LENGTHS

TITLE = "NovAtel OEM log, binary or text"
SYNCS = (b"\xaa\x44\x12", b"\xaa\x44\x13")
BESTPOS, BESTVEL, INSPVA, INSPVAS, INSPVAX = 42, 99, 507, 508, 1465
RAWIMU, RAWIMUS, RAWIMUX, RAWIMUSX, INSCONFIG = 268, 325, 1461, 1462, 1945
CORRECTED = (812, 813, 1362, 2264)
STREAMS = {"imu": (RAWIMU, RAWIMUS, RAWIMUX, RAWIMUSX), "gnss": (BESTPOS,)}
STREAMS |= {"reference": (INSPVA, INSPVAS, INSPVAX)}
HEADING, HEADING2, DUAL = 971, 1335, 2042
UNICORE = 1 << 16 | 972  # of another maker: beyond the numbers of NovAtel
STREAMS |= {"heading": (DUAL, HEADING2, HEADING, UNICORE)}
FIXED = (48, 49, 50)  # types of a position whose ambiguities are whole numbers
SOLVED = (3, 6, 7)  # states of the inertial solution: good, free, alignment complete
# Type of position to field 6 of NMEA GGA; 50s are aided by the inertial unit.
QUALITY = {16: 1, 53: 1, 17: 2, 18: 2, 52: 2, 54: 2, 19: 6, 1: 7, 2: 7}
QUALITY |= dict.fromkeys((48, 49, 50, 51, 56), 4) | dict.fromkeys((32, 33, 34, 55), 5)
QUALITY |= dict.fromkeys((68, 69, 70, 73, 74, 77, 78, 79, 80), 2)
FUSED = (19, 51, 52, 53, 54, 55, 56, 73, 74, 79, 80)
FOOT, G = LENGTHS["ft"], STANDARD_GRAVITY
# Radians and m/s of a count by the type of the unit; some counts are rates, at the unit's Hz.
_HG = (2.0**-33, 2.0**-27 * FOOT)
_KVH, _FSAS = 0.1 / (3600.0 * 256.0), float(np.radians(0.1 / 256.0 / 3600.0))
SCALES: dict[int, tuple[float, float]] = {
    **dict.fromkeys((1, 5, 11, 20, 27, 28), _HG),
    **dict.fromkeys((4, 12), (2.0**-33, 2.0**-26 * FOOT)),
    8: (2.0**-19, 2.0**-14),
    13: (_FSAS, 0.05 * 2.0**-15),
    **dict.fromkeys((16, 33), (_KVH, 0.05 * 2.0**-15)),
    **dict.fromkeys((26, 52), (1e-9, 2e-8)),
    31: (float(np.radians(720.0 / 2.0**31)), 200.0 / 2.0**31),
    **dict.fromkeys((32, 56), (float(np.radians(2.0**-21)), 2.0**-22)),
    **dict.fromkeys((58, 68, 69), (2.0**-33, 2.0**-29)),
    41: (float(np.radians(0.008 / 65536.0)) / 125.0, 0.2e-3 / 65536.0 * G / 125.0),
    62: (float(np.radians(0.008 / 65536.0)) / 200.0, 0.2e-3 / 65536.0 * G / 200.0),
    61: (float(np.radians(0.0151515 / 65536.0)) / 200.0, 0.4e-3 / 65536.0 * G / 200.0),
}
WEEK_MS = 604_800_000
Frames = dict[int, list[tuple[int, bytes]]]


#: Messages as text: number, layout of the binary message, and which of the fields of a line are
#: its values. Fields that are words or hexadecimal are in `_WORDS` and `_HEX`.
TEXTS: dict[str, tuple[int, str]] = {
    "BESTPOS": (BESTPOS, "<IIdddfI3f"),
    "BESTVEL": (BESTVEL, "<II2f3d"),
    "INSPVA": (INSPVA, "<Id9dI"),
    "INSPVAS": (INSPVAS, "<Id9dI"),
    "INSPVAX": (INSPVAX, "<II3df6d"),
    "RAWIMU": (RAWIMU, "<IdI6i"),
    "RAWIMUS": (RAWIMUS, "<IdI6i"),
    "RAWIMUX": (RAWIMUX, "<BBHdI6i"),
    "RAWIMUSX": (RAWIMUSX, "<BBHdI6i"),
    "HEADING": (HEADING, "<II6f"),
    "HEADING2": (HEADING2, "<II6f"),
    "DUALANTENNAHEADING": (DUAL, "<II6f"),
    "UNIHEADING": (UNICORE, "<II6f"),
}
#: States of a solution and of the inertial solution, types of a position, and the datum, by name
#: (tables Solution Status, Position or Velocity Type, Inertial Solution Status, Datum).
_WORDS = {"SOL_COMPUTED": 0, "NONE": 0, "WGS84": 61, "INS_INACTIVE": 0, "INS_ALIGNING": 1}
_WORDS |= {"INS_HIGH_VARIANCE": 2, "INS_SOLUTION_GOOD": 3, "INS_SOLUTION_FREE": 6}
_WORDS |= {"INS_ALIGNMENT_COMPLETE": 7, "FIXEDPOS": 1, "FIXEDHEIGHT": 2, "DOPPLER_VELOCITY": 8}
_WORDS |= {"SINGLE": 16, "PSRDIFF": 17, "WAAS": 18, "PROPAGATED": 19, "L1_FLOAT": 32}
_WORDS |= {"IONOFREE_FLOAT": 33, "NARROW_FLOAT": 34, "L1_INT": 48, "WIDE_INT": 49}
_WORDS |= {"NARROW_INT": 50, "RTK_DIRECT_INS": 51, "INS_SBAS": 52, "INS_PSRSP": 53}
_WORDS |= {"INS_PSRDIFF": 54, "INS_RTKFLOAT": 55, "INS_RTKFIXED": 56, "PPP_CONVERGING": 68}
_WORDS |= {"PPP": 69, "OPERATIONAL": 70, "INS_PPP_CONVERGING": 73, "INS_PPP": 74}
_WORDS |= {"PPP_BASIC_CONVERGING": 77, "PPP_BASIC": 78, "INS_PPP_BASIC": 80}
#: Another state than a computed solution.
_OTHER_STATE = 99
#: Field with the status of the unit, in hexadecimal, of the messages with its counts.
_STATUS = {RAWIMU: 2, RAWIMUS: 2, RAWIMUX: 4, RAWIMUSX: 4}
_LINE = re.compile(
    rb"^(?:#(\w+)A,(?:[^,;\r\n]*,){4}(\d+),(\d+\.\d+),[^;\r\n]*"
    rb"|%(\w+)A,(\d+),(\d+\.\d+)"
    rb"|#(UNI\w+)A,[^,;\r\n]*,GPS,[^,;\r\n]*,(\d+),(\d+),[^;\r\n]*)"
    rb";([^*\r\n]*)\*([0-9a-fA-F]{8})[ \t]*\r?$",
    re.M,
)


detect = Signs(
    first=rb"\xaa\x44[\x12\x13]|(?m:^[#%](?:BESTPOS|BESTVEL|INSPVA|RAWIMU)S?X?A,)"
    rb"|(?m:^#(?:UNI|DUALANTENNA)?HEADING2?A,)",
    # Two frames with their CRC.
    also=lambda path: sum(map(len, _frames(first_bytes(path, 8192))[0].values())) >= 2,
)


def _lines(data: bytes) -> tuple[Frames, int]:
    """Return the messages of a text as their binary form, and the count of damaged lines."""
    found: Frames = {}
    lost = 0
    for m in _LINE.finditer(data):
        name, week, stamp = next(m.group(k, k + 1, k + 2) for k in (1, 4, 7) if m[k])
        kind, form = TEXTS.get(name.decode(), (0, ""))
        if not kind:
            continue
        line = m[0]
        if _crc(line[1 : line.rindex(b"*")]) != int(m[11], 16):
            lost += 1
            continue
        try:
            letters = re.sub(r"(\d+)(\w)", lambda n: n[2] * int(n[1]), form[1:])
            fields = m[10].decode().split(",")[: len(letters)]
            values = [
                int(field, 16) if k == _STATUS.get(kind) else _value(field, letters[k])
                for k, field in enumerate(fields)
            ]
            message = struct.pack(form, *values)
        except (ValueError, struct.error):
            lost += 1
            continue
        ms = int(stamp) if m[7] else round(float(stamp) * 1000.0)
        found.setdefault(kind, []).append((int(week) * WEEK_MS + ms, message))
    return found, lost


def _value(field: str, letter: str) -> float:
    if field[:1].isalpha():
        return _WORDS.get(field, _OTHER_STATE)
    return float(field) if letter in "df" else int(field)


def _frames(data: bytes) -> tuple[Frames, int]:
    """Return messages by their number, with GPS ms since 1980, and the count of other bytes.

    Of a text: and the count of damaged lines.
    """
    if not any(sync in data for sync in SYNCS):
        return _lines(data)
    found: Frames = {}
    k, lost = 0, 0
    while (at := data.find(b"\xaa\x44", k)) >= 0:
        lost += at - k
        k = at
        head = data[k : k + 28]
        if head[:3] == SYNCS[0] and len(head) == 28 and head[3] >= 28:
            begin, (kind, size) = head[3], (head[4] | head[5] << 8, head[8] | head[9] << 8)
            week, ms = struct.unpack_from("<HI", head, 14)
        elif head[:3] == SYNCS[1] and len(head) >= 12:
            begin, size = 12, head[3]
            kind, week, ms = struct.unpack_from("<HHI", head, 4)
        else:
            k, lost = k + 2, lost + 2
            continue
        end = k + begin + size
        if end + 4 > len(data) or _crc(data[k:end]) != struct.unpack_from("<I", data, end)[0]:
            k, lost = k + 2, lost + 2
            continue
        found.setdefault(kind, []).append((week * WEEK_MS + ms, data[k + begin : end]))
        k = end + 4
    return found, lost + len(data) - k


def _crc(data: bytes) -> int:
    """CRC of 32 bits that begins with 0 and is not inverted."""
    return zlib.crc32(data, 0xFFFFFFFF) ^ 0xFFFFFFFF


def _read(path: Path, stream: str) -> tuple[Frames, list[Finding]]:
    with damage(path):
        frames, lost = _frames(path.read_bytes())
    findings: list[Finding] = []
    if lost:
        add_note(findings, "io.bytes-left-out", file=path.name, count=lost)
    if not any(kind in frames for kind in STREAMS[stream]):
        if stream == "imu" and any(kind in frames for kind in CORRECTED):
            raise DataError("io.novatel-corrected-only", file=path.name, quantity="imu")
        has = [s for s, kinds in STREAMS.items() if any(k in frames for k in kinds)]
        raise NoStreamError(path.name, stream, TITLE, has or ["other messages"])
    return frames, findings


def read(path: Path) -> RawLog:
    """Read the increments of the inertial unit, m/s and rad in each interval."""
    frames, findings = _read(path, "imu")
    kind = next(k for k in STREAMS["imu"][::-1] if k in frames)
    with damage(path):
        if kind in (RAWIMUX, RAWIMUSX):
            form, unit = "<BBHdI6i", frames[kind][0][1][1]
            rows = [struct.unpack_from(form, m)[2:] for _, m in frames[kind]]
        else:
            rows = [struct.unpack_from("<IdI6i", m) for _, m in frames[kind]]
            told = [m[1] for k in (RAWIMUX, RAWIMUSX) for _, m in frames.get(k, [])]
            told += [struct.unpack_from("<I", m)[0] for _, m in frames.get(INSCONFIG, [])]
            unit = told[0] if told else 0
    if unit not in SCALES:
        raise DataError("io.novatel-unit-unknown", file=path.name, quantity="imu", unit=unit)
    angle, speed = SCALES[unit]
    time = np.array([(r[0] - rows[0][0]) * WEEK + r[1] for r in rows])
    counts = np.array([r[3:] for r in rows], dtype=np.float64)
    # z, -y, x of velocity, then of angle
    turned = counts[:, [2, 1, 0, 5, 4, 3]] * np.tile([1.0, -1.0, 1.0], 2)
    columns = {"time": time}
    columns |= {f"dtheta_{a}": angle * turned[:, 3 + k] for k, a in enumerate("xyz")}
    columns |= {f"dv_{a}": speed * turned[:, k] for k, a in enumerate("xyz")}
    stated: dict[str, tuple[str, str | None]] = {"time": ("time", "s")}
    stated |= {f"dtheta_{a}": (f"gyro_{a}", "rad") for a in "xyz"}
    stated |= {f"dv_{a}": (f"accel_{a}", "m/s") for a in "xyz"}
    name = path.resolve().name
    return RawLog(
        name, (path,), columns, stated=stated, sampling="mean", clock=GPS, findings=findings
    )


@or_sentences
def read_fixes(path: Path) -> RawLog:
    """Read BESTPOS, with the velocity of BESTVEL at the same instants."""
    frames, findings = _read(path, "gnss")
    with damage(path):
        rows = [(t, *struct.unpack_from("<IIdddfI3f", m)) for t, m in frames[BESTPOS]]
        velocities = {t: struct.unpack_from("<II2f3d", m) for t, m in frames.get(BESTVEL, [])}
    kept = [r for r in rows if r[1] == 0 and r[2] != 0]
    if len(kept) < len(rows):
        code, count = "io.fixes-without-position-left-out", len(rows) - len(kept)
        add_note(findings, code, file=path.name, count=count)
    if not kept:
        raise DataError("io.no-usable-fix", file=path.name, quantity="lat, lon")
    table = np.array(kept, dtype=np.float64)
    if count := int(np.isin(table[:, 2], FUSED).sum()):
        code = "io.fixes-of-fused-receiver"
        add_note(findings, code, file=path.name, count=count)
    stamps = np.array([r[0] for r in kept], dtype=np.int64)
    time, week = stamps % WEEK_MS, stamps // WEEK_MS
    out: Quantities = {"time": (time, "ms"), "week": (week, None)}
    out |= {"lat": (table[:, 3], "deg"), "lon": (table[:, 4], "deg")}
    out["alt"] = (table[:, 5] + table[:, 6], "m")
    out |= {f"{n}_sd": (table[:, 8 + k], "m") for k, n in enumerate(("north", "east", "down"))}
    out["quality"] = (np.array([QUALITY.get(int(k), 1) for k in table[:, 2]]), None)
    ned = np.full((time.size, 3), np.nan)
    for k, stamp in enumerate(stamps.tolist()):
        if (v := velocities.get(stamp)) and v[0] == 0 and v[1] != 0:
            course = np.radians(v[5])
            ned[k] = (v[4] * np.cos(course), v[4] * np.sin(course), -v[6])
    if np.isfinite(ned).any():
        late = max((v[2] for v in velocities.values()), default=0.0)
        if late > 0.0:
            code = "io.velocity-late"
            add_note(findings, code, file=path.name, late=late)
        out |= {f"V{a}": (ned[:, k], "m/s") for k, a in enumerate("NED")}
    return RawLog.of(path, out, clock=GPS, findings=findings)


@or_headings
def read_heading(path: Path) -> RawLog:
    """Read the heading of the baseline of two antennas; its length, m, where it is stated."""
    frames, findings = _read(path, "heading")
    kind = next(k for k in STREAMS["heading"] if k in frames)
    with damage(path):
        rows = [(t, *struct.unpack_from("<II6f", m)) for t, m in frames[kind]]
    kept = [r for r in rows if r[1] == 0 and r[2] in FIXED and r[7] > 0.0]
    if count := len(rows) - len(kept):
        add_note(findings, "io.headings-left-out", file=path.name, quantity="heading", count=count)
    if not kept:
        raise DataError("io.no-usable-heading", file=path.name, quantity="heading", count=count)
    stamps = np.array([r[0] for r in kept], dtype=np.int64)
    table = np.array(kept, dtype=np.float64)
    out: Quantities = {"time": (stamps % WEEK_MS, "ms"), "week": (stamps // WEEK_MS, None)}
    out |= {"heading": (table[:, 4], "deg"), "heading_sd": (table[:, 7], "deg")}
    out["baseline"] = (np.where(table[:, 3] > 0.0, table[:, 3], np.nan), "m")
    return RawLog.of(path, out, clock=GPS, findings=findings)


def read_reference(path: Path) -> pd.DataFrame:
    """Read the inertial solution of the receiver."""
    frames, findings = _read(path, "reference")
    kind = next(k for k in STREAMS["reference"] if k in frames)
    rows = []
    with damage(path):
        for stamp, m in frames[kind]:
            if kind == INSPVAX:  # its height is over the sea
                state, _, lat, lon, sea, up, *rest = struct.unpack_from("<II3df6d", m)
                (week, ms), alt = divmod(stamp, WEEK_MS), sea + up
                second = ms * 1e-3
            else:
                week, second, lat, lon, alt, *rest, state = struct.unpack_from("<Id9dI", m)
            vn, ve, vu, roll, pitch, azimuth = rest
            if state in SOLVED:
                rows.append((week, second, lat, lon, alt, vn, ve, -vu, roll, pitch, azimuth))
    if not rows:
        raise DataError("io.solution-without-rows", file=path.name, quantity="reference")
    table = np.array(rows)
    time = table[:, 1] + WEEK * (table[:, 0] - table[0, 0])
    parts = (time, table[:, 2:5], table[:, 5:8], table[:, 8:])
    return solution(path, parts, Clock(GPS, 0.0, int(table[0, 0])), findings)


# Text exports of Inertial Explorer (NovAtel Waypoint), as a reference.


EXPLORER_TITLE = "text export of Inertial Explorer"
_UNIT = re.compile(r"\([^)]*\)|\S+")
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
PLACE, ANGLES = ("latitude", "longitude", "h-ell"), ("roll", "pitch", "heading")
LEVEL, BODY = ("vnorth", "veast", "vup"), ("velbdyx", "velbdyy", "velbdyz")
EXPLORER_UNITS = {
    "gpstime": ("sec", "s"),
    "latitude": ("deg", "+/-d m s", "d m s"),
    "h-ell": ("m",),
}
EXPLORER_UNITS |= {"longitude": EXPLORER_UNITS["latitude"], **dict.fromkeys(ANGLES, ("deg",))}
EXPLORER_UNITS |= dict.fromkeys((*LEVEL, *BODY), ("m/s",))


# The line that names the program, or names and units of angles in three numbers without it.
detect_explorer = Signs(
    first=rb"(?m)^[ \t]*Program:[ \t]+Inertial Explorer"
    rb"|\A[^\r\n]*Latitude[ \t]+Longitude[ \t]+H-Ell\b[^\r\n]*\r?\n[^\r\n]*\(\+/-D M S\)"
)


def read_explorer_reference(path: Path) -> pd.DataFrame:
    """Read position, velocity and attitude."""
    with damage(path):
        text, findings = decoded(path.read_bytes(), path.name)
        values = _values(path, text.splitlines())
    names = ("gpstime", *PLACE, *ANGLES)
    velocity = next((v for v in (LEVEL, BODY) if set(v) <= values.keys()), LEVEL)
    missing = [n for n in (*names, *velocity) if n not in values]
    if missing:
        data = {"missing": missing, "columns": list(values)}
        raise DataError("io.missing-columns-3", file=path.name, data=data)

    def block(of: tuple[str, ...]) -> Any:
        return np.column_stack([values[n] for n in of])

    euler = block(ANGLES)
    euler[:, 2] = (euler[:, 2] + 180.0) % 360.0 - 180.0
    if velocity == LEVEL:
        ned = block(LEVEL) * [1.0, 1.0, -1.0]
    else:
        forward = block(("velbdyy", "velbdyx", "velbdyz")) * [1.0, 1.0, -1.0]
        ned = rotation.rotate(rotation.quaternion_from_euler(euler), forward)
    week = values.get("week")
    time = values["gpstime"] + (0.0 if week is None else WEEK * (week - week[0]))
    clock = Clock(GPS, 0.0, None if week is None else int(week[0]))
    return solution(path, (time, block(PLACE), ned, euler), clock, findings, of_recorder=False)


def _values(path: Path, lines: list[str]) -> dict[str, Any]:
    """Return the columns of numbers by name in lower case; angles in deg."""
    at = next(
        (k for k, n in enumerate(lines) if {"latitude", "h-ell"} <= set(n.lower().split())), -1
    )
    names = lines[at].lower().split() if at >= 0 else []
    below = lines[at + 1] if 0 <= at < len(lines) - 1 else ""
    units = [u.strip("()").lower() for u in _UNIT.findall(below)]
    if len(names) == len(units) + 1 and names[-1] == "q":
        units.append("")  # the quality, the last, has none
    if not names or len(names) != len(units):
        raise DataError("io.inertial-explorer-header", file=path.name)
    for name, unit in zip(names, units, strict=True):
        if name in EXPLORER_UNITS and unit not in EXPLORER_UNITS[name]:
            quantity = {"quantity": name, "unit": unit}
            raise DataError("io.inertial-explorer-unit", file=path.name, **quantity)
    widths = [3 if unit.endswith("d m s") else 1 for unit in units]
    starts = np.cumsum([0, *widths])
    rows = []
    for k, line in enumerate(lines[at + 2 :], at + 3):
        fields = line.split()
        if not fields or not fields[0][-1].isdigit():  # blank lines, and text at the end
            continue
        if len(fields) != starts[-1]:
            width = int(starts[-1])
            raise DataError(
                "io.inertial-explorer-row", file=path.name, row=k, count=len(fields), width=width
            )
        rows.append(fields)
    if not rows:
        raise DataError("io.csv-without-rows", file=path.name, row=at + 1)
    out = {}
    for k, name in enumerate(names):
        parts = [[row[j] for row in rows] for j in range(starts[k], starts[k + 1])]
        if all(_NUMBER.fullmatch(field) for part in parts for field in part):
            first, *rest = (np.array(part, dtype=np.float64) for part in parts)
            # The sign is that of the degrees, which may be -0.
            sign = np.array([-1.0 if field.startswith("-") else 1.0 for field in parts[0]])
            small = sum(v / 60.0 ** (j + 1) for j, v in enumerate(rest))
            out[name] = sign * (np.abs(first) + small)
    return out

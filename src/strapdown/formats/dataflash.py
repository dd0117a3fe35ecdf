"""ArduPilot DataFlash logs (``.bin``, or as text ``.log``): records that the log itself describes.

File: https://ardupilot.org/dev/docs/code-overview-adding-a-new-log-message.html; messages:
https://ardupilot.org/copter/docs/logmessages.html. A record begins with A3 95 and the number of its
type; a record FMT gives each type its length, name, letters of the fields' formats, and names.
Letters c, C, e, E stand for hundredths and L for 1e-7 deg. Records FMTU and UNIT name the units.
``TimeUS`` counts µs since the start of the autopilot. IMU: rad/s and m/s² of specific force,
forward, right, down. GPS: ``Alt`` is over the sea; GPA has accuracies, and ``AEl``, the height over
the ellipsoid, or in older logs ``Und``, the geoid undulation with its sign reversed (pull request
29904 of ArduPilot). As text a line is the name of its type and its values, scaled already: ``GPS,
33200000, 3, …``. MAG: milligauss. XKF1 or NKF1 and POS: the solution of the autopilot.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.errors import DataError, Finding
from strapdown.formats.clocks import RELATIVE, Clock
from strapdown.formats.known_formats import Quantities, damage, interpolated, solution, turned
from strapdown.formats.recording import NoStreamError, RawLog
from strapdown.formats.signs import Signs

TITLE = "ArduPilot DataFlash log (.bin, .log)"
STREAMS = {"imu": "IMU", "gnss": "GPS", "reference": "POS", "magnetometer": "MAG"}
STREAMS |= {"barometer": "BARO"}
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
QUALITY = {2: 1, 3: 1, 4: 2, 5: 5, 6: 4}
UNITS = {"Gyr": "rad/s", "Acc": "m/s/s"}  # as UNIT spells them
Record = dict[str, NDArray[Any]]
# The description of descriptions, as text.
_TEXT = re.compile(rb"(?:\A|\n)FMT, ?128, ?89, ?FMT,")


# The first record describes itself.
detect = Signs(first=rb"\A\xa3\x95\x80|\AFMT, ?128, ?89, ?FMT,|\nFMT, ?128, ?89, ?FMT,")


@lru_cache(maxsize=1)
def _records(path: Path, stamp: int) -> tuple[dict[str, Record], int]:
    """Read every record by name, and count the bytes between records that are none."""
    data = path.read_bytes()
    if _TEXT.search(data[:4096]):
        return _records_of_text(data.decode("ascii", "replace"))
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
    name = STREAMS[stream]
    if name not in log:
        raise NoStreamError(path.name, stream, TITLE, [s for s, n in STREAMS.items() if n in log])
    if "TimeUS" not in log[name]:
        raise DataError("io.dataflash-without-stamps", file=path.name, quantity=f"{name} time")
    if lost:
        findings.append(Finding("io.bytes-left-out", file=path.name, severity="note", count=lost))
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


def read(path: Path) -> RawLog:
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


def read_fixes(path: Path) -> RawLog:
    """Read the fixes of the first receiver, on the clock of the sensors."""
    log, fix, findings = _log(path, "gnss")
    with damage(path):
        use = fix["Status"] >= 2
        if not use.all():
            count = int((~use).sum())
            code = "io.fixes-without-position-left-out"
            findings.append(Finding(code, file=path.name, severity="note", count=count))
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
        out["quality"] = (np.array([QUALITY.get(int(s), 1) for s in fix["Status"]]), None)
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


def read_reference(path: Path) -> pd.DataFrame:
    """Read the autopilot's own solution, if the log has heights over the ellipsoid."""
    log, place, findings = _log(path, "reference")
    state = next((log[n] for n in ("XKF1", "NKF1") if n in log), None)
    if state is None:
        raise NoStreamError(
            path.name, "reference", TITLE, [s for s, n in STREAMS.items() if n in log]
        )
    fixes = read_fixes(path).columns if "GPS" in log else {}
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


def read_magnetometer(path: Path) -> RawLog:
    """Read the magnetic field of the first compass, as corrected by the autopilot."""
    _, field, findings = _log(path, "magnetometer")
    with damage(path):
        out: Quantities = {"time": (field["TimeUS"].astype(np.int64), "us")}
        out |= {f"mag_{a.lower()}": (field[f"Mag{a}"], "mG") for a in "XYZ"}
    return RawLog.of(path, out, axes="x,y,z", clock=RELATIVE, findings=findings)


def read_barometer(path: Path) -> RawLog:
    """Read air pressure and temperature."""
    _, baro, findings = _log(path, "barometer")
    with damage(path):
        out: Quantities = {"time": (baro["TimeUS"].astype(np.int64), "us")}
        out |= {"pressure": (baro["Press"], "Pa"), "temperature": (baro["Temp"], "degC")}
    return RawLog.of(path, out, clock=RELATIVE, findings=findings)

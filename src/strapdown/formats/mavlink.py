"""Telemetry logs of MAVLink (``.tlog``), as ground stations keep them, by pymavlink.

A record is the time of arrival, µs since 1970 in eight bytes, most significant first, and a frame
of MAVLink 1 or 2 (https://mavlink.io/en/guide/serialization.html). Messages, units and axes are
those of https://mavlink.io/en/messages/common.html, body axes forward, right, down:

- IMU: HIGHRES_IMU (m/s², rad/s), else SCALED_IMU (mG, mrad/s), else RAW_IMU, whose unit MAVLink
  leaves open;
- fixes: GPS_RAW_INT: 1e-7 deg, mm over the sea, and in MAVLink 2 mm over the ellipsoid and
  accuracies, which are zero where the autopilot does not fill them in;
- reference: ATTITUDE and GLOBAL_POSITION_INT, the autopilot's own solution;
- barometer: SCALED_PRESSURE (hPa).

Stamps are those of the autopilot since its start; SYSTEM_TIME relates those of 1970 to them.
pymavlink is under the LGPL: it is imported where it is installed (extra ``mavlink``), and no part
is copied here.
"""

from __future__ import annotations

import struct
from collections import Counter
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.errors import DataError, Finding
from strapdown.formats.clocks import RELATIVE, Clock
from strapdown.formats.known_formats import Quantities, damage, solution, turned
from strapdown.formats.recording import NoStreamError, RawLog, library
from strapdown.formats.signs import Signs, first_bytes

TITLE = "telemetry log of MAVLink (.tlog)"
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
IMUS = ("HIGHRES_IMU", "SCALED_IMU", "RAW_IMU")
STREAMS = {"imu": IMUS, "gnss": ("GPS_RAW_INT",), "reference": ("GLOBAL_POSITION_INT",)}
STREAMS |= {"barometer": ("SCALED_PRESSURE",)}
#: Kind of a fix to field 6 of NMEA GGA.
QUALITY = {2: 1, 3: 1, 4: 2, 5: 5, 6: 4, 7: 4, 8: 3}
UNKNOWN = 65535  # of a speed and a course
#: 2000 to 2045 in µs since 1970; a clock since a start never counts so far.
FIRST, LAST = 946_684_800_000_000, 2_366_841_600_000_000
HEAD = 8  # bytes of a stamp
Fields = dict[str, NDArray[Any]]


def _begins(path: Path) -> bool:
    """Whether there are two records, each a stamp of these decades and a frame."""
    return len(list(_frames(first_bytes(path, 1024), most=2))) == 2


detect = Signs(first=rb"\A.{8,1023}?[\xfd\xfe]", also=_begins)


def _frames(data: bytes, most: int | None = None) -> Iterator[tuple[int, bytes]]:
    """Yield number and bytes of each frame; what is between records is passed over."""
    k, count = 0, 0
    while k + HEAD + 8 <= len(data) and (most is None or count < most):
        stamp, marker = struct.unpack_from(">QB", data, k)
        size = 0
        if FIRST < stamp < LAST and marker in (0xFD, 0xFE):
            length = data[k + HEAD + 1]
            signed = 13 if marker == 0xFD and data[k + HEAD + 2] & 1 else 0
            size = length + signed + (12 if marker == 0xFD else 8)
        if not size or k + HEAD + size > len(data):
            if most is not None:  # a file of this kind begins with a record
                return
            k += 1
            continue
        frame = data[k + HEAD : k + HEAD + size]
        number = int.from_bytes(frame[7:10], "little") if marker == 0xFD else frame[5]
        yield number, frame
        k, count = k + HEAD + size, count + 1


@lru_cache(maxsize=1)
def _messages(path: Path, stamp: int) -> tuple[dict[str, Fields], list[Finding]]:
    """Read the fields of the messages of the vehicle, by their names."""
    dialect = library("pymavlink.dialects.v20.ardupilotmega", path, "mavlink")
    parser, held, lost = dialect.MAVLink(None), [], 0
    for number, frame in _frames(path.read_bytes()):
        if number in IDS:
            try:
                held.append(parser.decode(bytearray(frame)))
            except dialect.MAVError:
                lost += 1
    findings = []
    systems = Counter(m.get_srcSystem() for m in held)
    if len(systems) > 1:
        vehicle = systems.most_common(1)[0][0]
        held = [m for m in held if m.get_srcSystem() == vehicle]
        others = sorted(set(systems) - {vehicle})
        findings.append(
            Finding(
                "io.mavlink-one-of-systems",
                severity="note",
                file=path.name,
                system=vehicle,
                others=others,
            )
        )
    if lost:
        findings.append(
            Finding("io.mavlink-frames-left-out", severity="note", file=path.name, count=lost)
        )
    out: dict[str, Fields] = {}
    for name in IDS.values():
        rows = [m for m in held if m.get_type() == name]
        # Several units of a vehicle send the same message; the first that is there counts.
        rows = [m for m in rows if m.get_srcComponent() == rows[0].get_srcComponent()]
        if rows:
            out[name] = {n: np.array([getattr(m, n) for m in rows]) for n in rows[0].fieldnames}
    return out, findings


def _of(path: Path, stream: str) -> tuple[dict[str, Fields], str, list[Finding]]:
    """Return all messages, the name of the first kind of a stream that is there, and findings."""
    with damage(path):
        log, findings = _messages(path.resolve(), path.stat().st_mtime_ns)
    kind = next((name for name in STREAMS[stream] if name in log), None)
    if kind is None:
        has = [s for s, kinds in STREAMS.items() if set(kinds) & set(log)]
        raise NoStreamError(path.name, stream, TITLE, has or ["other messages"])
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


def read(path: Path) -> RawLog:
    """Read rates and specific force; where the messages have one, the magnetic field."""
    log, kind, findings = _of(path, "imu")
    fields = log[kind]
    units = {
        "HIGHRES_IMU": ("rad/s", "m/s2", "gauss"),
        "SCALED_IMU": ("mrad/s", "mg", "mG"),
        "RAW_IMU": (None, None, None),
    }[kind]
    out: Quantities = {"time": (_time(path, log, kind), "us")}
    for triad, unit in zip(("gyro", "accel"), units[:2], strict=True):
        short = triad.removesuffix("el")
        out |= {f"{triad}_{a}": (fields[f"{a}{short}"].astype(float), unit) for a in "xyz"}
    if units[2] and any(fields[f"{a}mag"].any() for a in "xyz"):
        out |= {f"mag_{a}": (fields[f"{a}mag"].astype(float), units[2]) for a in "xyz"}
    return RawLog.of(path, out, axes="x,y,z", clock=RELATIVE, findings=findings)


def read_fixes(path: Path) -> RawLog:
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
    out["quality"] = (np.array([QUALITY.get(int(k), 1) for k in fix["fix_type"]]), None)
    return RawLog.of(path, out, clock=RELATIVE, findings=findings)


def read_reference(path: Path) -> pd.DataFrame:
    """Read the autopilot's own solution, if the fixes have heights over the ellipsoid."""
    log, kind, findings = _of(path, "reference")
    place, attitude, fix = log[kind], log.get("ATTITUDE"), log.get("GPS_RAW_INT", {})
    if attitude is None:
        raise NoStreamError(path.name, "reference", TITLE, ["imu", "gnss"])
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


def read_barometer(path: Path) -> RawLog:
    """Read air pressure."""
    log, kind, findings = _of(path, "barometer")
    out: Quantities = {"time": (_time(path, log, kind), "us")}
    out["pressure"] = (log[kind]["press_abs"].astype(float), "hPa")
    return RawLog.of(path, out, clock=RELATIVE, findings=findings)

"""Streams of u-blox receivers (``.ubx``), alone or mixed with NMEA and RTCM, by pyubx2.

Messages: interface descriptions of u-blox M8, F9 and M10, for example UBX-19056845. A frame is
B5 62, class, number, length, payload and two bytes of checksum. Fixes are NAV-PVT, or NAV-PVAT of a
receiver with an inertial unit: deg, mm over the ellipsoid, mm/s, and ``iTOW``, ms of the GPS week;
NAV-HPPOSLLH of the same instant has the position in steps of 0.1 mm. NAV-PVAT also has roll, pitch
and heading of the vehicle (forward, right, down). ESF-MEAS has one sensor a field: deg/s in steps
of 2^-12, m/s² in steps of 2^-10, the speed of a wheel in mm/s, in axes of the unit on its board, at
time tags in ms of the receiver's own clock, which the order of the messages relates to GPS time, to
the time that the receiver needs for a fix. ESF-RAW has time tags of an undocumented unit, and is
not read.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Iterator
from datetime import UTC, datetime
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from strapdown.errors import DataError, Finding
from strapdown.formats.clocks import GPS, RELATIVE, WEEK, Clock, gps_from_unix
from strapdown.formats.join import join
from strapdown.formats.known_formats import Quantities, damage, solution
from strapdown.formats.recording import NoStreamError, RawLog, library
from strapdown.formats.signs import Signs, first_bytes

TITLE = "u-blox UBX stream"
SYNC, MOST_PAYLOAD = b"\xb5\x62", 8192
LEAST_FRAMES = 3  # of a stream that begins with something else
PVT, PVAT, MEAS, RAW = b"\x01\x07", b"\x01\x17", b"\x10\x02", b"\x10\x03"
PRECISE = b"\x01\x14"  # NAV-HPPOSLLH
NAMES = {
    "precise": (PRECISE,),
    "gnss": (PVT, PVAT),
    "reference": (PVAT,),
    "imu": (MEAS,),
    "wheel": (MEAS,),
}
GYRO, ACCEL, SPEED = (14, 13, 5), (16, 17, 18), 11  # types of data, x y z
SCALES = {**dict.fromkeys(GYRO, 2.0**-12), **dict.fromkeys(ACCEL, 2.0**-10), SPEED: 1e-3}


def _has_frames(path: Path) -> bool:
    """Whether a frame with its checksum is at the start, or several are among other lines."""
    head = first_bytes(path, 65536)
    frames = list(islice(_frames(head), LEAST_FRAMES))
    return len(frames) == LEAST_FRAMES or bool(frames and head.startswith(SYNC))


detect = Signs(first=re.escape(SYNC), also=_has_frames)


def _frames(data: bytes) -> Iterator[bytes]:
    """Yield whole frames with a right checksum."""
    k = 0
    while (k := data.find(SYNC, k)) >= 0 and k + 8 <= len(data):
        end = k + 8 + struct.unpack_from("<H", data, k + 4)[0]
        body = data[k + 2 : end - 2]
        if end > len(data) or len(body) > MOST_PAYLOAD or _sum(body) != data[end - 2 : end]:
            k += 2
            continue
        yield data[k:end]
        k = end


def _sum(body: bytes) -> bytes:
    """Fletcher's checksum of 8 bits."""
    octets = np.frombuffer(body, dtype=np.uint8).astype(np.int64)
    first = np.cumsum(octets)
    return bytes([int(first[-1]) & 255, int(first.sum()) & 255])


def _messages(path: Path, stream: str) -> list[Any]:
    """Parse the messages of a stream: of the kinds that it may have, the first that is there."""
    ubx = library("pyubx2", path)
    with damage(path):
        frames: dict[bytes, list[bytes]] = {}
        for frame in _frames(path.read_bytes()):
            frames.setdefault(frame[2:4], []).append(frame)
        kind = next((k for k in NAMES[stream] if k in frames), None)
        if kind is None:
            if stream == "imu" and RAW in frames:
                raise DataError("io.ubx-raw-only", file=path.name, quantity="imu")
            if stream == "precise":
                return []
            has = [s for s, kinds in NAMES.items() if any(k in frames for k in kinds)]
            has = [s for s in has if s != "precise"]
            raise NoStreamError(path.name, stream, TITLE, has or ["other messages"])
        return [ubx.UBXReader.parse(frame) for frame in frames[kind]]


def _solved(path: Path, stream: str) -> tuple[list[Any], Quantities, list[Finding]]:
    """Return the messages with a position, their seconds of week and week, and findings."""
    messages = _messages(path, stream)
    with damage(path):
        fixed = [m for m in messages if m.fixType in (1, 2, 3, 4) and _ok(m)]
        tow = np.array([m.iTOW for m in fixed], dtype=np.int64)
        week = np.array([_week(m) for m in fixed])
    if not fixed:
        raise DataError("io.no-usable-fix", file=path.name, quantity="lat, lon")
    findings = []
    if lost := len(messages) - len(fixed):
        code = "io.fixes-without-position-left-out"
        findings.append(Finding(code, file=path.name, severity="note", count=lost))
    if any(m.fixType in (1, 4) for m in fixed):
        count = sum(m.fixType in (1, 4) for m in fixed)
        code = "io.fixes-of-fused-receiver"
        findings.append(Finding(code, file=path.name, severity="note", count=count))
    times: Quantities = {"time": (tow, "ms")}
    if np.isfinite(week).all():
        times["week"] = (week, None)
    return fixed, times, findings


def _ok(message: Any) -> bool:
    return bool(getattr(message, "gnssFixOk", 0) or getattr(message, "gnssFixOK", 0))


def _week(message: Any) -> float:
    """GPS week by the date; it is nearest to the seconds of week."""
    if not (message.validDate and message.validTime):
        return np.nan
    hour = datetime(message.year, message.month, message.day, message.hour, tzinfo=UTC)
    second = getattr(message, "second", None)
    second = message.sec if second is None else second
    unix = np.array([hour.timestamp() + 60.0 * message.min + second])
    return float(np.round((gps_from_unix(unix)[0] - message.iTOW * 1e-3) / WEEK))


def read_fixes(path: Path) -> RawLog:
    """Read the fixes, at GPS seconds of week."""
    fixed, out, findings = _solved(path, "gnss")
    with damage(path):
        precise = {m.iTOW: m for m in _messages(path, "precise") if not m.invalidLlh}

        def values(name: str) -> Any:
            finer = name in ("lat", "lon", "height", "hAcc", "vAcc")
            chosen = [precise.get(m.iTOW, m) if finer else m for m in fixed]
            return np.array([getattr(m, name) for m in chosen], dtype=np.float64)

        out |= {"lat": (values("lat"), "deg"), "lon": (values("lon"), "deg")}
        out |= {"alt": (values("height"), "mm"), "horizontal_accuracy": (values("hAcc"), "mm")}
        out |= {"vertical_accuracy": (values("vAcc"), "mm")}
        for axis in "NED":
            out[f"V{axis}"] = (values(f"vel{axis}"), "mm/s")
            out[f"V{axis}_sd"] = (values("sAcc"), "mm/s")
        out["quality"] = (np.array([_quality(m) for m in fixed]), None)
    return RawLog.of(path, out, clock=GPS, findings=findings)


def _quality(message: Any) -> int:
    """Field 6 of NMEA GGA."""
    if message.fixType == 1:
        return 6
    return {2: 4, 1: 5}.get(message.carrSoln, 2 if message.diffSoln else 1)


def read_reference(path: Path) -> pd.DataFrame:
    """Read the receiver's own solution with attitude."""
    fixed, times, findings = _solved(path, "reference")
    with damage(path):
        whole = [bool(m.vehRollValid and m.vehPitchValid and m.vehHeadingValid) for m in fixed]
        names = ["lat", "lon", "height", "velN", "velE", "velD"]
        names += ["vehRoll", "vehPitch", "vehHeading"]
        table = np.array([[getattr(m, n) for n in names] for m in fixed], dtype=np.float64)
    table[:, 2:6] *= 1e-3
    table[~np.array(whole), 6:] = np.nan
    week = times.get("week", (np.full(len(fixed), np.nan), None))[0]
    first = int(week[0]) if np.isfinite(week[0]) else None
    time = times["time"][0] * 1e-3 + (0.0 if first is None else WEEK * (week - week[0]))
    parts = (time, table[:, :3], table[:, 3:6], table[:, 6:])
    return solution(path, parts, Clock(GPS, 0.0, first), findings)


def _measured(path: Path, stream: str, kinds: tuple[int, ...]) -> tuple[Any, Any]:
    """Return time tags (ms), and values of the messages that hold all of some types of data."""
    tags, rows = [], []
    messages = _messages(path, stream)
    with damage(path):
        for m in messages:
            held = {}
            for k in range(1, m.numMeas + 1):
                kind, field = getattr(m, f"dataType_{k:02d}"), getattr(m, f"dataField_{k:02d}")
                value = int.from_bytes(field, "little") if isinstance(field, bytes) else int(field)
                held[kind] = value - (1 << 24 if value >= 1 << 23 else 0)
            if all(kind in held for kind in kinds):
                tags.append(m.timeTag)
                rows.append([held[kind] * SCALES[kind] for kind in kinds])
    return np.array(tags, dtype=np.int64), np.array(rows).reshape(-1, len(kinds))


def read(path: Path) -> RawLog:
    """Read rates and specific force, each on its own time tags, on those of the gyro."""
    lag = _lag(path)
    code = "io.ubx-own-clock" if lag is None else "io.ubx-clock-by-order"
    findings = [Finding(code, file=path.name, quantity="time", severity="note")]
    logs = []
    for triad, kinds, unit in (("gyro", GYRO, "deg/s"), ("accel", ACCEL, "m/s2")):
        tags, values = _measured(path, "imu", kinds)
        if not tags.size:
            if triad == "gyro":
                raise NoStreamError(path.name, "imu", TITLE, ["wheel"])
            continue
        out: Quantities = {"time": (tags - (lag or 0), "ms")}
        out |= {f"{triad}_{a}": (values[:, k], unit) for k, a in enumerate("xyz")}
        logs.append(RawLog.of(path, out, findings=findings))
        findings = []
    raw = join(logs, path.name, (path,)) if len(logs) > 1 else logs[0]
    raw.clock = RELATIVE if lag is None else GPS
    return raw


def _lag(path: Path) -> int | None:
    """Return what time tags of the gyro are ahead of GPS seconds of week, ms; None without fixes.

    By the order of the messages: a fix is written after the last sample before it, by the time
    that the receiver needs for it.
    """
    ubx, tag, lags = library("pyubx2", path), None, []
    with damage(path):
        for frame in _frames(path.read_bytes()):
            if frame[2:4] == MEAS:
                count = struct.unpack_from("<H", frame, 10)[0] >> 11
                words = struct.unpack_from(f"<{count}I", frame, 14)
                if {w >> 24 & 63 for w in words} >= set(GYRO):
                    tag = struct.unpack_from("<I", frame, 6)[0]
            elif frame[2:4] in (PVT, PVAT) and tag is not None:
                message = ubx.UBXReader.parse(frame)
                if _ok(message):
                    lags.append(tag - int(message.iTOW))
    return int(np.median(lags)) if lags else None


def read_wheel(path: Path) -> RawLog:
    """Read the speed of the vehicle's wheels."""
    tags, values = _measured(path, "wheel", (SPEED,))
    if not tags.size:
        raise NoStreamError(path.name, "wheel", TITLE, ["imu"])
    return RawLog.of(path, {"time": (tags, "ms"), "speed": (values[:, 0], "m/s")}, clock=RELATIVE)

"""Binary files of receivers with inertial units, and of their processing: UBX, SBF, SBET."""

from __future__ import annotations

import binascii
import re
import struct
from datetime import UTC, datetime
from itertools import islice
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.earth import radii_of_curvature
from strapdown.errors import DataError, Finding, add_note
from strapdown.formats.clocks import GPS, RELATIVE, WEEK, Clock, gps_from_unix
from strapdown.formats.join import join
from strapdown.formats.known_formats import (
    Quantities,
    damage,
    or_headings,
    or_sentences,
    solution,
)
from strapdown.formats.recording import NoStreamError, RawLog
from strapdown.formats.signs import Signs, first_bytes
from strapdown.frames import C_ne, geodetic_from_ecef
from strapdown.parsers import parse
from strapdown.parsers.recorders import UBX_SYNC, ubx_frames
from strapdown.tables.checks import Array

# Streams of u-blox receivers (``.ubx``), alone or mixed with NMEA and RTCM, by pyubx2.
#
# Messages: interface descriptions of u-blox M8, F9 and M10, for example UBX-19056845. A frame is
# B5 62, class, number, length, payload and two bytes of checksum. Fixes are NAV-PVT, or NAV-PVAT
# of a receiver with an inertial unit: deg, mm over the ellipsoid, mm/s, and ``iTOW``, ms of the
# GPS week; NAV-HPPOSLLH of the same instant has the position in steps of 0.1 mm. NAV-PVAT also
# has roll, pitch and heading of the vehicle (forward, right, down). ESF-MEAS has one sensor a
# field: deg/s in steps of 2^-12, m/s² in steps of 2^-10, the speed of a wheel in mm/s, in axes of
# the unit on its board, at time tags in ms of the receiver's own clock, which the order of the
# messages relates to GPS time, to the time that the receiver needs for a fix. ESF-RAW has time
# tags of an undocumented unit, and is not read. NAV-RELPOSNED of version 1 (UBX-18010854, HPG 1.12
# and later: 64 bytes) has the vector from the base's antenna to the rover's: its heading and the
# accuracy of that in 1e-5 deg, its length in cm and 0.1 mm. It is used where the base moves along
# (``isMoving``), the ambiguities are fixed (``carrSoln`` 2) and the heading is valid.


UBX_TITLE = "u-blox UBX stream"
LEAST_FRAMES = 3  # of a stream that begins with something else
PVT, PVAT, MEAS, RAW = b"\x01\x07", b"\x01\x17", b"\x10\x02", b"\x10\x03"
PRECISE = b"\x01\x14"  # NAV-HPPOSLLH
RELATIVE_POSITION = b"\x01\x3c"  # NAV-RELPOSNED
#: Bits of its flags: fix, relative position, fixed ambiguities of two bits, moving base, heading;
#: those of them that must be set; and the bit of a vector of unit length.
USED_BITS, WANTED_BITS, UNIT_LENGTH = 0x13D, 0x135, 0x200
NAMES = {
    "precise": (PRECISE,),
    "gnss": (PVT, PVAT),
    "reference": (PVAT,),
    "imu": (MEAS,),
    "wheel": (MEAS,),
    "heading": (RELATIVE_POSITION,),
}
GYRO, ACCEL, SPEED = (14, 13, 5), (16, 17, 18), 11  # types of data, x y z
SCALES = {**dict.fromkeys(GYRO, 2.0**-12), **dict.fromkeys(ACCEL, 2.0**-10), SPEED: 1e-3}


def _has_frames(path: Path) -> bool:
    """Whether a frame with its checksum is at the start, or several are among other lines."""
    head = first_bytes(path, 65536)
    frames = list(islice(ubx_frames(head), LEAST_FRAMES))
    return len(frames) == LEAST_FRAMES or bool(frames and head.startswith(UBX_SYNC))


detect_ubx = Signs(first=re.escape(UBX_SYNC), also=_has_frames)


def _messages(path: Path, stream: str) -> list[Any]:
    """Parse the messages of a stream: of the kinds that it may have, the first that is there."""
    with damage(path):
        frames = {frame[2:4] for frame in ubx_frames(path.read_bytes())}
        kind = next((k for k in NAMES[stream] if k in frames), None)
        if kind is None:
            if stream == "imu" and RAW in frames:
                raise DataError("io.ubx-raw-only", file=path.name, quantity="imu")
            if stream == "precise":
                return []
            has = [s for s, kinds in NAMES.items() if any(k in frames for k in kinds)]
            has = [s for s in has if s != "precise"]
            raise NoStreamError(path.name, stream, UBX_TITLE, has or ["other messages"])
    return _parsed(path, kind)


def _parsed(path: Path, kind: bytes) -> list[Any]:
    """Return the messages of a kind, with their fields as attributes."""
    found = parse("recorders.ubx", path, kind=kind.hex())
    return [SimpleNamespace(**fields) for fields in found]


def _solved(path: Path, stream: str) -> tuple[list[Any], Quantities, list[Finding]]:
    """Return the messages with a position, their seconds of week and week, and findings."""
    messages = _messages(path, stream)
    with damage(path):
        fixed = [m for m in messages if m.fixType in (1, 2, 3, 4) and _ok(m)]
        tow = np.array([m.iTOW for m in fixed], dtype=np.int64)
        week = np.array([_week(m) for m in fixed])
    if not fixed:
        raise DataError("io.no-usable-fix", file=path.name, quantity="lat, lon")
    findings: list[Finding] = []
    if lost := len(messages) - len(fixed):
        code = "io.fixes-without-position-left-out"
        add_note(findings, code, file=path.name, count=lost)
    if any(m.fixType in (1, 4) for m in fixed):
        count = sum(m.fixType in (1, 4) for m in fixed)
        code = "io.fixes-of-fused-receiver"
        add_note(findings, code, file=path.name, count=count)
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


@or_sentences
def read_ubx_fixes(path: Path) -> RawLog:
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
        out["satellites"] = (np.array([getattr(m, "numSV", np.nan) for m in fixed]), None)
    return RawLog.of(path, out, clock=GPS, findings=findings)


def _quality(message: Any) -> int:
    """Field 6 of NMEA GGA."""
    if message.fixType == 1:
        return 6
    return {2: 4, 1: 5}.get(message.carrSoln, 2 if message.diffSoln else 1)


def read_ubx_reference(path: Path) -> pd.DataFrame:
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


def read_ubx(path: Path) -> RawLog:
    """Read rates and specific force, each on its own time tags, on those of the gyro."""
    lag = _lag(path)
    code = "io.ubx-own-clock" if lag is None else "io.ubx-clock-by-order"
    findings = [Finding(code, file=path.name, quantity="time", severity="note")]
    logs = []
    for triad, kinds, unit in (("gyro", GYRO, "deg/s"), ("accel", ACCEL, "m/s2")):
        tags, values = _measured(path, "imu", kinds)
        if not tags.size:
            if triad == "gyro":
                raise NoStreamError(path.name, "imu", UBX_TITLE, ["wheel"])
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
    tag, lags = None, []
    messages = {kind: iter(_parsed(path, kind)) for kind in (PVT, PVAT)}
    with damage(path):
        for frame in ubx_frames(path.read_bytes()):
            if frame[2:4] == MEAS:
                count = struct.unpack_from("<H", frame, 10)[0] >> 11
                words = struct.unpack_from(f"<{count}I", frame, 14)
                if {w >> 24 & 63 for w in words} >= set(GYRO):
                    tag = struct.unpack_from("<I", frame, 6)[0]
            elif frame[2:4] in messages:
                message = next(messages[frame[2:4]])
                if tag is not None and _ok(message):
                    lags.append(tag - int(message.iTOW))
    return int(np.median(lags)) if lags else None


def read_ubx_wheel(path: Path) -> RawLog:
    """Read the speed of the vehicle's wheels."""
    tags, values = _measured(path, "wheel", (SPEED,))
    if not tags.size:
        raise NoStreamError(path.name, "wheel", UBX_TITLE, ["imu"])
    return RawLog.of(path, {"time": (tags, "ms"), "speed": (values[:, 0], "m/s")}, clock=RELATIVE)


@or_headings
def read_ubx_heading(path: Path) -> RawLog:
    """Read the heading of the baseline of a moving base, at GPS seconds of week."""
    dated: tuple[float, int] | None = None
    rows, lost = [], 0
    with damage(path):
        data = path.read_bytes()
        for frame in ubx_frames(data):
            body = frame[6:-2]
            if frame[2:4] == PVT and len(body) >= 12 and dated is None:
                tow, year, *rest, valid = struct.unpack_from("<IH6B", body)
                names = ("month", "day", "hour", "min", "sec")
                date = dict(zip(names, rest, strict=True)) | {"iTOW": tow, "year": year}
                both = {"validDate": valid & 1, "validTime": valid & 2}
                found = _week(SimpleNamespace(**date, **both))
                dated = (found, tow) if np.isfinite(found) else None
            if frame[2:4] != RELATIVE_POSITION or len(body) != 64 or body[0] != 1:
                continue
            tow, _, _, _, cm, angle, *_, tenths, _, _, _, _, sd, flags = struct.unpack(
                "<4xI5i4x4b5I4xI", body
            )
            if flags & USED_BITS != WANTED_BITS or not sd:
                lost += 1
                continue
            length = np.nan if flags & UNIT_LENGTH else 1e-2 * cm + 1e-4 * tenths
            rows.append((tow, angle, sd, length))
    if not rows and not lost:
        held = {frame[2:4] for frame in ubx_frames(data)}
        has = [s for s, kinds in NAMES.items() if any(k in held for k in kinds)]
        has = [s for s in has if s not in ("precise", "heading")]
        raise NoStreamError(path.name, "heading", UBX_TITLE, has or ["other messages"])
    findings: list[Finding] = []
    if lost:
        add_note(findings, "io.headings-left-out", file=path.name, quantity="heading", count=lost)
    if not rows:
        raise DataError("io.no-usable-heading", file=path.name, quantity="heading", count=lost)
    tow, angle, sd, length = np.array(rows, dtype=np.float64).T
    out: Quantities = {"time": (tow, "ms"), "heading": (angle, "1e-5 deg")}
    out |= {"heading_sd": (sd, "1e-5 deg"), "baseline": (length, "m")}
    if dated is not None:  # within half a week
        out["week"] = (dated[0] + np.round((dated[1] - tow) / WEEK_MS), None)
    return RawLog.of(path, out, clock=GPS, findings=findings)


# Septentrio Binary Format (``.sbf``).
#
# Blocks: SBF Reference Guide of the receivers (mosaic-G5, AsteRx). A block begins with ``$@``, a
# CRC of 16 bits, its number and its length, GPS time of week in ms and week. PVTGeodetic has rad,
# m over the ellipsoid and m/s north, east, up; PosCovGeodetic and VelCovGeodetic the variances;
# the Cartesian blocks the same in WGS 84, Earth-centered. ExtSensorMeas has angular rate in deg/s
# and acceleration in m/s² of an inertial unit, at the receiver's time, in the axes of the unit,
# which its setup relates to the vehicle. A value of -2e10 is not known.


SBF_TITLE = "Septentrio SBF"
SBF_SYNC = b"$@"
LEAST_BLOCKS = 3  # of a stream that begins with something else
CARTESIAN, GEODETIC, SENSORS = (4006, 5905, 5907), (4007, 5906, 5908), 4050
UNKNOWN = -2e10
RATE, FORCE = 1, 0  # types of a measurement
# Kind of solution to field 6 of NMEA GGA: alone, differential, fixed position, RTK fixed and float,
# SBAS, the same of a moving base, PPP.
QUALITY = {1: 1, 2: 2, 3: 7, 4: 4, 5: 5, 6: 2, 7: 4, 8: 5, 10: 2}
WEEK_MS = 604_800_000
Blocks = dict[int, list[tuple[int, bytes]]]


def _has_blocks(path: Path) -> bool:
    """Whether a block with its CRC is at the start, or several are among other lines."""
    head = first_bytes(path, 65536)
    count = sum(map(len, _blocks(head).values()))
    return count >= LEAST_BLOCKS or bool(count and head.startswith(SBF_SYNC))


detect_sbf = Signs(first=re.escape(SBF_SYNC), also=_has_blocks)


def _blocks(data: bytes) -> Blocks:
    """Return the blocks by their numbers, each with its GPS ms since 1980."""
    found: Blocks = {}
    k = 0
    while (k := data.find(SBF_SYNC, k)) >= 0 and k + 14 <= len(data):
        crc, kind, size, tow, week = struct.unpack_from("<HHHIH", data, k + 2)
        whole = size >= 14 and size % 4 == 0 and k + size <= len(data)
        if not whole or binascii.crc_hqx(data[k + 4 : k + size], 0) != crc:
            k += 2
            continue
        if tow != 0xFFFFFFFF and week != 0xFFFF:
            body = data[k + 14 : k + size]
            found.setdefault(kind & 0x1FFF, []).append((week * WEEK_MS + tow, body))
        k += size
    return found


def _read(path: Path, stream: str) -> Blocks:
    with damage(path):
        found = _blocks(path.read_bytes())
    has = {"imu": SENSORS in found, "gnss": GEODETIC[0] in found or CARTESIAN[0] in found}
    if not has[stream]:
        there = [s for s, is_there in has.items() if is_there]
        raise NoStreamError(path.name, stream, SBF_TITLE, there or ["other blocks"])
    return found


@or_sentences
def read_sbf_fixes(path: Path) -> RawLog:
    """Read position, velocity and their standard deviations."""
    found = _read(path, "gnss")
    kinds = GEODETIC if GEODETIC[0] in found else CARTESIAN
    with damage(path):
        rows = {t: struct.unpack_from("<BB3d4f", b) for t, b in found[kinds[0]]}
        use = {t: r for t, r in rows.items() if r[0] & 15 and not r[1] and r[2] > UNKNOWN}
        if not use:
            raise DataError("io.no-usable-fix", file=path.name, quantity="lat, lon")
        time = np.array(list(use), dtype=np.int64)
        table = np.array(list(use.values()), dtype=np.float64)
        table[table == UNKNOWN] = np.nan
        variances = [_variance(dict(found.get(kind, [])), time) for kind in kinds[1:]]
    place, velocity = table[:, 2:5], table[:, 6:9]
    if kinds == CARTESIAN:
        place = geodetic_from_ecef(place)
        turn = np.asarray(C_ne(place[:, 0], place[:, 1]))
        velocity = np.einsum("nij,nj->ni", turn, velocity)
        variances = [np.einsum("nij,njk,nlk->nil", turn, v, turn) for v in variances]
    else:
        place = place * [np.degrees(1.0), np.degrees(1.0), 1.0]
        velocity = velocity * [1.0, 1.0, -1.0]
    out: Quantities = {"time": (time % WEEK_MS, "ms"), "week": (time // WEEK_MS, None)}
    out |= {n: (place[:, k], u) for k, (n, u) in enumerate((("lat", "deg"), ("lon", "deg")))}
    out["alt"] = (place[:, 2], "m")
    out["quality"] = (np.array([QUALITY.get(int(r) & 15, 1) for r in table[:, 0]]), None)
    if np.isfinite(velocity).any():
        out |= {f"V{a}": (velocity[:, k], "m/s") for k, a in enumerate("NED")}
    heads = (("north_sd", "east_sd", "down_sd"), ("VN_sd", "VE_sd", "VD_sd"))
    for names, variance, unit in zip(heads, variances, ("m", "m/s"), strict=True):
        sd = np.sqrt(np.diagonal(variance, axis1=1, axis2=2))
        if np.isfinite(sd).any():
            out |= {n: (sd[:, k], unit) for k, n in enumerate(names)}
    findings: list[Finding] = []
    if lost := len(rows) - len(use):
        code = "io.fixes-without-position-left-out"
        add_note(findings, code, file=path.name, count=lost)
    return RawLog.of(path, out, clock=GPS, findings=findings)


def _variance(blocks: dict[int, bytes], time: NDArray[np.int64]) -> Array:
    """Covariance of three axes at each stamp, (n, 3, 3); NaN where there is none."""
    out = np.full((time.size, 3, 3), np.nan)
    for k, stamp in enumerate(time.tolist()):
        if stamp not in blocks:
            continue
        _, error, xx, yy, zz, _, xy, xz, _, yz = struct.unpack_from("<BB8f", blocks[stamp])
        block = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        if not error and (block > UNKNOWN).all():
            out[k] = block
    return out


def read_sbf(path: Path) -> RawLog:
    """Read rates and specific force of the inertial unit."""
    found = _read(path, "imu")
    values: dict[int, dict[int, Any]] = {RATE: {}, FORCE: {}}
    with damage(path):
        for time, body in found[SENSORS]:
            count, size = body[0], body[1]
            for at in range(2, 2 + count * size, size or 1):
                if body[at + 2] in values and size >= 28:
                    measured = struct.unpack_from("<3d", body, at + 4)
                    if min(measured) > UNKNOWN:
                        values[body[at + 2]][time] = measured
    if not values[RATE]:
        raise NoStreamError(path.name, "imu", SBF_TITLE, ["gnss"])
    logs = []
    week = min(values[RATE]) // WEEK_MS * WEEK_MS
    for kind, triad, unit in ((RATE, "gyro", "deg/s"), (FORCE, "accel", "m/s2")):
        if not values[kind]:
            continue
        table = np.array(list(values[kind].values()))
        out: Quantities = {"time": (np.array(list(values[kind]), dtype=np.int64) - week, "ms")}
        out |= {f"{triad}_{a}": (table[:, k], unit) for k, a in enumerate("xyz")}
        logs.append(RawLog.of(path, out))
    raw = join(logs, path.name, (path,)) if len(logs) > 1 else logs[0]
    raw.clock = GPS
    return raw


# Smoothed best estimate of trajectory of Applanix POSPac (SBET), as a reference.
#
# Records of 17 little-endian doubles (POSPac user guide; the SBET reader of PDAL): seconds of the
# GPS week; latitude and longitude in rad, height over the ellipsoid in m; velocity x, y, z in
# m/s; roll, pitch, platform heading and wander angle in rad; acceleration and angular rate, which
# are not read. The axes of velocity are north, west, up, turned by the wander angle toward the
# west: true heading is the platform heading less the wander angle. Other programs write
# velocities north, east, down; the positions decide which.


SBET_TITLE = "Applanix SBET trajectory"
FIELDS = 17
SIZE = 8 * FIELDS
# Largest plausible absolute values: time (two weeks), rad, m, m/s, rad.
MOST = np.array([2 * WEEK, np.pi / 2, 2 * np.pi, 2e4, *[600.0] * 3, *[np.pi] * 2, *[2 * np.pi] * 2])
LONGEST_STEP = 10.0  # s
SLOWEST = 0.5  # m/s, root mean square, of a motion that tells the axes of velocity


def _has_records(path: Path) -> bool:
    """Whether the size is that of records, and the first have plausible values."""
    if path.stat().st_size % SIZE:
        return False
    head = np.frombuffer(first_bytes(path, 8 * SIZE), dtype="<f8").reshape(-1, FIELDS)
    if not len(head) or not np.isfinite(head).all() or (head[:, 0] < 0.0).any():
        return False
    steps = np.diff(head[:, 0])
    moves = ((steps > 0.0) & (steps < LONGEST_STEP)).all()
    # Numbers of other files, read as doubles, are mostly of tiny or huge size.
    sized = (np.abs(head[:, 1:3]) > 1e-6).all() and (head[:, 0] > 1e-3).all()
    return bool((np.abs(head[:, : MOST.size]) <= MOST).all() and moves and sized)


# The exponent of the first time.
detect_sbet = Signs(first=rb"\A.{7}[\x3f-\x41]", also=_has_records)


def read_sbet_reference(path: Path) -> pd.DataFrame:
    """Read position, velocity and attitude."""
    findings: list[Finding] = []
    with damage(path):
        values = np.frombuffer(path.read_bytes(), dtype="<f8").reshape(-1, FIELDS)
        bad = ~np.isfinite(values[:, : MOST.size]).all(axis=1)
        bad |= (np.abs(values[:, : MOST.size]) > MOST).any(axis=1)
    if bad.any():
        raise DataError("io.sbet-value", file=path.name, row=int(np.argmax(bad)) + 1)
    time, place = values[:, 0], values[:, 1:4] * [np.degrees(1.0), np.degrees(1.0), 1.0]
    wander = values[:, 10]
    cos, sin = np.cos(wander), np.sin(wander)
    x, y, z = values[:, 4:7].T
    ned = np.column_stack([x * cos - y * sin, -(x * sin + y * cos), -z])
    plain = np.column_stack([x * cos + y * sin, y * cos - x * sin, z])
    moved = _moved(time, place)
    if moved.size and (size := _rms(moved)) > SLOWEST:
        apart = [_rms(moved - 0.5 * (v[1:] + v[:-1])) for v in (ned, plain)]
        if min(apart) > 0.3 * size:
            raise DataError("io.sbet-velocity", file=path.name, quantity="velocity")
        if apart[1] < 0.5 * apart[0]:
            ned = plain
            add_note(findings, "io.sbet-north-east-down", file=path.name)
    euler = np.degrees(np.column_stack([values[:, 7], values[:, 8], values[:, 9] - wander]))
    euler[:, 2] = (euler[:, 2] + 180.0) % 360.0 - 180.0
    clock = GPS if time.max() <= WEEK + 1.0 else RELATIVE
    return solution(path, (time, place, ned, euler), Clock(clock), findings, of_recorder=False)


def _moved(time: Array, place: Array) -> Array:
    """Mean velocity north, east, down between positions."""
    meridian, normal = radii_of_curvature(place[:, 0])
    middle = 0.5 * (place[1:, 2] + place[:-1, 2])
    steps = np.diff(np.column_stack([np.radians(place[:, :2]), place[:, 2]]), axis=0)
    steps[:, 1] = (steps[:, 1] + np.pi) % (2.0 * np.pi) - np.pi
    steps[:, 0] *= meridian[1:] + middle
    steps[:, 1] *= (normal[1:] + middle) * np.cos(np.radians(place[1:, 0]))
    return np.asarray(steps * [1.0, 1.0, -1.0] / np.diff(time)[:, None])


def _rms(values: Array) -> float:
    return float(np.sqrt(np.square(values).sum(axis=1).mean()))

"""Septentrio Binary Format (``.sbf``).

Blocks: SBF Reference Guide of the receivers (mosaic-G5, AsteRx). A block begins with ``$@``, a CRC
of 16 bits, its number and its length, GPS time of week in ms and week. PVTGeodetic has rad, m over
the ellipsoid and m/s north, east, up; PosCovGeodetic and VelCovGeodetic the variances; the
Cartesian blocks the same in WGS 84, Earth-centered. ExtSensorMeas has angular rate in deg/s and
acceleration in m/s² of an inertial unit, at the receiver's time, in the axes of the unit, which its
setup relates to the vehicle. A value of -2e10 is not known.
"""

from __future__ import annotations

import binascii
import re
import struct
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import DataError, Finding
from strapdown.formats.clocks import GPS
from strapdown.formats.join import join
from strapdown.formats.known_formats import Quantities, damage
from strapdown.formats.recording import NoStreamError, RawLog
from strapdown.formats.signs import Signs, first_bytes
from strapdown.frames import C_ne, geodetic_from_ecef

TITLE = "Septentrio SBF"
SYNC = b"$@"
LEAST_BLOCKS = 3  # of a stream that begins with something else
CARTESIAN, GEODETIC, SENSORS = (4006, 5905, 5907), (4007, 5906, 5908), 4050
UNKNOWN = -2e10
RATE, FORCE = 1, 0  # types of a measurement
# Kind of solution to field 6 of NMEA GGA: alone, differential, fixed place, RTK fixed and float,
# SBAS, the same of a moving base, PPP.
QUALITY = {1: 1, 2: 2, 3: 7, 4: 4, 5: 5, 6: 2, 7: 4, 8: 5, 10: 2}
WEEK_MS = 604_800_000
Blocks = dict[int, list[tuple[int, bytes]]]
Array = NDArray[np.float64]


def _has_blocks(path: Path) -> bool:
    """Whether a block with its CRC is at the start, or several are among other lines."""
    head = first_bytes(path, 65536)
    count = sum(map(len, _blocks(head).values()))
    return count >= LEAST_BLOCKS or bool(count and head.startswith(SYNC))


detect = Signs(first=re.escape(SYNC), also=_has_blocks)


def _blocks(data: bytes) -> Blocks:
    """Return the blocks by their numbers, each with its GPS ms since 1980."""
    found: Blocks = {}
    k = 0
    while (k := data.find(SYNC, k)) >= 0 and k + 14 <= len(data):
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
        raise NoStreamError(path.name, stream, TITLE, there or ["other blocks"])
    return found


def read_fixes(path: Path) -> RawLog:
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
    findings = []
    if lost := len(rows) - len(use):
        code = "io.fixes-without-position-left-out"
        findings.append(Finding(code, file=path.name, severity="note", count=lost))
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


def read(path: Path) -> RawLog:
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
        raise NoStreamError(path.name, "imu", TITLE, ["gnss"])
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

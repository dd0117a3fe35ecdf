"""Increments of a strapdown unit from the PSINS toolbox (``.imu``).

Its log of a SIMU: ``%`` comments, three lines of header, then six counts per sample:

    pitch, roll, yaw (deg), VE, VN, VU (m/s)        yaw counter-clockwise from north
    lat, lon (deg), h (m), t0 (s), step (ms), g (m/s²)
    scale of each gyro (arcsec), of each accelerometer (µg·s)

and its plain matrices: increments in rad and m/s, with the time in the last of seven columns.
Axes right, forward, up; an increment belongs to the interval that ends at its stamp.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import DataError, Finding
from strapdown.formats import csv
from strapdown.formats.recording import RawLog, StatedStart
from strapdown.formats.signs import Signs

Array = NDArray[np.float64]
Lines = list[tuple[int, str]]
SUFFIX = ".imu"
#: Which sensor axis points forward, right, down.
AXES = "y,x,-z"
GYROS = [f"dtheta_{a}" for a in "xyz"]
ACCELS = [f"dv_{a}" for a in "xyz"]
_ARCSEC = math.pi / 180.0 / 3600.0
# Header lines: name, and code of the note on their content.
_HEADER = (
    ("attitude and velocity", "io.psins-attitude-line"),
    ("position and clock", "io.psins-position-line"),
    ("scale factors", "io.psins-scales-line"),
)
# Norm of the median specific force of a carried or stationary unit.
_GRAVITY = (9.6, 10.0)  # m/s²
_STEPS = (1e-5, 1.0)  # s


detect = Signs(named=(SUFFIX,))


def read(path: Path) -> RawLog:
    """Read the increments of a strapdown unit.

    Returns
    -------
    RawLog
        Columns ``dtheta_x`` … in rad and ``dv_x`` … in m/s, with ``time`` at the end of each
        interval. A SIMU log is converted with the scale factors and clock of its header, whose
        position and attitude are kept as `StatedStart`. A plain matrix of seven columns is
        accepted if the last is a steady clock and the norm of the velocity increments over a
        step is that of gravity. Any other text is read as a table.

    Raises
    ------
    DataError
        The file is not text, the header is invalid, or a row has another width or no integer.
    """
    data = path.read_bytes()
    text, findings = csv.decoded(data, path.name)
    numbered = [(row, line) for row, line in enumerate(text.splitlines(), 1) if line.strip()]
    comments = [line for _, line in numbered if csv.is_comment(line)]
    lines = [(row, line) for row, line in numbered if not csv.is_comment(line)]
    ended = text.endswith(("\n", "\r"))
    if any("psins" in c.lower() for c in comments):
        return _simu(path, lines, ended, findings)
    return _matrix(path, lines, ended, findings) or csv.parse(data, path.name, (path,))


def _simu(path: Path, lines: Lines, ended: bool, findings: list[Finding]) -> RawLog:
    attitude, place, scales = (_header(path.name, lines, k) for k in range(3))
    start = _start(path.name, attitude, place, (lines[0][0], lines[1][0]))
    t0, step, g = place[3], 1e-3 * place[4], place[5]
    row = lines[1][0]
    if not _STEPS[0] <= step <= _STEPS[1]:
        _refuse(path.name, row, 1, "sampling interval", "io.psins-step", value=place[4])
    if not 9.7 <= g <= 9.9:
        _refuse(path.name, row, 1, "g", "io.psins-gravity", value=g)
    if min(scales) <= 0:
        _refuse(path.name, lines[2][0], 2, "scale factors", "io.psins-scale", value=min(scales))
    counts, rows = _counts(path.name, lines[3:], ended, findings)
    factors: Array = np.array(
        [s * _ARCSEC for s in scales[:3]] + [s * 1e-6 * g for s in scales[3:]]
    )
    stamps = np.asarray(t0 + step * np.arange(1.0, len(counts) + 1.0))
    roll, pitch, heading = start.roll_pitch_heading_deg
    findings.append(
        Finding(
            "io.header-states-roll-pitch-heading",
            file=path.name,
            quantity="start",
            severity="note",
            roll=roll,
            pitch=pitch,
            heading=heading,
            lat_deg=start.lat_deg,
            lon_deg=start.lon_deg,
            alt=start.alt,
        )
    )
    return _log(path, stamps, np.asarray(counts * factors), rows, AXES, findings, start)


def _header(file: str, lines: Lines, which: int) -> list[float]:
    """Parse the six numbers of a header line."""
    name, _ = _HEADER[which]
    if len(lines) <= which:
        raise DataError("io.psins-header-cut", file=file, which=which + 1, name=name)
    row, line = lines[which]
    fields = line.split()
    if len(fields) != 6:
        _refuse(
            file, row, which, name, "io.psins-count", count=len(fields), line_of_header=which + 1
        )
    values = [_number(f) for f in fields]
    for text, value in zip(fields, values, strict=True):
        if not math.isfinite(value):
            _refuse(file, row, which, name, "io.psins-number", text=text)
    return values


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return math.nan


def _refuse(file: str, row: int, which: int, quantity: str, code: str, **data: Any) -> None:
    """Refuse a value of a header line; the message describes the line."""
    holds = Finding(_HEADER[which][1], severity="note")
    raise DataError(code, file=file, row=row, quantity=quantity, holds=holds, **data)


def _start(
    file: str, attitude: list[float], place: list[float], rows: tuple[int, int]
) -> StatedStart:
    pitch, roll, yaw, east, north, up = attitude
    lat, lon, alt = place[:3]
    if abs(lat) > 90.0:
        _refuse(file, rows[1], 1, "latitude", "io.psins-latitude", value=lat)
    if abs(lon) > 360.0:
        _refuse(file, rows[1], 1, "longitude", "io.psins-longitude", value=lon)
    if abs(pitch) > 90.0:
        _refuse(file, rows[0], 0, "pitch", "io.psins-pitch", value=pitch)
    # Rotations about up, then right, then forward: with yaw reversed the 3-2-1 angles of
    # forward-right-down.
    return StatedStart(lat, lon, alt, (roll, pitch, 0.0 - yaw), (north, east, 0.0 - up))


def _counts(
    file: str, lines: Lines, ended: bool, findings: list[Finding]
) -> tuple[Array, NDArray[np.int64]]:
    """Return the integers of all samples, and their rows in the file."""
    block, rows = _block(file, lines, 6, ended, findings)
    bad = np.argwhere(block != np.round(block))
    if bad.size:
        i, j = (int(k) for k in bad[0])
        raise DataError(
            "io.no-whole-number-simu-log",
            file=file,
            row=int(rows[i]),
            quantity=(GYROS + ACCELS)[j],
            block=block[i, j],
            count=len(np.unique(bad[:, 0])),
        )
    return block, rows


def _matrix(path: Path, lines: Lines, ended: bool, findings: list[Finding]) -> RawLog | None:
    """Return increments in rad and m/s with their time, if plausible; else None."""
    if len(lines) < 3 or any(len(line.split()) != 7 for _, line in lines[:3]):
        return None
    if not all(math.isfinite(_number(f)) for _, line in lines[:3] for f in line.split()):
        return None
    block, rows = _block(path.name, lines, 7, ended, findings)
    time = block[:, 6]
    steps = np.diff(time)
    usual = float(np.median(steps)) if steps.size else 0.0
    steady = _STEPS[0] <= usual <= _STEPS[1] and float(np.mean(abs(steps - usual) < 0.1 * usual))
    if not steady or steady < 0.9:
        return None
    force = float(np.median(np.linalg.norm(block[:, 3:6], axis=1))) / usual
    turned = float(np.median(np.linalg.norm(block[:, :3], axis=1))) / usual
    if not _GRAVITY[0] <= force <= _GRAVITY[1] or not turned < 2.0 * math.pi:
        return None
    up = float(np.median(block[:, 5])) / usual > 0.5 * force
    findings.append(
        Finding(
            "io.taken-for-psins" if up else "io.taken-for-psins-axes-open",
            file=path.name,
            severity="note" if up else "warning",
            rate_hz=1.0 / usual,
            force=force,
        )
    )
    return _log(path, time, block[:, :6], rows, AXES if up else None, findings, None)


def _block(
    file: str, lines: Lines, width: int, ended: bool, findings: list[Finding]
) -> tuple[Array, NDArray[np.int64]]:
    """Return the numbers of all rows; drop a last row that may have lost digits."""
    if lines and (not ended or len(lines[-1][1].split()) < width):
        findings.append(
            Finding("io.last-line-does-not-end", severity="note", file=file, row=lines[-1][0])
        )
        lines = lines[:-1]
    if not lines:
        raise DataError("io.header-no-samples-under-2", file=file)
    for row, line in lines:
        if (count := len(line.split())) != width:
            raise DataError("io.numbers-every-sample", file=file, row=row, count=count, width=width)
    try:
        flat = np.array(" ".join(line for _, line in lines).split(), dtype=np.float64)
    except ValueError:
        row, text = next(
            (row, f) for row, line in lines for f in line.split() if math.isnan(_number(f))
        )
        raise DataError("io.text-not-a-number", file=file, row=row, text=text) from None
    return flat.reshape(-1, width), np.array([row for row, _ in lines], dtype=np.int64)


def _log(
    path: Path,
    stamps: Array,
    increments: Array,
    rows: NDArray[np.int64],
    axes: str | None,
    findings: list[Finding],
    start: StatedStart | None,
) -> RawLog:
    names = GYROS + ACCELS
    stated = {"time": ("time", "s")}
    stated |= {f"dtheta_{a}": (f"gyro_{a}", "rad") for a in "xyz"}
    stated |= {f"dv_{a}": (f"accel_{a}", "m/s") for a in "xyz"}
    return RawLog(
        name=path.name,
        files=(path,),
        columns={"time": stamps} | {n: increments[:, k] for k, n in enumerate(names)},
        rows=rows,
        stated=stated,
        sampling="mean",
        axes=axes,
        findings=findings,
        start=start,
    )

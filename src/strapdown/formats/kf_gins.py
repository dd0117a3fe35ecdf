"""Increments of inertial sensors in KF-GINS format: seven columns without a header.

Each line: GPS seconds of week, three increments of angle in rad, three of velocity in m/s, axes
forward, right, down; an increment belongs to the interval that ends at its stamp.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import DataError, Finding
from strapdown.formats import csv
from strapdown.formats.clocks import GPS, WEEK
from strapdown.formats.recording import RawLog

__all__ = ["COLUMNS", "detect", "read"]

Array = NDArray[np.float64]
COLUMNS = ["time", *(f"dtheta_{a}" for a in "xyz"), *(f"dv_{a}" for a in "xyz")]
SUFFIXES = (*csv.SUFFIXES, ".imu")
_KINDS = [("time", "s"), *((f"gyro_{a}", "rad") for a in "xyz")]
_KINDS += [(f"accel_{a}", "m/s") for a in "xyz"]
# Norm of the median specific force of a vehicle on the road, in flight or stationary.
_GRAVITY = (9.6, 10.0)  # m/s²
_STEPS = (1e-4, 0.5)  # s
_TURNS = 2.0 * np.pi  # rad/s


def detect(path: Path) -> bool:
    """Detect by the first numbers: a clock, and gravity in the increments."""
    if not path.is_file() or path.suffix.lower() not in SUFFIXES:
        return False
    with path.open("rb") as stream:
        head = stream.read(csv.HEAD)
    if b"," in head or b"\0" in head:
        return False
    whole = head[: head.rfind(b"\n") + 1]
    lines = [line for line in whole.splitlines() if line.strip()]
    lines = [line for line in lines if not line.lstrip().startswith((b"#", b"%"))]
    # One bad line is a fault of the file, not another layout.
    block = [row for line in lines if (row := _numbers(line)) is not None]
    if len(block) < 3 or len(block) < 0.9 * len(lines) or _numbers(lines[0]) is None:
        return False
    return _are_increments(np.array(block))


def _numbers(line: bytes) -> list[float] | None:
    fields = line.split()
    try:
        return [float(f) for f in fields] if len(fields) == len(COLUMNS) else None
    except ValueError:
        return None


def _are_increments(block: Array) -> bool:
    steps = np.diff(block[:, 0])
    usual = float(np.median(steps))
    if not _STEPS[0] <= usual <= _STEPS[1] or not -1.0 < block[0, 0] <= WEEK + 1.0:
        return False
    force = float(np.median(np.linalg.norm(block[:, 4:], axis=1))) / usual
    turn = float(np.median(np.linalg.norm(block[:, 1:4], axis=1))) / usual
    return _GRAVITY[0] <= force <= _GRAVITY[1] and turn < _TURNS


def read(path: Path) -> RawLog:
    """Read increments of angle and velocity.

    Parameters
    ----------
    path : Path

    Returns
    -------
    RawLog
        Columns `COLUMNS`, in s, rad, m/s. Axes forward, right, down if gravity is on the third
        axis, downward; otherwise not stated.

    Raises
    ------
    DataError
        The file is not text, a row has another width, or the numbers are not increments.
    """
    raw = csv.read(path)
    names = list(raw.columns)
    if len(names) != len(COLUMNS) or any(n.startswith("column ") is False for n in names):
        raise DataError(
            "io.kf-gins-column-count",
            file=raw.name,
            row=raw.row(0),
            count=len(names),
            names=names[:8],
        )
    columns = dict(zip(COLUMNS, raw.columns.values(), strict=True))
    axes = raw.axes
    if all(c.dtype.kind in "iuf" for c in columns.values()):
        axes = axes or _axes(columns, raw)
    return RawLog(
        name=raw.name,
        files=(path,),
        columns=columns,
        rows=raw.rows,
        stated=dict(zip(COLUMNS, _KINDS, strict=True)),
        sampling="mean",
        axes=axes,
        findings=raw.findings,
        clock=GPS,
    )


def _axes(columns: dict[str, NDArray[np.float64]], raw: RawLog) -> str | None:
    """Return forward, right, down if gravity agrees; note the assumption."""
    step = float(np.median(np.diff(columns["time"]))) if columns["time"].size > 1 else 0.0
    if not step > 0.0:
        return None
    down = float(np.median(columns["dv_z"])) / step
    told = down < -0.5 * _GRAVITY[0]
    raw.findings.append(
        Finding(
            "io.taken-for-kf-gins" if told else "io.taken-for-kf-gins-axes-open",
            file=raw.name,
            severity="note" if told else "warning",
            rate_hz=1.0 / step,
            down=down,
        )
    )
    return "x,y,z" if told else None

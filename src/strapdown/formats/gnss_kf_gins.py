"""Fixes of KF-GINS: seven columns without a header, or thirteen with velocity.

Each line: GPS seconds of week; latitude, longitude in deg, height above the ellipsoid in m, of the
antenna; standard deviations north, east, down in m; and, with thirteen columns, velocity north,
east, down and its standard deviations in m/s.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from strapdown.errors import DataError, Finding
from strapdown.formats import csv, kf_gins
from strapdown.formats.clocks import GPS, Clock
from strapdown.formats.find_columns import Column
from strapdown.formats.gnss_fixes import Fixes, GnssOptions
from strapdown.formats.numbers import numbers
from strapdown.formats.recording import RawLog

__all__ = ["detect", "read"]

NAMES = ("time", "lat", "lon", "alt", "north_sd", "east_sd", "down_sd")
WITH_VELOCITY = (*NAMES, "VN", "VE", "VD", "VN_sd", "VE_sd", "VD_sd")


def detect(path: Path) -> bool:
    """Detect by rows of seven or thirteen numbers without a header."""
    if not path.is_file() or path.suffix.lower() not in csv.SUFFIXES:
        return False
    with path.open("rb") as stream:
        head = stream.read(csv.HEAD)
    lines = [line.split() for line in head.splitlines() if line.strip()]
    lines = [line for line in lines if not line[0].startswith((b"#", b"%"))]
    if not lines or len(lines[0]) not in (len(NAMES), len(WITH_VELOCITY)):
        return False
    return all(csv.is_data(f.decode("latin-1")) for f in lines[0])


def read(path: Path, options: GnssOptions) -> Fixes:
    """Read fixes without a header.

    Parameters
    ----------
    path : Path
    options : GnssOptions

    Returns
    -------
    Fixes

    Raises
    ------
    DataError
        The number of columns differs, a value is not a number, or the data are inertial.
    """
    if kf_gins.detect(path):
        raise DataError("io.these-increments-inertial-sensors-not", file=path.name)
    raw = csv.read(path)
    names = WITH_VELOCITY if len(raw.columns) == len(WITH_VELOCITY) else NAMES
    if len(raw.columns) != len(names):
        raise DataError(
            "io.kf-gins-fix-column-count",
            file=raw.name,
            row=raw.row(0),
            count=len(raw.columns),
        )
    return fixes_of(raw, names)


def fixes_of(raw: RawLog, names: tuple[str, ...]) -> Fixes:
    """Convert columns in a known order to fixes."""
    values = {
        name: np.asarray(numbers(raw, Column(column, None, ""), name), dtype=np.float64)
        for name, column in zip(names, raw.columns, strict=True)
    }

    def block(first: int) -> np.ndarray:
        return np.column_stack([values[n] for n in names[first : first + 3]])

    raw.findings.append(
        Finding(
            "io.taken-for-kf-gins-fixes-with-velocity"
            if len(names) > len(NAMES)
            else "io.taken-for-kf-gins-fixes",
            file=raw.name,
            severity="note",
            count=len(names),
        )
    )
    return Fixes(
        name=raw.name,
        time=values["time"],
        place=block(1),
        rows=np.arange(1, values["time"].size + 1) if raw.rows is None else raw.rows,
        clock=Clock(GPS),
        velocity=block(7) if len(names) > len(NAMES) else None,
        position_sd=block(4),
        velocity_sd=block(10) if len(names) > len(NAMES) else None,
        findings=raw.findings,
    )

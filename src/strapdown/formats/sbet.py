"""Smoothed best estimate of trajectory of Applanix POSPac (SBET), as a reference.

Records of 17 little-endian doubles (POSPac user guide; the SBET reader of PDAL): seconds of the GPS
week; latitude and longitude in rad, height over the ellipsoid in m; velocity x, y, z in m/s; roll,
pitch, platform heading and wander angle in rad; acceleration and angular rate, which are not read.
The axes of velocity are north, west, up, turned by the wander angle toward the west: true heading
is the platform heading less the wander angle. Other programs write velocities north, east, down;
the positions decide which.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.earth import radii_of_curvature
from strapdown.errors import DataError, Finding
from strapdown.formats.clocks import GPS, RELATIVE, WEEK, Clock
from strapdown.formats.known_formats import damage, solution
from strapdown.formats.signs import Signs, first_bytes

TITLE = "Applanix SBET trajectory"
FIELDS = 17
SIZE = 8 * FIELDS
Array = NDArray[np.float64]
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
detect = Signs(first=rb"\A.{7}[\x3f-\x41]", also=_has_records)


def read(path: Path) -> pd.DataFrame:
    """Read position, velocity and attitude."""
    findings = []
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
            findings.append(Finding("io.sbet-north-east-down", file=path.name, severity="note"))
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

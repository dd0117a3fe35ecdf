"""Text exports of Inertial Explorer (NovAtel Waypoint), as a reference.

A preamble (``Program: Inertial Explorer Version …``), a line of names, a line of units, rows
(Inertial Explorer User Guide, export wizard; the columns are those of the user's profile). Used are
``GPSTime`` (seconds of the week) and ``Week``; ``Latitude``, ``Longitude`` in deg or in degrees,
minutes, seconds, ``H-Ell``; ``VNorth``, ``VEast``, ``VUp``, or ``VelBdyX``, ``VelBdyY``,
``VelBdyZ`` to the right, forward, up; ``Roll``, ``Pitch``, ``Heading`` in deg: left side up, front
up, clockwise from north.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from strapdown import rotation
from strapdown.errors import DataError
from strapdown.formats import csv
from strapdown.formats.binary import damage, solution
from strapdown.formats.clocks import GPS, WEEK, Clock
from strapdown.formats.signs import Signs

TITLE = "text export of Inertial Explorer"
_UNIT = re.compile(r"\([^)]*\)|\S+")
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
PLACE, ANGLES = ("latitude", "longitude", "h-ell"), ("roll", "pitch", "heading")
LEVEL, BODY = ("vnorth", "veast", "vup"), ("velbdyx", "velbdyy", "velbdyz")
UNITS = {"gpstime": ("sec", "s"), "latitude": ("deg", "+/-d m s"), "h-ell": ("m",)}
UNITS |= {"longitude": UNITS["latitude"], **dict.fromkeys(ANGLES, ("deg",))}
UNITS |= dict.fromkeys((*LEVEL, *BODY), ("m/s",))


# The line that names the program.
detect = Signs(first=rb"(?m)^[ \t]*Program:[ \t]+Inertial Explorer")


def read(path: Path) -> pd.DataFrame:
    """Read position, velocity and attitude."""
    with damage(path):
        text, findings = csv.decoded(path.read_bytes(), path.name)
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
        (k for k, n in enumerate(lines) if {"latitude", "h-ell"} <= set(n.lower().split())), 0
    )
    names = lines[at].lower().split()
    units = [u.strip("()").lower() for u in _UNIT.findall(lines[at + 1])] if at else []
    if len(names) != len(units):
        raise DataError("io.inertial-explorer-header", file=path.name)
    for name, unit in zip(names, units, strict=True):
        if name in UNITS and unit not in UNITS[name]:
            quantity = {"quantity": name, "unit": unit}
            raise DataError("io.inertial-explorer-unit", file=path.name, **quantity)
    widths = [3 if unit == "+/-d m s" else 1 for unit in units]
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

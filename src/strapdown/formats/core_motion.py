"""Tables of Core Motion (iOS, watchOS): rotation rate, gravity and user acceleration apart.

Names are those of CMDeviceMotion, in the spellings of applications and data sets:
``rotationRate.x``, ``motionRotationRateX``, ``rotation_rate_x(radians/s)``; ``userAcceleration.x``,
``user_acc_x(G)``; ``gravity.x``, ``gravity_x(G)``. Apple documents rad/s, and gravity and user
acceleration in units of gravity, the sign opposite to specific force: a phone on its back has
gravity -z. The length of gravity shows where an application converted it to m/s². Specific force is
minus the sum of both.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from strapdown.constants import STANDARD_GRAVITY
from strapdown.errors import Finding
from strapdown.formats import csv
from strapdown.formats.columns import read_name
from strapdown.formats.known_formats import AXES, column, names_of, stated_by, under
from strapdown.formats.recording import RawLog
from strapdown.formats.signs import Signs

WORDS = {
    "gyro": ("rotationrate", "motionrotationrate", "rotrate"),
    "gravity": ("gravity", "motiongravity", "grav"),
    "user": ("useracceleration", "motionuseracceleration", "useracc", "useraccel"),
}


def _has_vectors(path: Path) -> bool:
    """Whether the first line names the three vectors."""
    return csv.detect(path) and len(_named(names_of(path))) == 9


detect = Signs(text=r"(?i)\A.*grav", also=_has_vectors)


def _named(names: list[str]) -> dict[str, str]:
    """Return the columns of the vectors, by vector and axis."""
    found = {}
    for name in names:
        word = re.sub(r"[(\[].*|[^a-z]", "", name.lower())
        for vector, words in WORDS.items():
            if word[:-1] in words and word[-1] in "xyz":
                found[f"{vector}_{word[-1]}"] = name
    return found


def read(path: Path) -> RawLog:
    """Read the rates, and specific force from gravity and user acceleration.

    Raises
    ------
    DataError
        The table is damaged, or a value is not a number.
    """
    raw = under(path)
    named = _named(list(raw.columns))
    gyro, gravity, user = (
        np.column_stack([column(raw, named[f"{v}_{a}"]) for a in "xyz"]) for v in WORDS
    )
    length = float(np.nanmedian(np.linalg.norm(gravity, axis=1)))
    # Standardized applications turn the sign together with the unit.
    units = {"-g": 1.0, "m/s2 or -m/s2": STANDARD_GRAVITY}
    unit = next((u for u, g in units.items() if abs(length / g - 1.0) < 0.02), None)
    held: dict[str, tuple[NDArray[Any], str | None]] = {}
    # As in timestamp(unix).
    said = {n: (read_name(n), read_name(n.partition("(")[0])) for n in raw.columns}
    times = {n: s for n, both in said.items() for s in both if s.quantity == "time"}
    if times:
        best = next((n for n, s in times.items() if s.unit), next(iter(times)))
        held["time"] = (raw.columns[best], times[best].unit)
    for k, axis in enumerate("xyz"):
        held[f"gyro_{axis}"] = (gyro[:, k], "rad/s")
        held[f"accel_{axis}"] = (gravity[:, k] + user[:, k], unit)
    log = stated_by(raw, held, axes=AXES)
    log.findings.append(
        Finding(
            "io.force-summed",
            file=path.name,
            quantity="accel",
            severity="note",
            linear=named["user_x"],
            gravity=named["gravity_x"],
            distance=0.0,
        )
    )
    return log

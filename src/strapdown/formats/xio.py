"""x-IMU3 of x-io Technologies: CSV of its software, a folder of tables or one of them.

``Inertial.csv``: ``Timestamp (us)`` (or ``Time (s)``), ``Gyroscope X (deg/s)`` …, ``Accelerometer X
(g)`` …; ``Magnetometer.csv``: ``Magnetometer X (a.u.)`` …, in units of the calibrated field
(https://github.com/xioTechnologies/x-IMU3-Software, MIT). A message that arrived by two connections
has two rows. Axes are those printed on the unit.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from strapdown.errors import Finding
from strapdown.formats.known_formats import column, selected, under
from strapdown.formats.recording import RawLog
from strapdown.formats.signs import Signs, head

NAMES = {f"gyro_{a}": (f"Gyroscope {a.upper()} (deg/s)", "deg/s") for a in "xyz"}
NAMES |= {f"accel_{a}": (f"Accelerometer {a.upper()} (g)", "g") for a in "xyz"}
TIMES = {"Timestamp (us)": "us", "Time (s)": "s"}
TABLE = "Inertial.csv"


def _has_names(path: Path) -> bool:
    """Whether the table, or that of a folder, has the inertial names."""
    line = head(path / TABLE if path.is_dir() else path, 4096).partition("\n")[0]
    names = [n.strip() for n in line.split(",")]
    return any(t in names for t in TIMES) and all(n in names for n, _ in NAMES.values())


detect = Signs(text=r"\A.*Gyroscope X \(deg/s\)", also=_has_names, folder=_has_names)


def files_of(path: Path) -> tuple[Path, ...]:
    """List the table that is read."""
    return (path / TABLE,) if path.is_dir() and detect(path) else ()


def read(path: Path) -> RawLog:
    """Read rates and specific force, without rows that repeat the one before.

    Raises
    ------
    DataError
        The table is damaged.
    """
    raw = under(path / TABLE if path.is_dir() else path)
    time = next(t for t in TIMES if t in raw.columns)
    held = {q: column(raw, n) for q, (n, _) in NAMES.items()}
    raw.stated = {time: ("time", TIMES[time])} | {n: (q, u) for q, (n, u) in NAMES.items()}
    rows = np.column_stack([column(raw, time).astype(np.float64), *held.values()])
    own = np.ones(len(rows), dtype=bool)
    own[1:] = (rows[1:] != rows[:-1]).any(axis=1)
    if own.all():
        return raw
    finding = Finding(
        "io.rows-repeat-sample-before-stamp",
        file=raw.name,
        row=raw.row(int(np.argmin(own))),
        quantity="time",
        severity="note",
        repeated=int((~own).sum()),
        size=own.size,
    )
    raw.findings.append(finding)
    return selected(raw, own)

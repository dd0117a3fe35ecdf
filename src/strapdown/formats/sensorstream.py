"""Sensorstream IMU+GPS (Android, Axel Lorenz): its CSV files, or its UDP lines saved to a file.

A line is a stamp in seconds and any subset of blocks: ``timestamp, id, v1, v2, v3, id, …``. A block
has three values, or one for pressure and battery temperature. Files have no header; a blank may
follow each comma. A table of whole numbers is another format, for stamps and values have decimals.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from strapdown.errors import DataError, add_note
from strapdown.formats.csv import SUFFIXES
from strapdown.formats.join import join
from strapdown.formats.known_formats import force_of, sensor_log
from strapdown.formats.recording import RawLog
from strapdown.formats.signs import Signs, first_bytes
from strapdown.formats.text_columns import decoded

# Number of values in a block, by its id: 1 GPS, 3 accelerometer, 4 gyroscope, 5 magnetic field,
# 6 GPS in ECEF, 7 GPS velocity, 81 orientation, 82 linear acceleration, 83 gravity, 84 rotation
# vector, 85 pressure, 86 battery temperature.
WIDTHS = {1: 3, 3: 3, 4: 3, 5: 3, 6: 3, 7: 3, 81: 3, 82: 3, 83: 3, 84: 3, 85: 1, 86: 1}
NAMES = {3: "accelerometer", 4: "gyroscope", 5: "magnetic field", 82: "linear", 83: "gravity"}
TRIADS = {3: ("accel", "m/s2"), 4: ("gyro", "rad/s"), 5: ("mag", "uT")}
_ID = re.compile(r"\d+")
_LOOKED_AT = 20  # lines examined to detect the format

Blocks = dict[int, tuple[float, ...]]


def _has_blocks(path: Path) -> bool:
    """Whether each of the first lines is a stamp and blocks."""
    try:
        text = decoded(first_bytes(path, 16384), path.name)[0]
    except DataError:
        return False
    lines = [line for line in text.splitlines()[:_LOOKED_AT] if line.strip()]
    # The last line of the examined part may be truncated.
    lines = lines[:-1] if len(lines) > 1 else lines
    ids = set()
    for line in lines:
        parsed = blocks_of(line)
        if parsed is None or "." not in line:
            return False
        ids |= set(parsed[1])
    return bool(ids & {3, 4, 82, 83})


detect = Signs(
    suffixes=SUFFIXES,
    text=rf"\A\s*+[^,\n]*+,\s*+(?:{'|'.join(map(str, WIDTHS))})\s*,",
    also=_has_blocks,
)


def read(path: Path) -> RawLog:
    """Read the blocks of each sensor, joined on the stamps of the gyro.

    Lines without a gyro are not samples; accelerometer or magnetic field from other lines are
    interpolated to the stamps of the gyro.
    """
    text, findings = decoded(path.read_bytes(), path.name)
    numbered = [(row, line) for row, line in enumerate(text.splitlines(), 1) if line.strip()]
    seen: dict[int, list[tuple[int, float, tuple[float, ...]]]] = {}
    for k, (row, line) in enumerate(numbered):
        parsed = blocks_of(line)
        if parsed is None:
            if k == len(numbered) - 1 and k and not text.endswith(("\n", "\r")):
                add_note(findings, "io.last-line-cut-left-out-2", file=path.name, row=row)
                break
            raise DataError(
                "io.not-stamp-blocks-id-values",
                file=path.name,
                row=row,
                value_shown=line if len(line) <= 60 else f"{line[:60]}…",
            )
        for kind, values in parsed[1].items():
            seen.setdefault(kind, []).append((row, parsed[0], values))
    if 4 not in seen:
        raise DataError(
            "io.no-line-gyroscope-id-ids", file=path.name, quantity="gyro", seen=sorted(seen)
        )
    if without := len(numbered) - len(seen[4]):
        add_note(
            findings,
            "io.lines-no-gyroscope-no-samples",
            file=path.name,
            quantity="gyro",
            without=without,
            count=len(numbered),
        )
    logs = [_log(path, seen, kind, *TRIADS[kind]) for kind in (4, 3, 5) if kind in seen]
    if 3 not in seen and {82, 83} <= set(seen):
        linear, gravity = (_log(path, seen, kind, "accel", "m/s2") for kind in (82, 83))
        logs.append(force_of(linear, gravity))
    raw = join(logs, path.name, (path,))
    raw.findings[:0] = findings
    return raw


def _log(
    path: Path,
    seen: dict[int, list[tuple[int, float, tuple[float, ...]]]],
    kind: int,
    triad: str,
    unit: str,
) -> RawLog:
    lines = seen[kind]
    values = np.array([v for _, _, v in lines])
    columns = {"time": np.array([t for _, t, _ in lines])}
    columns |= {axis: values[:, j] for j, axis in enumerate("xyz")}
    return sensor_log(
        f"{path.name}/{NAMES[kind]}",
        path,
        columns,
        triad,
        unit,
        time=("time", "s"),
        rows=np.array([row for row, _, _ in lines]),
    )


def blocks_of(line: str) -> tuple[float, Blocks] | None:
    """Split a line into stamp and blocks; None if it has another form."""
    fields = [f.strip() for f in line.split(",")]
    if fields and not fields[-1]:
        fields.pop()
    blocks: Blocks = {}
    try:
        stamp = float(fields[0])
        k = 1
        while k < len(fields):
            kind = int(fields[k]) if _ID.fullmatch(fields[k]) else 0
            width = WIDTHS.get(kind, 0)
            if not width or kind in blocks or k + width >= len(fields):
                return None
            blocks[kind] = tuple(float(f) for f in fields[k + 1 : k + 1 + width])
            k += 1 + width
    except (ValueError, IndexError):
        return None
    return stamp, blocks

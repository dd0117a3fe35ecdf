"""A reader from outside: logs of 16-bit counts, little-endian, behind a header of one line.

The line is ``TWOBYTE <rate in Hz> <rad/s per count> <m/s² per count>``; each sample is six counts:
rates about forward, right, down, and specific force along them, each the mean over its interval.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from strapdown.errors import DataError
from strapdown.formats import Reader
from strapdown.formats.recording import RawLog

MAGIC = b"TWOBYTE "


def detect(path: Path) -> bool:
    """Detect by the first bytes."""
    if not path.is_file():
        return False
    with path.open("rb") as stream:
        return stream.read(len(MAGIC)) == MAGIC


def read(path: Path) -> RawLog:
    """Read the samples; `DataError`: the header or the last sample is damaged."""
    head, _, body = path.read_bytes().partition(b"\n")
    fields = head.split()
    if len(fields) != 4 or len(body) % 12:
        raise DataError("io.not-of-format", file=path.name, title=TWO_BYTE.title, reason="damaged")
    rate, gyro, accel = (float(f) for f in fields[1:])
    counts = np.frombuffer(body, dtype="<i2").reshape(-1, 6)
    quantities = {"time": (np.arange(len(counts)) / rate, "s")}
    for k, axis in enumerate("xyz"):
        quantities[f"gyro_{axis}"] = (counts[:, k] * gyro, "rad/s")
        quantities[f"accel_{axis}"] = (counts[:, 3 + k] * accel, "m/s2")
    return RawLog.of(path, quantities, axes="x,y,z", sampling="mean")


TWO_BYTE = Reader("log of 16-bit counts", detect, {"imu": read})

"""Google Smartphone Decimeter Challenge: ``ground_truth.csv`` of 2021, and what cannot be read.

``ground_truth.csv`` (kaggle.com/competitions/google-smartphone-decimeter-challenge/data):
``millisSinceGpsEpoch`` without leap seconds, ``latDeg``, ``lngDeg``,
``heightAboveWgs84EllipsoidM``, ``speedMps``, ``courseDegree`` from north. Its stamps are turned to
Unix time, the clock of ``device_imu.csv``. That of 2022 and later is a table of ``Fix`` lines
(`gnss_logger`). ``device_gnss.csv`` and ``…_derived.csv`` have pseudoranges, which are not
positions.
"""

from __future__ import annotations

from pathlib import Path

from strapdown.errors import DataError
from strapdown.formats.clocks import UNIX, unix_from_gps
from strapdown.formats.known_text import column, head, optional, stated_by, under
from strapdown.formats.recording import RawLog

TRUTH = "collectionName,phoneName,millisSinceGpsEpoch,latDeg,lngDeg,"
RAW = ("ReceivedSvTimeNanos", "receivedSvTimeInGpsNanos", "rawPrM")


def detect(path: Path) -> bool:
    """Detect by the header of the positions of 2021."""
    return path.is_file() and head(path, 256).startswith(TRUTH)


def detect_raw(path: Path) -> bool:
    """Detect by the header of a table of pseudoranges."""
    line = head(path).partition("\n")[0] if path.is_file() else ""
    return line.startswith(("MessageType,", "collectionName,")) and any(n in line for n in RAW)


def read(path: Path) -> RawLog:
    """Read the positions of the reference receiver."""
    raw = under(path)
    held = {"time": (unix_from_gps(column(raw, "millisSinceGpsEpoch") * 1e-3), "s")}
    names = {
        "lat": ("latDeg", "deg"),
        "lon": ("lngDeg", "deg"),
        "alt": ("heightAboveWgs84EllipsoidM", "m"),
        "speed": ("speedMps", "m/s"),
        "course": ("courseDegree", "deg"),
    }
    return stated_by(raw, held | optional(raw, names), clock=UNIX)


def refuse(path: Path) -> RawLog:
    """Refuse pseudoranges."""
    raise DataError("io.pseudoranges", file=path.name)

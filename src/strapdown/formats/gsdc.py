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
from strapdown.formats.known_text import column, optional, stated_by, under
from strapdown.formats.recording import RawLog
from strapdown.formats.signs import Signs

TRUTH = "collectionName,phoneName,millisSinceGpsEpoch,latDeg,lngDeg,"
RAW = ("ReceivedSvTimeNanos", "receivedSvTimeInGpsNanos", "rawPrM")


detect = Signs(text=rf"\A{TRUTH}")


detect_raw = Signs(text=rf"\A(?:MessageType|collectionName),.*(?:{'|'.join(RAW)})")


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

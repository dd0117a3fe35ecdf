"""GPX tracks (https://www.topografix.com/GPX/1/1/): fixes, read by gpxpy.

Every ``trkpt`` of every track and segment, in their order: latitude and longitude in degrees of WGS
84, ``time`` in UTC. ``ele`` is over the sea, and ``geoidheight`` the height of the geoid over the
ellipsoid, as in NMEA GGA; ``fix`` is the kind of solution; GPX 1.0 also has ``speed`` in m/s and
``course`` in degrees from north.
"""

from __future__ import annotations

from datetime import UTC
from pathlib import Path

import numpy as np

from strapdown.errors import DataError, Finding
from strapdown.formats.clocks import UNIX
from strapdown.formats.known_text import head, selected
from strapdown.formats.recording import RawLog, library

QUALITY = {"none": 0.0, "dgps": 2.0, "pps": 3.0}


def detect(path: Path) -> bool:
    """Detect by the first element of the XML."""
    return path.is_file() and "<gpx" in head(path, 4096)


def read(path: Path) -> RawLog:
    """Read the points that have a time.

    Raises
    ------
    DataError
        The library is missing, the XML is damaged, or no point has a time.
    """
    gpxpy = library("gpxpy", path)
    try:
        gpx = gpxpy.parse(path.read_bytes())
        points = [p for track in gpx.tracks for part in track.segments for p in part.points]
    except Exception as error:  # the library raises errors of its XML parser, too
        raise DataError("io.gpx-unreadable", file=path.name, error=str(error)) from None
    timed = np.array([p.time is not None for p in points], dtype=bool)
    if not timed.any():
        raise DataError("io.gpx-without-time", file=path.name, quantity="time", count=len(points))
    stamps = [
        p.time.replace(tzinfo=p.time.tzinfo or UTC).timestamp() if p.time else 0.0 for p in points
    ]

    def values(name: str) -> np.ndarray:
        return np.array([getattr(p, name) for p in points], dtype=np.float64)

    held = {
        "time": (np.array(stamps), "s"),
        "lat": (values("latitude"), "deg"),
        "lon": (values("longitude"), "deg"),
        "alt_msl": (values("elevation"), "m"),
        "quality": (np.array([QUALITY.get(p.type_of_gpx_fix or "", 1.0) for p in points]), None),
    }
    if np.isfinite(values("geoid_height")[timed]).all():
        held["geoid"] = (values("geoid_height"), "m")
    if np.isfinite(values("speed") * values("course")).any():
        held |= {"speed": (values("speed"), "m/s"), "course": (values("course"), "deg")}
    log = selected(RawLog.of(path, held, clock=UNIX), timed)
    if not timed.all():
        log.findings.append(
            Finding(
                "io.points-without-time",
                file=path.name,
                quantity="time",
                severity="note",
                lost=int((~timed).sum()),
                count=timed.size,
            )
        )
    return log

"""GPX tracks (https://www.topografix.com/GPX/1/1/): fixes, read by gpxpy.

Every ``trkpt`` of every track and segment, in their order: latitude and longitude in degrees of WGS
84, ``time`` in UTC. ``ele`` is over the sea, and ``geoidheight`` the height of the geoid over the
ellipsoid, as in NMEA GGA; ``fix`` is the kind of solution; GPX 1.0 also has ``speed`` in m/s and
``course`` in degrees from north.
"""

from __future__ import annotations

from datetime import UTC
from pathlib import Path
from xml.sax.saxutils import escape

import numpy as np

from strapdown.errors import DataError, Finding
from strapdown.formats.clocks import UNIX
from strapdown.formats.known_formats import selected
from strapdown.formats.recording import RawLog, library
from strapdown.formats.signs import Signs
from strapdown.formats.trajectory_writers import one_line
from strapdown.formats.writing import (
    FileOptions,
    Tables,
    dates,
    fixes_not_held,
    fixes_of,
    heights_of,
    iso_dates,
    over_ground,
)
from strapdown.tables.checks import values_of

QUALITY = {"none": 0.0, "dgps": 2.0, "pps": 3.0}


detect = Signs(text=r"\A[\s\S]{0,4092}?<gpx")


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


# Writing: GPX 1.0 (https://www.topografix.com/GPX/1/0/), which has speed and course; 1.1 has not.

_FIX = {1: "3d", 2: "dgps", 3: "pps", 4: "dgps", 5: "dgps"}
_BEGIN = """<?xml version="1.0" encoding="UTF-8"?>
<gpx version="1.0" creator="strapdown" xmlns="http://www.topografix.com/GPX/1/0">
<trk><name>{name}</name><trkseg>
"""


def write(path: Path, tables: Tables, options: FileOptions) -> list[Finding]:
    """Write one track of the fixes, or of the positions of a trajectory.

    Latitude and longitude have the fewest digits that reproduce each; dates microseconds, as far
    as readers go. ``ele`` is over the sea by the stated height of the geoid; without one it is that
    over the ellipsoid, with ``geoidheight`` 0 and a warning.

    DataError: the clock is not related to UTC, or there are neither fixes nor a trajectory.
    """
    options.require_wgs84("GPX")
    gnss, findings = fixes_of(tables, "GPX")
    stamps, said = dates(gnss, options, "GPX")
    over_sea, geoid, warned = heights_of(gnss, options)
    findings += [*said, *warned, *fixes_not_held("GPX", gnss, position_sd=False)]
    speed, course = (v.tolist() for v in over_ground(gnss))
    lines = [_BEGIN.format(name=escape(one_line(options.name)))]
    quality = values_of(gnss, ["quality"])[:, 0].astype(int).tolist()
    places = zip(*values_of(gnss, ["lat", "lon"]).T.tolist(), over_sea.tolist(), strict=True)
    for k, ((lat, lon, ele), date) in enumerate(zip(places, iso_dates(stamps), strict=True)):
        moves = ""
        if np.isfinite(speed[k]):
            moves = f"<course>{course[k]!r}</course><speed>{speed[k]!r}</speed>"
        fix = f"<fix>{_FIX[quality[k]]}</fix>" if quality[k] in _FIX else ""
        lines.append(
            f'<trkpt lat="{lat!r}" lon="{lon!r}"><ele>{ele!r}</ele><time>{date}</time>{moves}'
            f"<geoidheight>{geoid!r}</geoidheight>{fix}</trkpt>\n"
        )
    lines.append("</trkseg></trk>\n</gpx>\n")
    path.write_bytes("".join(lines).encode())
    return findings

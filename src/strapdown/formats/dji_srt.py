"""Subtitles of DJI drones (``.SRT``): the position at each frame or second of a video.

Two families, as in the samples of https://github.com/JuanIrache/DJI_SRT_Parser (MIT):

- ``[latitude: 59.30] [longitude: 18.20] [rel_alt: 1.3 abs_alt: 132.8]`` (older: ``[latitude : …]
  [longtitude : …] [altitude: …]``): degrees; ``rel_alt`` is over the point of take-off;
  ``abs_alt`` and ``altitude`` are over the ellipsoid in drones with RTK, and by the air pressure
  over the sea in others, which the file does not say (DJI Onboard SDK, "Altitude": fused altitude
  from the sea level at standard pressure, GPS and RTK altitude over the ellipsoid);
- ``GPS (13.37, 52.50, 15) … H 85.80m``: longitude, latitude, and a third number that is a count of
  satellites or a height, depending on the drone, and is not used; ``H`` and ``BAROMETER`` are
  heights over the point of take-off.

Of both families the absolute height is read if it is there, else that over the take-off.

Stamps are those of the subtitles, from the start of the video; the printed date has no time zone.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from strapdown.errors import DataError, Finding
from strapdown.formats import csv
from strapdown.formats.clocks import RELATIVE
from strapdown.formats.recording import RawLog
from strapdown.formats.signs import Signs, head

_TIME = re.compile(r"(\d+):(\d\d):(\d\d)[,.](\d{1,3})\s*-->")
_NUMBER = r"\s*([+-]?\d+(?:\.\d+)?)\s*"
_LAT = re.compile(r"\[\s*latitude\s*:" + _NUMBER, re.I)
_LON = re.compile(r"\[\s*long?t?itude\s*:" + _NUMBER, re.I)
_ALT = re.compile(r"\b(?:abs_alt|altitude)\s*:" + _NUMBER, re.I)
_UP = re.compile(r"\b(?:rel_alt\s*:|H(?=\s)|BAROMETER\s*:)" + _NUMBER, re.I)
_PAIR = re.compile(r"\bGPS\s*\(" + _NUMBER + "," + _NUMBER + ",")


def _has_positions(path: Path) -> bool:
    text = head(path, 4096)
    return bool(_TIME.search(text) and (_LAT.search(text) or _PAIR.search(text)))


detect = Signs(text=r"\A[\s\S]{0,4080}?\d:\d\d:\d\d[,.]\d{1,3}\s*-->", also=_has_positions)


def read(path: Path) -> RawLog:
    """Read the positions.

    Raises
    ------
    DataError
        No subtitle has a position, or the angles may be in radians.
    """
    text, findings = csv.decoded(path.read_bytes(), path.name)
    starts = list(_TIME.finditer(text))
    ends = [*(m.start() for m in starts[1:]), len(text)]
    rows, values, lost = [], [], 0
    for start, end in zip(starts, ends, strict=True):
        block = text[start.end() : end]
        hours, minutes, seconds, rest = (int(g) for g in start.groups())
        time = 3600 * hours + 60 * minutes + seconds + int(f"{rest:03d}") * 1e-3
        pair, lat, lon = _PAIR.search(block), _LAT.search(block), _LON.search(block)
        alt, up = _ALT.search(block), _UP.search(block)
        place = (pair[2], pair[1]) if pair else (lat[1], lon[1]) if lat and lon else None
        if place is None:
            lost += 1
            continue
        rows.append(text.count("\n", 0, start.start()) + 1)
        heights = (float(one[1]) if one else np.nan for one in (alt, up))
        values.append((time, float(place[0]), float(place[1]), *heights))
    if not values:
        raise DataError("io.srt-without-places", file=path.name, quantity="lat, lon")
    time, lats, lons, alts, ups = np.array(values).T
    none = (lats == 0.0) & (lons == 0.0)
    if np.abs(lats).max() <= np.pi / 2 and np.abs(lons).max() <= np.pi and not none.all():
        raise DataError(
            "io.srt-degrees-or-radians",
            file=path.name,
            quantity="lat, lon",
            lat=lats[~none][0],
            lon=lons[~none][0],
        )
    if lost:
        findings.append(
            Finding(
                "io.subtitles-without-place",
                file=path.name,
                severity="note",
                lost=lost,
                count=len(starts),
            )
        )
    held = {
        "time": (time, "s"),
        "lat": (lats, "deg"),
        "lon": (lons, "deg"),
        **({"alt_take_off": (ups, "m")} if np.isnan(alts).all() else {"alt_unstated": (alts, "m")}),
        "quality": (np.where(none, 0.0, 1.0), None),
    }
    return RawLog.of(path, held, rows=np.array(rows), clock=RELATIVE, findings=findings)

"""smartLoc of TU Chemnitz (https://www.tu-chemnitz.de/projekt/smartLoc): CSV of raw GNSS data.

A row is one pseudorange, in front of it the reference at its epoch, of a NovAtel SPAN system:
``GPSWeek [weeks]``, ``GPSSecondsOfWeek [s]``, longitude and latitude in degrees, height above the
ellipsoid, heading in rad from east, counterclockwise, speed along it, acceleration and yaw rate.
One rate and one acceleration are not three axes: the file gives positions, once an epoch.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from strapdown.errors import Finding
from strapdown.formats.clocks import GPS
from strapdown.formats.known_formats import column, selected, stated_by, under
from strapdown.formats.recording import RawLog
from strapdown.formats.signs import Signs

FIRST = ("GPSWeek [weeks]", "GPSSecondsOfWeek [s]")
LAT, LON = "Latitude (GT Lat) [deg]", "Longitude (GT Lon) [deg]"
ALT, SPEED = "Height above ellipsoid (GT Height) [m]", "Velocity (GT Velocity) [m/s]"


detect = Signs(text=r"\A" + "".join(f"(?=.*{re.escape(n)})" for n in (*FIRST, LAT, LON)))


def read(path: Path) -> RawLog:
    """Read position and velocity of the reference, once an epoch.

    Raises
    ------
    DataError
        A column is missing, or a value is not a number.
    """
    raw = under(path)
    heading = next((n for n in raw.columns if n.startswith("Heading (0° = East, counterc")), "")
    held = {
        "week": (column(raw, FIRST[0]), None),
        "time": (column(raw, FIRST[1]), "s"),
        "lat": (column(raw, LAT), "deg"),
        "lon": (column(raw, LON), "deg"),
        "alt": (column(raw, ALT), "m"),
        "speed": (column(raw, SPEED), "m/s"),
        "course": (np.mod(90.0 - np.degrees(column(raw, heading or "Heading")), 360.0), "deg"),
    }
    log = stated_by(raw, held, clock=GPS)
    epochs = held["time"][0] + 604_800.0 * held["week"][0]
    log = selected(log, np.diff(epochs, prepend=-np.inf) != 0.0)
    log.findings.append(
        Finding("io.smartloc-reference", file=path.name, quantity="lat, lon, alt", severity="note")
    )
    return log

"""What each key of an alignment wants, in a few words: for what is missing or still open."""

from __future__ import annotations

from strapdown.config.wanted import Wanted

__all__ = ["ALIGNMENT_WANTED"]

_WORDS = {
    "log.path": "the log, from the folder of this file",
    "simulation.duration": "how long to simulate",
    "site": "[site]: where the body stands",
    "site.lat": "geodetic latitude, north positive",
    "site.lon": "longitude, east positive",
    "site.alt": "height over the ellipsoid",
    "sensors.sensor": "a sensor of the catalogue (strapdown modules), or a .toml file of your own",
    "gyro.bias_sd_deg_per_h": "how large the gyros' bias may be: 0.01 deg/h is 0.05° of heading",
    "accel.bias_sd_ug": "how large the accelerometers' bias may be: 50 µg are 0.003° of tilt",
    "coarse.kind": "which coarse alignment",
    "coarse.heading": "heading of the body, clockwise from north",
    "reference.heading": "heading that is known from elsewhere",
}

ALIGNMENT_WANTED = Wanted(_WORDS)

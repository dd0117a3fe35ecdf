"""What each key of a run of navigation wants, in a few words: for what is missing or still open."""

from __future__ import annotations

from strapdown.config.wanted import Wanted

__all__ = ["NAVIGATION_WANTED"]

_WORDS = {
    "log.path": "the log, from the folder of this file",
    "truth.path": "the reference trajectory, from the folder of this file",
    "control_points.path": "a table of time, north, east, from the folder of this file",
    "simulation.motion": '[simulation.motion]: the motion, as kind = "car" and its keys',
    "start.lat": "geodetic latitude, north positive",
    "start.lon": "longitude, east positive",
    "start.alt": "height over the ellipsoid",
    "start.roll": "right side down is positive",
    "start.pitch": "nose up is positive",
    "start.heading": "clockwise from north",
    "site.lat": "geodetic latitude, north positive",
    "site.lon": "longitude, east positive",
    "site.alt": "height over the ellipsoid",
    "sensors.sensor": "a sensor of the catalogue (strapdown modules), or a .toml file of your own",
    "gyro.bias_sd_deg_per_h": "how large the gyros' bias may be",
    "accel.bias_sd_ug": "how large the accelerometers' bias may be",
    "coarse.heading": "heading of the body, clockwise from north",
    "kind": "which module stands here: strapdown modules lists them",
}

NAVIGATION_WANTED = Wanted(_WORDS)

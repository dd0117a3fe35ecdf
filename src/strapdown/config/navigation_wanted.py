"""What each key of a run of navigation wants, in a few words: for what is missing or still open."""

from __future__ import annotations

from strapdown.config.quantities import base_of, keys_of
from strapdown.config.toml_lines import KeyPath

__all__ = ["what_navigation_wants", "write_of_navigation"]

# By table and field without its unit.
WANTED: dict[str, str] = {
    "log.path": "the log, from the folder of this file",
    "truth.path": "the reference trajectory, from the folder of this file",
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


def what_navigation_wants(path: KeyPath) -> str:
    """Say what is wanted at a key; empty where nothing is known of it."""
    keys = [part for part in path if isinstance(part, str)]
    if not keys:
        return ""
    table = keys[-2] if len(keys) > 1 else ""
    for name in (keys[-1], base_of(keys[-1])):
        found = WANTED.get(f"{table}.{name}" if table else name) or WANTED.get(name)
        if found:
            return found
    return ""


def write_of_navigation(path: KeyPath) -> str:
    """The remedy for a key that is missing: how it is written, and what it is."""
    name = path[-1] if isinstance(path[-1], str) else ""
    said = what_navigation_wants(path)
    if said.startswith("["):
        header, _, meaning = said.partition(": ")
        return f"write {header} and its keys below it ({meaning})"
    form = f"write {' or '.join(keys_of(name)[:1])} = …"
    return f"{form} ({said})" if said else form

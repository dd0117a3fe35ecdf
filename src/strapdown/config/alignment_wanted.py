"""What each key of an alignment wants, in a few words: for what is missing or still open."""

from __future__ import annotations

from strapdown.config.quantities import base_of, keys_of
from strapdown.config.toml_lines import KeyPath

__all__ = ["what_alignment_wants", "write_of_alignment"]

# By table and field without its unit.
WANTED: dict[str, str] = {
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


def what_alignment_wants(path: KeyPath) -> str:
    """Say what is wanted at a key; empty where nothing is known of it."""
    keys = [part for part in path if isinstance(part, str)]
    if not keys:
        return ""
    table = keys[-2] if len(keys) > 1 else ""
    for name in (keys[-1], base_of(keys[-1])):
        found = WANTED.get(f"{table}.{name}" if table else name)
        if found:
            return found
    return ""


def write_of_alignment(path: KeyPath) -> str:
    """The remedy for a key that is missing: how it is written, and what it is."""
    name = path[-1] if isinstance(path[-1], str) else ""
    said = what_alignment_wants(path)
    if said.startswith("["):
        header, _, meaning = said.partition(": ")
        return f"write {header} and its keys below it ({meaning})"
    form = f"write {' or '.join(keys_of(name)[:1])} = …"
    return f"{form} ({said})" if said else form

"""Short descriptions of configuration keys, for messages on missing or open values."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from strapdown.config.toml_file import KeyPath
from strapdown.constants import STANDARD_GRAVITY

__all__ = [
    "ALIGNMENT_WANTED",
    "NAVIGATION_WANTED",
    "Wanted",
    "base_of",
    "converted",
    "keys_of",
    "wanted_at",
    "what_to_write",
]


@dataclass(frozen=True)
class Wanted:
    """Descriptions of the keys of one kind of file.

    Attributes
    ----------
    words : dict
        By table and field without its unit; a field alone where the meaning is the same everywhere.
    """

    words: Mapping[str, str]

    def at(self, path: KeyPath) -> str:
        """Describe the value of a key; empty if unknown."""
        keys = [part for part in path if isinstance(part, str)]
        if not keys:
            return ""
        table = keys[-2] if len(keys) > 1 else ""
        for name in (keys[-1], base_of(keys[-1])):
            found = self.words.get(f"{table}.{name}" if table else name) or self.words.get(name)
            if found:
                return found
        return ""

    def remedy(self, path: KeyPath) -> str:
        """Remedy for a missing key: how to write it, and its meaning."""
        name = path[-1] if isinstance(path[-1], str) else ""
        said = self.at(path)
        if said.startswith("["):
            header, _, meaning = said.partition(": ")
            return f"write {header} and its keys below it ({meaning})"
        form = f"write {' or '.join(keys_of(name)[:1])} = …"
        return f"{form} ({said})" if said else form


# Descriptions of the keys of a crash case.


AXES = "forward, right, down"
FROM = "from the origin that all positions share"
# By table and field without its unit; a field alone where the meaning is the same everywhere.
WANTED: dict[str, str] = {
    "title": "what the case is called in the report",
    "number": "the number or sign of the case",
    "author": "who answers for the report",
    "description": "what happened, in your words",
    "vehicle.name": "make, model and year of the vehicle",
    "vehicle.mass": "mass of the vehicle with its load",
    "vehicle.length": "overall length of the vehicle",
    "vehicle.width": "width of the vehicle without mirrors",
    "vehicle.front": "how far the front of the vehicle is ahead of the origin of positions",
    "vehicle.outline": "corners of the vehicle from above: forward, right of each, around it",
    "point": "[point]: the point whose motion is told",
    "point.name": "what the reference point is",
    "point.position": f"{AXES} of the reference point {FROM}",
    "entry": "[entry]: how the vehicle moved before the crash, and how that is known",
    "entry.kind": "speed, standstill or gnss",
    "entry.source": "where the speed is from: a test's speed trap, a tachograph, skid marks",
    "entry.speed": "speed of the vehicle at the entry",
    "entry.speed_sd": "standard deviation of that speed",
    "entry.time": "instant of the entry, from the trigger",
    "entry.heading": "heading of the vehicle at the entry, clockwise from north",
    "entry.slip": "direction of travel less heading, clockwise",
    "entry.path": "file of the satellite fixes",
    "entry.antenna": f"{AXES} of the antenna {FROM}",
    "units": "[[units]]: one for each recorder on the vehicle",
    "name": "a name, to be told apart by",
    "position": f"{AXES} of the recorder {FROM}; delta-V and the direction of force move with it",
    "position_sd": "standard deviation of each of these coordinates: how well it was measured",
    "angles": "roll, pitch, heading that turn vehicle axes into the recorder's",
    "angles_sd": "standard deviation of these angles",
    "trigger": "instant of the trigger on the recorder's clock",
    "trigger_sd": "standard deviation of that instant",
    "accelerometers": "[[units.accelerometers]]: one for each range, the lowest first",
    "gyro_from": "name of the unit whose gyro turns with this one",
    "rest": "start and end of the time in which the vehicle stood, from the trigger",
    "levelling": "roll and pitch of the vehicle before the crash",
    "levelling_sd": "standard deviation of these angles",
    "path": "the file, from the folder of this one",
    "channels": "the column or channel of each axis: x, y and z",
    "x": "column or channel of the forward axis",
    "y": "column or channel of the axis to the right",
    "z": "column or channel of the axis down",
    "time": "column of the time",
    "time_unit": "unit of the time: s, ms or us",
    "rate": "samples in a second",
    "unit": "unit of the record: g or m/s2, deg/s or rad/s",
    "sampling": "instantaneous or mean",
    "sensor": "a sensor of the catalogue, or a .toml file of your own",
    "uncertainty": "what is not known of the sensor, from its data sheet",
    "assumed": "what is taken for axes and gyros that are not there",
    "turn_sd": "by how much the vehicle may have turned, as a standard deviation",
    "delta_v_sd": "how large delta-V along the missing axis may be, as a standard deviation",
    "because": "why that may be taken",
    "references": "[[references]]: something else that is known of the crash",
    "references.kind": "path or delta_v",
    "references.name": "what it is: a video, a barrier's force, another recorder",
    "source": "where it is from",
    "references.path": "file of the path: time, north, east, down",
    "delta_v": "change of velocity from time zero",
    "at": "until when it is counted, from time zero",
    "window": "start and end of the path, from the trigger",
    "severity": "names of models of injury risk",
}


def wanted_at(path: KeyPath) -> str:
    """Describe the value of a key; empty if unknown."""
    keys = [part for part in path if isinstance(part, str)]
    if not keys:
        return ""
    field = base_of(keys[-1])
    table = keys[-2] if len(keys) > 1 else ""
    for unit in ("_km_per_h", "_mph", "_mm", "_cm", "_in", "_ft", "_ms", "_lb", "_g"):
        field = field.removesuffix(unit)
    return WANTED.get(f"{table}.{field}") or WANTED.get(field, "")


def what_to_write(path: KeyPath) -> str:
    """Remedy for a missing key: how to write it, and its meaning."""
    name = path[-1] if isinstance(path[-1], str) else ""
    said = wanted_at(path)
    keys = [key for key in keys_of(name) if not key.endswith(("_in", "_ft", "_lb", "_g"))]
    form = f"write {' or '.join(keys)} = …"
    if said.startswith("["):
        header, _, meaning = said.partition(": ")
        form, said = f"write {header} and its keys below it", meaning
    return f"{form} ({said})" if said else form


# Descriptions of the keys of an alignment.


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


# Descriptions of the keys of a navigation run.


_NAVIGATION_WANTED_WORDS = {
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

NAVIGATION_WANTED = Wanted(_NAVIGATION_WANTED_WORDS)


# Units of keys, and conversion to the unit of the field.


# By the unit ending of a specification key, the accepted endings, with the number to multiply with
# and the one to divide by: 600 mm are 0.6 m to the last bit.
UNITS: dict[str, dict[str, tuple[float, float]]] = {
    "_m_per_s2": {"_m_per_s2": (1.0, 1.0), "_g": (STANDARD_GRAVITY, 1.0)},
    "_m_per_s": {"_m_per_s": (1.0, 1.0), "_km_per_h": (1.0, 3.6), "_mph": (0.44704, 1.0)},
    "_m": {
        "_m": (1.0, 1.0),
        "_mm": (1.0, 1000.0),
        "_cm": (1.0, 100.0),
        "_in": (0.0254, 1.0),
        "_ft": (0.3048, 1.0),
    },
    "_s": {"_s": (1.0, 1.0), "_ms": (1.0, 1000.0)},
    "_kg": {"_kg": (1.0, 1.0), "_lb": (0.45359237, 1.0)},
    "_deg_per_s": {"_deg_per_s": (1.0, 1.0)},
    "_deg": {"_deg": (1.0, 1.0)},
    "_hz": {"_hz": (1.0, 1.0)},
}


def _ending(name: str) -> str | None:
    fits = [ending for ending in UNITS if name.endswith(ending)]
    found = max(fits, key=len, default=None)
    # The s of a rate or of a square root is not a time unit.
    of_another = found is not None and name.removesuffix(found).endswith(("_per", "_sqrt"))
    return None if of_another else found


def base_of(name: str) -> str:
    """A key of a specification without its unit: ``speed`` of ``speed_m_per_s``."""
    return name.removesuffix(_ending(name) or "")


def keys_of(name: str) -> tuple[str, ...]:
    """Accepted keys of a field, the field's own first."""
    ending = _ending(name)
    if ending is None:
        return (name,)
    return tuple(base_of(name) + unit for unit in UNITS[ending])


def converted(value: Any, key: str, name: str) -> Any:
    """Convert a value from the unit of a key to that of a field.

    Parameters
    ----------
    value : object
        A number, or lists of numbers; other values are returned unchanged.
    key : str
        One of `keys_of` the field.
    name : str
        Name of the field.
    """
    ending = _ending(name)
    if key == name or ending is None:
        return value
    if isinstance(value, list):
        return [converted(part, key, name) for part in value]
    if isinstance(value, bool) or not isinstance(value, int | float):
        return value
    multiply, divide = UNITS[ending][key.removeprefix(base_of(name))]
    try:
        return value * multiply / divide
    except OverflowError:
        return math.inf if value > 0 else -math.inf

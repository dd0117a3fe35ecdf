"""What each key of a crash case wants, in a few words: for what is missing or still open."""

from __future__ import annotations

from strapdown.config.quantities import base_of, keys_of
from strapdown.config.toml_lines import KeyPath

__all__ = ["wanted_at", "what_to_write"]

AXES = "forward, right, down"
FROM = "from the origin that all positions share"
# By table and field without its unit; a field alone where it means the same everywhere.
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
    """Say what is wanted at a key; empty where nothing is known of it."""
    keys = [part for part in path if isinstance(part, str)]
    if not keys:
        return ""
    field = base_of(keys[-1])
    table = keys[-2] if len(keys) > 1 else ""
    for unit in ("_km_per_h", "_mph", "_mm", "_cm", "_in", "_ft", "_ms", "_lb", "_g"):
        field = field.removesuffix(unit)
    return WANTED.get(f"{table}.{field}") or WANTED.get(field, "")


def what_to_write(path: KeyPath) -> str:
    """The remedy for a key that is missing: how it is written, and what it is."""
    name = path[-1] if isinstance(path[-1], str) else ""
    said = wanted_at(path)
    keys = [key for key in keys_of(name) if not key.endswith(("_in", "_ft", "_lb", "_g"))]
    form = f"write {' or '.join(keys)} = …"
    if said.startswith("["):
        header, _, meaning = said.partition(": ")
        form, said = f"write {header} and its keys below it", meaning
    return f"{form} ({said})" if said else form

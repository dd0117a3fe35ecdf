"""Speed of a vehicle's wheels in columns beside those of the inertial sensors, by their names.

A name says wheel, vehicle, car, CAN or OBD and speed; of four wheels it says which. Its unit must
be stated, as ``wheel_speed_kmh`` or in a row of units: km/h and m/s differ by less than speeds do.
"""

from __future__ import annotations

import itertools

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.errors import Finding, add_note
from strapdown.formats.columns import read_name
from strapdown.formats.recording import RawLog
from strapdown.formats.vocabularies import Quantity, Vocabulary
from strapdown.tables.checks import Array
from strapdown.tables.on_disk import stored
from strapdown.units import SPEEDS, find_unit

_WHEEL = ("wheelspeed", "wheelspd", "whlspeed", "whlspd", "wheelvelocity")
#: Of the vehicle, by its wheels or its gearbox; the first that is there counts.
_VEHICLE = (
    *("vehiclespeed", "vehspeed", "vehspd", "carspeed", "canspeed", "canvehiclespeed", "obdspeed"),
    *("speedobd", "obd2speed", "obdiispeed", "odospeed", "odometerspeed"),
)
_PLACES = {
    "front left": ("fl", "lf", "frontleft", "leftfront"),
    "front right": ("fr", "rf", "frontright", "rightfront"),
    "rear left": ("rl", "lr", "rearleft", "leftrear", "backleft"),
    "rear right": ("rr", "rearright", "rightrear", "backright"),
}
#: Pairs of which the mean is used, the first that is whole: rear wheels do not steer.
_AXLES = (("rear left", "rear right"), ("front left", "front right"))
_KNOWN = {
    place: Quantity(tuple(w for h in _WHEEL for x in words for w in (h + x, x + h)), SPEEDS)
    for place, words in _PLACES.items()
}
_KNOWN |= {"wheel": Quantity(_WHEEL, SPEEDS), "vehicle": Quantity(_VEHICLE, SPEEDS)}
_VOCABULARY = Vocabulary(_KNOWN, ("velocity",))


def names_of_wheels(raw: RawLog) -> tuple[str, ...]:
    """Columns with the speed that is used: two wheels of an axle, or one; empty without."""
    found: dict[str, str] = {}
    for name, values in raw.columns.items():
        quantity = read_name(name, _VOCABULARY).quantity
        if quantity is not None and values.dtype.kind in "iuf" and name not in raw.stated:
            found.setdefault(quantity, name)
    for axle in _AXLES:
        if set(axle) <= found.keys():
            return tuple(found[place] for place in axle)
    return next(((found[kind],) for kind in ("wheel", "vehicle") if kind in found), ())


def wheel_speed(
    raw: RawLog, time: Array, kept: NDArray[np.int64], findings: list[Finding]
) -> pd.Series | None:
    """Speed of the wheels, m/s, by the time of the rows that have a new one; None without.

    `time` ((m,), s), `kept` ((m,)): of the samples. A speed that is repeated until the next arrives
    counts once. A column without a unit of speed is a warning, and is not used.
    """
    names = names_of_wheels(raw)
    if not names:
        return None
    units = {name: _unit(raw, name) for name in names}
    if without := [name for name, unit in units.items() if unit is None]:
        code = "io.wheel-speed-unit-open"
        findings.append(Finding(code, file=raw.name, quantity="speed", names=without))
        return None
    block = [
        stored(raw.columns[name], kept).astype(np.float64) * SPEEDS[str(units[name])]
        for name in names
    ]
    speed = np.mean(block, axis=0)
    new = _new(speed)
    say_wheels(findings, raw.name, names)
    index = pd.Index(np.asarray(time)[new], name="time")
    return pd.Series(speed[new], index=index, name=", ".join(names))


def say_wheels(findings: list[Finding], file: str, names: tuple[str, ...]) -> None:
    """Add a note on the wheels, or the column, whose speed is used."""
    if len(names) > 1:
        add_note(findings, "io.wheel-speed-mean", file=file, quantity="speed", names=names)
    else:
        add_note(findings, "io.wheel-speed-of", file=file, quantity="speed", name=names[0])


def _unit(raw: RawLog, name: str) -> str | None:
    """Unit of speed of a column, as a row of units or its name states it."""
    apart = raw.units.get(name)
    found = find_unit(apart, ("velocity",)) if apart else None
    unit = found[1] if found else read_name(name, _VOCABULARY).unit
    return unit if unit in SPEEDS else None


def _new(speed: Array) -> NDArray[np.int64]:
    """Rows with a speed that was not there before.

    In a column that repeats each value until the next arrives: the first row of each, and where
    it stays, rows at the usual interval of changes.
    """
    rows = np.flatnonzero(np.isfinite(speed))
    if rows.size < 2:
        return rows
    changes = np.flatnonzero(np.concatenate([[True], np.diff(speed[rows]) != 0.0]))
    every = int(np.median(np.diff(changes))) if changes.size > 2 else 1
    if every < 2:
        return rows
    runs = np.append(changes, rows.size)
    starts = [np.arange(a, b, every) for a, b in itertools.pairwise(runs)]
    return np.asarray(rows[np.concatenate(starts)])

"""Speed of a vehicle's wheels in columns beside those of the inertial sensors, by their names.

A name says wheel, vehicle, car, CAN or OBD and speed, in any order; of four wheels it says which.
Its unit must be stated, as ``wheel_speed_kmh`` or in a row of units: km/h and m/s differ by less
than speeds do.
"""

from __future__ import annotations

import itertools

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.errors import Finding, add_note
from strapdown.formats.columns import read_name
from strapdown.formats.known_formats import interpolated
from strapdown.formats.recording import RawLog
from strapdown.formats.vocabularies import Quantity, Vocabulary
from strapdown.tables.checks import Array, find_gaps
from strapdown.tables.on_disk import stored
from strapdown.units import SPEEDS, find_unit


def _in_any_order(*parts: str) -> tuple[str, ...]:
    """Names of one word of each part, in any order."""
    chosen = itertools.product(*(part.split() for part in parts))
    return tuple("".join(order) for words in chosen for order in itertools.permutations(words))


#: Words of a wheel and of its speed.
_WHEEL = ("wheel whl", "speed spd velocity")
#: Of the vehicle, by its wheels or its gearbox; a velocity may be that of a receiver.
_VEHICLE = (
    *_in_any_order("vehicle veh car can obd obd2 obdii odo odometer", "speed spd"),
    *_in_any_order("can", "vehicle", "speed"),
)
#: Places of wheels, in one word or two.
_PLACES = {
    "front left": (("fl lf",), ("front", "left")),
    "front right": (("fr rf",), ("front", "right")),
    "rear left": (("rl lr",), ("rear back", "left")),
    "rear right": (("rr",), ("rear back", "right")),
}
#: Pairs of which the mean is used, the first that is whole: rear wheels do not steer.
_AXLES = (("rear left", "rear right"), ("front left", "front right"))
_KNOWN = {
    place: Quantity(tuple(w for words in ways for w in _in_any_order(*_WHEEL, *words)), SPEEDS)
    for place, ways in _PLACES.items()
}
_KNOWN["wheel"] = Quantity(_in_any_order(*_WHEEL), SPEEDS)
_KNOWN["vehicle"] = Quantity(_VEHICLE, SPEEDS)
_VOCABULARY = Vocabulary(_KNOWN, ("velocity",))
#: Why columns of wheels are not used, of warnings of a log.
UNIT_OPEN, EMPTY = "io.wheel-speed-unit-open", "io.no-usable-row"


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
    counts once. Columns without a unit of speed, or without a common value, are a warning, and are
    not used.
    """
    names = names_of_wheels(raw)
    if not names:
        return None
    units = {name: _unit(raw, name) for name in names}
    if without := [name for name, unit in units.items() if unit is None]:
        findings.append(Finding(UNIT_OPEN, file=raw.name, quantity="speed", names=without))
        return None
    block = [
        stored(raw.columns[name], kept).astype(np.float64) * SPEEDS[str(units[name])]
        for name in names
    ]
    speed = _mean(time, block)
    new = _new(speed)
    if not new.size:
        findings.append(Finding(EMPTY, file=raw.name, quantity=", ".join(names)))
        return None
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


def _mean(time: Array, block: list[Array]) -> Array:
    """Mean of wheels in the rows of the one that has the fewest values; NaN in others.

    Frames of a bus may fill the wheels in different rows: there the others are interpolated, but
    not over their gaps.
    """
    there = [np.isfinite(values) for values in block]
    least = min(there, key=np.count_nonzero)
    at = [
        values if own[least].all() else _between(time, time[own], values[own])
        for values, own in zip(block, there, strict=True)
    ]
    return np.asarray(np.mean(at, axis=0))


def _between(time: Array, own: Array, values: Array) -> Array:
    """Interpolate values to other stamps; NaN outside theirs, and within their gaps."""
    at = interpolated(time, own, [values])[:, 0]
    for gap in find_gaps(own):
        first, last = np.searchsorted(time, (gap.start, gap.end))
        at[first + 1 : last] = np.nan
    return at


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

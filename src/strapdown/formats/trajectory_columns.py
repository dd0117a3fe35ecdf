"""Which column of a text table is which quantity of a trajectory, and in which unit."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from strapdown.constants import TIME_UNITS
from strapdown.exceptions import ConfigError, DataError, nearest
from strapdown.formats.columns import CLOCKS, EULERS, TIMES
from strapdown.formats.unit_words import UNIT_OF as UNITS_OF_LOGS
from strapdown.formats.unit_words import unit_of
from strapdown.tables import TRAJECTORY

__all__ = ["QUANTITIES", "TrajectoryColumn", "find_trajectory_columns"]

QUANTITIES = ["time", *TRAJECTORY]
UP = "VU"


def _velocity(letter: str, *words: str) -> list[str]:
    heads = ("v", "vel", "velocity", "speed")
    names = [head + end for head in heads for end in (letter, *words)]
    return [*names, *(word + head for word in words for head in heads)]


NAMES: dict[str, list[str]] = {
    "time": [*TIMES, *CLOCKS],
    "lat": ["lat", "latitude"],
    "lon": ["lon", "lng", "long", "longitude"],
    "alt": [
        "alt",
        "altitude",
        "h",
        "hgt",
        "height",
        "hell",
        "ellipsoidalheight",
        "heightellipsoid",
    ],
    "VN": _velocity("n", "north"),
    "VE": _velocity("e", "east"),
    "VD": _velocity("d", "down"),
    UP: _velocity("u", "up"),
    **EULERS,
}
ANGLES = {"deg": 1.0, "rad": float(np.degrees(1.0))}
LENGTHS = {"m": 1.0, "km": 1000.0, "cm": 0.01, "mm": 0.001, "ft": 0.3048}
SPEEDS = {"m/s": 1.0, "km/h": 1.0 / 3.6, "kn": 1852.0 / 3600.0, "cm/s": 0.01, "mm/s": 0.001}
# Units as people write them, the parts of a name joined by underscores.
_SPELLINGS = {
    **{s: u for s, u in UNITS_OF_LOGS.items() if u in TIME_UNITS or u in ANGLES},
    **{u: u for u in LENGTHS},
    "meters": "m",
    "metres": "m",
    **{u: u for u in SPEEDS},
    **{u.replace("/", "_"): u for u in SPEEDS},
    "mps": "m/s",
    "kmh": "km/h",
    "kph": "km/h",
    "knots": "kn",
}
_KIND = {
    "time": TIME_UNITS,
    **dict.fromkeys(["lat", "lon", "roll", "pitch", "heading"], ANGLES),
    "alt": LENGTHS,
    **dict.fromkeys(["VN", "VE", "VD", UP], SPEEDS),
}
_BRACKETS = re.compile(r"[\[(]\s*([^\])]*?)\s*[\])]\s*$")


@dataclass(frozen=True)
class TrajectoryColumn:
    """A column of the file that is a quantity of a trajectory.

    Attributes
    ----------
    source : str
        Its name in the file.
    factor : float
        What turns its numbers into the table's unit; negative for a velocity that is up.
    stated : bool
        Its name says the unit; otherwise the table's own was taken.
    """

    source: str
    factor: float
    stated: bool


def find_trajectory_columns(
    names: Iterable[str], asked: Mapping[str, str], file: str
) -> dict[str, TrajectoryColumn]:
    """Find the column of each quantity.

    Parameters
    ----------
    names : iterable of str
        As they stand in the file.
    asked : mapping of str to str
        Quantity (one of `QUANTITIES`) to the name of its column, which goes before what the names
        suggest.
    file : str
        For messages.

    Returns
    -------
    dict of str to TrajectoryColumn
        One for each of `QUANTITIES`.

    Raises
    ------
    ConfigError
        A column that was asked for is not there, or its quantity is none.
    DataError
        A quantity is missing, two columns could be one, or a unit is none of its quantity.
    """
    columns = list(names)
    for quantity, name in asked.items():
        if quantity not in QUANTITIES:
            raise ConfigError(
                f"'{quantity}' is no quantity of a trajectory",
                quantity="columns",
                remedy=nearest(quantity, QUANTITIES),
            )
        if name not in columns:
            raise ConfigError(
                f"there is no column '{name}'",
                file=file,
                quantity=f"columns {quantity}",
                remedy=nearest(name, columns),
            )
    found: dict[str, TrajectoryColumn] = {}
    for name in columns:
        word, unit = _read(name)
        said = next((q for q, known in NAMES.items() if word in known), None)
        wanted = next((q for q, source in asked.items() if source == name), None)
        meant = wanted or said
        if meant is None or (wanted is None and _table_name(meant) in asked):
            continue
        # A column that was asked for may still say that it is up.
        sign = -1.0 if said == UP and _table_name(meant) == "VD" else 1.0
        factor = sign * _factor(meant, unit, word, name, file)
        known = _table_name(meant)
        if known in found:
            raise DataError(
                f"columns '{found[known].source}' and '{name}' could both be it",
                file=file,
                quantity=known,
                remedy=f"say which: columns={{'{known}': '{name}'}}",
            )
        found[known] = TrajectoryColumn(name, factor, bool(unit))
    missing = [q for q in QUANTITIES if q not in found]
    if missing:
        raise DataError(
            f"missing columns: {', '.join(missing)}; it has {', '.join(columns)}",
            file=file,
            remedy="a trajectory needs time, lat, lon, alt, VN, VE, VD, roll, pitch and heading; "
            "name columns that are called otherwise with columns={'lat': …}",
        )
    return found


def _table_name(quantity: str) -> str:
    return "VD" if quantity == UP else quantity


def _read(name: str) -> tuple[str, str | None]:
    """The word of a name, and its unit as it is spelled, or None."""
    text = name.strip()
    bracket = _BRACKETS.search(text)
    if bracket:
        text = text[: bracket.start()]
    words = [w for w in re.split(r"[\s_\-/:.]+", text.lower()) if w]
    if bracket:
        return "".join(words), re.sub(r"\s+", "", bracket.group(1).lower()) or None
    whole = "".join(words)
    if any(whole in known for known in NAMES.values()):
        return whole, None
    for take in (2, 1):
        spelled = "_".join(words[-take:])
        if len(words) > take and spelled in _SPELLINGS:
            return "".join(words[:-take]), spelled
    return whole, None


def _factor(quantity: str, unit: str | None, word: str, name: str, file: str) -> float:
    kind = _KIND[quantity]
    if unit is None:
        # A clock that is called millis says its unit.
        return kind[CLOCKS[word]] if quantity == "time" and word in CLOCKS else 1.0
    known = _SPELLINGS.get(unit) or unit_of(unit) or unit
    if known not in kind:
        raise DataError(
            f"'{unit}' is no unit of it (column '{name}')",
            file=file,
            quantity=_table_name(quantity),
            remedy=f"known are {', '.join(kind)}",
        )
    return kind[known]

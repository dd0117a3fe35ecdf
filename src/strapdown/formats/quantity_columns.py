"""Assignment of table columns to quantities, by words and units in their names."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from strapdown.errors import ConfigError, DataError, check_choice
from strapdown.formats.columns import CLOCKS
from strapdown.formats.recording import RawLog
from strapdown.units import ANGLES, LENGTHS, OF_TABLES, SPEEDS, unit_of, unit_words

__all__ = [
    "GEODETIC_QUANTITIES",
    "Found",
    "Quantity",
    "find_quantities",
    "quantities_of",
]


_BRACKETS = re.compile(r"[\[(]\s*([^\])]*?)\s*[\])]\s*$")


@dataclass(frozen=True)
class Quantity:
    """A quantity that a table may hold.

    Attributes
    ----------
    words : tuple of str
        Names without blanks, underscores and units, in lower case.
    units : dict of str to float
        Its units, each with its factor to that of the table; empty if dimensionless.
    negative : tuple of str
        Further words, for the opposite sign: ``velup`` for a velocity down.
    """

    words: tuple[str, ...]
    units: Mapping[str, float]
    negative: tuple[str, ...] = ()


@dataclass(frozen=True)
class Found:
    """The column of a quantity.

    Attributes
    ----------
    source : str
        Column name in the file.
    factor : float
        Factor to the table's unit and sign.
    stated : bool
        Whether the name states the unit; otherwise the table's own is assumed.
    """

    source: str
    factor: float
    stated: bool


def quantities_of(
    raw: RawLog, known: Mapping[str, Quantity], asked: Mapping[str, str], of: str = "this table"
) -> dict[str, Found]:
    """Find the column of each quantity: as asked, else as the file states, else by its name.

    See `find_quantities`. A file that states its columns is not searched by names.
    """
    if not raw.stated:
        return find_quantities(raw.columns, known, asked, raw.name, raw.units, of)
    found = {
        quantity: Found(column, 1.0 if unit is None else known[quantity].units[unit], True)
        for column, (quantity, unit) in raw.stated.items()
        if quantity in known and quantity not in asked
    }
    return found | (find_quantities(raw.columns, known, asked, raw.name) if asked else {})


def find_quantities(
    names: Iterable[str],
    known: Mapping[str, Quantity],
    asked: Mapping[str, str],
    file: str,
    units: Mapping[str, str] | None = None,
    of: str = "this table",
) -> dict[str, Found]:
    """Find the column of each quantity.

    `names`: as in the file. `asked`: quantity to the name of its column, or its number, from 1;
    overrides what the names suggest. `file`: for messages. `units`: column to unit, if stated apart
    from the name. `of`: object that the quantities describe, for messages. Returns quantities that
    were not found are absent. ConfigError: a requested column does not exist, or its quantity is
    unknown. DataError: two columns fit one quantity, or a unit does not fit its quantity.
    """
    columns = list(names)
    wanted: dict[str, str] = {}
    for quantity, name in asked.items():
        if quantity not in known:
            raise ConfigError(
                "io.unknown-quantity-of-table",
                quantity="columns",
                of_what=quantity,
                of=of,
                word=quantity,
                known=known,
            )
        if name not in columns and name.isdecimal() and 1 <= int(name) <= len(columns):
            name = columns[int(name) - 1]
        check_choice(
            "io.no-column-3", columns, quantity=f"columns {quantity}", file=file, name=name
        )
        wanted[name] = quantity
    found: dict[str, Found] = {}
    for name in columns:
        word, unit = read_words(name, known)
        unit = unit or ((units or {}).get(name, "").strip("[]() ").lower() or None)
        said = next((q for q, k in known.items() if word in k.words or word in k.negative), None)
        meant = wanted.get(name, said)
        if meant is None or (name not in wanted and meant in asked):
            continue
        sign = -1.0 if word in known[meant].negative else 1.0
        factor = sign * _factor(meant, known[meant], unit, word, name, file)
        if meant in found:
            raise DataError(
                "io.column-names-ambiguous",
                file=file,
                quantity=meant,
                source=found[meant].source,
                name=name,
                meant=meant,
            )
        found[meant] = Found(name, factor, bool(unit))
    return found


def read_words(name: str, known: Mapping[str, Quantity]) -> tuple[str, str | None]:
    """Split a name into its word without blanks, and its unit as spelled, or None.

    `known`: a name that is a word as a whole has no unit: ``h``, ``s``.
    """
    text = name.strip()
    bracket = _BRACKETS.search(text)
    if bracket:
        text = text[: bracket.start()]
    words = [w for w in re.split(r"[\s_\-/:.#]+", text.lower()) if w]
    if bracket:
        return "".join(words), re.sub(r"\s+", "", bracket.group(1).lower()) or None
    whole = "".join(words)
    if any(whole in k.words or whole in k.negative for k in known.values()):
        return whole, None
    bare, its = unit_words(words, OF_TABLES)
    return "".join(bare), its or None


def _factor(
    quantity: str, known: Quantity, unit: str | None, word: str, name: str, file: str
) -> float:
    if unit is None:
        # The word millis of a clock states its unit.
        return known.units[CLOCKS[word]] if word in CLOCKS and CLOCKS[word] in known.units else 1.0
    spelled = unit_of(unit, OF_TABLES) or unit
    if spelled not in known.units:
        raise DataError(
            "io.unit-of-other-quantity",
            file=file,
            quantity=quantity,
            unit=unit,
            name=name,
            units=", ".join(known.units) or "none",
        )
    return known.units[spelled]


# Column names of positions and velocities in tables of fixes and of trajectories.


_HEADS = ("v", "vel", "velocity", "speed")


def _velocities(letter: str, word: str) -> tuple[str, ...]:
    return tuple(h + e for h in _HEADS for e in (letter, word)) + tuple(word + h for h in _HEADS)


#: Degrees, meters over the ellipsoid, meters per second; velocity up is negative velocity down.
GEODETIC_QUANTITIES: dict[str, Quantity] = {
    "lat": Quantity(("lat", "latitude"), ANGLES),
    "lon": Quantity(("lon", "lng", "long", "longitude"), ANGLES),
    "alt": Quantity(
        (
            "alt",
            "altitude",
            "h",
            "hgt",
            "height",
            "hell",
            "altell",
            "heightell",
            "ellipsoidalheight",
            "heightellipsoid",
            "altitudeellipsoid",
        ),
        LENGTHS,
    ),
    "VN": Quantity(_velocities("n", "north"), SPEEDS),
    "VE": Quantity(_velocities("e", "east"), SPEEDS),
    "VD": Quantity(_velocities("d", "down"), SPEEDS, _velocities("u", "up")),
}

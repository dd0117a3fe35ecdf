"""Assignment of table columns to quantities, by words and units in their names."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import ConfigError, DataError, StrapdownError, check_choice
from strapdown.formats.arrays import numbers, ticks_of
from strapdown.formats.clocks import clock_of_name
from strapdown.formats.columns import CLOCKS, TIMES, split_brackets
from strapdown.formats.recording import RawLog
from strapdown.units import ANGLES, LENGTHS, OF_TABLES, SPEEDS, TIME_UNITS, unit_of, unit_words

__all__ = [
    "FIX_QUANTITIES",
    "GEODETIC_QUANTITIES",
    "Found",
    "Quantity",
    "find_quantities",
    "fix_columns",
    "names_of_fixes",
]


Array = NDArray[np.float64]


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

    def values(self, raw: RawLog, quantity: str) -> Array:
        """Return the numbers in the table's unit and sign; (n,).

        `quantity`: for messages. DataError: a value is not a number.
        """
        return np.asarray(numbers(raw, self.source, quantity), np.float64) * self.factor

    def stamps(self, raw: RawLog) -> tuple[Array, str, bool]:
        """Return seconds, (n,), the name of their clock, and whether they were dates.

        DataError: a stamp is neither a number nor a date.
        """
        ticks, dated = ticks_of(raw, self.source)
        time = np.asarray(ticks * (1e-9 if dated else self.factor), dtype=np.float64)
        finite = time[np.isfinite(time)]
        first = float(finite[0]) if finite.size else 0.0
        return time, raw.clock or clock_of_name(self.source, first, dated=dated), dated


def find_quantities(
    names: Iterable[str],
    known: Mapping[str, Quantity],
    asked: Mapping[str, str],
    file: str,
    units: Mapping[str, str] | None = None,
    of: str = "this table",
    before: re.Pattern[str] | None = None,
) -> dict[str, Found]:
    """Find the column of each quantity.

    `names`: as in the file. `asked`: quantity to the name of its column, or its number, from 1;
    overrides what the names suggest. `file`: for messages. `units`: column to unit, if stated apart
    from the name. `of`: object that the quantities describe, for messages. `before`: words that may
    precede the name of a quantity that has no column otherwise. Returns quantities that were
    not found are absent. ConfigError: a requested column does not exist, or its quantity is
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
    read = {name: read_words(name, known) for name in columns}
    there = {_quantity_of(word, known) for word, _ in read.values()}
    for name in columns:
        word, unit = read[name]
        unit = unit or ((units or {}).get(name, "").strip("[]() ").lower() or None)
        said = _quantity_of(word, known)
        while said is None and before is not None and (match := before.match(word)):
            word = word[match.end() :]
            said = _quantity_of(word, known)
            said = None if said in there else said
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


def _quantity_of(word: str, known: Mapping[str, Quantity]) -> str | None:
    return next((q for q, k in known.items() if word in k.words or word in k.negative), None)


def read_words(name: str, known: Mapping[str, Quantity]) -> tuple[str, str | None]:
    """Split a name into its word without blanks, and its unit as spelled, or None.

    `known`: a name that is a word as a whole has no unit: ``h``, ``s``.
    """
    text, bracket = split_brackets(name.strip())
    words = [w for w in re.split(r"[\s_\-/:.#]+", text.lower()) if w]
    if bracket:
        return "".join(words), re.sub(r"\s+", "", bracket.lower())
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


# Column names of fixes.


#: Words before the names of a fix among other columns, as in ``gps_lat``, ``location.latitude``.
_OF_FIXES = re.compile(r"(?:gps|gnss|navsat|location|loc|position|pos|coords|fix)(?=..)")
_SD_HEADS = ("sd", "std", "stddev", "stdev", "sigma", "s")


def _sds(*words: str) -> tuple[str, ...]:
    """List names of a standard deviation, with the word for it before or after the quantity."""
    return tuple(h + w for h in _SD_HEADS for w in words) + tuple(
        w + h for h in _SD_HEADS[:-1] for w in words
    )


#: Quantities of a table of fixes, with their possible names.
FIX_QUANTITIES: dict[str, Quantity] = {
    "time": Quantity(
        (*TIMES, *CLOCKS, "gpssecondsofweek", "secondsofweek", "utc", "datetime", "date"),
        TIME_UNITS,
    ),
    "week": Quantity(("week", "gpsweek", "weeknumber", "wn"), {}),
    **GEODETIC_QUANTITIES,
    "alt_msl": Quantity(
        (
            "hmsl",
            "altmsl",
            "altitudemsl",
            "heightmsl",
            "mslaltitude",
            "mslheight",
            "orthometricheight",
        ),
        LENGTHS,
    ),
    "geoid": Quantity(
        ("geoid", "undulation", "geoidsep", "geoidseparation", "geoidheight", "geoidundulation"),
        LENGTHS,
    ),
    "alt_take_off": Quantity(
        (
            "relalt",
            "relativealt",
            "relativealtitude",
            "heightabovetakeoff",
            "altitudeabovetakeoff",
            "heighttakeoff",
        ),
        LENGTHS,
    ),
    # Of formats that do not say whether it is over the ellipsoid or over the sea.
    "alt_unstated": Quantity((), LENGTHS),
    "north": Quantity(("north", "posn", "positionnorth", "northposition"), LENGTHS),
    "east": Quantity(("east", "pose", "positioneast", "eastposition"), LENGTHS),
    "up": Quantity(("up", "posu", "positionup"), LENGTHS, ("down", "posd", "positiondown")),
    **{
        f"ecef_{axis}": Quantity((f"ecef{axis}", f"{axis}ecef", f"positionecef{axis}"), LENGTHS)
        for axis in "xyz"
    },
    "north_sd": Quantity(_sds("n", "north", "lat", "latitude"), LENGTHS),
    "east_sd": Quantity(_sds("e", "east", "lon", "longitude"), LENGTHS),
    "down_sd": Quantity(
        _sds("d", "down", "u", "up", "h", "alt", "altitude", "height", "hgt"), LENGTHS
    ),
    "VN_sd": Quantity(_sds("vn", "veln", "velocityn", "northvelocity", "velnorth"), SPEEDS),
    "VE_sd": Quantity(_sds("ve", "vele", "velocitye", "eastvelocity", "veleast"), SPEEDS),
    "VD_sd": Quantity(
        _sds("vd", "veld", "velocityd", "vu", "velu", "velocityu", "veldown", "velup"), SPEEDS
    ),
    "horizontal_accuracy": Quantity(
        (
            "accuracy",
            "horizontalaccuracy",
            "locationhorizontalaccuracy",
            "accuracyhorizontal",
            "hacc",
            "haccuracy",
            "eph",
        ),
        LENGTHS,
    ),
    "vertical_accuracy": Quantity(
        (
            "verticalaccuracy",
            "locationverticalaccuracy",
            "altitudeaccuracy",
            "accuracyvertical",
            "vacc",
            "vaccuracy",
            "epv",
        ),
        LENGTHS,
    ),
    "speed": Quantity(("speed", "sog", "groundspeed", "locationspeed", "speedoverground"), SPEEDS),
    "speed_sd": Quantity(("speedaccuracy", "speedsd", "sacc", "locationspeedaccuracy"), SPEEDS),
    "course": Quantity(
        (
            "course",
            "cog",
            "bearing",
            "courseoverground",
            "locationcourse",
            "track",
            "directionofmotion",
            "gpsheading",
            "gnssheading",
            "headmot",
        ),
        ANGLES,
    ),
    "quality": Quantity(("quality", "fixquality", "gpsquality", "gnssquality"), {}),
    "Q": Quantity(("q",), {}),
}


def fix_columns(raw: RawLog, asked: Mapping[str, str]) -> dict[str, Found]:
    """Find the columns of fixes: as asked, else as the file states, else by their names.

    Names are those of `FIX_QUANTITIES`, also after ``gps_``: a quantity that has its own name is
    not searched behind such a word, for beside ``time`` and ``speed``, ``gps_time`` and
    ``gps_speed`` are others. A file that states its columns is not searched by names. Errors as of
    `find_quantities`.
    """
    known = FIX_QUANTITIES
    if not raw.stated:
        return find_quantities(raw.columns, known, asked, raw.name, raw.units, before=_OF_FIXES)
    found = {
        quantity: Found(column, 1.0 if unit is None else known[quantity].units[unit], True)
        for column, (quantity, unit) in raw.stated.items()
        if quantity in known and quantity not in asked
    }
    return found | (find_quantities(raw.columns, known, asked, raw.name) if asked else {})


def names_of_fixes(raw: RawLog) -> set[str]:
    """Return the columns that are of fixes; empty without latitude and longitude."""
    try:
        found = fix_columns(raw, {})
    except StrapdownError:
        return set()
    there = {"lat", "lon"} <= found.keys()
    return {column.source for column in found.values()} if there else set()

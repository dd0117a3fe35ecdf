"""Assignment of table columns to quantities, by words and units in their names."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import ConfigError, DataError, StrapdownError, check_choice
from strapdown.formats.arrays import numbers, ticks_of
from strapdown.formats.clocks import clock_of_name
from strapdown.formats.columns import ColumnName, clocks_with_unit, read_name
from strapdown.formats.recording import RawLog
from strapdown.formats.vocabularies import FIXES, Quantity, Vocabulary

__all__ = ["Found", "find_quantities", "fix_columns", "names_of_fixes"]


Array = NDArray[np.float64]


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
    of: Vocabulary,
    asked: Mapping[str, str],
    file: str,
    units: Mapping[str, str] | None = None,
) -> dict[str, Found]:
    """Find the column of each quantity.

    `names`: as in the file. `of`: vocabulary of the file. `asked`: quantity to the name of its
    column, or its number, from 1; overrides what the names suggest. `file`: for messages. `units`:
    column to unit, if stated apart from the name. Returns quantities that were not found are
    absent. ConfigError: a requested column does not exist, or its quantity is unknown. DataError:
    two columns fit one quantity, or a unit does not fit its quantity.
    """
    columns, known = list(names), of.quantities
    wanted: dict[str, str] = {}
    for quantity, name in asked.items():
        if quantity not in known:
            raise ConfigError(
                "io.unknown-quantity-of-table",
                quantity="columns",
                of_what=quantity,
                of=of.of,
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
    read = {name: read_name(name, of, (units or {}).get(name, "")) for name in columns}
    for evidence in range(3):
        there = set(found) | set(asked)
        clocks = [n for n, s in read.items() if (s.quantity, s.loose) == ("time", evidence)]
        others = set(clocks).difference(clocks_with_unit(clocks, lambda n: bool(read[n].unit)))
        for name, said in read.items():
            meant = wanted.get(name) if evidence == 0 else None
            free = name not in wanted and name not in others
            if free and said.loose == evidence and said.quantity not in there:
                meant = said.quantity
            if meant is None or (evidence == 2 and not _is_plain(name, read, known)):
                continue
            sign = said.sign if said.quantity == meant else 1.0
            factor = sign * _factor(meant, known[meant], said.unit, name, file)
            if meant in found:
                raise DataError(
                    "io.column-names-ambiguous",
                    file=file,
                    quantity=meant,
                    source=found[meant].source,
                    name=name,
                    meant=meant,
                )
            found[meant] = Found(name, factor, bool(said.unit))
    return found


def _is_plain(name: str, read: Mapping[str, ColumnName], known: Mapping[str, Quantity]) -> bool:
    """Whether a name of which only words are known is alone with them, and its unit fits."""
    said = read[name]
    alone = [n for n, other in read.items() if (other.quantity, other.loose) == (said.quantity, 2)]
    return len(alone) == 1 and (not said.unit or said.unit in known[str(said.quantity)].units)


def _factor(quantity: str, known: Quantity, unit: str | None, name: str, file: str) -> float:
    if unit is None:
        return 1.0
    if unit not in known.units:
        raise DataError(
            "io.unit-of-other-quantity",
            file=file,
            quantity=quantity,
            unit=unit,
            name=name,
            units=", ".join(known.units) or "none",
        )
    return known.units[unit]


def fix_columns(raw: RawLog, asked: Mapping[str, str]) -> dict[str, Found]:
    """Find the columns of fixes: as asked, else as the file states, else by their names.

    Names are those of `FIXES`, also after ``gps_``: a quantity that has its own name is not
    searched behind such a word, for beside ``time`` and ``speed``, ``gps_time`` and ``gps_speed``
    are others. A file that states its columns is not searched by names. Errors as of
    `find_quantities`.
    """
    if not raw.stated:
        return find_quantities(raw.columns, FIXES, asked, raw.name, raw.units)
    known = FIXES.quantities
    found = {
        quantity: Found(column, 1.0 if unit is None else known[quantity].units[unit], True)
        for column, (quantity, unit) in raw.stated.items()
        if quantity in known and quantity not in asked
    }
    named = find_quantities(raw.columns, FIXES, asked, raw.name) if asked else {}
    return found | {quantity: named[quantity] for quantity in asked}


def names_of_fixes(raw: RawLog) -> set[str]:
    """Return the columns that are of fixes; empty without latitude and longitude."""
    try:
        found = fix_columns(raw, {})
    except StrapdownError:
        return set()
    there = {"lat", "lon"} <= found.keys()
    return {column.source for column in found.values()} if there else set()

"""Assignment of the columns of a text table to the quantities of a trajectory, with units."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from strapdown.constants import TIME_UNITS
from strapdown.errors import DataError
from strapdown.formats.columns import CLOCKS, EULERS, TIMES
from strapdown.formats.geodetic_quantities import GEODETIC_QUANTITIES
from strapdown.formats.quantity_columns import ANGLES, Found, Quantity, find_quantities

__all__ = ["QUANTITIES", "find_trajectory_columns"]

#: Quantities of a trajectory table, with their possible names.
QUANTITIES: dict[str, Quantity] = {
    "time": Quantity((*TIMES, *CLOCKS), TIME_UNITS),
    **GEODETIC_QUANTITIES,
    **{angle: Quantity(tuple(words), ANGLES) for angle, words in EULERS.items()},
}


def find_trajectory_columns(
    names: Iterable[str], asked: Mapping[str, str], file: str
) -> dict[str, Found]:
    """Find the column of each quantity.

    Parameters
    ----------
    names : iterable of str
        As in the file.
    asked : mapping of str to str
        Quantity (one of `QUANTITIES`) to the name of its column, or its number, from 1;
        overrides what the names suggest.
    file : str
        For messages.

    Returns
    -------
    dict of str to Found
        One for each of `QUANTITIES`.

    Raises
    ------
    ConfigError
        A requested column does not exist, or its quantity is unknown.
    DataError
        A quantity is missing, two columns fit one quantity, or a unit does not fit.
    """
    columns = list(names)
    found = find_quantities(columns, QUANTITIES, asked, file, of="a trajectory")
    missing = [q for q in QUANTITIES if q not in found]
    if missing:
        raise DataError("io.missing-columns-3", file=file, missing=missing, columns=columns)
    return found

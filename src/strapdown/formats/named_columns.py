"""Tables with fixed column names, with or without units."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.errors import DataError
from strapdown.formats import read_raw
from strapdown.formats.recording import RawLog
from strapdown.tables import NED, POSITION_SD

__all__ = ["columns_of", "read_reference_path"]

Array = NDArray[np.float64]

#: Accepted units, each with its table unit and the factor to it.
UNITS: dict[str, tuple[str, float]] = {
    "s": ("s", 1.0),
    "ms": ("s", 1e-3),
    "m": ("m", 1.0),
    "cm": ("m", 1e-2),
    "mm": ("m", 1e-3),
    "deg": ("deg", 1.0),
    "m/s": ("m/s", 1.0),
    "km/h": ("m/s", 1.0 / 3.6),
    "Pa": ("Pa", 1.0),
    "hPa": ("Pa", 100.0),
    "mbar": ("Pa", 100.0),
    "kPa": ("Pa", 1000.0),
}
_HEAD = re.compile(r"\s*([A-Za-z][A-Za-z_ ]*?)\s*(?:[\[(]\s*([^\])]+?)\s*[\])])?\s*")
_ENDINGS = {"_m_per_s": "m/s", "_km_per_h": "km/h", "_mm": "mm", "_ms": "ms", "_deg": "deg"}
_ENDINGS |= {"_hpa": "hPa", "_kpa": "kPa", "_pa": "Pa", "_m": "m", "_s": "s"}


def read_reference_path(path: str | Path) -> pd.DataFrame:
    """Read the path of a point from cameras or a survey.

    `path`: a table with the columns ``time north east down`` and, if not exact, ``north_sd east_sd
    down_sd``; s and m, unless a column states ``[ms]`` or ``[mm]``. Returns indexed by time in s,
    positions in m. ConfigError: the file does not exist. DataError: a column is missing or unknown,
    a value is not a number, or time does not advance.
    """
    raw = read_raw(Path(path))
    units = {"time": "s"} | dict.fromkeys([*NED, *POSITION_SD], "m")
    found = columns_of(raw, units, ["time", *NED])
    has_sd = [name for name in POSITION_SD if name in found]
    if has_sd and len(has_sd) < len(POSITION_SD):
        missing = next(name for name in POSITION_SD if name not in found)
        raise DataError(
            "io.missing-while-another-standard-deviation", file=raw.name, quantity=missing
        )
    time = found.pop("time")
    _check_advances(raw, time)
    table = pd.DataFrame(found, index=pd.Index(time, name="time"))[[*NED, *has_sd]]
    table.attrs["source"] = raw.name
    return table


def columns_of(raw: RawLog, units: Mapping[str, str], wanted: Sequence[str]) -> dict[str, Array]:
    """Return columns by name, in the units of the tables; (n,).

    `units`: unit of each possible column. `wanted`: required columns. DataError: a column is
    missing, has an unknown unit, or holds a value that is not a number.
    """
    by_lower = {name.lower(): name for name in units}
    found: dict[str, Array] = {}
    for head, values in raw.columns.items():
        name, unit = _name_and_unit(head, by_lower)
        unit = unit or raw.units.get(head, "")
        if name is None:
            continue
        factor = 1.0
        if unit:
            of, factor = UNITS.get(unit, ("", 1.0))
            if of != units[name]:
                known = [u for u in UNITS if UNITS[u][0] == units[name]]
                raise DataError(
                    "io.unit-needed",
                    file=raw.name,
                    quantity=head,
                    unit=unit,
                    units=units[name] or "none",
                    known=known,
                )
        found[name] = _numbers(raw, head, values) * factor
    for name in wanted:
        if name not in found:
            raise DataError(
                "io.no-column-2",
                file=raw.name,
                quantity="columns",
                name=name,
                wanted=wanted,
                word=name,
                known=raw.columns,
            )
    return found


def _name_and_unit(head: str, names: Mapping[str, str]) -> tuple[str | None, str]:
    match = _HEAD.fullmatch(head)
    if match is None:
        return None, ""
    word, unit = match[1].strip().replace(" ", "_"), match[2] or ""
    if word.lower() in names:
        return names[word.lower()], unit
    for ending, of in _ENDINGS.items():
        if word.lower().endswith(ending) and word.lower().removesuffix(ending) in names:
            return names[word.lower().removesuffix(ending)], of
    return None, ""


def _numbers(raw: RawLog, name: str, values: NDArray[np.generic]) -> Array:
    if values.dtype.kind not in "iuf":
        raise DataError("io.holds-text", file=raw.name, quantity=name)
    numbers = values.astype(np.float64)
    bad = np.flatnonzero(~np.isfinite(numbers))
    if bad.size:
        raise DataError(
            "io.no-number-3",
            file=raw.name,
            row=raw.row(int(bad[0])),
            quantity=name,
            numbers=numbers[bad[0]],
        )
    return numbers


def _check_advances(raw: RawLog, time: Array) -> None:
    back = np.flatnonzero(np.diff(time) <= 0.0)
    if back.size:
        k = int(back[0]) + 1
        raise DataError(
            "io.time-goes-3",
            file=raw.name,
            row=raw.row(k),
            quantity="time",
            time=time[k - 1],
            time_2=time[k],
        )

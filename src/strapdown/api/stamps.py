"""Time, units and names of tables in memory: dates become seconds, other units are refused.

A table of this package has its time in s and its columns in SI. pandas has clocks of dates and
durations, a default index that counts rows, and names in levels; taken as numbers they would be
nanoseconds or rows.
"""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.errors import DataError
from strapdown.formats.clocks import UNIX
from strapdown.formats.columns import read_name
from strapdown.units import unit_of

#: Units of the columns of a table.
SI = ("rad/s", "m/s2", "uT")


def as_frame(table: Any) -> Any:
    """Return a table of another library (polars, pyarrow) as one of pandas; anything else as is.

    DataError: two columns have the same name.
    """
    if not isinstance(table, pd.DataFrame) and callable(getattr(table, "to_pandas", None)):
        table = table.to_pandas()
    if isinstance(table, pd.DataFrame):
        _refuse_repeated(table.columns)
    return table


def _refuse_repeated(names: pd.Index) -> None:
    texts = names if names.nlevels > 1 else names.map(str)
    if not texts.is_unique:
        name = texts[texts.duplicated()][0]
        raise DataError("api.column-named-twice", name=name)


def plain_columns(table: pd.DataFrame) -> tuple[pd.DataFrame, dict[str, str]]:
    """Return a table as columns of a file, and the units of those that were durations.

    The index is a column, unless a column is the clock already; texts of numbers are numbers, and
    NaN where they are not.
    """
    out = flat(table, ()).reset_index(drop=True).infer_objects()
    out.attrs = {}
    out.columns = [str(name) for name in out.columns]
    clocked = any(read_name(name).quantity == "time" for name in out.columns)
    for k in reversed(range(table.index.nlevels)):
        level = table.index.get_level_values(k)
        name = "time" if level.name is None else str(level.name)
        # Integers without a name beside a clock count rows, of which some may have been left out.
        counts = isinstance(level, pd.RangeIndex) or (clocked and level.dtype.kind in "iu")
        if name not in out.columns and not (level.name is None and counts):
            out.insert(0, name, level)
    units = {}
    for name in [str(name) for name in out.columns]:
        column = out[name]
        if column.dtype.kind == "m":
            out[name], units[name] = seconds_of(column)[0], "s"
        elif pd.api.types.is_string_dtype(column.dtype):
            numbers = pd.to_numeric(column, errors="coerce")
            if 2 * numbers.notna().sum() > column.notna().sum():
                out[name] = numbers
    return out, units


def seconds_of(stamps: Any) -> tuple[Any, dict[str, Any]]:
    """Return stamps in s, and the `attrs` of their clock.

    Dates, UTC without a zone, count from the whole second of the first, which is ``clock_origin``;
    durations are seconds. Other stamps are returned as they are, without `attrs`.
    """
    if isinstance(stamps, list | tuple) and stamps and isinstance(stamps[0], datetime):
        stamps = pd.DatetimeIndex(pd.to_datetime(stamps, utc=True))
    kind = getattr(stamps, "dtype", None)
    if isinstance(kind, pd.DatetimeTZDtype):
        stamps = pd.DatetimeIndex(stamps).tz_convert("UTC").tz_localize(None)
    elif getattr(kind, "kind", "") not in ("M", "m"):
        return stamps, {}
    values: NDArray[Any] = np.asarray(stamps)
    missing = np.isnat(values)
    if missing.any():
        row = int(np.argmax(missing)) + 1
        raise DataError("api.stamp-missing", quantity="time", row=row)
    if values.dtype.kind == "m":
        return values.astype("timedelta64[ns]").astype(np.int64) * 1e-9, {}
    ns: NDArray[np.int64] = values.astype("datetime64[ns]").astype(np.int64)
    origin = int(ns[0] // 10**9) if ns.size else 0
    return (ns - origin * 10**9) * 1e-9, {"clock": UNIX, "clock_origin": float(origin)}


def by_time(table: pd.DataFrame, quantity: str = "imu") -> pd.DataFrame:
    """Return a table indexed by time in s, from its index or its column ``time``.

    DataError: the index only counts rows, or states another unit than s.
    """
    out = table
    if "time" in table.columns:
        out = table.set_index("time")
        out.attrs = dict(table.attrs)
    elif isinstance(table.index, pd.RangeIndex) and table.index.name is None and len(table) > 1:
        clocks = [str(c) for c in table.columns if read_name(str(c)).quantity == "time"]
        code = "api.time-in-other-column" if clocks else "api.index-counts-rows"
        raise DataError(code, quantity=quantity, name=clocks[0] if clocks else "time")
    stamps, clock = seconds_of(out.index)
    if clock or stamps is not out.index:
        attrs = dict(out.attrs)
        out = out.set_axis(pd.Index(stamps, name="time"), axis=0)
        out.attrs = attrs | clock
        return out
    unit = read_name(str(out.index.name)).unit if out.index.name is not None else None
    if unit not in (None, "s"):
        raise DataError("api.time-unit", quantity=quantity, name=out.index.name, unit=unit)
    return out


def flat(table: pd.DataFrame, needed: Sequence[str]) -> pd.DataFrame:
    """Return a table whose names in levels are joined: ``("gyro", "x")``, ``("gyro_x", "rad/s")``.

    `needed`: names of columns whose units are checked. DataError: a level states a unit that is not
    the table's.
    """
    if table.columns.nlevels == 1:
        return table
    names = []
    for column in table.columns:
        parts = [str(part) for part in column if str(part)]
        units = {part: unit_of(part) for part in parts if part not in needed}
        name = "_".join(part for part in parts if units.get(part) is None)
        stated = next((u for u in units.values() if u is not None), None)
        if name in needed and stated is not None and stated not in SI:
            raise DataError("api.unit-of-level", quantity=name, unit=stated)
        names.append(name)
    out = table.set_axis(names, axis=1)
    _refuse_repeated(out.columns)
    out.attrs = dict(table.attrs)
    return out

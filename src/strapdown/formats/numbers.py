"""Conversion of columns to numbers; errors name the row."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.errors import DataError
from strapdown.formats.find_columns import Column
from strapdown.formats.recording import RawLog


def numbers(raw: RawLog, column: Column, quantity: str) -> NDArray[Any]:
    """Return the values of a column as numbers.

    Parameters
    ----------
    raw : RawLog
    column : Column
    quantity : str
        For messages.

    Returns
    -------
    ndarray, (n,)
        Integers or floats, as in the file; NaN for missing values.

    Raises
    ------
    DataError
        A value is not a number.
    """
    values = raw.columns[column.source]
    if values.dtype.kind in "iufb":
        return values
    texts = pd.Series(values)
    found = pd.to_numeric(texts, errors="coerce").to_numpy(dtype=np.float64)
    bad = np.flatnonzero(np.isnan(found) & texts.notna().to_numpy())
    if bad.size:
        raise DataError(
            "io.value-not-a-number",
            file=raw.name,
            row=raw.row(int(bad[0])),
            quantity=quantity,
            values=values[bad[0]],
            source=column.source,
        )
    return found


def ticks_of(raw: RawLog, column: Column) -> tuple[NDArray[Any], bool]:
    """Return stamps as numbers; dates and times of day as nanoseconds since 1970, and True.

    Raises
    ------
    DataError
        A stamp is neither, or of another kind than those before it.
    """
    values = raw.columns[column.source]
    if values.dtype.kind == "M":
        return values.astype("datetime64[ns]").astype(np.int64), True
    if values.dtype.kind != "O" or not re.match(r"\d{4}-\d\d-\d\d[T ]\d\d:", str(values[0])):
        return numbers(raw, column, "time"), False
    texts = pd.Series(values).str.replace(",", ".")
    dates = pd.to_datetime(texts, format="ISO8601", utc=True, errors="coerce")
    bad = np.flatnonzero(dates.isna().to_numpy())
    if bad.size:
        raise DataError(
            "io.not-date-time-like-those",
            file=raw.name,
            row=raw.row(int(bad[0])),
            quantity="time",
            values=values[bad[0]],
            source=column.source,
        )
    stamps = dates.dt.tz_localize(None).to_numpy().astype("datetime64[ns]")
    return stamps.astype(np.int64), True

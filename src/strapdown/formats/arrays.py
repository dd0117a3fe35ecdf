"""Columns of numbers: named arrays from binary files, conversion from text, rows of errors."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.errors import DataError, Finding
from strapdown.formats.columns import read_name
from strapdown.formats.dates import excel_nanoseconds, is_stamp, nanoseconds_of
from strapdown.formats.recording import RawLog, stated_by

__all__ = ["told_by_file_rows"]


RATES = ("sampling_rate", "sample_rate", "rate_hz", "fs", "freq", "frequency")
# An array is refused if it declares more than SMALL and exceeds its stored bytes by this ratio.
LARGEST_RATIO = 1000
SMALL = 64 * 1024 * 1024  # bytes


def refuse_lie(declared: int, stored: int, what: str, file: str) -> None:
    """Refuse an array that declares far more data than its file can hold.

    `what`: name of the array.
    """
    if declared > SMALL and declared > LARGEST_RATIO * max(stored, 1):
        raise DataError(
            "io.claims-bytes-stored", file=file, quantity=what, declared=declared, stored=stored
        )


def raw_log(
    path: Path,
    arrays: dict[str, NDArray[Any]],
    units: dict[str, str],
    meta: dict[str, Any],
) -> RawLog:
    """Convert named arrays to columns of one length.

    `arrays`: One- and two-dimensional; a second dimension of up to 16 becomes ``name[0]``,
    ``name[1]`` …. `units`: where the file states them. `meta`: may hold ``sampling``, ``axes`` and
    a sampling rate. DataError: no numeric array has two samples or more.
    """
    columns: dict[str, NDArray[Any]] = {}
    for name, array in arrays.items():
        columns |= _columns(name, np.squeeze(array))
    if not columns:
        raise DataError(
            "io.no-array-of-numbers",
            file=path.name,
            arrays=", ".join([*arrays, *meta]) or "nothing",
        )
    samples = _samples(columns)
    findings = _left_out(columns, samples, path.name)
    columns = {n: c for n, c in columns.items() if c.size == samples}
    return RawLog(
        name=path.name,
        files=(path,),
        columns=columns,
        units={n: units[b] for n in columns if (b := n.partition("[")[0]) in units},
        rate=_rate(meta),
        findings=findings,
        **stated_by({key: _text(value) for key, value in meta.items()}),
    )


def _left_out(columns: dict[str, NDArray[Any]], samples: int, file: str) -> list[Finding]:
    """List arrays whose length differs from the gyro's; refuse stamps of another length."""
    other = {n: c.size for n, c in columns.items() if c.size != samples}
    for name, size in other.items():
        if read_name(name).quantity == "time":
            raise DataError(
                "io.values-gyro-samples",
                file=file,
                quantity="time",
                name=name,
                size=size,
                samples=samples,
            )
    if not other:
        return []
    listed = ", ".join(f"{name} ({size} values)" for name, size in other.items())
    return [
        Finding(
            "io.left-out-because-gyro-samples",
            file=file,
            severity="note",
            samples=samples,
            listed=listed,
        )
    ]


def _columns(name: str, array: NDArray[Any]) -> dict[str, NDArray[Any]]:
    if array.dtype.kind not in "iufbM" or array.ndim not in (1, 2) or array.size < 2:
        return {}
    if array.ndim == 1:
        return {name: array}
    # One row per sample; MATLAB files often have one column per sample.
    rows = array.T if array.shape[0] < array.shape[1] else array
    if rows.shape[1] > 16:
        return {}
    return {f"{name}[{k}]": np.ascontiguousarray(rows[:, k]) for k in range(rows.shape[1])}


def _samples(columns: dict[str, NDArray[Any]]) -> int:
    """Return the length of the gyro's arrays, or else the most common length."""
    lengths = [c.size for n, c in columns.items() if str(read_name(n).quantity).startswith("gyro")]
    lengths = lengths or [c.size for c in columns.values()]
    return int(max(set(lengths), key=lengths.count))


def _rate(meta: dict[str, Any]) -> float | None:
    """Return the stated sampling rate, given as a number or as text with its unit."""
    for key in RATES:
        text = _text(meta.get(key)) or ""
        match = re.fullmatch(r"\s*([\d.eE+-]+)\s*(Hz)?\s*", text, re.I)
        try:
            rate = float(match.group(1)) if match else math.nan
        except ValueError:
            continue
        if math.isfinite(rate) and rate > 0:
            return rate
    return None


def _text(value: Any) -> str | None:
    if value is None:
        return None
    if isinstance(value, bytes):
        return value.decode("utf-8", "replace")
    if isinstance(value, np.ndarray):
        return _text(value.reshape(-1)[0]) if value.size else None
    return str(value)


def numbers(raw: RawLog, source: str, quantity: str) -> NDArray[Any]:
    """Return the values of a column as numbers.

    `source`: the column. `quantity`: for messages. Returns (n,), integers or floats, as in the
    file; NaN for missing values. DataError: a value is not a number.
    """
    values = raw.columns[source]
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
            source=source,
        )
    return found


def ticks_of(raw: RawLog, source: str, unit: str | None = None) -> tuple[NDArray[Any], bool]:
    """Return stamps as numbers; dates and times of day as nanoseconds, and True.

    Nanoseconds count from 1970, or, without a date, from a midnight. DataError: a stamp is
    neither, or of another kind than those before it.
    """
    values = raw.columns[source]
    if values.dtype.kind == "M":
        return values.astype("datetime64[ns]").astype(np.int64), True
    if values.dtype.kind != "O":
        days = excel_nanoseconds(values) if unit is None else None
        return (numbers(raw, source, "time"), False) if days is None else (days, True)
    if not is_stamp(str(values[0])):
        return numbers(raw, source, "time"), False
    if re.match(r"\d{4}-\d\d-\d\d[T ]", str(values[0])):  # a hundred times faster
        texts = pd.Series(values).str.replace(",", ".")
        dates = pd.to_datetime(texts, format="ISO8601", utc=True, errors="coerce")
        if not dates.isna().any():
            stamps = dates.dt.tz_localize(None).to_numpy().astype("datetime64[ns]")
            return stamps.astype(np.int64), True
    found = nanoseconds_of(values)
    if found is None:
        first = next((k for k, v in enumerate(values) if nanoseconds_of([v]) is None), 0)
        raise DataError(
            "io.not-date-time-like-those",
            file=raw.name,
            row=raw.row(first),
            quantity="time",
            values=values[first],
            source=source,
        )
    return found, True


@contextmanager
def told_by_file_rows(name: str, row_of: Callable[[int], int | None]) -> Iterator[None]:
    """Re-raise errors of a table with the row of its file.

    `name`: file name. `row_of`: maps a row of the table, from 0, to a row of the file.
    """
    try:
        yield
    except DataError as error:
        row = error.finding.row
        raise DataError(
            error.finding, file=name, row=None if row is None else row_of(row - 1)
        ) from None

"""Common part of readers of texts with a known layout: the top, the table under it, JSON."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import DataError
from strapdown.formats import csv
from strapdown.formats.arrays import numbers
from strapdown.formats.recording import NoStreamError, RawLog
from strapdown.formats.signs import head

__all__ = [
    "column",
    "from_json",
    "lacking",
    "names_of",
    "optional",
    "selected",
    "split",
    "stated_by",
    "under",
]


def under(path: Path, skip: int = 0, header: str | None = None, drop: int = 0) -> RawLog:
    """Read the table of a text under lines of another kind.

    `skip`: lines above the table. `header`: names to use instead of those of the file. `drop`:
    further lines under its names that are not data. Rows are counted as in the file. DataError: the
    text ends before its table, or as `csv.parse`.
    """
    text, found = csv.decoded(path.read_bytes(), path.name)
    lines = text.split("\n")
    if len(lines) <= skip + drop + 1:
        raise DataError("io.csv-without-rows", file=path.name, row=len(lines))
    names = lines[skip] if header is None else header
    # Blank lines keep the count of rows.
    kept = [*[""] * skip, names, *[""] * drop, *lines[skip + 1 + drop :]]
    raw = csv.parse("\n".join(kept).encode(), path.name, (path,))
    raw.findings[:0] = found
    return raw


def column(raw: RawLog, name: str) -> NDArray[Any]:
    """Return a column of numbers; NaN where a field is empty.

    DataError: it is missing, or a value is not a number.
    """
    if name not in raw.columns:
        raise DataError(
            "io.no-column-4", file=raw.name, missing=[name], columns=", ".join(raw.columns)
        )
    return numbers(raw, name, name)


def optional(
    raw: RawLog, names: Mapping[str, tuple[str, str | None]]
) -> dict[str, tuple[NDArray[Any], str | None]]:
    """Return the quantities whose columns are there: `names` has quantity to column and unit."""
    return {q: (column(raw, c), u) for q, (c, u) in names.items() if c in raw.columns}


def stated_by(
    raw: RawLog, quantities: Mapping[str, tuple[NDArray[Any], str | None]], **stated: Any
) -> RawLog:
    """Make a log of quantities of a table, with its rows and its findings."""
    out = RawLog.of(raw.files[0], quantities, **stated)
    out.name, out.rows = raw.name, raw.rows
    out.findings[:0] = raw.findings
    return out


def selected(log: RawLog, keep: NDArray[np.bool_]) -> RawLog:
    """Keep some rows of a log, which remember their row of the file."""
    rows = np.arange(1, keep.size + 1) if log.rows is None else log.rows
    log.columns = {name: values[keep] for name, values in log.columns.items()}
    log.rows = rows[keep]
    return log


def from_json(path: Path) -> Any:
    """Parse a JSON file.

    DataError: it is not JSON, or nested too deeply.
    """
    text, _ = csv.decoded(path.read_bytes(), path.name)
    try:
        return json.loads(text)
    except json.JSONDecodeError as error:
        raise DataError("io.no-json", file=path.name, row=error.lineno, msg=error.msg) from None
    except (RecursionError, ValueError) as error:
        raise DataError("io.no-json", file=path.name, msg=str(error)) from None


def names_of(path: Path) -> list[str]:
    """Return the names in the first line, for format detection."""
    lines = head(path).splitlines()
    return split(lines[0]) if lines else []


def split(line: str, separator: str | None = "") -> list[str]:
    """Split a line into fields, by its own separator; quotes that do not close are text."""
    by = csv.separator_of(line) if separator == "" else separator
    try:
        return csv.fields_of(line, by)
    except Exception:  # of the standard library: a quote that does not close, a long field
        return [field.strip() for field in line.split(by)]


def lacking(path: Path, stream: str, title: str, streams: Iterable[str]) -> DataError:
    """Make the error for a file of a known format that lacks a stream, or all of them."""
    name, there = path.resolve().name, list(streams)
    if there:
        return NoStreamError(name, stream, title, there)
    return DataError("io.no-known-stream", file=name, title=title)

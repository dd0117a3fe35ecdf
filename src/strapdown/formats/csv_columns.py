"""Fast parsing of text lines into numeric columns."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

__all__ = ["NULLS", "Columns", "columns_at_once", "parsed", "single_blanks"]

Columns = list[NDArray[Any]]
#: Texts of missing values.
NULLS = ("", "nan", "NaN", "NAN", "-nan", "NA", "N/A", "NULL", "null", "None")
#: From this many bytes on, the first lines decide which columns are numeric.
LONG = 1 << 22


def columns_at_once(
    data: bytes, count: int, separator: str | None, start: int = 0
) -> Columns | None:
    """Parse columns of lines of equal width.

    Parameters
    ----------
    data : bytes
        ASCII, without quotes from `start` on; the last line ends with a line break.
    count : int
        Number of columns.
    separator : str or None
        Separator of fields; None for any run of blanks.
    start : int
        Characters before the first of these lines.

    Returns
    -------
    list of ndarray, or None
        As `parsed`. None if a line has another width, is empty, or may hold non-numbers.
    """
    # A comma may be a decimal sign, and an x part of a hexadecimal number.
    odd = (b"x", b"X", *(() if separator == "," else (b",",)))
    if count < 2 or any(data.find(c, start) >= 0 for c in odd):
        return None
    if data.find(b"\r", start) >= 0:
        data, start = data[start:].replace(b"\r\n", b"\n"), 0
        if b"\r" in data:
            return None
    # No copy: a text may take half of the memory.
    columns = _parsed_or_none(memoryview(data)[start:], count, separator or " ")
    if columns is not None and all(_full(c) for c in columns):
        return columns
    body = data[start:]
    # A missing value may be two adjacent blanks, or a line without any.
    if separator is None:
        body = single_blanks(body)
        columns = _parsed_or_none(body, count, " ")
    return None if b"\n\n" in body or body.startswith(b"\n") else columns


def _parsed_or_none(body: bytes | memoryview, count: int, delimiter: str) -> Columns | None:
    import pyarrow as pa

    try:
        return parsed(body, count, delimiter)
    except pa.ArrowInvalid:
        return None


def _full(column: NDArray[Any]) -> bool:
    return column.dtype.kind in "iu" or (
        column.dtype.kind == "f" and bool(np.isfinite(column.sum()))
    )


def single_blanks(text: bytes) -> bytes:
    """Reduce runs of blanks to one between fields, with none at the ends of a line.

    Parameters
    ----------
    text : bytes
        Fields separated by blanks and tabs.

    Returns
    -------
    bytes
        The same object if unchanged.
    """
    text = text.replace(b"\t", b" ")
    # Four passes reduce runs of up to 300 blanks; longer ones take more passes.
    for run in (16, 4, 3, 2):
        text = text.replace(b" " * run, b" ")
    while b"  " in text:
        text = text.replace(b"  ", b" ")
    return text.replace(b"\n ", b"\n").replace(b" \n", b"\n").removeprefix(b" ")


def parsed(
    body: bytes | memoryview,
    count: int,
    delimiter: str,
    *,
    decimal: str = ".",
    quote: str | Literal[False] = '"',
    text: Sequence[int] = (),
) -> Columns:
    """Parse lines, each number to the nearest double.

    Parameters
    ----------
    body : bytes or memoryview
        UTF-8, without a header.
    count : int
        Number of columns.
    delimiter, decimal : str
    quote : str or False
        Quote around fields that hold the delimiter.
    text : sequence of int
        Columns to keep as text.

    Returns
    -------
    list of ndarray, (n,)
        Numbers with NaN for missing values, dates as dates, the rest as text.

    Raises
    ------
    pyarrow.ArrowInvalid
        A line has the wrong number of fields.
    """
    import pyarrow as pa

    def read(part: bytes | memoryview, types: dict[str, Any]) -> Any:
        return _table(part, types, count, delimiter, decimal, quote)

    asked = {str(k): pa.string() for k in text}
    table = None
    if len(body) > LONG:
        # Where a type is not stated, Arrow keeps all of the text until it is known.
        with suppress(pa.ArrowInvalid):
            top = bytes(body[:LONG])
            seen = read(top[: top.rfind(b"\n") + 1], asked).schema
            numbers = {f.name: f.type for f in seen if str(f.type) in ("int64", "double")}
            table = read(body, {**numbers, **asked})
    if table is None:
        table = read(body, asked)
    columns = []
    # Column by column, so that at most one is in memory twice.
    for _ in range(count):
        columns.append(_array(table.column(0)))
        table = table.remove_column(0)
    pa.default_memory_pool().release_unused()
    return columns


def _table(
    body: bytes | memoryview,
    types: dict[str, Any],
    count: int,
    delimiter: str,
    decimal: str,
    quote: str | Literal[False],
) -> Any:
    import pyarrow as pa
    import pyarrow.csv as pa_csv

    return pa_csv.read_csv(
        pa.BufferReader(body),
        read_options=pa_csv.ReadOptions(
            column_names=[str(k) for k in range(count)], use_threads=False
        ),
        parse_options=pa_csv.ParseOptions(
            delimiter=delimiter, quote_char=quote, ignore_empty_lines=False
        ),
        convert_options=pa_csv.ConvertOptions(
            decimal_point=decimal,
            null_values=list(NULLS),
            strings_can_be_null=True,
            column_types=types,
        ),
    )


def _array(column: Any) -> NDArray[Any]:
    """Convert to numbers with NaN for missing values, to dates, or to text."""
    kind = str(column.type)
    if kind in ("int64", "double"):
        values: NDArray[Any] = column.to_numpy()
        return values
    if kind == "null":
        return np.full(len(column), np.nan)
    if kind.startswith("timestamp") and not column.null_count:
        dates: NDArray[Any] = column.cast("timestamp[ns]").to_numpy()
        return dates
    return np.array([None if v is None else str(v) for v in column.to_pylist()], dtype=object)

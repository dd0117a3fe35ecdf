"""Parquet tables, by Arrow: columns, lists of equal length, structures."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from strapdown.errors import DataError
from strapdown.parsers.limits import refuse_lie, refuse_total

UNITS = (b"unit", b"units")
#: Most columns: each takes memory, whatever it holds.
MOST_COLUMNS = 20_000
#: Bytes of a column that are read at a time, and of numbers that are decoded at a time.
BUFFER, PART = 1 << 16, 1 << 22


def table(path: Path) -> dict[str, Any]:
    """Read ``arrays``, their ``units``, and ``meta``, the metadata of the table.

    DataError: the file is damaged, or declares far more data than it holds.
    """
    try:
        with path.open("rb") as begin:
            feather = begin.read(6) == b"ARROW1"
        schema, found = (_of_feather if feather else _of_parquet)(path)
        meta = {_text(k): _text(v) for k, v in (schema.metadata or {}).items()}
        units = _units(schema)
        pa.default_memory_pool().release_unused()
    except (DataError, MemoryError):
        raise
    except Exception as error:  # a damaged file can break any of the decoders involved
        raise DataError(
            "io.table-cannot-read",
            file=path.name,
            splitlines=str(error).splitlines()[0] if str(error) else "damaged",
        ) from None
    return {"arrays": found, "units": units, "meta": meta}


def _arrays(held: pa.Table) -> tuple[pa.Schema, dict[str, np.ndarray[Any, Any]]]:
    """Return the schema of a table without structures, and its columns that are arrays."""
    while any(pa.types.is_struct(field.type) for field in held.schema):
        held = held.flatten()
    schema = held.schema
    found = {}
    # Column by column, so that at most one is in memory twice.
    for name in held.column_names:
        array = _array(held.column(0))
        held = held.remove_column(0)
        if array is not None:
            found[name] = array
    return schema, found


def _of_parquet(path: Path) -> tuple[pa.Schema, dict[str, np.ndarray[Any, Any]]]:
    # Otherwise all of the file is in memory before the first number is decoded.
    with pq.ParquetFile(path, pre_buffer=False, buffer_size=BUFFER) as file:
        rows, width = file.metadata.num_rows, max(file.metadata.num_columns, 1)
        refuse_lie(rows * width * 8, path.stat().st_size, "table", path.name)
        refuse_total(rows * width * 8, path)
        _refuse_wide(width, path)
        numbers = _numbers(file, rows)
        if numbers is None:
            return _arrays(file.read(use_threads=False))
        return file.schema_arrow, dict(numbers)


def _of_feather(path: Path) -> tuple[pa.Schema, dict[str, np.ndarray[Any, Any]]]:
    """Read a table of Feather, version 2: a file of Arrow."""
    with pa.OSFile(str(path)) as source:
        reader = pa.ipc.open_file(source)
        _refuse_wide(len(reader.schema), path)
        return _arrays(reader.read_all())


def _refuse_wide(width: int, path: Path) -> None:
    if width > MOST_COLUMNS:
        raise DataError(
            "io.too-many-columns-of-table", file=path.name, count=width, most=MOST_COLUMNS
        )


def with_bytes(path: Path) -> dict[str, Any]:
    """Read `table`, and the bytes of the columns of bytes of one length, as a geometry has them."""
    found = table(path)
    with pq.ParquetFile(path) as file:
        names = [f.name for f in file.schema_arrow if pa.types.is_binary(f.type)]
        for name in names:
            values = file.read([name], use_threads=False).column(0).to_pylist()
            if len({None if value is None else len(value) for value in values}) == 1:
                joined = np.frombuffer(b"".join(values), dtype=np.uint8)
                found["arrays"][name] = joined.reshape(len(values), -1)
    return found


def _numbers(file: pq.ParquetFile, rows: int) -> dict[str, np.ndarray[Any, Any]] | None:
    """Read columns of numbers alone part by part, which needs a part of memory beside them.

    None if there is another column, a missing whole number, or another number of rows.
    """
    fields = list(file.schema_arrow)
    plain = (pa.types.is_integer, pa.types.is_float32, pa.types.is_float64)
    if len({field.name for field in fields}) < len(fields):
        return None
    if not fields or not all(any(kind(field.type) for kind in plain) for field in fields):
        return None
    arrays = {field.name: np.empty(rows, field.type.to_pandas_dtype()) for field in fields}
    begin = 0
    for part in file.iter_batches(max(1024, PART // (8 * len(fields))), use_threads=False):
        end = begin + part.num_rows
        if end > rows:
            return None
        for column, values in zip(part.columns, arrays.values(), strict=True):
            if column.null_count and pa.types.is_integer(column.type):
                return None
            values[begin:end] = column.to_numpy(zero_copy_only=False)
        begin = end
    return arrays if begin == rows else None


def _units(schema: pa.Schema) -> dict[str, str]:
    found = {}
    for field in schema:
        for key in UNITS:
            if key in (field.metadata or {}):
                found[field.name] = _text(field.metadata[key])
    return found


def _array(column: Any) -> np.ndarray[Any, Any] | None:
    """Convert to numbers, dates, or rows of numbers; None for anything else."""
    kind = column.type
    if pa.types.is_list(kind) or pa.types.is_large_list(kind) or pa.types.is_fixed_size_list(kind):
        return _rows(column)
    if pa.types.is_dictionary(kind):
        return _array(column.cast(kind.value_type))
    if pa.types.is_decimal(kind):
        column, kind = column.cast(pa.float64()), pa.float64()
    if pa.types.is_integer(kind) and column.null_count:
        column, kind = column.cast(pa.float64()), pa.float64()
    if pa.types.is_timestamp(kind) and not column.null_count:
        dates: np.ndarray[Any, Any] = column.cast(pa.timestamp("ns")).to_numpy()
        return dates
    if pa.types.is_integer(kind) or pa.types.is_floating(kind):
        values: np.ndarray[Any, Any] = column.to_numpy()
        # Arrow keeps memory that it has allocated, even when freed.
        return values if values.flags.owndata else values.copy()
    return None


def _rows(column: Any) -> np.ndarray[Any, Any] | None:
    """Convert lists of equal length to rows of an array; a missing list is a row of NaN."""
    if not (
        pa.types.is_integer(column.type.value_type) or pa.types.is_floating(column.type.value_type)
    ):
        return None
    lists = column.to_pylist()
    widths = {len(row) for row in lists if row is not None}
    if len(widths) != 1:
        return None
    empty = [np.nan] * widths.pop()
    return np.array([empty if row is None else row for row in lists], dtype=np.float64)


def _text(value: bytes) -> str:
    return value.decode("utf-8", "replace")

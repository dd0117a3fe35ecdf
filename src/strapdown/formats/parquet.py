"""Parquet tables: columns, lists of three, structures; units where stated in fields."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import DataError
from strapdown.formats.arrays import raw_log, refuse_lie
from strapdown.formats.recording import RawLog
from strapdown.formats.signs import Signs

SUFFIXES = (".parquet", ".pq")
MAGIC = b"PAR1"
UNITS = (b"unit", b"units")


detect = Signs(named=SUFFIXES, first=rb"\A" + re.escape(MAGIC))


def read(path: Path) -> RawLog:
    """Read the numeric columns of a table.

    Returns
    -------
    RawLog
        Columns of structures are named ``structure.field``, those of lists of equal length
        ``list[0]``, ``list[1]`` …; missing values are NaN. The metadata ``unit`` or ``units``
        of a field, and ``sampling``, ``axes`` and a rate of the table, are understood.

    Raises
    ------
    DataError
        The file is damaged, or declares far more data than it holds.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        with pq.ParquetFile(path) as file:
            rows, width = file.metadata.num_rows, max(file.metadata.num_columns, 1)
            refuse_lie(rows * width * 8, path.stat().st_size, "table", path.name)
            table = file.read()
        while any(pa.types.is_struct(field.type) for field in table.schema):
            table = table.flatten()
        meta = {_text(k): _text(v) for k, v in (table.schema.metadata or {}).items()}
        units = _units(table)
        arrays = {}
        # Column by column, so that at most one is in memory twice.
        for name in table.column_names:
            arrays[name] = _array(table.column(0))
            table = table.remove_column(0)
        pa.default_memory_pool().release_unused()
    except DataError:
        raise
    except Exception as error:  # a damaged file can break any of the decoders involved
        raise DataError(
            "io.table-cannot-read",
            file=path.name,
            splitlines=str(error).splitlines()[0] if str(error) else "damaged",
        ) from None
    return raw_log(path, {n: a for n, a in arrays.items() if a is not None}, units, meta)


def _units(table: Any) -> dict[str, str]:
    found = {}
    for field in table.schema:
        for key in UNITS:
            if key in (field.metadata or {}):
                found[field.name] = _text(field.metadata[key])
    return found


def _array(column: Any) -> NDArray[Any] | None:
    """Convert to numbers, dates, or rows of numbers; None for anything else."""
    import pyarrow as pa

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
        dates: NDArray[Any] = column.cast(pa.timestamp("ns")).to_numpy()
        return dates
    if pa.types.is_integer(kind) or pa.types.is_floating(kind):
        values: NDArray[Any] = column.to_numpy()
        # Arrow keeps memory that it has allocated, even when freed.
        return values if values.flags.owndata else values.copy()
    return None


def _rows(column: Any) -> NDArray[Any] | None:
    """Convert lists of equal length to rows of an array; a missing list is a row of NaN."""
    import pyarrow as pa

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


def write(path: Path, columns: dict[str, NDArray[Any]], meta: dict[str, str]) -> None:
    """Write columns exactly. `columns` ((n,)): names with their unit. `meta`: of the file."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    table = pa.table({name: pa.array(values) for name, values in columns.items()})
    pq.write_table(
        table.replace_schema_metadata(meta),
        path,
        compression="zstd",
        use_dictionary=False,
        use_byte_stream_split=True,
    )


def _text(value: bytes) -> str:
    return value.decode("utf-8", "replace")

"""Tables in files of their own kind: Excel, JSON, LabVIEW, NumPy, Parquet."""

from __future__ import annotations

import csv as text_csv
import dataclasses
import io
import json
import re
import zipfile
from datetime import datetime, time
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import DataError, Finding
from strapdown.formats import csv
from strapdown.formats.android_events import joined, kind_of
from strapdown.formats.arrays import raw_log, refuse_lie
from strapdown.formats.columns import read_name
from strapdown.formats.known_formats import from_json, under
from strapdown.formats.recording import RawLog, library
from strapdown.formats.signs import Signs, head

# Excel workbooks (``.xlsx``) by openpyxl: the sheet with the most numbers, as a table.
#
# Dates are written as ISO 8601; a cell with a formula has the value that Excel stored. The rest
# is as in a text table with commas (`csv`), headers and lines above them included.


detect_excel = Signs(suffixes=(".xlsx", ".xlsm"), first=rb"\APK\x03\x04")


def read_excel(path: Path) -> RawLog:
    """Read the sheet with the most numbers.

    Raises
    ------
    DataError
        The library is missing, the file is damaged, or no sheet has numbers.
    """
    openpyxl = library("openpyxl", path)
    try:
        book = openpyxl.load_workbook(io.BytesIO(path.read_bytes()), read_only=True, data_only=True)
        sheets = {
            s.title: [list(r) for r in s.iter_rows(values_only=True)] for s in book.worksheets
        }
    except Exception as error:  # a damaged archive can break any of the decoders
        raise DataError(
            "io.excel-unreadable", file=path.name, error=str(error) or type(error).__name__
        ) from None
    counts = {
        name: sum(isinstance(c, int | float) for row in rows for c in row)
        for name, rows in sheets.items()
    }
    name = max(counts, key=lambda n: counts[n], default="")
    if not counts.get(name):
        raise DataError("io.excel-without-numbers", file=path.name, sheets=list(sheets))
    buffer = io.StringIO()
    width = max(len(row) for row in sheets[name])
    writer = text_csv.writer(buffer, lineterminator="\n")
    for row in sheets[name]:
        writer.writerow([_text_of_excel(cell) for cell in [*row, *[None] * (width - len(row))]])
    raw = csv.parse(buffer.getvalue().encode(), path.name, (path,))
    if len(sheets) > 1:
        others = [n for n in sheets if n != name]
        raw.findings.append(
            Finding("io.sheet-read", file=path.name, severity="note", name=name, others=others)
        )
    return raw


def _text_of_excel(cell: Any) -> str:
    if cell is None:
        return ""
    if isinstance(cell, datetime):
        return cell.isoformat(" ", "microseconds")
    if isinstance(cell, time):
        return cell.isoformat("microseconds")
    return repr(cell) if isinstance(cell, float) else str(cell)


# JSON of samples: lines of one object each, or one list of objects.
#
# Names of members are joined by a dot (``{"gyro": {"x": 0.1}}`` is ``gyro.x``), parts of lists
# are numbered from 0 (``gyro[0]``); they are then understood as those of any table. Objects of
# several sensors, whose kind a member ``sensor``, ``type``, ``name`` or ``kind`` states, are read
# as events (`android_events`).


JSON_SUFFIXES = (".json", ".jsonl", ".ndjson", ".jsonlines", ".ldjson")
KINDS = ("sensor", "type", "name", "kind", "sensorType", "sensor_type")
#: Deepest nesting that is unfolded.
DEEP = 6


def _is_object(line: str) -> bool:
    try:
        return isinstance(json.loads(line), dict)
    except (ValueError, RecursionError):
        return False


def _begins(path: Path) -> bool:
    """Whether an object is at the beginning."""
    text = head(path).lstrip()
    if path.suffix.lower() in JSON_SUFFIXES[:1] and text.startswith("["):
        return text[1:].lstrip().startswith("{")
    return _is_object(text.partition("\n")[0])


detect_json = Signs(suffixes=(*JSON_SUFFIXES, ".txt", ".log"), text=r"\A\s*+[\[{]", also=_begins)


def read_json(path: Path) -> RawLog:
    """Read the members of the objects as columns, missing ones as NaN.

    Raises
    ------
    DataError
        A line is not JSON, a value is neither a number nor a text, or the file has no object.
    """
    objects, rows, findings = _objects(path)
    kind = next(
        (k for k in KINDS if len({kind_of(str(o.get(k))) for o in objects} - {None}) > 1), None
    )
    flat = [_unfolded(o) for o in objects]
    if kind is not None and any(
        kind_of(str(o.get(kind))) in ("gyro", "gyro uncalibrated") for o in objects
    ):
        return _events(path, flat, rows, kind, findings)
    columns = {}
    for name in dict.fromkeys(n for one in flat for n in one):
        values = [one.get(name) for one in flat]
        if any(isinstance(v, str) for v in values):
            columns[name] = np.array(["" if v is None else str(v) for v in values], dtype=object)
        else:
            whole = all(isinstance(v, int) for v in values)
            columns[name] = np.array(
                [np.nan if v is None else v for v in values], dtype=None if whole else np.float64
            )
    return RawLog(path.name, (path,), columns, rows=np.array(rows), findings=findings)


def _objects(path: Path) -> tuple[list[dict[str, Any]], list[int], list[Finding]]:
    """Return the objects, each with its line or its number in the list."""
    text, findings = csv.decoded(path.read_bytes(), path.name)
    if text.lstrip().startswith("["):
        content = from_json(path)
        if not content or not all(isinstance(o, dict) for o in content):
            raise DataError("io.not-list-records", file=path.name)
        return content, list(range(1, len(content) + 1)), findings
    objects: list[dict[str, Any]] = []
    rows: list[int] = []
    lines = text.splitlines()
    for row, line in enumerate(lines, 1):
        if not line.strip():
            continue
        try:
            one = json.loads(line)
        except (ValueError, RecursionError) as error:
            if row == len(lines) and objects and not text.endswith("\n"):
                findings.append(
                    Finding("io.last-line-cut-left-out", file=path.name, row=row, severity="note")
                )
                continue
            raise DataError("io.no-json", file=path.name, row=row, msg=str(error)) from None
        if not isinstance(one, dict):
            raise DataError("io.not-list-records", file=path.name, row=row)
        objects.append(one)
        rows.append(row)
    return objects, rows, findings


def _unfolded(value: Any, name: str = "", depth: int = 0) -> dict[str, Any]:
    if depth > DEEP:
        return {}
    if isinstance(value, dict):
        parts = [(f"{name}.{k}" if name else str(k), v) for k, v in value.items()]
    elif isinstance(value, list):
        parts = [(f"{name}[{k}]", v) for k, v in enumerate(value[:16])]
    else:
        plain = value if value is None or isinstance(value, str | int | float) else None
        return {name: plain}
    return {k: v for part, inner in parts for k, v in _unfolded(inner, part, depth + 1).items()}


def _events(
    path: Path, flat: list[dict[str, Any]], rows: list[int], kind: str, findings: list[Finding]
) -> RawLog:
    events: dict[str, list[list[Any]]] = {}
    unit = None
    for one, row in zip(flat, rows, strict=True):
        which = kind_of(str(one.get(kind)))
        if which is None:
            continue
        time = next((n for n in one if read_name(n).quantity == "time"), None)
        axes = [n for a in "xyz" for n in one if n.lower().rpartition(".")[2] == a]
        if len(axes) != 3:
            axes = sorted(n for n in one if n.endswith(("[0]", "[1]", "[2]")))[:3]
        if (
            time is None
            or len(axes) != 3
            or any(not isinstance(one[n], int | float) for n in (time, *axes))
        ):
            raise DataError("io.event-without-values", file=path.name, row=row, quantity=which)
        unit = read_name(time).unit
        events.setdefault(which, []).append([row, one[time], *(one[n] for n in axes)])
    held = {
        k: {n: np.array([e[j] for e in es]) for j, n in enumerate(("row", "time", "x", "y", "z"))}
        for k, es in events.items()
    }
    return joined(path, held, {"time": unit}, findings, android=False)


# Measurement files of LabVIEW (``.lvm``): a text table under two headers.
#
# The first header names separator and decimal sign; the second has a value of each channel in a
# line, among them ``Y_Unit_Label`` and ``Delta_X`` (National Instruments, Specification for the
# LabVIEW Measurement File). ``X_Value`` is time in s; without it, ``Delta_X`` is the step. The
# last name is ``Comment``, whose field is most often missing in the rows.


LABVIEW_MAGIC, END = "LabVIEW Measurement", "***End_of_Header***"


detect_labview = Signs(text=rf"\A{LABVIEW_MAGIC}")


def read_labview(path: Path) -> RawLog:
    """Read the channels, with the units that the header states.

    Raises
    ------
    DataError
        The header does not end, or a second one follows the rows.
    """
    text, _ = csv.decoded(path.read_bytes(), path.name)
    lines = text.split("\n")
    ends = [k for k, line in enumerate(lines) if line.startswith(END)]
    if len(ends) != 2 or len(lines) < ends[1] + 3:
        raise DataError("io.labview-headers", file=path.name, count=len(ends))
    about = [line.rstrip("\r").split("\t") for line in lines[: ends[1]]]
    said = {fields[0]: fields[1:] for fields in about}
    names = lines[ends[1] + 1].rstrip("\r").split("\t")
    width = len(lines[ends[1] + 2].rstrip("\r").split("\t"))
    names = ["time" if n == "X_Value" else n for n in names[:width]]
    raw = under(path, ends[1] + 1, "\t".join(names))
    units = [u for u in said.get("Y_Unit_Label", ()) if u]
    channels = [n for n in raw.columns if n not in ("time", "Comment")]
    if len(units) == len(channels):
        raw.units |= dict(zip(channels, units, strict=True))
    raw.units |= {"time": "s"} if "time" in raw.columns else {}
    step = next(iter(said.get("Delta_X", ())), "").replace(",", ".")
    stated = csv.NUMBER.fullmatch(step) is not None and 1e-9 < float(step) < 1e9
    if "time" not in raw.columns and stated:
        raw.rate = 1.0 / float(step)
    return raw


# NumPy archives (``.npz``), arrays (``.npy``), and folders of arrays; none is executed.


detect_numpy = Signs(named=(".npz",))


def read_numpy(path: Path) -> RawLog:
    """Read the arrays of a NumPy archive; its content is never executed.

    Raises
    ------
    DataError
        The file is not an archive, is damaged, declares too much data, or holds Python objects.
    """
    found = arrays_of(path)
    arrays = {name: array for name, array in found.items() if array.ndim}
    meta = {name: array for name, array in found.items() if not array.ndim}
    return raw_log(path, arrays, {}, meta)


def arrays_of(path: Path) -> dict[str, NDArray[Any]]:
    """Return the arrays of an archive by name."""
    found: dict[str, NDArray[Any]] = {}
    try:
        with zipfile.ZipFile(path) as archive:
            for info in archive.infolist():
                if info.filename.endswith(".npy"):
                    found[info.filename[:-4]] = _member(archive, info, path.name)
    except DataError:
        raise
    except Exception as error:  # a damaged archive can break any of the decoders involved
        raise DataError(
            "io.npz-unreadable", file=path.name, error=error or type(error).__name__
        ) from None
    return found


def _member(archive: zipfile.ZipFile, info: zipfile.ZipInfo, file: str) -> NDArray[Any]:
    name = info.filename[:-4]
    refuse_lie(info.file_size, info.compress_size, name, file)
    with archive.open(info) as stream:
        return read_numpy_array(stream, info.file_size, name, file)


def write_numpy(path: Path, arrays: dict[str, NDArray[Any]]) -> None:
    """Write arrays; equal input gives identical bytes."""
    with path.open("wb") as stream:  # by a name NumPy would append an ending
        np.savez(stream, allow_pickle=False, **arrays)


# Single NumPy arrays, from files or archives; their content is never executed.


def load_numpy(path: Path, label: str) -> NDArray[Any]:
    """Load the array of a file.

    `label`: for messages. DataError: the array is damaged, declares more data than it holds, or
    holds Python objects.
    """
    try:
        with path.open("rb") as stream:
            return read_numpy_array(stream, path.stat().st_size, None, label)
    except DataError:
        raise
    except Exception as error:  # a damaged header can break NumPy's parser
        raise DataError(
            "io.npy-unreadable", file=label, error=error or type(error).__name__
        ) from None


def read_numpy_array(
    stream: BinaryIO | Any, size: int, name: str | None, file: str
) -> NDArray[Any]:
    """Read an array from a stream.

    `size`: stored size, including the header. `name`: name of the array, for messages. DataError:
    the declared size differs from the stored one, or the array holds Python objects. ValueError:
    the header is damaged.
    """
    version = np.lib.format.read_magic(stream)
    header = (
        np.lib.format.read_array_header_1_0
        if version == (1, 0)
        else np.lib.format.read_array_header_2_0
    )
    shape, fortran, dtype = header(stream)
    if dtype.hasobject:
        raise DataError("io.holds-python-objects-not-loaded", file=file, quantity=name)
    count = int(np.prod([int(n) for n in shape], dtype=object))
    stored = size - stream.tell()
    if count * dtype.itemsize != stored:
        raise DataError(
            "io.claims-values-bytes-bytes-stored"
            if name
            else "io.claims-values-bytes-bytes-stored-2",
            file=file,
            quantity=name,
            count=count,
            itemsize=dtype.itemsize,
            stored=stored,
        )
    data = np.frombuffer(stream.read(), dtype=dtype)
    return data.reshape(shape, order="F" if fortran else "C")


# Folders of NumPy arrays, one per quantity: ``time.npy``, ``gyro_rad_s.npy``, ``accel.npy``.


def _has_gyro(folder: Path) -> bool:
    """Whether a folder has an array with the name of a gyro."""
    return any(str(read_name(p.stem).quantity).startswith("gyro") for p in _arrays(folder))


detect_numpy_folder = Signs(folder=_has_gyro)


def read_numpy_folder(path: Path) -> RawLog:
    """Read every array of the folder, each under its file name.

    Returns arrays that differ in length from the gyro's are dropped and listed. DataError: an array
    is damaged, declares more data than it holds, or holds Python objects; or the stamps differ in
    length from the gyro.
    """
    name = path.resolve().name
    arrays: dict[str, NDArray[Any]] = {}
    meta: dict[str, Any] = {}
    files = _arrays(path)
    for file in files:
        array = load_numpy(file, f"{name}/{file.name}")
        (meta if array.ndim == 0 else arrays)[file.stem] = array
    raw = raw_log(path, arrays, {}, meta)
    return dataclasses.replace(raw, name=name, files=tuple(files))


def _arrays(path: Path) -> list[Path]:
    return sorted(p for p in path.glob("*.npy") if p.is_file()) if path.is_dir() else []


# Parquet tables: columns, lists of three, structures; units where stated in fields.


PARQUET_SUFFIXES = (".parquet", ".pq")
PARQUET_MAGIC = b"PAR1"
UNITS = (b"unit", b"units")


detect_parquet = Signs(named=PARQUET_SUFFIXES, first=rb"\A" + re.escape(PARQUET_MAGIC))


def read_parquet(path: Path) -> RawLog:
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
        meta = {
            _text_of_parquet(k): _text_of_parquet(v)
            for k, v in (table.schema.metadata or {}).items()
        }
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
                found[field.name] = _text_of_parquet(field.metadata[key])
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


def write_parquet(path: Path, columns: dict[str, NDArray[Any]], meta: dict[str, str]) -> None:
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


def _text_of_parquet(value: bytes) -> str:
    return value.decode("utf-8", "replace")

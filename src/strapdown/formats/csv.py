"""Text tables: commas, semicolons, tabs or blanks, with a header line or without."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from strapdown.exceptions import DataError, Finding
from strapdown.formats.recording import RawLog

SUFFIXES = (".csv", ".txt", ".tsv", ".dat")
COMMENTS = ("#", "%")
Columns = list[NDArray[Any]]
_NUMBER = re.compile(r"[+-]?(\d+([.,]\d*)?|[.,]\d+)([eE][+-]?\d+)?|nan|[+-]?inf(inity)?", re.I)


def detect(path: Path) -> bool:
    """Tell whether the name is that of a text table."""
    return path.is_file() and path.suffix.lower() in SUFFIXES


def read(path: Path) -> RawLog:
    """Read the columns of a text table.

    Parameters
    ----------
    path : Path

    Returns
    -------
    RawLog
        Columns that hold anything but numbers are left as text. Lines at the top that begin
        with ``#`` or ``%`` are comments; ``# sampling: mean`` among them is understood.

    Raises
    ------
    DataError
        The file is empty, holds a header alone, or is no text.
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise DataError(
            f"no text: byte {error.start} is not UTF-8",
            file=path.name,
            remedy="give the file its own ending (.mat, .h5, .npz), or save it as UTF-8",
        ) from None
    lines = text.splitlines()
    comments = 0
    while comments < len(lines) and (
        not lines[comments].strip() or lines[comments].lstrip().startswith(COMMENTS)
    ):
        comments += 1
    if comments == len(lines):
        raise DataError(
            "the file is empty" if not text.strip() else "the file holds comments alone",
            file=path.name,
            remedy="check that the recording was saved and copied whole",
        )
    separator = _separator(lines[comments])
    fields = _split(lines[comments], separator)
    header = any(not _NUMBER.fullmatch(f.strip()) for f in fields if f.strip())
    first = comments + (1 if header else 0)
    while len(lines) > first and not lines[-1].strip():
        lines.pop()
    if len(lines) <= first:
        raise DataError(
            "a header, and no data under it",
            file=path.name,
            row=comments + 1,
            remedy="check that the recording was saved and copied whole",
        )
    names = [f.strip().strip('"') for f in fields] if header else _above(lines[:comments], fields)
    findings = _drop_cut_line(lines, first, len(names), separator, path.name)
    _check_widths(lines, first, len(names), separator, path.name)
    columns = _parse(lines, first, len(names), separator)
    meta: dict[str, str] = {}
    for line in lines[:comments]:
        if match := re.match(r"[#%]\s*(\w+)\s*:\s*(.+?)\s*$", line):
            meta[match.group(1)] = match.group(2)
    return RawLog(
        name=path.name,
        files=(path,),
        columns=dict(zip(_unique(names), columns, strict=True)),
        first_row=first + 1,
        sampling=meta.get("sampling"),
        axes="x,y,z" if meta.get("axes") == "forward-right-down" else None,
        findings=findings,
    )


def _above(comments: list[str], fields: list[str]) -> list[str]:
    """Names of columns without a header: the last comment, where it is one; else numbers."""
    for line in reversed(comments):
        text = line.strip().lstrip("".join(COMMENTS)).strip()
        names = [f.strip() for f in _split(text, _separator(text))]
        if len(names) == len(fields) and not any(_NUMBER.fullmatch(n) for n in names):
            return names
        break
    return [f"column {k + 1}" for k in range(len(fields))]


def _unique(names: list[str]) -> list[str]:
    seen: dict[str, int] = {}
    out = []
    for name in names:
        seen[name] = seen.get(name, 0) + 1
        out.append(name if seen[name] == 1 else f"{name} ({seen[name]})")
    return out


def _separator(line: str) -> str | None:
    """The separator of a line; None stands for any run of blanks."""
    for candidate in ("\t", ";", ","):
        if candidate in line:
            return candidate
    return None


def _split(line: str, separator: str | None) -> list[str]:
    if separator is not None and '"' in line:
        import csv

        return next(csv.reader([line], delimiter=separator))
    return line.split(separator)


def _drop_cut_line(
    lines: list[str], first: int, width: int, separator: str | None, name: str
) -> list[Finding]:
    """Drop a last line that was cut short; with it alone there would be no data."""
    last = _split(lines[-1], separator)
    if len(last) >= width or len(lines) - first < 2:
        return []
    row = len(lines)
    lines.pop()
    return [
        Finding(
            f"the last line is cut: {len(last)} of {width} fields. It was left out",
            file=name,
            row=row,
            remedy="if more is missing, copy the file again",
        )
    ]


def _check_widths(
    lines: list[str], first: int, width: int, separator: str | None, name: str
) -> None:
    if separator is None:
        counts = (len(line.split()) for line in lines[first:])
    else:
        counts = (
            len(_split(line, separator)) if '"' in line else line.count(separator) + 1
            for line in lines[first:]
        )
    for k, count in enumerate(counts):
        if count != width:
            raise DataError(
                f"{count} fields, where the first line has {width}",
                file=name,
                row=first + k + 1,
                remedy="correct or delete that row",
            )


def _parse(lines: list[str], first: int, count: int, separator: str | None) -> Columns:
    """Parse the lines under the header, each number to the double nearest to it."""
    import pyarrow as pa
    import pyarrow.csv as pa_csv

    body = lines[first:]
    decimal = "," if separator != "," and any("," in line for line in body[:5]) else "."
    if separator is None:
        body = ["\t".join(line.split()) for line in body]
    table = pa_csv.read_csv(
        pa.BufferReader("\n".join(body).encode()),
        read_options=pa_csv.ReadOptions(
            column_names=[str(k) for k in range(count)], use_threads=False
        ),
        parse_options=pa_csv.ParseOptions(delimiter=separator or "\t", ignore_empty_lines=False),
        convert_options=pa_csv.ConvertOptions(
            decimal_point=decimal,
            null_values=["", "nan", "NaN", "NAN", "-nan"],
            strings_can_be_null=True,
            timestamp_parsers=[],
        ),
    )
    return [_array(table.column(k)) for k in range(count)]


def _array(column: Any) -> NDArray[Any]:
    """Numbers as numbers, with NaN for what is missing; anything else as text."""
    kind = str(column.type)
    if kind in ("int64", "double"):
        values: NDArray[Any] = column.to_numpy()
        return values
    if kind == "null":
        return np.full(len(column), np.nan)
    return np.array([None if v is None else str(v) for v in column.to_pylist()], dtype=object)


def write(path: Path, columns: dict[str, NDArray[Any]], comments: dict[str, str]) -> None:
    """Write columns as text, each number in the fewest digits that give it back exactly.

    Parameters
    ----------
    path : Path
    columns : dict of str to ndarray, (n,)
        Names with their unit, as ``gyro_x_rad_s``.
    comments : dict of str to str
        Written at the top as ``# key: value``.
    """
    import pyarrow as pa
    import pyarrow.csv as pa_csv

    head = [f"# {key}: {value}" for key, value in comments.items()]
    head.append(",".join(columns))
    with path.open("wb") as stream:
        stream.write(("\n".join(head) + "\n").encode())
        pa_csv.write_csv(
            pa.table({k: pa.array(v) for k, v in columns.items()}),
            stream,
            pa_csv.WriteOptions(include_header=False),
        )

"""Text tables: commas, semicolons, tabs or blanks, with a header line or without."""

from __future__ import annotations

import io
import re
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from strapdown.exceptions import DataError, Finding
from strapdown.formats.recording import RawLog

SUFFIXES = (".csv", ".txt", ".tsv", ".dat")
COMMENTS = ("#", "%")
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
    names = [f.strip().strip('"') for f in fields] if header else _numbered(len(fields))
    findings = _drop_cut_line(lines, first, len(names), separator, path.name)
    _check_widths(lines, first, len(names), separator, path.name)
    table = _parse(lines, first, names, separator)
    meta: dict[str, str] = {}
    for line in lines[:comments]:
        if match := re.match(r"[#%]\s*(\w+)\s*:\s*(.+?)\s*$", line):
            meta[match.group(1)] = match.group(2)
    return RawLog(
        name=path.name,
        files=(path,),
        columns={name: table[k].to_numpy() for k, name in enumerate(_unique(names))},
        first_row=first + 1,
        sampling=meta.get("sampling"),
        axes="x,y,z" if meta.get("axes") == "forward-right-down" else None,
        findings=findings,
    )


def _numbered(count: int) -> list[str]:
    return [f"column {k + 1}" for k in range(count)]


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


def _parse(lines: list[str], first: int, names: list[str], separator: str | None) -> pd.DataFrame:
    body = lines[first:]
    decimal = "," if separator in (";", "\t", None) and any("," in s for s in body[:5]) else "."
    options: dict[str, Any] = {"sep": separator} if separator else {"sep": r"\s+"}
    table: pd.DataFrame = pd.read_csv(
        io.StringIO("\n".join(body)),
        header=None,
        names=list(range(len(names))),
        index_col=False,
        decimal=decimal,
        skip_blank_lines=False,
        skipinitialspace=True,
        float_precision="round_trip",
        low_memory=False,
        na_values=["nan", "NaN", "NAN", ""],
        keep_default_na=False,
        **options,
    )
    return table


def write(path: Path, columns: dict[str, np.ndarray[Any, Any]], comments: dict[str, str]) -> None:
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

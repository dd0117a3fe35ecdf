"""Excel workbooks (``.xlsx``) by openpyxl: the sheet with the most numbers, as a table.

Dates are written as ISO 8601; a cell with a formula has the value that Excel stored. The rest is as
in a text table with commas (`csv`), headers and lines above them included.
"""

from __future__ import annotations

import csv as text_csv
import io
from datetime import datetime, time
from pathlib import Path
from typing import Any

from strapdown.errors import DataError, Finding
from strapdown.formats import csv
from strapdown.formats.recording import RawLog, library
from strapdown.formats.signs import Signs

detect = Signs(suffixes=(".xlsx", ".xlsm"), first=rb"\APK\x03\x04")


def read(path: Path) -> RawLog:
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
        writer.writerow([_text(cell) for cell in [*row, *[None] * (width - len(row))]])
    raw = csv.parse(buffer.getvalue().encode(), path.name, (path,))
    if len(sheets) > 1:
        others = [n for n in sheets if n != name]
        raw.findings.append(
            Finding("io.sheet-read", file=path.name, severity="note", name=name, others=others)
        )
    return raw


def _text(cell: Any) -> str:
    if cell is None:
        return ""
    if isinstance(cell, datetime):
        return cell.isoformat(" ", "microseconds")
    if isinstance(cell, time):
        return cell.isoformat("microseconds")
    return repr(cell) if isinstance(cell, float) else str(cell)

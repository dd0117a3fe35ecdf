"""Excel workbooks (``.xlsx``), by openpyxl."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path
from typing import Any

from strapdown.parsers.limits import damage, library, refuse_total


def sheets(path: Path) -> dict[str, list[list[Any]]]:
    """Read the rows of each sheet; a formula has the value that was stored."""
    openpyxl = library("openpyxl", path)
    with damage("io.excel-unreadable", path):
        data = path.read_bytes()
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            refuse_total(sum(m.file_size for m in archive.infolist()), path)
        book = openpyxl.load_workbook(io.BytesIO(data), read_only=True, data_only=True)
        return {s.title: [list(r) for r in s.iter_rows(values_only=True)] for s in book.worksheets}

"""Text tables as recorders export them: a title above the header, and a row of units under it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from strapdown.exceptions import DataError, Finding
from strapdown.formats import csv
from strapdown.formats.crash_attributes import check_attributes
from strapdown.formats.crash_csv_writer import NOTE
from strapdown.formats.crash_units import unit_of
from strapdown.formats.recording import RawLog

__all__ = ["notes_of", "read_text_table"]

# A header stands within so many lines, or there is none.
HIGHEST_HEADER = 200
# Rows of plain numbers of some hundred bytes: more than this is no table of a crash.
LARGEST = 2_000_000_000
_TITLE = "# title: "
_NO_UNIT = ("", "-", "--", "none", "1")


def read_text_table(path: Path) -> tuple[RawLog, dict[str, dict[str, Any]], str]:
    """Read a text table whose header need not be its first line.

    Parameters
    ----------
    path : Path

    Returns
    -------
    RawLog
        Its `units` are those of a row of units, where there is one.
    dict of str to dict
        What comments say of columns, as `crash_attributes.attributes_of` gives it.
    str
        Title in a comment, or empty.

    Raises
    ------
    DataError
        As `formats.csv.read`.
    """
    if path.stat().st_size > LARGEST:
        raise DataError(
            f"it has {path.stat().st_size} bytes, more than a table of a crash has",
            file=path.name,
            remedy="give the part of the record around the crash",
        )
    text, findings = csv.decoded(path.read_bytes(), path.name)
    if "\0" in text:
        raise DataError(
            "no text: it holds zero bytes",
            file=path.name,
            remedy="give the record as CSV, ISO MME or in the form of the NHTSA database",
        )
    lines = text.splitlines()
    header, units_at, units = _header(lines)
    if header is not None:
        # Blank lines are skipped, and rows keep their numbers.
        above = [line if csv.is_comment(line) else "" for line in lines[:header]]
        lines[:header] = above
        if units_at is not None:
            lines[units_at] = ""
    ended = "\n" if text.endswith(("\n", "\r")) else ""
    raw = csv.parse(("\n".join(lines) + ended).encode(), path.name, (path,))
    raw.findings[:0] = findings
    if units and len(units) == len(raw.columns):
        raw.units |= {name: u for name, u in zip(raw.columns, units, strict=True) if u}
    notes = notes_of(lines, raw)
    title = next((line[len(_TITLE) :] for line in lines[:1] if line.startswith(_TITLE)), "")
    return raw, notes, title


def notes_of(lines: list[str], raw: RawLog) -> dict[str, dict[str, Any]]:
    """What comments say of columns; what is not understood is told in the log's findings."""
    names = list(raw.columns)
    notes: dict[str, dict[str, Any]] = {}
    for row, line in enumerate(lines, start=1):
        if line.strip() and not csv.is_comment(line):
            break
        if not line.startswith(NOTE):
            continue
        try:
            said = json.loads(line[len(NOTE) :])
            checked = check_attributes(said, raw.name, row)
            column = int(said["column"])
            notes[names[column - 1]] = checked
        except (DataError, ValueError, TypeError, KeyError, IndexError, RecursionError) as error:
            told = (
                error.finding.what if isinstance(error, DataError) else "no channel is read in it"
            )
            raw.findings.append(Finding(f"comment left out: {told}", file=raw.name, row=row))
    return notes


def _header(lines: list[str]) -> tuple[int | None, int | None, list[str]]:
    """Where the header and the units stand, and the units; None where the first line is it."""
    said: list[tuple[int, list[str]]] = []
    for at, line in enumerate(lines[:HIGHEST_HEADER]):
        if not line.strip() or csv.is_comment(line):
            continue
        separator = csv.separator_of(line)
        fields = csv.fields_of(line, separator)
        if all(csv.is_data(f) for f in fields) and any(fields):
            return _above(said, len(fields))
        said.append((at, fields))
    return None, None, []


def _above(
    said: list[tuple[int, list[str]]], width: int
) -> tuple[int | None, int | None, list[str]]:
    whole = [(at, fields) for at, fields in said if len(fields) == width]
    if not whole or whole[-1] != said[-1]:
        return None, None, []
    at, fields = whole[-1]
    # A cell may stand above and say only the unit: it is one where every cell does.
    plain = [f.strip("[](){} ") for f in fields]
    known = [unit_of(p) is not None for p in plain if p.lower() not in _NO_UNIT]
    if len(whole) > 1 and whole[-2] == said[-2] and known and all(known):
        units = ["" if p.lower() in _NO_UNIT else p for p in plain]
        return whole[-2][0], at, units
    return at, None, []

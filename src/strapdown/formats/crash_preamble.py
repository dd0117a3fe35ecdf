"""Text tables as recorders export them: a title above the header, and a row of units under it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from strapdown.errors import DataError, Finding
from strapdown.formats import csv
from strapdown.formats.crash_attributes import check_attributes
from strapdown.formats.crash_csv_writer import NOTE
from strapdown.formats.crash_text import LONGEST_NAME, clean
from strapdown.formats.crash_units import unit_of
from strapdown.formats.day_time import day_nanoseconds
from strapdown.formats.recording import RawLog

__all__ = ["notes_of", "read_text_table"]

# A header stands within so many lines, or there is none.
HIGHEST_HEADER = 200
# So many rows under the first look like it.
ROWS = 3
# Lines above a table that a person would read.
MOST_REMARKS = 24
# Rows of plain numbers of some hundred bytes: more than this is no table of a crash.
LARGEST = 2_000_000_000
_TITLE = "# title: "
_NO_UNIT = ("", "-", "--", "none", "1")


def read_text_table(
    path: Path,
) -> tuple[RawLog, dict[str, dict[str, Any]], str, tuple[str, ...]]:
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
    tuple of str
        The other lines above the table, in which recorders write rate, range and axes.

    Raises
    ------
    DataError
        As `formats.csv.read`.
    """
    if path.stat().st_size > LARGEST:
        raise DataError(
            "io.bytes-more-than-table-crash", file=path.name, st_size=path.stat().st_size
        )
    text, findings = csv.decoded(path.read_bytes(), path.name)
    if "\0" in text:
        raise DataError("io.crash-table-with-zero-bytes", file=path.name)
    lines = text.splitlines()
    header, units_at, units = _header(lines)
    remarks = _remarks(lines, header)
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
    _read_clocks(raw)
    notes = notes_of(lines, raw)
    title = next((line[len(_TITLE) :] for line in lines[:1] if line.startswith(_TITLE)), "")
    # A comment may be the header.
    return raw, notes, title, tuple(r for r in remarks if not r.startswith(next(iter(raw.columns))))


def _remarks(lines: list[str], header: int | None) -> tuple[str, ...]:
    above = []
    for at, line in enumerate(lines[:HIGHEST_HEADER]):
        if at == header or (not csv.is_comment(line) and (header is None or at > header)):
            break
        if line.startswith((NOTE, _TITLE)):
            continue
        text = clean(line.lstrip("#% "), LONGEST_NAME)
        if text:
            above.append(text)
    return tuple(above[:MOST_REMARKS])


def _read_clocks(raw: RawLog) -> None:
    """Times of day become nanoseconds since midnight."""
    stated = dict(raw.stated)
    for name, values in raw.columns.items():
        if values.dtype.kind != "O":
            continue
        ticks = day_nanoseconds(values)
        if ticks is not None:
            raw.columns[name] = ticks
            stated[name] = ("time", "ns")
    raw.stated = stated


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
            reason = error.finding if isinstance(error, DataError) else None
            raw.findings.append(
                Finding(
                    "io.comment-of-no-channel" if reason is None else "io.comment-left-out",
                    file=raw.name,
                    row=row,
                    severity="note",
                    reason=reason,
                )
            )
    return notes


def _header(lines: list[str]) -> tuple[int | None, int | None, list[str]]:
    """Where the header and the units stand, and the units; None where the first line is it."""
    said = [
        (at, csv.fields_of(line, csv.separator_of(line)))
        for at, line in enumerate(lines[:HIGHEST_HEADER])
        if line.strip() and not csv.is_comment(line)
    ]
    # Rows of numbers alone; of a table that has a column of text, rows that are mostly numbers.
    # "Channels: 3" above a table looks like one: what goes on as it begins goes first.
    for goes_on in (True, False):
        for whole in (True, False):
            for k, (_, fields) in enumerate(said):
                if not _is_row(fields, whole):
                    continue
                below = [f for _, f in said[k + 1 : k + 1 + ROWS]]
                if goes_on and not (
                    below and all(len(f) == len(fields) and _is_row(f, whole) for f in below)
                ):
                    continue
                return _above(said[:k], len(fields))
    return None, None, []


def _is_row(fields: list[str], whole: bool) -> bool:
    there = [f for f in fields if f]
    numbers = sum(map(csv.is_data, there))
    return bool(numbers and (numbers == len(there) if whole else 2 * numbers >= len(fields)))


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

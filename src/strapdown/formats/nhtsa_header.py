"""The header of a crash test of the NHTSA database, row by row: sections, fields, numbers."""

from __future__ import annotations

import math
from pathlib import Path

from strapdown.errors import DataError

SECTIONS = ("EV5", "TEST", "VEHICLE", "BARRIER", "OCCUPANT", "RESTRAINT", "INSTRUMENTATION", "END")
# Headers are text of some hundred bytes a channel, of which no test has a hundred thousand.
LARGEST_HEADER = 50_000_000


def sections(file: Path) -> dict[str, list[tuple[list[str], int]]]:
    """Rows of each section, field by field, with their line numbers.

    Raises
    ------
    DataError
        The file is missing, empty, far too large, cut, or in another form.
    """
    if not file.is_file():
        raise DataError("io.no-such-file", file=str(file))
    size = file.stat().st_size
    if size == 0 or size > LARGEST_HEADER:
        raise DataError(
            "io.file-empty-5" if not size else "io.bytes-no-ev-header", file=file.name, size=size
        )
    rows: dict[str, list[tuple[list[str], int]]] = {name: [] for name in SECTIONS}
    section = ""
    seen: set[str] = set()
    for k, line in enumerate(file.read_bytes().decode("latin-1").splitlines(), start=1):
        text = line.strip()
        if not text or text.startswith("#"):
            continue
        if text.startswith("-----"):
            section = text.strip("- ").upper()
            if section not in rows:
                raise DataError(
                    "io.no-section-ev",
                    file=file.name,
                    row=k,
                    quantity="section",
                    section=section,
                    word=section,
                    known=SECTIONS,
                )
            seen.add(section)
        elif section in ("", "EV5", "END"):
            raise DataError("io.stands-no-section", file=file.name, row=k, text=text[:40])
        else:
            rows[section].append(([f.strip() for f in line.split("|")], k))
    missing = [name for name in ("EV5", "TEST", "INSTRUMENTATION", "END") if name not in seen]
    if missing:
        raise DataError("io.no-section", file=file.name, quantity="section", missing=missing)
    return rows


def only(
    rows: dict[str, list[tuple[list[str], int]]], section: str, file: Path
) -> tuple[list[str], int]:
    """Return the row of a section that has one, with its line; refuse another count."""
    if len(rows[section]) != 1:
        raise DataError(
            "io.rows-section-needed",
            file=file.name,
            quantity=section,
            count=len(rows[section]),
            section=section,
        )
    return rows[section][0]


def to_number(text: str, file: Path, line: int, what: str) -> float:
    """Return a field as a number, NaN where it is not stated; refuse what is none."""
    if text in ("", "NA", "UN"):
        return math.nan
    try:
        value = float(text)
    except ValueError:
        raise bad_number(text, file, line, what) from None
    if not math.isfinite(value):
        raise bad_number(text, file, line, what)
    return value


def to_whole(text: str, file: Path, line: int, what: str) -> int:
    """Return a field as a whole number; refuse what is none, or not stated."""
    value = to_number(text, file, line, what)
    if not math.isfinite(value) or value != int(value):
        raise bad_number(text, file, line, what)
    return int(value)


def bad_number(text: str, file: Path, line: int, what: str) -> DataError:
    """What is said of a field that should be a number."""
    return DataError("io.no-number-4", file=file.name, row=line, quantity=what, text=text)


def row_error(file: Path, line: int, section: str, found: int, needed: int) -> DataError:
    """What is said of a row with too few or too many fields."""
    return DataError(
        "io.fields-between-bars-row",
        file=file.name,
        row=line,
        quantity=section,
        found=found,
        section=section,
        needed=needed,
    )

"""Text tables: commas, semicolons, tabs, bars or blanks, with or without names of columns.

A table without any oddity is read at once (`text_columns`), anything else line by line: text above
and among the rows, quotes, decimal commas, separators that end rows, a last line that was cut,
tables below each other, lines that a program printed (`printed_lines`).
"""

from __future__ import annotations

import dataclasses
import itertools
import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import DataError, Finding, add_note
from strapdown.formats.clock_columns import with_one_clock
from strapdown.formats.columns import UNKNOWN_WORDS, read_name
from strapdown.formats.printed_lines import LONGEST, SENTENCE, as_rows
from strapdown.formats.recording import RawLog, stated_by
from strapdown.formats.signs import HEAD, Signs, first_bytes
from strapdown.formats.text_columns import (
    HEXADECIMAL,
    JUDGED,
    MARKS,
    NUMBER_OR_NAN,
    SEARCHED,
    UNSIGNED,
    Columns,
    Lines,
    are_data,
    columns_at_once,
    decoded,
    fields_of,
    is_comment,
    is_data,
    numbered_lines,
    parsed,
    separator_of,
    without_second_encoding,
)
from strapdown.formats.vocabularies import FIXES, TRIADS
from strapdown.tables.on_disk import let_go, step_range
from strapdown.units import ACCEL_UNITS, GYRO_UNITS, MAG_UNITS, OF_LOGS, OF_TABLES, unit_of

# --- the top of a table: where its numbers begin, and what is above them -----------------
# Names and units of columns, and the sampling rate and the units of sensors in words.

_UNIT = re.compile(r"\s*[\[(].*")
_REMARK = re.compile(r"\s*\([^()]*\)|\s*\[[^\[\]]*\]")
# A unit in brackets; those within it, as of m/(s^2), are its own.
_ENCLOSED = re.compile(r"^[\[({]\s*(.*?)\s*[\])}]$")
_CALIBRATED = {"cal", "raw", "uncal"}
# The level behind the unit of a height.
_LEVEL = re.compile(r"(ft|feet|m)\s+(?:msl|agl|baro|wgs ?84|hae|gps)", re.I)
_NO_UNIT = ("-", "--", "none", "1")
#: Characters of the lines at the top in which the rows of numbers are searched.
SEARCHED_TEXT = 1 << 20
#: Lines below one with a word and a number in which the names of the columns are searched.
PREAMBLE = 10
#: Most lines between names and rows of which the names have another separator.
ABOVE = 4


class TableTop:
    """Names, units and separator of a table, and the lines from its first row on.

    Lines above the names are a preamble. Two lines of names are a group and its members, as
    ``Gyroscope,,`` over ``x,y,z``.

    `numbered`: lines with their rows, without the comments at the top. `kinds`: of units that a
    row under the names may have.
    """

    def __init__(self, numbered: Lines, comments: list[str], kinds: Sequence[str]) -> None:
        first, self.separator, width = _first_row(numbered, kinds)
        self.data = numbered[first:]
        #: Lines above, without those of the names.
        self.above = comments + [line for _, line in numbered[:first]]
        self.units: dict[str, str] = {}
        near = [line for _, line in numbered[max(0, first - 4) : first]][::-1]
        # A row that only says that each column is calibrated has neither names nor units.
        marks = [line for line in near[:2] if _says_calibrated(line, self.separator)]
        near = [line for line in near if line not in marks][:3]
        lines = [_named(line, self.separator, width) for line in near] + [None, None]
        names, over = lines[:2]
        if names is None and near:
            names = self._behind_a_word(near[0], width) or self._names_parted_otherwise(width)
        if names is None:
            below = self._units_in_comment(width, kinds)
            named = _above(self.above[:-1] if below else self.above, width, self.separator)
            if named is not None:
                del self.above[len(self.above) - 1 - bool(below) :]
            names = named or [f"column {k + 1}" for k in range(width)]
            below = None if named is None else below
        else:
            below = _units(near[0], self.separator, width, kinds) if over is not None else None
            if below and over is not None:
                names, over = over, lines[2]
            bare = [_UNIT.sub("", n) for n in names if n]
            grouped = len(set(bare)) < len(bare) and (
                over is not None and (_are_groups(over) or _are_runs(over))
            )
            if grouped and over is not None:
                names = [f"{g} {n}".strip() for g, n in zip(_filled(over), names, strict=True)]
            over_names = near[1:2] or comments[-1:]
            if not below and not grouped and over_names:
                below = self._units_over(over_names[0], width, kinds)
            del self.above[len(self.above) - 1 - bool(below) - grouped - len(marks) :]
        names = of_arrays(names)
        count: Counter[str] = Counter()
        self.names = []
        for name in names:
            count[name] += 1
            self.names.append(name if count[name] == 1 else f"{name} ({count[name]})")
        if below:
            self.units = {n: u for n, u in zip(self.names, below, strict=True) if u}

    def _units_over(self, line: str, width: int, kinds: Sequence[str]) -> list[str] | None:
        """Units in the line above the names, of any quantity: ``# deg, deg, ft msl, kt``.

        The level of a height, which a name says, is left out.
        """
        bare = line.strip().lstrip(MARKS)
        fields = [_LEVEL.sub(r"\1", field) for field in fields_of(bare, self.separator)]
        joined = (self.separator or " ").join(fields)
        return _units(joined, self.separator, width, tuple({*kinds, *OF_TABLES}))

    def _behind_a_word(self, line: str, width: int) -> list[str] | None:
        """Names of rows that all begin with one word, which has no name: ``Data,1,2``."""
        words = {fields_of(row, self.separator)[0] for _, row in self.data[:JUDGED]}
        if len(words) != 1 or width < 2:
            return None
        word = words.pop()
        named = _named(line, self.separator, width - 1)
        # Where the first name is not of a number, the word has it, and another is missing.
        if not named or read_name(named[0]).quantity is None:
            return None
        return [word, *named] if word and not is_data(word) else None

    def _names_parted_otherwise(self, width: int) -> list[str] | None:
        """Names that commas separate over rows that blanks do, as POSPac has them, or tabs.

        A board prints names between tabs, and its rows between commas.
        """
        between = "," if self.separator is None else "\t"
        lines = [fields_of(line, between) for line in reversed(self.above[-ABOVE:])]
        fits = (n for n in lines if len(n) == width and all(n) and not are_data(n))
        return next(fits, None)

    def _units_in_comment(self, width: int, kinds: Sequence[str]) -> list[str] | None:
        """Units in the last comment, where the one before it has the names."""
        if len(self.above) < 2 or not all(map(is_comment, self.above[-2:])):
            return None
        if _above(self.above[:-1], width, self.separator) is None:
            return None
        return _units(self.above[-1].strip().lstrip(MARKS), self.separator, width, kinds)


def _first_row(numbered: Lines, kinds: Sequence[str]) -> tuple[int, str | None, int]:
    """Return the first of rows of numbers, their separator, and their number of fields.

    They are the most frequent form, and two of the first three have it. Where every line above has
    as many fields, the first that is full names the columns.
    """
    forms: list[tuple[str | None, int]] = []
    data: list[bool] = []
    read = 0
    for _, line in numbered[:SEARCHED]:
        separator = separator_of(line)
        fields = fields_of(line, separator)
        forms.append((separator, len(fields)))
        data.append(are_data(fields))
        if (read := read + len(line)) > SEARCHED_TEXT and len(forms) > 4:
            break
    # Numbers in a preamble are fewer than the rows.
    usual = Counter(f for f, d in zip(forms, data, strict=True) if d).most_common(1)
    like = [bool(usual) and d and f == usual[0][0] for f, d in zip(forms, data, strict=True)]
    for k in np.flatnonzero(like).tolist():
        after = like[k + 1 : k + 3]
        # A line with empty fields is of a preamble if the names, all there, are soon below.
        if not all(fields_of(numbered[k][1], forms[k][0])) and any(
            forms[m] == forms[k] and not data[m] and all(fields_of(numbered[m][1], forms[m][0]))
            for m in range(k + 1, min(k + 1 + PREAMBLE, len(forms)))
        ):
            continue
        if k == 1:
            break
        if after and not any(after) and len(like) > 3:
            continue
        separator, width = forms[k]
        if k > 1 and all(form == forms[k] for form in forms[:k]):
            top = [fields_of(line, separator) for _, line in numbered[:k]]
            # Lines of a preamble may be filled up with separators.
            full = next((m for m, names in enumerate(top) if all(names)), None)
            first = 1 + (_are_groups(top[0]) if full is None else full)
            # Groups whose names are repeated, over their members.
            if full is not None and first < k and _are_runs(top[full]) and not data[first]:
                first += 1
            if first < k and _says_calibrated(numbered[first][1], separator):
                first += 1
            if first < k and _units(numbered[first][1], separator, width, kinds):
                first += 1
            return min(first, k), separator, width
        return k, separator, width - _ends_empty(numbered, forms[k], k)
    # A single line above is that of the names, and decides how many fields a row has.
    separator = separator_of(numbered[0][1])
    names = fields_of(numbered[0][1], separator)
    return 1, separator, len(names) - (len(names) > 1 and not names[-1])


def _ends_empty(numbered: Lines, form: tuple[str | None, int], first: int) -> bool:
    """Whether every row ends with a separator, and the names have no field for it."""
    separator, width = form
    above = fields_of(numbered[first - 1][1], separator) if first else []
    if len(above) == width and above[-1]:
        return False
    rows = [fields_of(line, separator) for _, line in numbered[first : first + 50]]
    return all(len(row) != width or not row[-1] for row in rows)


def _named(line: str, separator: str | None, width: int) -> list[str] | None:
    """Return the fields of a line that may name columns, or None."""
    bare = line.strip().lstrip(MARKS).strip() if is_comment(line) else line
    fields = fields_of(bare, separator)
    if bare != line and len(fields) == width - 1:
        # The mark may be the name of a column of numbers of rows.
        whole = fields_of(line.strip(), separator)
        fields = whole if len(whole) == width and not whole[0].strip(MARKS) else fields
    if bare != line and len(fields) == width and not fields[0]:
        fields = [line.strip()[: len(line.strip()) - len(bare)].strip() or "#", *fields[1:]]
    if len(fields) == width + 1 and not fields[-1]:
        fields = fields[:-1]
    return fields if len(fields) == width and any(fields) and not are_data(fields) else None


def _says_calibrated(line: str, separator: str | None) -> bool:
    """Whether a line only says of each column whether it is calibrated."""
    said = {field.strip().lower() for field in fields_of(line, separator)} - {""}
    return bool(said) and said <= _CALIBRATED


def _are_groups(fields: list[str]) -> bool:
    """Whether a line names groups of columns: some fields are empty, each name is there once."""
    full = [f for f in fields if f]
    return len(fields) > len(full) > 0 and len(set(full)) == len(full)


def _are_runs(fields: list[str]) -> bool:
    """Whether a line names groups of columns by repeating each name over its members."""
    names = [name for name, _ in itertools.groupby(fields)]
    return all(fields) and len(fields) > len(names) == len(set(names)) > 1


def _filled(fields: list[str]) -> list[str]:
    """Repeat each name over the empty fields after it."""
    out: list[str] = []
    for field in fields:
        out.append(field or (out[-1] if out else ""))
    return out


#: Axes in a name, in the order of the columns that it stands over.
_LISTED = re.compile(r"\(([xyz]),([xyz]),([xyz])\)")


def of_arrays(names: list[str]) -> list[str]:
    """Name the values of a sensor of which the first alone has its name: ``Gyro, 1, 2``.

    They are numbered, or have the axes that the name lists: ``Gyro (z,x,y), 1, 2``.
    """
    out = list(names)
    for k, name in enumerate(names):
        numbered = names[k + 1 : k + 3] == ["1", "2"] and names[k + 3 : k + 4] != ["3"]
        listed = _LISTED.search(name) if numbered else None
        if listed and set(listed.groups()) == {*"xyz"}:
            bare = name[: listed.start()], name[listed.end() :]
            out[k : k + 3] = [f"{bare[0]}({axis}){bare[1]}" for axis in listed.groups()]
        elif numbered and read_name(name).quantity in TRIADS:
            out[k : k + 3] = [f"{name}[{j}]" for j in range(3)]
    return out


def _units(line: str, separator: str | None, width: int, kinds: Sequence[str]) -> list[str] | None:
    """Return the units of a second header line, if most fields are units known here."""
    fields = [_ENCLOSED.sub(r"\1", f.strip()) for f in fields_of(line, separator)][:width]
    fields = ["" if f.lower() in _NO_UNIT else f for f in fields]
    known = [unit_of(f, kinds) is not None for f in fields if f]
    return fields if len(fields) == width and known and 2 * sum(known) > len(known) else None


def _above(comments: list[str], width: int, separator: str | None) -> list[str] | None:
    """Return the names that the last comment gives to columns without a header, or None."""
    names = _named(comments[-1], separator, width) if comments else None
    if comments and names is None and separator is None:
        # Names over columns of blanks may be separated otherwise: "% time, x, y".
        names = _named(comments[-1], separator_of(comments[-1].strip().lstrip(MARKS)), width)
    if comments and names is None:
        # A remark in brackets may hold separators: "# time_s,force_N (sum of cells, zeroed)".
        names = _named(_REMARK.sub("", comments[-1]), separator, width)
    return None if names is None or any(is_data(n) for n in names) else names


# Sampling rate and units of sensors, stated in the lines above a table.


# "Sample Rate:,128,Hz", "// Update Rate: 100.0Hz", "Sampling frequency (Hz): 50", "ODR 100 Hz".
_RATES = (
    re.compile(
        r"(?:sampl\w*|update|output|logging|data)[ _-]*(?:rate|freq\w*)"
        rf"(?:\s*[\[(]\s*Hz\s*[\])])?\W*?({UNSIGNED})(?!\d|\s*[a-gi-z])",
        re.I,
    ),
    re.compile(rf"\b(?:fs|odr)\b\W*?({UNSIGNED})\s*Hz\b", re.I),
)
_STEP = re.compile(rf"\bdt\s*=\s*({UNSIGNED})\s*s\b", re.I)
_NAME_OF_SENSOR = re.compile(
    r"(?P<gyro>gyro(?:scopes?|s)?|ang(?:ular)?[ _-]?(?:rate|vel(?:ocity)?)s?|(?:rotation|turn)"
    r"[ _-]?rates?)|(?P<accel>acc(?:el(?:eration|erometer)?s?)?|specific[ _-]force)"
    r"|(?P<mag>mag(?:netometer|netic[ _-]?field|n)?)",
    re.I,
)
_IN = re.compile(
    r"[\s:=(\[]*(?:\b(?:units?|in|is|are|data|values?)\b[\s:=(\[]*)*"
    r"([^\s,;)\]]+(?:[ ]s\^?(?:-|−|⁻)(?:\d|[¹²]))?)",
    re.I,
)
_COUNT = r"(?:LSBs?|counts?|digits?)"
_PER_UNIT = re.compile(rf"({UNSIGNED})\s*{_COUNT}\s*(?:/|per)\s*\(?([^\s,;)]+)", re.I)
_PER_COUNT = re.compile(rf"({UNSIGNED})\s*([^\s\d,;(]+?)\s*(?:/|per)\s*{_COUNT}", re.I)
# Counts of 1 g among the settings of a flight controller: acc_1G:2048.
_ONE_G = re.compile(rf"[_ ]?1_?G\"?[\s:=,]+\"?({UNSIGNED})", re.I)
_RANGE = re.compile(r"(?:±|\+/?-|_FS[_=]?)\s*(\d+)\s*([^\s,;)]*)", re.I)
_16_BIT = re.compile(r"\bint16|\b16[ -]?bit", re.I)
_KNOWN = {"gyro": GYRO_UNITS, "accel": ACCEL_UNITS, "mag": MAG_UNITS}
#: Unit of a range that is stated without, as in the names of registers.
_OF_RANGE = {"gyro": "deg/s", "accel": "g"}


def stated_rate(above: list[str]) -> float | None:
    """Return the sampling rate (Hz) that lines above a table state."""
    rates = [float(m[1]) for line in above for form in _RATES if (m := form.search(line))]
    rates += [1.0 / float(m[1]) for line in above if (m := _STEP.search(line)) and float(m[1])]
    return rates[0] if rates and rates[0] > 0.0 else None


def stated_units(above: list[str], columns: dict[str, NDArray[Any]]) -> dict[str, str]:
    """Return the unit of each sensor that lines above a table state.

    ``gyro: deg/s``; counts by ``131 LSB/(deg/s)``, ``0.061 mg/LSB``, ``acc_1G:2048``, or by a range
    of 16 bits: ``±250 deg/s … 16 bit``. Counts are whole numbers; a range says no unit of others.
    """
    text = "\n".join(above)
    out: dict[str, str] = {}
    for line in above:
        found = [*_NAME_OF_SENSOR.finditer(line)]
        for this, after in itertools.zip_longest(found, found[1:]):
            triad = str(this.lastgroup)
            rest = line[this.end() : after.start() if after else None]
            if line[this.end() : this.end() + 1].isalpha() or triad in out:
                continue
            unit = _counts(triad, rest, bool(_16_BIT.search(text)))
            if unit is not None and not _are_counts(triad, columns):
                continue
            said = unit_of(m[1].strip(".:").removesuffix("'s")) if (m := _IN.match(rest)) else None
            if unit or said in _KNOWN[triad]:
                out[triad] = unit or str(said)
    return out


def _counts(triad: str, text: str, of_16_bits: bool) -> str | None:
    """Return the unit of raw counts that a text states."""
    if triad == "accel" and (m := _ONE_G.match(text)) and float(m[1]):
        return f"g/{m[1]}"
    if m := _PER_UNIT.search(text):
        scale, unit = f"/{m[1]}", unit_of(m[2])
    elif m := _PER_COUNT.search(text):
        return f"{m[1]} {of}" if (of := unit_of(m[2])) in _KNOWN[triad] else None
    elif of_16_bits and triad in _OF_RANGE and (m := _RANGE.search(text)) and int(m[1]):
        # Names of registers have no unit.
        default = _OF_RANGE[triad] if m[0].upper().startswith("_FS") else None
        scale, unit = f"/{32768 / int(m[1]):g}", unit_of(m[2]) or default
    else:
        return None
    return f"{unit}{scale}" if unit in _KNOWN[triad] else None


def _are_counts(triad: str, columns: dict[str, NDArray[Any]]) -> bool:
    """Whether the columns of a sensor, as far as their names say it, are whole numbers."""
    held = [c for n, c in columns.items() if str(read_name(n).quantity).startswith(triad)]
    return all(
        c.dtype.kind in "iuf" and bool(np.all(~np.isfinite(c) | (c == np.rint(c)))) for c in held
    )


SUFFIXES = (".csv", ".txt", ".tsv", ".dat")
# Line breaks of Python that are none of an editor.
_BREAKS = re.compile("[\x0b\x0c\x1c\x1d\x1e\x85\u2028\u2029]|\r(?!\n)")


def _begins_with_rows(path: Path) -> bool:
    """Whether the first lines are rows of data under any name."""
    data = first_bytes(path, HEAD)
    if not data.strip():
        return False
    try:
        text, _ = decoded(data[: data.rfind(b"\n") + 1] or data, path.name)
    except DataError:
        return False
    lines = as_rows(numbered_lines(text)[0])[-21:]
    rows = [fields_of(line) for _, line in lines[:-1] or lines]
    return len(rows) > 2 and all(len(row) > 2 and are_data(row) for row in rows)


detect = Signs(named=SUFFIXES, also=_begins_with_rows)


def read(path: Path) -> RawLog:
    """Read the columns of a text table.

    Columns that hold anything but numbers are left as text. Lines at the top that begin with ``#``,
    ``%``, ``//``, ``!`` or ``;`` are comments; the comment ``# sampling: mean`` is understood.
    """
    return parse(path, path.name, (path,))


def parse(
    source: bytes | Path, name: str, files: tuple[Path, ...], kinds: Sequence[str] = OF_LOGS
) -> RawLog:
    """Read the columns of a text table from a file or a member of an archive.

    `name`: for messages. `files`: file that holds it. `kinds`: of units in a row under the names.
    """
    at_once = _at_once(source, name, files, kinds)
    if at_once is not None:
        return at_once
    data = source if isinstance(source, bytes) else source.read_bytes()
    return _line_by_line(data, name, files, kinds)


def _at_once(
    source: bytes | Path, name: str, files: tuple[Path, ...], kinds: Sequence[str] = OF_LOGS
) -> RawLog | None:
    """Read a text whose rows are all like the first; ten times faster.

    None if anything is irregular: the lines then have to be parsed one by one.
    """
    if isinstance(source, bytes):
        head, tail, size = source[:HEAD], source[-HEAD:], len(source)
    else:
        with source.open("rb") as stream:
            head = stream.read(HEAD)
            size = stream.seek(0, 2)
            stream.seek(max(0, size - HEAD))
            tail = stream.read()
    try:
        text = head[: head.rfind(b"\n") + 1].decode("utf-8-sig")
    except UnicodeDecodeError:
        return None
    text, findings = without_second_encoding(text, name)
    if not text or "\0" in text or _BREAKS.search(text):
        return None
    numbered, comments = numbered_lines(text, name)
    if not numbered or as_rows(numbered) is not numbered:
        return None
    top = TableTop(numbered, comments, kinds)
    if not top.data:
        return None
    first, _ = top.data[0]
    start = 0
    for _ in range(first - 1):
        start = head.index(b"\n", start) + 1
    if not tail.endswith(b"\n"):
        before, _, last = tail.decode("latin-1").rpartition("\n")
        rows = [*enumerate(before.split("\n"))][-20:]
        if size <= HEAD or _was_cut(last, rows, top, ended=False):
            return None
    seen = [line for _, line in top.data] + tail.decode("latin-1").split("\n")[1:]
    if _mark_of_groups(seen, top.separator):
        return None
    columns = columns_at_once(source, len(top.names), top.separator, start)
    # A line of text between rows makes text of every column.
    if columns is None or all(c.dtype.kind == "O" for c in columns):
        return None
    # Fractions of a second without their zeros are told by their digits.
    clock = _clock(top.names, columns)
    if clock is not None and len(columns[clock]) > 1 and step_range(columns[clock])[0] < 0.0:
        return None
    # Nor are blanks beside a separator, or that begin a line, part of a word.
    if any(c.dtype.kind == "O" for c in columns) and (f"{top.separator} " in text or "\n " in text):
        return None
    return _log(top, name, files, columns, np.arange(first, first + columns[0].size), findings)


def _line_by_line(
    data: bytes, name: str, files: tuple[Path, ...], kinds: Sequence[str] = OF_LOGS
) -> RawLog:
    text, findings = decoded(data, name)
    numbered, comments = numbered_lines(text, name)
    if not numbered:
        raise DataError("io.file-holds-comments-alone" if comments else "io.file-empty", file=name)
    if parts := _sections(numbered):
        return _joined(parts, comments, name, files, kinds, findings)
    top = TableTop(as_rows(numbered), comments, kinds)
    if not top.data:
        raise DataError("io.csv-without-rows", file=name, row=numbered[0][0])
    ended = text.endswith(("\n", "\r"))
    rows, lines = _whole_lines(top, ended, name, findings)
    if (several := _in_blocks(rows, top, name)) is not None:
        findings.append(several)
    if mark := _mark_of_groups(lines, top.separator):
        lines = [_GROUPS[mark].sub(lambda m: m[0].replace(mark, ""), line) for line in lines]
        add_note(findings, "io.thousands-grouped", file=name, row=rows[0], mark=mark)
    columns = _parse(lines, len(top.names), top.separator, name)
    clock = _clock(top.names, columns)
    if clock is not None and len(columns[clock]) > 1 and step_range(columns[clock])[0] < 0.0:
        texts = [fields_of(line, top.separator)[clock] for line in lines]
        if (padded := _padded(texts)) is not None:
            columns = [*columns[:clock], padded, *columns[clock + 1 :]]
            finding = Finding(
                "io.fractions-without-zeros",
                severity="note",
                file=name,
                quantity=top.names[clock],
                row=rows[0],
            )
            findings.append(finding)
    return _log(top, name, files, columns, np.array(rows), findings)


#: Numbers whose thousands a mark groups, with decimals behind the other; lines that are looked at,
#: and fewest grouped numbers and others that show it.
_GROUPS = {
    mark: re.compile(rf"(?<![\d.,])-?[1-9]\d{{0,2}}(?:\{mark}\d{{3}})+(?:\{other}\d+)?(?![\d.,])")
    for mark, other in ((".", ","), (",", "."))
}
_LOOKED_AT, _LEAST_GROUPED = 400, 20


def _mark_of_groups(lines: Sequence[str], separator: str | None) -> str:
    """Return the mark that groups thousands, 1.165 beside 146; empty if none does.

    Every number with the mark is then of whole groups behind a digit that is no zero, and those
    without it in the same columns have at most three digits before their decimals.
    """
    if separator not in (";", "\t"):
        return ""
    some = lines[:: max(1, len(lines) // _LOOKED_AT)]
    rows = [[f.strip(' "') for f in line.split(separator)] for line in some]
    columns = [[f for f in c if f[:1].isdigit() or f[:1] == "-"] for c in zip(*rows, strict=False)]
    for mark, other in ((".", ","), (",", ".")):
        fields = [f for c in columns if any(mark in f for f in c) for f in c]
        grouped = [f for f in fields if mark in f]
        if len(grouped) < _LEAST_GROUPED or not all(map(_GROUPS[mark].fullmatch, grouped)):
            continue
        plain = [f for f in fields if mark not in f and f.strip("-0")]
        # Whole seconds beside 5.125 are digits before its mark.
        before = {f.partition(mark)[0] for f in grouped}
        if 2 * sum(f.partition(other)[0] in before for f in plain) > len(plain):
            continue
        short = all(len(f.lstrip("-").partition(other)[0]) < 4 for f in plain)
        if short and len(plain) >= _LEAST_GROUPED:
            return mark
    return ""


def _clock(names: Sequence[str], columns: Columns) -> int | None:
    """Return the number of the first column of fractional numbers that is named as a clock."""
    floats = (k for k, c in enumerate(columns) if c.dtype.kind == "f")
    return next((k for k in floats if read_name(names[k]).quantity == "time"), None)


#: Seconds, a point, and a count of milli-, micro- or nanoseconds without zeros before it.
_UNPADDED = re.compile(r"(\d+)\.(\d{1,9})")


def _padded(texts: list[str]) -> NDArray[np.float64] | None:
    """Return seconds of texts whose fraction is a number of thousandths, without its zeros.

    ``0.98``, ``0.99``, ``0.100``. None where that does not put them in order, or any fraction has a
    zero before it.
    """
    parts = [m.groups() for text in texts if (m := _UNPADDED.fullmatch(text.strip()))]
    if len(parts) < len(texts) or any(f[0] == "0" and f != "0" for _, f in parts):
        return None
    digits = max(len(f) for _, f in parts)
    digits = next(d for d in (3, 6, 9) if digits <= d)
    seconds = np.array([int(s) + int(f) / 10**digits for s, f in parts])
    steps = np.diff(seconds)
    even = steps.max(initial=0.0) < PAUSE * float(np.median(steps)) if steps.size else False
    return seconds if even and bool((steps > 0.0).all()) else None


#: Longest step beside the usual one of rows whose fractions have no zeros.
PAUSE = 20.0


#: Fewest names of a section's columns, and most lines of text that are searched for them.
NAMES, TEXTS = 3, 64


def _sections(numbered: Lines) -> list[tuple[str, Lines]]:
    """Return the sections of a text that has tables below each other, each with its own names.

    Each has its title, the line of one field above the names; empty if there is just one table,
    whose names may be repeated where logs were joined.
    """
    texts = [k for k, (_, line) in enumerate(numbered) if line.lstrip(" \t\"'#%[")[:1].isalpha()]
    heads: list[tuple[int, list[str]]] = []
    for k in texts if len(texts) <= TEXTS else ():
        below = numbered[k + 1][1] if k + 1 < len(numbered) else ""
        names = fields_of(numbered[k][1].strip().lstrip(MARKS), separator_of(below))
        row = fields_of(below)
        if len(names) == len(row) >= NAMES and are_data(row) and not are_data(names):
            axes = {str(read_name(n).quantity)[-2:] for n in names}
            if (
                {"_x", "_y", "_z"} <= axes
                or set("xyz") <= {n.lower()[:1] for n in names}
                or are_fixes(names)
            ):
                heads.append((k, names))
    if len({tuple(names) for _, names in heads}) < 2:
        titles = {_title(numbered, k, texts) for k, _ in heads}
        if len(heads) < 2 or len(titles) < len(heads) or "" in titles:
            return []
    out = []
    for (k, _), (end, _) in itertools.pairwise([*heads, (len(numbered), [])]):
        title = _title(numbered, k, texts)
        body = numbered[k:end]
        while body and (end := end - 1) in texts and end > k:
            body = body[:-1]
        out.append((title, body))
    return out


def _title(numbered: Lines, head: int, texts: Sequence[int]) -> str:
    """Return the words of the line above names, if it is not a row; or empty."""
    if head - 1 not in texts:
        return ""
    return numbered[head - 1][1].strip(" \t\"'#%/;![]:,=-*")


def _joined(
    parts: list[tuple[str, Lines]],
    comments: list[str],
    name: str,
    files: tuple[Path, ...],
    kinds: Sequence[str],
    findings: list[Finding],
) -> RawLog:
    """Read tables below each other as logs of single sensors, on the stamps of the gyro.

    DataError: none has a gyro.
    """
    from strapdown.formats.join import join

    logs: list[RawLog] = []
    fixes: RawLog | None = None
    for title, numbered in parts:
        top = TableTop(numbered, comments, kinds)
        if title and not any("_" in str(read_name(n).quantity) for n in top.names):
            # x, y and z under the name of their sensor.
            axes = {n: f"{title} {n}" for n in top.names if read_name(n).quantity is None}
            top.units |= {axes[n]: u for n, u in top.units.items() if n in axes}
            top.names = [axes.get(n, n) for n in top.names]
        rows, lines = _whole_lines(top, True, name, findings)
        columns = _parse(lines, len(top.names), top.separator, name)
        log = _log(top, name, files, columns, np.array(rows), [])
        if fixes is None and not any(map(_is_gyro, log.columns)) and are_fixes(log.columns):
            fixes = log
        else:
            logs.append(log)
    if not any(_is_gyro(n) for log in logs for n in log.columns):
        raise DataError(
            "io.csv-sections",
            file=name,
            row=parts[1][1][0][0],
            sections=[", ".join(log.columns) for log in logs],
        )
    if len(logs) == 1:
        raw = logs[0]
    else:
        add_note(findings, "io.csv-sections-joined", file=name, count=len(logs))
        named = [dataclasses.replace(log, name=f"{name}/{k}") for k, log in enumerate(logs, 1)]
        raw = join(named, name, files)
    raw.findings[:0] = findings
    return dataclasses.replace(raw, fixes=fixes)


def are_fixes(names: Iterable[str]) -> bool:
    """Whether the names of columns say latitude and longitude."""
    return {"lat", "lon"} <= {read_name(n, FIXES).quantity for n in names}


def _whole_lines(
    top: TableTop, ended: bool, name: str, findings: list[Finding]
) -> tuple[list[int], list[str]]:
    """Return rows and lines of one width; drop a truncated last line."""
    numbered, width, separator = top.data, len(top.names), top.separator
    rows, lines = [], []
    amid: Lines = []
    numeric = are_data(fields_of(numbered[0][1], separator))
    # Sentences of a receiver on the same line as the rows of a board.
    other = not SENTENCE.fullmatch(numbered[0][1].strip())
    for k, (row, line) in enumerate(numbered):
        last = k == len(numbered) - 1
        if last and k and _was_cut(line, numbered[max(0, k - 20) : k], top, ended):
            add_note(findings, "io.last-line-cut-left-out", file=name, row=row)
            break
        count = _count(line, separator)
        bare = line.rstrip(" \r\n")
        if count == width + 1 and separator and bare.endswith(separator):
            line, count = bare[:-1], width
        odd = count != width
        if other and line.lstrip().startswith("$") and SENTENCE.fullmatch(line.strip()):
            amid.append((row, line))
            continue
        # Names once more, as where logs were joined.
        first = line.lstrip(" \t\"'")[:1]
        if odd or (numeric and (first.isalpha() or first in f"{MARKS}_/")):
            fields = fields_of(line, separator)
            if (odd and is_comment(line)) or not any(is_data(f) for f in fields if f):
                amid.append((row, line))
                continue
        if odd:
            _refuse_kinds(numbered, separator, name)
            doubled = separator == "," and count >= 2 * width - 1 > 1
            raise DataError(
                "io.csv-decimal-commas" if doubled else "io.csv-field-count",
                file=name,
                row=row,
                count=count,
                width=width,
            )
        rows.append(row)
        lines.append(line)
    if amid:
        row, line = amid[0]
        if not rows:  # its separator is not that of the header
            count = _count(line, separator)
            raise DataError("io.csv-field-count", file=name, row=row, count=count, width=width)
        add_note(
            findings,
            "io.comments-among-rows",
            file=name,
            row=row,
            count=len(amid),
            first=line.strip()[:60],
        )
    return rows, lines


#: Fewest rows of a block, on average, that blank lines set apart from the next.
BLOCK = 10


def _in_blocks(rows: list[int], top: TableTop, name: str) -> Finding | None:
    """A warning of rows without stamps in blocks between blank lines: recordings of their own."""
    breaks = [k for k, (a, b) in enumerate(itertools.pairwise(rows), 1) if b > a + 1]
    if not breaks or len(rows) < BLOCK * (len(breaks) + 1):
        return None
    if any(read_name(n).quantity == "time" for n in top.names):
        return None
    return Finding(
        "io.rows-in-blocks",
        severity="warning",
        file=name,
        row=rows[breaks[0]],
        count=len(breaks) + 1,
        size=breaks[0],
    )


#: Most kinds of rows that a message lists.
KINDS = 8


def _refuse_kinds(numbered: Lines, separator: str | None, name: str) -> None:
    """Refuse rows whose first field says of which kind they are, each kind with its own width."""
    widths: dict[str, set[int]] = {}
    rows: Counter[str] = Counter()
    for _, line in numbered:
        kind = fields_of(line, separator)[0]
        widths.setdefault(kind, set()).add(_count(line, separator))
        rows[kind] += 1
        if len(widths) > KINDS:
            return
    repeated = len(numbered) >= 3 * len(widths)  # stamps are not
    if repeated and len(widths) > 1 and all(len(counts) == 1 for counts in widths.values()):
        raise _of_kinds(name, rows, {kind: min(counts) for kind, counts in widths.items()})


def _of_kinds(name: str, rows: Mapping[str, int], widths: Mapping[str, int]) -> DataError:
    kinds = [f"{kind!r} ({rows[kind]} rows of {widths[kind]} fields)" for kind in widths]
    return DataError("io.csv-rows-of-kinds", file=name, kinds=kinds)


def _refuse_alike(rows: Counter[str], width: int, name: str) -> None:
    """Refuse rows without names whose first field is one of some words: each is of a kind."""
    words = all(word[:1].isalpha() for word in rows)
    if words and 1 < len(rows) <= KINDS and min(rows.values()) >= 3:
        raise _of_kinds(name, rows, dict.fromkeys(rows, width))


def _count(line: str, separator: str | None) -> int:
    if separator is None or '"' in line:
        return len(fields_of(line, separator))
    return line.count(separator) + 1


def _was_cut(line: str, before: Lines, top: TableTop, ended: bool) -> bool:
    """Whether the last line ends within a field, or before the last one."""
    width, separator = len(top.names), top.separator
    fields = fields_of(line, separator)
    if len(fields) < width:
        return True
    if ended or len(fields) != width:
        return False
    ends = [fields_of(other, separator)[-1] for _, other in before]
    if not all(NUMBER_OR_NAN.fullmatch(e) for e in ends):
        return False
    # Without a line end the last number may have lost digits; it shows if all others have more.
    digits = [len(e.replace(",", ".").partition(".")[2]) for e in (*ends, fields[-1])]
    short = digits[-1] < min(digits[:-1], default=0)
    return not NUMBER_OR_NAN.fullmatch(fields[-1]) or short


def _parse(lines: list[str], count: int, separator: str | None, name: str) -> Columns:
    """Parse the lines under the header, each number to the nearest double."""
    line = next((line for line in lines if "," in line), "")
    numbers = [f for f in fields_of(line, separator) if NUMBER_OR_NAN.fullmatch(f)]
    comma = any("," in n for n in numbers) and not any("." in n for n in numbers)
    decimal = "," if comma else "."
    if separator is None:
        lines = ["\t".join(line.split()) for line in lines]
    elif any(line[:1] == " " for line in lines[:JUDGED]):
        lines = [line.lstrip(" ") for line in lines]
    if separator and separator.strip() and any(f"{separator} " in line for line in lines[:JUDGED]):
        # Blanks beside a separator do not belong to a field.
        around = re.compile(rf"[ \t]*{re.escape(separator)}[ \t]*")
        lines = [line if '"' in line else around.sub(separator, line) for line in lines]
    # Arrow reads 0xFFF0 as a number, but its meaning for a sensor is unknown.
    odd = next((line for line in lines if "0x" in line or "0X" in line), "")
    hexadecimal = [k for k, f in enumerate(fields_of(odd, separator)) if HEXADECIMAL.fullmatch(f)]
    body = "\n".join(lines).encode()
    # With blanks as separators, a quote is an ordinary character.
    quote: str | Literal[False] = '"' if separator else False
    between = separator or "\t"
    try:
        return parsed(body, count, between, decimal=decimal, quote=quote, text=hexadecimal)
    except ValueError as error:
        raise DataError(
            "io.rows-cannot-taken-apart", file=name, splitlines=str(error).splitlines()[0]
        ) from None


# The log of a table, with what the lines above it state.


_META = re.compile(r"(?:[#%]|//)\s*(\w+)\s*:\s*(.+?)\s*$")
#: Beginning of a name, to the last sign in it.
_SHARED = re.compile(r".+[\s_\-/:.]")


def _is_gyro(name: str) -> bool:
    said = read_name(name)
    return str(said.quantity).startswith("gyro_") and said.loose != UNKNOWN_WORDS


def _log(
    top: TableTop,
    name: str,
    files: tuple[Path, ...],
    columns: Columns,
    rows: NDArray[np.int64],
    findings: list[Finding],
) -> RawLog:
    """Make the log of these columns, with what the lines above them state."""
    # What all names begin with, as that of a device, is left out if it hides the sensors.
    # A separator that ends each row makes a column without a name.
    named = [name for name in top.names if name] or [""]
    pairs = zip(min(named), max(named), strict=False)
    same = itertools.takewhile(lambda pair: pair[0] == pair[1], pairs)
    shared = _SHARED.match("".join(letter for letter, _ in same))
    if shared is not None and not any(map(_is_gyro, named)):
        short = {name: name[shared.end() :] for name in top.names}
        if all(map(short.get, named)) and sum(map(_is_gyro, short.values())) == 3:
            top.names = list(short.values())
            top.units = {short[name]: unit for name, unit in top.units.items()}
    held = dict(zip(top.names, columns, strict=True))
    if top.names[0] == "column 1" and columns[0].dtype.kind == "O":
        _refuse_alike(Counter(columns[0].astype(str).tolist()), len(columns), name)
    said = [line[:LONGEST] for line in top.above]
    held = _vectors_apart(_without_units(held, top.units))
    held = with_one_clock(held, top.units, findings, name)
    held, rows = _one_row_a_stamp(held, rows)
    return RawLog(
        name=name,
        files=files,
        columns=held,
        rows=rows,
        units=top.units,
        triad_units=stated_units(said, held),
        rate=stated_rate(said),
        above=said,
        findings=findings,
        # Comments of the form ``# key: value``, as strapdown writes them.
        **stated_by({m[1]: m[2] for line in said if (m := _META.match(line))}),
    )


# Cells that hold a vector, and tables of one value a row.


_DECIMAL = rf"[+-]?{UNSIGNED}"
_CELL = re.compile(rf"\s*[\[({{]\s*{_DECIMAL}(?:\s*[,;]\s*|\s+){_DECIMAL}.*[\])}}]\s*")
_WITH_UNIT = re.compile(rf"\s*({_DECIMAL})\s*([^\s\d.,;:+-][^\d,;:]{{0,10}}(?:\d\)?)?)\s*")
#: Most parts of a vector, and most names of values.
VECTOR, VALUES = 16, 64
_VALUE_NAMES = ("value", "val", "values", "reading", "data", "wert", "valor")


def _without_units(held: dict[str, NDArray[Any]], units: dict[str, str]) -> dict[str, NDArray[Any]]:
    """Take one unit off all cells of a column, ``0.01 sec``, and put it among the units.

    A capital may be the letter of a hemisphere: ``48.5S``.
    """
    out = dict(held)
    for name, values in held.items():
        first = _WITH_UNIT.fullmatch(str(values[0])) if values.dtype.kind == "O" else None
        if first is None or first[2] in ("N", "S", "E", "W") or unit_of(first[2]) is None:
            continue
        cells = [_WITH_UNIT.fullmatch(str(v)) for v in values]
        numbers = [float(m[1]) for m in cells if m and m[2] == first[2]]
        if len(numbers) == len(cells):
            out[name], units[name] = np.array(numbers), first[2]
    return out


def _vectors_apart(held: dict[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """Take apart columns whose cells are vectors, ``[0.1, 0.2, 0.3]``."""
    out: dict[str, NDArray[Any]] = {}
    for name, values in held.items():
        out[name] = values
        if values.dtype.kind != "O" or not values.size or not _CELL.fullmatch(str(values[0])):
            continue
        cells = [re.split(r"[\s,;]+", str(v).strip(" \t[](){}")) for v in values]
        width = len(cells[0])
        with suppress(ValueError):
            if width <= VECTOR and all(len(cell) == width for cell in cells):
                parts = np.array(cells, dtype=np.float64)
                del out[name]
                out |= {f"{name}[{k}]": parts[:, k] for k in range(width)}
    return out


def _one_row_a_stamp(
    held: dict[str, NDArray[Any]], rows: NDArray[np.int64]
) -> tuple[dict[str, NDArray[Any]], NDArray[np.int64]]:
    """Put values that have a row each, under the name of their axis, into one row a stamp.

    The names are in a column, ``gyro_x``, or in two, the sensor and its axis. Columns of one value
    say nothing, as those of an export of InfluxDB.
    """
    values = [n for n in held if n.strip(" _").lower() in _VALUE_NAMES]
    if len(values) != 1:
        return held, rows
    vary = {n: v for n, v in held.items() if ((v != v[:1]) & (v == v)).any()}
    clocks = [n for n in vary if read_name(n).quantity == "time"]
    texts = [n for n, v in vary.items() if v.dtype.kind == "O" and n not in clocks]
    if len(clocks) != 1 or len(texts) not in (1, 2) or len(vary) > 5:
        return held, rows
    words = [held[n].astype(str) for n in texts]
    names = words[0] if len(words) == 1 else np.char.add(np.char.add(words[0], " "), words[1])
    known, of = np.unique(names, return_inverse=True)
    quantities = {str(read_name(str(n)).quantity) for n in known[:VALUES]}
    if known.size > VALUES or not {"gyro_x", "gyro_y", "gyro_z"} <= quantities:
        return held, rows
    clock = held[clocks[0]]
    stamps, first, at = np.unique(
        clock.astype(str) if clock.dtype.kind == "O" else clock,
        return_index=True,
        return_inverse=True,
    )
    # In the order of the file, which of texts is not theirs.
    order = np.argsort(first)
    first, at = first[order], np.argsort(order)[at]
    if np.unique(at * known.size + of).size < at.size:
        return held, rows  # a stamp has two values of one name
    table = np.full((known.size, stamps.size), np.nan)
    table[of, at] = held[values[0]]
    return {clocks[0]: clock[first]} | {str(n): table[k] for k, n in enumerate(known)}, rows[first]


#: Rows that are written at a time.
WRITTEN = 1 << 14


def write(path: Path, columns: dict[str, NDArray[Any]], comments: dict[str, str]) -> None:
    """Write columns as text, with the fewest digits that reproduce each number exactly.

    `columns` ((n,)): names with their unit, as ``gyro_x_rad_s``. `comments`: written at the top as
    ``# key: value``.
    """
    import pyarrow as pa
    import pyarrow.csv as pa_csv

    head = [f"# {key}: {value}" for key, value in comments.items()]
    head.append(",".join(columns))
    with path.open("wb") as stream:
        stream.write(("\n".join(head) + "\n").encode())
        for begin in range(0, len(next(iter(columns.values()), ())), WRITTEN):
            rows = {k: pa.array(v[begin : begin + WRITTEN]) for k, v in columns.items()}
            pa_csv.write_csv(pa.table(rows), stream, pa_csv.WriteOptions(include_header=False))
            for values in columns.values():
                let_go(values)

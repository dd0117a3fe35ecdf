"""Text tables: commas, semicolons, tabs, bars or blanks, with or without names of columns.

A table without any oddity is read at once (`text_columns`), anything else line by line: text above
and among the rows, quotes, decimal commas, separators that end rows, a last line that was cut.
Lines of labelled values (``ax: 0.1, ay: 0.2``) and of a serial monitor (``14:22:07.010 -> 1,2``)
are rows, too.
"""

from __future__ import annotations

import codecs
import itertools
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from contextlib import suppress
from datetime import datetime
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import DataError, Finding, add_note
from strapdown.formats.arrays import is_date, is_day_time, is_stamp
from strapdown.formats.columns import UNKNOWN_WORDS, read_name, split_brackets
from strapdown.formats.recording import RawLog, stated_by
from strapdown.formats.signs import HEAD, Signs, first_bytes
from strapdown.formats.text_columns import NULLS, Columns, columns_at_once, parsed
from strapdown.tables.on_disk import let_go
from strapdown.units import ACCEL_UNITS, GYRO_UNITS, MAG_UNITS, OF_LOGS, unit_of

SUFFIXES = (".csv", ".txt", ".tsv", ".dat")
COMMENTS = ("#", "%", "//", "!")
_MARKS = "#%/;!"
_SEPARATOR = re.compile(r"sep=.?", re.I)
#: A number, with a point or a comma.
NUMBER = re.compile(r"[+-]?(\d+([.,]\d*)?|[.,]\d+)([eE][+-]?\d+)?")
_NUMBER = re.compile(rf"{NUMBER.pattern}|[+-]?nan|[+-]?inf(inity)?", re.I)
# Numbers with a decimal comma, separated by blanks.
_COMMAS = re.compile(r"[+-]?\d+(,\d+)?([eE][+-]?\d+)?(\s+[+-]?\d+(,\d+)?([eE][+-]?\d+)?)+")
_UNIT = re.compile(r"\s*[\[(].*")
_REMARK = re.compile(r"\s*\([^()]*\)|\s*\[[^\[\]]*\]")
# A unit in brackets; those within it, as of m/(s^2), are its own.
_ENCLOSED = re.compile(r"^[\[({]\s*(.*?)\s*[\])}]$")
_CALIBRATED = {"cal", "raw", "uncal"}
_NO_UNIT = ("-", "--", "none", "1")
_HEX = re.compile(r"[+-]?0x[0-9a-f]+", re.I)
#: Lines at the top of a text in which its rows of numbers are searched, their characters, and the
#: fields of each that are judged.
SEARCHED, SEARCHED_TEXT, JUDGED = 400, 1 << 20, 200
#: Lines below one with a word and a number in which the names of the columns are searched.
PREAMBLE = 10
#: Most fields of a row; no log has more, and a damaged line may.
MOST_COLUMNS = 10_000
# Line breaks of Python that are none of an editor.
_BREAKS = re.compile("[\x0b\x0c\x1c\x1d\x1e\x85\u2028\u2029]|\r(?!\n)")
Lines = list[tuple[int, str]]


def _begins_with_rows(path: Path) -> bool:
    """Whether the first lines are rows of data under any name."""
    data = first_bytes(path, HEAD)
    if not data.strip():
        return False
    try:
        text, _ = decoded(data[: data.rfind(b"\n") + 1] or data, path.name)
    except DataError:
        return False
    lines = _rewritten(_numbered(text)[0])[-21:]
    rows = [fields_of(line, separator_of(line)) for _, line in lines[:-1] or lines]
    return len(rows) > 2 and all(len(row) > 2 and are_data(row) for row in rows)


detect = Signs(named=SUFFIXES, also=_begins_with_rows)


def read(path: Path) -> RawLog:
    """Read the columns of a text table.

    Columns that hold anything but numbers are left as text. Lines at the top that begin with ``#``,
    ``%``, ``//``, ``!`` or ``;`` are comments; the comment ``# sampling: mean`` is understood.
    """
    files = (path,)
    return _at_once(path, path.name, files) or _line_by_line(path.read_bytes(), path.name, files)


def parse(
    data: bytes, name: str, files: tuple[Path, ...], kinds: Sequence[str] = OF_LOGS
) -> RawLog:
    """Read the columns of a text table from a file or a member of an archive.

    `name`: for messages. `files`: file that holds it. `kinds`: of units in a row under the names.
    """
    return _at_once(data, name, files, kinds) or _line_by_line(data, name, files, kinds)


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
        text, findings = _read_once(head[: head.rfind(b"\n") + 1].decode("utf-8-sig"), name)
    except UnicodeDecodeError:
        return None
    if not text or "\0" in text or _BREAKS.search(text):
        return None
    numbered, comments = _numbered(text, name)
    if not numbered or _rewritten(numbered) is not numbered:
        return None
    top = _Top(numbered, comments, name, kinds)
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
    columns = columns_at_once(source, len(top.names), top.separator, start)
    # A line of text between rows makes text of every column.
    if columns is None or all(c.dtype.kind == "O" for c in columns):
        return None
    # Nor are blanks beside a separator part of a word.
    if any(c.dtype.kind == "O" for c in columns) and f"{top.separator} " in text:
        return None
    return top.log(name, files, columns, np.arange(first, first + columns[0].size), findings)


def _line_by_line(
    data: bytes, name: str, files: tuple[Path, ...], kinds: Sequence[str] = OF_LOGS
) -> RawLog:
    text, findings = decoded(data, name)
    numbered, comments = _numbered(text, name)
    if not numbered:
        raise DataError("io.file-holds-comments-alone" if comments else "io.file-empty", file=name)
    top = _Top(_rewritten(numbered), comments, name, kinds)
    if not top.data:
        raise DataError("io.csv-without-rows", file=name, row=numbered[0][0])
    ended = text.endswith(("\n", "\r"))
    rows, lines = _whole_lines(top, ended, name, findings)
    if (several := _in_blocks(rows, top, name)) is not None:
        findings.append(several)
    columns = _parse(lines, len(top.names), top.separator, name)
    return top.log(name, files, columns, np.array(rows), findings)


def _numbered(text: str, name: str = "") -> tuple[Lines, list[str]]:
    """Split into non-blank lines with their row numbers, and the comments at the top.

    `name`: for messages. DataError: one of the first lines has more than `MOST_COLUMNS` fields,
    which no log has; no pattern is searched in it.
    """
    numbered = [(row, line) for row, line in enumerate(text.splitlines(), 1) if line.strip()]
    comments = [line for _, line in itertools.takewhile(lambda n: is_comment(n[1]), numbered)]
    numbered = numbered[len(comments) :]
    for row, line in numbered[: SEARCHED if name else 0]:
        if len(line) < 2 * MOST_COLUMNS:
            continue
        count = 1 + max(line.count(separator) for separator in ",;\t|")
        count = count if count > MOST_COLUMNS else len(line.split(None, 2 * MOST_COLUMNS))
        if count > MOST_COLUMNS:
            raise DataError(
                "io.csv-too-many-columns", file=name, row=row, count=count, most=MOST_COLUMNS
            )
    return numbered, comments


# Lines that are rows in another form.


#: Time of arrival that the serial monitor of a development environment puts before a line.
_ARRIVAL = re.compile(r"(\d\d:\d\d:\d\d\.\d+) -> ?")
# A sentence with its name and checksum: "$VNYMR,1.5,…*69".
_SENTENCE = re.compile(r"(\$\w+)(,[^*]*)\*[0-9A-Fa-f]{2}\s*")
# "IMU: 20, 0.1, …": one word before the numbers of every row.
_TAGGED = re.compile(r"\s*([A-Za-z]\w*):[ \t]*(?=[+-]?[\d.][^:=]*$)")
# "ax: 0.12 g," or "ax = 0.12": a name, its value, and its unit where a sign ends the field.
_PLAIN = r"[+-]?\d+(?:\.\d*)?(?:[eE][+-]?\d+)?"
_NAME = r"[A-Za-z_][\w ./()\[\]^²³°-]{0,40}?"
_LABELLED = re.compile(
    rf"\s*({_NAME})\s*[:=]\s*([^\s,;|=]+)"
    r"(?:[ \t]*([^\s\d,;|:=][^\s,;|:=]*)(?=[ \t]*[,;|]|$))?[ \t]*[,;|]?"
)
# "Accel (m/s^2): 0.31, -0.12, 9.71": a name and its three values.
_VECTOR = re.compile(
    rf"({_NAME})\s*[:=]\s*[\[(]?"
    + r"\s*[,; ]\s*".join([rf"({_PLAIN})"] * 3)
    + r"(?=\s*([\])|;]|$))"
)
# A number before the first name, as the stamp in "20518269: |Acc X:-0.22".
_LEADING = re.compile(rf"\s*({_PLAIN})\s*[:,;|]\s*\|?(?=\s*[A-Za-z_])")
#: Longest line above the rows that is understood, and of labelled values.
LONGEST = 2000
#: Name of a number before the first label, and of one that counts lines or is beside a clock.
LEADING, COUNTED = "time", "number"
#: Fewest labelled values of a line that is taken for a row.
LABELS = 3


def _rewritten(numbered: Lines) -> Lines:
    """Return lines of labelled values, or with the time of arrival before them, as rows.

    The same object if there are none.
    """
    top = numbered[:SEARCHED]
    # A semicolon that ends a line of commas, as of a program's statement.
    if all(line.count(";") == 1 and "," in line and line.rstrip()[-1] == ";" for _, line in top):
        numbered = [(row, line.rstrip().removesuffix(";")) for row, line in numbered]
        top = numbered[:SEARCHED]
    sentences = {m[1] if m else "" for m in (_SENTENCE.fullmatch(line) for _, line in top)}
    if len(sentences) == 1 and "" not in sentences:
        numbered = [(row, _SENTENCE.sub(r"\1\2", line)) for row, line in numbered]
        numbered = with_names(numbered, [str(s) for s in sentences])
        top = numbered[:SEARCHED]
    tags = {m[1] if m else "" for m in (_TAGGED.match(line) for _, line in top)}
    if len(tags) == 1 and "" not in tags:
        # Three numbers are a vector of that name.
        between = separator_of(top[0][1])
        if between is not None and top[0][1].count(between) > 2:
            numbered = [(row, _TAGGED.sub(rf"\1{between}", line)) for row, line in numbered]
            top = numbered[:SEARCHED]
    stamped = sum(_ARRIVAL.match(line) is not None for _, line in top)
    if 2 * stamped > len(top):
        stamps = [_ARRIVAL.match(line) for _, line in numbered]
        bare = [
            (row, line[m.end() :] if m else line)
            for m, (row, line) in zip(stamps, numbered, strict=True)
        ]
        rows = _unlabelled(bare)
        by_row = {row: m[1] for m, (row, _) in zip(stamps, numbered, strict=True) if m}
        return [(row, _with_arrival(line, by_row.get(row))) for row, line in rows if line.strip()]
    joined = one_line_a_sample(numbered)
    return _unlabelled(numbered) if joined is numbered else joined


def _with_arrival(line: str, stamp: str | None) -> str:
    """Put the time of arrival into the first field; it is the clock of a table without one."""
    separator = separator_of(line)
    fields = fields_of(line, separator)
    if not are_data(fields):
        other = any(read_name(name).quantity == "time" for name in fields)
        stamp = "arrival" if other else "time"
    return line if stamp is None else f"{stamp}{separator or ' '}{line.lstrip()}"


def _unlabelled(numbered: Lines) -> Lines:
    """Return lines of labelled values as rows under their labels."""
    usual = Counter(
        names for _, line in numbered[:SEARCHED] if (names := _labels(line)[0])
    ).most_common(1)
    if not usual or 2 * usual[0][1] <= len(numbered[:SEARCHED]):
        return numbered
    names, first = usual[0][0], True
    stamps = [float(m[1]) for _, line in numbered[:SEARCHED] if (m := _LEADING.match(line))]
    count = all(b - a == 1.0 for a, b in itertools.pairwise(stamps)) and names[0] == LEADING
    out: Lines = []
    for row, line in numbered:
        said, values = _labels(line)
        if said and said == names[: len(said)]:
            if first:
                out.append((row, "\t".join((COUNTED, *names[1:]) if count else names)))
                first = False
            line = "\t".join(values)
        out.append((row, line))
    return out


def _labels(line: str) -> tuple[tuple[str, ...], list[str]]:
    """Return labels with units, and values, of a line that has little else; or empty."""
    if len(line) >= LONGEST:
        return (), []
    stamp = _LEADING.match(line)
    line = _VECTOR.sub(_by_axis, line[stamp.end() :] if stamp else line)
    found = _LABELLED.findall(line)
    if len(found) < LABELS or _LABELLED.sub("", line).strip():
        return (), []
    names = [f"{name} [{unit}]" if unit else name for name, _, unit in found]
    values = [value for _, value, _ in found]
    if stamp:
        timed = any(read_name(name).quantity == "time" for name in names)
        names, values = [COUNTED if timed else LEADING, *names], [stamp[1], *values]
    return tuple(names), values


def _by_axis(vector: re.Match[str]) -> str:
    """Write three values under one name as three names with a value each."""
    bare, unit = split_brackets(vector[1])
    ends = [f" ({unit})" if unit else ""] * 3
    return ", ".join(
        f"{bare.strip()} {axis}{end}: {value}"
        for axis, end, value in zip("xyz", ends, vector.groups()[1:4], strict=True)
    )


#: Most lines between names and rows of which the names have another separator.
ABOVE = 4


# Texts of serial monitors: several lines a sample, as a board prints its sensors one below the
# other, and sentences whose fields their maker defines.


#: Most lines of a sample, and the longest line that is understood.
MOST_TURNS, LONGEST_LABELLED = 8, 400
#: Fewest labelled values of a line of a sensor, and lines of sensors of a sample.
AXES, SENSORS = 3, 2
_DECIMAL = r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?"
# "Acceleration X: 0.08," and, at the end of a line, its unit: "Z: 9.83 m/s^2".
_VALUE = re.compile(rf"\s*([A-Za-z][\w ]{{0,40}}?)\s*[:=]\s*({_DECIMAL})[ \t]*[,;|]?")
_UNIT_BEHIND = re.compile(r"\s*([^\s\d,;|:=][^,;|:=]{0,20}?)\s*")


def _labelled(line: str) -> tuple[tuple[str, ...], list[str]]:
    """Return the names, with the unit at the end, and the values of a line; or its letters."""
    values, end = [], 0
    if len(line) <= LONGEST_LABELLED:
        while m := _VALUE.match(line, end):
            values.append((m[1], m[2]))
            end = m.end()
    rest = line[end:].strip()
    unit = unit_of(m[1]) if (m := _UNIT_BEHIND.fullmatch(rest)) else None
    if not values or (rest and unit is None):
        return (re.sub(r"[^A-Za-z]", "", line[:LONGEST_LABELLED]),), []
    # "Accel X: 1, Y: 2, Z: 3": the name is said once.
    first, _, axis = values[0][0].rpartition(" ")
    names = [
        n if len(n) > 1 or not first or axis not in ("X", "x") else f"{first} {n}"
        for n, _ in values
    ]
    return tuple(f"{n} [{unit}]" if unit else n for n in names), [v for _, v in values]


def one_line_a_sample(numbered: Lines) -> Lines:
    """Return lines of labelled values that come in turns as one row a sample, under their names.

    The same object if they do not: a sample has two lines of three values at least, and each is
    followed by the next.
    """
    said = [_labelled(line) for _, line in numbered[:SEARCHED]]
    keys = [names for names, _ in said]
    period = next(
        (k for k in range(1, min(MOST_TURNS, len(keys) - 1) + 1) if keys[k] == keys[0]), 0
    )
    if period < SENSORS or len(keys) < 3 * period:
        return numbered
    turns = keys[:period]
    sensors = [k for k, (_, values) in enumerate(said[:period]) if len(values) >= AXES]
    regular = sum(key == turns[k % period] for k, key in enumerate(keys))
    if len(sensors) < SENSORS or len(set(turns)) < period or 10 * regular < 9 * len(keys):
        return numbered
    held = [k for k in range(period) if said[k][1]]
    out: Lines = [(numbered[0][0], "\t".join(name for k in held for name in turns[k]))]
    sample: list[list[str]] = []
    begin = 0
    for row, line in numbered:
        names, values = _labelled(line)
        if names == turns[0]:
            sample, begin = [], row
        if len(sample) < period and names == turns[len(sample)]:
            sample.append(values)
        else:
            sample = []  # a line is lost: the sample is not whole
        if len(sample) == period:
            out.append((begin, "\t".join(v for part in sample for v in part)))
            sample = []
    return out


_SENSED = [
    f"{name}_{axis} [{unit}]"
    for name, unit in (("mag", "gauss"), ("accel", "m/s2"), ("gyro", "rad/s"))
    for axis in "xyz"
]
_YAW = ["yaw [deg]", "pitch [deg]", "roll [deg]"]
#: Fields of sentences (VectorNav, Interface Control Documents of VN-100 and VN-200).
SENTENCES = {
    "$VNIMU": [*_SENSED, "temperature", "pressure"],
    "$VNYMR": [*_YAW, *_SENSED],
    "$VNQMR": ["quat_x", "quat_y", "quat_z", "quat_w", *_SENSED],
    "$VNMAR": _SENSED,
    "$VNYBA": [*_YAW, *[f"linear {n}" for n in _SENSED[3:6]], *_SENSED[6:]],
}


def with_names(numbered: Lines, sentences: Sequence[str]) -> Lines:
    """Put the names of its fields over the rows of one known sentence."""
    names = SENTENCES.get(sentences[0]) if len(sentences) == 1 else None
    if names is None or not numbered or numbered[0][1].count(",") != len(names):
        return numbered
    return [(numbered[0][0], ",".join(["sentence", *names])), *numbered]


# The top of a table: where rows of numbers begin, and what the lines above them say.


class _Top:
    """Names, units and separator of a table, and the lines from its first row on.

    Lines above the names are a preamble. Two lines of names are a group and its members, as
    ``Gyroscope,,`` over ``x,y,z``.

    `numbered`: lines with their rows, without the comments at the top. `name`: for messages.
    `kinds`: kinds of units that a row under the names may have.
    """

    def __init__(
        self, numbered: Lines, comments: list[str], name: str, kinds: Sequence[str]
    ) -> None:
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
            names = self._behind_a_word(near[0], width) or self._names_with_commas(width)
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
            grouped = over is not None and len(set(bare)) < len(bare) and _are_groups(over)
            if grouped and over is not None:
                names = [f"{g} {n}".strip() for g, n in zip(_filled(over), names, strict=True)]
            del self.above[len(self.above) - 1 - bool(below) - grouped - len(marks) :]
        count: Counter[str] = Counter()
        self.names = []
        for name in names:
            count[name] += 1
            self.names.append(name if count[name] == 1 else f"{name} ({count[name]})")
        if below:
            self.units = {n: u for n, u in zip(self.names, below, strict=True) if u}

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

    def _names_with_commas(self, width: int) -> list[str] | None:
        """Names that commas separate, over rows that blanks do, as POSPac exports them."""
        if self.separator is not None:
            return None
        lines = [fields_of(line, ",") for line in reversed(self.above[-ABOVE:])]
        fits = (n for n in lines if len(n) == width and all(n) and not are_data(n))
        return next(fits, None)

    def _units_in_comment(self, width: int, kinds: Sequence[str]) -> list[str] | None:
        """Units in the last comment, where the one before it has the names."""
        if len(self.above) < 2 or not all(map(is_comment, self.above[-2:])):
            return None
        if _above(self.above[:-1], width, self.separator) is None:
            return None
        return _units(self.above[-1].strip().lstrip(_MARKS), self.separator, width, kinds)

    def log(
        self,
        name: str,
        files: tuple[Path, ...],
        columns: Columns,
        rows: NDArray[np.int64],
        findings: list[Finding],
    ) -> RawLog:
        """Make the log of these columns, with what the lines above them state."""
        # What all names begin with, as that of a device, is left out if it hides the sensors.
        first, last = min(self.names), max(self.names)
        same = itertools.takewhile(lambda pair: pair[0] == pair[1], zip(first, last, strict=False))
        shared = _SHARED.match("".join(letter for letter, _ in same))
        if shared is not None and not any(map(_is_gyro, self.names)):
            short = {name: name[shared.end() :] for name in self.names}
            if all(short.values()) and sum(map(_is_gyro, short.values())) == 3:
                self.names = list(short.values())
                self.units = {short[name]: unit for name, unit in self.units.items()}
        held = dict(zip(self.names, columns, strict=True))
        said = [line[:LONGEST] for line in self.above]
        return RawLog(
            name=name,
            files=files,
            columns=one_clock_of_parts(held, self.units),
            rows=rows,
            units=self.units,
            triad_units=stated_units(said, held),
            rate=stated_rate(said),
            above=said,
            findings=findings,
            # Comments of the form ``# key: value``, as strapdown writes them.
            **stated_by({m[1]: m[2] for line in said if (m := _META.match(line))}),
        )


# Sampling rate and units of sensors, stated in the lines above a table.


_META = re.compile(r"(?:[#%]|//)\s*(\w+)\s*:\s*(.+?)\s*$")
# "Sample Rate:,128,Hz", "// Update Rate: 100.0Hz", "Sampling frequency (Hz): 50", "ODR 100 Hz".
_RATES = (
    re.compile(
        r"(?:sampl\w*|update|output|logging|data)[ _-]*(?:rate|freq\w*)"
        r"(?:\s*[\[(]\s*Hz\s*[\])])?\W*(\d+(?:\.\d*)?)(?!\d|\s*[a-gi-z])",
        re.I,
    ),
    re.compile(r"\b(?:fs|odr)\b\W*(\d+(?:\.\d*)?)\s*Hz\b", re.I),
)
_STEP = re.compile(r"\bdt\s*=\s*(\d*\.?\d+(?:e-?\d+)?)\s*s\b", re.I)
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
_PER_UNIT = re.compile(rf"(\d+(?:\.\d*)?)\s*{_COUNT}\s*(?:/|per)\s*\(?([^\s,;)]+)", re.I)
_PER_COUNT = re.compile(rf"(\d*\.?\d+)\s*([^\s\d,;(]+?)\s*(?:/|per)\s*{_COUNT}", re.I)
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

    ``gyro: deg/s``; counts by ``131 LSB/(deg/s)``, ``0.061 mg/LSB``, or by a range of 16 bits:
    ``±250 deg/s … 16 bit``. Counts are whole numbers; a range says no unit of others.
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
            said = unit_of(m[1].strip(".:")) if (m := _IN.match(rest)) else None
            if unit or said in _KNOWN[triad]:
                out[triad] = unit or str(said)
    return out


def _counts(triad: str, text: str, of_16_bits: bool) -> str | None:
    """Return the unit of raw counts that a text states."""
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


#: Beginning of a name, to the last sign in it.
_SHARED = re.compile(r".+[\s_\-/:.]")


def _is_gyro(name: str) -> bool:
    said = read_name(name)
    return str(said.quantity).startswith("gyro_") and said.loose != UNKNOWN_WORDS


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


def are_data(fields: list[str]) -> bool:
    """Whether half of the fields that are there are data; of many fields, the first."""
    full = [f for f in fields if f][:JUDGED]
    return bool(full) and 2 * sum(map(is_data, full)) >= len(full)


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
    bare = line.strip().lstrip(_MARKS).strip() if is_comment(line) else line
    fields = fields_of(bare, separator)
    if bare != line and len(fields) == width - 1:
        # The mark may be the name of a column of numbers of rows.
        whole = fields_of(line.strip(), separator)
        fields = whole if len(whole) == width and not whole[0].strip(_MARKS) else fields
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


def _filled(fields: list[str]) -> list[str]:
    """Repeat each name over the empty fields after it."""
    out: list[str] = []
    for field in fields:
        out.append(field or (out[-1] if out else ""))
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
        names = _named(comments[-1], separator_of(comments[-1].strip().lstrip(_MARKS)), width)
    if comments and names is None:
        # A remark in brackets may hold separators: "# time_s,force_N (sum of cells, zeroed)".
        names = _named(_REMARK.sub("", comments[-1]), separator, width)
    return None if names is None or any(is_data(n) for n in names) else names


#: Ends of names of a stamp's two numbers, as ROS writes them.
_PARTS = (("secs", "nsecs"), ("sec", "nanosec"), ("sec", "nsec"))


def one_clock_of_parts(
    columns: dict[str, NDArray[Any]], units: dict[str, str]
) -> dict[str, NDArray[Any]]:
    """Join a date and a time of day, and seconds and nanoseconds, that are two columns.

    `units`: the unit of the joined column is added.
    """
    out = dict(columns)
    for whole, part in _PARTS:
        for name in [n for n in out if n == whole or n.endswith((f".{whole}", f"/{whole}"))]:
            other = name.removesuffix(whole) + part
            if other in out and all(columns[n].dtype.kind in "iu" for n in (name, other)):
                out.pop(other)
                held = columns[name].astype(np.int64) * 10**9 + columns[other]
                one = name.removesuffix(whole)[:-1] or "stamp"
                out = {one if n == name else n: held if n == name else c for n, c in out.items()}
                units[one] = "ns"
    for name, texts in _digits_of_clock(columns).items():
        columns = {**columns, name: texts}
        out[name] = texts
    dates = [n for n, c in columns.items() if c.dtype.kind == "O" and is_date(c[0])]
    times = [n for n, c in columns.items() if c.dtype.kind == "O" and is_day_time(c[0])]
    if len(dates) == len(times) == 1 and "date" in dates[0].lower():
        days = out.pop(dates[0])
        out[times[0]] = np.array(
            [
                None if None in both else " ".join(both)
                for both in zip(days, out[times[0]], strict=True)
            ],
            dtype=object,
        )
    return out


def _digits_of_clock(columns: Mapping[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """Return a time of day that is a number of digits, 93015.2, and a date, 20240506, as texts.

    Beside a date its name is enough; alone, a time of day goes on from 59 to 100: as a number of
    seconds it jumps by 40 more at each full minute. A date of six digits becomes none, for it
    leaves open which of them are the year (240506 may be of 2024 or of 2006), and the time counts
    from midnight.
    """
    numeric = [n for n, c in columns.items() if c.dtype.kind in "iuf"]
    dates = [n for n in numeric if _says(n, "date")]
    clocks = [n for n in numeric if _says(n, "time")]
    if len(clocks) != 1 or len(dates) > 1:
        return {}
    of_day = columns[clocks[0]].astype(np.float64)
    whole = np.floor(of_day)
    parts = [whole // 10_000, whole // 100 % 100, whole % 100]
    if not np.isfinite(of_day).all() or any(
        (v < 0).any() or (v >= most).any() for v, most in zip(parts, (24, 60, 60), strict=True)
    ):
        return {}
    second = of_day - 100.0 * (whole // 100)
    if not dates and not _jumps_at_minutes(of_day, 3600.0 * parts[0] + 60.0 * parts[1] + second):
        return {}
    times = [
        f"{int(h):02d}:{int(m):02d}:{s:09.6f}"
        for h, m, s in zip(parts[0], parts[1], second, strict=True)
    ]
    out = {clocks[0]: np.array(times, dtype=object)}
    day = columns[dates[0]].astype(np.float64) if dates else np.empty(0)
    if not dates or not np.isfinite(day).all():
        return out
    texts = [f"{int(d):06d}" for d in day.tolist()]
    try:
        known = {t: datetime.strptime(t, "%Y%m%d") for t in set(texts)}
        sure = all(len(t) == 8 and 2000 <= d.year <= 2045 for t, d in known.items())
    except ValueError:
        sure = False
    # A text of digits is no clock.
    days = [f"{known[t]:%Y-%m-%d}" if sure else t for t in texts]
    return {**out, dates[0]: np.array(days, dtype=object)}


def _jumps_at_minutes(digits: NDArray[np.float64], seconds: NDArray[np.float64]) -> bool:
    """Whether stamps are even as a time of day, and as numbers at full minutes alone not."""
    if digits.size < 3:
        return False
    steps, jumps = np.diff(seconds), np.diff(digits)
    usual = float(np.median(jumps))
    odd = np.abs(jumps - usual) > 0.5 * usual
    even = np.abs(steps - usual) <= 0.5 * usual
    return usual > 0.0 and bool(odd.any() and even[odd].all() and not (odd & ~even).any())


def _says(name: str, word: str) -> bool:
    """Whether a name is a word, alone or with UTC beside it: DATE, utc_time."""
    more = {"date": ("datum", "day", "fecha"), "time": ("hhmmss", "hora", "uhrzeit", "zeit")}
    plain = re.sub(r"[\W_]", "", name.lower())
    said = re.sub("utc|gps|gmt", "", plain)
    return said in (word, word * 2, *more[word]) or (word == "time" and plain in ("utc", "gmt"))


# Lines, fields and numbers.


def decoded(data: bytes, name: str) -> tuple[str, list[Finding]]:
    """Decode the text of a file and collect findings.

    UTF-16 is known by its mark, or by null bytes at every second byte of a text in ASCII.
    DataError: the content is not text.
    """
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return data.decode("utf-16", "replace"), []
    top = data[:4096]
    if b"\0" in top:
        for first, code in ((1, "utf-16-le"), (0, "utf-16-be")):
            if len(top) > 20 and not any(top[first::2]) and b"\0" not in top[1 - first :: 2]:
                return data.decode(code, "replace"), []
        raise DataError("io.text-with-zero-bytes", file=name)
    try:
        return _read_once(data.decode("utf-8-sig"), name)
    except UnicodeDecodeError as error:
        return data.decode("cp1252", "replace"), [
            Finding("io.not-utf-8", file=name, severity="note", byte=error.start)
        ]


#: Codes in which programs read UTF-8 by mistake.
_MISTAKEN = ("cp1252", "cp1251")


def _read_once(text: str, name: str) -> tuple[str, list[Finding]]:
    """Repair lines at the top that are UTF-8 read in another code, and written in UTF-8 again.

    ``Â°/s`` is the degree in cp1252. Letters of no other text make UTF-8 in such a code, so that
    every line with such letters has to, in the same.
    """
    cut = text.find("\n", 1 << 13)
    top = text if cut < 0 else text[:cut]
    odd = [line for line in top.split("\n") if not line.isascii()]
    for code in _MISTAKEN if odd else ():
        try:
            right = {line: _bytes_of(line, code).decode("utf-8") for line in odd}
        except UnicodeError:
            continue
        lines = [right.get(line, line) for line in top.split("\n")]
        wrong, said = odd[0].strip()[:60], right[odd[0]].strip()[:60]
        found = Finding(
            "io.text-decoded-twice", severity="note", file=name, wrong=wrong, right=said
        )
        return "\n".join(lines) + text[len(top) :], [found]
    return text, []


def _bytes_of(line: str, code: str) -> bytes:
    """Encode a line; signs of control that the code does not have are themselves."""
    return b"".join(
        bytes([ord(c)]) if 0x80 <= ord(c) < 0xA0 else c.encode(code, "strict") for c in line
    )


def is_comment(line: str) -> bool:
    """Whether a line is a comment, or Excel's ``sep=;``.

    A semicolon begins a comment where it does not separate fields.
    """
    text = line.strip()
    if text.startswith(COMMENTS) or _SEPARATOR.fullmatch(text):
        return True
    return text.startswith(";") and ";" not in text.lstrip(";")


def is_data(field: str) -> bool:
    """Whether a field is a number, a date, a time of day, or missing; not a name."""
    if len(field) > 64:
        return False
    return field in NULLS or any(p.fullmatch(field) for p in (_NUMBER, _HEX)) or is_stamp(field)


def separator_of(line: str) -> str | None:
    """Return the separator of a line; None for any run of blanks."""
    for candidate in ("\t", ";"):
        if candidate in line:
            return candidate
    # Between bars, a name may hold a comma; between commas, bars mean a norm.
    if line.count("|") > max(1, line.count(",") - 1):
        return "|"
    return None if "," not in line or _COMMAS.fullmatch(line.strip()) else ","


def fields_of(line: str, separator: str | None) -> list[str]:
    """Split a line into fields, without the blanks and quotes around them.

    Quotes that do not close are text.
    """
    if separator is not None and '"' in line:
        import csv

        with suppress(csv.Error):  # of a quote that does not close, or a field too long
            return [f.strip() for f in next(csv.reader([line], delimiter=separator))]
    return [f.strip() for f in line.split(separator)]


def _whole_lines(
    top: _Top, ended: bool, name: str, findings: list[Finding]
) -> tuple[list[int], list[str]]:
    """Return rows and lines of one width; drop a truncated last line."""
    numbered, width, separator = top.data, len(top.names), top.separator
    rows, lines = [], []
    amid: Lines = []
    numeric = are_data(fields_of(numbered[0][1], separator))
    # Sentences of a receiver on the same line as the rows of a board.
    other = not _SENTENCE.fullmatch(numbered[0][1].strip())
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
        if other and line.lstrip().startswith("$") and _SENTENCE.fullmatch(line.strip()):
            amid.append((row, line))
            continue
        # Names once more, as where logs were joined.
        first = line.lstrip(" \t\"'")[:1]
        if odd or (numeric and (first.isalpha() or first in f"{_MARKS}_/")):
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


def _in_blocks(rows: list[int], top: _Top, name: str) -> Finding | None:
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
        raise DataError(
            "io.csv-rows-of-kinds",
            file=name,
            kinds=[
                f"{kind!r} ({rows[kind]} rows of {min(widths[kind])} fields)" for kind in widths
            ],
        )


def _count(line: str, separator: str | None) -> int:
    if separator is None or '"' in line:
        return len(fields_of(line, separator))
    return line.count(separator) + 1


def _was_cut(line: str, before: Lines, top: _Top, ended: bool) -> bool:
    """Whether the last line ends within a field, or before the last one."""
    width, separator = len(top.names), top.separator
    fields = fields_of(line, separator)
    if len(fields) < width:
        return True
    if ended or len(fields) != width:
        return False
    ends = [fields_of(other, separator)[-1] for _, other in before]
    if not all(_NUMBER.fullmatch(e) for e in ends):
        return False
    # Without a line end the last number may have lost digits; it shows if all others have more.
    digits = [len(e.replace(",", ".").partition(".")[2]) for e in (*ends, fields[-1])]
    short = digits[-1] < min(digits[:-1], default=0)
    return not _NUMBER.fullmatch(fields[-1]) or short


def _parse(lines: list[str], count: int, separator: str | None, name: str) -> Columns:
    """Parse the lines under the header, each number to the nearest double."""
    line = next((line for line in lines if "," in line), "")
    numbers = [f for f in fields_of(line, separator) if _NUMBER.fullmatch(f)]
    comma = any("," in n for n in numbers) and not any("." in n for n in numbers)
    decimal = "," if comma else "."
    if separator is None:
        lines = ["\t".join(line.split()) for line in lines]
    if separator and separator.strip() and any(f"{separator} " in line for line in lines[:JUDGED]):
        # Blanks beside a separator do not belong to a field.
        around = re.compile(rf"[ \t]*{re.escape(separator)}[ \t]*")
        lines = [line if '"' in line else around.sub(separator, line) for line in lines]
    # Arrow reads 0xFFF0 as a number, but its meaning for a sensor is unknown.
    odd = next((line for line in lines if "0x" in line or "0X" in line), "")
    hexadecimal = [k for k, f in enumerate(fields_of(odd, separator)) if _HEX.fullmatch(f)]
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

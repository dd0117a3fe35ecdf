"""Text tables: commas, semicolons, tabs, bars or blanks, with or without names of columns.

A table without any oddity is read at once (`text_columns`), anything else line by line: text above
and among the rows, quotes, decimal commas, separators that end rows, a last line that was cut.
Lines of labelled values (``ax: 0.1, ay: 0.2``) and of a serial monitor (``14:22:07.010 -> 1,2``)
are rows, too.
"""

from __future__ import annotations

import codecs
import dataclasses
import itertools
import re
from collections import Counter
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import DataError, Finding, add_note
from strapdown.formats.arrays import is_stamp
from strapdown.formats.clock_columns import with_one_clock
from strapdown.formats.columns import UNKNOWN_WORDS, read_name, split_brackets
from strapdown.formats.recording import RawLog, stated_by
from strapdown.formats.signs import HEAD, Signs, first_bytes
from strapdown.formats.text_columns import NULLS, Columns, columns_at_once, parsed
from strapdown.formats.vocabularies import FIXES
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
    if parts := _sections(numbered):
        return _joined(parts, comments, name, files, kinds, findings)
    top = _Top(_rewritten(numbered), comments, name, kinds)
    if not top.data:
        raise DataError("io.csv-without-rows", file=name, row=numbered[0][0])
    ended = text.endswith(("\n", "\r"))
    rows, lines = _whole_lines(top, ended, name, findings)
    if (several := _in_blocks(rows, top, name)) is not None:
        findings.append(several)
    columns = _parse(lines, len(top.names), top.separator, name)
    return top.log(name, files, columns, np.array(rows), findings)


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
        names = fields_of(numbered[k][1].strip().lstrip(_MARKS), separator_of(below))
        row = fields_of(below, separator_of(below))
        if len(names) == len(row) >= NAMES and are_data(row) and not are_data(names):
            axes = {str(read_name(n).quantity)[-2:] for n in names}
            if (
                {"_x", "_y", "_z"} <= axes
                or set("xyz") <= {n.lower()[:1] for n in names}
                or {"lat", "lon"} <= {read_name(n, FIXES).quantity for n in names}
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
    for title, numbered in parts:
        top = _Top(numbered, comments, name, kinds)
        if title and not any("_" in str(read_name(n).quantity) for n in top.names):
            # x, y and z under the name of their sensor.
            axes = {n: f"{title} {n}" for n in top.names if read_name(n).quantity is None}
            top.units |= {axes[n]: u for n, u in top.units.items() if n in axes}
            top.names = [axes.get(n, n) for n in top.names]
        rows, lines = _whole_lines(top, True, name, findings)
        columns = _parse(lines, len(top.names), top.separator, name)
        logs.append(top.log(name, files, columns, np.array(rows), []))
    if not any(_is_gyro(n) for log in logs for n in log.columns):
        raise DataError(
            "io.csv-sections",
            file=name,
            row=parts[1][1][0][0],
            sections=[", ".join(log.columns) for log in logs],
        )
    add_note(findings, "io.csv-sections-joined", file=name, count=len(logs))
    raw = join(
        [dataclasses.replace(log, name=f"{name}/{k}") for k, log in enumerate(logs, 1)], name, files
    )
    raw.findings[:0] = findings
    return raw


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


# Lines that a program prints: of every sample the same words, with other numbers between them.


#: Time of arrival that the serial monitor of a development environment puts before a line.
_ARRIVAL = re.compile(r"(\d\d:\d\d:\d\d\.\d+) -> ?")
# A sentence with its name and checksum: "$VNYMR,1.5,…*69".
_SENTENCE = re.compile(r"(\$\w+)(,[^*]*)\*[0-9A-Fa-f]{2}\s*")
# "IMU: 20, 0.1, …": one word before the numbers of every row.
_TAGGED = re.compile(r"\s*([A-Za-z]\w*):[ \t]*(?=[+-]?[\d.][^:=]*$)")
# Stamps and numbers between words. A digit of a name or a unit is none, nor one whose sign may be
# a part of the word before it.
_UNSIGNED = r"(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?"
_PRINTED = re.compile(
    r"(?<![\w.])(?:(?:\d{4}-\d\d-\d\d|\d{1,2}/\d{1,2}/\d{4})[ T])?\d{1,2}:\d\d:\d\d"
    r"(?:[.,]\d+(?:,\d{3})?)?(?:Z|[+-]\d\d:?\d\d)?(?![\w:])"
    rf"|(?<![\w.^])[+-]{_UNSIGNED}|(?<![\w.^+-]){_UNSIGNED}|(?<![\w<])[+-]?(?:nan|inf)(?![\w>])",
    re.I,
)
# Signs between the values of a vector, at the end of a label, and between its words.
_BETWEEN = re.compile(r"[,;/| \t-]+")
_LABEL = re.compile(r"[^\W\d_].*[:=]\s*[\[({<]?$|[^\W\d_].*[\[({<]$|[|,;]\s*[A-Za-z][\w ]*$", re.S)
# A number as numpy prints it within a dictionary.
_TYPE = re.compile(r"\b(?:np|numpy)\.\w+\($")
#: Labels of a latitude and a longitude.
_POSITIONS = {"location", "position", "gps", "coordinates", "coords", "latlng", "latlon"}
# A unit in brackets behind a value.
_BEHIND = re.compile(r"\s*[\[(]([^\[\]()]*(?:\([^()]*\))?[^\[\]()]*)[\])]")
#: Between the lines of a sample that are joined.
_NEXT_LINE = " ~ "
_MARKS_OF_PRINT = re.compile(r"([:=\[\](){}<>,;|~]|\s-\s)")
_CLOSED = re.compile(r"[\])}>\s]*")
_FIRST_WORD = re.compile(r"([^\s,;|:=\[\](){}<>]+)(.*)", re.S)
_TRIMMED = " \t'\"*#>-"
#: Levels of the log of a microcontroller's framework, whose stamps are in ms: "I (5310) imu: …".
_LEVELS = {"E", "W", "I", "D", "V"}
#: Longest line above the rows that is understood, and of labelled values.
LONGEST = 2000
#: Name of a number before or behind all labels, and of one that is not a clock.
LEADING, COUNTED = "time", "number"
#: Fewest values of a line that is taken for a row, and of a sample in several lines.
LABELS, OF_SEVERAL = 3, 6
#: Most lines of a sample.
MOST_TURNS = 80
Printed = tuple[tuple[str, ...], list[str]]


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
    return _unlabelled(_one_line_a_sample(numbered))


def _with_arrival(line: str, stamp: str | None) -> str:
    """Put the time of arrival into the first field; it is the clock of a table without one."""
    separator = separator_of(line)
    fields = fields_of(line, separator)
    if not are_data(fields):
        other = any(read_name(name).quantity == "time" for name in fields)
        stamp = "arrival" if other else "time"
    return line if stamp is None else f"{stamp}{separator or ' '}{line.lstrip()}"


def _printed(line: str) -> Printed:
    """Return the texts before, between and behind the numbers of a line, and the numbers.

    Of a text the blanks at its ends are left out: a sign takes the room of one.
    """
    texts, values, end = [], [], 0
    for m in _PRINTED.finditer(line) if len(line) < LONGEST else ():
        texts.append(line[end : m.start()])
        values.append(re.sub(r"(:\d\d\.\d{3}),(\d{3})$", r"\1\2", m[0]))  # 09:59:58.123,456
        end = m.end()
    texts.append(line[end:])
    return tuple(" ".join(text.split()) or text[:1] for text in texts), values


def _one_line_a_sample(numbered: Lines) -> Lines:
    """Join the lines of samples that are printed in several, of which each is followed by the next.

    The same object if they are not.
    """
    keys = [_printed(line)[0] for _, line in numbered[:SEARCHED]]
    period = next((k for k in range(1, min(MOST_TURNS, len(keys))) if keys[k] == keys[0]), 0)
    turns = keys[:period]
    if len(set(turns)) < 2 or len(keys) < 3 * period or len(sum(turns, ())) < period + OF_SEVERAL:
        return numbered
    regular = sum(key == turns[k % period] for k, key in enumerate(keys))
    labels = sum(_LABEL.search(text) is not None for key in turns for text in key[:-1])
    if 10 * regular < 9 * len(keys) or labels < 2:
        return numbered
    out: Lines = []
    sample: Lines = []
    for row, line in numbered:
        key = _printed(line)[0]
        # Where a line is lost, the sample is not whole.
        if key == turns[0] or len(sample) == period or key != turns[len(sample)]:
            sample = []
        if key == turns[len(sample)]:
            sample.append((row, line.strip()))
        if len(sample) == period:
            out.append((sample[0][0], _NEXT_LINE.join(said for _, said in sample)))
    return out


def _unlabelled(numbered: Lines) -> Lines:
    """Return lines of labelled values as rows under their labels.

    The same object unless most lines at the top are such.
    """
    top = [_printed(line) for _, line in numbered[:SEARCHED]]
    usual = Counter(texts for texts, values in top if len(values) >= LABELS).most_common(1)
    if not usual or 2 * usual[0][1] <= len(top):
        return numbered
    texts = usual[0][0]
    names = _names(texts, [values for said, values in top if said == texts])
    if names is None:
        return numbered
    out: Lines = []
    named = False
    for row, line in numbered:
        said, values = _printed(line)
        # A line that was cut has fewer values.
        if values and (said == texts or said[: len(values)] == texts[: len(values)]):
            if not named:
                out.append((row, "\t".join(names)))
                named = True
            line = "\t".join(values)
        out.append((row, line))
    return out


def _names(texts: tuple[str, ...], rows: list[list[str]]) -> list[str] | None:
    """Return names of the values between some texts, with units; None if few have a label.

    ``Gyro: (0.1, 0.2, 0.3) rad/s`` is a vector, ``acc {x: 1, y: 2}`` a name said once. `rows`: of
    values between these texts.
    """
    # Values of one label: a text without a letter before the others.
    runs: list[list[int]] = []
    for k, text in enumerate(texts[:-1]):
        same = k and _BETWEEN.fullmatch(text) and (len(runs[-1]) == 1 or text == texts[k - 1])
        if same and any(letter.isalpha() for letter in texts[runs[-1][0]]):
            runs[-1].append(k)
        else:
            runs.append([k])
    # One value behind those that have a label each, as a stamp that ends a line.
    if len(runs) > 1 and len(runs[-1]) == 2 and max(map(len, runs[:-1])) == 1:
        runs.append([runs[-1].pop()])
    labelled = sum(len(run) for run in runs if _LABEL.search(texts[run[0]]))
    if labelled < LABELS:
        return None
    said: list[tuple[str, str]] = []
    bases = [""]
    for run in [*runs, [len(texts) - 1]]:
        unit, label, base = _label(texts[run[0]], bases[-1])
        # The unit behind the last axis of a name is that of all.
        for k in reversed(range(len(said) if unit else 0)):
            if said[k][1] or bases[k + 1] != bases[-1]:
                break
            said[k] = (said[k][0], unit)
        # 0,12 may be a number with a decimal comma.
        pointed = any("." in row[k] for row in rows for k in run if k < len(row))
        if len(run) % 2 == 0 and texts[run[1]] == "," and not pointed:
            return None
        inside, own = split_brackets(label)
        said.append((inside.strip(), own))
        bases.append(base)
    del said[-1]
    timed = any(read_name(name).quantity == "time" for name, _ in said)
    clocks = [
        j for j, run in enumerate(runs) if not said[j][0] and _is_clock([r[run[0]] for r in rows])
    ]
    # Of several, as of lines that each have one, that of the gyro.
    gyro = next((j for j, (name, _) in enumerate(said) if _is_turn(name)), len(runs))
    clock = next((j for j in reversed(clocks) if j < gyro), clocks[0] if clocks else -1)
    names: list[str] = []
    for j, (run, (name, unit)) in enumerate(zip(runs, said, strict=True)):
        if not name:
            name = LEADING if j == clock and not timed else COUNTED
        elif len(run) == 2 and re.sub(r"\W", "", name).lower() in _POSITIONS:
            names += ["lat", "lon"]
            continue
        elif len(run) == 6 and name.lower() == "a/g":  # as an example for MPU-6050 prints them
            names += [f"{sensor}_{axis}" for sensor in ("accel", "gyro") for axis in "xyz"]
            continue
        elif name in _LEVELS and texts[run[0]].endswith("("):
            name, unit = LEADING, unit or "ms"
        ends = {1: [""], 3: [" x", " y", " z"]}.get(len(run), [f" {k}" for k in range(len(run))])
        names += [f"{name}{end} [{unit}]" if unit else f"{name}{end}" for end in ends]
    return names


def _label(text: str, base: str) -> tuple[str, str, str]:
    """Split a text between two numbers: the unit of the first, the label of the second, its base.

    `base`: of the label before, which an axis alone continues: ``Accel X: 1, Y: 2``.
    """
    unit = ""
    text = _TYPE.sub("", text[_CLOSED.match(text).end() :])  # type: ignore[union-attr]
    if (m := _BEHIND.match(text)) and (found := unit_of(m[1])) is not None:
        unit, text = found, text[m.end() :]
    # A label of one letter may be spelled as a unit: then it is next to the number.
    m = _FIRST_WORD.match(text)
    found = unit_of(m[1]) if m else None
    if m and found and (any(map(str.isalpha, m[2])) or not _LABEL.search(text)):
        unit, text = found, m[2]
    own = ""
    for m in re.finditer(r"\(([^()]*(?:\([^()]*\)[^()]*)*)\)|\[([^\[\]]*)\]", text):
        if (found := unit_of(m[1] or m[2] or "")) is not None:
            own, text = found, text[: m.start()] + " " + text[m.end() :]
            break
    parts = _MARKS_OF_PRINT.split(text)
    words = [
        (mark, part.strip(_TRIMMED))
        for mark, part in zip(["", *parts[1::2]], parts[::2], strict=True)
    ]
    words = [(mark, word) for mark, word in words if any(map(str.isalpha, word))]
    if not words:
        return unit, "", base
    mark, label = words[-1]
    if mark == "=" and " " in label:
        label = label.rpartition(" ")[2]  # behind a value in words: host=pi ax=
    if label.lower() in ("x", "y", "z", "w"):
        base = words[-2][1] if len(words) > 1 else base
        label = f"{base} {label}".strip()
    elif label[-2:-1] == " " and label[-1] in "xX":
        base = label[:-2]
    else:
        base = label
    return unit, f"{label} [{own}]" if own else label, base


def _is_turn(name: str) -> bool:
    """Whether a label is of a gyro, alone or with an axis."""
    return any(str(read_name(n).quantity).startswith("gyro") for n in (name, f"{name} x"))


def _is_clock(values: list[str]) -> bool:
    """Whether values are stamps, or numbers that grow otherwise than by one a line."""
    try:
        steps = np.diff([float(v) for v in values])
    except ValueError:
        return True
    return bool(
        steps.size and np.all(steps >= 0.0) and np.any(steps > 0.0) and np.any(steps != 1.0)
    )


#: Most lines between names and rows of which the names have another separator.
ABOVE = 4


# Sentences whose fields their maker defines.


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
            grouped = len(set(bare)) < len(bare) and (
                over is not None and (_are_groups(over) or _are_runs(over))
            )
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
        # A separator that ends each row makes a column without a name.
        named = [name for name in self.names if name] or [""]
        pairs = zip(min(named), max(named), strict=False)
        same = itertools.takewhile(lambda pair: pair[0] == pair[1], pairs)
        shared = _SHARED.match("".join(letter for letter, _ in same))
        if shared is not None and not any(map(_is_gyro, named)):
            short = {name: name[shared.end() :] for name in self.names}
            if all(map(short.get, named)) and sum(map(_is_gyro, short.values())) == 3:
                self.names = list(short.values())
                self.units = {short[name]: unit for name, unit in self.units.items()}
        held = dict(zip(self.names, columns, strict=True))
        said = [line[:LONGEST] for line in self.above]
        held = _vectors_apart(_without_units(held, self.units))
        held = with_one_clock(held, self.units, findings, name)
        held, rows = _one_row_a_stamp(held, rows)
        return RawLog(
            name=name,
            files=files,
            columns=held,
            rows=rows,
            units=self.units,
            triad_units=stated_units(said, held),
            rate=stated_rate(said),
            above=said,
            findings=findings,
            # Comments of the form ``# key: value``, as strapdown writes them.
            **stated_by({m[1]: m[2] for line in said if (m := _META.match(line))}),
        )


# Cells that hold a vector, and tables of one value a row.


_DECIMAL = rf"[+-]?{_UNSIGNED}"
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

    The names are in a column, ``gyro_x``, or in two, the sensor and its axis.
    """
    clocks = [n for n in held if read_name(n).quantity == "time"]
    texts = [n for n, v in held.items() if v.dtype.kind == "O" and n not in clocks]
    values = [n for n in held if n.strip().lower() in _VALUE_NAMES]
    if len(clocks) != 1 or len(values) != 1 or len(texts) not in (1, 2) or len(held) > 5:
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

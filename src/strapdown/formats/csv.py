"""Text tables: commas, semicolons, tabs or blanks, with or without a header line."""

from __future__ import annotations

import codecs
import itertools
import re
from collections import Counter
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import DataError, Finding
from strapdown.formats.recording import RawLog, stated_by
from strapdown.units import unit_of

__all__ = [
    "NULLS",
    "Columns",
    "columns_at_once",
    "day_nanoseconds",
    "is_day_time",
    "parsed",
    "single_blanks",
]


SUFFIXES = (".csv", ".txt", ".tsv", ".dat")
COMMENTS = ("#", "%", "//")
_META = re.compile(r"(?:[#%]|//)\s*(\w+)\s*:\s*(.+?)\s*$")
# A preamble that states the rate: "Sample Rate:,128,Hz", "// Update Rate: 100.0Hz".
_RATE = re.compile(
    r"(?:sampl\w*|update|output|logging|data)[ _-]*(?:rate|freq\w*)"
    r"\W*(\d+(?:\.\d*)?)(?!\d|\s*[a-gi-z])",
    re.I,
)
_UNIT = re.compile(r"\s*[\[(].*")
_SEPARATOR = re.compile(r"sep=.?", re.I)
_NUMBER = re.compile(r"[+-]?(\d+([.,]\d*)?|[.,]\d+)([eE][+-]?\d+)?|[+-]?nan|[+-]?inf(inity)?", re.I)
# Numbers with a decimal comma, separated by blanks.
_COMMAS = re.compile(r"[+-]?\d+(,\d+)?([eE][+-]?\d+)?(\s+[+-]?\d+(,\d+)?([eE][+-]?\d+)?)+")
_DATE = re.compile(r"\d{4}-\d\d-\d\d[T ]\d\d:.*")
_HEX = re.compile(r"[+-]?0x[0-9a-f]+", re.I)
# Bytes of a text that are examined to learn how its table begins.
HEAD = 1 << 16
# Null bytes and unusual line breaks.
_ODD = (b"\0", b"\x0b", b"\x0c", b"\x1c", b"\x1d", b"\x1e")


def detect(path: Path) -> bool:
    """Whether the name is that of a text table, or the first lines are."""
    if not path.is_file() or path.suffix.lower() in SUFFIXES:
        return path.is_file()
    with path.open("rb") as stream:
        head = stream.read(HEAD)
    if b"\0" in head or not head.strip():
        return False
    numbered, _ = _numbered(head[: head.rfind(b"\n") + 1].decode("utf-8", "replace"))
    rows = [fields_of(line, separator_of(line)) for _, line in numbered[-20:]]
    return len(rows) > 2 and all(
        len(row) > 2 and 2 * sum(map(is_data, row)) >= len(row) for row in rows
    )


def read(path: Path) -> RawLog:
    """Read the columns of a text table.

    Returns
    -------
    RawLog
        Columns that hold anything but numbers are left as text. Lines at the top that begin
        with ``#``, ``%``, ``//`` or ``;`` are comments; the comment ``# sampling: mean`` is
        understood.

    Raises
    ------
    DataError
        The file is empty, holds only a header, or is not text.
    """
    return parse(path.read_bytes(), path.name, (path,))


def parse(data: bytes, name: str, files: tuple[Path, ...]) -> RawLog:
    """Read the columns of a text table from a file or a member of an archive.

    `name`: for messages. `files`: file that holds it.
    """
    return _at_once(data, name, files) or _line_by_line(data, name, files)


def _at_once(data: bytes, name: str, files: tuple[Path, ...]) -> RawLog | None:
    """Parse a text whose lines are all like the first; ten times faster.

    None if anything is irregular: the lines then have to be parsed one by one.
    """
    if not data.endswith(b"\n") or not data.isascii() or any(c in data for c in _ODD):
        return None
    head = data[:HEAD].decode()
    numbered, comments = _numbered(head[: head.rfind("\n") + 1])
    if not numbered:
        return None
    top = _top(numbered, comments)
    if not top.data:
        return None
    first, _ = top.data[0]
    start = 0
    for _ in range(first - 1):
        start = data.index(b"\n", start) + 1
    # Quotes are regular only in the names of columns.
    if data.find(b'"', start) >= 0:
        return None
    columns = columns_at_once(data, len(top.names), top.separator, start)
    if columns is None:
        return None
    # A line of text between rows makes text of every column.
    if all(c.dtype.kind == "O" for c in columns):
        return None
    return _log(name, files, top, columns, np.arange(first, first + columns[0].size), [])


def _line_by_line(data: bytes, name: str, files: tuple[Path, ...]) -> RawLog:
    text, findings = decoded(data, name)
    numbered, comments = _numbered(text)
    if not numbered:
        raise DataError("io.file-holds-comments-alone" if comments else "io.file-empty", file=name)
    top = _top(numbered, comments)
    if not top.data:
        raise DataError("io.csv-without-rows", file=name, row=numbered[0][0])
    rows, lines = _whole_lines(top.data, len(top.names), top.separator, text, name, findings)
    columns = _parse(lines, len(top.names), top.separator, name)
    return _log(name, files, top, columns, np.array(rows), findings)


@dataclass(frozen=True)
class _Top:
    """Top of a table, and the lines under it."""

    names: list[str]
    units: dict[str, str]
    separator: str | None
    data: list[tuple[int, str]]
    above: list[str]


def _numbered(text: str) -> tuple[list[tuple[int, str]], list[str]]:
    """Split into non-blank lines with their row numbers, and the comments at the top."""
    numbered = [(row, line) for row, line in enumerate(text.splitlines(), 1) if line.strip()]
    comments = [line for _, line in itertools.takewhile(lambda n: is_comment(n[1]), numbered)]
    return numbered[len(comments) :], comments


def _top(numbered: list[tuple[int, str]], comments: list[str]) -> _Top:
    """Find where the rows of numbers begin, and their names and units above them.

    Lines above the names are a preamble. Two lines of names are a group and its members, as
    ``Gyroscope,,`` over ``x,y,z``.
    """
    first, separator, width = _first_row(numbered)
    preamble = [line for _, line in numbered[:first]]
    above = [_named(line, separator, width) for line in preamble[-3:]][::-1]
    units: dict[str, str] = {}
    names = above[0] if above else None
    if names is None:
        names = _above(comments + preamble, width, separator)
        return _Top(names, units, separator, numbered[first:], comments + preamble)
    over = above[1] if len(above) > 1 else None
    below = _units(preamble[-1], separator, width)
    if below and over is not None:
        names, over = over, above[2] if len(above) > 2 else None
        units = {n: u for n, u in zip(_unique(names), below, strict=True) if u}
    bare = [_UNIT.sub("", n) for n in names if n]
    if over is not None and len(set(bare)) < len(bare) and _are_groups(over):
        names = [f"{g} {n}".strip() for g, n in zip(_filled(over), names, strict=True)]
        units = {n: u for n, u in zip(_unique(names), below or [], strict=False) if u}
    return _Top(names, units, separator, numbered[first:], comments + preamble)


#: Lines at the top of a text in which its rows of numbers are searched.
SEARCHED = 400


def _first_row(numbered: list[tuple[int, str]]) -> tuple[int, str | None, int]:
    """Return the first of rows of numbers, their separator, and their number of fields.

    They are the most frequent form, and two of the first three have it. Where every line above has
    as many fields, the first names the columns.
    """
    forms: list[tuple[str | None, int]] = []
    data: list[bool] = []
    for _, line in numbered[:SEARCHED]:
        separator = separator_of(line)
        fields = fields_of(line, separator)
        forms.append((separator, len(fields)))
        data.append(_are_data(fields))
    # Numbers in a preamble are fewer than the rows.
    usual = Counter(f for f, d in zip(forms, data, strict=True) if d).most_common(1)
    like = [bool(usual) and d and f == usual[0][0] for f, d in zip(forms, data, strict=True)]
    for k in np.flatnonzero(like).tolist():
        after = like[k + 1 : k + 3]
        if k == 1:
            break
        if after and not any(after) and len(like) > 3:
            continue
        separator, width = forms[k]
        if k > 1 and all(form == forms[k] for form in forms[:k]):
            top = [fields_of(line, separator) for _, line in numbered[:k]]
            first = 1 + _are_groups(top[0])
            if _units(numbered[first][1], separator, width):
                first += 1
            return min(first, k), separator, width
        return k, separator, width - _ends_empty(numbered, forms[k], k)
    # A single line above is that of the names, and decides how many fields a row has.
    separator = separator_of(numbered[0][1])
    names = fields_of(numbered[0][1], separator)
    return 1, separator, len(names) - (len(names) > 1 and not names[-1])


def _are_data(fields: list[str]) -> bool:
    """Whether half of the fields that are there are data."""
    full = [f for f in fields if f]
    return bool(full) and 2 * sum(map(is_data, full)) >= len(full)


def _ends_empty(numbered: list[tuple[int, str]], form: tuple[str | None, int], first: int) -> bool:
    """Whether every row ends with a separator, and the names have no field for it."""
    separator, width = form
    above = fields_of(numbered[first - 1][1], separator) if first else []
    if len(above) == width and above[-1]:
        return False
    rows = [fields_of(line, separator) for _, line in numbered[first:SEARCHED]]
    return all(len(row) != width or not row[-1] for row in rows)


def _named(line: str, separator: str | None, width: int) -> list[str] | None:
    """Return the fields of a line that may name columns, or None."""
    fields = fields_of(line.strip().lstrip("#%/;").strip() if is_comment(line) else line, separator)
    if len(fields) == width + 1 and not fields[-1]:
        fields = fields[:-1]
    full = [f for f in fields if f]
    if len(fields) != width or not full or 2 * sum(is_data(f) for f in full) > len(full):
        return None
    return fields


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


def _log(
    name: str,
    files: tuple[Path, ...],
    top: _Top,
    columns: Columns,
    rows: NDArray[np.int64],
    findings: list[Finding],
) -> RawLog:
    meta = {m[1]: m[2] for c in top.above if (m := _META.match(c))}
    rates = [float(m[1]) for line in top.above if (m := _RATE.search(line))]
    return RawLog(
        name=name,
        files=files,
        columns=dict(zip(_unique(top.names), columns, strict=True)),
        rows=rows,
        units=top.units,
        rate=rates[0] if rates and rates[0] > 0.0 else None,
        findings=findings,
        **stated_by(meta),
    )


def decoded(data: bytes, name: str) -> tuple[str, list[Finding]]:
    """Decode the text of a file and collect findings.

    DataError: the content is not text.
    """
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return data.decode("utf-16", "replace"), []
    if b"\0" in data[:4096]:
        raise DataError("io.text-with-zero-bytes", file=name)
    try:
        return data.decode("utf-8-sig"), []
    except UnicodeDecodeError as error:
        return data.decode("cp1252", "replace"), [
            Finding("io.not-utf-8", file=name, severity="note", byte=error.start)
        ]


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
    if field in NULLS or is_day_time(field):
        return True
    return any(p.fullmatch(field) for p in (_NUMBER, _DATE, _HEX))


def _units(line: str, separator: str | None, width: int) -> list[str] | None:
    """Return the units of a second header line, if most fields are units known here."""
    fields = [f.strip("[]() ") for f in fields_of(line, separator)][:width]
    known = [unit_of(f) is not None for f in fields if f]
    return fields if len(fields) == width and known and 2 * sum(known) > len(known) else None


def _above(comments: list[str], width: int, separator: str | None) -> list[str]:
    """Name the columns without a header: by the last comment if it fits, else by numbers."""
    names = _named(comments[-1], separator, width) if comments else None
    if comments and names is None and separator is None:
        # Names over columns of blanks may be separated otherwise: "% time, x, y".
        names = _named(comments[-1], separator_of(comments[-1].strip().lstrip("#%/;")), width)
    if names is None or any(is_data(n) for n in names):
        return [f"column {k + 1}" for k in range(width)]
    return names


def _unique(names: list[str]) -> list[str]:
    seen: dict[str, int] = {}
    out = []
    for name in names:
        seen[name] = seen.get(name, 0) + 1
        out.append(name if seen[name] == 1 else f"{name} ({seen[name]})")
    return out


def separator_of(line: str) -> str | None:
    """Return the separator of a line; None for any run of blanks."""
    for candidate in ("\t", ";", ","):
        if candidate in line:
            return None if candidate == "," and _COMMAS.fullmatch(line.strip()) else candidate
    return None


def fields_of(line: str, separator: str | None) -> list[str]:
    """Split a line into fields, without the blanks and quotes around them."""
    if separator is not None and '"' in line:
        import csv

        return [f.strip() for f in next(csv.reader([line], delimiter=separator))]
    return [f.strip() for f in line.split(separator)]


def _whole_lines(
    numbered: list[tuple[int, str]],
    width: int,
    separator: str | None,
    text: str,
    name: str,
    findings: list[Finding],
) -> tuple[list[int], list[str]]:
    """Return rows and lines of one width; drop a truncated last line."""
    rows, lines = [], []
    amid: list[tuple[int, str]] = []
    numeric = _are_data(fields_of(numbered[0][1], separator))
    ended = text.endswith(("\n", "\r"))
    for k, (row, line) in enumerate(numbered):
        last = k == len(numbered) - 1
        if last and k and _was_cut(line, numbered[max(0, k - 20) : k], width, separator, ended):
            findings.append(
                Finding("io.last-line-cut-left-out", severity="note", file=name, row=row)
            )
            break
        count = _count(line, separator)
        if count == width + 1 and separator and line.rstrip().endswith(separator):
            line, count = line.rstrip()[:-1], width
        odd = count != width
        if odd or (numeric and line.lstrip()[:1].isalpha()):
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
        findings.append(
            Finding(
                "io.comments-among-rows",
                file=name,
                row=row,
                severity="note",
                count=len(amid),
                first=line.strip()[:60],
            )
        )
    return rows, lines


#: Most kinds of rows that a message lists.
KINDS = 8


def _refuse_kinds(numbered: list[tuple[int, str]], separator: str | None, name: str) -> None:
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


def _was_cut(
    line: str, before: list[tuple[int, str]], width: int, separator: str | None, ended: bool
) -> bool:
    """Whether the last line ends within a field, or before the last one."""
    fields = fields_of(line, separator)
    if len(fields) < width:
        return True
    if ended or len(fields) != width:
        return False
    ends = [fields_of(other, separator)[-1] for _, other in before]
    if not all(_NUMBER.fullmatch(e) for e in ends):
        return False
    # Without a line end the last number may have lost digits; it shows if all others have the same
    # number of decimals.
    decimals = {len(e.partition(".")[2]) for e in ends}
    short = len(decimals) == 1 and len(fields[-1].partition(".")[2]) < decimals.pop()
    return not _NUMBER.fullmatch(fields[-1]) or short


def _parse(lines: list[str], count: int, separator: str | None, name: str) -> Columns:
    """Parse the lines under the header, each number to the nearest double."""
    decimal = "," if _comma_is_decimal(lines, separator) else "."
    if separator is None:
        lines = ["\t".join(line.split()) for line in lines]
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


def _comma_is_decimal(lines: list[str], separator: str | None) -> bool:
    line = next((line for line in lines if "," in line), "")
    numbers = [f for f in fields_of(line, separator) if _NUMBER.fullmatch(f)]
    return any("," in n for n in numbers) and not any("." in n for n in numbers)


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
        pa_csv.write_csv(
            pa.table({k: pa.array(v) for k, v in columns.items()}),
            stream,
            pa_csv.WriteOptions(include_header=False),
        )


# Fast parsing of text lines into numeric columns.


Columns = list[NDArray[Any]]
#: Texts of missing values.
NULLS = ("", "nan", "NaN", "NAN", "-nan", "NA", "N/A", "NULL", "null", "None")
#: From this many bytes on, the first lines decide which columns are numeric.
LONG = 1 << 22


def columns_at_once(
    data: bytes, count: int, separator: str | None, start: int = 0
) -> Columns | None:
    """Parse columns of lines of equal width.

    `data`: ASCII, without quotes from `start` on; the last line ends with a line break. `count`:
    number of columns. `separator`: separator of fields; None for any run of blanks. `start`:
    characters before the first of these lines. Returns or None, as `parsed`. None if a line has
    another width, is empty, or may hold non-numbers.
    """
    # A comma may be a decimal sign, and an x part of a hexadecimal number.
    odd = (b"x", b"X", *(() if separator == "," else (b",",)))
    if count < 2 or any(data.find(c, start) >= 0 for c in odd):
        return None
    if data.find(b"\r", start) >= 0:
        data, start = data[start:].replace(b"\r\n", b"\n"), 0
        if b"\r" in data:
            return None
    # No copy: a text may take half of the memory.
    columns = _parsed_or_none(memoryview(data)[start:], count, separator or " ")
    if columns is not None and all(_full(c) for c in columns):
        return columns
    body = data[start:]
    # A missing value may be two adjacent blanks, or a line without any.
    if separator is None:
        body = single_blanks(body)
        columns = _parsed_or_none(body, count, " ")
    return None if b"\n\n" in body or body.startswith(b"\n") else columns


def _parsed_or_none(body: bytes | memoryview, count: int, delimiter: str) -> Columns | None:
    import pyarrow as pa

    try:
        return parsed(body, count, delimiter)
    except pa.ArrowInvalid:
        return None


def _full(column: NDArray[Any]) -> bool:
    return column.dtype.kind in "iu" or (
        column.dtype.kind == "f" and bool(np.isfinite(column.sum()))
    )


def single_blanks(text: bytes) -> bytes:
    """Reduce runs of blanks to one between fields, with none at the ends of a line.

    `text`: fields separated by blanks and tabs. Returns the same object if unchanged.
    """
    text = text.replace(b"\t", b" ")
    # Four passes reduce runs of up to 300 blanks; longer ones take more passes.
    for run in (16, 4, 3, 2):
        text = text.replace(b" " * run, b" ")
    while b"  " in text:
        text = text.replace(b"  ", b" ")
    return text.replace(b"\n ", b"\n").replace(b" \n", b"\n").removeprefix(b" ")


def parsed(
    body: bytes | memoryview,
    count: int,
    delimiter: str,
    *,
    decimal: str = ".",
    quote: str | Literal[False] = '"',
    text: Sequence[int] = (),
) -> Columns:
    """Parse lines, each number to the nearest double.

    `body`: UTF-8, without a header. `count`: number of columns. `quote`: quote around fields that
    hold the delimiter. `text`: columns to keep as text. Returns (n,), numbers with NaN for missing
    values, dates as dates, the rest as text. pyarrow.ArrowInvalid: a line has the wrong number of
    fields.
    """
    import pyarrow as pa

    def read(part: bytes | memoryview, types: dict[str, Any]) -> Any:
        return _table(part, types, count, delimiter, decimal, quote)

    asked = {str(k): pa.string() for k in text}
    table = None
    if len(body) > LONG:
        # Where a type is not stated, Arrow keeps all of the text until it is known.
        with suppress(pa.ArrowInvalid):
            top = bytes(body[:LONG])
            seen = read(top[: top.rfind(b"\n") + 1], asked).schema
            numbers = {f.name: f.type for f in seen if str(f.type) in ("int64", "double")}
            table = read(body, {**numbers, **asked})
    if table is None:
        table = read(body, asked)
    columns = []
    # Column by column, so that at most one is in memory twice.
    for _ in range(count):
        columns.append(_array(table.column(0)))
        table = table.remove_column(0)
    pa.default_memory_pool().release_unused()
    return columns


def _table(
    body: bytes | memoryview,
    types: dict[str, Any],
    count: int,
    delimiter: str,
    decimal: str,
    quote: str | Literal[False],
) -> Any:
    import pyarrow as pa
    import pyarrow.csv as pa_csv

    return pa_csv.read_csv(
        pa.BufferReader(body),
        read_options=pa_csv.ReadOptions(
            column_names=[str(k) for k in range(count)], use_threads=False
        ),
        parse_options=pa_csv.ParseOptions(
            delimiter=delimiter, quote_char=quote, ignore_empty_lines=False
        ),
        convert_options=pa_csv.ConvertOptions(
            decimal_point=decimal,
            null_values=list(NULLS),
            strings_can_be_null=True,
            column_types=types,
        ),
    )


def _array(column: Any) -> NDArray[Any]:
    """Convert to numbers with NaN for missing values, to dates, or to text."""
    kind = str(column.type)
    if kind in ("int64", "double"):
        values: NDArray[Any] = column.to_numpy()
        return values
    if kind == "null":
        return np.full(len(column), np.nan)
    if kind.startswith("timestamp") and not column.null_count:
        dates: NDArray[Any] = column.cast("timestamp[ns]").to_numpy()
        return dates
    return np.array([None if v is None else str(v) for v in column.to_pylist()], dtype=object)


_TIME = re.compile(
    r"(?:\d{1,2}[./-]\d{1,2}[./-]\d{2,4}[ T]+)?(\d{1,2}):([0-5]\d):([0-5]\d)(?:[.,:](\d{1,9}))?"
)
_DAY = 86_400 * 10**9
# A decrease of more than half a day is midnight.
_HALF_DAY = _DAY // 2


def is_day_time(field: str) -> bool:
    """Whether a field is a time of day, with seconds."""
    return _TIME.fullmatch(field) is not None


def day_nanoseconds(texts: NDArray[Any]) -> NDArray[np.int64] | None:
    """Convert times of day to nanoseconds since the midnight before the first.

    `texts` ((n,)). Returns (n,), or None, none if one is not a time of day. Counting continues past
    midnight; dates are ignored.
    """
    found = [None if t is None else _TIME.fullmatch(str(t).strip()) for t in texts]
    if not found or any(m is None or int(m[1]) > 23 for m in found):
        return None
    whole = np.array(
        [
            (int(m[1]) * 3600 + int(m[2]) * 60 + int(m[3])) * 10**9
            + int((m[4] or "0").ljust(9, "0"))
            for m in found
            if m
        ],
        dtype=np.int64,
    )
    fell = np.concatenate([[0], np.cumsum(np.diff(whole) < -_HALF_DAY)])
    return np.asarray(whole + fell * _DAY, dtype=np.int64)

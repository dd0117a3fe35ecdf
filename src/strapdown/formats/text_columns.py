"""A text as lines, fields and columns: encodings, comments, separators, quotes, numbers.

Lines with equally many fields are read as columns by pyarrow, each number the nearest double:
`columns_at_once` reads a regular table block by block, from a file without holding it in memory;
`parsed` reads lines whose irregularities are known.
"""

from __future__ import annotations

import codecs
import itertools
import re
from collections import deque
from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from itertools import islice
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import DataError, Finding
from strapdown.formats.arrays import is_stamp
from strapdown.formats.vocabularies import FOREIGN, without_accents
from strapdown.tables import on_disk

Columns = list[NDArray[Any]]
#: Lines with their rows.
Lines = list[tuple[int, str]]
COMMENTS = ("#", "%", "//", "!")
#: Signs at the beginning of a comment, of each of which there may be several.
MARKS = "#%/;!"
_SEPARATOR = re.compile(r"sep=.?", re.I)
#: A number with a point and without a sign, as a part of other expressions.
UNSIGNED = r"(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?"
#: A number, with a point or a comma; and that or not a number.
NUMBER = re.compile("[+-]?" + UNSIGNED.replace(r"\.", "[.,]"))
NUMBER_OR_NAN = re.compile(rf"{NUMBER.pattern}|[+-]?nan|[+-]?inf(inity)?", re.I)
HEXADECIMAL = re.compile(r"[+-]?0x[0-9a-f]+", re.I)
# Numbers with a decimal comma, separated by blanks.
_COMMA = r"[+-]?\d+(?:,\d+)?(?:[eE][+-]?\d+)?"
_COMMAS = re.compile(rf"{_COMMA}(\s+{_COMMA})+")
#: Lines at the top of a text that are searched, and the fields of each that are judged.
SEARCHED, JUDGED = 400, 200
#: Most fields of a row; no log has more, and a damaged line may.
MOST_COLUMNS = 10_000
#: Texts of missing values.
NULLS = (
    *("", "nan", "NaN", "NAN", "-nan", "NA", "N/A", "n/a", "NULL", "null", "None", "NaT"),
    *("#N/A", "#NV", "#NUM!", "#VALUE!", "#DIV/0!", "#REF!"),
)
#: Bytes of a block; the first decides which columns are numeric.
BLOCK = 1 << 20
#: Threads that parse blocks where all columns are numbers.
THREADS = 4
#: Rows of a long table that are kept in memory while it is read.
KEPT = 1 << 18
# Null bytes and unusual line breaks, which are regular in no text.
_ODD = (b"\0", b"\x0b", b"\x0c", b"\x1c", b"\x1d", b"\x1e")
# Types of numbers; each holds those before it.
_WIDER = ("null", "int64", "double")


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
        return without_second_encoding(data.decode("utf-8-sig"), name)
    except UnicodeDecodeError as error:
        code = _code_of(top)
        about: dict[str, Any] = {"byte": error.start, "encoding": _CODES[code]}
        return data.decode(code, "replace"), [
            Finding("io.not-utf-8", file=name, severity="note", **about)
        ]


#: Codes of texts before Unicode, and how they are called. The first holds any text.
_CODES = {"cp1252": "Windows-1252", "cp1251": "Windows-1251", "gb18030": "GB 18030"}
_CODES |= {"shift_jis": "Shift JIS", "cp949": "CP949"}


def _code_of(top: bytes) -> str:
    """Return the code in which most words of clocks and sensors are found, of any language."""
    found = {}
    for code in _CODES:
        text = without_accents(top.decode(code, "ignore").lower())
        found[code] = sum(word in text for word in FOREIGN)
    return max(found, key=lambda code: found[code])  # the first of equals


#: Codes in which programs read UTF-8 by mistake.
_MISTAKEN = ("cp1252", "cp1251")


def without_second_encoding(text: str, name: str) -> tuple[str, list[Finding]]:
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
    number = NUMBER_OR_NAN.fullmatch(field) or HEXADECIMAL.fullmatch(field)
    return field in NULLS or number is not None or is_stamp(field)


def separator_of(line: str) -> str | None:
    """Return the separator of a line; None for any run of blanks."""
    for candidate in ("\t", ";"):
        if candidate in line:
            return candidate
    # Between bars, a name may hold a comma; between commas, bars mean a norm.
    if line.count("|") > max(1, line.count(",") - 1):
        return "|"
    return None if "," not in line or _COMMAS.fullmatch(line.strip()) else ","


def fields_of(line: str, separator: str | None = "") -> list[str]:
    """Split a line into fields, without the blanks and quotes around them.

    `separator`: by default that of the line. Quotes that do not close are text.
    """
    if separator == "":
        separator = separator_of(line)
    if separator is not None and '"' in line:
        import csv

        with suppress(csv.Error):  # of a quote that does not close, or a field too long
            return [f.strip() for f in next(csv.reader([line], delimiter=separator))]
    return [f.strip() for f in line.split(separator)]


def are_data(fields: list[str]) -> bool:
    """Whether half of the fields that are there are data; of many fields, the first."""
    full = [f for f in fields if f][:JUDGED]
    return bool(full) and 2 * sum(map(is_data, full)) >= len(full)


def numbered_lines(text: str, name: str = "") -> tuple[Lines, list[str]]:
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


# Columns of lines with equally many fields.


def columns_at_once(
    source: bytes | Path, count: int, separator: str | None, start: int = 0
) -> Columns | None:
    """Parse columns of lines of equal width.

    `source`: a text, or the file that holds it. `count`: number of columns. `separator`: separator
    of fields; None for any run of blanks. `start` (bytes): where the first of these lines begins.
    Returns (n,): as `parsed`. None if a line has another width, is empty, or a field may be other
    than a plain number, date or word: in quotes, hexadecimal, with a decimal comma, not ASCII.
    """
    import pyarrow as pa

    # A comma may be a decimal sign, and an x part of a hexadecimal number.
    odd = (b"x", b"X", b'"', *(() if separator == "," else (b",",)))
    if count < 2:
        return None
    parts: list[Columns] = []
    types: dict[str, Any] = {}
    for block in _blocks(source, start):
        if any(c in block for c in odd):
            return None
        read = _block(block, count, separator, types)
        if read is None:
            return None
        if not parts and {str(t) for t in types.values()} <= {"int64", "double"}:
            streamed = _streamed(source, start, types, separator or " ", len(block) / len(read[0]))
            if streamed is not None:
                return streamed
        parts.append(read)
    columns = []
    for k in range(count):
        held = [part[k] for part in parts]
        kinds = {c.dtype.kind for c in held}
        if len(kinds) != 1 and not kinds <= set("iuf"):
            return None
        columns.append(held[0] if len(held) == 1 else np.concatenate(held))
        for part in parts:
            part[k] = np.empty(0)  # at most one column is in memory twice
    pa.default_memory_pool().release_unused()
    return columns or None


def _streamed(
    source: bytes | Path, start: int, types: dict[str, Any], separator: str, width: float
) -> Columns | None:
    """Parse numbers alone, of stated types; None if there is anything else, or an empty field.

    `width`: bytes of a line, about.
    """
    import pyarrow as pa
    import pyarrow.csv as pa_csv

    doubles = [str(t) != "int64" for t in types.values()]
    size = (len(source) if isinstance(source, bytes) else source.stat().st_size) - start
    # Doubles are rows of one array, which the table of the log keeps.
    room = int(1.02 * size / width) + 16
    block = on_disk.room((sum(doubles), room))
    whole = np.empty((len(doubles) - len(block), room), dtype=np.int64)
    rows = 0
    options = _options(types, len(types), separator, ".", False)

    def read(lines: bytes) -> Any:
        # Arrow reads whole numbers with an x as hexadecimal.
        if not all(doubles) and (b"x" in lines or b"X" in lines):
            raise pa.ArrowInvalid
        return pa_csv.read_csv(pa.BufferReader(lines), *options)

    with ThreadPoolExecutor(THREADS) as pool:
        begun = deque[Future[Any]]()
        blocks = _blocks(source, start)
        try:
            while True:
                # So many at once that no thread waits while the oldest is copied.
                begun += [pool.submit(read, b) for b in islice(blocks, 2 * THREADS - len(begun))]
                if not begun:
                    break
                table = begun.popleft().result()
                end = rows + table.num_rows
                if end > room:
                    more = ((0, 0), (0, 2 * end - room))
                    block, whole, room = np.pad(block, more), np.pad(whole, more), 2 * end
                held_now = _columns(block, whole, doubles)
                for column, parsed_now in zip(held_now, table.columns, strict=True):
                    if parsed_now.null_count:
                        return None
                    column[rows:end] = parsed_now.to_numpy()
                if end // KEPT > rows // KEPT:
                    on_disk.let_go(block)
                rows = end
        except pa.ArrowInvalid:
            return None
        finally:
            pool.shutdown(cancel_futures=True)
    on_disk.let_go(block)
    pa.default_memory_pool().release_unused()
    return [column[:rows] for column in _columns(block, whole, doubles)]


def _columns(
    block: NDArray[Any], whole: NDArray[Any], doubles: Sequence[bool]
) -> Iterator[NDArray[Any]]:
    """Yield the columns, in the order of the text, from those of doubles and of whole numbers."""
    of_doubles, of_whole = iter(block), iter(whole)
    for double in doubles:
        yield next(of_doubles if double else of_whole)


def _blocks(source: bytes | Path, start: int) -> Iterator[bytes]:
    """Yield whole lines of a text, about a block at a time."""
    if isinstance(source, bytes):
        end = len(source)
        while start < end:
            stop = source.rfind(b"\n", start, min(start + BLOCK, end)) + 1
            if not stop:
                stop = source.find(b"\n", start, end) + 1 or end
            yield _ended(source[start:stop])
            start = stop
        return
    size = BLOCK
    with source.open("rb") as stream:
        stream.seek(start)
        while block := stream.read(size):
            stop = block.rfind(b"\n") + 1
            if not stop and len(block) == size:
                size *= 2  # a line longer than that
            else:
                yield block[:stop] if stop else _ended(block)
                start, size = start + (stop or len(block)), BLOCK
            # The rest of the last line is read again, which copies less than joining it.
            stream.seek(start)


def _ended(lines: bytes) -> bytes:
    return lines if lines.endswith(b"\n") else lines + b"\n"


def _block(
    block: bytes, count: int, separator: str | None, types: dict[str, Any]
) -> Columns | None:
    """Parse one block. `types`: of the blocks before, to which those of this one are added."""
    columns = _typed(block, count, separator or " ", types)
    # A missing value may be two adjacent blanks, or a line without any.
    if columns is None or not all(
        c.dtype.kind in "iu" or (c.dtype.kind == "f" and np.isfinite(c.sum())) for c in columns
    ):
        if separator is None:
            columns = _typed(single_blanks(block), count, " ", types)
        if any(empty in b"\n" + block for empty in (b"\n\n", b"\n\r")):
            return None
    # Words are checked for what a number cannot hold.
    words = columns is not None and any(c.dtype.kind == "O" for c in columns)
    odd = words and (not block.isascii() or any(c in block for c in _ODD))
    return None if odd else columns


def _typed(block: bytes, count: int, separator: str, types: dict[str, Any]) -> Columns | None:
    """Parse one block with the types known so far; numbers may make them wider."""
    import pyarrow as pa

    if types:
        with suppress(pa.ArrowInvalid):
            return _arrays(_table(block, types, count, separator, ".", False))
    try:
        table = _table(block, {}, count, separator, ".", False)
    except pa.ArrowInvalid:
        return None
    for field in table.schema:
        both = {str(types.get(field.name, field.type)), str(field.type)}
        dates = all(kind.startswith("timestamp") for kind in both)
        if len(both) > 1 and not (dates or both <= set(_WIDER)):
            return None  # a word among numbers makes words of them
        if dates or max(both, key=_WIDER.index if both <= set(_WIDER) else len) == str(field.type):
            types[field.name] = field.type
    return _arrays(table)


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
    if len(body) > BLOCK:
        # Where a type is not stated, Arrow keeps all of the text until it is known.
        with suppress(pa.ArrowInvalid):
            top = bytes(body[:BLOCK])
            seen = read(top[: top.rfind(b"\n") + 1], asked).schema
            numbers = {f.name: f.type for f in seen if str(f.type) in ("int64", "double")}
            table = read(body, {**numbers, **asked})
    if table is None:
        table = read(body, asked)
    columns = _arrays(table)
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
        pa.BufferReader(body), *_options(types, count, delimiter, decimal, quote)
    )


def _options(
    types: dict[str, Any], count: int, delimiter: str, decimal: str, quote: str | Literal[False]
) -> tuple[Any, Any, Any]:
    import pyarrow.csv as pa_csv

    return (
        pa_csv.ReadOptions(column_names=[str(k) for k in range(count)], use_threads=False),
        pa_csv.ParseOptions(delimiter=delimiter, quote_char=quote, ignore_empty_lines=False),
        pa_csv.ConvertOptions(
            decimal_point=decimal,
            null_values=list(NULLS),
            strings_can_be_null=True,
            column_types=types,
        ),
    )


def _arrays(table: Any) -> Columns:
    """Convert to numbers with NaN for missing values, to dates, or to text."""
    # Column by column, so that at most one is in memory twice.
    held, arrays = table.columns[::-1], []
    del table
    while held:
        column = held.pop()
        kind = str(column.type)
        if kind in ("int64", "double"):
            arrays.append(column.to_numpy())
        elif kind == "null":
            arrays.append(np.full(len(column), np.nan))
        elif kind.startswith("timestamp") and not column.null_count:
            arrays.append(column.cast("timestamp[ns]").to_numpy())
        else:
            words = [None if v is None else str(v) for v in column.to_pylist()]
            arrays.append(np.array(words, dtype=object))
    return arrays

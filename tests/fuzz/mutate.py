"""Change a file as damage and malice do: lines, fields, numbers, keys and values, bytes.

Deterministic: the same generator of random numbers makes the same inputs.
"""

from __future__ import annotations

import json
import random
import re

NUMBER = re.compile(rb"[-+]?\d+(?:\.\d*)?(?:[eE][-+]?\d+)?")
#: A value behind a key of TOML or JSON, or a field of a table.
VALUE = re.compile(rb"(?<=[=:,;\t\[ ])[^=:,;\t\n\[\]{}]+")
WORD = re.compile(rb"[A-Za-z_][\w.\-]*")
NUMBERS = (
    *(b"0", b"-0", b"1", b"-1", b"nan", b"inf", b"-inf", b"1e308", b"-1e308", b"1e-320", b"1e400"),
    *(b"2147483648", b"-9223372036854775808", b"18446744073709551615", b"9" * 400, b"9" * 5000),
    *(b"4.6e9", b"1_000", b"0x10", b"1,5", b"1e5e5", b".", b"-", b"007", b"1.7e9", b"1e18"),
    *("٤".encode(), "１２".encode(), "²".encode(), b"1e", b"+", b"1.2.3", b"361", b"-91", b"1e-9"),
)
TEXTS = (
    *(b"", b" ", b'"', b"'", b'""', b"\\", b"\\u0000", b"\x1b[31mred\x1b[0m", b"\x07", b"\x00"),
    *("\u202egnp".encode(), "\u2066".encode(), "\ufeff".encode(), "\u2028".encode(), b"\x85"),
    *(b"<script>alert(1)</script>", b"{}", b"{x}", b"%s", b"true", b"[[]]", b"[1, 2]", b"{a = 1}"),
    *(b"a" * 3000, b"?", b"..", b"/etc/passwd", b"\xff\xfe", b"\xc3", b"1979-05-27T07:32:00Z"),
    *(b"NaN", b"null", b"None", b"#", b"$GPGGA", b"deg/s", b"time", b"kind", b"12:34:56.7"),
)
BREAKS = (b"\n", b"\r\n", b"\r", b"\x0b", b"\n\n")
SEPARATORS = (b",", b";", b"\t", b" ", b"|", b":", b"=", b", ")


def mutated(data: bytes, chance: random.Random, others: list[bytes] | None = None) -> bytes:
    """Return a changed copy: a few changes, each of a kind drawn anew.

    `others`: further files, of which lines may be taken.
    """
    for _ in range(chance.choice((1, 1, 1, 2, 2, 3, 5, 9))):
        change = chance.choice(CHANGES)
        data = change(data, chance, others or [data])[: 1 << 16]
    return data


def _one(pattern: re.Pattern[bytes], data: bytes, chance: random.Random) -> re.Match[bytes] | None:
    # From a place drawn, so that long files cost no more.
    at = chance.randrange(len(data) + 1)
    return pattern.search(data, at) or pattern.search(data)


def _number(data: bytes, chance: random.Random, others: list[bytes]) -> bytes:
    found = _one(NUMBER, data, chance)
    if found is None:
        return data
    text = chance.choice(NUMBERS)
    if chance.random() < 0.4:
        # JSON and TOML take no other numbers; an ordinary one may be the worst.
        text = repr(chance.gauss(0.0, 10.0 ** chance.randint(-12, 22))).encode()
    return data[: found.start()] + text + data[found.end() :]


def _value(data: bytes, chance: random.Random, others: list[bytes]) -> bytes:
    found = _one(VALUE, data, chance)
    text = chance.choice(TEXTS if chance.random() < 0.5 else NUMBERS)
    if chance.random() < 0.3:
        other = _one(VALUE, chance.choice(others), chance)
        text = other[0] if other else text
    if chance.random() < 0.2:
        text = json.dumps(text.decode("latin-1")).encode()
    return data if found is None else data[: found.start()] + text + data[found.end() :]


def _word(data: bytes, chance: random.Random, others: list[bytes]) -> bytes:
    found, other = _one(WORD, data, chance), _one(WORD, chance.choice(others), chance)
    if found is None:
        return data
    text = other[0] if other and chance.random() < 0.7 else chance.choice(TEXTS)
    return data[: found.start()] + text + data[found.end() :]


def _lines(data: bytes, chance: random.Random, others: list[bytes]) -> bytes:
    lines = data.split(b"\n")
    k, m = chance.randrange(len(lines)), chance.randrange(len(lines))
    kind = chance.randrange(6)
    if kind == 0:
        del lines[k]
    elif kind == 1:
        lines.insert(k, lines[m])
    elif kind == 2:
        lines[k], lines[m] = lines[m], lines[k]
    elif kind == 3:
        lines.insert(k, chance.choice(chance.choice(others).split(b"\n")))
    elif kind == 4:
        lines[k:k] = [lines[m]] * chance.choice((2, 9, 60))
    else:
        lines = lines[: k + 1]
    return b"\n".join(lines)


def _column(data: bytes, chance: random.Random, others: list[bytes]) -> bytes:
    """Drop, repeat, move or fill one column of all rows."""
    lines = data.split(b"\n")
    separator = max(SEPARATORS[:5], key=data.count)
    k, m, kind = chance.randrange(12), chance.randrange(12), chance.randrange(4)
    text = chance.choice((*NUMBERS, *TEXTS))
    for at, line in enumerate(lines):
        fields = line.split(separator)
        if len(fields) <= max(k, m):
            continue
        if kind == 0:
            del fields[k]
        elif kind == 1:
            fields.insert(m, fields[k])
        elif kind == 2:
            fields[k], fields[m] = fields[m], fields[k]
        elif at:
            fields[k] = text
        lines[at] = separator.join(fields)
    return b"\n".join(lines)


def _separators(data: bytes, chance: random.Random, others: list[bytes]) -> bytes:
    old, new = chance.choice(SEPARATORS), chance.choice(SEPARATORS)
    if chance.random() < 0.3:
        return data.replace(b"\n", chance.choice(BREAKS))
    at = chance.randrange(len(data) + 1)
    return data[:at] + data[at:].replace(old, new, chance.choice((1, 3, -1)))


def _bytes(data: bytes, chance: random.Random, others: list[bytes]) -> bytes:
    if not data:
        return bytes([chance.randrange(256)])
    out = bytearray(data)
    kind, at = chance.randrange(5), chance.randrange(len(out))
    if kind == 0:
        out[at] = chance.randrange(256)
    elif kind == 1:
        out[at] ^= 1 << chance.randrange(8)
    elif kind == 2:
        out[at:at] = chance.choice(TEXTS)
    elif kind == 3:
        del out[at : at + chance.choice((1, 2, 8, 64))]
    else:
        del out[at:]
    return bytes(out)


def _nested(data: bytes, chance: random.Random, others: list[bytes]) -> bytes:
    found = _one(VALUE, data, chance)
    deep = chance.choice((2, 40, 2000))
    begin, end = chance.choice(((b"[", b"]"), (b"{a=", b"}"), (b'{"a":', b"}"), (b"(", b")")))
    inside = found[0] if found else b"1"
    text = begin * deep + inside + end * chance.choice((deep, deep, 1))
    return data + text if found is None else data[: found.start()] + text + data[found.end() :]


#: Changes of numbers and values are the most frequent: they reach what is behind the form.
CHANGES = (
    *(_number,) * 4,
    *(_value,) * 4,
    *(_word,) * 2,
    *(_lines,) * 3,
    _column,
    _separators,
    *(_bytes,) * 2,
    _nested,
)

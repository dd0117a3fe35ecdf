"""A TOML file: its table, and the line of each key."""

from __future__ import annotations

import re
import tomllib
from bisect import bisect_right
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

from strapdown.errors import ConfigError, Finding

_PLACE = re.compile(r"\s*\(at (?:line (\d+), column (\d+)|end of document)\)$")
# Codes of common slips, by the pattern of a line that is not TOML.
_SLIPS = (
    (r"=\s*\?", "config.toml-open-value"),
    (r"=\s*-?[\d.]+\s*,\s*-?[\d.]+\s*,", "config.toml-list-without-brackets"),
    (r"=\s*[\[\s\d,.-]*\d,\d+\s*(?:#.*)?$", "config.toml-decimal-comma"),
    (r"[“”„‟‘’]", "config.toml-typographic-quotes"),
    (r"=\s*\"[^\"]*\\", "config.toml-backslash"),
    (r"=\s*(?i:true|false|yes|no)\b", "config.toml-capital-boolean"),
    (r"=\s*[+-]?\.\d", "config.toml-no-digit-before-point"),
    (r"=\s*[+-]?0\d", "config.toml-leading-zero"),
    (r"=\s*\d+[-/_]", "config.toml-unquoted-date"),
    (r"=\s*-?[\d.]+\s*[A-Za-z%°]", "config.toml-unit-after-number"),
    (r"=\s*[^\s\"'\d\[{+-]", "config.toml-unquoted-text"),
)


#: Number of characters of a line that are searched for a slip.
LONG = 500


@dataclass(frozen=True)
class TomlFile:
    """Content of a file; the lines of its keys are searched for a message."""

    path: Path
    table: dict[str, Any]
    text: str = field(repr=False)

    @cached_property
    def lines(self) -> dict[KeyPath, list[int]]:
        """As `key_lines`."""
        return key_lines(self.text)

    def line(self, path: KeyPath) -> int | None:
        """Line of a key, or of the nearest enclosing one."""
        return line_of(self.lines, path)

    def refuse(self, path: KeyPath, code: str | Finding, /, **data: Any) -> ConfigError:
        """Return an error at a key, of a code and its data, or of a finding."""
        where = {"file": self.path.name, "line": self.line(path), "quantity": place_of(path)}
        return ConfigError(code, row=None, **{**where, **data})


def read_toml(path: Path) -> TomlFile:
    """Read a file written by a user.

    ConfigError: the file is missing, cannot be read, or is not TOML; the message names the line.
    """
    return parse_toml(path, _text(path))


def parse_toml(path: Path, text: str) -> TomlFile:
    """Parse the text of a file, which need not be written. ConfigError: as `read_toml`."""
    try:
        if any(line.count(".") > DEEPEST for line in text.split("\n")):
            key_lines(text)  # refuses a key of many parts, which tomllib parses slowly
        table = tomllib.loads(text)
        if _depth(table) > DEEPEST:
            raise RecursionError
        return TomlFile(path, table, text)
    except RecursionError:
        raise ConfigError("config.nested-too-deep", file=path.name) from None
    except ValueError as error:
        raise _no_toml(path, text, str(error)) from None


def _depth(node: Any) -> int:
    """Length of the longest path of keys and elements."""
    if not isinstance(node, dict | list):
        return 0
    return max(
        (1 + _depth(one) for one in (node.values() if isinstance(node, dict) else node)), default=0
    )


def _text(path: Path) -> str:
    try:
        if not path.is_file():
            code = "config.not-a-file" if path.exists() else "config.no-such-file"
            raise ConfigError(code, file=str(path))
        # With or without a byte-order mark.
        return path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        before = error.object[: error.start]
        raise ConfigError(
            "config.not-utf-8",
            file=path.name,
            line=before.count(b"\n") + 1 if isinstance(before, bytes) else None,
            byte=error.object[error.start],
        ) from None
    except OSError as error:
        raise ConfigError("config.file-unreadable", file=str(path), reason=error.strerror) from None
    except ValueError as error:
        raise ConfigError("config.not-a-file-name", file=shown(str(path)), reason=error) from None


#: File name endings of data tables and crash records, which are not configurations.
RECORDS = (".csv", ".tsv", ".txt", ".dat", ".ev5", ".mme")


def _no_toml(path: Path, text: str, said: str) -> ConfigError:
    found = _PLACE.search(said)
    what = shown_key(said[: found.start()] if found else said)
    if found and found.group(2):
        what = f"{what}, column {found.group(2)}"
    number = int(found.group(1)) if found and found.group(1) else None
    if number is None:
        number = text.rstrip("\n").count("\n") + 1 if found else None
    rows = text.split("\n")
    # Only the beginning of a long line: patterns take time.
    line = rows[number - 1][:LONG] if number is not None and number <= len(rows) else ""
    if number is not None:
        # A duplicate key is found only after the whole line has been read.
        twice = _twice("\n".join(rows[:number]), number)
        if what.startswith(("Cannot", "Duplicate")) and twice:
            key, first = twice
            return ConfigError(
                "config.key-repeated",
                file=path.name,
                line=number,
                quantity=place_of(key),
                first=first,
            )
    code = next((c for pattern, c in _SLIPS if re.search(pattern, line)), "config.not-toml")
    if path.suffix.lower() in RECORDS:
        code = "config.toml-is-record"
    return ConfigError(code, file=path.name, line=number, reason=what)


def _twice(text: str, line: int) -> tuple[KeyPath, int] | None:
    """Find the earlier occurrence of this line's key, with its line."""
    with suppress(RecursionError):
        for key, lines in key_lines(text).items():
            if len(lines) > 1 and lines[-1] == line:
                return key, lines[0]
    return None


def place_of(path: KeyPath) -> str:
    """Position of a path for users: ``manoeuvre 3, radius_m``."""
    words: list[str] = []
    for part in path:
        if isinstance(part, int):
            if not words:
                words.append("element")
            # Lists are shown by element, vectors by component.
            of = words[-1] if words[-1].endswith("_s") else words[-1].removesuffix("s")
            words[-1] = f"{of} {part + 1}"
        else:
            words.append(shown_key(part))
    return ", ".join(words)


# Line numbers of the keys of a TOML file.


#: Keys and numbers of elements, from the root: ``("units", 1, "accelerometers", 0, "unit")``.
KeyPath = tuple[str | int, ...]

#: Maximum nesting of a user's file.
DEEPEST = 50

_BLANK = re.compile(r"[ \t]*")
_BETWEEN = re.compile(r"(?:[ \t\n]|#[^\n]*)*")
_BARE = re.compile(r"[A-Za-z0-9_-]+")
# Longest first: a triple-quoted string begins like an empty one. Up to two further marks belong to
# the string before the three that end it. Groups that can fail inside are not possessive: Python
# before 3.11.5 does not match those (cpython issue 106052).
_STRINGS = tuple(
    re.compile(pattern)
    for pattern in (
        r'"""(?:[^"\\]++|\\[\s\S]|"{1,2}+(?!"))*"{3,5}',
        r"'''(?:[^']++|'{1,2}+(?!'))*'{3,5}",
        r'"(?:[^"\\\n]++|\\.)*"',
        r"'[^'\n]*'",
    )
)
_SCALAR = re.compile(r"[^,\]}#\n]*")


def key_lines(text: str) -> dict[KeyPath, list[int]]:
    r"""Find the lines of all keys, tables and elements.

    `text`: TOML that `tomllib` reads, with ``\n`` at the ends of its lines. For other text, the
    keys up to the first error. Returns by path, the lines from 1 on which it is written: more than
    one for a duplicate key or a reopened table. A table that only contains others and is not
    written itself, such as ``a`` of ``[a.b]``, has the line of its first member. RecursionError:
    the text is nested too deeply.
    """
    scan = _Scan(text)
    scan.document()
    return scan.lines


def line_of(lines: Mapping[KeyPath, list[int]], path: KeyPath) -> int | None:
    """Line of a path, or of the nearest enclosing one; None for the file as a whole."""
    for end in range(len(path), 0, -1):
        if path[:end] in lines:
            return lines[path[:end]][0]
    return None


class _Stop(Exception):  # noqa: N818
    """The text is not TOML from here on."""


class _Scan:
    """One pass over a text."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.at = 0
        self.starts = [0, *(m.end() for m in re.finditer("\n", text))]
        self.lines: dict[KeyPath, list[int]] = {}
        self.elements: dict[KeyPath, int] = {}

    def document(self) -> None:
        table: KeyPath = ()
        try:
            while self._skip(_BETWEEN) < len(self.text):
                if self._follows("[["):
                    path = self._header(self._key(), "]]", counted=True)
                    table = (*path, self.elements[path] - 1)
                    self.lines[table] = [self._line(self.at)]
                elif self._follows("["):
                    table = self._header(self._key(), "]", counted=False)
                else:
                    self._pair(table)
        except _Stop:
            return

    def _header(self, parts: tuple[str, ...], end: str, *, counted: bool) -> KeyPath:
        line = self._line(self.at)
        path: KeyPath = ()
        for k, part in enumerate(parts):
            path = (*path, part)
            last = k == len(parts) - 1
            if last and counted:
                if path in self.lines and path not in self.elements:
                    # A single table so far, now a list of tables.
                    self.lines[path].append(line)
                self.elements[path] = self.elements.get(path, 0) + 1
                self.lines.setdefault(path, [line])
            else:
                self._note(path, line, written=last)
                if path in self.elements:
                    path = (*path, self.elements[path] - 1)
        self._expect(end)
        return path

    def _pair(self, table: KeyPath) -> None:
        line = self._line(self.at)
        parts = self._key()
        for k in range(len(parts)):
            self._note((*table, *parts[: k + 1]), line, written=k == len(parts) - 1)
        self._expect("=")
        self._value((*table, *parts))

    def _note(self, path: KeyPath, line: int, *, written: bool) -> None:
        known = self.lines.setdefault(path, [])
        if written or not known:
            known.append(line)

    def _key(self) -> tuple[str, ...]:
        parts: list[str] = []
        while True:
            self._skip(_BLANK)
            quoted = self._string() if self.text[self.at : self.at + 1] in ('"', "'") else None
            if quoted is not None:
                try:
                    parts.append(tomllib.loads(f"key = {quoted}")["key"])
                except tomllib.TOMLDecodeError:
                    raise _Stop from None
            else:
                parts.append(self._match(_BARE))
            self._skip(_BLANK)
            if not self._follows("."):
                return tuple(parts)
            if len(parts) > DEEPEST:
                raise RecursionError

    def _value(self, path: KeyPath) -> None:
        self._skip(_BLANK)
        if self._follows("["):
            self._array(path)
        elif self._follows("{"):
            while not self._ended("}"):
                self._pair(path)
        elif self.text[self.at : self.at + 1] in ('"', "'"):
            self._string()
        else:
            self._match(_SCALAR)

    def _array(self, path: KeyPath) -> None:
        number = 0
        while not self._ended("]"):
            self.lines[(*path, number)] = [self._line(self.at)]
            self._value((*path, number))
            number += 1

    def _ended(self, mark: str) -> bool:
        self._skip(_BETWEEN)
        if self._follows(","):
            self._skip(_BETWEEN)
        if self.at >= len(self.text):
            raise _Stop
        return self._follows(mark)

    def _string(self) -> str:
        for pattern in _STRINGS:
            found = pattern.match(self.text, self.at)
            if found:
                self.at = found.end()
                return found.group()
        raise _Stop

    def _match(self, pattern: re.Pattern[str]) -> str:
        found = pattern.match(self.text, self.at)
        if not found or not found.group():
            raise _Stop
        self.at = found.end()
        return found.group()

    def _skip(self, pattern: re.Pattern[str]) -> int:
        found = pattern.match(self.text, self.at)
        self.at = found.end() if found else self.at
        return self.at

    def _follows(self, mark: str) -> bool:
        if not self.text.startswith(mark, self.at):
            return False
        self.at += len(mark)
        return True

    def _expect(self, mark: str) -> None:
        self._skip(_BLANK)
        if not self._follows(mark):
            raise _Stop

    def _line(self, at: int) -> int:
        return bisect_right(self.starts, at)


# Short display of values in messages, without control characters.


#: Longer values are cut in a message.
LONGEST = 80


def shown(value: Any) -> str:
    """A value as a file would write it, shortened if long."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        text = repr(value[: LONGEST + 1])
    elif isinstance(value, list | tuple) and len(value) > LONGEST:
        text = repr(value[:LONGEST])
    elif isinstance(value, int) and abs(value) >= 10**LONGEST:
        return f"an integer of {value.bit_length()} bits"
    else:
        try:
            text = repr(value)
        except (RecursionError, ValueError):
            return f"a {type(value).__name__}"
    return text if len(text) <= LONGEST else f"{text[: LONGEST - 1]}…"


def shown_key(key: str) -> str:
    """A key without unprintable characters."""
    text = key if key.isprintable() and key else repr(key[: LONGEST + 1])
    return text if len(text) <= LONGEST else f"{text[: LONGEST - 1]}…"

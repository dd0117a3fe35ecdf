"""Where each key of a TOML file stands."""

from __future__ import annotations

import re
import tomllib
from bisect import bisect_right
from collections.abc import Mapping

__all__ = ["DEEPEST", "KeyPath", "key_lines", "line_of"]

#: Keys and numbers of elements, from the root: ``("units", 1, "accelerometers", 0, "unit")``.
KeyPath = tuple[str | int, ...]

#: Levels of a file that a person writes.
DEEPEST = 50

_BLANK = re.compile(r"[ \t]*")
_BETWEEN = re.compile(r"(?:[ \t\n]|#[^\n]*)*")
_BARE = re.compile(r"[A-Za-z0-9_-]+")
# Longest first: a string of three quotation marks begins like an empty one of one. Up to two
# further marks belong to the string before the three that end it.
_STRINGS = tuple(
    re.compile(pattern)
    for pattern in (
        r'"""(?:[^"\\]++|\\[\s\S]|"{1,2}+(?!"))*+"{3,5}',
        r"'''(?:[^']++|'{1,2}+(?!'))*+'{3,5}",
        r'"(?:[^"\\\n]++|\\.)*+"',
        r"'[^'\n]*'",
    )
)
_SCALAR = re.compile(r"[^,\]}#\n]*")


def key_lines(text: str) -> dict[KeyPath, list[int]]:
    r"""Find the lines of all keys, tables and elements.

    Parameters
    ----------
    text : str
        TOML that `tomllib` reads, with ``\n`` at the ends of its lines. Of other text, the keys
        up to where it stops to be TOML.

    Returns
    -------
    dict
        By path, the lines from 1 where it is written: more than one for a key that stands twice,
        or a table that is opened again. What contains others and is not written itself, such as
        ``a`` of ``[a.b]``, stands where the first of them does.

    Raises
    ------
    RecursionError
        It is nested deeper than a person would write.
    """
    scan = _Scan(text)
    scan.document()
    return scan.lines


def line_of(lines: Mapping[KeyPath, list[int]], path: KeyPath) -> int | None:
    """Line of a path, or of what is nearest around it; None for the file as a whole."""
    for end in range(len(path), 0, -1):
        if path[:end] in lines:
            return lines[path[:end]][0]
    return None


class _Stop(Exception):  # noqa: N818
    """Here it is no TOML."""


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
                    # One table before, and now several.
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

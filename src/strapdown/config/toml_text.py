"""Write the lines of a TOML file with comments; any text survives the round trip."""

from __future__ import annotations

import os
import re
import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from strapdown.errors import Finding

#: Placeholder for a value that only the user knows.
ASK = '"?"'
WIDTH = 100
_BARE = re.compile(r"[A-Za-z0-9_-]+")
_SHORT = {'"': '\\"', "\\": "\\\\", "\n": "\\n", "\r": "\\r", "\t": "\\t"}
LONGEST = 300


def string(text: str) -> str:
    """Return a TOML basic string.

    `text`: any characters; unpaired surrogates, which UTF-8 cannot encode, become U+FFFD.
    """
    return '"' + "".join(_escaped(c) for c in text) + '"'


def _escaped(c: str) -> str:
    if c in _SHORT:
        return _SHORT[c]
    code = ord(c)
    if 0xD800 <= code <= 0xDFFF:
        return "\\uFFFD"
    if not c.isprintable():
        return f"\\u{code:04X}" if code <= 0xFFFF else f"\\U{code:08X}"
    return c


def named_from(path: Path, folder: Path) -> str:
    """Path of one file relative to the folder of another, with slashes.

    Relative, so that both may be moved together; absolute where they share only the root, since a
    relative path is then not helpful.
    """
    whole, start = path.absolute(), folder.absolute()
    try:
        shared = Path(os.path.commonpath([whole, start]))
    except ValueError:  # on another drive
        return whole.as_posix()
    if shared == shared.parent != start:
        return whole.as_posix()
    return Path(os.path.relpath(whole, start)).as_posix()


def plain(text: str) -> str:
    """Text for a comment: one line, no control characters, at most 300 characters."""
    one = "".join(c if c.isprintable() else " " for c in text)
    return one if len(one) <= LONGEST else one[: LONGEST - 1] + "…"


def number(value: float, digits: int = 6) -> str:
    """Return a TOML float with no more digits than are known."""
    text = f"{value:.{digits}g}"
    return text if any(c in text for c in ".en") else f"{text}.0"


def instant(value: float) -> str:
    """An instant of a clock, s: to 10 µs, for any clock origin."""
    text = f"{value:.5f}".rstrip("0")
    return f"{text}0" if text.endswith(".") else text


def array(values: Sequence[float | None]) -> str:
    """Return an array of numbers, with a question mark for each unknown one."""
    return "[" + ", ".join(ASK if v is None else number(v) for v in values) + "]"


def inline(table: Mapping[str, str]) -> str:
    """An inline table of strings."""
    pairs = (f"{k if _BARE.fullmatch(k) else string(k)} = {string(v)}" for k, v in table.items())
    return "{ " + ", ".join(pairs) + " }"


@dataclass(frozen=True)
class Asked:
    """A value left to the user.

    Attributes
    ----------
    line : int
        In the file, counted from 1.
    key : str
    what : str
    """

    line: int
    key: str
    what: str


@dataclass(frozen=True)
class Offered:
    """A table that a file has as a comment: only the user knows whether it applies.

    Attributes
    ----------
    table : str
        Key path, as ``aiding.magnetometer``.
    values : mapping
        Its keys.
    what : str
        What has to be true, as a question.
    label : str
        The answer that adds it.
    """

    table: str
    values: Mapping[str, Any]
    what: str
    label: str


@dataclass(frozen=True)
class Draft:
    """Proposed configuration: its text, what it rests on, and what is open.

    `asked`: values to state, `to_check`: to confirm; `offers`: tables that are comments. Of a crash
    `vehicle`: its number, empty where the records do not number vehicles; `name` as they state it;
    `left_out`: what of the records is not in it.
    """

    text: str
    found: tuple[str, ...] = ()
    asked: tuple[Asked, ...] = ()
    to_check: tuple[Asked, ...] = ()
    findings: tuple[Finding, ...] = ()
    offers: tuple[Offered, ...] = ()
    vehicle: str = ""
    name: str = ""
    left_out: tuple[Any, ...] = ()


@dataclass
class Page:
    """A file under construction, line by line."""

    lines: list[str] = field(default_factory=list)
    asked: list[Asked] = field(default_factory=list)
    to_check: list[Asked] = field(default_factory=list)

    def say(self, *paragraphs: str) -> None:
        """Add comment lines, wrapped; control characters are removed."""
        for text in paragraphs:
            shown = "".join(c if c.isprintable() else " " for c in text)
            if len(shown) > 6 * LONGEST:
                shown = shown[: 6 * LONGEST - 1] + "…"
            wrapped = textwrap.wrap(shown, WIDTH - 2, break_long_words=True, break_on_hyphens=False)
            self.lines += [f"# {line}".rstrip() for line in wrapped or [""]]

    def table(self, header: str, *remarks: str) -> None:
        """Add a blank line, comments, and the header of a table."""
        self.blank()
        self.say(*remarks)
        self.lines.append(header)

    def blank(self) -> None:
        """Add a blank line, never two."""
        if self.lines and self.lines[-1]:
            self.lines.append("")

    def path(self, name: str, path: Path, folder: Path) -> None:
        """Add a key that names a file; its remark is above, so that lines do not move.

        `folder`: folder of the file being written.
        """
        self.say("from the folder of this file, or whole")
        self.key(name, string(named_from(path, folder)))

    def key(
        self, name: str, value: str, remark: str = "", *, what: str = "", check: str = ""
    ) -> None:
        """Add a key with its remark, on the same line if it fits, else above.

        `name`, `value`: the value as TOML. `what`: short text for the list of open values; by
        default the remark. `check`: consequence of the value, for a user to confirm.
        """
        text = f"{name} = {value}"
        remark = "".join(c if c.isprintable() else " " for c in remark)
        beside = f"{text:<34}  # {remark}"
        if remark and len(beside) > WIDTH:
            self.say(remark)
            beside = text
        self.lines.append(beside if remark else text)
        if ASK in value:
            said = what or remark.removeprefix("only you know: ")
            self.asked.append(Asked(len(self.lines), name, said))
        elif check:
            self.to_check.append(Asked(len(self.lines), name, check))

    @property
    def text(self) -> str:
        """Return the whole file."""
        return "\n".join(self.lines) + "\n"

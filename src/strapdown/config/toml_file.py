"""A specification in TOML, as it is read from a file: its table, and the line of each key."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from strapdown.config.shown import shown, shown_key
from strapdown.config.toml_lines import DEEPEST, KeyPath, key_lines, line_of
from strapdown.errors import ConfigError

__all__ = ["TomlFile", "read_toml"]

_PLACE = re.compile(r"\s*\(at (?:line (\d+), column (\d+)|end of document)\)$")
# What people write, by what a line that is no TOML looks like.
_SLIPS = (
    (r"=\s*\?", "this value is still open: put what you know in place of the question mark"),
    (r"=\s*-?[\d.]+\s*,\s*-?[\d.]+\s*,", "write several numbers in brackets: [0.6, -0.5, 0.2]"),
    (r"=\s*[\[\s\d,.-]*\d,\d+\s*(?:#.*)?$", "write numbers with a point: 25.6, not 25,6"),
    (r"[“”„‟‘’]", "use the plain quotation marks, \" or ', not those of a word processor"),
    (
        r"=\s*\"[^\"]*\\",
        "a backslash in double quotation marks begins an escape: write the path in single ones, "
        "'C:\\case\\record.csv', or with /",
    ),
    (r"=\s*(?i:true|false|yes|no)\b", "write true or false, in small letters"),
    (r"=\s*[+-]?\.\d", "write a 0 before the point: 0.5, not .5"),
    (r"=\s*[+-]?0\d", "write numbers without zeros before them"),
    (r"=\s*\d+[-/_]", 'write what is no number in quotation marks: "2024-117"'),
    (
        r"=\s*-?[\d.]+\s*[A-Za-z%°]",
        "write the number alone: the name of the key tells its unit",
    ),
    (r"=\s*[^\s\"'\d\[{+-]", 'write text in quotation marks: key = "text"'),
)


#: Characters of a line that are looked at for a slip.
LONG = 500


@dataclass(frozen=True)
class TomlFile:
    """What a file says, and where.

    Attributes
    ----------
    path : Path
    table : dict
    lines : dict
        As `toml_lines.key_lines`.
    """

    path: Path
    table: dict[str, Any]
    lines: Mapping[KeyPath, list[int]] = field(repr=False)

    def line(self, path: KeyPath) -> int | None:
        """Line of a key, or of what is nearest around it."""
        return line_of(self.lines, path)

    def refuse(self, path: KeyPath, what: str, remedy: str, quantity: str = "") -> ConfigError:
        """An error at a key."""
        return ConfigError(
            "config.message",
            file=self.path.name,
            line=self.line(path),
            quantity=quantity or place_of(path),
            message=what,
            remedy_text=remedy,
        )


def read_toml(path: Path, form: str) -> TomlFile:
    """Read a file that a person wrote.

    Parameters
    ----------
    path : Path
    form : str
        What it is, for a remedy: ``a trajectory has three levels``.

    Raises
    ------
    ConfigError
        There is no such file, it cannot be read, or it is no TOML; the message names the line.
    """
    text = _text(path)
    try:
        # Lines first: it is quick to see a depth that takes long to be read.
        lines = key_lines(text)
        if max(map(len, lines), default=0) > DEEPEST:
            raise RecursionError
        return TomlFile(path, tomllib.loads(text), lines)
    except RecursionError:
        raise ConfigError(
            "config.message", file=path.name, message="it is nested too deep", remedy_text=form
        ) from None
    except ValueError as error:
        raise _no_toml(path, text, str(error)) from None


def _text(path: Path) -> str:
    try:
        if not path.is_file():
            what = "it is no file" if path.exists() else "there is no such file"
            raise ConfigError(
                "config.message", file=str(path), message=what, remedy_text="check the path"
            )
        # With the mark that some editors on Windows begin a file with, or without.
        return path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        before = error.object[: error.start]
        raise ConfigError(
            "config.no-toml-byte-not-utf",
            file=path.name,
            line=before.count(b"\n") + 1 if isinstance(before, bytes) else None,
            object=error.object[error.start],
        ) from None
    except OSError as error:
        raise ConfigError("config.cannot-read-2", file=str(path), strerror=error.strerror) from None
    except ValueError as error:
        raise ConfigError("config.no-name-file", file=shown(str(path)), error=error) from None


#: Endings of tables, which are no configurations.
RECORDS = (".csv", ".tsv", ".txt", ".dat")


def _no_toml(path: Path, text: str, said: str) -> ConfigError:
    found = _PLACE.search(said)
    what = shown_key(said[: found.start()] if found else said)
    if found and found.group(2):
        what = f"{what}, column {found.group(2)}"
    number = int(found.group(1)) if found and found.group(1) else None
    if number is None:
        number = text.rstrip("\n").count("\n") + 1 if found else None
    rows = text.split("\n")
    # Of a long line the beginning: patterns take time.
    line = rows[number - 1][:LONG] if number is not None and number <= len(rows) else ""
    if number is not None:
        # What stands twice is known only once all of the line is read.
        twice = _twice("\n".join(rows[:number]), number)
        if what.startswith(("Cannot", "Duplicate")) and twice:
            key, first = twice
            return ConfigError(
                "config.written-twice-line-too",
                file=path.name,
                line=number,
                quantity=place_of(key),
                first=first,
            )
    remedy = next((r for pattern, r in _SLIPS if re.search(pattern, line)), "mend it where it says")
    if path.suffix.lower() in RECORDS:
        remedy = "it seems to be a record: strapdown init writes a file from it, and that is given"
    return ConfigError(
        "config.message",
        file=path.name,
        line=number,
        message=f"it is no TOML: {what}",
        remedy_text=remedy,
    )


def _twice(text: str, line: int) -> tuple[KeyPath, int] | None:
    """The key of this line that stood before, and where."""
    for key, lines in key_lines(text).items():
        if len(lines) > 1 and lines[-1] == line:
            return key, lines[0]
    return None


def place_of(path: KeyPath) -> str:
    """Where it stands, as a person counts: ``manoeuvre 3, radius_m``."""
    words: list[str] = []
    for part in path:
        if isinstance(part, int):
            if not words:
                words.append("element")
            # Of lists one is named, of vectors a component.
            of = words[-1] if words[-1].endswith("_s") else words[-1].removesuffix("s")
            words[-1] = f"{of} {part + 1}"
        else:
            words.append(shown_key(part))
    return ", ".join(words)

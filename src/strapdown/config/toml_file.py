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
from strapdown.errors import ConfigError, Finding

__all__ = ["TomlFile", "read_toml"]

_PLACE = re.compile(r"\s*\(at (?:line (\d+), column (\d+)|end of document)\)$")
# Codes of what people write, by what a line that is not TOML looks like.
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

    def refuse(self, path: KeyPath, code: str | Finding, /, **data: Any) -> ConfigError:
        """Return an error at a key, of a code and its data, or of a finding."""
        where = {"file": self.path.name, "line": self.line(path), "quantity": place_of(path)}
        return ConfigError(code, row=None, **{**where, **data})


def read_toml(path: Path) -> TomlFile:
    """Read a file that a person wrote.

    Parameters
    ----------
    path : Path

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
        raise ConfigError("config.nested-too-deep", file=path.name) from None
    except ValueError as error:
        raise _no_toml(path, text, str(error)) from None


def _text(path: Path) -> str:
    try:
        if not path.is_file():
            code = "config.not-a-file" if path.exists() else "config.no-such-file"
            raise ConfigError(code, file=str(path))
        # With the mark that some editors on Windows begin a file with, or without.
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

"""Values of a case as written in its file, with their lines."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from strapdown.config.toml_file import KeyPath, TomlFile, shown, shown_key
from strapdown.config.wanted import what_to_write
from strapdown.errors import ConfigError, Finding

__all__ = ["Written"]

#: Number of keys of a table that a message shows.
MOST = 4


@dataclass(frozen=True)
class Written:
    """The file of a case, looked up by the names of fields.

    Attributes
    ----------
    file : TomlFile
    names : dict
        Path of a field to its path in the file, where the file has another unit.
    """

    file: TomlFile
    names: Mapping[KeyPath, KeyPath]

    def has(self, *path: str | int) -> bool:
        """Whether the file has this field."""
        return self._value(path) is not None

    def said(self, *path: str | int, default: Any = None) -> str:
        """The key, its value and its line: ``speed_km_per_h = 25.6 (line 14)``."""
        value = self._value(path)
        if value is None:
            return f"{path[-1]} = {shown(default)} (as nothing else is written)"
        return f"{self._equation(path, value)} (line {self.file.line(self._at(path))})"

    def refuse(self, path: KeyPath, code: str, /, **data: Any) -> ConfigError:
        """Return an error about one value; the message starts with the value."""
        value = self._value(path)
        if value is not None and not _big(value):
            data["shown"] = shown(value)
        return self.file.refuse(self._at(path), code, **data)

    def located(self, path: KeyPath, finding: Finding) -> ConfigError:
        """Return an error at a key from a finding that names the value itself."""
        return self.file.refuse(self._at(path), finding)

    def missing(self, path: KeyPath, code: str, /, **data: Any) -> ConfigError:
        """Return an error about a required field that is not written."""
        return self.file.refuse(path, code, wanted=what_to_write(path), **data)

    def contradiction(
        self, path: KeyPath, other: KeyPath, code: str, /, default: Any = None, **data: Any
    ) -> ConfigError:
        """Return an error about two values that exclude each other."""
        mine = self._equation(path, self._value(path))
        other_words = self.said(*other, default=default)
        return self.file.refuse(self._at(path), code, mine=mine, other=other_words, **data)

    def key(self, *path: str | int) -> str:
        """The name of the key as the file has it."""
        return shown_key(str(self._at(path)[-1]))

    def _at(self, path: KeyPath) -> KeyPath:
        for end in range(len(path), 0, -1):
            if path[:end] in self.names:
                return (*self.names[path[:end]], *path[end:])
        return path

    def _value(self, path: KeyPath) -> Any:
        node: Any = self.file.table
        for part in self._at(path):
            if isinstance(node, str):
                # A single value where several are allowed.
                break
            try:
                node = node[part]
            except (KeyError, IndexError, TypeError):
                return None
        return node

    def _equation(self, path: KeyPath, value: Any) -> str:
        at = self._at(path)
        name = next((shown_key(part) for part in reversed(at) if isinstance(part, str)), "")
        return name if _big(value) else f"{name} = {_shown(value)}"


def _shown(value: Any) -> str:
    if not isinstance(value, dict):
        return shown(value)
    pairs = [f"{shown_key(key)} = {shown(part)}" for key, part in value.items()]
    return f"{{ {', '.join(pairs[:MOST])}{', …' if len(pairs) > MOST else ''} }}"


def _big(value: Any) -> bool:
    """A table that contains tables, or several of them."""
    parts = list(value.values()) if isinstance(value, dict) else value
    return isinstance(parts, list) and any(isinstance(part, dict) for part in parts)

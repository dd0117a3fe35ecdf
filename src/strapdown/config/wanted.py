"""What the keys of a file want, in a few words: for what is missing or still open."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from strapdown.config.quantities import base_of, keys_of
from strapdown.config.toml_lines import KeyPath

__all__ = ["Wanted"]


@dataclass(frozen=True)
class Wanted:
    """What each key of one kind of file wants.

    Attributes
    ----------
    words : dict
        By table and field without its unit; a field alone where it means the same everywhere.
    """

    words: Mapping[str, str]

    def at(self, path: KeyPath) -> str:
        """Say what is wanted at a key; empty where nothing is known of it."""
        keys = [part for part in path if isinstance(part, str)]
        if not keys:
            return ""
        table = keys[-2] if len(keys) > 1 else ""
        for name in (keys[-1], base_of(keys[-1])):
            found = self.words.get(f"{table}.{name}" if table else name) or self.words.get(name)
            if found:
                return found
        return ""

    def remedy(self, path: KeyPath) -> str:
        """The remedy for a key that is missing: how it is written, and what it is."""
        name = path[-1] if isinstance(path[-1], str) else ""
        said = self.at(path)
        if said.startswith("["):
            header, _, meaning = said.partition(": ")
            return f"write {header} and its keys below it ({meaning})"
        form = f"write {' or '.join(keys_of(name)[:1])} = …"
        return f"{form} ({said})" if said else form

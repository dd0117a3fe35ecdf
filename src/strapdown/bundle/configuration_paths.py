"""Find and replace the paths of inputs in a configuration."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any


def names_file(key: str, value: Any) -> bool:
    """Whether a value of a configuration is the path of an input.

    `key`: name of the field, of a list that of the list. `value`: a path; for a sensor or a model
    of severity, a file path with its suffix, or a name of the catalogue.
    """
    if not isinstance(value, str):
        return False
    return key.endswith("path") or (
        key in ("sensor", "severity") and value.lower().endswith(".toml")
    )


def named_paths(value: Any, key: str = "") -> Iterator[str]:
    """Every path of an input in a configuration; `key`: that of the value."""
    if isinstance(value, list):
        for item in value:
            yield from named_paths(item, key)
    elif isinstance(value, dict):
        for name, item in value.items():
            yield from named_paths(item, name)
    elif names_file(key, value):
        yield value


def with_paths(value: Any, change: Callable[[str], str], key: str = "") -> Any:
    """Return a configuration with every path of an input replaced.

    `value`: the configuration, or a part. `change`: maps a path to its replacement. `key`: that of
    the value.
    """
    if isinstance(value, dict):
        return {k: with_paths(v, change, k) for k, v in value.items()}
    if isinstance(value, list):
        return [with_paths(v, change, key) for v in value]
    return change(value) if names_file(key, value) else value


def resolved(value: Any, root: Path) -> Any:
    """Return a configuration with the paths of copied inputs made absolute.

    `value`: from a manifest. `root`: folder of the bundle.
    """
    return with_paths(value, lambda path: str(root / path))

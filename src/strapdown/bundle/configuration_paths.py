"""Find and replace the paths of inputs in a configuration."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any


def names_file(key: str, value: Any) -> bool:
    """Whether a value of a configuration is the path of an input.

    `key`: name of the field. `value`: a path; for a sensor, a file path with its suffix, or a name
    of the catalogue.
    """
    if not isinstance(value, str):
        return False
    return key.endswith("path") or (key == "sensor" and value.lower().endswith(".toml"))


def named_paths(value: Any) -> Iterator[str]:
    """Every path of an input in a configuration."""
    if isinstance(value, list):
        for item in value:
            yield from named_paths(item)
    for key, item in value.items() if isinstance(value, dict) else ():
        if names_file(key, item):
            yield item
        yield from named_paths(item)


def with_paths(value: Any, change: Callable[[str], str]) -> Any:
    """Return a configuration with every path of an input replaced.

    `value`: the configuration, or a part. `change`: maps a path to its replacement.
    """
    if isinstance(value, dict):
        return {
            k: change(v) if names_file(k, v) else with_paths(v, change) for k, v in value.items()
        }
    if isinstance(value, list):
        return [with_paths(v, change) for v in value]
    return value


def resolved(value: Any, root: Path) -> Any:
    """Return a configuration with the paths of copied inputs made absolute.

    `value`: from a manifest. `root`: folder of the bundle.
    """
    return with_paths(value, lambda path: str(root / path))

"""Paths of inputs in a configuration: which values they are, and how they are changed."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

__all__ = ["named_paths", "names_file", "resolved", "with_paths"]


def names_file(key: str, value: Any) -> bool:
    """Tell whether a value of a configuration is the path of an input.

    Parameters
    ----------
    key : str
        Name of the field.
    value : object
        A path; or of a sensor a file's path, which ends as such, or a name of the catalogue.
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
    """Return a configuration with every path of an input changed.

    Parameters
    ----------
    value : object
        The configuration, or what stands in it.
    change : callable
        From a path to what takes its place.
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

    Parameters
    ----------
    value : object
        Of a manifest.
    root : Path
        The bundle.
    """
    return with_paths(value, lambda path: str(root / path))

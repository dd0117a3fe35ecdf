"""Plug-ins: readers, attitude algorithms and measurements of other distributions (entry points).

A distribution names them in its ``pyproject.toml``::

    [project.entry-points."strapdown.attitude"]
    midpoint = "my_package.midpoint:Midpoint"

They are searched only for a name that is in none of the package's own tables, or when all are
listed. A defective one raises an error that names its distribution, never a traceback.
"""

from __future__ import annotations

import logging
import sys
from collections.abc import Iterator, Mapping
from functools import lru_cache
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from typing import Any

from strapdown.errors import ConfigError, Finding

#: By kind, the group of its entry points.
GROUPS = {
    "reader": "strapdown.readers",
    "attitude": "strapdown.attitude",
    "measurement": "strapdown.measurements",
}
_log = logging.getLogger("strapdown")
_log.addHandler(logging.NullHandler())


def plugin(kind: str, name: str, base: type) -> Any | None:
    """Find one plug-in by its name.

    `kind`: a key of `GROUPS`. `base`: required type: a subclass, or an instance. None if no
    distribution offers the name. ConfigError: it cannot be loaded, or is something else; the
    message names its distribution.
    """
    for point in _points(GROUPS[kind]):
        if point.name == name:
            return _loaded(point, base)
    return None


def plugins(kind: str, base: type) -> tuple[dict[str, Any], tuple[Finding, ...]]:
    """Load every plug-in of a kind.

    `kind`: a key of `GROUPS`. Returns `found`: plug-ins by name; `findings`: one of each that
    cannot be used.
    """
    found: dict[str, Any] = {}
    findings: list[Finding] = []
    for point in sorted(_points(GROUPS[kind]), key=lambda p: p.name):
        try:
            found.setdefault(point.name, _loaded(point, base))
        except ConfigError as error:
            findings.append(error.finding)
    return found, tuple(findings)


def _points(group: str) -> tuple[EntryPoint, ...]:
    """Find the entry points of a group; the metadata of all distributions take 20 ms to search."""
    # An installation changes a folder that is searched.
    folders = [path for path in map(Path, sys.path) if path.exists()]
    return _searched(group, tuple((str(path), path.stat().st_mtime_ns) for path in folders))


@lru_cache(maxsize=8)
def _searched(group: str, _state: tuple[tuple[str, int], ...]) -> tuple[EntryPoint, ...]:
    return tuple(entry_points(group=group))


def _loaded(point: EntryPoint, base: type) -> Any:
    distribution = point.dist.name if point.dist is not None else "an unknown distribution"
    where = f"{point.group}: {point.name}"
    try:
        found = point.load()
    except Exception as error:  # code of others can fail in every way
        raise ConfigError(
            "plugins.not-loadable",
            quantity=where,
            distribution=distribution,
            value=point.value,
            name=type(error).__name__,
            error=error,
        ) from None
    fits = issubclass(found, base) if isinstance(found, type) else isinstance(found, base)
    if not fits:
        raise ConfigError(
            "plugins.wrong-kind",
            quantity=where,
            distribution=distribution,
            name=base.__name__,
            value=point.value,
        )
    _log.info("plug-in %s of distribution %s", where, distribution)
    return found


class WithPlugins(Mapping[str, Any]):
    """A literal table, extended by the plug-ins of its kind.

    Its keys are those of the table: a plug-in is found by its name alone, so that no module of
    another distribution is imported until it is requested.

    Parameters
    ----------
    table : mapping
    kind : str
        A key of `GROUPS`.
    base : type
    """

    def __init__(self, table: Mapping[str, Any], kind: str, base: type) -> None:
        self._table, self._kind, self._base = table, kind, base

    def __getitem__(self, name: str) -> Any:
        if name in self._table:
            return self._table[name]
        found = plugin(self._kind, name, self._base)
        if found is None:
            raise KeyError(name)
        return found

    def __contains__(self, name: object) -> bool:
        if name in self._table:
            return True
        return isinstance(name, str) and plugin(self._kind, name, self._base) is not None

    def __iter__(self) -> Iterator[str]:
        return iter(self._table)

    def __len__(self) -> int:
        return len(self._table)

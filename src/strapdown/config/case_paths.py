"""The files that a case names, found from its folder."""

from __future__ import annotations

import difflib
from itertools import islice
from pathlib import Path
from typing import Any

from strapdown.config.sealed_paths import beside_sealed_case
from strapdown.config.shown import shown
from strapdown.config.toml_file import TomlFile
from strapdown.config.toml_lines import KeyPath

__all__ = ["with_absolute_paths"]

#: Names of a folder that are looked through for one that is near.
MOST_NAMES = 10_000


def with_absolute_paths(
    file: TomlFile, table: dict[str, Any], called: str = "the case file"
) -> dict[str, Any]:
    """Find the files that a case names.

    Parameters
    ----------
    file : TomlFile
    table : dict
        Of the case, already found to be of its form.
    called : str
        What the file is, for messages.

    Returns
    -------
    dict
        With every ``path``, and every ``sensor`` that is a file, as an absolute path. Of a case
        that is a copy in a sealed folder, the copies in that folder.

    Raises
    ------
    ConfigError
        One is not there; the message names the line.
    """
    found: dict[str, Any] = _resolved(file, table, (), called)
    return found


def _resolved(file: TomlFile, node: Any, path: KeyPath, called: str) -> Any:
    if isinstance(node, dict):
        return {
            key: _found(file, value, (*path, key), called)
            if key == "path" or (key == "sensor" and str(value).lower().endswith(".toml"))
            else _resolved(file, value, (*path, key), called)
            for key, value in node.items()
        }
    if isinstance(node, list | tuple):
        return [_resolved(file, value, (*path, k), called) for k, value in enumerate(node)]
    return node


def _found(file: TomlFile, given: Any, path: KeyPath, called: str) -> Any:
    if not isinstance(given, str):
        return given
    wanted = file.path.parent.absolute() / given
    try:
        if wanted.exists():
            return str(wanted)
        kept = beside_sealed_case(file.path, path, given)
        if kept is not None:
            return str(kept)
        why = f"there is no {shown(given)}"
    except (OSError, ValueError) as error:
        why = f"{shown(given)} cannot be read: {getattr(error, 'strerror', None) or error}"
    remedy = f"paths begin at the folder of {called}; check the path"
    near = _near(wanted)
    if near:
        remedy = f"did you mean '{near}'? Else {remedy}"
    raise file.refuse(path, why, remedy)


def _near(wanted: Path) -> str:
    try:
        names = [p.name for p in islice(wanted.parent.iterdir(), MOST_NAMES)]
    except (OSError, ValueError):
        return ""
    close = difflib.get_close_matches(wanted.name[:255], sorted(names), n=1)
    return close[0] if close and close[0].isprintable() else ""

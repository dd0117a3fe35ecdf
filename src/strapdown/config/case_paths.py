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


def with_absolute_paths(file: TomlFile, table: dict[str, Any]) -> dict[str, Any]:
    """Find the files that a case names.

    Parameters
    ----------
    file : TomlFile
    table : dict
        Of the case, already found to be of its form.

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
    found: dict[str, Any] = _resolved(file, table, ())
    return found


def _resolved(file: TomlFile, node: Any, path: KeyPath) -> Any:
    if isinstance(node, dict):
        return {
            key: _found(file, value, (*path, key))
            if key == "path" or (key == "sensor" and str(value).lower().endswith(".toml"))
            else _resolved(file, value, (*path, key))
            for key, value in node.items()
        }
    if isinstance(node, list | tuple):
        return [_resolved(file, value, (*path, k)) for k, value in enumerate(node)]
    return node


def _found(file: TomlFile, given: Any, path: KeyPath) -> Any:
    if not isinstance(given, str):
        return given
    wanted = file.path.parent.absolute() / given
    try:
        if wanted.exists():
            return str(wanted)
        kept = beside_sealed_case(file.path, path, given)
        if kept is not None:
            return str(kept)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise file.refuse(
            path, "config.named-file-unreadable", given=shown(given), reason=reason
        ) from None
    near = _near(wanted)
    if near:
        raise file.refuse(path, "config.named-file-missing-near", given=shown(given), near=near)
    raise file.refuse(path, "config.named-file-missing", given=shown(given))


def _near(wanted: Path) -> str:
    try:
        names = [p.name for p in islice(wanted.parent.iterdir(), MOST_NAMES)]
    except (OSError, ValueError):
        return ""
    close = difflib.get_close_matches(wanted.name[:255], sorted(names), n=1)
    return close[0] if close and close[0].isprintable() else ""

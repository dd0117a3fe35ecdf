"""Resolve the files that a case names, relative to its folder."""

from __future__ import annotations

import difflib
import json
from itertools import islice
from pathlib import Path, PurePosixPath
from typing import Any

from strapdown.config.toml_file import KeyPath, TomlFile, shown

__all__ = ["beside_sealed_case", "with_absolute_paths"]


#: Largest number of names in a folder that are searched for a similar one.
MOST_NAMES = 10_000


def with_absolute_paths(file: TomlFile, table: dict[str, Any]) -> dict[str, Any]:
    """Resolve the files that a case names.

    Parameters
    ----------
    file : TomlFile
    table : dict
        Table of the case, already checked against its form.

    Returns
    -------
    dict
        With every ``path``, and every ``sensor`` that is a file, as an absolute path. For a case
        copied into a sealed folder, these are the copies in that folder.

    Raises
    ------
    ConfigError
        A file does not exist; the message names the line.
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


# Copies of a case's files in a sealed folder.


# Upper limit of the manifest size, bytes: one with hundreds of records is smaller.
LARGEST = 50_000_000


def beside_sealed_case(case: Path, key: KeyPath, given: str) -> Path | None:
    """Find the copy of a file that a case names, where the case is itself a copy.

    Parameters
    ----------
    case : Path
        As ``FOLDER/inputs/case/case.toml``.
    key : tuple
        Of the value in the case.
    given : str
        The value.

    Returns
    -------
    Path or None
        None if the case is not in a sealed folder, or the folder has no copy for this key with
        this file name.
    """
    home = case.absolute().parent
    if home.parent.name != "inputs":
        return None
    root = home.parent.parent
    manifest = root / "manifest.json"
    try:
        if not manifest.is_file() or manifest.stat().st_size > LARGEST:
            return None
        node: Any = json.loads(manifest.read_text(encoding="utf-8"))["configuration"]["case"]
        for step in key:
            node = node[step]
        if not isinstance(node, str):
            return None
        kept = (root / node).resolve()
        if not kept.is_relative_to((root / "inputs").resolve()) or not kept.exists():
            return None
    except (OSError, ValueError, KeyError, IndexError, TypeError, RecursionError):
        return None
    # An edited case may name another record under this key.
    named = PurePosixPath(given.replace("\\", "/")).name
    return kept if kept.name in (named, PurePosixPath(given).parent.name) else None

"""What pydantic finds in a file, in our words and with its line."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from strapdown.config.shown import shown, shown_key
from strapdown.config.spec import misfit
from strapdown.config.toml_file import TomlFile, place_of
from strapdown.config.toml_lines import KeyPath
from strapdown.errors import ConfigError, Finding

__all__ = ["explained"]


def explained(
    error: Any,
    file: TomlFile,
    *,
    place: Callable[[KeyPath], str] = place_of,
    tags: Mapping[str, Sequence[str]] | None = None,
    written: Mapping[KeyPath, KeyPath] | None = None,
    wanted: Callable[[KeyPath], str] | None = None,
) -> ConfigError:
    """Turn an error of pydantic into one of ours.

    Parameters
    ----------
    error : dict
        One of `ValidationError.errors`.
    file : TomlFile
    place : callable
        Says where a path is, as a person counts.
    tags : dict
        By the key that tells what a table is, what it may be.
    written : dict
        By the path of a field, the path under which the file has it, where it is another.
    wanted : callable
        Says of a path what is wanted there, for a key that is missing.
    """
    path, context = tuple(error["loc"]), error.get("ctx", {})
    # What was converted is told as the file has it.
    converted = _renamed(path, written or {}) != path
    given = _given(file, path, written or {}) if converted else error["input"]
    if error["type"] == "refused" and error["ctx"]["key"]:
        path = (*path, error["ctx"]["key"])
    elif error["type"] in ("union_tag_not_found", "union_tag_invalid"):
        path = (*path, context["discriminator"].strip("'"))
    elif error["type"] == "literal_error" and path[-1] == "[key]":
        path = path[:-1]
    finding = _found(error, path, given, tags or {}, wanted)
    return ConfigError(
        finding,
        file=file.path.name,
        line=file.line(_in_file(file, path, written or {})),
        quantity=place(_renamed(path, written or {})),
    )


def _found(
    error: Any,
    path: KeyPath,
    given: Any,
    tags: Mapping[str, Sequence[str]],
    wanted: Callable[[KeyPath], str] | None,
) -> Finding:
    """Return what is wrong, without a location."""
    context, name = error.get("ctx", {}), str(path[-1]) if path else ""
    match error["type"]:
        case "missing":
            return _missing(path, wanted)
        case "union_tag_not_found":
            return Finding("config.choice-missing", key=name, known=tags[name])
        case "union_tag_invalid":
            known, tag = re.findall(r"'(\w+)'", context["expected_tags"]), str(context["tag"])
            return Finding(
                "config.unknown-choice", given=f"'{shown_key(tag)}'", word=tag, known=known
            )
        case "literal_error":
            known = re.findall(r"'([^']+)'", context["expected"])
            return Finding(
                "config.unknown-choice", given=shown(given), word=str(given), known=known
            )
        case "model_type" | "dict_type":
            return Finding("config.not-a-table", given=shown(given), header=_header(path))
        case "tuple_type" | "list_type" if isinstance(given, dict):
            return Finding("config.one-table-for-list", header=_header(path))
        case "tuple_type" | "list_type":
            key = shown_key(name) if isinstance(path[-1], str) else "key"
            return Finding("config.not-a-list", given=shown(given), key=key)
        case "string_type" if isinstance(given, int | float):
            return Finding("config.number-for-text", key=name, given=shown(given))
    return misfit(error, given)


def _missing(path: KeyPath, wanted: Callable[[KeyPath], str] | None) -> Finding:
    if isinstance(path[-1], int):
        return Finding("config.component-missing")
    known = wanted(path) if wanted else ""
    if known:
        return Finding("config.key-missing", wanted=known)
    return Finding("config.key-missing-with-unit", key=path[-1])


def _header(path: KeyPath) -> str:
    return ".".join(shown_key(part) for part in path if isinstance(part, str))


def _renamed(path: KeyPath, written: Mapping[KeyPath, KeyPath]) -> KeyPath:
    for end in range(len(path), 0, -1):
        if path[:end] in written:
            return (*written[path[:end]], *path[end:])
    return path


def _in_file(file: TomlFile, path: KeyPath, written: Mapping[KeyPath, KeyPath]) -> KeyPath:
    """The path without what pydantic puts into it: tags that tell which of several it is."""
    kept: list[str | int] = []
    node: Any = file.table
    renamed = _renamed(path, written)
    for k, part in enumerate(renamed):
        inside = (isinstance(node, dict) and part in node) or (
            isinstance(node, list) and isinstance(part, int) and part < len(node)
        )
        if inside:
            node = node[part]
        if inside or k == len(renamed) - 1:
            kept.append(part)
    return tuple(kept)


def _given(file: TomlFile, path: KeyPath, written: Mapping[KeyPath, KeyPath]) -> Any:
    """What the file has there, in its own unit."""
    node: Any = file.table
    for part in _in_file(file, path, written):
        try:
            node = node[part]
        except (KeyError, IndexError, TypeError):
            return None
    return node

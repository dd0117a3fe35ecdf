"""What pydantic finds in a file, in our words and with its line."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from strapdown.config.shown import shown, shown_key
from strapdown.config.toml_file import TomlFile, place_of
from strapdown.config.toml_lines import KeyPath
from strapdown.errors import ConfigError, nearest

__all__ = ["explained"]

_REMEDIES = {
    "string_type": 'write text, in quotation marks: "…"',
    "float_type": "write a number, without quotation marks and without a unit",
    "int_type": "write a whole number, without quotation marks",
    "bool_type": "write true or false, without quotation marks",
    "finite_number": "give a finite number",
}
_OTHER = "give another value; the name of the key tells its unit"


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
    if error["type"] == "refused":
        what, remedy = context["what"], context["remedy"]
        path = (*path, context["key"]) if context["key"] else path
    elif error["type"] == "missing":
        what, remedy = "it is missing", _for_missing(path, wanted)
    elif error["type"] == "union_tag_not_found":
        key = context["discriminator"].strip("'")
        path = (*path, key)
        what = "it is missing"
        remedy = f"write {key} = …; known: {', '.join((tags or {})[key])}"
    elif error["type"] == "union_tag_invalid":
        path = (*path, context["discriminator"].strip("'"))
        known = re.findall(r"'(\w+)'", context["expected_tags"])
        tag = str(context["tag"])
        what, remedy = f"there is no '{shown_key(tag)}'", nearest(tag, known)
    elif error["type"] == "literal_error":
        path = path[:-1] if path[-1] == "[key]" else path
        known = re.findall(r"'([^']+)'", context["expected"])
        what, remedy = f"there is no {shown(given)}", nearest(str(given), known)
    elif error["type"] in ("model_type", "dict_type"):
        what = f"{shown(given)} is no table"
        remedy = f"write [{_header(path)}], and its keys in the lines below"
    elif error["type"] in ("tuple_type", "list_type"):
        what, remedy = _no_list(path, given)
    else:
        what = f"{shown(given)} does not fit: {error['msg'].lower()}"
        remedy = _REMEDIES.get(error["type"], _OTHER)
        if error["type"] == "string_type" and isinstance(given, int | float):
            remedy = f'write it in quotation marks: {path[-1]} = "{shown(given)}"'
    where = _in_file(file, path, written or {})
    quantity = place(_renamed(path, written or {}))
    return ConfigError(
        "config.message",
        file=file.path.name,
        line=file.line(where),
        quantity=quantity,
        message=what,
        remedy_text=remedy,
    )


def _for_missing(path: KeyPath, wanted: Callable[[KeyPath], str] | None) -> str:
    if isinstance(path[-1], int):
        return "give a number for each component"
    known = wanted(path) if wanted else ""
    return known or f"write {path[-1]} = …; its name tells its unit"


def _no_list(path: KeyPath, given: Any) -> tuple[str, str]:
    name = path[-1] if isinstance(path[-1], str) else "key"
    if isinstance(given, dict):
        header = _header(path)
        return "there may be several, and this is one", f"write [[{header}]], in double brackets"
    return f"{shown(given)} is no list", f"write {shown_key(name)} = [ … , … ]"


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

"""The file of a chain as its specification: quantities in their units, paths found, lines named."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

from pydantic import ValidationError

from strapdown.config.case_keys import canonical
from strapdown.config.case_paths import with_absolute_paths
from strapdown.config.crash_checks import Written
from strapdown.config.spec import TableSpec, misfit
from strapdown.config.toml_file import KeyPath, TomlFile, place_of, read_toml, shown, shown_key
from strapdown.config.wanted import Wanted, wanted_at
from strapdown.errors import ConfigError, Finding

__all__ = [
    "PLACEHOLDER",
    "explained",
    "filled_form",
    "read_named_toml",
    "refuse_placeholders",
    "together",
]


Form = TypeVar("Form", bound=TableSpec)


def read_named_toml(path: Path, kind: str, wanted: Wanted) -> TomlFile:
    """Read a file that has nothing open, and leaves its name to be that of the file.

    Parameters
    ----------
    path : Path
    kind : str
        Kind of the file, for messages: ``run``.
    wanted : Wanted

    Raises
    ------
    ConfigError
        There is no such file, it is no TOML, has a name, or a value is still ``"?"``.
    """
    file = read_toml(path)
    if "name" in file.table:
        raise file.refuse(("name",), "config.named-after-file", kind=kind)
    refuse_placeholders(file, wanted.at)
    return file


def filled_form(
    file: TomlFile,
    form: type[Form],
    wanted: Wanted,
    *,
    files: bool,
    place: Callable[[KeyPath], str] = place_of,
    tags: Mapping[str, Sequence[str]] | None = None,
) -> tuple[Form, Written]:
    """Fill a form with what a file has.

    Parameters
    ----------
    file : TomlFile
    form : type
        The specification.
    wanted : Wanted
    files : bool
        Whether the files that it names must be there, and become absolute paths.
    place, tags
        As `explained` takes them.

    Returns
    -------
    spec : TableSpec
        Named after the file.
    written : Written
        The file, asked by the names of fields.

    Raises
    ------
    ConfigError
        A key is not known or missing, a value does not fit, or a file is not there; the message
        names the line, or those of all.
    """
    table, names = canonical(file, form)
    try:
        spec = form(**{**table, "name": file.path.stem})
        if files:
            whole = spec.model_dump(serialize_as_any=True)
            spec = form(**with_absolute_paths(file, whole))
    except ValidationError as error:
        raise together(
            [
                explained(one, file, place=place, tags=tags, written=names, wanted=wanted.remedy)
                for one in error.errors()
            ]
        ) from None
    return spec, Written(file, names)


# What a case leaves open: values that only the user can know, written as a question mark.


#: Stands where only the user can know.
PLACEHOLDER = "?"
#: More of them are counted, not listed.
MOST = 60


def refuse_placeholders(file: TomlFile, wanted_of: Callable[[KeyPath], str] = wanted_at) -> None:
    """Name every value that is still open.

    Raises
    ------
    ConfigError
        There are some; the message has the line of each, and what is wanted there.
    """
    # A vector that is open in each component is one.
    open_keys = list(dict.fromkeys(_open(file.table, ())))
    if not open_keys:
        return
    values = [
        Finding(
            "config.open-value",
            line=file.line(path),
            quantity=place_of(path),
            wanted=wanted_of(path),
        )
        for path in open_keys[:MOST]
    ]
    count = len(open_keys)
    code = "config.open-values" if count > 1 else "config.one-open-value"
    if count > MOST:
        code = "config.many-open-values"
    raise ConfigError(
        code,
        file=file.path.name,
        count=count,
        more=count - len(values),
        values=values,
        placeholder=PLACEHOLDER,
    )


def _open(node: Any, path: KeyPath) -> Iterator[KeyPath]:
    if isinstance(node, dict):
        for key, value in node.items():
            yield from _open(value, (*path, key))
    elif isinstance(node, list):
        for k, value in enumerate(node):
            if isinstance(value, dict):
                yield from _open(value, (*path, k))
            else:
                yield from (path for _ in _open(value, path))
    elif isinstance(node, str) and node.strip() == PLACEHOLDER:
        yield path


# What pydantic finds in a file, in our words and with its line.


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


# Several faults of one file as one error.


def together(found: Sequence[ConfigError]) -> ConfigError:
    """Return several errors as one.

    Parameters
    ----------
    found : sequence of ConfigError
        One or more, of one file.

    Returns
    -------
    ConfigError
        In the order of the lines; a single one as it is.
    """
    if len(found) == 1:
        return found[0]
    faults = sorted((error.finding for error in found), key=lambda f: f.line or 0)
    return ConfigError("config.several", file=faults[0].file, count=len(faults), faults=faults)

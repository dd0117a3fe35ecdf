"""Build a specification from a file: units converted, paths resolved, errors with lines."""

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
    """Read a complete file that leaves the name to be that of the file.

    Parameters
    ----------
    path : Path
    kind : str
        Kind of the file, for messages: ``run``.
    wanted : Wanted

    Raises
    ------
    ConfigError
        The file is missing or not TOML, has a name, or a value is still ``"?"``.
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
    """Fill a form with the values of a file.

    Parameters
    ----------
    file : TomlFile
    form : type
        The specification.
    wanted : Wanted
    files : bool
        Whether the files that it names must exist and become absolute paths.
    place, tags
        As in `explained`.

    Returns
    -------
    spec : TableSpec
        Named after the file.
    written : Written
        The file, looked up by the names of fields.

    Raises
    ------
    ConfigError
        A key is unknown or missing, a value does not fit, or a file does not exist; the message
        names the line, or all lines.
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


# Open values of a case: known only to the user, written as a question mark.


#: Placeholder for a value that only the user knows.
PLACEHOLDER = "?"
#: Above this number they are counted, not listed.
MOST = 60


def refuse_placeholders(file: TomlFile, wanted_of: Callable[[KeyPath], str] = wanted_at) -> None:
    """Report every value that is still open.

    Raises
    ------
    ConfigError
        Some values are open; the message has the line and the meaning of each.
    """
    # A vector with all components open counts as one.
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


# Convert pydantic errors to errors with a line and this package's messages.


def explained(
    error: Any,
    file: TomlFile,
    *,
    place: Callable[[KeyPath], str] = place_of,
    tags: Mapping[str, Sequence[str]] | None = None,
    written: Mapping[KeyPath, KeyPath] | None = None,
    wanted: Callable[[KeyPath], str] | None = None,
) -> ConfigError:
    """Convert a pydantic error.

    Parameters
    ----------
    error : dict
        One of `ValidationError.errors`.
    file : TomlFile
    place : callable
        Describes the position of a path for users.
    tags : dict
        By tag key, the possible values.
    written : dict
        Path of a field to its path in the file, where they differ.
    wanted : callable
        Describes the expected value of a missing key, by path.
    """
    path, context = tuple(error["loc"]), error.get("ctx", {})
    # A converted value is reported as written in the file.
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
    """Return the finding without a location."""
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
    """Path without pydantic's union tags."""
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
    """The value as the file has it, in its own unit."""
    node: Any = file.table
    for part in _in_file(file, path, written):
        try:
            node = node[part]
        except (KeyError, IndexError, TypeError):
            return None
    return node


# Combine several errors of one file.


def together(found: Sequence[ConfigError]) -> ConfigError:
    """Return several errors as one.

    Parameters
    ----------
    found : sequence of ConfigError
        One or more, of one file.

    Returns
    -------
    ConfigError
        In the order of the lines; a single one is returned unchanged.
    """
    if len(found) == 1:
        return found[0]
    faults = sorted((error.finding for error in found), key=lambda f: f.line or 0)
    return ConfigError("config.several", file=faults[0].file, count=len(faults), faults=faults)

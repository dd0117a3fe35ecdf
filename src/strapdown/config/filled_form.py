"""The file of a chain as its specification: quantities in their units, paths found, lines named."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TypeVar

from pydantic import ValidationError

from strapdown.config.case_keys import canonical
from strapdown.config.case_paths import with_absolute_paths
from strapdown.config.crash_checks import Written
from strapdown.config.explain import explained
from strapdown.config.placeholders import refuse_placeholders
from strapdown.config.spec import TableSpec
from strapdown.config.together import together
from strapdown.config.toml_file import TomlFile, place_of, read_toml
from strapdown.config.toml_lines import KeyPath
from strapdown.config.wanted import Wanted

__all__ = ["filled_form", "read_named_toml"]

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

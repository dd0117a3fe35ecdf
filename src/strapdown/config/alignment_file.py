"""An alignment read from its file, or from what is sealed: the forms that its kinds have."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from pydantic import create_model

from strapdown.config.alignment import AlignmentSpec, CoarseSpec, FineSpec, PrefilterSpec
from strapdown.config.alignment_checks import check_alignment
from strapdown.config.alignment_wanted import ALIGNMENT_WANTED
from strapdown.config.choice import ChoiceSpec, as_table, choice_form, field_of
from strapdown.config.filled_form import filled_form, read_named_toml
from strapdown.config.slots import SLOTS
from strapdown.config.toml_file import TomlFile

__all__ = ["STAGES", "alignment_spec", "read_alignment_spec"]

#: Stages that are modules, by table: what the table has beside the options, and the kind that
#: stands there where none is named.
STAGES: dict[str, tuple[type[ChoiceSpec], str]] = {
    "prefilter": (PrefilterSpec, "none"),
    "coarse": (CoarseSpec, "inertial_frame"),
    "fine": (FineSpec, "filter"),
}
#: Stages that a chain can do without, by the kind ``none``.
MAY_BE_EMPTY = ("prefilter", "fine")


def alignment_form(table: Mapping[str, Any], file: TomlFile | None = None) -> type[AlignmentSpec]:
    """The specification with the options of the kinds that a table names.

    Raises
    ------
    ConfigError
        There is no such kind.
    """
    stages: dict[str, Any] = {}
    for name, (base, default) in STAGES.items():
        given = table.get(name)
        written = given if isinstance(given, Mapping) else {}
        form = choice_form(
            SLOTS[name],
            written,
            base,
            default=default,
            empty=name in MAY_BE_EMPTY,
            file=file,
            path=(name,),
        )
        stages[name] = field_of(form, {})
    return create_model("Alignment", __base__=AlignmentSpec, **stages)


def alignment_spec(table: Mapping[str, Any]) -> AlignmentSpec:
    """Make a specification of plain data, as a command or a sealed folder has it.

    Parameters
    ----------
    table : mapping

    Returns
    -------
    AlignmentSpec

    Raises
    ------
    ConfigError
        There is no such kind, or a module refuses its options.
    ValidationError
        The table has another form.
    """
    whole = _with_kinds(table)
    spec = alignment_form(whole).model_validate(whole)
    check_alignment(spec)
    return spec


def read_alignment_spec(path: str | Path, *, files: bool = True) -> AlignmentSpec:
    """Read the file of an alignment.

    Parameters
    ----------
    path : str or Path
    files : bool
        Whether the files that it names must be there, and become absolute paths; else only the
        form is checked.

    Returns
    -------
    AlignmentSpec
        Named after the file.

    Raises
    ------
    ConfigError
        There is no such file, it is no TOML, a key is not known, missing or still ``"?"``, a value
        does not fit, or the parts do not go together; the message names the line.
    """
    file = read_named_toml(Path(path), "alignment", ALIGNMENT_WANTED)
    file = replace(file, table=_with_kinds(file.table))
    form = alignment_form(file.table, file)
    spec, written = filled_form(file, form, ALIGNMENT_WANTED, files=files)
    check_alignment(spec, written)
    return spec


def _with_kinds(table: Mapping[str, Any]) -> dict[str, Any]:
    out = dict(table)
    for name, (_, default) in STAGES.items():
        if name in out:
            out[name] = as_table(SLOTS[name], out[name], default)
    return out

"""A run of navigation read from its file, or from what is sealed: the forms that its kinds have."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from pydantic import BaseModel, create_model

from strapdown.config.alignment import PrefilterSpec
from strapdown.config.choice import ChoiceSpec, as_table, choice_form, field_of, with_kinds
from strapdown.config.filled_form import filled_form, read_named_toml
from strapdown.config.motions import KINDS, MANOEUVRES
from strapdown.config.navigation import (
    AidSpec,
    CoarseModeSpec,
    DampingSpec,
    FilterSpec,
    FineModeSpec,
    MechanizationSpec,
    NavigationSimulationTable,
    NavigationSpec,
    ReceiverTable,
    RecorderSpec,
    SmootherSpec,
)
from strapdown.config.navigation_checks import check_navigation
from strapdown.config.navigation_wanted import NAVIGATION_WANTED
from strapdown.config.slots import SLOTS
from strapdown.config.spec import TableSpec
from strapdown.config.state_tables import StatesTable
from strapdown.config.toml_file import TomlFile, place_of
from strapdown.config.toml_lines import KeyPath
from strapdown.errors import ConfigError, Finding

__all__ = ["NAVIGATION_STAGES", "navigation_spec", "read_navigation_spec", "stage_default"]

#: Stages that are modules, by table: what the table has beside the options, the kind that stands
#: there where none is named, and whether a chain can do without it, by the kind ``none``.
NAVIGATION_STAGES: dict[str, tuple[type[ChoiceSpec], str, bool]] = {
    "prefilter": (PrefilterSpec, "none", True),
    "coarse": (CoarseModeSpec, "inertial_frame", True),
    "fine": (FineModeSpec, "filter", True),
    "mechanization": (MechanizationSpec, "ned", False),
    "filter": (FilterSpec, "error_state", False),
    "damping": (DampingSpec, "feedback", False),
    "smoother": (SmootherSpec, "none", True),
    "recorder": (RecorderSpec, "interval", False),
}
#: Of a start that is known nothing is aligned.
ALIGNMENTS = ("coarse", "fine")
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")


def stage_default(name: str, table: Mapping[str, Any]) -> str:
    """The kind of a stage where its table names none."""
    if name in ALIGNMENTS and table.get("start") is not None:
        return "none"
    return NAVIGATION_STAGES[name][1]


def navigation_form(table: Mapping[str, Any], file: TomlFile | None = None) -> type[NavigationSpec]:
    """The specification with the options of the kinds that a table names.

    Raises
    ------
    ConfigError
        There is no such kind, or an aid has no name that can be used.
    """
    parts: dict[str, Any] = {}
    for name, (base, _, empty) in NAVIGATION_STAGES.items():
        given = table.get(name)
        form = choice_form(
            SLOTS[name],
            given if isinstance(given, Mapping) else {},
            base,
            default=stage_default(name, table),
            empty=empty,
            file=file,
            path=(name,),
        )
        parts[name] = field_of(form, {"kind": stage_default(name, table)})
    parts["states"] = (StatesTable, StatesTable())
    parts["aiding"] = field_of(_aiding_form(table, file), {})
    if isinstance(table.get("simulation"), Mapping):
        parts["simulation"] = (_simulation_form(table, file), ...)
    return create_model("Navigation", __base__=NavigationSpec, **parts)


def _aiding_form(table: Mapping[str, Any], file: TomlFile | None) -> type[TableSpec]:
    given = table.get("aiding")
    forms: dict[str, Any] = {}
    for name, aid in given.items() if isinstance(given, Mapping) else ():
        path = ("aiding", name)
        _refuse_name(name, path, file)
        slot = SLOTS["aiding"]
        form = choice_form(
            slot,
            aid if isinstance(aid, Mapping) else {},
            AidSpec,
            default=name if name in slot.entries else "",
            file=file,
            path=path,
        )
        forms[name] = (form, ...)
    return create_model("Aiding", __base__=TableSpec, **forms)


def _simulation_form(table: Mapping[str, Any], file: TomlFile | None) -> type[TableSpec]:
    """The simulation with a receiver for each aid that takes fixes and names no file."""
    aiding = table.get("aiding")
    names = {
        name
        for name, aid in (aiding.items() if isinstance(aiding, Mapping) else ())
        if isinstance(aid, Mapping) and aid.get("kind", name) == "gnss" and not aid.get("path")
    }
    written = table["simulation"].get("gnss")
    for name in written if isinstance(written, Mapping) else ():
        if name not in names:
            path: KeyPath = ("simulation", "gnss", str(name))
            finding = Finding("config.receiver-without-aid", name=name)
            if file is None:
                raise ConfigError(finding, quantity=place_of(path))
            raise file.refuse(path, finding)
    forms: dict[str, Any] = {name: (ReceiverTable, ReceiverTable()) for name in sorted(names)}
    receivers = create_model("Receivers", __base__=TableSpec, **forms)
    return create_model(
        "Simulation", __base__=NavigationSimulationTable, gnss=(receivers, receivers())
    )


def _refuse_name(name: Any, path: KeyPath, file: TomlFile | None) -> None:
    if isinstance(name, str) and _NAME.fullmatch(name) and not hasattr(BaseModel, name):
        return
    reserved = isinstance(name, str) and hasattr(BaseModel, name)
    finding = Finding("config.aid-name-reserved" if reserved else "config.bad-aid-name")
    if file is None:
        raise ConfigError(finding, quantity=place_of(path))
    raise file.refuse(path, finding)


def navigation_spec(table: Mapping[str, Any]) -> NavigationSpec:
    """Make a specification of plain data, as a command or a sealed folder has it.

    Parameters
    ----------
    table : mapping

    Returns
    -------
    NavigationSpec

    Raises
    ------
    ConfigError
        There is no such kind, or the parts do not go together.
    ValidationError
        The table has another form.
    """
    whole = _with_kinds(table)
    spec = navigation_form(whole).model_validate(whole)
    check_navigation(spec)
    return spec


def read_navigation_spec(path: str | Path, *, files: bool = True) -> NavigationSpec:
    """Read the file of a run of navigation.

    Parameters
    ----------
    path : str or Path
    files : bool
        Whether the files that it names must be there, and become absolute paths; else only the
        form is checked.

    Returns
    -------
    NavigationSpec
        Named after the file.

    Raises
    ------
    ConfigError
        There is no such file, it is no TOML, a key is not known, missing or still ``"?"``, a value
        does not fit, or the parts do not go together; the message names the line.
    """
    file = read_named_toml(Path(path), "run", NAVIGATION_WANTED)
    file = replace(file, table=_with_kinds(file.table))
    spec, written = filled_form(
        file,
        navigation_form(file.table, file),
        NAVIGATION_WANTED,
        files=files,
        place=_place,
        tags={"kind": KINDS, "do": MANOEUVRES},
    )
    check_navigation(spec, written)
    return spec


def _place(parts: KeyPath) -> str:
    """Where it stands; which of the motions it is goes without saying."""
    if parts[:2] == ("simulation", "motion") and len(parts) > 3 and parts[2] in KINDS:
        parts = (*parts[:2], *parts[3:])
    return place_of(parts)


def _with_kinds(table: Mapping[str, Any]) -> dict[str, Any]:
    """A table in which a module that is named by its kind alone is a table, too."""
    out = dict(table)
    for name in NAVIGATION_STAGES:
        if name in out:
            out[name] = as_table(SLOTS[name], out[name], stage_default(name, table))
    aiding = out.get("aiding")
    if isinstance(aiding, Mapping):
        out["aiding"] = {
            name: with_kinds(SLOTS["aiding"], aid, name if isinstance(name, str) else "")
            for name, aid in aiding.items()
        }
    return out

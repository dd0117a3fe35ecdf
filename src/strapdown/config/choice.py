"""A module chosen for a slot, as a person writes it: its kind, and its options with their units."""

from __future__ import annotations

import types
from collections.abc import Mapping
from dataclasses import MISSING, fields
from typing import Any, Union, get_args, get_origin

from pydantic import StrictBool, StrictInt, StrictStr, create_model

from strapdown.config.crash_case import Number
from strapdown.config.shown import shown
from strapdown.config.slots import Option, Slot, options_of
from strapdown.config.spec import TableSpec
from strapdown.config.toml_file import TomlFile
from strapdown.config.toml_lines import KeyPath
from strapdown.errors import ConfigError, Finding

__all__ = ["ChoiceSpec", "choice_form", "make_choice"]

_STRICT = {float: Number, int: StrictInt, bool: StrictBool, str: StrictStr}


class ChoiceSpec(TableSpec):
    """A module of a slot; its options are further fields."""

    kind: str


def choice_form(
    slot: Slot,
    given: Mapping[str, Any],
    base: type[ChoiceSpec] = ChoiceSpec,
    *,
    default: str = "",
    empty: bool = False,
    file: TomlFile | None = None,
    path: KeyPath = (),
) -> type[ChoiceSpec]:
    """The form of what is written for a slot: the options of the kind that it names.

    Parameters
    ----------
    slot : Slot
    given : mapping
        Its table.
    base : type
        What the table has beside the module's options.
    default : str
        Kind where the table names none.
    empty : bool
        Whether the slot may stay empty, by the kind ``none``.
    file, path : TomlFile, tuple
        Where the table stands, for messages.

    Raises
    ------
    ConfigError
        There is no such kind.
    """
    kind = given.get("kind", default)
    if kind == NONE and empty and NONE not in slot.entries:
        return create_model("none", __base__=base, kind=(StrictStr, NONE))
    if not isinstance(kind, str) or kind not in slot.entries:
        raise _unknown(slot, kind, empty, file, path)
    entry = slot.entries[kind]
    known: dict[str, Any] = {"kind": (StrictStr, kind)}
    for option in options_of(entry):
        known[option.key] = _field(option, given, file, (*path, option.key))
    return create_model(kind, __base__=base, **known)


#: Kind of an empty slot.
NONE = "none"


def _unknown(
    slot: Slot, kind: Any, empty: bool, file: TomlFile | None, path: KeyPath
) -> ConfigError:
    kinds = [*slot.entries, *([NONE] if empty else [])]
    finding = (
        Finding("config.unknown-choice", given=shown(kind), word=str(kind), known=kinds)
        if kind
        else Finding("config.choice-missing", key="kind", known=kinds)
    )
    if file is None:
        return ConfigError(finding, quantity=f"{slot.name}, kind")
    return file.refuse((*path, "kind"), finding)


def _field(
    option: Option, given: Mapping[str, Any], file: TomlFile | None, path: KeyPath
) -> tuple[Any, Any]:
    if option.group is not None:
        form = group_form(option.group)
        return form, form()
    if option.slot is None:
        default = ... if option.default is MISSING else option.default
        return strict(option.hint), default
    inner = given.get(option.key)
    nothing = option.default is None
    if inner is None and nothing:
        return (ChoiceSpec | None), None
    written = inner if isinstance(inner, Mapping) else {} if inner is None else {"kind": inner}
    kind = NONE if nothing else option.default if isinstance(option.default, str) else ""
    form = choice_form(option.slot, written, default=kind, empty=nothing, file=file, path=path)
    if inner is None and kind:
        return form, form(kind=kind)
    return form, ...


def group_form(group: type) -> type[TableSpec]:
    """The form of a table of options that belong together."""
    known: dict[str, Any] = {o.key: (strict(o.hint), o.default) for o in options_of(group)}
    return create_model(group.__name__, __base__=TableSpec, **known)


def strict(hint: Any) -> Any:
    """The hint with numbers that are numbers, and no text or truth that looks like one."""
    if hint in _STRICT:
        return _STRICT[hint]
    origin, parts = get_origin(hint), get_args(hint)
    if origin in (Union, types.UnionType):
        return Union[tuple(strict(p) for p in parts)]  # noqa: UP007
    if origin is tuple:
        return tuple[tuple(p if p is ... else strict(p) for p in parts)]  # type: ignore[misc]
    return hint


def with_kinds(slot: Slot, given: Any, default: str = "") -> Any:
    """A table in which a module that is named by its kind alone is a table, too."""
    if not isinstance(given, dict):
        return given
    entry = slot.entries.get(given.get("kind", default))
    out = dict(given)
    for option in options_of(entry) if entry is not None else ():
        inner = out.get(option.key)
        if option.slot is None or inner is None:
            continue
        kind = option.default if isinstance(option.default, str) else ""
        out[option.key] = as_table(option.slot, inner, kind)
    return out


def as_table(slot: Slot, given: Any, default: str) -> Any:
    """As `with_kinds`, of a module that may itself be named by its kind alone."""
    return with_kinds(slot, {"kind": given} if isinstance(given, str) else given, default)


def field_of(form: type[TableSpec], usual: Mapping[str, Any]) -> tuple[Any, Any]:
    """A field of a form, which may be left out where nothing in it must be written."""
    needed = any(one.is_required() for name, one in form.model_fields.items() if name not in usual)
    return form, ... if needed else form.model_validate(usual)


def make_choice(spec: ChoiceSpec, slot: Slot, given: Mapping[str, Any]) -> Any:
    """Make the module that a specification names.

    Parameters
    ----------
    spec : ChoiceSpec
    slot : Slot
    given : mapping
        Fields that the chain fills, by name.

    Returns
    -------
    object
        An instance of the slot's base; None where the slot stays empty.

    Raises
    ------
    ConfigError
        An option is outside its range; its quantity names the option.
    """
    if spec.kind == NONE and NONE not in slot.entries:
        return None
    entry = slot.entries[spec.kind]
    values: dict[str, Any] = {}
    for option in options_of(entry):
        value = getattr(spec, option.key)
        if option.group is not None:
            values[option.field] = _group(option, value)
        elif option.slot is None:
            values[option.field] = value
        elif isinstance(value, ChoiceSpec):
            if option.takes_class:
                values[option.field] = option.slot.entries[value.kind]
                continue
            try:
                values[option.field] = make_choice(value, option.slot, given)
            except ConfigError as error:
                raise _inside(error, option.key) from None
    own = {one.name for one in fields(entry)}
    values |= {name: value for name, value in given.items() if name in own}
    try:
        return entry(**values)
    except ConfigError as error:
        raise _keyed(error, entry) from None


def _group(option: Option, spec: TableSpec) -> Any:
    assert option.group is not None
    given = {one.field: getattr(spec, one.key) for one in options_of(option.group)}
    try:
        return option.group(**given)
    except ConfigError as error:
        raise _inside(_keyed(error, option.group), option.key) from None


def _inside(error: ConfigError, key: str) -> ConfigError:
    f = error.finding
    quantity = f"{key}, {f.quantity}" if f.quantity else key
    return error.replaced(quantity=quantity)


def _keyed(error: ConfigError, entry: type) -> ConfigError:
    """The error with the key of the configuration in place of the field."""
    f = error.finding
    keys = {o.field: o.key for o in options_of(entry)}
    quantity = keys.get(f.quantity or "", f.quantity)
    return error.replaced(quantity=quantity)

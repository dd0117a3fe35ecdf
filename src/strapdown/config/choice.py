"""Configuration of a module in a slot: its kind, and its options with units."""

from __future__ import annotations

import types
from collections.abc import Mapping
from dataclasses import MISSING, Field, dataclass, fields, is_dataclass
from typing import Any, Union, get_args, get_origin, get_type_hints

from pydantic import StrictBool, StrictInt, StrictStr, create_model

from strapdown.alignment.alignment import CoarseAlignment
from strapdown.alignment.coarse_alignments import COARSE_ALIGNMENTS
from strapdown.alignment.fine import FineAlignment
from strapdown.config.crash_case import Number
from strapdown.config.spec import TableSpec
from strapdown.config.toml_file import KeyPath, TomlFile, shown
from strapdown.errors import ConfigError, Finding
from strapdown.estimation.covariance import COVARIANCES, CovarianceForm, UpdateRule
from strapdown.estimation.error_model import ERROR_MODELS, ErrorModel
from strapdown.estimation.robust import INFLUENCES, UPDATE_RULES, Influence
from strapdown.mechanization import MECHANIZATIONS, Mechanization
from strapdown.navigation.filter_options import DAMPINGS, Correction, FilterOptions
from strapdown.navigation.measurements import AIDS
from strapdown.navigation.measurements.measurement import Measurement
from strapdown.navigation.recorder import RECORDERS, Recorder
from strapdown.navigation.smoother import SMOOTHERS, Smoother
from strapdown.plugins import WithPlugins
from strapdown.prefilter import PREFILTERS, Prefilter

__all__ = [
    "GIVEN",
    "SLOTS",
    "ChoiceSpec",
    "Option",
    "Slot",
    "choice_form",
    "make_choice",
    "options_of",
]


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
    """Form of the table of a slot, with the options of the kind that it names.

    Parameters
    ----------
    slot : Slot
    given : mapping
        Table of the slot.
    base : type
        Fields of the table besides the module's options.
    default : str
        Kind if the table names none.
    empty : bool
        Whether the slot may stay empty, with the kind ``none``.
    file, path : TomlFile, tuple
        Position of the table, for messages.

    Raises
    ------
    ConfigError
        The kind is unknown.
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
    """Form of a table of grouped options."""
    known: dict[str, Any] = {o.key: (strict(o.hint), o.default) for o in options_of(group)}
    return create_model(group.__name__, __base__=TableSpec, **known)


def strict(hint: Any) -> Any:
    """Type hint that accepts numbers only as numbers, not as text or booleans."""
    if hint in _STRICT:
        return _STRICT[hint]
    origin, parts = get_origin(hint), get_args(hint)
    if origin in (Union, types.UnionType):
        return Union[tuple(strict(p) for p in parts)]  # noqa: UP007
    if origin is tuple:
        return tuple[tuple(p if p is ... else strict(p) for p in parts)]  # type: ignore[misc]
    return hint


def with_kinds(slot: Slot, given: Any, default: str = "") -> Any:
    """Replace modules given by kind alone with tables."""
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
    """As `with_kinds`, also for the slot's own module."""
    return with_kinds(slot, {"kind": given} if isinstance(given, str) else given, default)


def field_of(form: type[TableSpec], usual: Mapping[str, Any]) -> tuple[Any, Any]:
    """Field of a form, optional if none of its own fields is required."""
    needed = any(one.is_required() for name, one in form.model_fields.items() if name not in usual)
    return form, ... if needed else form.model_validate(usual)


def make_choice(spec: ChoiceSpec, slot: Slot, given: Mapping[str, Any]) -> Any:
    """Create the module that a specification names.

    Parameters
    ----------
    spec : ChoiceSpec
    slot : Slot
    given : mapping
        Fields that the chain fills, by name.

    Returns
    -------
    object
        An instance of the slot's base; None for an empty slot.

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
    """The error with the key of the configuration instead of the field."""
    f = error.finding
    keys = {o.field: o.key for o in options_of(entry)}
    quantity = keys.get(f.quantity or "", f.quantity)
    return error.replaced(quantity=quantity)


# Slots of a chain and the modules for each, from their own literal tables.


@dataclass(frozen=True)
class Slot:
    """Slot of a chain, filled by a module.

    Attributes
    ----------
    name : str
        Table or key in a configuration.
    title : str
        Title for users.
    base : type
        Base class of its modules.
    entries : dict of str to type
        By ``kind``: dataclasses, whose fields are the options.
    """

    name: str
    title: str
    base: type
    entries: Mapping[str, type]


FINE_ALIGNMENTS: dict[str, type[FineAlignment]] = {"filter": FineAlignment}
FILTERS: dict[str, type[FilterOptions]] = {"error_state": FilterOptions}

SLOTS: dict[str, Slot] = {
    "prefilter": Slot("prefilter", "Pre-filters", Prefilter, PREFILTERS),
    "coarse": Slot("coarse", "Coarse alignments", CoarseAlignment, COARSE_ALIGNMENTS),
    "fine": Slot("fine", "Fine alignments", FineAlignment, FINE_ALIGNMENTS),
    "mechanization": Slot("mechanization", "Mechanizations", Mechanization, MECHANIZATIONS),
    "filter": Slot("filter", "Filters", FilterOptions, FILTERS),
    "error_model": Slot("error_model", "Error models", ErrorModel, ERROR_MODELS),
    "covariance": Slot("covariance", "Covariance forms", CovarianceForm, COVARIANCES),
    "update_rule": Slot("update_rule", "Update rules", UpdateRule, UPDATE_RULES),
    "influence": Slot("influence", "Influence functions", Influence, INFLUENCES),
    "aiding": Slot("aiding", "Aids", Measurement, WithPlugins(AIDS, "measurement", Measurement)),
    "damping": Slot("damping", "Dampings", Correction, DAMPINGS),
    "smoother": Slot("smoother", "Smoothers", Smoother, SMOOTHERS),
    "recorder": Slot("recorder", "Recorders", Recorder, RECORDERS),
}

#: Fields that the chain fills; users do not write them.
GIVEN = ("ellipsoid", "gyro_noise", "accel_noise", "name")
_PLAIN = (float, int, bool, str)
#: Units of options without a unit in their name, as the endings of keys; options of other modules
#: have the unit in their name or in the field's metadata: ``metadata={"unit": "s"}``.
UNITS = {
    "RobustWd.bandwidth": "hz",
    "attenuation": "db",
    "correlation_time": "s",
    "gravity": "m_per_s2",
    "height_limits": "m",
    "height_time_constant": "s",
    "interval": "s",
    "largest_speed": "m_per_s",
    "least_speed": "m_per_s",
    "lever_arm": "m",
    "rate": "hz",
}


@dataclass(frozen=True)
class Option:
    """One option of a module.

    Attributes
    ----------
    field : str
        Field of the module's dataclass.
    key : str
        Configuration key: the field with its unit (``metadata={"unit": "s"}``), or the name of
        the slot whose module it takes.
    hint : type
    default : object
        `dataclasses.MISSING` if required.
    slot : Slot or None
    takes_class : bool
        Whether the field takes a module's class instead of an instance.
    group : type or None
        Of a field that takes a dataclass of further options.
    """

    field: str
    key: str
    hint: Any
    default: Any
    slot: Slot | None = None
    takes_class: bool = False
    group: type | None = None

    @property
    def has_default(self) -> bool:
        """Whether the option may be omitted."""
        return self.default is not MISSING


def options_of(module: type) -> tuple[Option, ...]:
    """Options of a module, from the fields of its dataclass.

    Parameters
    ----------
    module : type
        An entry of a slot.

    Returns
    -------
    tuple of Option
        Without fields that are set neither by users nor by a slot.
    """
    hints = get_type_hints(module)
    found = []
    for one in fields(module):
        if not one.init or one.name in GIVEN:
            continue
        hint = hints[one.name]
        slot = _slot_of(hint)
        if slot is not None:
            found.append(Option(one.name, slot.name, hint, _kind(one, slot), slot, _of_class(hint)))
        elif is_dataclass(hint) and isinstance(hint, type) and _all_plain(hint):
            found.append(Option(one.name, one.name, hint, _default(one), group=hint))
        elif _plain(hint):
            unit = _unit(module, one)
            key = f"{one.name}_{unit}" if unit else one.name
            found.append(Option(one.name, key, hint, _default(one)))
    return tuple(found)


def _unit(module: type, one: Field[Any]) -> str | None:
    """Unit of an option without a unit in its name."""
    own = UNITS.get(f"{module.__name__}.{one.name}")
    return one.metadata.get("unit") or own or UNITS.get(one.name)


def _parts(hint: Any) -> tuple[Any, ...]:
    return get_args(hint) if get_origin(hint) in (Union, types.UnionType) else (hint,)


def _slot_of(hint: Any) -> Slot | None:
    for part in _parts(hint):
        inner = get_args(part)[0] if get_origin(part) is type else part
        for slot in SLOTS.values():
            if inner is slot.base:
                return slot
    return None


def _of_class(hint: Any) -> bool:
    return any(get_origin(part) is type for part in _parts(hint))


def _plain(hint: Any) -> bool:
    for part in _parts(hint):
        if part in (*_PLAIN, type(None)) or str(get_origin(part)) == "typing.Literal":
            continue
        if get_origin(part) is tuple and all(_plain(a) for a in get_args(part) if a is not ...):
            continue
        return False
    return True


def _all_plain(group: type) -> bool:
    hints = get_type_hints(group)
    return all(_plain(hints[one.name]) for one in fields(group))


def _default(one: Field[Any]) -> Any:
    if one.default_factory is not MISSING:
        return one.default_factory()
    return one.default


def _kind(one: Field[Any], slot: Slot) -> Any:
    """Default kind of the module; None for no module."""
    default = _default(one)
    if default is None or default is MISSING:
        return default
    module = default if isinstance(default, type) else type(default)
    return next((kind for kind, entry in slot.entries.items() if entry is module), None)

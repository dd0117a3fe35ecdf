"""Modules in the slots of a chain: tables discriminated by ``kind``, whose keys are its options.

A module is a dataclass in the table of its slot; its fields are its options. The configuration has
a specification for each, made when its kind is first named (`form_of`), so that an entry added at
run time or by a plug-in can be configured like those of the package. A key is the field with its
unit (``metadata={"unit": "s"}``), or the name of the slot whose module the field takes.
"""

from __future__ import annotations

import types
from collections.abc import Iterator, Mapping
from dataclasses import MISSING, Field, dataclass, fields, is_dataclass
from functools import cache
from typing import Annotated, Any, ClassVar, Union, get_args, get_origin, get_type_hints

import pydantic
from pydantic import (
    BeforeValidator,
    StrictBool,
    StrictInt,
    StrictStr,
    create_model,
    model_validator,
)

from strapdown.alignment.alignment import CoarseAlignment
from strapdown.alignment.coarse_alignments import COARSE_ALIGNMENTS
from strapdown.alignment.fine import FineAlignment
from strapdown.config.spec import Number, Spec, refuse
from strapdown.config.toml_file import shown
from strapdown.errors import ConfigError
from strapdown.estimation.covariance import COVARIANCES, CovarianceForm, UpdateRule
from strapdown.estimation.error_model import ERROR_MODELS, ErrorModel
from strapdown.estimation.robust import INFLUENCES, UPDATE_RULES, Influence
from strapdown.mechanization import MECHANIZATIONS, Mechanization
from strapdown.navigation.filter_options import DAMPINGS, Correction, FilterOptions
from strapdown.navigation.measurements import AIDS
from strapdown.navigation.measurements.measurement import Measurement
from strapdown.navigation.recorder import RECORDERS, Recorder
from strapdown.navigation.smoother import SMOOTHERS, RauchTungStriebel
from strapdown.plugins import WithPlugins
from strapdown.prefilter import PREFILTERS, Prefilter

#: Kind of an empty slot.
NONE = "none"


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
    slot.name: slot
    for slot in (
        Slot("prefilter", "Pre-filters", Prefilter, PREFILTERS),
        Slot("coarse", "Coarse alignments", CoarseAlignment, COARSE_ALIGNMENTS),
        Slot("fine", "Fine alignments", FineAlignment, FINE_ALIGNMENTS),
        Slot("mechanization", "Mechanizations", Mechanization, MECHANIZATIONS),
        Slot("filter", "Filters", FilterOptions, FILTERS),
        Slot("error_model", "Error models", ErrorModel, ERROR_MODELS),
        Slot("covariance", "Covariance forms", CovarianceForm, COVARIANCES),
        Slot("update_rule", "Update rules", UpdateRule, UPDATE_RULES),
        Slot("influence", "Influence functions", Influence, INFLUENCES),
        Slot("aiding", "Measurements", Measurement, WithPlugins(AIDS, "measurement", Measurement)),
        Slot("damping", "Dampings", Correction, DAMPINGS),
        Slot("smoother", "Smoothers", RauchTungStriebel, SMOOTHERS),
        Slot("recorder", "Recorders", Recorder, RECORDERS),
    )
}


# --- the table of a module ----------------------------------------------------------------


class _Made(Spec):
    """Options of a dataclass, which refuses what it cannot be made with."""

    entry: ClassVar[Any] = None

    def make(self, **given: Any) -> Any:
        """Create the module; None for an empty slot.

        `**given`: fields that the chain fills, of this module and of those in it.
        """
        if self.entry is None:
            return None
        values: dict[str, Any] = {}
        for option in options_of(self.entry):
            value = getattr(self, option.key)
            if isinstance(value, _Made):
                value = value.entry if option.takes_class else value.make(**given)
            values[option.field] = value
        own = {one.name for one in fields(self.entry)}
        return self.entry(**values, **{name: v for name, v in given.items() if name in own})

    @model_validator(mode="after")
    def _can_be_made(self) -> _Made:
        try:
            self.make()
        except ConfigError as error:
            keys = {option.field: option.key for option in options_of(self.entry)}
            name = (error.finding.quantity or "").partition(",")[0]
            found = error.finding.replace(quantity=None, file=None, line=None)
            raise refuse(keys.get(name, ""), found) from None
        return self


class ChoiceSpec(_Made):
    """A module of a slot; its options are further fields."""

    kind: str


@cache
def form_of(entry: type | None, kind: str, base: type[_Made]) -> type[_Made]:
    """Specification of a module: the fields of a base, and the module's options."""
    known: dict[str, Any] = {"kind": (StrictStr, kind)} if issubclass(base, ChoiceSpec) else {}
    if entry is not None:
        known |= {option.key: _field(option) for option in options_of(entry)}
    form = create_model(kind, __base__=base, **known)
    form.entry = entry
    return form


def _field(option: Option) -> tuple[Any, Any]:
    if option.group is not None:
        form = form_of(option.group, option.group.__name__, _Made)
        return form, pydantic.Field(default_factory=form)
    if option.slot is None:
        default: Any = ... if option.default is MISSING else option.default
        return _strict(option.hint), pydantic.Field(default, description=_MEANINGS.get(option.key))
    kind = option.default if isinstance(option.default, str) else ""
    kinds = Kinds(option.slot.name, kind, empty=option.default is None)
    hint = BeforeValidator(kinds)
    if option.default is None:
        return Annotated[ChoiceSpec | None, hint], None
    default = pydantic.Field({"kind": kind}, validate_default=True) if kind else ...
    return Annotated[ChoiceSpec, hint], default


_MEANINGS = {"heading_deg": "heading of the body, clockwise from north"}
_STRICT = {float: Number, int: StrictInt, bool: StrictBool, str: StrictStr}


def _strict(hint: Any) -> Any:
    """Type hint that accepts numbers only as numbers, not as text or booleans."""
    if hint in _STRICT:
        return _STRICT[hint]
    origin, parts = get_origin(hint), get_args(hint)
    if origin in (Union, types.UnionType):
        return Union[tuple(_strict(p) for p in parts)]  # noqa: UP007
    if origin is tuple:
        return tuple[tuple(p if p is ... else _strict(p) for p in parts)]  # type: ignore[misc]
    return hint


@dataclass(frozen=True)
class Kinds:
    """Validator of a table that is discriminated by its ``kind``, or is a kind alone.

    Parameters
    ----------
    slot : str
    default : str
        Kind of a table that names none.
    empty : bool
        Whether the slot may stay empty, with the kind ``none``.
    base : type
        Fields of the table besides the options of its module.
    """

    slot: str
    default: str = ""
    empty: bool = False
    base: type[ChoiceSpec] = ChoiceSpec

    def __call__(self, value: Any) -> Any:
        """Return the table as the specification of its kind."""
        given = {"kind": value} if isinstance(value, str) else value
        if not isinstance(given, Mapping):
            return given
        default = NONE if self.empty and not self.default else self.default
        kind = given.get("kind", default)
        return self.form(kind).model_validate({**given, "kind": kind})

    def form(self, kind: Any) -> type[_Made]:
        """Specification of a kind."""
        entries = SLOTS[self.slot].entries
        if isinstance(kind, str) and kind in entries:
            return form_of(entries[kind], kind, self.base)
        if self.empty and kind == NONE:
            return form_of(None, NONE, self.base)
        known = [*entries, *([NONE] if self.empty else [])]
        if not kind:
            raise refuse("kind", "config.choice-missing", key="kind", known=known)
        word = str(kind)
        raise refuse("kind", "config.unknown-choice", given=shown(kind), word=word, known=known)

    def forms(self) -> Iterator[type[_Made]]:
        """Yield the specifications of all kinds."""
        return (self.form(kind) for kind in SLOTS[self.slot].entries)


# --- options: the fields of a dataclass ---------------------------------------------------

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
        Key in a configuration.
    hint : type
    default : object
        `dataclasses.MISSING` if required; of a module its kind.
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


@cache
def options_of(module: type) -> tuple[Option, ...]:
    """Options of a module, without fields that are set neither by users nor by a slot."""
    hints = get_type_hints(module)
    found = []
    for one in fields(module):
        if not one.init or one.name in GIVEN:
            continue
        hint = hints[one.name]
        default = one.default if one.default_factory is MISSING else one.default_factory()
        parts = _members(hint)
        bases = [get_args(p)[0] if get_origin(p) is type else p for p in parts]
        slot = next((slot for slot in SLOTS.values() if slot.base in bases), None)
        if slot is not None:
            kind = default
            if default not in (None, MISSING):
                made = default if isinstance(default, type) else type(default)
                kind = next((kind for kind, entry in slot.entries.items() if entry is made), None)
            takes_class = any(get_origin(part) is type for part in parts)
            found.append(Option(one.name, slot.name, hint, kind, slot, takes_class))
        elif is_dataclass(hint) and isinstance(hint, type) and _all_plain(hint):
            found.append(Option(one.name, one.name, hint, default, group=hint))
        elif _plain(hint):
            unit = _unit(module, one)
            key = f"{one.name}_{unit}" if unit else one.name
            found.append(Option(one.name, key, hint, default))
    return tuple(found)


def _unit(module: type, one: Field[Any]) -> str | None:
    own = UNITS.get(f"{module.__name__}.{one.name}")
    return one.metadata.get("unit") or own or UNITS.get(one.name)


def _members(hint: Any) -> tuple[Any, ...]:
    return get_args(hint) if get_origin(hint) in (Union, types.UnionType) else (hint,)


def _plain(hint: Any) -> bool:
    return all(
        part in (*_PLAIN, type(None))
        or str(get_origin(part)) == "typing.Literal"
        or (get_origin(part) is tuple and all(_plain(a) for a in get_args(part) if a is not ...))
        for part in _members(hint)
    )


def _all_plain(group: type) -> bool:
    hints = get_type_hints(group)
    return all(_plain(hints[one.name]) for one in fields(group))

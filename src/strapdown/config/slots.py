"""Slots of a chain, and the modules that can stand in each: from their own literal tables."""

from __future__ import annotations

import types
from collections.abc import Mapping
from dataclasses import MISSING, Field, dataclass, fields, is_dataclass
from typing import Any, Union, get_args, get_origin, get_type_hints

from strapdown.aiding.aid import Aid
from strapdown.aiding.aids import AIDS
from strapdown.alignment.coarse import CoarseAlignment
from strapdown.alignment.coarse_alignments import COARSE_ALIGNMENTS
from strapdown.alignment.fine import FineAlignment
from strapdown.estimation.covariance import CovarianceForm
from strapdown.estimation.covariances import COVARIANCES
from strapdown.estimation.error_model import ErrorModel
from strapdown.estimation.error_models import ERROR_MODELS
from strapdown.estimation.influence import Influence
from strapdown.estimation.influences import INFLUENCES
from strapdown.estimation.update_rule import UpdateRule
from strapdown.estimation.update_rules import UPDATE_RULES
from strapdown.mechanization import MECHANIZATIONS, Mechanization
from strapdown.navigation.damping import DAMPINGS, Damping
from strapdown.navigation.filter_options import FilterOptions
from strapdown.navigation.recorder import RECORDERS, Recorder
from strapdown.navigation.smoother import SMOOTHERS, Smoother
from strapdown.plugins import WithPlugins
from strapdown.prefilter import PREFILTERS, Prefilter

__all__ = ["GIVEN", "SLOTS", "Option", "Slot", "options_of"]


@dataclass(frozen=True)
class Slot:
    """A place of a chain that a module stands in.

    Attributes
    ----------
    name : str
        The table, or the key, of a configuration.
    title : str
        For people.
    base : type
        What every module of it is.
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
    "aiding": Slot("aiding", "Aids", Aid, WithPlugins(AIDS, "measurement", Aid)),
    "damping": Slot("damping", "Dampings", Damping, DAMPINGS),
    "smoother": Slot("smoother", "Smoothers", Smoother, SMOOTHERS),
    "recorder": Slot("recorder", "Recorders", Recorder, RECORDERS),
}

#: Fields that a chain fills by itself, and no person writes.
GIVEN = ("ellipsoid", "gyro_noise", "accel_noise", "name")
_PLAIN = (float, int, bool, str)
#: Units of options whose names do not have them, as the endings of keys; another module's option
#: is named with its unit, or has it in its field's metadata: ``metadata={"unit": "s"}``.
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
        Of the module's dataclass.
    key : str
        Of a configuration: the field with its unit (``metadata={"unit": "s"}``), or the name of
        the slot whose module it takes.
    hint : type
    default : object
        `dataclasses.MISSING` where it must be written.
    slot : Slot or None
    takes_class : bool
        Whether the field takes a module's class, and no instance.
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
        """Whether it may be left out."""
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
        Fields that neither a person writes nor a slot fills are left out.
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
    """The unit of an option whose name does not have it."""
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
    """The kind of the module that stands there if nothing is written; None for no module."""
    default = _default(one)
    if default is None or default is MISSING:
        return default
    module = default if isinstance(default, type) else type(default)
    return next((kind for kind, entry in slot.entries.items() if entry is module), None)

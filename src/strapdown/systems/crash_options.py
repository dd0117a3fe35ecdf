"""What is asked of `reconstruct_crash`, checked before any work is done."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from strapdown.crash.entry import Entry
from strapdown.crash.event_rule import EventRule
from strapdown.crash.gnss_start import GnssEntry
from strapdown.errors import ConfigError, DataError
from strapdown.mechanization import NorthEastDown
from strapdown.sensors.crash_unit import CrashUnit
from strapdown.sensors.triad_numbers import FARTHEST, finite, triple

__all__ = ["check_crash_options"]


def check_crash_options(
    units: object,
    entry: object,
    point: object,
    window: object,
    preparation: object,
    peak_window: object,
    rule: object,
    gravity: object,
    mechanization: object,
) -> None:
    """Check the arguments whose kind or size no later stage would name.

    Raises
    ------
    DataError
        There is no unit.
    ConfigError
        An argument is of another kind, or out of range.
    """
    _check_units(units)
    if not (entry is None or isinstance(entry, Entry | GnssEntry)):
        raise _wrong_type("entry", entry)
    place = triple(point, "point", "sensors.point-not-three-numbers")
    if math.hypot(*place) > FARTHEST:
        raise ConfigError(
            "crash.vehicle-origin", quantity="point", place=place, hypot=math.hypot(*place)
        )
    if window is not None:
        _check_window(window)
    if not (preparation is None or isinstance(preparation, Mapping)):
        raise _wrong_type("preparation", preparation)
    names = {unit.name for unit in units}  # type: ignore[attr-defined]
    for name, given in (preparation or {}).items():
        if name in names and not isinstance(given, Mapping):
            raise ConfigError(
                "crash.preparation-of-unit-of-wrong-type",
                quantity=f"preparation, {name}",
                type=type(given).__name__,
            )
        if name not in names and isinstance(given, Mapping):
            raise ConfigError(
                "crash.preparation-of-unknown-unit", quantity="preparation", name=name
            )
    if not (finite(peak_window) and peak_window > 0.0):  # type: ignore[operator]
        raise ConfigError("crash.no-length", quantity="peak_window", peak_window=peak_window)
    if not isinstance(rule, EventRule):
        raise _wrong_type("rule", rule)
    if not isinstance(gravity, int | float):
        raise _wrong_type("gravity", gravity)
    if not (mechanization is None or isinstance(mechanization, NorthEastDown)):
        raise _wrong_type("mechanization", mechanization)


def _check_units(units: object) -> None:
    if isinstance(units, CrashUnit):
        raise ConfigError("crash.unit-list-needed", file=units.name, quantity="units")
    if units is None or (isinstance(units, Sequence) and not units):
        raise DataError("crash.no-units-given", quantity="units")
    if not isinstance(units, Sequence) or isinstance(units, str):
        raise _wrong_type("units", units)
    for unit in units:
        if not isinstance(unit, CrashUnit):
            raise _wrong_type("units", unit)


def _check_window(window: Any) -> None:
    try:
        begin, end = (float(x) for x in window)
    except (TypeError, ValueError):
        begin = end = math.nan
    if not (math.isfinite(begin) and math.isfinite(end) and begin < end):
        raise ConfigError("crash.window-not-a-pair", quantity="window", window=window)


def _wrong_type(quantity: str, given: object) -> ConfigError:
    return ConfigError(
        f"crash.{quantity}-of-wrong-type", quantity=quantity, type=type(given).__name__
    )

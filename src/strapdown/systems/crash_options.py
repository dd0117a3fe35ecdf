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
        raise _kind(
            entry,
            "entry",
            "give Entry.from_speed(speed in m/s, its standard deviation), a GnssEntry, or None "
            "for a vehicle that stood still when the record began",
        )
    place = triple(point, "point", "give forward, right, down in m from the vehicle's origin")
    if math.hypot(*place) > FARTHEST:
        raise ConfigError(
            "crash.vehicle-origin", quantity="point", place=place, hypot=math.hypot(*place)
        )
    if window is not None:
        _check_window(window)
    if not (preparation is None or isinstance(preparation, Mapping)):
        raise _kind(
            preparation, "preparation", "give options of prepare_unit, as {'levelling': (0, 0, 1)}"
        )
    names = {unit.name for unit in units}  # type: ignore[attr-defined]
    for name, given in (preparation or {}).items():
        remedy = (
            "give options for all units as {'gravity': 9.81}, and those of one under its name, as "
            "{'IMU1': {'levelling': (0, 0, 1)}}"
        )
        if name in names and not isinstance(given, Mapping):
            raise _kind(given, f"preparation, {name}", remedy)
        if name not in names and isinstance(given, Mapping):
            raise ConfigError(
                "crash.message",
                quantity="preparation",
                message=f"there is no unit {name!r}",
                remedy_text=remedy,
            )
    if not (finite(peak_window) and peak_window > 0.0):  # type: ignore[operator]
        raise ConfigError("crash.no-length", quantity="peak_window", peak_window=peak_window)
    if not isinstance(rule, EventRule):
        raise _kind(rule, "rule", "give an EventRule, or leave it out for 49 CFR 563")
    if not isinstance(gravity, int | float):
        raise _kind(gravity, "gravity", "give m/s², or leave it out")
    if not (mechanization is None or isinstance(mechanization, NorthEastDown)):
        raise _kind(mechanization, "mechanization", "give NorthEastDown(), or leave it out")


def _check_units(units: object) -> None:
    if isinstance(units, CrashUnit):
        raise ConfigError("crash.unit-list-needed", file=units.name, quantity="units")
    if units is None or (isinstance(units, Sequence) and not units):
        raise DataError("crash.none-4", quantity="units")
    if not isinstance(units, Sequence) or isinstance(units, str):
        raise _kind(units, "units", "give a list of CrashUnit")
    for unit in units:
        if not isinstance(unit, CrashUnit):
            raise _kind(unit, "units", "give a list of CrashUnit")


def _check_window(window: Any) -> None:
    try:
        begin, end = (float(x) for x in window)
    except (TypeError, ValueError):
        begin = end = math.nan
    if not (math.isfinite(begin) and math.isfinite(end) and begin < end):
        raise ConfigError("crash.no-window-2", quantity="window", window=window)


def _kind(given: object, quantity: str, remedy: str) -> ConfigError:
    return ConfigError(
        "crash.message",
        quantity=quantity,
        message=f"this is of kind {type(given).__name__}",
        remedy_text=remedy,
    )

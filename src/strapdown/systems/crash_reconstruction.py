"""Reconstruct a crash from its units' records: delta-v, direction of force and path."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import pandas as pd

from strapdown.constants import STANDARD_GRAVITY
from strapdown.crash.at_point import PointKinematics
from strapdown.crash.combine_units import combine_units
from strapdown.crash.compare_units import UnitComparison, compare_units
from strapdown.crash.entry import Entry
from strapdown.crash.events import PART_563, EventRule
from strapdown.crash.gnss_entry import GnssEntry, start_from_gnss
from strapdown.crash.prepare import prepare_together
from strapdown.crash.reconstruction_summary import summary_table, unit_line
from strapdown.crash.unit_reconstruction import PEAK_WINDOW, UnitReconstruction, reconstruct_unit
from strapdown.errors import ConfigError, DataError, Finding
from strapdown.mechanization import NorthEastDown
from strapdown.sensors.crash_unit import CrashUnit
from strapdown.sensors.synchronise import SynchronisedUnits, synchronise
from strapdown.sensors.triad_errors import FARTHEST, finite, triple

__all__ = ["check_crash_options"]


@dataclass(frozen=True, eq=False)
class CrashReconstruction:
    """Reconstruction of a crash by each unit and by all together.

    Attributes
    ----------
    point : tuple of float, m
        The reference point, vehicle axes from the vehicle's origin.
    synchronised : SynchronisedUnits
    units : tuple of UnitReconstruction
        Each unit by itself, at the reference point.
    comparison : UnitComparison or None
        None for a single unit.
    combined : UnitReconstruction or None
        Of the weighted mean of the units, if requested and if several units agree.
    findings : tuple of Finding
        Findings of all steps.
    """

    point: tuple[float, float, float]
    synchronised: SynchronisedUnits = field(repr=False)
    units: tuple[UnitReconstruction, ...]
    comparison: UnitComparison | None
    combined: UnitReconstruction | None
    findings: tuple[Finding, ...]

    def __repr__(self) -> str:
        lines = [unit_line(u) for u in self.answers]
        said = f"{len(self.findings)} finding{'s' * (len(self.findings) != 1)}"
        return "\n".join([f"<CrashReconstruction at {self.point} m", *lines, f"{said}>"])

    @property
    def answers(self) -> tuple[UnitReconstruction, ...]:
        """Every unit, and their mean if there is one."""
        return (*self.units, *(() if self.combined is None else (self.combined,)))

    def summary(self) -> pd.DataFrame:
        """Table of delta-v, directions of force and ends of the path, with their bounds.

        Returns
        -------
        DataFrame
            Indexed by ``unit``, ``part`` (number and type of the event, or ``path``) and
            ``quantity``; ``value``, ``low`` and ``high`` in the unit that the quantity names: 95 %
            bounds.
        """
        return summary_table(self.answers)

    @property
    def main(self) -> UnitReconstruction:
        """The mean of the units, or the first unit."""
        return self.units[0] if self.combined is None else self.combined

    def unit(self, name: str) -> UnitReconstruction:
        """Find a unit by its name.

        Raises
        ------
        ConfigError
            No unit has this name.
        """
        for unit in self.units:
            if unit.name == name:
                return unit
        raise ConfigError(
            "crash.unit-unknown", quantity="unit", name=name, units=[u.name for u in self.units]
        )


def reconstruct_crash(
    units: Sequence[CrashUnit],
    entry: Entry | GnssEntry | None,
    *,
    point: Sequence[float] = (0.0, 0.0, 0.0),
    window: Sequence[float] | None = None,
    rate: float = 200.0,
    sampling: str = "instantaneous",
    clock: str = "trigger",
    combine: bool = True,
    preparation: Mapping[str, Any] | None = None,
    peak_window: float = PEAK_WINDOW,
    rule: EventRule = PART_563,
    gravity: float = STANDARD_GRAVITY,
    mechanization: NorthEastDown | None = None,
) -> CrashReconstruction:
    """Reconstruct a crash.

    Parameters
    ----------
    units : sequence of CrashUnit
        Of one rigid vehicle, as recorded.
    entry : Entry, GnssEntry or None
        Velocity, heading and instant of the path; or fixes of a GNSS receiver before the crash,
        from which each unit finds them together with its biases (the mean of the units then uses
        the entry of the first). None: the vehicle was stationary at the beginning of the record,
        and the path is given in its axes at the trigger.
    point : sequence of float, (3,), m
        Reference point in vehicle axes (forward, right, down) from the vehicle's origin.
    window : (float, float), s, optional
        Of the path, from the trigger; -0.1 to 0.75 s, as far as a unit's record has them, if not
        given.
    rate : float, Hz
        Of the common stamps. Faster channels are decimated without aliasing.
    sampling : {'instantaneous', 'mean'}
        Meaning of the samples at the common stamps: values of a band-limited signal, or true means
        over the step, which preserve the delta-v of a fast channel.
    clock : {'trigger', 'correlation'}
        As `synchronise`.
    combine : bool
        Also reconstruct the weighted mean of the units, if they agree; if they contradict, a
        finding reports it. `combine_units` computes the mean in any case.
    preparation : mapping, optional
        Options of `prepare_unit`, for all units; under the name of a unit, a mapping of its own
        options.
    peak_window : float, s
        Window of the delta-v that usually rates severity.
    rule : EventRule
        Definition of an event: 49 CFR 563 by default.
    gravity : float, m/s²
        Local gravity.
    mechanization : NorthEastDown, optional

    Returns
    -------
    CrashReconstruction
        All bounds are 95 % bounds. Without an event in the record there are no changes of velocity,
        and a finding states how near it came; the path is returned in any case.

    Raises
    ------
    DataError
        A record cannot be used: the message names unit, sensor, row, quantity and remedy.
    ConfigError
        An option is out of range.
    DivergenceError
        A path left the range of vehicle motion.
    """
    check_crash_options(
        units, entry, point, window, preparation, peak_window, rule, gravity, mechanization
    )
    together = synchronise(units, method=clock, rate=rate, sampling=sampling, cut=False)
    findings = list(together.findings)
    there = prepare_together(together, point, gravity, preparation or {})
    for of in there:
        findings += () if of.prepared is None else of.prepared.findings
    # Before each unit estimates its own biases, which absorbs part of the differences.
    comparison = compare_units(there) if len(there) > 1 else None
    tied: list[Entry | None] = [None if isinstance(entry, GnssEntry) else entry] * len(there)
    if isinstance(entry, GnssEntry):
        for k, of in enumerate(there):
            there[k], tied[k], state = start_from_gnss(of, entry, point)
            findings += state.findings

    def answers(of: PointKinematics, start: Entry | None) -> UnitReconstruction:
        return reconstruct_unit(
            of,
            start,
            window=window,
            peak_window=peak_window,
            rule=rule,
            gravity=gravity,
            mechanization=mechanization,
        )

    found = tuple(answers(of, start) for of, start in zip(there, tied, strict=True))
    combined = None
    if combine and comparison is not None and comparison.agree:
        combined = answers(combine_units(there), tied[0])
    for reconstruction in (*found, *(() if combined is None else (combined,))):
        findings += reconstruction.findings
    if comparison is not None:
        findings += comparison.findings
        if combine and not comparison.agree:
            findings.append(_no_mean(there))
    x, y, z = (float(v) for v in point)
    return CrashReconstruction(
        (x, y, z), together, found, comparison, combined, tuple(dict.fromkeys(findings))
    )


def _no_mean(units: Sequence[PointKinematics]) -> Finding:
    return Finding(
        "crash.units-disagree-no-mean-told",
        file=", ".join(u.name for u in units),
        quantity="combine",
    )


# Checks of the arguments of `reconstruct_crash` before any work.


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
    """Check the arguments that no later stage would report by kind or size.

    Raises
    ------
    DataError
        No unit is given.
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

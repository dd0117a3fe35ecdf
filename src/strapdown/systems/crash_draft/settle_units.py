"""What each triad is and in which unit: by its heading, its rest, or by one that felt the same."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from strapdown.constants import ACCEL_UNITS, GYRO_UNITS, STANDARD_GRAVITY, TIME_UNITS
from strapdown.formats.crash_units import FACTORS
from strapdown.formats.inference.conclusion import THRESHOLD
from strapdown.systems.crash_draft.parts import Part
from strapdown.systems.crash_draft.triad_kind import (
    Answer,
    accel_unit,
    clock_by_pulse,
    gyro_unit,
    quiet_part,
    same_quantity,
)

Array = NDArray[np.float64]

__all__ = ["settle_units"]

# Of the shorter record: so much must lie within the other for the two to be held together.
OVERLAP = 0.5
# Without gravity a rest is below this part of the peak.
ZEROED = 0.05


def settle_units(parts: Sequence[Part]) -> list[Part]:
    """Conclude kind and unit of every triad.

    Parameters
    ----------
    parts : sequence of Part
        With values as recorded, and kind and unit as far as headings tell them.

    Returns
    -------
    list of Part
        In the same order, with values in SI; by the likeliest unit where `Part.unit` is empty.
    """
    parts = [_timed(p) for p in parts]
    out: list[Part | None] = [_by_heading(p) for p in parts]
    order = sorted(range(len(parts)), key=lambda k: _off_gravity(parts[k]))
    for step in (_by_gravity, _by_another, _by_gravity_alone, _by_another, _by_elimination):
        for k in order:
            part = parts[k]
            if out[k] is None:
                known = [q for q in out if q is not None and q.kind == "acceleration"]
                out[k] = step(part, known)
    return [p for p in out if p is not None]


def _off_gravity(part: Part) -> float:
    """How far its rest is from gravity in any unit, relative."""
    if len(part.axes) < 3:
        return math.inf
    length = float(np.linalg.norm(quiet_part(part.values).mean))
    if length <= 0.0:
        return math.inf
    known = (STANDARD_GRAVITY / s for s in ACCEL_UNITS.values() if s > 0.0)
    return min(abs(math.log(length / g)) for g in known)


def _timed(part: Part) -> Part:
    """Settle a clock by how long the crash lasts."""
    clock = part.clock
    if clock.unit or not clock.column:
        return part
    found = clock_by_pulse(clock, part.values[:, part.axes])
    if found is None:
        return part
    unit, why = found
    factor = TIME_UNITS[unit]
    was = 1.0 / (clock.step * clock.rate)
    settled = replace(
        clock, unit=unit, why=f"{clock.why}; {why}", rate=1.0 / (clock.step * factor), candidates=""
    )
    return replace(part, clock=settled, time=part.time * (factor / was))


def _by_heading(part: Part) -> Part | None:
    for kind, table in (
        ("acceleration", ACCEL_UNITS),
        ("rate", GYRO_UNITS),
        ("velocity", FACTORS["velocity"]),
    ):
        if part.kind == kind and part.unit in table:
            return _scaled(part, kind, part.unit, table[part.unit], "unit by the heading")
    return None


def _weighed(part: Part, known: Sequence[Part]) -> Answer | None:
    # A gyro may rest at what gravity is in some unit: beside an accelerometer it must agree.
    if not part.kind and any(q.path == part.path for q in known):
        return None
    if part.kind not in ("", "acceleration") or len(part.axes) < 3:
        return None
    return accel_unit(part.values, part.step, quiet_part(part.values))


def _by_gravity(part: Part, known: Sequence[Part]) -> Part | None:
    said = _weighed(part, known)
    if said is None or not said.settled:
        return None
    return _scaled(part, "acceleration", said.unit, ACCEL_UNITS[said.unit], said.why)


def _by_gravity_alone(part: Part, known: Sequence[Part]) -> Part | None:
    """An accelerometer, as it weighs something at rest, in a unit that is not settled."""
    said = _weighed(part, known)
    if said is None or said.gravity < THRESHOLD:
        return None
    return _asked(part, "acceleration", said.unit, ACCEL_UNITS, _accelerations)


def _by_another(part: Part, known: Sequence[Part]) -> Part | None:
    if part.kind not in ("", "acceleration"):
        return None
    for other in sorted(known, key=lambda q: q.path != part.path):
        together = _together(other, part)
        found = same_quantity(*together) if together else None
        if found:
            unit, ratio, correlation = found
            told = (
                f"in {unit} it agrees with {_named(other, part)} (correlation "
                f"{correlation:.2f}, scale {ratio:.3f})"
            )
            if not other.unit:
                # In the same unit, whichever that is.
                return _asked(part, "acceleration", unit, ACCEL_UNITS, _accelerations, told)
            return _scaled(part, "acceleration", unit, ACCEL_UNITS[unit], told)
    return None


def _by_elimination(part: Part, known: Sequence[Part]) -> Part | None:
    values = part.values[:, part.axes]
    quiet = quiet_part(values)
    if part.kind == "velocity":
        return _asked(part, "velocity", "km/h", FACTORS["velocity"], _speeds)
    beside = any(q.path == part.path or _together(q, part) for q in known)
    if part.kind == "rate" or (not part.kind and beside and len(part.axes) == 3):
        said = gyro_unit(part.time, values, quiet)
        why = "" if part.kind else "it does not follow the accelerations, and rests near zero"
        if said.settled:
            return _scaled(
                part,
                "rate",
                said.unit,
                GYRO_UNITS[said.unit],
                "; ".join(filter(None, (why, said.why))),
            )
        return _asked(part, "rate", said.unit, GYRO_UNITS, _rates, why)
    said = accel_unit(part.values, part.step, quiet) if len(part.axes) == 3 else _likeliest(part)
    zeroed = bool(np.abs(quiet.mean).max() < ZEROED * np.abs(values).max())
    return replace(
        _asked(part, "acceleration", said.unit, ACCEL_UNITS, _accelerations),
        zeroed=zeroed,
    )


def _likeliest(part: Part) -> Answer:
    """A crash has tens of g: what peaks above two hundred is not in g."""
    peak = float(np.nanmax(np.abs(part.values)))
    return Answer("g" if peak < 100.0 else "m/s2" if peak < 5000.0 else "mg", 0.0, "by its size")


def _scaled(part: Part, kind: str, unit: str, factor: float, why: str) -> Part:
    values = part.values * factor
    quiet = quiet_part(values[:, part.axes])
    zeroed = kind == "acceleration" and (
        float(np.linalg.norm(quiet.mean)) < 0.3 * STANDARD_GRAVITY and len(part.axes) == 3
    )
    return replace(
        part, kind=kind, unit=unit, values=values, zeroed=zeroed, unit_why=(*part.unit_why, why)
    )


def _asked(
    part: Part,
    kind: str,
    unit: str,
    table: dict[str, float],
    words: Callable[[Part, str, float], str],
    why: str = "",
) -> Part:
    units = [u for u in table if table[u] > 0.0 and u not in ("mrad/s", "mdeg/s", "deg/h")]
    told = "; ".join(words(part, u, table[u]) for u in units)
    return replace(
        part,
        kind=kind,
        unit="",
        candidates=told,
        values=part.values * table[unit],
        unit_why=(*part.unit_why, *((why,) if why else ())),
    )


def _peak_change(part: Part, factor: float) -> tuple[float, float]:
    """Largest value, and largest change of its integral, of any axis."""
    values = part.values[:, part.axes]
    values = (values - quiet_part(values).mean) * factor
    step = part.step
    sums = np.abs(np.cumsum(values, axis=0) * step)
    return float(np.abs(values).max()), float(sums.max())


def _accelerations(part: Part, unit: str, factor: float) -> str:
    peak, change = _peak_change(part, factor)
    return f'"{unit}" makes a peak of {peak / STANDARD_GRAVITY:.3g} g and {change * 3.6:.3g} km/h'


def _rates(part: Part, unit: str, factor: float) -> str:
    peak, turn = _peak_change(part, factor)
    turned = f"a turn of {np.degrees(turn):.3g} deg"
    return f'"{unit}" makes a peak of {np.degrees(peak):.3g} deg/s and {turned}'


def _speeds(part: Part, unit: str, factor: float) -> str:
    return f'"{unit}" makes {float(np.nanmax(np.abs(part.values))) * factor * 3.6:.3g} km/h'


def _together(known: Part, other: Part) -> tuple[Array, Array] | None:
    """Both at the stamps of the slower one, where both were on."""
    start, end = max(known.time[0], other.time[0]), min(known.time[-1], other.time[-1])
    shorter = min(np.ptp(known.time), np.ptp(other.time))
    if end - start < OVERLAP * shorter:
        return None
    slow, fast = (known, other) if known.step >= other.step else (other, known)
    rows = (slow.time >= start) & (slow.time <= end)
    at = slow.time[rows]
    moved = np.column_stack([np.interp(at, fast.time, fast.values[:, k]) for k in range(3)])
    own = slow.values[rows]
    return (own, moved) if slow is known else (moved, own)


def _named(other: Part, part: Part) -> str:
    names = ", ".join(other.channels.values())
    return names if other.path == part.path else f"{other.path}: {names}"

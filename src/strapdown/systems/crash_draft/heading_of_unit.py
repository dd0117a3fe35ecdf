"""Which way a unit faces, as far as headings of columns, the blow and other units tell it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from strapdown.crash.pdof import pdof
from strapdown.rotation import within_half_turn
from strapdown.systems.crash_draft.group_units import Unit

__all__ = ["Facing", "direction", "facings", "side_of"]

TURNS = (0.0, 90.0, 180.0, -90.0)
# A blow from the front, as most crashes of vehicles that drive are, comes within this of it.
FRONTAL = 45.0  # deg
# Two units of one vehicle feel one direction; the next right angle is farther than this.
SAME_DIRECTION = 30.0  # deg
POINTS = {0.0: "forward", 90.0: "to the right", 180.0: "rearward", -90.0: "to the left"}
SIDES = {0: "the front", 1: "the right", 2: "the rear", 3: "the left"}


@dataclass(frozen=True)
class Facing:
    """Heading of a mounting.

    Attributes
    ----------
    heading_deg : float or None
        None where only a person knows.
    why : str
        How it is known; what each of the four would mean, where it is not.
    """

    heading_deg: float | None
    why: str


def facings(units: Sequence[Unit]) -> list[Facing]:
    """Find the heading of each unit's mounting, of the four right angles.

    Parameters
    ----------
    units : sequence of Unit

    Returns
    -------
    list of Facing
        Assumed zero where the columns are named x, y, z, the vertical is along z, and the blow
        then comes from the front; for the others what agrees with the first that is known.
    """
    out: list[Facing | None] = [_own(u) for u in units]
    known = next((k for k, f in enumerate(out) if f and f.heading_deg is not None), None)
    for k, unit in enumerate(units):
        if out[k] is None and known is not None:
            first = out[known]
            assert first is not None and first.heading_deg is not None
            out[k] = _like(unit, direction(units[known], first.heading_deg), units[known].name)
    return [f or Facing(None, _meanings(u)) for f, u in zip(out, units, strict=True)]


def direction(unit: Unit, heading_deg: float) -> float | None:
    """Where the force came from, deg, if the unit faced so; None where nothing moved it."""
    sitting = unit.impact.sitting
    change = np.nan_to_num(unit.impact.change)
    if sitting is not None:
        change = sitting.into_vehicle(change[None, :], heading_deg)[0]
    elif heading_deg:
        return None
    if not unit.impact.found or np.hypot(*change[:2]) == 0.0:
        return None
    return float(pdof((change[0], change[1], 0.0)).horizontal_deg)


def _pointing(unit: Unit, turn: float) -> str:
    """Where x of a housing points that is turned so; nothing where it points up or down."""
    sitting = unit.impact.sitting
    if sitting is None or abs(sitting.pitch_deg) > FRONTAL:
        return ""
    return f" (its x points {POINTS[turn]})"


def side_of(came: float) -> str:
    """In words, where a force came from at this direction, deg."""
    return SIDES[round(came / 90.0) % 4]


def _own(unit: Unit) -> Facing | None:
    sitting = unit.impact.sitting
    named = all(p.named for p in unit.accelerometers)
    came = direction(unit, 0.0)
    if sitting is None:
        if unit.accelerometers[0].zeroed and named:
            return Facing(
                0.0,
                "assumed: x, y, z of the record point forward, right, down; gravity is not in it, "
                "so that nothing can be seen of how it sits",
            )
        return None
    if not named or not sitting.along.endswith("z") or came is None or abs(came) > FRONTAL:
        return None
    return Facing(
        0.0,
        "assumed: x points forward, as its heading says x and the blow then comes from the front "
        f"({came:.0f} deg)",
    )


def _like(unit: Unit, goal: float | None, name: str) -> Facing | None:
    if goal is None or unit.impact.sitting is None:
        return None
    off = {}
    for turn in TURNS:
        came = direction(unit, turn)
        if came is None:
            return None
        off[turn] = abs(float(within_half_turn(np.array([came - goal]))[0]))
    best = min(off, key=lambda t: off[t])
    if off[best] > SAME_DIRECTION:
        return None
    return Facing(
        best,
        f"assumed: with it the blow comes from where '{name}' has it, within {off[best]:.0f} deg",
    )


def _meanings(unit: Unit) -> str:
    told = []
    for turn in TURNS:
        came = direction(unit, turn)
        if came is None:
            continue
        told.append(f"{turn:g}{_pointing(unit, turn)} makes it a blow from {side_of(came)}")
    if not told:
        return "the record does not tell it"
    return ", ".join(told)

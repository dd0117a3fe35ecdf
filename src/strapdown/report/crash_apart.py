"""What is told where recorders do not agree: each by itself, and the span of all."""

from __future__ import annotations

from strapdown.crash.pdof import Pdof
from strapdown.crash.unit_reconstruction import UnitReconstruction
from strapdown.report.crash_values import KMH, angle_range, plain, speed
from strapdown.report.document import KeyFigure
from strapdown.systems.case_severity import main_event
from strapdown.systems.crash_case import CaseResult

__all__ = ["apart", "apart_figures", "apart_headline"]


def apart(result: CaseResult) -> bool:
    """Tell whether there are recorders that do not agree, so that there is no mean of them."""
    made = result.reconstruction
    return made.comparison is not None and not made.comparison.agree and made.combined is None


def apart_headline(result: CaseResult) -> str:
    """Return the answers of all recorders in one sentence."""
    told = "; ".join(f"{unit.name} {_change(unit)}" for unit in result.reconstruction.units)
    return f"The recorders do not agree, and no mean of them is told. Delta-V: {told}."


def apart_figures(result: CaseResult) -> tuple[KeyFigure, ...]:
    """Return delta-V and direction of force for page one: the span of all bounds.

    Parameters
    ----------
    result : CaseResult
        Of recorders that do not agree.
    """
    units = result.reconstruction.units
    spans = [span for span in map(_span, units) if span is not None]
    value = "no event"
    if spans:
        low, high = min(s[0] for s in spans), max(s[1] for s in spans)
        value = f"{plain(KMH * low, 1)} to {plain(KMH * high, 1)} km/h"
    return (
        KeyFigure(
            "Delta-V",
            value,
            "; ".join(f"{unit.name} {_change(unit)}" for unit in units),
            "the recorders do not agree: the span of their 95 % bounds, and no mean",
        ),
        KeyFigure(
            "Direction of force",
            _directions(units),
            "; ".join(f"{unit.name} {_direction(unit)}" for unit in units),
            "where the force came from: 0° the front, clockwise seen from above",
        ),
    )


def _change(unit: UnitReconstruction) -> str:
    number = main_event(unit)
    if number is None:
        return "no event"
    whole = unit.body[number].event
    return speed(whole.resultant, whole.resultant_bound)


def _span(unit: UnitReconstruction) -> tuple[float, float] | None:
    number = main_event(unit)
    if number is None:
        return None
    whole = unit.body[number].event
    return whole.resultant - whole.resultant_bound, whole.resultant + whole.resultant_bound


def _angle(unit: UnitReconstruction) -> float | None:
    number = main_event(unit)
    if number is None or unit.body[number].event.interval.horizontal.undetermined:
        return None
    angle = unit.body[number].event.pdof
    assert isinstance(angle, Pdof)
    return angle.horizontal_deg


def _direction(unit: UnitReconstruction) -> str:
    angle, number = _angle(unit), main_event(unit)
    if angle is None or number is None:
        return "not determined"
    across = unit.body[number].event.interval.horizontal
    return f"{plain(angle, 1)}° ({angle_range(across).removesuffix(' with 95 %')})"


def _directions(units: tuple[UnitReconstruction, ...]) -> str:
    angles = [angle for angle in map(_angle, units) if angle is not None]
    return " / ".join(f"{plain(angle, 0)}°" for angle in angles) or "not determined"

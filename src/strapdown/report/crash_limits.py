"""What limits the answers of a case, from what happened in it, the gravest first."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from strapdown.report.crash_sensor_limits import assumed, borrowed, clipping, rest, ringing
from strapdown.report.crash_values import instant, plain
from strapdown.systems.case_severity import main_event
from strapdown.systems.crash_case import CaseResult

__all__ = ["grave_limitations", "limitations"]

#: What makes an answer wrong, and not only less precise.
GRAVE = frozenset(
    (
        "event-beyond-record",
        "event-before-record",
        "direction-undetermined",
        "recorders-disagree",
        "clipped",
        "assumed",
    )
)


def limitations(result: CaseResult) -> tuple[tuple[str, str], ...]:
    """Return what a reader must know before relying on the answers.

    Parameters
    ----------
    result : CaseResult

    Returns
    -------
    tuple of (head, text)
        Only of what happened in this case.
    """
    return tuple((head, text) for _, head, text in _all(result))


def grave_limitations(result: CaseResult) -> tuple[str, ...]:
    """Return the heads of those that make an answer wrong, and not only less precise."""
    return tuple(head for code, head, _ in _all(result) if code in GRAVE)


def _all(result: CaseResult) -> tuple[tuple[str, str, str], ...]:
    """Return code, head and text of each."""
    return (
        *_event(result),
        *clipping(result),
        *_disagreement(result),
        *_contradicted(result),
        *assumed(result),
        *rest(result),
        *borrowed(result),
        *_alone(result),
        *ringing(result),
        *_levers(result),
        *_entry(result),
        *_no_reference(result),
    )


def _event(result: CaseResult) -> Iterator[tuple[str, str, str]]:
    unit = result.reconstruction.main
    number = main_event(unit)
    if number is None:
        others = [u.name for u in result.reconstruction.units if main_event(u) is not None]
        alone = (
            f" There is one by {' and '.join(others)} alone: see Delta-V, and whether the record "
            "of another begins late or ends early."
        )
        yield (
            "no-event",
            "No event",
            "The record holds no event after 49 CFR 563. There is no delta-V and no direction of "
            f"force; the path is told all the same.{alone if others else ''}",
        )
        return
    event = unit.events.events[number]
    if event.lasts_beyond_record:
        yield (
            "event-beyond-record",
            "The event lasts beyond the record",
            f"The record ends at {instant(event.end)} while the velocity still changes: the "
            "delta-V is that up to there, and the whole one is larger or smaller.",
        )
    if event.starts_before_record:
        yield (
            "event-before-record",
            "The event begins before the record",
            f"The record begins at {instant(event.time_zero)}, within the event: what changed "
            "before is missing.",
        )
    whole = unit.body[number].event
    if whole.interval.horizontal.undetermined:
        yield (
            "direction-undetermined",
            "The direction of force is not determined",
            "The bound of the change of velocity holds zero in the horizontal plane, so that no "
            "direction is excluded.",
        )
    if unit.ned[number] is None:
        yield (
            "event-outside-path",
            "The event is not within the path",
            "Its change of velocity is told along the turning axes of the vehicle alone.",
        )


def _disagreement(result: CaseResult) -> Iterator[tuple[str, str, str]]:
    made = result.reconstruction
    comparison = made.comparison
    if comparison is None or comparison.agree:
        return
    apart = [p for p in comparison.pairs if not p.agree]
    pairs = [f"{p.first} and {p.second}" for p in apart]
    if len(pairs) == len(comparison.pairs) > 1:
        pairs = ["No two of them agree"]
    mean = (
        "The weighted mean lies between them, and its bound is too narrow: it takes each at its "
        "word. "
        if made.combined is not None
        else ""
    )
    yield (
        "recorders-disagree",
        "The recorders do not agree",
        f"{'; '.join(pairs) or 'All together'}: they differ by more than what is stated of them "
        f"allows with 95 %. {mean}At least one of them has an error that is not stated: a wrong "
        "axis, mounting point, angle, scale or clock, a sensor at the end of its range, or a place "
        "that was deformed or rang. Do not rely on the answers before it is found; see Sensors "
        "against each other.",
    )


def _alone(result: CaseResult) -> Iterator[tuple[str, str, str]]:
    if len(result.units) == 1:
        yield (
            "one-recorder",
            "One recorder alone",
            "An error that is not stated, such as an axis with a wrong sign, a wrong mounting "
            "point or a loose bracket, would not show.",
        )


def _levers(result: CaseResult) -> Iterator[tuple[str, str, str]]:
    point = np.asarray(result.spec.point.position_m)
    longest, name = max(
        (float(np.linalg.norm(point - unit.mounting.position)), unit.name) for unit in result.units
    )
    if longest > 0.0:
        yield (
            "rigid-vehicle",
            "The vehicle is taken as rigid",
            f"That holds between each recorder and the {result.spec.point.name}, up to "
            f"{plain(longest, 2)} m ({name}). A floor or pillar that folded in between moved "
            "otherwise.",
        )


def _entry(result: CaseResult) -> Iterator[tuple[str, str, str]]:
    if result.spec.entry.kind == "speed":
        yield (
            "entry-speed-stated",
            "The entry speed is not from these records",
            "It shifts every velocity and the path as a whole; delta-V and direction of force do "
            "not depend on it.",
        )


def _contradicted(result: CaseResult) -> Iterator[tuple[str, str, str]]:
    for answer in result.references:
        if answer.unit == result.reconstruction.main.name and not answer.consistent:
            source = f" That is known from: {answer.spec.source}." if answer.spec.source else ""
            yield (
                "reference-contradicts",
                f"Not within the bounds of what else is known: {answer.spec.name}",
                "The difference is larger than the bounds of both together allow with 95 %; see "
                f"Reference comparison.{source}",
            )


def _no_reference(result: CaseResult) -> Iterator[tuple[str, str, str]]:
    if not result.references:
        yield (
            "no-reference",
            "Nothing to compare with",
            "No film, no survey and no other measurement of the crash was given.",
        )

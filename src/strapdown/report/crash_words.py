"""Results of a case in sentences, shared by terminal, page and PDF."""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from importlib.resources import files
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from strapdown.constants import TWO_SIDED_95
from strapdown.crash.case import CaseResult
from strapdown.crash.case_contact import OF_DRIVES, main_event
from strapdown.crash.delta_v import delta_v
from strapdown.crash.delta_v_bound import VelocityChange
from strapdown.crash.measuring_point import MISSING_AXIS, NO_TURNING, TURNED_AXIS
from strapdown.crash.pdof import AngleInterval, Pdof
from strapdown.crash.reconstruction import UnitReconstruction
from strapdown.errors import Finding
from strapdown.formats.crash_record import CrashRecord
from strapdown.report.values import (
    AXES,
    GAP,
    MEAN,
    SHOWN,
    about,
    angle_range,
    axis_names,
    change_range,
    change_words,
    instant,
    length_about,
    length_factor,
    length_unit,
    moment,
    over_ground,
    plain,
    probability_words,
    side_words,
    speed,
    speed_factor,
    speed_unit,
    speed_words,
)
from strapdown.sensors.pre_crash import PreparedUnit
from strapdown.tables import NED, VELOCITY

if TYPE_CHECKING:
    from strapdown.crash.closure import Closure, Figure
    from strapdown.report.document import KeyFigure

TYPES = {
    "front": "an impact from the front",
    "right": "an impact from the right",
    "rear": "an impact from behind",
    "left": "an impact from the left",
    "rollover": "a rollover",
    "undetermined": "type not determined",
}


#: A vehicle is at rest where its speed with its bound stays below one, m/s, for so long, s: it then
#: moves by 5 cm at most; a rebound passes zero faster.
STANDING, STANDING_FOR = 0.5, 0.1


def headline(result: CaseResult) -> str:
    """Return the answer in one sentence."""
    if apart(result):
        return apart_headline(result)
    unit = result.reconstruction.main
    number = main_event(unit)
    if number is None and (cut := unit.events.cut_change) > 0.0:
        return (
            f"The record ends within an impact: delta-V at least {speed_words(cut)}, as far as "
            "recorded; its direction of force is not determined."
        )
    if number is None:
        size, axis = unit.events.largest_change, unit.events.largest_axis
        return (
            f"No event by 49 CFR 563: the {axis} velocity changed by {speed_words(size)} "
            "at most within 150 ms; an event requires 8 km/h."
        )
    whole = unit.body[number].event
    low = f" ({change_range(whole)})" if whole.at_least else ""
    return (
        f"Delta-V {change_words(whole)}{low}; {direction_name(whole)} "
        f"{direction(result, number)}; {TYPES[unit.types[number].name]}."
    )


def direction_name(change: VelocityChange) -> str:
    """Return what a direction is of: of a change that is a part, of that part."""
    return "direction of force" + (" of the recorded part" if change.at_least else "")


def direction(result: CaseResult, number: int) -> str:
    """Return the direction of force of an event with its bound."""
    whole = result.reconstruction.main.body[number].event
    across = whole.interval.horizontal
    if across.undetermined:
        return angle_range(across)
    angle = whole.pdof
    assert isinstance(angle, Pdof)
    found = direction_range(result, across)
    return f"{plain(angle.horizontal_deg, 1)}° ({found}), {angle.clock} o'clock"


def direction_range(result: CaseResult, across: AngleInterval) -> str:
    """Return the bound of the direction of force, and whether it is an assumption."""
    assumed = "direction of force" in on_assumption(result)
    return angle_range(across) + ", by assumption" * assumed


def key_figures(result: CaseResult) -> tuple[KeyFigure, ...]:
    """Return the key figures of page one."""
    from strapdown.report.document import KeyFigure

    unit = result.reconstruction.main
    number = main_event(unit)
    figures: list[KeyFigure] = []
    of = ""
    if apart(result):
        figures += apart_figures(result)
        of = f" by {unit.name}"
    elif number is None:
        figures.append(KeyFigure("Delta-V", _change(unit), headline(result)))
    else:
        changes = unit.body[number]
        whole, peak = changes.event, changes.peak
        ms = 1e3 * (peak.delta_v.end - peak.delta_v.start)
        begin, end = (
            about(edge.time, TWO_SIDED_95 * edge.sd, "s")
            for edge in (changes.contact.start, changes.contact.end)
        )
        figures.append(
            KeyFigure(
                "Delta-V",
                change_words(whole),
                change_range(whole),
                f"over the contact, {begin} to {end}; largest in {ms:.3g} ms {change_words(peak)}",
            )
        )
        across = whole.interval.horizontal
        value = "not determined"
        if not across.undetermined:
            angle = whole.pdof
            value = f"{plain(getattr(angle, 'horizontal_deg', np.nan), 1)}°, {angle.clock} o'clock"
        figures.append(
            KeyFigure(
                direction_name(whole).capitalize(),
                value,
                direction_range(result, across),
                "0° the front, clockwise from above",
            )
        )
    place, half = _end(unit)
    figures.append(
        KeyFigure(
            f"{_last_name(unit)}{of}",
            f"{plain(length_factor() * math.hypot(place[0], place[1]), 2)} {length_unit()}",
            ", ".join(
                f"{name}{GAP}{length_about(p, h)}"
                for name, p, h in zip(axis_names(result), place, half, strict=True)
            )
            + f" with 95{GAP}%",
            f"from {instant(unit.path.entry.time)} to {instant(unit.path.time[-1])}, "
            f"{_axes(result)}",
        )
    )
    return tuple(figures)


def lead(result: CaseResult) -> str:
    """Return the lead paragraph of page one."""
    unit = result.reconstruction.main
    number = main_event(unit)
    parts = []
    if apart(result):
        parts.append(f"{apart_headline(result)} The following is by {unit.name}.")
    if number is None:
        parts.append(headline(result))
    else:
        changes = unit.body[number]
        whole, peak = changes.event, changes.peak
        forward, right = float(whole.delta_v.vector[0]), float(whole.delta_v.vector[1])
        length = 1e3 * (whole.delta_v.end - whole.delta_v.start)
        parts.append(
            f"Within {length:.0f} ms from {moment(whole.delta_v.start)}, the velocity of the "
            f"{result.spec.point.name} changed by {change_words(whole)} ("
            f"{change_words(whole, unit=SHOWN.get().beside)}; all bounds are 95 %), "
            f"{side_words(forward, right)}. {direction_name(whole).capitalize()}: "
            f"{direction(result, number)}; {TYPES[unit.types[number].name]}."
        )
        if whole.at_least:
            parts.append(f"{incomplete_words(whole)} The change is {change_range(whole)}.")
        parts.append(windows_words(unit, number))
        others = len(unit.body) - 1
        if others:
            parts.append(
                f"It is the largest of {len(unit.body)} events; the others are under Delta-V."
            )
        parts.append(
            f"The largest change within {1e3 * (peak.delta_v.end - peak.delta_v.start):.3g} ms was "
            f"{change_words(peak)}."
        )
    parts += [
        entry_words(result),
        path_words(result),
        units_words(result),
        *references_words(result),
        closure_words(result),
        assumption_words(result),
    ]
    return " ".join(p for p in parts if p)


def windows_words(unit: UnitReconstruction, number: int) -> str:
    """Return where the contact of an event begins and why, and the window of the regulation."""
    contact, event = unit.body[number].contact, unit.events.events[number]
    start = contact.start
    half = about(1e3 * abs(start.time), 1e3 * TWO_SIDED_95 * start.sd, "ms")
    side = "before" if start.time < 0.0 else "after"
    words = (
        f"The contact begins {half} {side} the trigger, where the acceleration leaves its level of "
        "before; the bound is for how slowly it rises"
    )
    if start.time < 0.0 < contact.end.time:
        lost = delta_v(unit.acceleration, start.time, 0.0, across_gaps=True)
        least = 0.1 / speed_factor()
        size = speed_words(max(lost.resultant, least))
        less = "less than " * (lost.resultant < least)
        words += f". By the trigger the velocity had changed by {less}{size}"
        if lost.resultant < unit.body[number].event.resultant_bound:
            words += ", so that an earlier or later onset hardly changes delta-V"
    end = "beyond the record" if event.lasts_beyond_record else f"to {instant(event.end)}"
    return (
        f"{words}. The 49 CFR 563 event is another window, {instant(event.time_zero)} {end}: it "
        "begins and ends where the change within 20 ms passes 0.8 km/h, and no number here is the "
        "change over it."
    )


#: Why the record holds only a part of a change of velocity.
PART = {
    "before": "the record begins within the contact",
    "after": "the record ends within the contact",
    "clipped": "a sensor was at the end of its range",
}


def incomplete_words(change: VelocityChange) -> str:
    """Return why a change of velocity has no upper bound."""
    why = " and ".join(PART[m] for m in change.missing)
    return f"This is a part of the change: {why}."


def entry_words(result: CaseResult) -> str:
    """Return the entry speed and its source."""
    entry = result.spec.entry
    if entry.kind == "standstill":
        return "The vehicle was stationary when the record began."
    if entry.kind in OF_DRIVES:
        at = result.reconstruction.main.path.entry
        size = float(np.linalg.norm(at.velocity))
        by = "GNSS fixes" if entry.kind == "gnss" else "speeds of its wheels"
        return f"At {instant(at.time)} it moved at {speed_words(size)}, by {by} before the impact."
    assert entry.speed_m_per_s is not None and entry.speed_sd_m_per_s is not None
    half = TWO_SIDED_95 * entry.speed_sd_m_per_s
    source = f" ({entry.source})" if entry.source else ""
    return (
        f"Entry speed: {speed(entry.speed_m_per_s, half)}{source}, not measured by the recorders."
    )


def closure_words(result: CaseResult) -> str:
    """Return what the other vehicle, or the barrier, says; empty without one."""
    closure = result.closure
    if closure is None:
        return ""
    if not result.partners:
        return _barrier_words(result, closure)
    other = result.vehicle_names[2 - result.number]
    if closure.contradicted:
        return f"It CONTRADICTS {other}: momentum does not close; see the closure."
    told = "closes" if closure.freedom else "could not be tested"
    parts = [f"With {other} momentum {told}"]
    if closure.closing_speed is not None:
        speeds = _figure(closure.closing_speed, speed_factor(), 1, f" {speed_unit()}")
        parts.append(f"the closing speed was {speeds}")
    if closure.restitution is not None:
        parts.append(f"the restitution {_figure(closure.restitution)}")
    return "; ".join(parts) + "."


def _figure(figure: Figure, factor: float = 1.0, places: int = 2, unit: str = "") -> str:
    value, low, high = (plain(factor * x, places) for x in (figure.value, figure.low, figure.high))
    return f"{value}{unit} ({low} to {high})"


def references_words(result: CaseResult) -> Iterator[str]:
    """Return what references of delta-V say that do not contradict the result."""
    main = result.reconstruction.main.name
    for answer in result.references:
        if answer.path is None and answer.consistent and answer.unit == main:
            yield (
                f"It is consistent with {answer.spec.name}, from which its {answer.spec.axis} "
                f"delta-V differs by {speed(*answer.difference)}."
            )


#: Contributors of the error budget that a case assumes instead of a measurement.
ASSUMED = (NO_TURNING, MISSING_AXIS, TURNED_AXIS)


def on_assumption(result: CaseResult) -> tuple[str, ...]:
    """Numbers of page one whose bound is by assumptions for the most part of its variance."""
    unit, names = result.reconstruction.main, axis_names(result)
    number, out = main_event(unit), []
    if number is not None:
        whole = unit.body[number].event
        forward, right, _ = whole.delta_v.vector
        across = np.array([-right, forward, 0.0])
        for name, along in (("delta-V", whole.delta_v.vector), ("direction of force", across)):
            if along.any():
                out.append((name, whole.bound.shares(along)))
    ends = unit.path.variances()[NED]
    for name, axis in zip(names[:2], NED, strict=False):
        out.append((f"position {name}", ends[axis] / (ends[axis].sum() or 1.0)))
    return tuple(name for name, shares in out if shares[shares.index.isin(ASSUMED)].sum() > 0.5)


def assumption_words(result: CaseResult) -> str:
    """Return which numbers of page one rest on assumptions; empty where none does."""
    found = on_assumption(result)
    if not found:
        return ""
    axes = dict.fromkeys(a for u in result.reconstruction.units for a in u.at_point.assumed_axes)
    return (
        f"Not measured but assumed: {', '.join(axes)}. On this assumption rest: {', '.join(found)}."
    )


def _barrier_words(result: CaseResult, closure: Closure) -> str:
    if closure.contradicted:
        return "It CONTRADICTS a rigid barrier; see Contact and deformation."
    parts = []
    for crush in result.deformation.crush[:1]:
        at_least = "at least " * crush.at_least
        depth = length_about(crush.depth.value, crush.depth.half_width)
        parts.append(f"it was crushed by {at_least}{depth}")
    if closure.restitution is not None:
        parts.append(f"the restitution was {_figure(closure.restitution)}")
    return f"Against the barrier {'; '.join(parts)}." if parts else ""


def path_words(result: CaseResult) -> str:
    """Return the end position of the path."""
    unit = result.reconstruction.main
    place, half = _end(unit)
    (ahead, aside, _), (first, second, _) = (axis_names(result), place)
    return (
        f"{instant(unit.path.time[-1])} after the trigger the {result.spec.point.name} was "
        f"{length_about(first, half[0])} {ahead} and {length_about(second, half[1])} {aside} of "
        f"its position at the entry, {_axes(result)}."
    )


def units_words(result: CaseResult) -> str:
    """Return the number of recorders, and whether they agree."""
    made = result.reconstruction
    names = [u.name for u in made.units]
    if len(names) == 1:
        return f"The result is by one recorder, {names[0]}, without a second one to compare."
    assert made.comparison is not None
    told = "are consistent" if made.comparison.agree else "ARE NOT CONSISTENT"
    mean = "the weighted mean of" if made.combined is not None else f"{made.main.name}, one of"
    return (
        f"The result is {mean} {len(names)} recorders ({', '.join(names)}), which {told} "
        f"(probability {probability_words(made.comparison.probability)} of differences as large or "
        "larger)."
    )


def _axes(result: CaseResult) -> str:
    return "over ground" if over_ground(result) else "in the axes of the vehicle at the entry"


def _last_name(unit: UnitReconstruction) -> str:
    """Name of the position at the end of the path: final only where the vehicle came to rest."""
    path = unit.path
    last = path.time >= path.time[-1] - STANDING_FOR
    speeds = np.linalg.norm(path.table[VELOCITY].to_numpy()[last], axis=1)
    bounds = TWO_SIDED_95 * np.linalg.norm(path.sd[VELOCITY].to_numpy()[last], axis=1)
    long = path.time[-1] - path.time[0] > STANDING_FOR
    if long and bool((speeds + bounds < STANDING).all()):
        return "Final position"
    return f"Position at {instant(path.time[-1])}"


def _end(unit: UnitReconstruction) -> tuple[list[float], list[float]]:
    """Position at the end of the path and the half widths of its bound, m."""
    place = unit.path.table[NED].iloc[-1].tolist()
    half = (TWO_SIDED_95 * unit.path.sd[NED].iloc[-1]).tolist()
    return place, half


# Wording for recorders that disagree: each one separately, and the span of all.


def apart(result: CaseResult) -> bool:
    """Whether the recorders disagree, so that they have no mean."""
    made = result.reconstruction
    return made.comparison is not None and not made.comparison.agree and made.combined is None


def apart_headline(result: CaseResult) -> str:
    """Return the answers of all recorders in one sentence."""
    made = result.reconstruction
    told = "; ".join(f"{unit.name} {_change(unit)}" for unit in made.units)
    doubted = made.comparison.doubted if made.comparison is not None else ()
    named = f" The others contradict {' and '.join(doubted)}." if doubted else ""
    return f"The recorders disagree; their mean is not reported. Delta-V: {told}.{named}"


def apart_figures(result: CaseResult) -> tuple[KeyFigure, ...]:
    """Return delta-V and direction of force for page one: the span of all bounds.

    `result`: of recorders that disagree.
    """
    from strapdown.report.document import KeyFigure

    units = result.reconstruction.units
    spans = [span for span in map(_span, units) if span is not None]
    value = "no event"
    if spans:
        low, high = min(s[0] for s in spans), max(s[1] for s in spans)
        ends = [plain(speed_factor() * end, 1) for end in (low, high)]
        value = f"{' to '.join(ends)} {speed_unit()}"
        if not math.isfinite(high):
            value = f"above {ends[0]} {speed_unit()}"
    return (
        KeyFigure(
            "Delta-V",
            value,
            "; ".join(f"{unit.name} {_change(unit)}" for unit in units),
            "the recorders disagree: span of their 95 % bounds, no mean",
        ),
        KeyFigure(
            "Direction of force",
            _directions(units),
            "; ".join(f"{unit.name} {_direction(unit)}" for unit in units),
            "0° the front, clockwise from above",
        ),
    )


def _change(unit: UnitReconstruction) -> str:
    number = main_event(unit)
    if number is None:
        cut = unit.events.cut_change
        return f"at least {speed_words(cut)}" if cut > 0.0 else "no event"
    return change_words(unit.body[number].event)


def _span(unit: UnitReconstruction) -> tuple[float, float] | None:
    number = main_event(unit)
    if number is None:
        return None
    return unit.body[number].event.resultant_range


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


# Findings in the records of a case, and the metadata of a record.


# A number with needless digits, as 15.858333333.
LONG = re.compile(r"-?\d+\.\d{5,}")
# Keys of a record that end with their unit.
UNITS = {"_m_per_s": "m/s", "_kg": "kg", "_m": "m", "_deg": "deg"}


def notes(
    findings: Sequence[Finding], result: CaseResult, *, remedies: bool = True
) -> tuple[tuple[str, str], ...]:
    """Return findings as items; files and recorders with the same finding share an item.

    `result`: supplies the name of the recorders' mean. `remedies`: whether each item includes its
    remedy. Returns: location, and finding with its remedy.
    """
    combined = result.reconstruction.combined
    told: dict[tuple[str, str], list[str]] = {}
    alike_by: dict[tuple[str, str], Finding] = {}
    for finding in findings:
        file = finding.file or ""
        if combined is not None:
            file = file.replace(combined.name, MEAN)
        rest = [
            None if finding.row is None else f"row {finding.row}",
            None if finding.line is None else f"line {finding.line}",
            finding.quantity,
        ]
        remedy = finding.advice("file") or "" if remedies else ""
        text = _sentence(finding.sentence("file")) + (f" {_sentence(remedy)}" if remedy else "")
        place = ", ".join(r for r in rest if r)
        key = place, text
        alike = [k for k in told if _alike(alike_by[k], finding)]
        alike_by[key] = finding
        if file == MEAN and alike:
            # A finding of the mean that differs only in numbers is joined with the recorders'.
            files = [f for k in alike for f in told.pop(k)]
            told[key] = [*files, file]
        else:
            told.setdefault(key, []).append(file)
    return tuple(
        (": ".join(p for p in (_places(files), place) if p), text)
        for (place, text), files in told.items()
    )


def _alike(first: Finding, second: Finding) -> bool:
    """Whether two findings differ only in their numbers."""
    return (
        first.code == second.code
        and first.quantity == second.quantity
        and _words(first.data) == _words(second.data)
    )


def _words(data: object) -> object:
    """Return data without their numbers."""
    if isinstance(data, Mapping):
        return {key: _words(value) for key, value in data.items()}
    if isinstance(data, tuple):
        return tuple(_words(value) for value in data)
    if isinstance(data, Finding):
        return data.code, _words(data.data)
    return None if isinstance(data, int | float) else data


def _places(files: Sequence[str]) -> str:
    named = list(dict.fromkeys(f for f in files if f))
    if len(named) > 1 and named[-1] == MEAN:
        return f"{MEAN}, and each recorder"
    return ", ".join(named)


def _sentence(text: str) -> str:
    found = text.strip()
    return found[:1].upper() + found[1:] + ("" if found.endswith((".", "!", "?")) else ".")


def record_facts(record: CrashRecord) -> tuple[tuple[str, str], ...]:
    """Return the test metadata of a record, with units.

    Returns: empty if the record has only its file name.
    """
    rows = []
    if record.title and record.title != record.path.stem:
        rows.append(("title", record.title))
    facts = list(record.facts.items())
    for number, own in record.vehicles.items():
        of = f"vehicle {number}: " if len(record.vehicles) > 1 else ""
        facts += [(f"{of}{key}", value) for key, value in own.items()]
    for key, value in facts:
        name, unit = str(key), ""
        for ending, symbol in UNITS.items():
            if name.endswith(ending):
                name, unit = name.removesuffix(ending), f" {symbol}"
                break
        rows.append((name.replace("_", " "), LONG.sub(_short, str(value)) + unit))
    return tuple(rows)


def _short(found: re.Match[str]) -> str:
    return f"{float(found.group()):.6g}"


# What contradicts the answers, for page one.


#: Findings by which a record, a case or a second vehicle speaks against an answer.
AGAINST = frozenset(
    f"crash.{code}"
    for code in (
        "bias-against-times-stated",
        "direction-their-forces-stated",
        "disagree-their-common-point-chi",
        "deformation-energy-apart",
        "event-beyond-assumed-turning",
        "momentum-not-closed",
        "moves-on-at-barrier",
        "no-closing-speed",
        "no-event-yet",
        "no-point-closes",
        "no-rigid-barrier",
        "one-point-off",
        "others-agree-another-not",
        "point-does-not-close",
        "reads-more-than-stated-full",
        "residual-crush-above-dynamic",
        "rest-until-record-itself-comes",
        "restitution-above-one",
        "restitution-below-zero",
        "specific-force-rest-along-vehicle",
        "specific-force-rest-long-off",
        "stated-crash-began-ms-before",
        "turned-against-about-forward-right",
        "turned-more-than-assumed",
        "velocity-turns-back",
        "vertical-velocity-upward-vehicle-points",
        "window-exceeds-event",
    )
) | {"io.edr-maximum-beyond-table"}


def contradictions(result: CaseResult) -> tuple[tuple[str, str], ...]:
    """Return what speaks against the answers: references, records and the other vehicle.

    Returns: source, and what it says.
    """
    rows = []
    for answer in result.references:
        spec = answer.spec
        if answer.consistent or answer.unit != result.reconstruction.main.name:
            continue
        if answer.path is not None:
            at = f"at {instant(answer.path.errors.index[-1])}"
            off = answer.path.errors[NED].iloc[-1].to_numpy()
            half = answer.path.bound[NED].iloc[-1].to_numpy()
            differs = ", ".join(
                f"{name} {length_about(float(d), float(h))}"
                for name, d, h in zip(axis_names(result), off, half, strict=True)
            )
            text = f"Its path differs {at} by {differs} (this report less the reference)."
        else:
            assert spec.delta_v_m_per_s is not None
            text = (
                f"Its {spec.axis} delta-V is {speed_words(spec.delta_v_m_per_s)}; that of this "
                f"report, {speed_words(answer.delta_v)}, differs from it by "
                f"{speed(*answer.difference)} (95 %)."
            )
        rows.append((spec.name, text))
    found = [f for f in result.findings if f.code in AGAINST]
    return (*rows, *notes(found, result, remedies=False))


def not_shown(result: CaseResult) -> tuple[tuple[str, str], ...]:
    """Return what the records of this case cannot show."""
    spec, made = result.spec, result.reconstruction
    unit = made.main
    axes = list(dict.fromkeys(a for u in made.units for a in u.at_point.assumed_axes))
    barrier = spec.vehicle.against == "barrier"
    several, rate = len(made.units) > 1, spec.options.rate_hz
    applies = {
        "The speed before the impact": spec.entry.kind == "speed",
        "The place on the road": not over_ground(result),
        "The other vehicle or obstacle": not result.partners,
        "Axes that were not measured": bool(axes),
        "An error of the one recorder": not several,
        "Errors that the recorders share": several,
    }
    values = {
        "begin": instant(unit.acceleration.begin),
        "end": instant(unit.acceleration.end),
        "more": "" if barrier else "; a closing speed needs its case as well",
        "axes": ", ".join(axes),
        "rate": rate,
        "half": rate / 2.0,
    }
    rows = sentences()["not_shown"].items()
    return tuple((head, text.format(**values)) for head, text in rows if applies.get(head, True))


# Limitations of the answers of a case, from its own events, most serious first.


#: Limitations that make an answer wrong, not only less precise.
GRAVE = frozenset(
    (
        "blow-beyond-record",
        "event-beyond-record",
        "event-before-record",
        "direction-undetermined",
        "recorders-disagree",
        "vehicles-do-not-close",
        "reference-contradicts",
        "clipped-accelerometer",
        "clipped-gyro",
        "assumed",
    )
)


def limitations(result: CaseResult) -> tuple[tuple[str, str, str], ...]:
    """Return code, head and text of each limitation that applies to a case."""
    return tuple(_limitations(result))


def _limitation(code: str, /, *, of: str | None = None, **values: str) -> tuple[str, str, str]:
    """Code, head and text of a limitation; `of`: key of its sentences, by default the code."""
    head, text = sentences()["limitations"][of or code]
    return code, head.format(**values), text.format(**values)


def _limitations(result: CaseResult) -> Iterator[tuple[str, str, str]]:
    yield from _event(result)
    yield from clipping(result)
    yield from _disagreement(result)
    for answer in result.references:
        if answer.unit == result.reconstruction.main.name and not answer.consistent:
            source = answer.spec.source and f" Source of the reference: {answer.spec.source}."
            yield _limitation("reference-contradicts", name=answer.spec.name, source=source)
    closure = result.closure
    if closure is not None and closure.contradicted:
        first, second = (*result.vehicle_names, "the barrier")[:2]
        of = None if result.partners else "barrier-does-not-close"
        yield _limitation("vehicles-do-not-close", of=of, first=first, second=second)
    yield from assumed(result)
    yield from rest(result)
    yield from borrowed(result)
    if len(result.units) == 1:
        yield _limitation("one-recorder")
    yield from ringing(result)
    yield from _levers(result)
    if result.spec.entry.kind == "speed":
        yield _limitation("entry-speed-stated")
    if not result.references:
        yield _limitation("no-reference")


def _event(result: CaseResult) -> Iterator[tuple[str, str, str]]:
    unit = result.reconstruction.main
    number = main_event(unit)
    if number is None:
        others = [u.name for u in result.reconstruction.units if main_event(u) is not None]
        alone = (
            f" {' and '.join(others)} alone recorded one: see Delta-V, and check whether another "
            "record begins late or ends early."
        ) * bool(others)
        cut = unit.events.cut_change
        if cut > 0.0:
            end = instant(unit.acceleration.end)
            yield _limitation("blow-beyond-record", end=end, least=speed_words(cut), alone=alone)
        else:
            yield _limitation("no-event", alone=alone)
        return
    whole = unit.body[number].event
    if "after" in whole.missing:
        yield _limitation("event-beyond-record", end=instant(whole.delta_v.end))
    if "before" in whole.missing:
        yield _limitation("event-before-record", start=instant(whole.delta_v.start))
    if whole.interval.horizontal.undetermined:
        yield _limitation("direction-undetermined")
    if unit.ned[number] is None:
        yield _limitation("event-outside-path")


def _disagreement(result: CaseResult) -> Iterator[tuple[str, str, str]]:
    made = result.reconstruction
    comparison = made.comparison
    if comparison is None or comparison.agree:
        return
    pairs = [f"{p.first} and {p.second}" for p in comparison.pairs if not p.agree]
    if len(pairs) == len(comparison.pairs) > 1:
        pairs = ["No two agree"]
    mean = "The weighted mean is between them, and its bound is too narrow. "
    yield _limitation(
        "recorders-disagree",
        pairs="; ".join(pairs) or "All together",
        mean=mean * (made.combined is not None),
    )


def _levers(result: CaseResult) -> Iterator[tuple[str, str, str]]:
    point = np.asarray(result.spec.point.position_m)
    longest, name = max(
        (float(np.linalg.norm(point - unit.mounting.position)), unit.name) for unit in result.units
    )
    comparison = result.reconstruction.comparison
    structure = None if comparison is None else comparison.structure
    if longest > 0.0:
        far = f"{plain(length_factor() * longest, 2)} {length_unit()}"
        told = f"{result.spec.point.name}, up to {far} ({name})"
        if structure is not None and structure.reported:
            sd = speed_words(float(structure.sd.max()))
            yield _limitation("shared-deformation", sd=sd, point=told)
        else:
            yield _limitation("rigid-vehicle", point=told)


# Limitations due to the sensors: range, missing axes, stationary stretch, sample rate.


# A shorter stationary stretch determines the biases less well.
SHORT_REST = 2.0  # s
# Below this rate structural ringing is not resolved: up to a quarter of the rate is usable.
RINGS = 1000.0  # Hz


def _prepared(result: CaseResult) -> Iterator[tuple[UnitReconstruction, PreparedUnit]]:
    for unit in result.reconstruction.units:
        if unit.at_point.prepared is not None:
            yield unit, unit.at_point.prepared


def clipping(result: CaseResult) -> Iterator[tuple[str, str, str]]:
    """Return the sensors that reached the end of their range."""
    cut: dict[str, list[tuple[str, str]]] = {"accelerometer": [], "gyro": []}
    for unit, prepared in _prepared(result):
        time = unit.at_point.time
        for what, clipped in (
            ("accelerometer", prepared.clipped),
            ("gyro", prepared.gyro_clipped),
        ):
            axes = [k for k in range(3) if clipped[:, k].any()]
            if axes:
                rows = np.flatnonzero(clipped.any(axis=1))
                letters = ", ".join("xyz"[k] for k in axes)
                said = (
                    f"{unit.name}: its axis {letters}, {len(rows)} samples between "
                    f"{instant(time[rows[0]])} and {instant(time[rows[-1]])}"
                )
                cut[what].append((unit.name, said))
    for what, found in cut.items():
        if found:
            whose, spans = ", ".join(n for n, _ in found), "; ".join(s for _, s in found)
            yield _limitation(f"clipped-{what}", names=whose, spans=spans)


def assumed(result: CaseResult) -> Iterator[tuple[str, str, str]]:
    """Return the unmeasured quantities, once for all recorders that share them."""
    told: dict[tuple[str, str], list[str]] = {}
    for spec in result.spec.units:
        given, parts, lacks = spec.assumed, [], []
        if given is None:
            continue
        span = f"between {instant(given.over_s[0])} and {instant(given.over_s[1])}"
        if given.turn_sd_deg is not None:
            lacks.append("the rotation")
            parts.append(
                "No gyro: the rotation of the vehicle is assumed to be zero with a standard "
                f"deviation of {_each(given.turn_sd_deg, '°', 'roll, pitch and heading')} {span}."
            )
        if given.delta_v_sd_m_per_s is not None:
            missing = [
                name
                for name, column in zip(AXES, ("x", "y", "z"), strict=True)
                if all(column not in t.channels for t in spec.accelerometers)
            ]
            along = " and ".join(missing) or "an axis"
            lacks.append(f"delta-V {along}")
            parts.append(
                f"No accelerometer along {along}: delta-V there is "
                "assumed to be zero with a standard deviation of "
                f"{_each(given.delta_v_sd_m_per_s, ' m/s', 'x, y and z')} {span}."
            )
        parts.append("The bounds include this; they are wrong if the assumption is.")
        if given.because:
            parts.append(f"Reason stated: {given.because.rstrip('.')}.")
        told.setdefault((" and ".join(lacks), " ".join(parts)), []).append(spec.name)
    for (what, text), names in told.items():
        yield "assumed", f"{', '.join(names)}: {what}, not measured but assumed", text


def _each(sd: float | tuple[float, float, float], unit: str, names: str) -> str:
    """Format one standard deviation for all axes, or one for each."""
    if isinstance(sd, float):
        return f"{sd:g}{unit}"
    return f"{sd[0]:g}, {sd[1]:g} and {sd[2]:g}{unit} ({names})"


def rest(result: CaseResult) -> Iterator[tuple[str, str, str]]:
    """Return the shortcomings of the stationary stretch before the crash."""
    told: dict[tuple[str, tuple[tuple[str, str], ...]], list[str]] = {}
    for unit, prepared in _prepared(result):
        still, level = prepared.rest, prepared.levelling
        if unit.drive is not None and (still is None or still.grade == "steady"):
            # Level and biases are those of the drive.
            continue
        if still is None:
            half = TWO_SIDED_95 * level.sd_deg
            roll, pitch = (about(angle, half, "°") for angle in (level.roll_deg, level.pitch_deg))
            code, values = "no-rest", {"roll": roll, "pitch": pitch}
        else:
            code, values = "steady-rest", {"start": instant(still.start), "end": instant(still.end)}
            if still.grade != "steady":
                if still.end - still.start >= SHORT_REST:
                    continue
                code, values["length"] = "short-rest", instant(still.end - still.start)
        told.setdefault((code, tuple(values.items())), []).append(unit.name)
    for (code, items), names in told.items():
        yield _limitation(code, names=", ".join(names), **dict(items))


def borrowed(result: CaseResult) -> Iterator[tuple[str, str, str]]:
    """Return the recorders without a gyro, and the recorder whose gyro they use."""
    told: dict[str, list[str]] = {}
    for unit in result.units:
        if unit.gyro is None and unit.gyro_from is not None:
            told.setdefault(unit.gyro_from, []).append(unit.name)
    for lender, names in told.items():
        yield _limitation("borrowed-gyro", names=", ".join(names), lender=lender)


def ringing(result: CaseResult) -> Iterator[tuple[str, str, str]]:
    """Return the recorders whose sample rate is too low for structural ringing."""
    slow = []
    for unit in result.units:
        stamps = unit.accelerometers[-1].table.index.to_numpy()
        rate = 1.0 / float(np.median(np.diff(stamps)))
        means = unit.accelerometers[-1].table.attrs.get("sampling") == "mean"
        if rate < RINGS and not means:
            slow.append((unit.name, rate))
    if slow:
        rates = ", ".join(f"{name} ({rate:.4g} Hz)" for name, rate in slow)
        yield _limitation("ringing", rates=rates)


# Assumptions and conventions of a crash report.


@cache
def sentences() -> dict[str, Any]:
    """Sentences of the report that do not depend on the case but by values in them."""
    return tomllib.loads(files("strapdown.report").joinpath("crash_words.toml").read_text("utf-8"))


def conventions() -> tuple[tuple[str, str], ...]:
    """Return the conventions, with the units that are shown."""
    units = SHOWN.get()
    rows = sentences()["conventions"].items()
    return tuple((k, text.format(speed=units.speed, length=units.length)) for k, text in rows)


def assumptions(result: CaseResult) -> tuple[tuple[str, str], ...]:
    """Return the assumptions of this case."""
    spec = result.spec
    options, entry = spec.options, spec.entry
    comparison = result.reconstruction.comparison
    bent = comparison is not None and comparison.structure.reported
    keys = ["bent" if bent else "rigid", "errors", "gravity", options.sampling, options.clock]
    values: dict[str, Any] = {"at": instant(entry.time_s), "source": entry.source or "not stated"}
    if entry.kind == "speed":
        assert entry.speed_m_per_s is not None and entry.speed_sd_m_per_s is not None
        half = TWO_SIDED_95 * entry.speed_sd_m_per_s
        values |= {
            "speed": speed(entry.speed_m_per_s, half),
            "direction": TWO_SIDED_95 * entry.slip_sd_deg,
            "climb": TWO_SIDED_95 * entry.climb_sd_m_per_s,
        }
    keys += [entry.kind] * (entry.kind != "speed_record")
    if entry.speed_path is not None:
        keys.append("wheels")
        values["scale"] = TWO_SIDED_95 * entry.speed_scale_sd_percent
        values["delay"] = TWO_SIDED_95 * entry.speed_delay_sd_s
    if entry.kind in OF_DRIVES and (entry.slip_sd_deg or entry.speed_path is not None):
        from strapdown.crash.drive_entry import CAR

        keys.append("drive")
        values["slip"] = TWO_SIDED_95 * (entry.slip_sd_deg or CAR["side_slip_sd_deg"])
    values = options.model_dump() | entry.model_dump() | values
    found = [sentences()["assumptions"][key] for key in keys]
    reasons: dict[str, list[str]] = {}
    for unit in spec.units:
        if unit.assumed is not None and unit.assumed.because:
            reasons.setdefault(unit.assumed.because, []).append(unit.name)
    return (
        *((head, text.format(**values)) for head, text in found),
        *((", ".join(n), f"Reason for the assumed axes: {why}") for why, n in reasons.items()),
    )


def method(result: CaseResult) -> tuple[str, ...]:
    """Return the processing steps from the records to the answers, in order."""
    said, samples = sentences()["method"], result.samples
    runs = "" if samples is None else f", and by {len(samples.errors)} Monte Carlo runs"
    steps = [*said["steps"]]
    if len(result.units) > 1:
        steps.append(said["compared"])
    mean = ", and their weighted mean is reconstructed as well"
    mean *= result.reconstruction.combined is not None
    return tuple(step.format(runs=runs, mean=mean) for step in steps)


def how_to_verify() -> tuple[tuple[str, str], ...]:
    """Return ways to check the report, besides the command."""
    return tuple(sentences()["how_to_verify"].items())


# Quantities that a drive determines.


DEG = math.degrees(1.0)


class DriveQuantity(NamedTuple):
    """A quantity that a drive determines: its key in JSON, unit, and names on axes 0 to 2."""

    key: str
    symbol: str
    size: float
    names: tuple[str, ...]


_BIAS, _SCALE = (tuple(f"{what} {axis}" for axis in "xyz") for what in ("bias", "scale factor"))
#: By the quantities of `EntryState.calibration`; `size` is that of the unit, in SI.
DRIVE_QUANTITIES: dict[str, DriveQuantity] = {
    "bias": DriveQuantity("accelerometer_bias_m_per_s2", "m/s²", 1.0, _BIAS),
    "scale": DriveQuantity("accelerometer_scale_percent", "%", 0.01, _SCALE),
    "gyro bias": DriveQuantity("gyro_bias_deg_per_s", "°/s", 1.0 / DEG, _BIAS),
    "gyro scale": DriveQuantity("gyro_scale_percent", "%", 0.01, _SCALE),
    "mounting": DriveQuantity(
        "mounting_deg", "°", 1.0 / DEG, ("mounting roll", "mounting pitch", "mounting yaw")
    ),
    "speed scale": DriveQuantity("speed_scale_percent", "%", 0.01, ("scale of the wheels",)),
    "speed delay": DriveQuantity("speed_delay_s", "s", 1.0, ("delay of the wheels",)),
}

"""Results of a case in sentences, shared by terminal, page and PDF."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence

import numpy as np

from strapdown.constants import TWO_SIDED_95
from strapdown.crash.case import CaseResult, main_event
from strapdown.crash.pdof import Pdof
from strapdown.crash.reconstruction import UnitReconstruction
from strapdown.errors import Finding
from strapdown.formats.crash_record import CrashRecord
from strapdown.report.document import KeyFigure
from strapdown.report.values import (
    GAP,
    KMH,
    MEAN,
    about,
    angle_range,
    axis_names,
    instant,
    moment,
    over_ground,
    plain,
    side_words,
    speed,
    speed_range,
)
from strapdown.tables import NED

TYPES = {
    "front": "an impact from the front",
    "right": "an impact from the right",
    "rear": "an impact from behind",
    "left": "an impact from the left",
    "rollover": "a rollover",
    "undetermined": "of a type that the bounds leave open",
}


def headline(result: CaseResult) -> str:
    """Return the answer in one sentence."""
    if apart(result):
        return apart_headline(result)
    unit = result.reconstruction.main
    number = main_event(unit)
    if number is None:
        size, axis = unit.events.largest_change, unit.events.largest_axis
        return (
            f"There is no event after 49 CFR 563 in the record: the {axis} velocity changed by "
            f"{plain(KMH * size, 1)} km/h at most within 150 ms, where 8 km/h make one."
        )
    whole = unit.body[number].event
    return (
        f"Delta-V {speed(whole.resultant, whole.resultant_bound)}; direction of force "
        f"{direction(unit, number)}; {TYPES[unit.types[number].name]}."
    )


def direction(unit: UnitReconstruction, number: int) -> str:
    """Return the direction of force of an event with its bound."""
    whole = unit.body[number].event
    across = whole.interval.horizontal
    if across.undetermined:
        return angle_range(across)
    angle = whole.pdof
    assert isinstance(angle, Pdof)
    return f"{plain(angle.horizontal_deg, 1)}° ({angle_range(across)}), {angle.clock} o'clock"


def key_figures(result: CaseResult) -> tuple[KeyFigure, ...]:
    """Return the key figures of page one."""
    unit = result.reconstruction.main
    number = main_event(unit)
    figures: list[KeyFigure] = []
    of = ""
    if apart(result):
        figures += apart_figures(result)
        of = f" by {unit.name}"
    elif number is None:
        figures.append(KeyFigure("Delta-V", "no event", headline(result)))
    else:
        changes = unit.body[number]
        whole, peak = changes.event, changes.peak
        event = unit.events.events[number]
        ms = 1e3 * (peak.delta_v.end - peak.delta_v.start)
        figures.append(
            KeyFigure(
                "Delta-V",
                speed(whole.resultant, whole.resultant_bound),
                speed_range(whole.resultant, whole.resultant_bound),
                f"over the event, {instant(event.time_zero)} to {instant(event.end)}; largest in "
                f"{ms:.3g} ms {speed(peak.resultant, peak.resultant_bound)}",
            )
        )
        across = whole.interval.horizontal
        value = "not determined"
        if not across.undetermined:
            angle = whole.pdof
            value = f"{plain(getattr(angle, 'horizontal_deg', np.nan), 1)}°, {angle.clock} o'clock"
        figures.append(
            KeyFigure(
                "Direction of force",
                value,
                angle_range(across),
                "where the force came from: 0° the front, clockwise seen from above",
            )
        )
    place, half = _end(unit)
    figures.append(
        KeyFigure(
            f"Place at the end{of}",
            f"{plain(math.hypot(place[0], place[1]), 2)} m",
            ", ".join(
                f"{name}{GAP}{about(p, h, 'm')}"
                for name, p, h in zip(axis_names(result), place, half, strict=True)
            )
            + f" with 95{GAP}%",
            f"from the place at {instant(unit.path.entry.time)} to that at "
            f"{instant(unit.path.time[-1])}, {_axes(result)}",
        )
    )
    return tuple(figures)


def lead(result: CaseResult) -> str:
    """Return the lead paragraph of page one."""
    unit = result.reconstruction.main
    number = main_event(unit)
    parts = []
    if apart(result):
        parts.append(f"{apart_headline(result)} What follows is of {unit.name}.")
    if number is None:
        parts.append(headline(result))
    else:
        changes = unit.body[number]
        whole, peak = changes.event, changes.peak
        event = unit.events.events[number]
        forward, right = float(whole.delta_v.vector[0]), float(whole.delta_v.vector[1])
        length = 1e3 * (event.end - event.time_zero)
        parts.append(
            f"Within {length:.0f} ms from {moment(event.time_zero)} on, the velocity of the "
            f"{result.spec.point.name} changed by "
            f"{speed(whole.resultant, whole.resultant_bound)} ("
            f"{about(whole.resultant, whole.resultant_bound, 'm/s')}; all bounds hold 95 %), "
            f"{side_words(forward, right)}. The force came from "
            f"{direction(unit, number)}: {TYPES[unit.types[number].name]}."
        )
        others = len(unit.body) - 1
        if others:
            parts.append(
                f"It is the largest of {len(unit.body)} events; the others are told under Delta-V."
            )
        parts.append(
            f"The largest change within {1e3 * (peak.delta_v.end - peak.delta_v.start):.3g} ms was "
            f"{speed(peak.resultant, peak.resultant_bound)}."
        )
    parts += [entry_words(result), path_words(result), units_words(result)]
    return " ".join(p for p in parts if p)


def entry_words(result: CaseResult) -> str:
    """Return the entry speed and its source."""
    entry = result.spec.entry
    if entry.kind == "standstill":
        return "The vehicle stood still when the record began."
    if entry.kind == "gnss":
        at = result.reconstruction.main.path.entry
        size = float(np.linalg.norm(at.velocity))
        return (
            f"At {instant(at.time)} it moved at {plain(KMH * size, 1)} km/h, found from the fixes "
            "of a satellite receiver before the impact."
        )
    assert entry.speed_m_per_s is not None and entry.speed_sd_m_per_s is not None
    half = TWO_SIDED_95 * entry.speed_sd_m_per_s
    source = f" ({entry.source})" if entry.source else ""
    return (
        f"It entered at {speed(entry.speed_m_per_s, half)}{source}, which is stated and not found "
        "from the record."
    )


def path_words(result: CaseResult) -> str:
    """Return the end position of the path."""
    unit = result.reconstruction.main
    place, half = _end(unit)
    (ahead, aside, _), (first, second, _) = (axis_names(result), place)
    return (
        f"{instant(unit.path.time[-1])} after the trigger the {result.spec.point.name} was "
        f"{about(first, half[0], 'm')} {ahead} and {about(second, half[1], 'm')} {aside} of where "
        f"it entered, {_axes(result)}."
    )


def units_words(result: CaseResult) -> str:
    """Return the number of recorders, and whether they agree."""
    made = result.reconstruction
    names = [u.name for u in made.units]
    if len(names) == 1:
        return f"All of this rests on one recorder, {names[0]}, beside which there is no other."
    assert made.comparison is not None
    told = "agree within what is stated of them" if made.comparison.agree else "DO NOT AGREE"
    mean = "the weighted mean of" if made.combined is not None else f"{made.main.name}, one of"
    return (
        f"All this is {mean} {len(names)} recorders ({', '.join(names)}), which {told} "
        f"(probability {_probability(made.comparison.probability)} of differences as large or "
        "larger)."
    )


def _probability(value: float) -> str:
    return "below 0.0001" if value < 1e-4 else f"{value:.2g}"


def _axes(result: CaseResult) -> str:
    return "over ground" if over_ground(result) else "in the axes of the vehicle at the entry"


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
    told = "; ".join(f"{unit.name} {_change(unit)}" for unit in result.reconstruction.units)
    return f"The recorders do not agree, and no mean of them is told. Delta-V: {told}."


def apart_figures(result: CaseResult) -> tuple[KeyFigure, ...]:
    """Return delta-V and direction of force for page one: the span of all bounds.

    Parameters
    ----------
    result : CaseResult
        Of recorders that disagree.
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


# Findings in the records of a case, and the metadata of a record.


# A number with needless digits, as 15.858333333.
LONG = re.compile(r"-?\d+\.\d{5,}")
# Keys of a record that end with their unit.
UNITS = {"_m_per_s": "m/s", "_kg": "kg", "_m": "m", "_deg": "deg"}


def notes(
    findings: Sequence[Finding], result: CaseResult, *, remedies: bool = True
) -> tuple[tuple[str, str], ...]:
    """Return findings as items; files and recorders with the same finding share an item.

    Parameters
    ----------
    findings : sequence of Finding
    result : CaseResult
        Supplies the name of the recorders' mean.
    remedies : bool
        Whether each item includes its remedy.

    Returns
    -------
    tuple of (str, str)
        Location, and finding with its remedy.
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
        return f"{MEAN}, and each by itself"
    return ", ".join(named)


def _sentence(text: str) -> str:
    found = text.strip()
    return found[:1].upper() + found[1:] + ("" if found.endswith((".", "!", "?")) else ".")


def record_facts(record: CrashRecord) -> tuple[tuple[str, str], ...]:
    """Return the test metadata of a record, with units.

    Returns
    -------
    tuple of (str, str)
        Empty if the record has only its file name.
    """
    rows = []
    if record.title and record.title != record.path.stem:
        rows.append(("title", record.title))
    for key, value in record.facts.items():
        name, unit = str(key), ""
        for ending, symbol in UNITS.items():
            if name.endswith(ending):
                name, unit = name.removesuffix(ending), f" {symbol}"
                break
        rows.append((name.replace("_", " "), LONG.sub(_short, str(value)) + unit))
    return tuple(rows)


def _short(found: re.Match[str]) -> str:
    return f"{float(found.group()):.6g}"

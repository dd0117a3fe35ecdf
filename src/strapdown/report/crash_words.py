"""Results of a case in sentences, shared by terminal, page and PDF."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence

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
from strapdown.sensors.pre_crash import PreparedUnit
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
                f"It is the largest of {len(unit.body)} events; the others are under Delta-V."
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
        return f"All of this rests on one recorder, {names[0]}, without a second one to compare."
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
    return f"The recorders disagree; their mean is not reported. Delta-V: {told}."


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


# Limitations of the answers of a case, from its own events, most serious first.


#: Limitations that make an answer wrong, not only less precise.
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
    """Return the limitations that a reader must know before relying on the answers.

    Returns
    -------
    tuple of (head, text)
        Only those that apply to this case.
    """
    return tuple((head, text) for _, head, text in _all(result))


def grave_limitations(result: CaseResult) -> tuple[str, ...]:
    """Return the heads of the limitations that make an answer wrong, not only less precise."""
    return tuple(head for code, head, _ in _all(result) if code in GRAVE)


def _all(result: CaseResult) -> tuple[tuple[str, str, str], ...]:
    """Return code, head and text of each limitation."""
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
            "The record holds no event after 49 CFR 563. Delta-V and direction of force are not "
            f"defined; the path is reported.{alone if others else ''}",
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
            "Its change of velocity is given along the rotating axes of the vehicle only.",
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


# Limitations due to the sensors: range, missing axes, stationary stretch, sample rate.


# A shorter stationary stretch determines the biases less well.
SHORT_REST = 2.0  # s
# Below this rate structural ringing is not resolved: up to a quarter of the rate is usable.
RINGS = 1000.0  # Hz
AXES = ("forward", "right", "down")


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
                names = ", ".join("xyz"[k] for k in axes)
                said = (
                    f"{unit.name}: its axis {names}, {len(rows)} samples between "
                    f"{instant(time[rows[0]])} and {instant(time[rows[-1]])}"
                )
                cut[what].append((unit.name, said))
    for what, found in cut.items():
        if not found:
            continue
        follows, then = (
            ("the true delta-V is larger", "every place after it is off by what is missing")
            if what == "accelerometer"
            else ("the vehicle turned more", "what is resolved with its attitude is off")
        )
        yield (
            "clipped",
            f"{', '.join(name for name, _ in found)}: the {what} was at the end of its range, and "
            f"{follows}",
            f"{'; '.join(said for _, said in found)}; no wider range stands behind it. What was "
            f"cut off is missing, and no bound here knows how much: along that axis {follows} than "
            f"what is told here, and {then}.",
        )


def assumed(result: CaseResult) -> Iterator[tuple[str, str, str]]:
    """Return the unmeasured quantities, once for all recorders that share them."""
    told: dict[str, list[str]] = {}
    for spec in result.spec.units:
        given, parts = spec.assumed, []
        if given is None:
            continue
        span = f"between {instant(given.over_s[0])} and {instant(given.over_s[1])}"
        if given.turn_sd_deg is not None:
            parts.append(
                "There is no gyro: the vehicle is taken not to have turned, with a standard "
                f"deviation of {_each(given.turn_sd_deg, '°', 'roll, pitch and heading')} {span}."
            )
        if given.delta_v_sd_m_per_s is not None:
            missing = [
                name
                for name, column in zip(AXES, ("x", "y", "z"), strict=True)
                if all(column not in t.channels for t in spec.accelerometers)
            ]
            parts.append(
                f"There is no accelerometer along {' and '.join(missing) or 'an axis'}: nothing is "
                "taken to have changed there, with a standard deviation of "
                f"{_each(given.delta_v_sd_m_per_s, ' m/s', 'x, y and z')} {span}."
            )
        parts.append("The bounds have it; they are wrong where the assumption is.")
        if given.because:
            parts.append(f"Reason stated: {given.because.rstrip('.')}.")
        told.setdefault(" ".join(parts), []).append(spec.name)
    for text, names in told.items():
        yield "assumed", f"{', '.join(names)}: not everything was measured", text


def _each(sd: float | tuple[float, float, float], unit: str, names: str) -> str:
    """Format one standard deviation for all axes, or one for each."""
    if isinstance(sd, float):
        return f"{sd:g}{unit}"
    return f"{sd[0]:g}, {sd[1]:g} and {sd[2]:g}{unit} ({names})"


def rest(result: CaseResult) -> Iterator[tuple[str, str, str]]:
    """Return the shortcomings of the stationary stretch before the crash."""
    told: dict[tuple[str, str], list[str]] = {}
    for unit, prepared in _prepared(result):
        still, level = prepared.rest, prepared.levelling
        if still is None:
            half = TWO_SIDED_95 * level.sd_deg
            said = (
                "no stationary stretch before the crash",
                f"Roll and pitch are stated, {about(level.roll_deg, half, '°')} and "
                f"{about(level.pitch_deg, half, '°')}, or carried over from another recorder; "
                "biases are as stated of the sensors.",
            )
        elif still.grade == "steady":
            said = (
                "quiet before the crash, but perhaps at speed",
                f"The stretch from {instant(still.start)} to {instant(still.end)} may have been "
                "driven; acceleration and turning over it are taken as zero with a bound.",
            )
        elif still.end - still.start < SHORT_REST:
            said = (
                "a short stationary stretch",
                f"{instant(still.end - still.start)} before the crash, from "
                f"{instant(still.start)}: biases and levelling are known the less the "
                "shorter it is, and the bounds are so much wider.",
            )
        else:
            continue
        told.setdefault(said, []).append(unit.name)
    for (head, text), names in told.items():
        yield "rest", f"{', '.join(names)}: {head}", text


def borrowed(result: CaseResult) -> Iterator[tuple[str, str, str]]:
    """Return the recorders without a gyro, and the recorder whose gyro they use."""
    told: dict[str, list[str]] = {}
    for unit in result.units:
        if unit.gyro is None and unit.gyro_from is not None:
            told.setdefault(unit.gyro_from, []).append(unit.name)
    for lender, names in told.items():
        yield (
            "borrowed-gyro",
            f"{', '.join(names)}: no gyro",
            f"The turning is that of {lender}: a rigid vehicle turns everywhere alike. An error of "
            "that gyro is in all of them, and the comparison of recorders does not show it.",
        )


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
        which = ", ".join(f"{name} ({rate:.4g} Hz)" for name, rate in slow)
        yield (
            "ringing",
            "Ringing of the structure is not seen at this rate",
            f"{which}: what swings faster than a quarter of the rate cannot be integrated from "
            "samples. Ringing of 10 g at 195 Hz that decays in 30 ms moves the path by 1 m within "
            "750 ms at 200 Hz, and is not in the bounds. Another recorder at 1 kHz or more that "
            "agrees excludes it.",
        )


# Assumptions and conventions of a crash report.


CONVENTIONS = (
    ("Vehicle axes", "forward, right, down, turning with the vehicle"),
    ("Time", "s from the trigger; a recorder's own clock may show anything"),
    (
        "Path",
        "north, east, down from the place of the reference point at the entry; where no heading "
        "is stated, forward and right of the vehicle at the entry take the place of north and east",
    ),
    ("Attitude", "roll, pitch, heading (3-2-1): right side down, nose up, clockwise are positive"),
    (
        "Delta-V",
        "the change of velocity, so that a frontal crash has a negative forward part; along the "
        "turning axes of the vehicle, as recorders integrate it, where nothing else is said",
    ),
    (
        "Direction of force (PDOF)",
        "where the force came from: atan2(−ΔV right, −ΔV forward); 0° the front, positive "
        "clockwise seen from above, 90° the right side; on the clock 12 is the front",
    ),
    (
        "Event, time zero, end",
        "49 CFR 563.5(b): 8 km/h within 150 ms make an event; it begins with 0.8 km/h within 20 ms "
        "and ends when the resultant change within 20 ms becomes that or less",
    ),
    (
        "Bounds",
        "hold the truth in 95 of 100 cases (1.96 standard deviations) where everything that is "
        "stated and assumed here is right; of a direction, Fieller's interval",
    ),
    ("Units", "SI, with km/h for changes of velocity and g = 9.80665 m/s² for accelerations"),
)


def assumptions(result: CaseResult) -> tuple[tuple[str, str], ...]:
    """Return the assumptions of this case."""
    spec = result.spec
    options, entry = spec.options, spec.entry
    found = [
        (
            "Rigid vehicle",
            "Between each recorder and the reference point the vehicle keeps its shape.",
        ),
        (
            "Errors of the sensors",
            "are normal, of mean zero, and independent from recorder to recorder, with the "
            "standard deviations of the table under Sensors; within the record they do not drift.",
        ),
        (
            "Gravity",
            f"is {options.gravity_m_per_s2:g} m/s² and vertical throughout; the turning of the "
            "Earth over the record is computed and not assumed away.",
        ),
        (
            "Samples",
            f"The records are brought to {options.rate_hz:g} Hz as "
            + (
                "true means over each step."
                if options.sampling == "mean"
                else "values of a band-limited signal; each low-pass is taken to be late by its "
                "time constant."
            ),
        ),
        (
            "Clocks",
            "are tied by each recorder's trigger, as well as it is stated."
            if options.clock == "trigger"
            else "are tied by what the recorders felt, laid over each other.",
        ),
    ]
    if entry.kind == "speed":
        assert entry.speed_m_per_s is not None and entry.speed_sd_m_per_s is not None
        half = TWO_SIDED_95 * entry.speed_sd_m_per_s
        direction = TWO_SIDED_95 * entry.slip_sd_deg
        found.append(
            (
                "Entry",
                f"At {instant(entry.time_s)} the vehicle moved at "
                f"{speed(entry.speed_m_per_s, half)}, {entry.slip_deg:g} ± {direction:.2g}° "
                f"clockwise of where it pointed, and horizontally within "
                f"{TWO_SIDED_95 * entry.climb_sd_m_per_s:.2g} m/s. Source: "
                f"{entry.source or 'not stated'}.",
            )
        )
    elif entry.kind == "standstill":
        found.append(("Entry", "The vehicle stood still when the record began."))
    else:
        found.append(
            (
                "Entry",
                "The fixes are believed as far as they say, never beyond 50 m/s² or 20 m/s³, nor "
                "from the impact on.",
            )
        )
    reasons: dict[str, list[str]] = {}
    for unit in spec.units:
        if unit.assumed is not None and unit.assumed.because:
            reasons.setdefault(unit.assumed.because, []).append(unit.name)
    for because, names in reasons.items():
        found.append((", ".join(names), f"What was not measured is assumed because: {because}"))
    return tuple(found)


def method(result: CaseResult) -> tuple[str, ...]:
    """Return the processing steps from the records to the answers, in order."""
    steps = [
        "The clocks of the recorders are tied to the trigger, and all channels are brought to "
        "common stamps without aliasing; the delay of each low-pass is taken off.",
        "The stationary stretch before the crash tells the bias of the gyro, that of a high "
        "range against a low one, and roll and pitch; where there is none, what is stated is used.",
        "Ranges are merged: the low one while it is clear of its end, the high one beyond.",
        "Each recorder is turned into vehicle axes and moved to the reference point.",
        "Events are found, and their changes of velocity integrated along the turning axes and, "
        "with gravity taken off, over ground.",
        "The path runs from the entry, forward and backward, by strapdown navigation.",
        "Every unknown of the sensors, mounting, clocks and entry is carried through all of this, "
        "linearly"
        + (
            "."
            if result.samples is None
            else f", and by {len(result.samples.errors)} complete runs with drawn errors."
        ),
    ]
    if len(result.units) > 1:
        steps.append(
            "The recorders are compared at the reference point"
            + (
                ", and their weighted mean is reconstructed as well."
                if result.reconstruction.combined is not None
                else "."
            )
        )
    return tuple(steps)


def how_to_verify() -> tuple[tuple[str, str], ...]:
    """Return ways to check the report, besides the command."""
    return (
        (
            "Run it again",
            "Install strapdown in the version named on page one (pip install strapdown) and give "
            "the command below. It checks every file against the seal, runs the whole case again "
            "from the records, and compares each byte; it names every file and every option that "
            "was changed.",
        ),
        (
            "The seal",
            "is the SHA-256 of manifest.json, which holds that of every file of the folder. It was "
            "printed when the report was made: write it into the file of the case, apart from the "
            "folder, since who changes a file and the manifest too would not be found otherwise.",
        ),
        (
            "By other means",
            "The records stand under inputs/, the path in trajectory.csv and all numbers in "
            "crash.json, with their units in the names.",
        ),
    )

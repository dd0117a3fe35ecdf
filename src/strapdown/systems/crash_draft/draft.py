"""A commented case.toml from records: what was found, what is assumed, what only the user knows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from strapdown.constants import STANDARD_GRAVITY
from strapdown.exceptions import Finding
from strapdown.systems.crash_draft.group_units import Unit
from strapdown.systems.crash_draft.heading_of_unit import Facing, facings
from strapdown.systems.crash_draft.parts import Part, Skipped
from strapdown.systems.crash_draft.range_ends import RangeEnds, in_words
from strapdown.systems.crash_draft.stated_errors import stated_of
from strapdown.systems.crash_draft.toml_text import (
    ASK,
    Asked,
    Page,
    array,
    inline,
    number,
    plain,
    string,
)

__all__ = ["Draft", "write_draft"]

KMH = 3.6

SHOWN_SENSORS = 8


@dataclass(frozen=True)
class Draft:
    """A case as it was drafted.

    Attributes
    ----------
    text : str
        Of the file.
    found : tuple of str
        For the user, a line each.
    asked : tuple of Asked
        What is left to the user.
    findings : tuple of Finding
        What a person should know of the records.
    """

    text: str
    found: tuple[str, ...]
    asked: tuple[Asked, ...]
    findings: tuple[Finding, ...] = ()


def write_draft(
    units: Sequence[Unit],
    skipped: Sequence[Skipped],
    *,
    title: str = "",
    facts: Mapping[str, str] | None = None,
    findings: Sequence[Finding] = (),
) -> Draft:
    """Write a case of units.

    Parameters
    ----------
    units : sequence of Unit
    skipped : sequence of Skipped
        What was left out, for a comment.
    title : str
        As the record says; empty where it says none.
    facts : mapping, optional
        Of a test: the keys of `CrashRecord.facts`.
    findings : sequence of Finding
    """
    page = Page()
    facing = facings(units)
    _head(page)
    _case(page, title, facts or {})
    _vehicle(page, facts or {})
    _entry(page, facts or {})
    for k, unit in enumerate(units):
        _unit(page, unit, facing[k], units)
    _left_out(page, skipped)
    _options(page, units)
    return Draft(page.text, tuple(_found(units)), tuple(page.asked), tuple(findings))


def _head(page: Page) -> None:
    page.say(
        "A crash case for strapdown. It was written from the records; the answers are yours.",
        "",
        'Wherever it says "?", only you know the answer: write it there (texts keep their quotation '
        "marks, numbers have none). Where it says 'found', the records told it; where it says "
        "'assumed', nothing did: look at it. Then run: strapdown crash with the name of this file.",
        "",
        "Axes of the vehicle: forward, right, down. All positions are from one origin of your "
        "choice, such as the centre of mass, in m; keys may end in _mm or _cm instead of _m, "
        "speeds in _m_per_s instead of _km_per_h.",
    )


def _case(page: Page, title: str, facts: Mapping[str, str]) -> None:
    page.blank()
    if title:
        page.key("title", string(title), "found: in the record")
    else:
        page.key(
            "title", ASK, 'only you know: e.g. "Car against pole, 12 March"', what="what it is about"
        )
    number_of = facts.get("test", "")
    page.key("number", string(number_of), "of your file, as you like" if not number_of else "found")
    page.key("author", '""', "who stands for it, as you like")
    page.key("description", '""', "a few sentences for the first page, as you like")


def _vehicle(page: Page, facts: Mapping[str, str]) -> None:
    page.table("[vehicle]")
    page.key("name", string(facts.get("vehicle", "")), "for the report, as you like")
    mass = _fact(facts, "mass_kg")
    if mass is None:
        page.key("mass_kg", ASK, "only you know: as it was driven, in kg, e.g. 1450", what="mass, kg")
    else:
        page.key("mass_kg", number(mass), "found: in the record, as tested, kg")
    for name, usual in (("length_m", 4.5), ("width_m", 1.8)):
        value = _fact(facts, name)
        how = "assumed: of a car, m; it is drawn so" if value is None else "found: in the record, m"
        page.key(name, number(usual if value is None else value), how)
    page.table("[point]", "The point whose motion and change of velocity are told.")
    page.key("name", '"centre of mass"')
    page.key("position_m", array([0.0, 0.0, 0.0]), "assumed: it is the origin of all positions, m")


def _entry(page: Page, facts: Mapping[str, str]) -> None:
    page.table(
        "[entry]",
        "How fast the vehicle was at the impact, and how that is known. If it stood still before "
        'the blow: kind = "standstill", and delete the speed and its sd.',
    )
    page.key("kind", '"speed"')
    speed = _fact(facts, "speed_m_per_s")
    if speed is None:
        page.key(
            "speed_km_per_h", ASK, "only you know: forward, km/h, e.g. 25.6", what="entry speed, km/h"
        )
        page.key(
            "speed_sd_km_per_h",
            ASK,
            "only you know: standard deviation, km/h: two thirds of all such values are within it, "
            "e.g. 0.4 for a light barrier",
            what="its standard deviation, km/h",
        )
        page.key(
            "source",
            ASK,
            'only you know: how it was measured, e.g. "light barrier 2 m before the pole"',
            what="how the speed is known",
        )
        return
    page.key("speed_km_per_h", number(speed * KMH), "found: in the record, km/h")
    page.key("speed_sd_km_per_h", "0.1", "assumed: of a speed trap of a laboratory, km/h")
    page.key("source", string("stated by the record"), "found")


def _fact(facts: Mapping[str, str], key: str) -> float | None:
    try:
        value = float(facts.get(key, ""))
    except ValueError:
        return None
    return value if value > 0.0 else None


def _unit(page: Page, unit: Unit, facing: Facing, units: Sequence[Unit]) -> None:
    page.blank()
    page.say(f"---- the unit '{plain(unit.name)}'")
    for why in unit.why:
        page.say(f"found: {why}.")
    if unit.why:
        page.say(
            "If they are separate boxes: give each its own [[units]] table, with its own position."
        )
    elif len(units) > 1:
        page.say(
            "Taken for a box of its own. If it is one with another unit: move its "
            "[[units.accelerometers]] under that one, and delete the rest."
        )
    page.lines.append("[[units]]")
    page.key("name", string(unit.name))
    place = next((p.place for p in unit.accelerometers if p.place), "")
    where = f"found: the record says '{plain(place)}'; " if place else ""
    page.key(
        "position_m",
        array([None, None, None]),
        f"{where}only you know: m forward, right, down from the origin, e.g. [0.62, -0.45, 0.2]",
        what=f"where '{plain(unit.name)}' sits, m forward, right, down",
    )
    page.key("position_sd_m", "0.02", "assumed: measured with a tape, m")
    _angles(page, unit, facing)
    page.key("angles_sd_deg", "1.0", "assumed: bolted along the vehicle's axes, deg")
    _trigger(page, unit)
    if unit.gyro is None and unit.gyro_from:
        page.key(
            "gyro_from",
            string(unit.gyro_from),
            "found: it has no gyro of its own; the rates of a rigid vehicle are the same everywhere",
        )
    for k, part in enumerate(unit.accelerometers):
        words = "" if len(unit.accelerometers) == 1 else ("the finer range", "the wider range")[min(k, 1)]
        _triad(page, unit, part, "[[units.accelerometers]]", k, words)
    if unit.gyro is not None:
        _triad(page, unit, unit.gyro, "[units.gyro]", -1, "")
    _assumed(page, unit)


def _angles(page: Page, unit: Unit, facing: Facing) -> None:
    sitting = unit.impact.sitting
    turns = "roll, pitch, heading that turn the vehicle's axes into the sensor's, deg"
    if sitting is None:
        page.say(turns, facing.why)
        value = [0.0, 0.0, facing.heading_deg] if facing.heading_deg is not None else [None] * 3
        page.key(
            "angles_deg", array(value), what=f"how '{plain(unit.name)}' is turned: {turns}"
        )
        return
    told = (
        f"found: at rest its {sitting.along} points up (it reads {sitting.length:.2f} m/s², "
        f"{sitting.lean_deg:.1f} deg off), which is roll and pitch"
        if sitting.along
        else f"found: roll and pitch by gravity at rest, {sitting.length:.2f} m/s² along no axis"
    )
    page.say(turns, told, facing.why)
    page.key(
        "angles_deg",
        array([sitting.roll_deg, sitting.pitch_deg, facing.heading_deg]),
        what=f"heading of '{plain(unit.name)}', deg: {facing.why.partition(': ')[2]}",
    )


def _trigger(page: Page, unit: Unit) -> None:
    impact = unit.impact
    if not impact.found:
        page.say(
            "No crash was found: the largest change of the horizontal velocity within 150 ms is "
            f"{impact.largest * KMH:.2g} km/h, and 49 CFR 563 asks for 8. The largest "
            f"acceleration, {in_words(impact.peak, 'acceleration')}, is at {impact.trigger:.6g} s."
        )
        page.key(
            "trigger_s",
            ASK,
            f"only you know: the instant on this unit's clock, s, e.g. {impact.trigger:.6g}",
            what=f"instant of the impact on the clock of '{plain(unit.name)}', s",
        )
        page.key("trigger_sd_s", "0.01", "assumed, s")
        return
    if impact.at_zero:
        page.key("trigger_s", "0.0", "found: the record counts from its trigger, s")
    else:
        page.key(
            "trigger_s",
            number(impact.trigger, 7),
            "found: time zero by 49 CFR 563, s on this unit's clock; if it stamped its trigger, "
            "write that instant",
        )
    page.key("trigger_sd_s", number(impact.trigger_sd, 2), "found: how well that is known, s")
    page.say(
        f"found: from there the horizontal velocity changes by {impact.largest * KMH:.3g} km/h, "
        f"with a peak of {in_words(impact.peak, 'acceleration')}"
        + (f"; {impact.more} more events follow" if impact.more else "")
    )
    if impact.rest is None:
        page.say(
            "found: no rest before the impact, so that it does not tell roll and pitch of the "
            "vehicle there, deg"
        )
        page.key("levelling_deg", "[0.0, 0.0]", "assumed: a level road")
        page.key("levelling_sd_deg", "2.0", "assumed, deg")
    else:
        kind = {"still": "at rest", "steady": "steady, though perhaps moving"}[impact.grade]
        length = impact.rest[1] - impact.rest[0]
        page.say(
            f"found: it was {kind} from {impact.rest[0]:.6g} to {impact.rest[1]:.6g} s, "
            f"{length:.3g} s; to name another stretch, counted from the trigger: rest_s = [from, to]"
        )


def _triad(page: Page, unit: Unit, part: Part, header: str, k: int, words: str) -> None:
    ends = unit.ends[k]
    page.table(header)
    if words:
        page.say(f"{words}")
    page.key("path", string(part.path))
    page.key("channels", inline(part.channels), f"found: {part.why.split('; ')[0]}")
    missing = [a for a in "xyz" if a not in part.channels]
    if missing:
        page.say(f"found: nothing of {', '.join(missing)} in the record")
    if part.clock.column:
        page.key("time", string(part.clock.column), f"found: {part.clock.why}")
        if part.clock.unit:
            page.key("time_unit", string(part.clock.unit), f"found: {part.clock.rate:.5g} samples a second")
        else:
            page.key(
                "time_unit",
                ASK,
                f"only you know: {part.clock.candidates}",
                what=f"unit of the time of {plain(part.path)}",
            )
    elif not part.clock.unit:
        page.key(
            "rate_hz",
            ASK,
            "only you know: samples a second; the record has no time column",
            what=f"samples a second of {plain(part.path)}",
        )
    how = "; ".join(part.why.split("; ")[1:])
    if part.unit:
        page.key("unit", string(part.unit), f"found: {how}" if how else "found")
    else:
        page.key(
            "unit",
            ASK,
            f"only you know: {part.candidates}",
            what=f"unit of {plain(', '.join(part.channels.values()))} in {plain(part.path)}",
        )
    if part.sampling:
        page.key("sampling", string(part.sampling), "found: stated by the record")
    for note in part.notes:
        page.say(f"found: {note}")
    peaks = [in_words(p, part.kind) for p in ends.peak if p == p]
    page.say(f"found: largest {', '.join(peaks)} along its axes")
    if ends.saturated:
        stood = [
            f"{axis} at {in_words(e, part.kind)}"
            for axis, e in zip("xyz", ends.ends, strict=True)
            if e is not None
        ]
        page.say(f"found: it stood at the end of its range in {ends.samples} samples: {', '.join(stood)}")
    _sensor(page, part, ends, unit)


def _sensor(page: Page, part: Part, ends: RangeEnds, unit: Unit) -> None:
    """What is not known of the part: of the catalogue where its range tells it, else assumed."""
    if ends.saturated and len(ends.sensors) == 1 and not part.uncertainty:
        page.key(
            "sensor",
            string(ends.sensors[0]),
            "assumed: of the catalogue it alone ends there; look at `strapdown modules`",
        )
        return
    numbers, why = (part.uncertainty, part.basis)
    if not numbers:
        numbers, why = stated_of(part, ends, unit.impact, unit.accelerometers[0])
    page.say(f"assumed: {why}")
    page.key(
        "uncertainty",
        "{ " + ", ".join(f"{k} = {number(v, 4)}" for k, v in numbers.items()) + " }",
    )
    if not part.uncertainty:
        shown = ", ".join(ends.sensors[:SHOWN_SENSORS])
        more = " and more" if len(ends.sensors) > SHOWN_SENSORS else ""
        page.say(
            "If you know the part, write instead of that line: sensor = and its name in quotation "
            f"marks. Of the catalogue these reach so far: {shown or 'none'}{more}; a file of your "
            "own in its form will do, too"
        )


def _assumed(page: Page, unit: Unit) -> None:
    axes = {a for p in unit.accelerometers for a in p.channels}
    lacks_gyro = unit.gyro is None and not unit.gyro_from
    if not lacks_gyro and axes == set("xyz"):
        return
    page.table(
        "[units.assumed]",
        "What is not measured has to be bounded by you; it enters the bounds of the answers.",
    )
    if lacks_gyro:
        page.key(
            "turn_sd_deg",
            ASK,
            "only you know: no gyro: by how much the vehicle turned in the crash, standard "
            "deviation, deg, e.g. 2.0 for a centric frontal impact, 15.0 for an offset one",
            what=f"'{plain(unit.name)}' has no gyro: how much it may have turned, deg",
        )
    missing = [a for a in "xyz" if a not in axes]
    if missing:
        page.key(
            "delta_v_sd_m_per_s",
            ASK,
            f"only you know: no {', '.join(missing)}: how much the velocity may have changed along "
            "it, standard deviation, m/s, e.g. 1.0",
            what=f"'{plain(unit.name)}' lacks {', '.join(missing)}: change of velocity there, m/s",
        )
    page.key(
        "because",
        ASK,
        'only you know: why, e.g. "centric impact, no turn in the film"',
        what="why these may be assumed",
    )


def _left_out(page: Page, skipped: Sequence[Skipped]) -> None:
    if not skipped:
        return
    page.blank()
    page.say("---- left out")
    for one in skipped:
        page.say(f"{plain(one.path)}, {plain(one.what)}: {one.why}")


def _options(page: Page, units: Sequence[Unit]) -> None:
    page.table("[options]")
    several = len(units) > 1
    if several:
        own = all(u.impact.at_zero for u in units)
        page.key(
            "clock",
            '"trigger"' if own else '"correlation"',
            "found: all records count from one trigger"
            if own
            else "assumed: the clocks are laid over each other by what the units felt",
        )
    page.key("monte_carlo_runs", "2000")
    page.say(
        "window_s = [-0.1, 0.75]   of the path, from the trigger; severity, references (another "
        "measurement to hold the answers against) and more: docs/case.md"
    )


def _found(units: Sequence[Unit]) -> list[str]:
    told = []
    for unit in units:
        impact = unit.impact
        parts = [
            f"{'low' if k == 0 and len(unit.accelerometers) > 1 else 'high' if k else 'one'} range"
            for k in range(len(unit.accelerometers))
        ]
        with_ = " and ".join(parts) + (", gyro" if unit.gyro else "")
        if impact.found:
            what = (
                f"struck at {impact.trigger:.6g} s of its clock, {impact.largest * KMH:.3g} km/h, "
                f"peak {impact.peak / STANDARD_GRAVITY:.3g} g"
            )
        else:
            what = (
                f"no crash found: {impact.largest * KMH:.2g} km/h within 150 ms at most, of the 8 "
                "that 49 CFR 563 asks for"
            )
        told.append(f"{plain(unit.name)}: {with_}; {what}")
    return told

"""What a case says of each unit: where it sits, when it was struck, its triads."""

from __future__ import annotations

import re
from collections.abc import Sequence

from strapdown.config.toml_text import (
    ASK,
    Page,
    array,
    inline,
    instant,
    number,
    plain,
    string,
)
from strapdown.crash.event_rule import KMH
from strapdown.formats.crash_units import FACTORS
from strapdown.systems.crash_draft.group_units import Unit
from strapdown.systems.crash_draft.heading_of_unit import Facing, direction, side_of
from strapdown.systems.crash_draft.parts import Part
from strapdown.systems.crash_draft.range_ends import RangeEnds, in_words
from strapdown.systems.crash_draft.stated_errors import stated_of
from strapdown.systems.crash_draft.turn_after import LEAST_TURN, in_turn_words, turn_after

__all__ = ["unit_tables"]

SHOWN_SENSORS = 8
# Of a zeroed record: what is taken for the rest before the blow, s.
LEAST_REST, LONGEST_REST, BEFORE_BLOW = 0.02, 1.0, 0.005
ONLY = "only you know which way it faces: "


def unit_tables(page: Page, unit: Unit, facing: Facing, units: Sequence[Unit]) -> None:
    """One unit: its mounting, trigger and triads.

    Parameters
    ----------
    page : Page
        To which it is added.
    unit : Unit
    facing : Facing
        Of this unit.
    units : sequence of Unit
        All of the case.
    """
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
    page.key(
        "position_sd_m", "0.02", "assumed: measured with a tape, m; by eye or from photographs 0.2"
    )
    _angles(page, unit, facing)
    page.key(
        "angles_sd_deg",
        "1.0",
        "assumed: bolted along the vehicle's axes, deg; set down by eye 3 to 5",
    )
    _trigger(page, unit)
    if unit.gyro is None and unit.gyro_from:
        page.key(
            "gyro_from",
            string(unit.gyro_from),
            "found: it has no gyro of its own; a rigid vehicle turns alike everywhere",
        )
    for k, part in enumerate(unit.accelerometers):
        words = ""
        _triad(page, unit, part, "[[units.accelerometers]]", k, words)
    if unit.gyro is not None:
        _triad(page, unit, unit.gyro, "[units.gyro]", -1, "")
    _assumed(page, unit)


def _angles(page: Page, unit: Unit, facing: Facing) -> None:
    sitting = unit.impact.sitting
    turns = "roll, pitch, heading that turn the vehicle's axes into the sensor's, deg"
    why = facing.why if facing.heading_deg is not None else f"{ONLY}{facing.why}"
    if sitting is None:
        page.say(turns, why)
        value = [0.0, 0.0, facing.heading_deg] if facing.heading_deg is not None else [None] * 3
        page.key("angles_deg", array(value), what=f"how '{plain(unit.name)}' is turned: {turns}")
        return
    told = (
        f"found: at rest its {sitting.along} points up (it reads {sitting.length:.2f} m/s², "
        f"{sitting.lean_deg:.1f} deg off), which is roll and pitch"
        if sitting.along
        else f"found: roll and pitch by gravity at rest, {sitting.length:.2f} m/s² along no axis"
    )
    page.say(turns, told, why)
    came = None if facing.heading_deg is None else direction(unit, facing.heading_deg)
    if facing.heading_deg is None:
        page.say(
            "If in the vehicle no side of the housing points so, an axis of the record is reversed "
            "or exchanged: correct `channels` below, where a minus before a name turns it round."
        )
    page.key(
        "angles_deg",
        array([sitting.roll_deg, sitting.pitch_deg, facing.heading_deg]),
        what=f"heading of '{plain(unit.name)}', deg: {facing.why}",
        check=""
        if came is None
        else f"'{plain(unit.name)}' faces so that the blow came from {side_of(came)}",
    )


def _trigger(page: Page, unit: Unit) -> None:
    impact = unit.impact
    clock = unit.accelerometers[-1].clock
    if not clock.unit:
        at = impact.trigger * clock.rate
        page.key(
            "trigger_s",
            ASK,
            f"only you know: its largest blow begins at sample {at:.0f}, counted from zero; in s "
            "on its clock, e.g. that number divided by the samples a second",
            what=f"instant of the impact on the clock of '{plain(unit.name)}', s",
        )
        page.key("trigger_sd_s", "0.005", "assumed, s")
        return
    cut = unit.ends[len(unit.accelerometers) - 1]
    if not impact.found and cut.saturated:
        page.say(
            f"found: it was struck so hard that it stood at the end of its range, in {cut.samples} "
            f"samples; what it shows of the change of velocity, {impact.largest / KMH:.2g} km/h "
            "within 150 ms, is therefore too little"
        )
        page.key("trigger_s", instant(impact.trigger), "assumed: where its largest pulse begins, s")
        page.key("trigger_sd_s", "0.01", "assumed, s")
        return
    if not impact.found:
        page.say(
            "No crash was found: the largest change of the horizontal velocity within 150 ms is "
            f"{impact.largest / KMH:.2g} km/h, and 49 CFR 563 asks for 8. The largest "
            f"acceleration, {in_words(impact.peak, 'acceleration')}, is at "
            f"{instant(impact.trigger)} s."
        )
        page.key(
            "trigger_s",
            ASK,
            f"only you know: the instant on this unit's clock, s, e.g. {instant(impact.trigger)}",
            what=f"instant of the impact on the clock of '{plain(unit.name)}', s",
        )
        page.key("trigger_sd_s", "0.01", "assumed, s")
        return
    if impact.at_zero:
        page.key("trigger_s", "0.0", "found: the record counts from its trigger, s")
    else:
        page.key(
            "trigger_s",
            instant(impact.trigger),
            "found: time zero by 49 CFR 563, s on this unit's clock; if it stamped its trigger, "
            "write that instant",
        )
    page.key("trigger_sd_s", number(impact.trigger_sd, 2), "found: how well that is known, s")
    page.say(
        f"found: from there the horizontal velocity changes by {impact.largest / KMH:.3g} km/h, "
        f"with a peak of {in_words(impact.peak, 'acceleration')}"
        + (f"; {impact.more} more events follow" if impact.more else "")
    )
    if impact.rest is None:
        page.say("found: nothing in it tells roll and pitch of the vehicle before the impact, deg")
        page.key("levelling_deg", "[0.0, 0.0]", "assumed: a level road")
        page.key("levelling_sd_deg", "1.0", "assumed, deg")
        _zeroed_rest(page, unit)
    else:
        kind = {"still": "at rest", "steady": "steady, though perhaps moving"}[impact.grade]
        length = impact.rest[1] - impact.rest[0]
        page.say(
            f"found: it was {kind} from {instant(impact.rest[0])} to {instant(impact.rest[1])} s, "
            f"{length:.3g} s; to name another, counted from the trigger: rest_s = [from, to]"
        )


def _zeroed_rest(page: Page, unit: Unit) -> None:
    """Where gravity was taken off, the rest is bias: it is named, as none would be found."""
    part, impact = unit.accelerometers[0], unit.impact
    before = float(part.time[0]) - impact.trigger
    if not part.zeroed or part.unit in FACTORS["velocity"] or before > -LEAST_REST:
        return
    page.key(
        "rest_s",
        f"[{number(max(before, -LONGEST_REST), 4)}, {number(-BEFORE_BLOW)}]",
        "found: s from the trigger; there it was zeroed, gravity and all: that is its bias",
    )


def _triad(page: Page, unit: Unit, part: Part, header: str, k: int, words: str) -> None:
    ends = unit.ends[k]
    page.table(header)
    if words:
        page.say(f"{words}")
    if part.remarks and part is _first_of_its_file(part, unit):
        page.say(
            "The record says above its table; see whether it says axes, range or rate:",
            *(f"   {plain(r)}" for r in part.remarks),
        )
    page.key("path", string(part.path))
    _channels(page, unit, part)
    missing = [a for a in "xyz" if a not in part.channels]
    if missing:
        page.say(f"found: nothing of {', '.join(missing)} in the record")
    if part.clock.column:
        page.key("time", string(part.clock.column), f"found: {part.clock.why}")
        if part.clock.unit:
            page.key(
                "time_unit",
                string(part.clock.unit),
                f"found: {part.clock.rate:.5g} samples a second",
            )
            if part.clock.stated:
                why = part.clock.rate_why or part.clock.why
                page.key("rate_hz", number(part.clock.rate, 9), f"found: {why}")
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
            f"only you know: samples a second; the record has no time column; {part.clock.rate:g} "
            "would make it a crash of a usual length",
            what=f"samples a second of {plain(part.path)}",
        )
    elif part.clock.stated:
        page.key("rate_hz", number(part.clock.rate), f"found: {plain(part.clock.why)}")
    how = "; ".join(part.unit_why)
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
        page.say(
            f"found: it stood at the end of its range in {ends.samples} samples: {', '.join(stood)}"
        )
    _sensor(page, part, ends, unit)


def _channels(page: Page, unit: Unit, part: Part) -> None:
    why = f"found: {part.why}"
    turn = turn_after(unit) if part is unit.gyro else None
    if turn is None or abs(turn) < LEAST_TURN:
        page.key("channels", inline(part.channels), why)
        return
    so, other = in_turn_words(turn), in_turn_words(-turn)
    sitting = unit.impact.sitting
    axis = sitting.along.lstrip("-") if sitting else ""
    vertical = part.channels.get(axis, "")
    # Of yaw, pitch and roll some count to the left and some to the right.
    if vertical and re.search(r"yaw|gier|pitch|nick", " ".join(part.channels.values()).lower()):
        page.say(
            why,
            f'only you know: write "{vertical}", and in the half second after the blow the vehicle '
            f'turned {so}, seen from above; write "{_turned(vertical)}", and it turned {other}. '
            "Makers count yaw and pitch either way: with a minus here put one before the pitch "
            "rate, too.",
        )
        asked = {**part.channels, axis: "?"}
        page.key(
            "channels",
            inline(asked),
            what=f'{axis}: "{plain(vertical)}" if after the blow the vehicle turned to the '
            f'{so.split()[-1]} ({so}), "-" before it if to the {other.split()[-1]}',
        )
        return
    page.key(
        "channels",
        inline(part.channels),
        why,
        check=f"in the half second after the blow '{plain(unit.name)}' turned {so}, seen from "
        "above",
    )


def _turned(name: str) -> str:
    return name[1:] if name.startswith("-") else f"-{name}"


def _first_of_its_file(part: Part, unit: Unit) -> Part:
    parts = [*unit.accelerometers, *((unit.gyro,) if unit.gyro else ())]
    first: Part = next(p for p in parts if p.path == part.path)
    return first


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

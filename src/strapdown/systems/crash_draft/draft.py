"""Write a commented case.toml from records: found values, assumptions and open questions."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from strapdown.config.toml_text import (
    ASK,
    Asked,
    Page,
    array,
    inline,
    instant,
    named_from,
    number,
    plain,
    string,
)
from strapdown.constants import STANDARD_GRAVITY
from strapdown.crash.events import KMH
from strapdown.crash.pdof import pdof
from strapdown.errors import ConfigError, DataError, Finding
from strapdown.formats.crash_record import CrashRecord
from strapdown.formats.crash_records import read_crash_record
from strapdown.formats.crash_units import FACTORS
from strapdown.rotation import within_half_turn
from strapdown.systems.crash_draft.laboratory import (
    KnownPath,
    as_accelerations,
    known_path,
    laboratory_parts,
    reference_tables,
)
from strapdown.systems.crash_draft.parts import Part, Skipped
from strapdown.systems.crash_draft.table_parts import table_parts
from strapdown.systems.crash_draft.units import (
    RangeEnds,
    Unit,
    group_units,
    in_words,
    settle_units,
    stated_of,
)

__all__ = [
    "LEAST_TURN",
    "Draft",
    "Facing",
    "agreement",
    "case_table",
    "direction",
    "draft_case",
    "entry_table",
    "facings",
    "head",
    "in_turn_words",
    "left_out",
    "options_table",
    "read_records",
    "side_of",
    "turn_after",
    "unit_tables",
    "vehicle_table",
    "write_draft",
]


@dataclass(frozen=True)
class Draft:
    """Proposed case file.

    Attributes
    ----------
    text : str
        Text of the file.
    found : tuple of str
        Lines for the user.
    asked : tuple of Asked
        Questions that the user has to answer.
    to_check : tuple of Asked
        Consequences of found or assumed values, for the user to confirm.
    left_out : tuple of Skipped
    findings : tuple of Finding
        Findings about the records.
    """

    text: str
    found: tuple[str, ...]
    asked: tuple[Asked, ...]
    to_check: tuple[Asked, ...] = ()
    left_out: tuple[Skipped, ...] = ()
    findings: tuple[Finding, ...] = ()


def write_draft(
    units: Sequence[Unit],
    skipped: Sequence[Skipped],
    *,
    title: str = "",
    facts: Mapping[str, str] | None = None,
    findings: Sequence[Finding] = (),
    paths: Sequence[KnownPath] = (),
) -> Draft:
    """Write the case file of recording units.

    Parameters
    ----------
    units : sequence of Unit
    skipped : sequence of Skipped
        Parts left out, for a comment.
    title : str
        From the record; empty where not stated.
    facts : mapping, optional
        Facts of the test: the keys of `CrashRecord.facts`.
    findings : sequence of Finding
    paths : sequence of KnownPath
        Other known facts about the crash.
    """
    page = Page()
    facing = facings(units)
    head(page)
    case_table(page, title, facts or {})
    vehicle_table(page, facts or {})
    entry_table(page, facts or {}, units)
    for k, unit in enumerate(units):
        unit_tables(page, unit, facing[k], units)
    agreement(page, units, facing)
    reference_tables(page, list(paths))
    left_out(page, skipped)
    options_table(page, units)
    found = _found(units)
    found += [
        f"{plain(p.name)}: a path from {instant(p.start)} to {instant(p.end)} s, a reference"
        for p in paths
    ]
    return Draft(
        page.text,
        tuple(found),
        tuple(page.asked),
        tuple(page.to_check),
        tuple(skipped),
        tuple(findings),
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
        clock = unit.accelerometers[-1].clock
        if not clock.unit:
            at = impact.trigger * clock.rate
            what = f"its largest blow begins near sample {at:.0f}; it has no clock"
        elif impact.found:
            what = (
                f"struck at {instant(impact.trigger)} s of its clock, "
                f"{impact.largest / KMH:.3g} km/h, peak {impact.peak / STANDARD_GRAVITY:.3g} g"
            )
        elif unit.ends[len(unit.accelerometers) - 1].saturated:
            what = (
                f"struck at {instant(impact.trigger)} s of its clock, beyond the end of its range"
            )
        else:
            what = (
                f"no crash found: {impact.largest / KMH:.2g} km/h within 150 ms at most, of the 8 "
                "that 49 CFR 563 asks for"
            )
        told.append(f"{plain(unit.name)}: {with_}; {what}")
    return told


# From the files that a user names to the text of a case.


def read_records(paths: Sequence[str | Path]) -> list[CrashRecord]:
    """Read the records for a proposed case.

    Parameters
    ----------
    paths : sequence of str or Path

    Returns
    -------
    list of CrashRecord

    Raises
    ------
    ConfigError
        A file does not exist, or is named twice.
    DataError
        A file cannot be read.
    """
    seen: dict[Path, str] = {}
    records = []
    for given in paths:
        record = read_crash_record(given)
        for file in record.files or (Path(given),):
            real = file.resolve()
            if real in seen:
                raise ConfigError(
                    "crash.record-named-twice-differently"
                    if seen[real] != str(given)
                    else "crash.record-named-twice",
                    file=file.name,
                    quantity="RECORD",
                    seen=seen[real],
                    given=given,
                )
        seen |= {file.resolve(): str(given) for file in record.files or (Path(given),)}
        records.append(record)
    return records


def draft_case(records: Sequence[CrashRecord], *, folder: str | Path = ".") -> Draft:
    """Write a proposed case from records.

    Parameters
    ----------
    records : sequence of CrashRecord
    folder : str or Path
        Folder of the case file; record paths are relative to it.

    Returns
    -------
    Draft
        `CaseSpec.read` accepts its TOML text when every ``"?"`` is answered.

    Raises
    ------
    DataError
        No record, or none with an accelerometer; the message lists the findings.
    """
    parts: list[Part] = []
    skipped: list[Skipped] = []
    settled: list[Part] = []
    findings: list[Finding] = []
    paths: list[KnownPath] = []
    for record in records:
        path = named_from(record.path, Path(folder))
        # The case states the reader's finding about the clock.
        findings += [f for f in record.findings if f.quantity != "time"]
        known = known_path(path, record)
        if known is not None:
            paths.append(known)
            continue
        tabular = all(c.samples is not None for c in record.channels)
        found, left = (table_parts if tabular else laboratory_parts)(path, record)
        skipped += left
        (parts if tabular else settled).extend(found)
    for part in settle_units(parts):
        settled.append(as_accelerations(part) if part.kind == "velocity" else part)
    units, more = group_units(settled)
    skipped += more
    if not units:
        raise _nothing(records, settled, skipped)
    facts = next((r.facts for r in records if r.facts), {})
    title = next((r.title for r in records if r.facts and r.title), "")
    return write_draft(units, skipped, title=title, facts=facts, findings=findings, paths=paths)


def _nothing(
    records: Sequence[CrashRecord], parts: Sequence[Part], skipped: Sequence[Skipped]
) -> DataError:
    told = [f"{', '.join(p.channels.values())}: {p.kind}" for p in parts]
    told += [f"{s.what}: {s.why}" for s in skipped]
    return DataError(
        "crash.no-accelerometer-found" if told else "crash.nothing-in-record",
        file=", ".join(r.path.name for r in records[:3]),
        parts=told[:8] + ["…"] * (len(told) > 8),
    )


# The tables that occur once in a case: title, vehicle, entry, options.


# Laboratories sample fast enough to record ringing.
FAST = 5000.0  # Hz
# A larger difference between two units of a vehicle is not explained by their positions.
FAR_APART = 1.5


def head(page: Page) -> None:
    """Explain the file and how to complete it."""
    page.say(
        "A crash case for strapdown. It was written from the records; the answers are yours.",
        "",
        'Wherever it says "?", only you know the answer: write it there. Texts keep their '
        "quotation marks, numbers have none. Where it says 'found', the records told it; where it "
        "says 'assumed', nothing did: look at it. Then run: strapdown crash, with this file.",
        "",
        "Axes of the vehicle: forward, right, down. All positions are from one origin of your "
        "choice, such as the centre of mass, in m; keys may end in _mm or _cm instead of _m, "
        "speeds in _m_per_s instead of _km_per_h.",
    )


def case_table(page: Page, title: str, facts: Mapping[str, str]) -> None:
    """Title and number: from the test's record, or a question."""
    page.blank()
    if title:
        page.key("title", string(title), "found: in the record")
    else:
        page.key(
            "title",
            ASK,
            'only you know: e.g. "Car against pole, 12 March"',
            what="what it is about",
        )
    number_of = facts.get("test", "")
    page.key("number", string(number_of), "of your file, as you like" if not number_of else "found")
    page.key("author", '""', "who stands for it, as you like")
    page.key("description", '""', "a few sentences for the first page, as you like")


def vehicle_table(page: Page, facts: Mapping[str, str]) -> None:
    """Vehicle and reference point."""
    page.table("[vehicle]")
    page.key("name", string(facts.get("vehicle", "")), "for the report, as you like")
    mass = _fact(facts, "mass_kg")
    if mass is None:
        page.key(
            "mass_kg",
            ASK,
            "only you know: as it was driven, in kg, e.g. 1450; no answer depends on it: delete "
            "the line if it is not known",
            what="mass, kg; delete the line if it is not known",
        )
    else:
        page.key("mass_kg", number(mass), "found: in the record, as tested, kg")
    for name, usual in (("length_m", 4.5), ("width_m", 1.8)):
        value = _fact(facts, name)
        how = "assumed: of a car, m; it is drawn so" if value is None else "found: in the record, m"
        page.key(name, number(usual if value is None else value), how)
    page.table("[point]", "The point whose motion and change of velocity are told.")
    page.key("name", '"centre of mass"')
    page.key("position_m", array([0.0, 0.0, 0.0]), "assumed: it is the origin of all positions, m")


def entry_table(page: Page, facts: Mapping[str, str], units: Sequence[Unit]) -> None:
    """Speed at the impact: from the test's record, or a question."""
    page.table(
        "[entry]",
        "How fast the vehicle was at the impact, and how that is known. If it stood still before "
        'the blow: kind = "standstill", and delete the speed and its sd.',
    )
    page.key("kind", '"speed"')
    late = max(float(u.accelerometers[0].time[0]) - u.impact.trigger for u in units)
    timed = all(u.impact.found and u.accelerometers[0].clock.unit for u in units)
    if timed and late > 0.0:
        page.key(
            "time_s",
            number(late),
            "found: from the trigger, s: the first sample of the record is there; the speed then",
        )
    speed = _fact(facts, "speed_m_per_s")
    if not (timed and late > 0.0):
        page.key(
            "time_s",
            "0.0",
            "found: from the trigger, s: a test states the speed at its time zero, the first touch"
            if speed is not None
            else "assumed: from the trigger, s: the speed as the blow begins; of another instant, "
            "write it, e.g. -1.0 where the car's own data end",
        )
    if speed is None:
        page.key(
            "speed_km_per_h",
            ASK,
            "only you know: of the vehicle that the records are of, forward, km/h, e.g. 25.6",
            what="entry speed, km/h",
        )
        page.key(
            "speed_sd_km_per_h",
            ASK,
            "only you know: how far off it may be, as a standard deviation, km/h: the truth is "
            "within it in two of three cases, within twice it in nineteen of twenty; e.g. 0.5 for "
            "a light gate, 1 for a tachograph or the car's own data, 3 from a video, 5 from skid "
            "marks",
            what="how far off it may be (its standard deviation), km/h: e.g. 0.5 light gate, 3 "
            "video, 5 skid marks",
        )
        page.key(
            "source",
            ASK,
            'only you know: how it was measured, e.g. "light barrier 2 m before the pole"',
            what="how the speed is known",
        )
        return
    page.key("speed_km_per_h", number(speed / KMH), "found: in the record, km/h")
    page.key("speed_sd_km_per_h", "0.1", "assumed: of a speed trap of a laboratory, km/h")
    page.key("source", string("stated by the record"), "found")


def _fact(facts: Mapping[str, str], key: str) -> float | None:
    try:
        value = float(facts.get(key, ""))
    except ValueError:
        return None
    return value if value > 0.0 else None


def agreement(page: Page, units: Sequence[Unit], facing: Sequence[Facing]) -> None:
    """State how far the units agree, as comments."""
    told, sizes = [], []
    for unit, faces in zip(units, facing, strict=True):
        if not unit.impact.found or not unit.accelerometers[-1].clock.unit:
            continue
        came = None if faces.heading_deg is None else direction(unit, faces.heading_deg)
        where = "" if came is None else f" from {came:.0f} deg"
        told.append(f"'{plain(unit.name)}' {unit.impact.largest / KMH:.3g} km/h{where}")
        sizes.append(unit.impact.largest)
    if len(told) < 2:
        return
    page.blank()
    page.say(
        "---- the units beside each other",
        f"found: horizontal change of velocity, each at its own place: {', '.join(told)} (0 is the "
        "front, 90 the right). Places of a vehicle that turns do not gain the same.",
    )
    if max(sizes) > FAR_APART * min(sizes):
        page.say(
            "They are far apart: look at the unit, the range and the place of each, and whether "
            "all are of one crash."
        )


def left_out(page: Page, skipped: Sequence[Skipped]) -> None:
    """List the unused parts of the records with reasons, as comments."""
    if not skipped:
        return
    page.blank()
    page.say("---- left out")
    for one in skipped:
        page.say(f"{plain(one.path)}, {plain(one.what)}: {one.why}")


def options_table(page: Page, units: Sequence[Unit]) -> None:
    """Clock synchronization and the other options."""
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
    rate = min(u.accelerometers[-1].clock.rate for u in units)
    mean = all(p.unit in FACTORS["velocity"] for u in units for p in u.accelerometers)
    if mean:
        page.key("rate_hz", number(rate), "found: steps of the table, as samples a second")
        page.key("sampling", '"mean"', "found: changes over a step are means")
    elif rate >= FAST and all(u.gyro is None for u in units):
        page.key("rate_hz", "1000.0", "assumed: common samples a second, for a floor that rings")
        page.key("sampling", '"mean"', "assumed: means over a step lose nothing of what is faster")
    page.key("monte_carlo_runs", "2000")
    page.say(
        "window_s = [-0.1, 0.75]   of the path, from the trigger; severity, references (another "
        "measurement to hold the answers against) and more: docs/case.md"
    )


# The tables of each unit: mounting, trigger, triads.


SHOWN_SENSORS = 8
# Zeroed records: length of the rest before the impact, s.
LEAST_REST, LONGEST_REST, BEFORE_BLOW = 0.02, 1.0, 0.005
ONLY = "only you know which way it faces: "


def unit_tables(page: Page, unit: Unit, facing: Facing, units: Sequence[Unit]) -> None:
    """Write the tables of a unit: mounting, trigger and triads.

    Parameters
    ----------
    page : Page
        The tables are added to it.
    unit : Unit
    facing : Facing
        Heading of this unit.
    units : sequence of Unit
        All units of the case.
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
    """State the rest bias of a zeroed record: with gravity removed, the solution finds none."""
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
    # Yaw, pitch and roll channels may be positive to the left or to the right.
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
    """Unknown data of a part: from the catalogue where its range identifies it, else assumed."""
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


# Turn of the vehicle after the impact by its gyro, for a person to confirm.


# Span after the impact, and rest of the gyro before it, s.
AFTER, BEFORE, GAP = 0.5, 1.0, 0.05
#: An eyewitness cannot give the direction of a smaller turn, deg.
LEAST_TURN = 3.0


def turn_after(unit: Unit) -> float | None:
    """Turn about the vertical in the half second after the impact.

    Parameters
    ----------
    unit : Unit

    Returns
    -------
    float or None, deg
        Positive to the right; None without a gyro or a rest. Independent of the heading of the
        mounting.
    """
    gyro, sitting = unit.gyro, unit.impact.sitting
    if gyro is None or sitting is None or len(gyro.axes) < 3 or not unit.impact.found:
        return None
    zero = unit.impact.trigger
    before = (gyro.time > zero - BEFORE) & (gyro.time < zero - GAP)
    after = (gyro.time >= zero) & (gyro.time <= zero + AFTER)
    if not before.any() or after.sum() < 2:
        return None
    rate = sitting.into_vehicle(gyro.values - np.median(gyro.values[before], axis=0))[:, 2]
    return float(np.degrees(np.trapezoid(rate[after], gyro.time[after])))


def in_turn_words(turn: float) -> str:
    """Describe a turn as an eyewitness above would."""
    return f"{abs(turn):.0f} deg to the {'right' if turn > 0.0 else 'left'}"


# Heading of a unit by its column headings, the impact and the other units.


TURNS = (0.0, 90.0, 180.0, -90.0)
# A frontal impact, the most common one, is within this of the front.
FRONTAL = 45.0  # deg
# Two units of a vehicle measure one direction; the next right angle differs by more than this.
SAME_DIRECTION = 30.0  # deg
POINTS = {0.0: "forward", 90.0: "to the right", 180.0: "rearward", -90.0: "to the left"}
SIDES = {0: "the front", 1: "the right", 2: "the rear", 3: "the left"}


@dataclass(frozen=True)
class Facing:
    """Heading of a mounting.

    Attributes
    ----------
    heading_deg : float or None
        None where the user has to answer.
    why : str
        Reason for the heading, or the meaning of each of the four.
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
        Assumed zero where the columns are named x, y, z, the vertical is along z, and the impact
        then is frontal; the others agree with the first known heading.
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
    """Direction of the force, deg, at this heading of the unit; None without acceleration."""
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
    """Direction of the x axis of a turned housing; empty where it is vertical."""
    sitting = unit.impact.sitting
    if sitting is None or abs(sitting.pitch_deg) > FRONTAL:
        return ""
    return f" (its x points {POINTS[turn]})"


def side_of(came: float) -> str:
    """Name the side that the force came from, by its direction in deg."""
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

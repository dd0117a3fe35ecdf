"""What a case says once: what it is about, the vehicle, its entry, options."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from strapdown.config.toml_text import ASK, Page, array, number, plain, string
from strapdown.crash.event_rule import KMH
from strapdown.formats.crash_units import FACTORS
from strapdown.systems.crash_draft.group_units import Unit
from strapdown.systems.crash_draft.heading_of_unit import Facing, direction
from strapdown.systems.crash_draft.parts import Skipped

__all__ = [
    "agreement",
    "case_table",
    "entry_table",
    "head",
    "left_out",
    "options_table",
    "vehicle_table",
]

# Laboratories sample so fast that ringing is in their records.
FAST = 5000.0  # Hz
# Two units of one vehicle that differ by more are not explained by their places.
FAR_APART = 1.5


def head(page: Page) -> None:
    """What the file is and how it is filled in."""
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
    """Title and number: found in a test's record, else asked."""
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
    """Speed at the impact: found in a test's record, else asked."""
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
    """How far the units tell the same, as comments."""
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
    """What of the records is not used, and why, as comments."""
    if not skipped:
        return
    page.blank()
    page.say("---- left out")
    for one in skipped:
        page.say(f"{plain(one.path)}, {plain(one.what)}: {one.why}")


def options_table(page: Page, units: Sequence[Unit]) -> None:
    """How the clocks are tied, and what else may be chosen."""
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

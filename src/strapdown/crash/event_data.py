"""Event data recorders (49 CFR Part 563) of a case: triads of an event, and the speed before it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from strapdown.constants import STANDARD_GRAVITY
from strapdown.crash.record_parts import (
    Clock,
    Heading,
    Part,
    Skipped,
    find_clock,
)
from strapdown.errors import DataError, Finding, add_note, add_warning
from strapdown.formats.crash_edr import KMH, element_of, rounding
from strapdown.formats.crash_record import CrashChannel, CrashRecord
from strapdown.tables.checks import Array
from strapdown.units import FACTORS, SPEEDS, TIME_UNITS


class Recorder(NamedTuple):
    """Recorder of one file: triads of its severest event, unused channels, entry speed."""

    parts: list[Part]
    skipped: list[Skipped]
    findings: list[Finding]
    entry: IndicatedEntry | None


def recorder_parts(path: str, record: CrashRecord) -> Recorder:
    """Find the triads of the severest event of a recorder: values as recorded.

    Delta-V is used where the event has it; accelerations of the same sensor then are not, as they
    are not independent. `DataError`: two columns of one axis disagree, or axes of different units.
    """
    skipped: list[Skipped] = []
    findings: list[Finding] = []
    events: dict[int, list[Part]] = {}
    for number in sorted({c.event for c in record.channels}):
        own = [c for c in record.channels if c.event == number and c.quantity != "time"]
        triads = {
            kind: [c for c in own if c.quantity == kind and c.axis]
            for kind in ("velocity", "acceleration", "rate")
        }
        if not triads["velocity"] and not triads["acceleration"]:
            continue
        used = ["velocity"] if triads["velocity"] else ["acceleration"]
        # Pre-crash rates at 2 Hz do not serve as the gyro of the crash.
        clocks = {c.clock for kind in used for c in triads[kind]}
        triads["rate"] = [c for c in triads["rate"] if c.clock in clocks]
        used += ["rate"] if triads["rate"] else []
        events[number] = [_part(path, record, kind, triads[kind]) for kind in used]
        if "acceleration" not in used and triads["acceleration"]:
            names = tuple(c.name for c in triads["acceleration"])
            why = "delta-V of the same recorder is used, which the regulation gives an accuracy"
            skipped.append(Skipped(path, f"columns {', '.join(names)}", why, names))
    first, again = _without_copies(events)
    findings += [
        Finding(
            "crash.event-exported-twice",
            severity="note",
            file=record.path.name,
            event=a,
            other=b,
        )
        for a, b in again
    ]
    sizes = {number: _size(parts[0]) for number, parts in first.items()}
    chosen = max(sizes, key=lambda n: sizes[n], default=0)
    others = [n for n in first if n != chosen]
    for number in others:
        names = tuple(n for p in first[number] for n in p.channels.values())
        what = f"event {number} ({_shown(first[number][0], sizes[number])})"
        why = f"event {chosen} is severer; for a case of this one, name its columns: " + ", ".join(
            names
        )
        skipped.append(Skipped(path, what, why, names))
    if others:
        add_warning(
            findings,
            "crash.several-events-of-recorder",
            file=record.path.name,
            event=chosen,
            others=[str(n) for n in others],
        )
    for channel in record.channels:
        if channel.quantity in ("velocity", "acceleration", "rate") and not channel.axis:
            why = "its heading names no axis, or two; name it in the case if you know it"
            skipped.append(Skipped(path, f"column '{channel.name}'", why, (channel.name,)))
    context = [c.name for c in record.channels if _is_context(c)]
    if context:
        why = "context: no sensor of the motion in the crash"
        skipped.append(Skipped(path, f"columns {', '.join(context)}", why, tuple(context)))
    entry = indicated_entry(record, chosen, len(first)) if first or not events else None
    return Recorder(first.get(chosen, []), skipped, findings, entry)


def _is_context(channel: CrashChannel) -> bool:
    return channel.quantity not in ("velocity", "acceleration", "rate", "time")


def _part(path: str, record: CrashRecord, kind: str, channels: Sequence[CrashChannel]) -> Part:
    by_axis: dict[str, CrashChannel] = {}
    for channel in channels:
        axis = channel.axis.lstrip("-")
        if axis in by_axis:
            raise DataError(
                "crash.axis-recorded-twice",
                file=record.path.name,
                quantity="channels",
                axis=axis,
                name=by_axis[axis].name,
                other=channel.name,
            )
        by_axis[axis] = channel
    by_axis = {a: by_axis[a] for a in "xyz" if a in by_axis}
    units = {c.unit for c in by_axis.values()}
    # Axes in tables of their own have the same stamps.
    clocks = {_stamps(record, c).tobytes(): c.clock for c in by_axis.values()}
    if len(units) > 1 or len(clocks) > 1:
        raise DataError(
            "crash.axes-of-different-units" if len(units) > 1 else "crash.axes-in-different-tables",
            file=record.path.name,
            quantity="channels",
            names=[c.name for c in by_axis.values()],
            units=sorted(units),
        )
    unit = units.pop()
    clock, time = _clock(record.channel(next(iter(by_axis.values())).clock))
    factor = FACTORS[kind].get(unit, 1.0)
    values = np.full((time.size, 3), np.nan)
    for axis, channel in by_axis.items():
        sign = -1.0 if channel.axis.startswith("-") else 1.0
        assert channel.samples is not None
        recorded = channel.samples() / factor
        holes = np.flatnonzero(~np.isfinite(recorded))
        if holes.size:
            raise DataError(
                "io.not-finite-number-2",
                file=channel.file,
                row=channel.row(int(holes[0])),
                quantity=channel.name,
                velocity=float(recorded[holes[0]]),
            )
        values[:, "xyz".index(axis)] = sign * recorded
    return Part(
        path,
        kind,
        {a: f"-{c.name}" if c.axis.startswith("-") else c.name for a, c in by_axis.items()},
        clock,
        unit,
        "axes by the headings: forward, right and down positive (49 CFR 563.5)",
        time,
        values,
        label="",
        named=True,
        remarks=record.remarks,
        velocities=tuple(by_axis.values()) if kind == "velocity" else (),
        of_vehicle="an event data recorder has the axes of its vehicle (49 CFR 563.5)",
    )


def _stamps(record: CrashRecord, channel: CrashChannel) -> Array:
    read = record.channel(channel.clock).samples
    assert read is not None
    return np.asarray(read(), dtype=np.float64)


def _clock(channel: CrashChannel) -> tuple[Clock, Array]:
    assert channel.samples is not None
    stamps = channel.samples()
    heading = Heading("time", "", channel.unit, "")
    clock, time = find_clock({channel.name: stamps}, {channel.name: heading})
    if time is None:
        raise DataError(
            "crash.edr-stamps-uneven", file=channel.file, quantity=f"time ({channel.name})"
        )
    return clock, time


def _size(part: Part) -> float:
    return float(np.nanmax(np.abs(part.values))) * FACTORS[part.kind].get(part.unit, 1.0)


def _shown(part: Part, size: float) -> str:
    if part.kind == "velocity":
        return f"{size / KMH:.3g} km/h"
    return f"{size / STANDARD_GRAVITY:.3g} g"


def _changes(part: Part) -> tuple[Array, Array] | None:
    """Stamps, s, and delta-V, (n, 3), m/s, of a part as recorded; None of another quantity."""
    if part.kind != "velocity" or part.unit not in SPEEDS or part.clock.unit not in TIME_UNITS:
        return None
    return part.time, np.nan_to_num(part.values * SPEEDS[part.unit])


def _rounded(part: Part) -> float:
    """Last decimal of the recorded numbers in SI."""
    return rounding(part.values) * FACTORS[part.kind].get(part.unit, 1.0) if part.kind else 0.0


def is_copy(a: Part, b: Part) -> bool:
    """Whether two tables of delta-V have the same numbers, to the rounding of both."""
    one, other = _changes(a), _changes(b)
    if one is None or other is None or a.axes != b.axes or one[0].size != other[0].size:
        return False
    if np.abs(one[0] - other[0]).max() > 1e-6 or not one[1].any():
        return False
    limit = 0.5 * (_rounded(a) + _rounded(b)) * (1.0 + 1e-6) + 1e-9
    return bool(np.abs(one[1] - other[1]).max() <= limit)


def _without_copies(
    events: dict[int, list[Part]],
) -> tuple[dict[int, list[Part]], list[tuple[int, int]]]:
    kept: dict[int, list[Part]] = {}
    again = []
    for number, parts in events.items():
        twin = next((n for n, held in kept.items() if is_copy(held[0], parts[0])), None)
        if twin is None:
            kept[number] = parts
        else:
            again.append((twin, number))
    return kept, again


def drop_copies(parts: Sequence[Part]) -> tuple[list[Part], list[Skipped], list[Finding]]:
    """Remove tables of delta-V that a finer table of another file repeats: one recorder."""
    kept: list[Part] = []
    skipped: list[Skipped] = []
    findings: list[Finding] = []
    for part in sorted(parts, key=_rounded):
        twin = next((q for q in kept if q.path != part.path and is_copy(q, part)), None)
        if twin is None:
            kept.append(part)
            continue
        names = tuple(part.channels.values())
        why = f"the same recorder as {twin.path}: the numbers are the same, to their rounding"
        skipped.append(Skipped(part.path, ", ".join(names), why, names))
        add_note(findings, "crash.recorder-exported-twice", file=part.path, other=twin.path)
    return [p for p in parts if p in kept], skipped, findings


# Entry speed by the indicated speed before the crash.

# 49 CFR 563.8, Table III: the indicated speed to ±1 km/h.
INDICATED = 1.0 * KMH
# Rolling circumference of a tire, by wear, pressure and size, from the nominal one: one deviation.
TIRE = 0.02
# Slip of braked wheels: an ABS regulates about the maximum of friction, at 10 to 30 % of slip
# (Wong, Theory of Ground Vehicles, section 1.3); below it braking is steady. Bounds, of the speed.
SLIP_STEADY, SLIP_REGULATED = 0.1, 0.3
# Deceleration: dry asphalt allows tires of cars 0.9 g; engine, rolling and air make 0.2 g.
# Acceleration: 0.5 g by the engine. Bounds.
BRAKED, COASTING, DRIVEN = (f * STANDARD_GRAVITY for f in (0.9, 0.2, 0.5))


class IndicatedEntry(NamedTuple):
    """Speed at time zero by the last indicated one; SI, with its parts as standard deviations.

    `age`, s: largest time before time zero, the interval of the samples included, as they are not
    taken at time zero; `brake` and `abs`: None where not recorded. `locked`: the indicated speed
    fell faster than friction allows.
    """

    column: str
    speed: float
    sd: float
    stamp: float
    age: float
    brake: bool | None
    abs: bool | None
    locked: bool
    indicated_sd: float
    age_sd: float
    slip_sd: float
    tire_sd: float
    change: float


def indicated_entry(record: CrashRecord, event: int, events: int) -> IndicatedEntry | None:
    """Propose the entry speed from the last valid indicated speed before time zero of an event.

    `event` 0 with one event in all: tables without a label. None without such a speed, or where its
    unit, its clock or its event is not known.
    """
    alone = events <= 1
    held = [c for c in record.channels if c.event == event or (alone and c.event == 0)]
    if not held and alone:
        held = list(record.channels)
    speeds = [c for c in held if element_of(c.name) == "speed" and c.unit in SPEEDS]
    if len(speeds) != 1:
        return None
    channel = speeds[0]
    clock = record.channel(channel.clock)
    if clock.unit not in TIME_UNITS or clock.samples is None or channel.samples is None:
        return None
    time = clock.samples() * TIME_UNITS[clock.unit]
    speed = channel.samples() * SPEEDS[channel.unit]
    there = np.flatnonzero(np.isfinite(speed) & (time <= 1e-9))
    if not there.size or time[there[-1]] < -MOST_AGE or time[0] >= 0.0:
        return None
    last = int(there[-1])
    step = float(np.median(np.diff(time))) if time.size > 1 else 0.0
    state = {name: _state(record, held, name, channel.clock, last) for name in ("brake", "abs")}
    brake, regulated = state["brake"], state["abs"]
    before = there[-2] if there.size > 1 else last
    span = float(time[last] - time[before])
    change = float(speed[last] - speed[before]) / span if span > 0.0 else 0.0
    age = -float(time[last]) + step
    fell = -change if brake is not False else 0.0
    # Rounding of both speeds may make the change larger.
    step_of = rounding(speed / SPEEDS[channel.unit]) * SPEEDS[channel.unit]
    margin = step_of / span if span > 0.0 else 0.0
    locked = fell > BRAKED + margin
    possible = COASTING if brake is False else BRAKED
    largest = max(min(abs(change), BRAKED), possible, DRIVEN if not brake else 0.0)
    slip = SLIP_STEADY if regulated is False else SLIP_REGULATED
    slip = 0.0 if brake is False else slip
    value = float(speed[last])
    slip_bound = slip * value
    if locked:
        slip_bound = max(slip_bound, float(speed[before]) - value)
    parts = (
        math.hypot(INDICATED / math.sqrt(3.0), step_of / math.sqrt(12.0)),
        largest * age / math.sqrt(3.0),
        slip_bound / math.sqrt(3.0),
        TIRE * value,
    )
    return IndicatedEntry(
        channel.name,
        value,
        math.hypot(*parts),
        float(time[last]),
        age,
        brake,
        regulated,
        locked,
        *parts,
        change,
    )


# An older speed than this, s, is none of the impact.
MOST_AGE = 2.0


def _state(
    record: CrashRecord, held: Sequence[CrashChannel], name: str, clock: str, last: int
) -> bool | None:
    """Whether brake or ABS was on at the last sample of speed; None where not recorded."""
    for channel in held:
        if element_of(channel.name) == name and channel.samples is not None:
            if channel.clock != clock:
                continue
            value = channel.samples()[last]
            if math.isfinite(value):
                return bool(value > 0.0)
    return None

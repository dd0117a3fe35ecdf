"""Tables of event data recorders (EDR) by 49 CFR Part 563: before, in and after a crash.

Exports of recorders write several tables one below the other: before the crash (−5 to 0 s: speed,
brake, pedal), in the crash (delta-V each 10 ms from time zero), each for one or more events, with
lines of labels and values between them. Longitudinal is positive forward, lateral from left to
right, normal down (49 CFR 563.5), as our axes. Percent, rpm, on and off, and degrees of the
steering wheel are context, not sensors.
"""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import DataError, Finding, add_note, add_warning
from strapdown.formats.crash_record import LONGEST_NAME, CrashChannel, CrashRecord, clean, unique
from strapdown.formats.crash_samples import Clock, seconds_of
from strapdown.formats.crash_table import MOST_REMARKS, NOTE, ChannelName, channel_name
from strapdown.formats.text_columns import NUMBER, decoded, fields_of, separator_of
from strapdown.units import FACTORS, OF_CRASHES, SPEEDS, TIME_UNITS, find_unit, unit_words

Array = NDArray[np.float64]

KMH = SPEEDS["km/h"]
#: 49 CFR 563.8, Table III: delta-V is recorded from −100 to 100 km/h at least.
DELTA_V_RANGE = 100.0 * KMH
# 49 CFR 563.5: the event ends where the change within 20 ms is 0.8 km/h or less.
END_CHANGE, END_SPAN = 0.8 * KMH, 0.020
# Exports have some hundred rows.
LARGEST = 4_000_000

# Elements that a heading or a label names, in the order of search; None: delta-V or a sensor, by
# `channel_name`. The position of a pedal is not an acceleration, and the engine's speed is not
# the vehicle's.
_ELEMENTS = (
    ("pedal", r"accelerator|pedal|throttle|fahrpedal|gaspedal|drosselklappe"),
    ("rpm", r"\brpm\b|engine speed|motordrehzahl|drehzahl|1/min|motor speed"),
    ("wheel", r"wheel speed|raddrehzahl"),
    ("belt", r"belt|buckle|gurt"),
    ("parking", r"park"),
    ("abs", r"\babs\b|anti.?lock"),
    ("stability", r"stability|\besc\b|\besp\b|\bvsc\b|traction"),
    ("brake", r"brake|bremse"),
    ("steering", r"steer|lenk"),
    ("roll angle", r"roll angle|rollwinkel|wankwinkel"),
    ("event", r"^(multi-?event,? )?(event|ereignis)( record)?( number| no\.?| nr\.?)?$"),
    ("speed", r"\bspeed\b|geschwindigkeit"),
)
_MAXIMUM = re.compile(r"\bmax|\bpeak", re.I)
_ON = ("on", "yes", "true", "engaged", "active", "activated", "applied", "buckled", "ein", "ja")
_OFF = (
    *("off", "no", "false", "disengaged", "inactive", "unbuckled", "released", "aus", "nein"),
    *("not engaged", "non-engaged", "not active", "not applied", "not activated"),
)
_BRACKETS = re.compile(r"[\[(]([^\[\]()]*)[\])]")
# Both units in one cell: 31.1 [50.0].
_BOTH = re.compile(r"\s*(\S+)\s*[\[(]\s*([^\])\s]+)\s*[\])]\s*")
# A label of the event that the following tables are of.
_EVENT = re.compile(
    r"\b(?:event|ereignis)(?:[ _-]*(?:record|no\.?|number|nr\.?|#))?[ _:-]*(\d+)", re.I
)
_RECENT = (("most recent", 1), ("2nd prior", 3), ("second prior", 3), ("prior event", 2))
# Which way an axis is positive, beside its name: "lateral, left positive", "from left to right".
_SIGNS = (
    (re.compile(r"(from )?left[ -]to[ -]right", re.I), " lateral "),
    (re.compile(r"(from )?right[ -]to[ -]left", re.I), " left "),
    (re.compile(r"\blateral\b(?=.*\bleft\b)|\blongitudinal\b(?=.*\b(rear|back)ward\b)", re.I), " "),
    (re.compile(r"\b(vertical|normal)\b(?=.*\bup\b)", re.I), " "),
)
_NAMED = re.compile(r"delta|\bdv|speed|velocity|geschwindigkeit", re.I)
_PRIOR = re.compile(r"\b(before|prior|preceding|vor)\b", re.I)


def element_of(heading: str) -> str:
    """Name the element of Tables I and II of 49 CFR 563.7 that a heading names.

    Returns ``speed``, ``brake``, ``abs``, ``stability``, ``pedal``, ``rpm``, ``steering``, ``roll
    angle``, ``belt``, ``event``, others of a vehicle, or empty: delta-V, a sensor, or unknown.
    """
    text = " ".join(_BRACKETS.sub(" ", heading).lower().replace("_", " ").split()).strip(" ,;:")
    change = channel_name(heading).change
    return next((e for e, words in _ELEMENTS if not change and re.search(words, text)), "")


def rounding(values: Array) -> float:
    """Last decimal of the numbers of a table, in their unit: 1, 0.1, … 1e-9."""
    held = values[np.isfinite(values)]
    steps = (10.0**-k for k in range(9))
    whole = (s for s in steps if np.allclose(held, np.round(held / s) * s, rtol=0.0, atol=1e-4 * s))
    return next(whole, 1e-9)


# Tables in a text.


@dataclass(frozen=True)
class _Column:
    """One column: heading, meaning, numbers, and the unit that the heading has."""

    heading: str
    element: str
    said: ChannelName
    values: Array


@dataclass(frozen=True)
class _Table:
    """Rows below one header, of one event; `event` 0: not stated."""

    columns: tuple[_Column, ...]
    rows: NDArray[np.int64]
    event: int

    @property
    def clock(self) -> _Column:
        return next(c for c in self.columns if c.said.quantity == "time")


class _Text(NamedTuple):
    """`short`: tables of whose header every row has fewer fields: row, its fields, the header's."""

    tables: list[_Table]
    above: list[tuple[str, int]]
    short: list[tuple[int, int, int]]


@dataclass
class _Open:
    """A table whose rows are being read."""

    names: list[str]
    units: list[str]
    event: int
    header: str
    cells: list[list[str]] = field(default_factory=list)
    rows: list[int] = field(default_factory=list)


def detect(path: Path) -> bool:
    """Whether a text holds a table of delta-V, or of indicated speed with brake or pedal."""
    try:
        if not path.is_file() or path.stat().st_size > LARGEST:
            return False
        data = path.read_bytes()
        if b"\0" in data[:4096] and not data.startswith((b"\xff\xfe", b"\xfe\xff")):
            return False
        text, _ = decoded(data, path.name)
    except (DataError, OSError):
        return False
    # Logs of other kinds are not parsed.
    if NOTE in text or not _NAMED.search(text):
        return False
    found = _tables(text)
    return bool(found.tables or found.short)


def _is_recorder(table: _Table) -> bool:
    """Whether a table has delta-V, or counts to time zero and has speed with brake or pedal.

    A log of a drive has speed, too; its time begins with the log.
    """
    kinds = {c.element for c in table.columns}
    if any(c.said.change and c.said.axis for c in table.columns):
        return True
    stamps = table.clock.values
    counts = bool(stamps[0] < 0.0 or stamps[0] > stamps[-1] or _PRIOR.search(table.clock.heading))
    return counts and "speed" in kinds and bool(kinds & {"brake", "pedal", "rpm", "abs"})


def _tables(text: str) -> _Text:
    """Find the tables of a recorder, and the lines between them with the event that they name."""
    found: list[_Table] = []
    above: list[tuple[str, int]] = []
    short: list[tuple[int, int, int]] = []
    event, table = 0, None

    def close(table: _Open) -> None:
        if table.cells and not _filled(table):
            short.append((table.rows[0], max(map(len, table.cells)), len(table.names)))
        elif table.cells:
            found.extend(_closed(table))

    lines = [(k, line) for k, line in enumerate(text.splitlines(), 1)]
    for k, line in [*lines, (0, "")]:
        line = line.lstrip("#%").replace("\N{MINUS SIGN}", "-")
        fields = _fields(line, table)
        if not any(fields):
            if table is not None and table.cells:
                close(table)
                table = None
            continue
        if table is not None:
            width = len(table.names)
            fields = fields[:width] if not any(fields[width:]) else fields
            if len(fields) <= width and _is_row(table, fields):
                table.cells.append(fields)
                table.rows.append(k)
                continue
            if not table.cells and not table.units and _are_units(fields):
                table.units = fields
                continue
            close(table)
            table = None
            fields = _fields(line, None)
        if _is_header(fields):
            while not fields[-1]:
                fields.pop()
            table = _Open(fields, [], event, line)
            continue
        event = _labelled(fields, event)
        above.append((", ".join(f for f in fields if f), event))
    sensed = ("velocity", "acceleration", "rate")
    tables = [t for t in found if any(c.element or c.said.quantity in sensed for c in t.columns)]
    # Accelerations alone are of any recorder.
    own = any(_is_recorder(t) for t in tables)
    return _Text(_numbered(tables) if own else [], above, short)


def _filled(table: _Open) -> bool:
    """Fill rows up to the width of the header; whether one row has it.

    The regulation's own names have commas: where each row has fewer fields than the header, those
    with a blank after them are of a name, if the number of names is then that of the fields.
    """
    widest = max(map(len, table.cells))
    if widest < len(table.names):
        names = [name.strip() for name in re.split(r",(?! )", table.header)]
        if len(names) != widest:
            return False
        table.names = names
    table.cells = [[*row, *[""] * (len(table.names) - len(row))] for row in table.cells]
    return True


def _fields(line: str, table: _Open | None) -> list[str]:
    """Split a line, in a table by the separator that yields as many fields as the header has."""
    for separator in ("\t", ";", ",") if table is not None else ():
        fields = fields_of(line, separator)
        if table is not None and len(fields) == len(table.names):
            return fields
    # Blanks separate words of a title.
    separated = separator_of(line)
    return [line.strip()] if separated is None else fields_of(line, separated)


def _is_header(fields: list[str]) -> bool:
    full = [f for f in fields if f]
    if len(full) < 2 or any(NUMBER.fullmatch(f) for f in full):
        return False
    times = [f for f in full if _is_time(f)]
    others = [f for f in full if f not in times]
    told = (element_of(f) or channel_name(f).quantity not in ("other", "time") for f in others)
    return bool(times) and any(told)


def _is_time(heading: str) -> bool:
    if _MAXIMUM.search(heading) or element_of(heading):
        return False
    return channel_name(heading).quantity == "time" or bool(
        re.match(r"\s*(time|times|zeit|seconds|milliseconds)\b", heading, re.I)
    )


def _is_row(table: _Open, fields: list[str]) -> bool:
    at = next(k for k, n in enumerate(table.names) if _is_time(n))
    return len(fields) > max(at, 1) and bool(NUMBER.fullmatch(fields[at]))


def _are_units(fields: list[str]) -> bool:
    known = [find_unit(f.strip("[](){} "), OF_CRASHES) is not None for f in fields if f]
    return bool(known) and known[0] and not any(NUMBER.fullmatch(f) for f in fields)


def _labelled(fields: list[str], event: int) -> int:
    """Return the event that a line between tables names, or the one before."""
    full = [f for f in fields if f]
    text = full[0].lower()
    if len(full) == 2 and element_of(text) == "event" and full[1].isdigit():
        return int(full[1])
    if len(full) != 1 or text.startswith(("time", "zeit", "number", "multi")):
        return event
    if match := _EVENT.search(text):
        return int(match[1])
    return next((number for words, number in _RECENT if words in text), event)


def _number(cell: str) -> float:
    text = cell.strip().rstrip("%").strip()
    if NUMBER.fullmatch(text):
        return float(text.replace(",", "."))
    return 1.0 if text.lower() in _ON else 0.0 if text.lower() in _OFF else math.nan


def _closed(table: _Open) -> list[_Table]:
    """Parse the columns of a table; one with a column of events is one table for each."""
    if not table.cells:
        return []
    columns: list[_Column] = []
    for k, heading in enumerate(table.names):
        cells = [row[k] for row in table.cells]
        if not heading or not any(cells):
            continue
        row_unit = table.units[k] if k < len(table.units) else ""
        columns += _columns(clean(heading, LONGEST_NAME), row_unit.strip("[](){} "), cells)
    rows = np.array(table.rows)
    times = [c for c in columns if c.said.quantity == "time"]
    if not times:
        return []
    # A second column of time is context.
    columns = [c for c in columns if c.said.quantity != "time" or c is times[0]]
    numbers = next((c.values for c in columns if c.element == "event"), None)
    own = {e for c in columns if (e := _event_of(c.heading))}
    if numbers is not None and np.isfinite(numbers).all():
        out = []
        for event in np.unique(numbers):
            kept = numbers == event
            part = tuple(replace(c, values=c.values[kept]) for c in columns if c.element != "event")
            out += _parts(_Table(part, rows[kept], int(event)))
        return out
    if len(own) > 1:
        return [
            part
            for event in sorted(own)
            for part in _parts(
                _Table(
                    tuple(
                        c
                        for c in columns
                        if c.said.quantity == "time" or _event_of(c.heading) in (0, event)
                    ),
                    rows,
                    event,
                )
            )
        ]
    return _parts(_Table(tuple(columns), rows, table.event or next(iter(own), 0)))


def _event_of(heading: str) -> int:
    match = _EVENT.search(heading)
    return int(match[1]) if match else 0


def _columns(heading: str, row_unit: str, cells: list[str]) -> Iterator[_Column]:
    """Yield the columns of one heading: two where each cell has both units, as ``31 [50]``."""
    element, time = element_of(heading), _is_time(heading)
    units = _units_of(heading)
    both = [_BOTH.fullmatch(c) for c in cells]
    if len(units) == 2 and all(m or not c.strip() for m, c in zip(both, cells, strict=True)):
        for k, unit in enumerate(units):
            values = np.array([_number(m[k + 1]) if m else math.nan for m in both])
            yield _Column(f"{heading} in {unit}", element, _said(heading, unit), values)
        return
    values = np.array([_number(c) for c in cells])
    unit = units[0] if len(units) == 1 else row_unit if not units else ""
    if time:
        known = find_unit(unit, ("time",)) if unit else None
        word = re.match(r"\s*(seconds|milliseconds)\b", heading, re.I)
        stated = (
            known[1] if known else (find_unit(word[1], ("time",)) or ("", ""))[1] if word else ""
        )
        yield _Column(heading, "time", ChannelName("time", "", stated), values)
        return
    yield _Column(heading, element, _said(heading, unit), values)


def _said(heading: str, unit: str) -> ChannelName:
    """Meaning of a heading; of context, and of a maximum, only the unit."""
    bare = _EVENT.sub(" ", _BRACKETS.sub(" ", heading))
    for words, instead in _SIGNS:
        bare = words.sub(instead, bare)
    said = channel_name(bare, unit)
    known = find_unit(unit, OF_CRASHES) if unit else None
    if element_of(heading) or _MAXIMUM.search(heading) or said.quantity == "time":
        return ChannelName("other", "", known[1] if known else unit)
    if said.change and known and known[0] != "velocity":
        return ChannelName("other", "", known[1])
    return said


def _units_of(heading: str) -> list[str]:
    """Units that a heading states, in brackets or as its last words: ``(MPH [km/h])``."""
    bracketed = re.search(r"[\[(].*", heading)
    found = []
    for text in re.split(r"[\[\](){},;|]|\bor\b", bracketed[0] if bracketed else ""):
        known = [find_unit(text, OF_CRASHES)]
        if known == [None]:
            known = [find_unit(part, OF_CRASHES) for part in text.split("/")]
        found += [k[1] for k in known if k]
    if found:
        return list(dict.fromkeys(found))
    unit = unit_words(re.sub(r"[\[\]()]", " ", heading).lower().split(), OF_CRASHES)[1]
    return [unit] if unit else []


def _parts(table: _Table) -> list[_Table]:
    """Split a table whose columns fill different rows."""
    groups: dict[tuple[int, int], list[_Column]] = {}
    clock = table.clock
    for column in table.columns:
        there = np.flatnonzero(np.isfinite(column.values))
        if column is not clock and there.size:
            key = (int(there[0]), int(there[-1]) + 1)
            groups.setdefault(key, []).append(column)
    spans = [k for k, held in groups.items() if any(c.said.change for c in held)]
    starts = {a for a, _ in groups}
    if len(groups) > 1 and not (len(starts) > 1 and spans):
        # Invalid values at an end of some: one table over all of its rows.
        whole = (min(a for a, _ in groups), max(b for _, b in groups))
        groups = {whole: [c for held in groups.values() for c in held]}
    out = []
    for (first, last), held in groups.items():
        kept = [replace(c, values=c.values[first:last]) for c in (clock, *held)]
        out.append(_Table(tuple(kept), table.rows[first:last], table.event))
    return out


def _in_order(table: _Table, name: str) -> _Table:
    """Put stamps in increasing order; seconds before the crash become negative."""
    clock = table.clock
    stamps = clock.values
    before = not any(c.said.change for c in table.columns) and bool((stamps >= 0.0).all())
    counted = bool(_PRIOR.search(clock.heading)) or (stamps.size > 1 and stamps[0] > stamps[-1])
    if before and counted and stamps.max() > 0.0:
        stamps = -stamps + 0.0
    order = slice(None, None, -1) if stamps.size > 1 and stamps[0] > stamps[-1] else slice(None)
    columns = tuple(
        replace(c, values=(stamps if c is clock else c.values)[order]) for c in table.columns
    )
    table = _Table(columns, table.rows[order], table.event)
    back = np.flatnonzero(~(np.diff(table.clock.values) > 0.0))
    if back.size:
        k = int(back[0])
        raise DataError(
            "io.time-goes-back-in-record",
            file=name,
            row=int(table.rows[k + 1]),
            quantity=f"time ({clock.heading})",
            stamps=table.clock.values[k + 1],
            stamps_2=table.clock.values[k],
        )
    return table


def _numbered(tables: list[_Table]) -> list[_Table]:
    """Number the events of tables without a label, in their order.

    Tables of one event have different columns: where those of the crash occur twice, the second is
    of another event.
    """
    if any(t.event for t in tables):
        return [t if t.event else replace(t, event=1) for t in tables]
    moves = {"velocity", "acceleration"}
    crash = [
        k
        for k, t in enumerate(tables)
        if moves & {c.said.quantity for c in t.columns if c.said.axis}
    ]
    others = [k for k in range(len(tables)) if k not in crash]
    events = _groups(tables, crash)
    out = list(tables)
    for k, at in enumerate(events):
        for m in at:
            out[m] = replace(out[m], event=k + 1)
    for k, m in enumerate(others):
        # Where their number is another, a table before a crash is of none that could be named.
        known = len(others) == len(events)
        out[m] = replace(out[m], event=k + 1 if known or not events else 0)
    return out


def _groups(tables: list[_Table], crash: list[int]) -> list[list[int]]:
    """Group tables of crashes into events: one that repeats an axis begins the next."""
    events: list[list[int]] = []
    held: set[tuple[str, str, str]] = set()
    for k in crash:
        own = {
            (c.said.quantity, c.said.axis, c.said.unit)
            for c in tables[k].columns
            if c.said.quantity in ("velocity", "acceleration", "rate")
        }
        if not events or own & held:
            events.append([])
            held = set()
        events[-1].append(k)
        held |= own
    return events


# Channels and findings.


def read(path: Path) -> CrashRecord:
    """Read the tables of an event data recorder.

    A channel for each column, under its heading; of the tables of one event the same `event`.
    Columns of one quantity in two units are one channel where they agree within their rounding.
    """
    text, findings = decoded(path.read_bytes(), path.name)
    found = _tables(text)
    for row, count, width in found.short:
        raise DataError("io.edr-header-longer", file=path.name, row=row, count=count, width=width)
    if not found.tables:
        raise DataError("io.no-numeric-column", file=path.name)
    found = found._replace(tables=[_in_order(t, path.name) for t in found.tables])
    findings += _of_lines(found, path.name)
    several = len({t.event for t in found.tables if t.event}) > 1
    merged = [_one_unit(t, path.name, findings) for t in found.tables]
    for table in merged:
        findings += _of_table(table, path.name)
    bare = [
        (
            table,
            column,
            f"{column.heading}{f' (event {table.event})' if several and table.event else ''}",
        )
        for table in merged
        for column in table.columns
    ]
    names = unique([name for *_, name in bare])
    clocks = {
        id(t): n for (t, c, _), n in zip(bare, names, strict=True) if c.said.quantity == "time"
    }
    channels = [
        _channel(t, c, n, clocks[id(t)], path.name)
        for (t, c, _), n in zip(bare, names, strict=True)
    ]
    remarks = [clean(line, LONGEST_NAME) for line, _ in found.above]
    return CrashRecord(
        path=path,
        format="edr",
        title=clean(path.stem),
        facts={},
        channels=tuple(channels),
        files=(path,),
        findings=tuple(findings),
        remarks=tuple([r for r in dict.fromkeys(remarks) if r][:MOST_REMARKS]),
    )


def _channel(table: _Table, column: _Column, name: str, clock: str, file: str) -> CrashChannel:
    said, values = column.said, column.values
    factor = FACTORS.get(said.quantity, {}).get(said.unit, 1.0)
    si = values if said.quantity == "time" else values * factor
    rows = table.rows
    stamped = Clock(clock, table.clock.values, table.clock.said.unit, file, lambda k: int(rows[k]))
    return CrashChannel(
        name=name,
        quantity=said.quantity,
        axis=said.axis,
        unit=clean(said.unit, LONGEST_NAME),
        load=_loader(stamped, si),
        sampling=None,
        remarks=(said.contradiction,) if said.contradiction else (),
        file=file,
        row=stamped.row,
        clock=clock,
        samples=si.copy,
        from_zero=said.change,
        event=table.event,
    )


def _loader(clock: Clock, values: Array) -> Callable[[], tuple[Array, Array]]:
    return lambda: (seconds_of(clock)[0], values.copy())


def _one_unit(table: _Table, file: str, findings: list[Finding]) -> _Table:
    """Join columns of one quantity in two units, or written twice, if they agree."""
    groups: dict[tuple[str, ...], list[_Column]] = {}
    for column in table.columns:
        said = column.said
        is_one = said.unit and (said.axis or column.element == "speed")
        kind = (said.quantity, said.axis.lstrip("-"), column.element)
        groups.setdefault(kind if is_one else (column.heading,), []).append(column)
    gone: set[int] = set()
    for held in groups.values():
        for a, b in itertools.combinations(held, 2):
            if id(a) in gone or id(b) in gone:
                continue
            x, y, apart, limit = _compared(a, b)
            data: dict[str, Any] = {"name": a.heading, "other": b.heading}
            if apart.size and apart.max() > limit:
                k = int(np.argmax(apart))
                add_warning(
                    findings,
                    "io.edr-units-disagree",
                    file=file,
                    row=int(table.rows[k]),
                    quantity="unit",
                    value=float(x[k]),
                    value_2=float(y[k]),
                    unit={"acceleration": "m/s²", "rate": "rad/s"}.get(a.said.quantity, "m/s"),
                    **data,
                )
                continue
            fine = rounding(a.values) * _factor(a) <= rounding(b.values) * _factor(b)
            coarse = b if fine else a
            gone.add(id(coarse))
            data["name"] = (b if coarse is a else a).heading
            data["other"] = coarse.heading
            add_note(findings, "io.edr-two-units", file=file, quantity="unit", **data)
    return replace(table, columns=tuple(c for c in table.columns if id(c) not in gone))


def _factor(column: _Column) -> float:
    kind = "velocity" if column.element == "speed" else column.said.quantity
    return FACTORS.get(kind, {}).get(column.said.unit, 1.0)


def _compared(a: _Column, b: _Column) -> tuple[Array, Array, Array, float]:
    """Both columns in SI, their differences, and half of the rounding of each."""
    steps = [rounding(c.values) * _factor(c) for c in (a, b)]
    x, y = (c.values * (-_factor(c) if c.said.axis.startswith("-") else _factor(c)) for c in (a, b))
    return x, y, np.nan_to_num(np.abs(x - y)), 0.5 * (steps[0] + steps[1]) * (1.0 + 1e-6) + 1e-9


def _of_lines(text: _Text, file: str) -> list[Finding]:
    """Findings of labels and values: an incomplete file, a maximum that the table does not have."""
    findings: list[Finding] = []
    for line, event in text.above:
        label, _, value = line.rpartition(",")
        lower = label.lower()
        if "complete file" in lower and value.strip().lower() in _OFF:
            add_warning(findings, "io.edr-not-complete", file=file, quantity="complete file")
        axis = next((a for a in ("longitudinal", "lateral") if a in lower), "")
        units = _units_of(label)
        unit = (
            units[0]
            if units
            else (find_unit(value.split()[-1], OF_CRASHES) or ("", ""))[1]
            if (value.split())
            else ""
        )
        number = re.match(r"\s*([+-]?[\d.]+)", value)
        if not (_MAXIMUM.search(lower) and axis and number and unit in SPEEDS) or "time" in lower:
            continue
        findings += _of_maximum(text.tables, event, axis, _number(number[1]) * SPEEDS[unit], file)
    return findings


def _of_maximum(
    tables: Sequence[_Table], event: int, axis: str, stated: float, file: str
) -> list[Finding]:
    letter = "x" if axis == "longitudinal" else "y"
    held = [
        c
        for t in tables
        for c in t.columns
        if c.said.change and c.said.axis.endswith(letter) and c.said.unit in SPEEDS
        if not event or t.event == event
    ]
    reached = max((float(np.nanmax(np.abs(c.values))) * _factor(c) for c in held), default=math.nan)
    # The rounding of the table, and 1 km/h of the maximum (Table III).
    limit = max((rounding(c.values) * _factor(c) for c in held), default=0.0) + KMH
    if not abs(stated) > reached + limit:
        return []
    return [
        Finding(
            "io.edr-maximum-beyond-table",
            file=file,
            quantity=f"delta-V, {axis}",
            axis=letter,
            stated=abs(stated) / KMH,
            reached=reached / KMH,
        )
    ]


def _of_table(table: _Table, file: str) -> list[Finding]:
    """Findings of delta-V: at the end of the range, or still changing where the table ends."""
    findings: list[Finding] = []
    factor = TIME_UNITS.get(table.clock.said.unit, math.nan)
    time = table.clock.values * factor
    for column in table.columns:
        said = column.said
        if not said.change or said.unit not in SPEEDS:
            continue
        there = np.isfinite(column.values)
        v = column.values[there] * SPEEDS[said.unit]
        where: dict[str, Any] = {"file": file, "quantity": column.heading}
        step = rounding(column.values[there]) * _factor(column)
        largest = float(np.abs(v).max())
        at_end = np.flatnonzero(np.abs(v) >= largest - 0.5 * step) if step else np.array([], int)
        if largest >= DELTA_V_RANGE - 0.5 * max(step, KMH) and at_end.size > 1:
            add_warning(
                findings,
                "io.edr-at-range-end",
                **where,
                row=int(table.rows[there][at_end[0]]),
                axis=said.axis.lstrip("-"),
                reached=largest / KMH,
                count=at_end.size,
            )
        late = np.flatnonzero(time[there] >= time[there][-1] - 1.01 * END_SPAN)
        if v.size > 2 and late.size > 1:
            change = abs(float(v[-1] - v[late[0]]))
            if change > END_CHANGE + step:
                add_warning(
                    findings,
                    "io.edr-ends-in-event",
                    **where,
                    row=int(table.rows[there][-1]),
                    axis=said.axis.lstrip("-"),
                    end=float(time[there][-1]),
                    change=change / KMH,
                )
    return findings

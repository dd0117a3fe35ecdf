"""Propose a case file from records: what they say, assumptions, and questions to the user.

`case.toml.jinja` is the file; this module infers what it is filled with.
"""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path, PurePath
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from strapdown import rotation
from strapdown.config.toml_text import (
    Draft,
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
from strapdown.crash.event_data import IndicatedEntry, drop_copies, recorder_parts
from strapdown.crash.events import KMH, PART_563, EventDetector
from strapdown.crash.pdof import pdof
from strapdown.crash.record_parts import (
    FULL_SCALES,
    KnownForce,
    KnownPath,
    Part,
    Skipped,
    StatedReading,
    agreement,
    known_force,
    known_path,
    overlaps,
    quiet_part,
    record_parts,
    settle_units,
)
from strapdown.errors import ConfigError, DataError, Finding
from strapdown.formats.aid_table import read_aid_table
from strapdown.formats.columns import parse_axes
from strapdown.formats.crash_record import CrashRecord, compact
from strapdown.formats.crash_records import files_named, read_crash_record
from strapdown.formats.gnss_files import read_gnss
from strapdown.formats.triad_units import axes_matrix, mirrored
from strapdown.rotation import within_half_turn
from strapdown.sensors.catalogue import SENSORS, load_sensor
from strapdown.sensors.pre_crash import find_pre_crash_rest
from strapdown.sensors.saturation import find_limits
from strapdown.tables import ACCEL, GYRO
from strapdown.tables.checks import Array
from strapdown.units import GYRO_UNITS


def read_records(paths: Sequence[str | Path]) -> list[CrashRecord]:
    """Read the records for a proposed case. `ConfigError`: a file is named twice.

    A file that another record names as its own is part of that record.
    """
    seen: dict[Path, str] = {}
    records = []
    named = files_named([Path(given) for given in paths])
    for given in paths:
        if named and Path(given).resolve() in named:
            continue
        record = read_crash_record(given)
        own = {file.resolve(): file for file in record.files or (Path(given),)}
        for real in seen.keys() & own.keys():
            differently = "-differently" if seen[real] != str(given) else ""
            raise ConfigError(
                f"crash.record-named-twice{differently}",
                file=own[real].name,
                quantity="RECORD",
                seen=seen[real],
                given=given,
            )
        seen |= dict.fromkeys(own, str(given))
        records.append(record)
    return records


def draft_case(records: Sequence[CrashRecord], *, folder: str | Path = ".") -> Draft:
    """Write a proposed case from records of one vehicle.

    Parameters
    ----------
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
    ConfigError
        The records are of several vehicles.
    """
    drafts = draft_cases(records, folder=folder)
    if len(drafts) > 1:
        raise ConfigError(
            "crash.records-of-several-vehicles",
            file=", ".join(r.path.name for r in records[:3]),
            quantity="vehicle",
            numbers=[d.vehicle for d in drafts],
        )
    return drafts[0]


def draft_cases(
    records: Sequence[CrashRecord],
    *,
    folder: str | Path = ".",
    stated: Mapping[Path, StatedReading] = MappingProxyType({}),
) -> tuple[Draft, ...]:
    """Write a proposed case for each vehicle of the records.

    Parameters
    ----------
    folder : str or Path
        Folder of the case files; record paths are relative to it.
    stated : mapping of Path to StatedReading
        How records are read, by their path, where a person says it.

    Returns
    -------
    tuple of Draft
        In the order of the vehicles' numbers. Records that number no vehicles are of one.

    Raises
    ------
    DataError
        No record, or none with an accelerometer; the message lists the findings.
    """
    tables: list[Part] = []
    settled: list[Part] = []
    skipped: list[Skipped] = []
    findings: list[Finding] = []
    references: list[KnownPath | KnownForce] = []
    entries: list[IndicatedEntry] = []
    drives: list[RecordedDrive] = []
    labels: dict[str, Mapping[str, str]] = {}
    for record in records:
        path = named_from(record.path, Path(folder))
        # The case states the reader's finding about the clock.
        findings += [f for f in record.findings if f.quantity != "time"]
        known = known_path(path, record) or known_force(path, record)
        if known is not None:
            references.append(known)
            continue
        if record.format == "edr":
            recorder = recorder_parts(path, record)
            tables += recorder.parts
            skipped += recorder.skipped
            findings += recorder.findings
            entries += [recorder.entry] if recorder.entry else []
            continue
        drive = recorded_drive(path, record)
        found, left, open_units = record_parts(path, record)
        if drive is not None:
            drives.append(drive)
            if drive.kind == "gnss" and all(p.kind != "acceleration" for p in found):
                # Fixes without an accelerometer do not make a recorder.
                continue
            left = [s for s in left if drive.column not in s.names]
        if (reading := stated.get(record.path)) is not None:
            found = [reading.of(part) for part in found]
        own = _labels(record, found, labels)
        skipped += [replace(s, vehicle=own.get(s.vehicle, s.vehicle)) for s in left]
        parts = [replace(p, vehicle=own[p.vehicle]) for p in found]
        (tables if open_units else settled).extend(parts)
    skipped += _beside(records, Path(folder))
    tables, copies, told_of = drop_copies(tables)
    skipped += copies
    findings += told_of
    settled += settle_units(tables)
    units, skipped = _units_by_vehicle(settled, skipped)
    if not units:
        told = [f"{', '.join(p.channels.values())}: {p.kind}" for p in settled]
        told += [f"{s.what}: {s.why}" for s in skipped]
        numbered = any(c.vehicle or c.point for r in records for c in r.channels)
        code = (
            "crash.nothing-in-record"
            if not told
            else "crash.no-accelerometer-on-structure"
            if numbered
            else "crash.no-accelerometer-found"
        )
        raise DataError(
            code,
            file=", ".join(r.path.name for r in records[:3]),
            parts=told[:8] + ["…"] * (len(told) > 8),
        )
    if len(units) > 1:
        why = "nothing says which of the vehicles it is of; add it to the case of its own"
        skipped += [Skipped(r.path, plain(r.name), why) for r in references]
        references = []
    of_test = next((r for r in records if r.facts or r.vehicles), None)
    lines = [
        f"{plain(r.name)}: a path from {instant(r.start)} to {instant(r.end)} s, a reference"
        if isinstance(r, KnownPath)
        else f"{plain(r.name)}: a force, a reference"
        for r in references
    ]
    drafts = []
    for vehicle, of_vehicle in units.items():
        facts = {**(of_test.facts if of_test else {}), **labels.get(vehicle, {})}
        name = facts.get("vehicle", "")
        title = of_test.title if of_test else ""
        # The database numbers makes and models; its title has their names after the year.
        named = re.search(rf"\b{name[-4:]} \D.+", title) if name.startswith("make ") else None
        if named and len(units) == 1:
            name = facts["vehicle"] = named.group()
        if title and len(units) > 1:
            title = f"{title}, vehicle {vehicle}"
        # What belongs to no vehicle that has a case is stated in each.
        left_out = tuple(s for s in skipped if s.vehicle == vehicle or s.vehicle not in units)
        # A recorder's table states no vehicle, so that its speed is of the only one.
        speeds = entries[:1] if len(units) == 1 else []
        # Fixes have no tires.
        driven = sorted(drives, key=lambda d: d.kind)[:1] if len(units) == 1 else []
        several = len(units) > 1
        faced = _face(of_vehicle)
        against = [u.against_gravity() for u in faced if u.axes_contradicted]
        page = _filled(faced, left_out, title, facts, references, speeds, driven, several)
        drafts.append(
            Draft(
                page.text,
                (*map(_told, of_vehicle), *lines),
                tuple(page.asked),
                tuple(page.to_check),
                (*findings, *against),
                vehicle=vehicle,
                name=plain(name),
                left_out=left_out,
            )
        )
    return tuple(drafts)


#: Endings of tables that may lie in the folder of a record.
TABLES = (".csv", ".tsv", ".txt", ".xlsx")


def _beside(records: Sequence[CrashRecord], folder: Path) -> list[Skipped]:
    """Tables in the folders of the records that do not belong to a record."""
    known = {file.resolve() for record in records for file in record.files}
    folders = {record.files[0].parent for record in records if len(record.files) > 1}
    why = "it is no part of the record in its folder; to use it, name it, too"
    return [
        Skipped(named_from(file, folder), "the file", why)
        for one in sorted(folders)
        for file in sorted(one.iterdir())
        if file.suffix.lower() in TABLES and file.resolve() not in known
    ]


def _labels(
    record: CrashRecord, parts: Sequence[Part], labels: dict[str, Mapping[str, str]]
) -> dict[str, str]:
    """Number of each vehicle of a record among those of all records, whose facts are in `labels`.

    Vehicles of two records with one number are one, unless their facts name two.
    """
    known = {"": ""}
    if len(record.vehicles) == 1:
        # What states no vehicle is of the only one.
        labels.setdefault("", next(iter(record.vehicles.values())))
    for vehicle in dict.fromkeys(p.vehicle for p in parts if p.vehicle):
        facts = record.vehicles.get(vehicle, {})
        free = (str(k) for k in itertools.count(1) if str(k) not in labels)
        same = vehicle not in labels or not _differ(labels[vehicle], facts)
        label = vehicle if same else next(free)
        labels[label] = {**facts, **labels.get(label, {})}
        known[vehicle] = label
    return known


def _differ(one: Mapping[str, str], other: Mapping[str, str]) -> bool:
    """Whether facts are of two vehicles: by the numbers of their chassis, or by their names."""
    key = "vin" if "vin" in one and "vin" in other else "vehicle"
    named = compact(one.get(key, "")), compact(other.get(key, ""))
    return all(named) and named[0] != named[1]


def _units_by_vehicle(
    parts: Sequence[Part], skipped: Sequence[Skipped]
) -> tuple[dict[str, list[Unit]], list[Skipped]]:
    """Units of each vehicle that has an accelerometer, and what is left out."""
    out = list(skipped)
    found = {p.vehicle for p in parts if p.vehicle and p.kind == "acceleration"}
    numbers = sorted(found, key=lambda number: (len(number), number))
    if len(numbers) == 1:
        # What states no vehicle is of the only one.
        parts = [replace(p, vehicle=p.vehicle or numbers[0]) for p in parts]
    elif numbers:
        why = "nothing says which of the vehicles it is of; make the case of one from its records"
        out += [
            Skipped(p.path, _of(p), why, tuple(p.channels.values())) for p in parts if not p.vehicle
        ]
        parts = [p for p in parts if p.vehicle]
    units: dict[str, list[Unit]] = {}
    for vehicle in numbers or [""]:
        own, left = group_units([p for p in parts if p.vehicle == vehicle])
        out += [replace(one, vehicle=vehicle) for one in left]
        if own:
            units[vehicle] = own
    why = "its vehicle has no accelerometer"
    out += [
        Skipped(p.path, _of(p), why, tuple(p.channels.values()), p.vehicle)
        for p in parts
        if p.vehicle not in units and units
    ]
    return units, out


# The drive before the crash, where a record has fixes or the speed of the vehicle.


class RecordedDrive(NamedTuple):
    """Table of fixes or speeds of a drive: `column` and `unit` of a speed, empty of fixes."""

    kind: str
    path: str
    column: str
    unit: str
    length: float


#: A drive that is shorter shows little, s; a speed that stays below was not driven, m/s.
LEAST_DRIVE, LEAST_DRIVEN = 5.0, 3.0


def recorded_drive(path: str, record: CrashRecord) -> RecordedDrive | None:
    """Fixes of a record, or else the speed of the vehicle; None where it has neither."""
    words = {c.name: set(re.findall(r"[a-z]+", c.name.lower())) for c in record.channels}
    try:
        if any("lat" in w for w in words.values()) and any("lon" in w for w in words.values()):
            table = read_gnss(record.path)
            length = float(np.ptp(table.index))
            return RecordedDrive("gnss", path, "", "", length) if length > LEAST_DRIVE else None
        for name in (n for n, w in words.items() if "speed" in w and not w & set("xyz")):
            table = read_aid_table(record.path, {"speed": "m/s"}, names={"speed": name})
            length, fastest = float(np.ptp(table.index)), float(table["speed"].max())
            assumed = any(f.code == "io.unit-assumed" for f in table.attrs["findings"])
            if length > LEAST_DRIVE and fastest > LEAST_DRIVEN:
                return RecordedDrive("speed_record", path, name, "?" * assumed, length)
    except (ConfigError, DataError):
        # A table that cannot be read as a drive is read as a record alone.
        return None
    return None


# The file from its template.

# Laboratories sample fast enough to record ringing.
FAST = 5000.0  # Hz
# A larger ratio between two units of a vehicle is not explained by their positions.
FAR_APART = 1.5
# In the template, and in what it is filled with: before a remark, a question, a consequence.
_MARKS = {"  # ": "\x1f", " ?? ": "\x1e", " !! ": "\x1d"}


def _filled(
    units: Sequence[Unit],
    skipped: Sequence[Skipped],
    title: str,
    facts: Mapping[str, str],
    references: Sequence[KnownPath | KnownForce],
    entries: Sequence[IndicatedEntry],
    drives: Sequence[RecordedDrive],
    several: bool,
) -> Page:
    """Fill the template, and wrap its comments; `several`: vehicles of one crash."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    class Marked(PackageLoader):
        def get_source(self, environment: Environment, template: str) -> Any:
            source, *more = super().get_source(environment, template)
            for sign, mark in _MARKS.items():
                source = source.replace(sign, mark)
            return source, *more

    # Text of a record has no line break and none of the marks.
    environment = Environment(
        loader=Marked("strapdown.crash", ""),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        finalize=lambda value: "".join(c if c.isprintable() else " " for c in str(value)),
    )
    late = max(float(u.accelerometers[0].time[0]) - u.impact.trigger for u in units)
    timed = all(u.impact.found and u.accelerometers[0].clock.unit for u in units)
    sure = [u for u in units if u.impact.found and u.strong.clock.unit]
    sizes = [u.impact.largest for u in sure]
    rate = min(u.strong.clock.rate for u in units)
    helpers = (array, inline, instant, number, plain, string, direction, side_of, in_words)
    text = environment.get_template("case.toml.jinja").render(
        {helper.__name__: helper for helper in helpers},
        KMH=KMH,
        title=title,
        facts=facts,
        several=several,
        fact=lambda key: _positive(facts.get(key, "")),
        stands=_number(facts.get("speed_m_per_s", "")) == 0.0,
        late=late if timed and late > 0.0 else None,
        # The speed before time zero of a recorder, if the case counts from there.
        indicated=entries[0] if entries and any(u.impact.at_zero for u in units) else None,
        drive=drives[0] if drives else None,
        units=units,
        paths=[r for r in references if isinstance(r, KnownPath)],
        forces=[r for r in references if isinstance(r, KnownForce)],
        skipped=skipped,
        blows=[_blow(u) for u in sure],
        far_apart=len(sure) > 1 and max(sizes) > FAR_APART * min(sizes),
        rate=rate,
        same_trigger=all(u.impact.at_zero for u in units),
        all_velocities=all(p.velocities for u in units for p in u.accelerometers),
        rings=rate >= FAST and all(u.gyro is None for u in units),
        turning=_turning,
        error_model=error_model,
        lacking=lambda axes: ", ".join(a for a in "xyz" if a not in axes),
        peaks=lambda part, ends: [in_words(p, part.kind) for p in ends.peak if p == p],
        stood=lambda part, ends: [
            f"{axis} at {in_words(e, part.kind)}"
            for axis, e in zip("xyz", ends.ends, strict=True)
            if e is not None
        ],
    )
    page = Page()
    for line in text.split("\n"):
        if line.startswith("#!"):
            page.lines.append(f"# {line[2:].replace(_MARKS['  # '], '  # ')}")
        elif line.startswith("#"):
            page.say(line[1:].removeprefix(" "))
        elif " = " in line:
            body, _, check = line.partition(_MARKS[" !! "])
            body, _, what = body.partition(_MARKS[" ?? "])
            body, _, remark = body.partition(_MARKS["  # "])
            name, _, value = body.rstrip().partition(" = ")
            page.key(name, value, remark, what=what, check=check)
        elif line:
            page.lines.append(line)
        else:
            page.blank()
    return page


def _number(text: str) -> float | None:
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def _positive(text: str) -> float | None:
    value = _number(text)
    return value if value is not None and value > 0.0 else None


def _blow(unit: Unit) -> str:
    came = None if unit.heading_deg is None else direction(unit, unit.heading_deg)
    where = "" if came is None else f" from {came:.0f} deg"
    return f"'{plain(unit.name)}' {unit.impact.largest / KMH:.3g} km/h{where}"


def _told(unit: Unit) -> str:
    """One line of the terminal about a unit."""
    impact, clock, count = unit.impact, unit.strong.clock, len(unit.accelerometers)
    ranges = ["low range" if count > 1 else "one range", *["high range"] * (count - 1)]
    if not clock.unit:
        at = impact.trigger * clock.rate
        what = f"its largest impact begins near sample {at:.0f}; it has no clock"
    elif unit.strong.candidates:
        what = (
            f"largest pulse at {instant(impact.trigger)} s of its clock, and its unit is not "
            f"stated: {unit.strong.candidates}"
        )
    elif impact.found:
        what = (
            f"impact at {instant(impact.trigger)} s of its clock, "
            f"delta-V {impact.largest / KMH:.3g} km/h (change of velocity, no speed), "
            f"peak {impact.peak / STANDARD_GRAVITY:.3g} g"
        )
    elif unit.strong_ends.saturated:
        what = f"impact at {instant(impact.trigger)} s of its clock, beyond the end of its range"
    else:
        what = (
            f"no crash found: {impact.largest / KMH:.2g} km/h within 150 ms at most, of the 8 that "
            "49 CFR 563 asks for"
        )
    with_ = " and ".join(ranges) + (", gyro" if unit.gyro else "")
    return f"{plain(unit.name)}: {with_}; {what}"


def in_words(value: float, kind: str) -> str:
    """Write a magnitude in its customary unit."""
    if kind == "acceleration":
        return f"{value / STANDARD_GRAVITY:.3g} g"
    return f"{value / GYRO_UNITS['deg/s']:.4g} deg/s"


# Recorders: triads of one housing, and the gyro of those without.

# Impacts on one clock differ by less than this, or by three steps of the slower.
SAME_INSTANT, STEPS = 0.01, 3.0  # s
# Least correlation, and largest difference of scale, of two ranges of one housing.
SAME_PLACE, SAME_SCALE = 0.8, 0.25
# A gyro shares the accelerometer's clock if it begins to turn, by so many standard deviations,
# within this of the impact.
TURNS_WITHIN, TURNED = 0.15, 8.0  # s
# Zeroed records: length of the rest before the impact, s.
LEAST_REST, LONGEST_REST = 0.02, 1.0
_RANGE_WORDS = re.compile(
    r"(?<![a-z])(low|high|lo|hi|lg|hg|nd|hd|acc\w*|gyr\w*|gyro|imu|rate\w*|drehrate\w*|beschl\w*"
    r"|\d+ ?g|a|w|g)(?![a-z])"
)


@dataclass(frozen=True, eq=False)
class Unit:
    """Recorder found in the records.

    Accelerometers in order of increasing range; `gyro_from`: unit whose gyro it uses, empty if
    none; `ends`: of each accelerometer, and of the gyro last; `why`: grounds for the grouping;
    heading of the mounting with the reason, or None with the meaning of each right angle.
    """

    name: str
    accelerometers: tuple[Part, ...]
    gyro: Part | None
    gyro_from: str
    impact: Impact
    ends: tuple[RangeEnds, ...]
    why: tuple[str, ...] = ()
    heading_deg: float | None = None
    heading_why: str = ""

    @property
    def vehicle(self) -> str:
        """Number of its vehicle; empty where the records number none."""
        return self.strong.vehicle

    @property
    def strong(self) -> Part:
        """The accelerometer of the highest range."""
        return self.accelerometers[-1]

    @property
    def strong_ends(self) -> RangeEnds:
        """Range ends of the accelerometer of the highest range."""
        return self.ends[len(self.accelerometers) - 1]

    @property
    def triads(self) -> list[tuple[Part, RangeEnds, str, bool]]:
        """Each part, its ends, the header of its table, and whether it is its file's first."""
        headers = ["[[units.accelerometers]]"] * len(self.accelerometers) + ["[units.gyro]"]
        parts = [*self.accelerometers, *([self.gyro] if self.gyro else [])]
        first = [p.path not in [q.path for q in parts[:k]] for k, p in enumerate(parts)]
        return list(zip(parts, self.ends, headers[: len(parts)], first, strict=True))

    @property
    def axes(self) -> set[str]:
        """Axes that an accelerometer measures."""
        return {a for p in self.accelerometers for a in p.channels}

    @property
    def axes_stated(self) -> str:
        """Where a person says that its axes point; empty without, or if its files differ in it."""
        parts = [*self.accelerometers, *([self.gyro] if self.gyro else [])]
        said = {p.axes_stated for p in parts}
        return said.pop() if len(said) == 1 else ""

    @property
    def axes_contradicted(self) -> bool:
        """Whether gravity at rest contradicts the stated axes by over half a right angle."""
        sitting = self.impact.sitting
        if not self.axes_stated or sitting is None or not sitting.length:
            return False
        up = float(sitting.into_vehicle(stated_mounting(self.axes_stated)[2:])[0, 2])
        return up < math.cos(math.radians(MOST_PITCH))

    def against_gravity(self) -> Finding:
        """Return the finding that gravity at rest contradicts the stated axes."""
        return Finding("crash.axes-against-gravity", axes=self.axes_stated, unit=self.name)

    @property
    def place(self) -> str:
        """Position as the record states it; empty where it does not."""
        return next((p.place for p in self.accelerometers if p.place), "")

    @property
    def zeroed_from(self) -> float | None:
        """Begin of the rest in which the record was zeroed, s from the trigger.

        With gravity removed, the leveling finds no bias.
        """
        part = self.accelerometers[0]
        before = float(part.time[0]) - self.impact.trigger
        if not part.zeroed or part.velocities or before > -LEAST_REST:
            return None
        return max(before, -LONGEST_REST)


def group_units(parts: Sequence[Part]) -> tuple[list[Unit], list[Skipped]]:
    """Group triads, with kind and likeliest unit settled, into units; and gyros that fit none."""
    groups: list[tuple[list[Part], list[str]]] = []
    for part in (p for p in parts if p.kind == "acceleration"):
        for group, why in groups:
            told = _one_recorder(group, part)
            if told:
                group.append(part)
                why.append(told)
                break
        else:
            groups.append(([part], []))
    for group, _ in groups:
        group.sort(key=_reach)
    impacts = [find_impact(group[-1], group[0]) for group, _ in groups]
    gyros: dict[int, Part] = {}
    skipped: list[Skipped] = []
    for gyro in (p for p in parts if p.kind == "rate"):
        free = {k: groups[k][0] for k in range(len(groups)) if k not in gyros}
        owner, told = _owner(gyro, free, impacts)
        if owner is None:
            skipped.append(Skipped(gyro.path, _of(gyro), told, tuple(gyro.channels.values())))
            continue
        gyros[owner] = gyro
        groups[owner][1].extend([told] if told else [])
    names = _names([[*g, *([gyros[k]] if k in gyros else [])] for k, (g, _) in enumerate(groups)])
    lender = names[next(iter(gyros))] if gyros else ""
    units = []
    for k, (group, why) in enumerate(groups):
        own = gyros.get(k)
        impact = impacts[k] if own is None else find_impact(group[-1], group[0], own)
        ends = tuple(range_ends(p) for p in (*group, *([own] if own else [])))
        borrowed = lender if own is None else ""
        units.append(Unit(names[k], tuple(group), own, borrowed, impact, ends, tuple(why)))
    return units, skipped


def _reach(part: Part) -> float:
    known = [e for e in range_ends(part).ends if e is not None]
    return max(known) if known else float(np.nanmax(np.abs(part.values)))


def _one_recorder(group: Sequence[Part], part: Part) -> str:
    """Why a triad belongs to a group; empty where it does not."""
    for other in group:
        one_file = other.path == part.path
        if other.channels.keys() != part.channels.keys() or not _overlap(other, part):
            continue
        if one_file and other.clock.column != part.clock.column:
            continue
        if other.point != part.point:
            # Two measuring points, as the record names them.
            continue
        low, high = sorted((other, part), key=_reach)
        end, reached = _reach(low), float(np.nanmax(np.abs(high.values)))
        apart = abs(_instant(low, end) - _instant(high, end))
        if not one_file and apart > max(SAME_INSTANT, STEPS * max(other.step, part.step)):
            continue
        goes_on = range_ends(low).saturated and end < 0.8 * reached
        texts = [f"{PurePath(p.path).stem} {p.label}".lower() for p in (low, high)]
        words = [set(re.findall(r"[a-z]+", text)) for text in texts]
        named = words[0] & {"low", "lo", "lg", "nd"} and words[1] & {"high", "hi", "hg", "hd"}
        if not (goes_on or named):
            continue
        slope, correlation = agreement(low, high, low.axes)
        if correlation < SAME_PLACE or abs(slope - 1.0) > SAME_SCALE:
            continue
        told = f"{_of(low)} and {_of(high)} are low and high range of one recorder: "
        if goes_on:
            told += (
                f"the first ends at {in_words(end, 'acceleration')}, where the "
                f"second goes on to {in_words(reached, 'acceleration')}; "
            )
        return told + (
            f"below it they agree (correlation {correlation:.2f}, scale {slope:.2f}) on one clock"
        )
    return ""


def _overlap(a: Part, b: Part) -> bool:
    if a.clock.column == "" or b.clock.column == "":
        return a.path == b.path
    return overlaps(a, b)


def _instant(part: Part, reach: float) -> float:
    """Time of half of the lower range's peak, on the triad's clock."""
    size = np.abs(part.free).max(axis=1)
    return float(part.time[int(np.argmax(size > 0.5 * min(reach, float(size.max()))))])


def _owner(
    gyro: Part, free: Mapping[int, Sequence[Part]], impacts: Sequence[Impact]
) -> tuple[int | None, str]:
    """Unit without a gyro that a gyro belongs to, and why."""
    beside = [k for k, parts in free.items() if any(p.path == gyro.path for p in parts)]
    if beside:
        # Every point of a rigid vehicle turns alike; that of the gyro itself comes first.
        return min(beside, key=lambda k: free[k][0].point != gyro.point), ""
    near = [
        k
        for k, parts in free.items()
        if _overlap(parts[0], gyro) and _turns_at(gyro, impacts[k].trigger)
    ]
    if not near:
        return None, (
            "its clock fits no accelerometer: it does not begin to turn where one is struck; if it "
            "belongs to a unit, bring it to the clock of that unit's file"
        )
    k = min(near, key=lambda k: -len(_shared([_stem(gyro), _stem(free[k][0])])))
    return k, (
        f"{_of(gyro)} is its gyro: it is on the same clock, and begins to turn when "
        f"{_of(free[k][0])} is struck"
    )


def _turns_at(gyro: Part, impact: float) -> bool:
    """Whether it turns more after the impact than before, starting there."""
    values, recent = gyro.values[:, gyro.axes], gyro.time > impact - 3.0
    before = (gyro.time < impact - TURNS_WITHIN) & recent
    if before.sum() < 5:
        return True
    base = values[before]
    sd = np.maximum(base.std(axis=0), 1e-9)
    moved = (np.abs(values - base.mean(axis=0)) > TURNED * sd).any(axis=1)
    starts = gyro.time[moved & recent]
    return bool(starts.size and abs(starts[0] - impact) <= TURNS_WITHIN)


def _names(groups: Sequence[Sequence[Part]]) -> list[str]:
    """Short unit names: of the files, else of the columns."""
    stems = []
    for group in groups:
        files = list(dict.fromkeys(PurePath(p.path).stem for p in group))
        common = _shared(files).strip(" _-.")
        stems.append(common if len(common) >= 2 else files[0])
    names: list[str] = []
    for group, stem in zip(groups, stems, strict=True):
        name = f"{stem} {group[0].label}".strip() if stems.count(stem) > 1 else stem
        base = group[0].place or name or "unit"
        numbered = (f"{base} {n}" for n in itertools.count(2))
        names.append(next(n for n in itertools.chain([base], numbered) if n not in names))
    return names


def _shared(names: Sequence[str]) -> str:
    """Common beginning of all names."""
    together = itertools.takewhile(lambda chars: len(set(chars)) == 1, zip(*names, strict=False))
    return "".join(chars[0] for chars in together)


def _stem(part: Part) -> str:
    return _RANGE_WORDS.sub(" ", PurePath(part.path).stem.lower().replace("_", " ")).strip()


def _of(part: Part) -> str:
    return f"{', '.join(part.channels.values())} of {PurePath(part.path).name}"


# Saturation of a triad, sensors of the catalogue with that full scale, and error models.

# Tolerance of a full scale: converters end a step or two below it, and scale factors are a few
# percent off.
SAME_END = 0.03
GYRO_SCALES = (90.0, 125.0, 250.0, 300.0, 500.0, 1000.0, 2000.0, 4000.0, 8000.0, 20000.0)
# Wide enough for an uncalibrated MEMS part: data sheets give 3 % and 2 % as bounds of the first
# two (MPU-6050 and LSM6DSO), and a zero error of 20 to 100 mg and 1 to 20 deg/s.
SCALE_PERCENT, MISALIGNMENT_DEG = 2.0, 1.0
BIAS_MG, BIAS_DEG_PER_S, G_SENSITIVITY = 60.0, 5.0, 0.1
# A record that was zeroed at rest has lost gravity with its bias.
ZEROED_G = 1.0
# The range ends at least this factor above the largest reading.
HEADROOM = 1.01
_GROUNDS = (
    "wide enough for a cheap part without a calibration; the noise was found in the record, "
    "the full scale is the next usual one above what it reached"
)


class RangeEnds(NamedTuple):
    """Peak readings of a triad, and the range end where it saturated; SI.

    `peak` is NaN where an axis is missing, `ends` None where no end was found; `samples` were
    saturated. `sensors`: parts of the catalogue with this full scale; where no end was found,
    those whose range includes the peaks.
    """

    peak: tuple[float, ...]
    ends: tuple[float | None, ...]
    samples: int
    sensors: tuple[str, ...]

    @property
    def saturated(self) -> bool:
        """Whether an axis saturated."""
        return any(e is not None for e in self.ends)


def range_ends(part: Part) -> RangeEnds:
    """Find the ends of the range of a triad of accelerations or rates, in SI."""
    has = part.axes
    values = part.values[:, has]
    limits = find_limits(part.time, values, np.full(len(has), np.inf), np.zeros(len(has)))
    peak: list[float] = [math.nan] * 3
    ends: list[float | None] = [None] * 3
    for j, k in enumerate(has):
        peak[k] = float(np.abs(values[:, j]).max())
        if limits.found[j]:
            sizes = [abs(e) for e in (limits.lower[j], limits.upper[j]) if np.isfinite(e)]
            ends[k] = float(max(sizes))
    fits = tuple(
        name
        for name, full in _full_scales(part.kind).items()
        if all(_fits(peak[k], ends[k], full[k]) for k in has)
    )
    samples = int(limits.clipped[:, limits.found].any(axis=1).sum()) if limits.found.any() else 0
    return RangeEnds(tuple(peak), tuple(ends), samples, fits)


def _fits(peak: float, end: float | None, full: float) -> bool:
    return peak <= (1.0 + SAME_END) * full if end is None else abs(end / full - 1.0) <= SAME_END


@cache
def _full_scales(kind: str) -> dict[str, tuple[float, ...]]:
    """Full scales of all sensors of the catalogue with such a triad, SI."""
    found: dict[str, tuple[float, ...]] = {}
    own = "accel" if kind == "acceleration" else "gyro"
    for name in SENSORS:
        sensor = load_sensor(name)
        triad = getattr(sensor.imu_errors, own)
        if triad is not None and any(f.key.startswith(f"{own}.") for f in sensor.sources):
            found[name] = tuple(float(v) for v in triad.axis("full_scale"))
    return found


def error_model(part: Part, ends: RangeEnds, unit: Unit) -> tuple[Mapping[str, float], str]:
    """Error model of a part by keys of the sensor catalogue, and its grounds.

    Without a stated one: noise from the record, the rest assumed.
    """
    if part.uncertainty:
        return part.uncertainty, part.basis
    values = part.values[:, part.axes]
    quiet = quiet_part(values)
    # From differences between samples, which contain no motion.
    moved = np.diff(values[: max(quiet.samples, 3)], axis=0)
    density = float(np.sqrt(np.mean(moved**2) / 2.0) * math.sqrt(part.step))
    known = [e for e in ends.ends if e is not None]
    reached = max([max(p for p in ends.peak if p == p) * HEADROOM, *known])
    shape = {"scale_sd_percent": SCALE_PERCENT, "misalignment_sd_deg": MISALIGNMENT_DEG}
    if part.kind == "rate":
        unit_size = GYRO_UNITS["deg/s"]
        offset = float(np.abs(quiet.mean).max()) / unit_size
        return {
            "noise_density_deg_per_s_per_sqrt_hz": density / unit_size,
            "bias_sd_deg_per_s": max(BIAS_DEG_PER_S, math.ceil(offset)),
            **shape,
            "g_sensitivity_sd_deg_per_s_per_g": G_SENSITIVITY,
            "full_scale_deg_per_s": _next(reached / unit_size, GYRO_SCALES),
        }, f"{_GROUNDS}; it rests at {offset:.2g} deg/s"
    g, offset, told = STANDARD_GRAVITY, 0.0, ""
    if part.zeroed:
        offset = ZEROED_G
        told = "; it was zeroed at rest, so that gravity is in its bias"
    elif part is not unit.accelerometers[0] and len(part.axes) == 3:
        offset = float(np.abs(quiet.mean - unit.impact.base).max()) / g
        told = f"; at rest it is {offset:.2g} g off the finer range, which corrects it"
    return {
        "noise_density_ug_per_sqrt_hz": density / (1e-6 * g),
        "bias_sd_mg": max(BIAS_MG, 100.0 * math.ceil(10.0 * offset)),
        **shape,
        "full_scale_g": _next(reached / g, FULL_SCALES),
    }, _GROUNDS + told


def _next(value: float, usual: tuple[float, ...]) -> float:
    # Of a record that is beyond all numbers, no whole one is next.
    beyond = float(math.ceil(value)) if math.isfinite(value) else value
    return next((u for u in usual if u >= value * (1.0 - 1e-6)), beyond)


# Impact of a unit on its own clock, and its state of rest before.

# Span before the largest pulse that belongs to it, and window for the resting value before that.
BEFORE, REACH = 0.3, 3.0  # s
LEAST_BASE = 5  # samples
# A record that counts from its trigger has the event within this of zero.
AT_ZERO = 0.05  # s
CHANGE_OVER = 0.15  # s
# A pulse without an event begins at this share of its peak, after this time below it.
BEGUN, QUIET = 0.2, 0.02  # s


class Impact(NamedTuple):
    """Impact as measured by accelerometers, on their clock.

    `trigger`, s, is without an event (`found`, by 49 CFR 563) the begin of the largest pulse;
    `at_zero`: the record counts from its trigger; `largest`, m/s: horizontal delta-V of the event,
    without one the largest within 150 ms; `peak`, m/s², of the resultant without gravity; `change`,
    (3,), m/s: over 150 ms in sensor axes; `base`, (3,), m/s²: the resting value; `rest`, s, with
    `grade` ``still``, ``steady`` or empty; `more`: events after the first.
    """

    trigger: float
    trigger_sd: float
    at_zero: bool
    found: bool
    largest: float
    peak: float
    change: Array
    base: Array
    rest: tuple[float, float] | None
    grade: str
    sitting: Sitting | None
    more: int


def find_impact(strong: Part, fine: Part, gyro: Part | None = None) -> Impact:
    """Find the impact and the rest before it, by the highest and lowest range on one clock."""
    time = strong.time
    found = _rest(fine, gyro, _struck(strong))
    rest = None if found is None else (found.start, found.end)
    base, fine_base = _base(strong, rest), _base(fine, rest)
    free = np.nan_to_num(strong.values - base)
    sitting = sitting_at_rest(fine_base) if len(fine.axes) == 3 else None
    level = sitting.into_vehicle(free) if sitting else free
    # With the larger of the two horizontal components first, as the heading is not known yet.
    forward, right = (level[:, :2] ** 2).sum(axis=0)
    level = level if forward >= right else level[:, [1, 0, 2]]
    step = float(np.median(np.diff(time)))
    # Rounded stamps have steps of two lengths.
    lasts = np.gradient(time)[:, None]
    size = np.linalg.norm(free, axis=1)
    peak_at = int(np.argmax(size))
    before = time < time[peak_at] - BEFORE
    noise = free[before].std(axis=0) if before.sum() > LEAST_BASE else np.zeros(3)
    detector = EventDetector(noise=tuple(float(n) for n in noise))
    detector.extend(time, level)
    events = [*detector.events, *([detector.current] if detector.current else [])]
    if events:
        trigger, sd = events[0].time_zero, events[0].time_zero_sd
        during = (time >= trigger) & (time <= events[0].end)
        largest = float(np.linalg.norm((level[:, :2] * lasts)[during].sum(axis=0)))
    else:
        trigger, sd = _onset(time, size, peak_at), math.nan
        largest = detector.largest_change[0]
    # Time zero is not more accurate than the interval in which it is searched allows.
    sd = max(sd if math.isfinite(sd) else 0.0, step, 0.25 * PART_563.wake_window)
    near = abs(trigger) < AT_ZERO or any(c.from_zero for c in strong.velocities)
    at_zero = bool(time[0] - 1.5 * step <= 0.0 <= time[-1] and near)
    after = (time >= trigger) & (time <= trigger + CHANGE_OVER)
    return Impact(
        0.0 if at_zero else trigger,
        step / math.sqrt(12.0) if at_zero else sd,
        at_zero,
        bool(events),
        largest,
        float(np.linalg.norm(free[peak_at])),
        (free * lasts)[after].sum(axis=0),
        fine_base,
        rest,
        "" if found is None else found.grade,
        sitting,
        max(len(events) - 1, 0),
    )


def _onset(time: Array, size: Array, peak_at: int) -> float:
    """Begin of the largest pulse: the last quiet instant before it."""
    above = np.flatnonzero(size[: peak_at + 1] > BEGUN * size[peak_at])
    gaps = np.flatnonzero(np.diff(time[above]) > QUIET)
    first = above[gaps[-1] + 1] if gaps.size else above[0]
    return float(time[max(int(first) - 1, 0)])


def _struck(part: Part) -> float:
    """Time of the largest acceleration minus the duration of a pulse."""
    return float(part.time[int(np.argmax((part.free**2).sum(axis=1)))]) - BEFORE


def _base(part: Part, rest: tuple[float, float] | None) -> Array:
    """Resting value: the mean over the rest, or else before the largest pulse."""
    time, values, has = part.time, part.values, part.axes
    out = np.full(3, np.nan)
    struck = _struck(part)
    windows = [rest] if rest else []
    windows += [(struck - REACH, struck), (float(time[0]), 0.5 * float(time[0] + struck))]
    spans = [(time >= start) & (time <= end) for start, end in windows]
    # A record that begins with the crash: either zeroed, or without a usable rest.
    rows = next((s for s in spans if s.sum() >= LEAST_BASE), slice(0, LEAST_BASE - 2))
    out[has] = 0.0 if part.zeroed else values[rows][:, has].mean(axis=0)
    return out


def _rest(fine: Part, gyro: Part | None, impact: float) -> Any:
    if len(fine.axes) < 3 or fine.zeroed:
        return None
    noise = float(np.sqrt(np.mean(np.diff(fine.values, axis=0) ** 2, axis=0) / 2.0).max())
    rates = np.zeros_like(fine.values)
    if gyro is not None and len(gyro.axes) == 3:
        columns = [np.interp(fine.time, gyro.time, gyro.values[:, k]) for k in range(3)]
        rates = np.column_stack(columns)
    imu = pd.DataFrame(
        np.column_stack([rates, fine.values]),
        index=pd.Index(fine.time, name="time"),
        columns=[*GYRO, *ACCEL],
    )
    return find_pre_crash_rest(imu, impact=impact, accel_noise=noise)


# Roll and pitch of a mounting from gravity at rest; gravity does not observe the heading.

# A housing is bolted along the vehicle's axes; floor, bracket and bias tilt it by less.
MOST_LEAN = 20.0  # deg
# Plausible magnitudes at rest: scale factor and bias of a low-cost sensor.
LEAST_LENGTH, MOST_LENGTH = 0.8, 1.2  # g


class Sitting(NamedTuple):
    """Mounting angles from gravity at rest, as `Mounting.angles_deg` without the heading.

    `along` is the sensor axis that points up, as ``-z`` (empty where none does), `lean_deg` its
    angle to the vertical, `length` that of the specific force, m/s²; zero where the angles are
    stated, and not from gravity.
    """

    roll_deg: float
    pitch_deg: float
    along: str
    lean_deg: float
    length: float

    def into_vehicle(self, vectors: Array, heading_deg: float = 0.0) -> Array:
        """Turn vectors, (n, 3), from sensor into vehicle axes."""
        C_vs = rotation.dcm_from_euler((self.roll_deg, self.pitch_deg, heading_deg))
        return np.asarray(vectors @ C_vs.T)


def sitting_at_rest(force: Array) -> Sitting | None:
    """Find roll and pitch of a mounting from the mean specific force at rest, (3,), m/s².

    None where its magnitude is not that of gravity. An axis within 20° of the vertical is taken to
    be along it. The vehicle's up is in sensor axes ``C_vsᵀ (0, 0, -1) = (sin p, -sin r cos p, -cos
    r cos p)`` whatever the heading; with x along the vertical, roll and heading turn about one
    axis: roll is zero.
    """
    length = float(np.linalg.norm(force))
    if not LEAST_LENGTH <= length / STANDARD_GRAVITY <= MOST_LENGTH:
        return None
    up = force / length
    k = int(np.argmax(np.abs(up)))
    lean = math.degrees(math.acos(min(1.0, float(abs(up[k])))))
    along = ""
    if lean <= MOST_LEAN:
        along = f"{'-' if up[k] < 0.0 else ''}{'xyz'[k]}"
        up = np.where(np.arange(3) == k, np.sign(up), 0.0)
    pitch = math.degrees(math.asin(float(np.clip(up[0], -1.0, 1.0))))
    roll = 0.0 if along.endswith("x") else math.degrees(math.atan2(-up[1], -up[2]))
    if not along:
        roll, pitch = round(roll, 1), round(pitch, 1)
    # -180 deg equals 180 deg.
    return Sitting(180.0 if roll == -180.0 else roll + 0.0, pitch + 0.0, along, lean, length)


# Turn after the impact, and heading of a unit: by its column headings, the impact, other units.

# Span after the impact, and rest of the gyro before it, s.
AFTER, GYRO_REST, GAP = 0.5, 1.0, 0.05
# An eyewitness cannot give the direction of a smaller turn, deg.
LEAST_TURN = 3.0
TURNS = (0.0, 90.0, 180.0, -90.0)
# An axis that leans more than this points up or down, and to no side.
MOST_PITCH = 45.0  # deg
# Two units of a vehicle measure one direction; the next right angle differs by more than this.
SAME_DIRECTION = 30.0  # deg
POINTS = {0.0: "forward", 90.0: "to the right", 180.0: "rearward", -90.0: "to the left"}
SIDES = ("the front", "the right", "the rear", "the left")


def _turning(unit: Unit, part: Part) -> dict[str, Any] | None:
    """Turn about the vertical in the half second after the impact by a gyro, in words."""
    sitting, zero = unit.impact.sitting, unit.impact.trigger
    if part is not unit.gyro or sitting is None or len(part.axes) < 3 or not unit.impact.found:
        return None
    before = (part.time > zero - GYRO_REST) & (part.time < zero - GAP)
    after = (part.time >= zero) & (part.time <= zero + AFTER)
    if not before.any() or after.sum() < 2:
        return None
    rate = sitting.into_vehicle(part.values - np.median(part.values[before], axis=0))[:, 2]
    turn = float(np.degrees(np.trapezoid(rate[after], part.time[after])))
    if abs(turn) < LEAST_TURN:
        return None
    right, left = (f"{abs(turn):.0f} deg to the {side}" for side in ("right", "left"))
    axis = sitting.along.lstrip("-")
    vertical = part.channels.get(axis, "")
    # Yaw, pitch and roll channels may be positive to the left or to the right.
    words = " ".join(part.channels.values()).lower()
    return {
        "so": right if turn > 0.0 else left,
        "other": left if turn > 0.0 else right,
        "yaw": bool(vertical and re.search(r"yaw|gier|pitch|nick", words)),
        "axis": axis,
        "vertical": vertical,
        "reversed": vertical[1:] if vertical.startswith("-") else f"-{vertical}",
        "asked": inline({**part.channels, axis: "?"}),
    }


def _face(units: Sequence[Unit]) -> list[Unit]:
    """Find the heading of each unit's mounting, of the four right angles."""
    out = [_as_stated(_own_heading(unit)) for unit in units]
    first = next((u for u in out if u.heading_deg is not None), None)
    if first is None or first.heading_deg is None:
        return [_like(unit, None, "") for unit in out]
    goal = direction(first, first.heading_deg)
    return [_like(unit, goal, first.name) for unit in out]


def direction(unit: Unit, heading_deg: float) -> float | None:
    """Direction of the force, deg, at this heading of the unit; None without acceleration."""
    sitting = unit.impact.sitting
    change = np.nan_to_num(unit.impact.change)
    # Without gravity in the record, as if its z pointed down.
    level = sitting or Sitting(0.0, 0.0, "", 0.0, 0.0)
    change = level.into_vehicle(change[None, :], heading_deg)[0]
    # Where the unit of the values is asked, the size of a blow is not known, but its direction is.
    blow = unit.impact.found or not unit.strong.unit
    if not blow or np.hypot(*change[:2]) == 0.0:
        return None
    return float(pdof((change[0], change[1], 0.0)).horizontal_deg)


def side_of(came: float) -> str:
    """Name the side that the force came from, by its direction in deg."""
    return SIDES[round(came / 90.0) % 4]


def _own_heading(unit: Unit) -> Unit:
    """Heading of a unit whose record defines its axes as the vehicle's; none of another."""
    sitting, grounds = unit.impact.sitting, [p.of_vehicle for p in unit.accelerometers]
    if not all(grounds) or not (sitting is None or sitting.along.endswith("z")):
        return unit
    return replace(unit, heading_deg=0.0, heading_why=f"found: {grounds[0]}")


def stated_mounting(text: str) -> Array:
    """Return ``C_vs``, (3, 3), of stated axes; of left-handed ones the third channel is reversed.

    `text`: as `parse_axes`.
    """
    axis, sign = parse_axes(text)
    C_vs = axes_matrix(axis, sign)
    return np.asarray(C_vs * np.array([1.0, 1.0, -1.0 if mirrored(axis, sign) else 1.0]))


def _as_stated(unit: Unit) -> Unit:
    """Mounting by the axes that a person states: the heading, and roll and pitch without gravity.

    With roll and pitch ``C`` by gravity, the heading is that of the rotation ``R_z(h) C`` nearest
    to the stated ``M``, for which ``trace(Mᵀ R_z(h) C)`` is largest. Axes that gravity contradicts
    are not used.
    """
    text, sitting = unit.axes_stated, unit.impact.sitting
    if not text:
        return unit
    if unit.axes_contradicted:
        return replace(unit, heading_deg=None, heading_why="")
    why, stated = f"stated: {text}", stated_mounting(text)
    if sitting is None:
        roll, pitch, heading = within_half_turn(rotation.euler_from_dcm(stated)) + 0.0
        impact = unit.impact._replace(sitting=Sitting(roll, pitch, "", 0.0, 0.0))
        return replace(unit, heading_deg=float(heading), heading_why=why, impact=impact)
    level = rotation.dcm_from_euler((sitting.roll_deg, sitting.pitch_deg, 0.0))
    turn = level @ stated.T
    heading = math.degrees(math.atan2(turn[0, 1] - turn[1, 0], turn[0, 0] + turn[1, 1]))
    return replace(unit, heading_deg=round(heading, 1) + 0.0, heading_why=why)


def _like(unit: Unit, goal: float | None, name: str) -> Unit:
    """With the right angle that agrees with another unit, or else the meaning of each."""
    if unit.heading_deg is not None:
        return unit
    sitting = unit.impact.sitting
    came = {turn: at for turn in TURNS if (at := direction(unit, turn)) is not None}
    if goal is not None and sitting is not None and came:
        off = {t: abs(float(within_half_turn(np.array([at - goal]))[0])) for t, at in came.items()}
        best = min(off, key=lambda t: off[t])
        if off[best] <= SAME_DIRECTION:
            why = f"with it the impact comes from where '{name}' has it, within {off[best]:.0f} deg"
            return replace(unit, heading_deg=best, heading_why=f"assumed: {why}")
    # Where x is vertical, it points to no side.
    shown = sitting is not None and abs(sitting.pitch_deg) <= MOST_PITCH
    told = [
        f"{turn:g}{f' (its x points {POINTS[turn]})' if shown else ''} makes it an impact from "
        f"{side_of(at)}"
        for turn, at in came.items()
    ]
    if sitting is None and told:
        told[0] = f"gravity is not in it; if its z points down, a heading of {told[0]}"
    return replace(unit, heading_why=", ".join(told) or "not in the record")

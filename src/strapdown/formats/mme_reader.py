"""Tests in ISO MME (ISO/TS 13499) as crash records: folder, header, index, channel files."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from decimal import Decimal
from pathlib import Path
from typing import Any

import numpy as np

from strapdown.errors import DataError, Finding, add_note, add_warning
from strapdown.formats.crash_record import (
    CHANGE_NOTE,
    DEFORMS,
    LONGEST_NAME,
    CrashChannel,
    CrashRecord,
    clean,
    compact,
    header_of,
    position_of,
    unique,
)
from strapdown.formats.mme_codes import DIMENSIONS, DUMMIES, NO_CLASS, MmeCode, decode_mme
from strapdown.formats.text_columns import decoded
from strapdown.tables import SAMPLINGS
from strapdown.tables.checks import Array
from strapdown.units import FACTORS, OF_CRASHES, TIME_UNITS, find_unit

MOST_FILES = 20_000
_NUMBERED = re.compile(r"\.(\d{3,4})$")
_LISTED = re.compile(r"name of channel (\d+)")
_TITLES = ("title", "type of the test", "laboratory test ref. number", "test name")


def read(path: Path) -> CrashRecord:
    """Read a test; samples are read when a channel is used.

    `path`: the ``.mme`` file, or the folder that holds it.
    """
    head = header_of(path, ".mme", "io.folder-holds-tests", "io.no-mme-file")
    header = read_header(head)
    findings: list[Finding] = []
    index, listed = _index(head, findings)
    numbered = _numbered(head, findings)
    absent = [n for n in listed if n not in numbered]
    if absent:
        shown = ", ".join(f"{n:03d}" for n in absent[:12]) + (" …" if len(absent) > 12 else "")
        add_note(
            findings,
            "io.listed-channels-not-folder",
            file=index.name if index else head.name,
            quantity="channels",
            count=len(absent),
            count_2=len(listed),
            value_shown=shown,
        )
    if not numbered:
        raise DataError("io.test-no-channel-files", file=head.name, quantity="channels")
    files = [read_mme_file(p, listed.get(n, "")) for n, p in sorted(numbered.items())]
    names = unique([f.code or f.path.name for f in files])
    others = {
        f.code.upper(): (n, f) for n, f in reversed(list(zip(names, files, strict=True))) if f.code
    }
    vehicles = _vehicles(header, findings)
    numbers = _numbers(files, header)
    places = _places(files)
    findings += [f for file in files for f in _told(file, listed)]
    return CrashRecord(
        path=path,
        format="mme",
        title=next((t for k in _TITLES if (t := header.text(k))), clean(head.stem)),
        facts=_facts(header),
        channels=tuple(
            replace(channel_of(f, n, others), vehicle=number, place=place)
            for n, f, number, place in zip(names, files, numbers, places, strict=True)
        ),
        files=(head, *([index] if index else []), *(f.path for f in files)),
        findings=tuple(findings),
        vehicles=vehicles,
    )


def _folders(head: Path) -> list[Path]:
    """List the folders that may hold channels: Channel, and that of the header."""
    beside = head.parent
    named = sorted(p for p in beside.iterdir() if p.name.lower() == "channel" and p.is_dir())
    return [*named, beside]


def _inside(path: Path, head: Path) -> bool:
    """Whether a file is in the folder of the test, not linked from elsewhere."""
    return path.resolve().is_relative_to(head.parent.resolve())


def _left_out(path: Path) -> Finding:
    return Finding("io.left-out-link-file-outside", file=clean(path.name, LONGEST_NAME))


def _index(head: Path, findings: list[Finding]) -> tuple[Path | None, dict[int, str]]:
    """Read the channel index: its path, and the code of each channel number."""
    found = [
        p
        for folder in _folders(head)
        for p in sorted(folder.iterdir())
        if p.suffix.lower() == ".chn" and p.is_file()
    ]
    same = [p for p in found if p.stem.lower() == head.stem.lower()] or found
    if not same:
        add_note(findings, "io.no-index-channels-chn-files", file=head.name, quantity="channels")
        return None, {}
    index = same[0]
    if not _inside(index, head):
        findings.append(_left_out(index))
        return None, {}
    header = read_header(index)
    listed = {
        int(m[1]): clean(value.split("/")[0], LONGEST_NAME)
        for key, (value, _) in header.values.items()
        if (m := _LISTED.fullmatch(key)) and len(m[1]) <= 5
    }
    promised = header.number("number of channels")
    if promised is not None and promised != len(listed):
        add_warning(
            findings,
            "io.promises-channels-lists",
            file=index.name,
            row=header.line("number of channels"),
            quantity="number of channels",
            promised=promised,
            count=len(listed),
        )
    return index, listed


def _numbered(head: Path, findings: list[Finding]) -> dict[int, Path]:
    """Find the channel files by their number."""
    for folder in _folders(head):
        found = [p for p in sorted(folder.iterdir()) if _NUMBERED.search(p.name) and p.is_file()]
        same = [p for p in found if p.stem.lower() == head.stem.lower()]
        stems = sorted({p.stem for p in found})
        tests = {p.stem.lower() for p in head.parent.iterdir() if p.suffix.lower() == ".mme"}
        if not same and (len(stems) > 1 or any(s.lower() in tests for s in stems)):
            shown = ", ".join(clean(s, 40) for s in stems[:6])
            raise DataError(
                "io.channels-other-tests-none-name",
                file=head.name,
                quantity="channels",
                value_shown=shown,
            )
        kept: dict[int, Path] = {}
        for path in (same or found)[:MOST_FILES]:
            if not _inside(path, head):
                findings.append(_left_out(path))
                continue
            kept.setdefault(int(path.suffix[1:]), path)
        if kept:
            return kept
    return {}


_OF_OBJECT = re.compile(r"(.*?\S)(?: of)? test object (\d+)")
# Keys of the header about a test object, in SI units, as `CrashRecord.vehicles` names them.
_SI_OF = {"mass": ("", "kg"), "velocity": ("", "m/s")}
_SPOKEN = {"name": "vehicle", "mass": "mass_kg", "velocity": "speed_m_per_s"}


def _facts(header: MmeHeader) -> dict[str, str]:
    facts = {
        clean(key, LONGEST_NAME): header.text(key)
        for key in header.values
        if not _OF_OBJECT.fullmatch(key)
    }
    spoken = {
        "test": "laboratory test ref. number",
        "date": "date of the test",
        "laboratory": "laboratory name",
    }
    facts |= {name: header.text(key) for name, key in spoken.items()}
    return {k: v for k, v in facts.items() if v}


def _vehicles(header: MmeHeader, findings: list[Finding]) -> dict[str, dict[str, str]]:
    """Facts of each test object, by its number."""
    vehicles: dict[str, dict[str, str]] = {}
    for key in header.values:
        match = _OF_OBJECT.fullmatch(key)
        if not match or not header.text(key):
            continue
        facts = vehicles.setdefault(clean(match[2].lstrip("0"), LONGEST_NAME), {})
        name = _SPOKEN.get(match[1], clean(match[1], LONGEST_NAME))
        if match[1] not in ("mass", "velocity"):
            facts[name] = header.text(key)
            continue
        try:
            facts[name] = f"{_in_si(header, key):.10g}"
        except DataError as error:
            # Unusable data of the vehicle only affects the report: keep the record.
            fault = error.finding
            add_warning(
                findings,
                "io.left-out-unusable",
                file=fault.file,
                row=fault.row,
                quantity=fault.quantity,
                reason=fault,
            )
    return vehicles


def _in_si(header: MmeHeader, key: str) -> float:
    """Return a mass or velocity of the header, which is in SI units if it states none."""
    value, text = header.number(key), header.text(key).partition(" ")[2].strip().lower()
    unit = find_unit(text, ("velocity",)) if text and key.startswith("velocity") else None
    factor = FACTORS[unit[0]][unit[1]] if unit else 1.0 if text in _SI_OF[key.split()[0]] else None
    if value is None or factor is None:
        raise header.fault("io.no-number", key, text=header.text(key)[:60])
    return value * factor


def _numbers(files: list[MmeFile], header: MmeHeader) -> list[str]:
    """Number of the test object of each channel; empty without one that moves.

    Codes have a letter for a mobile barrier, sled or impactor. Its number is that of the header of
    its channels, or the only one that the test has and no other object takes.
    """
    objects = [f.known.vehicle if f.known else "" for f in files]
    stated = _plain_number(header, "number of test objects") or 0.0
    free = {str(k) for k in range(1, int(min(stated, 9.0)) + 1)} - set(objects)
    # A fixed barrier, component or test rig may be the object that is left.
    alone = len(free) == len({o for o in objects if o.isalpha()}) == 1
    alone = alone and not any(f.known and f.known.code[0] in "BCT" for f in files)
    numbers = {o: o for o in objects}
    for letter in (o for o in numbers if o.isalpha()):
        of_letter = (f for f, o in zip(files, objects, strict=True) if o == letter)
        own = {f.header.text("test object number") for f in of_letter}
        number = own.pop() if len(own) == 1 else ""
        if number.isdecimal() and number not in (*objects, *numbers.values()):
            numbers[letter] = number
        elif alone:
            numbers[letter] = free.pop()
    noted = (_note(f.header.all("comments"), VEHICLE_NOTE) for f in files)
    return [
        "" if note == NO_VEHICLE else note or numbers[o]
        for note, o in zip(noted, objects, strict=True)
    ]


def _places(files: list[MmeFile]) -> list[str]:
    """Position of each channel: its own name where that is of one point only, else by its code."""
    names = [position_of(f.header.text("name of the channel")) for f in files]
    points: dict[str, set[str]] = {}
    for file, name in zip(files, names, strict=True):
        points.setdefault(compact(name), set()).add(file.code[:1] + _point(file))
    out = []
    for file, name in zip(files, names, strict=True):
        noted = _note(file.header.all("comments"), PLACE_NOTE)
        words = any(len(w) > 2 and w.isalpha() for w in re.split(r"[\W_]+", name))
        own = words and len(points[compact(name)]) == 1 and compact(name) not in _NO_NAME
        known = file.known.place if file.known else ""
        out.append(noted or (name if own or not known else known))
    return out


def _point(file: MmeFile) -> str:
    noted = _note(file.header.all("comments"), POINT_NOTE)
    return noted or (file.known.point if file.known else "")


def _told(file: MmeFile, listed: dict[int, str]) -> list[Finding]:
    told: list[Finding] = []
    name = clean(file.path.name, LONGEST_NAME)
    number = int(file.path.suffix[1:])
    if file.known is None:
        add_warning(
            told,
            "io.channel-code-malformed" if file.code else "io.channel-code-missing",
            file=name,
            row=file.header.line("channel code"),
            quantity="channel code",
            word=file.code,
        )
    elif (
        not file.known.listed
        and file.known.body == "vehicle"
        and (file.known.quantity in ("acceleration", "rate"))
    ):
        add_note(
            told,
            "io.location-code-unknown",
            file=name,
            row=file.header.line("channel code"),
            quantity=f"channel {file.code}",
            word=file.code[2:6],
        )
    if is_bad(file):
        add_warning(
            told,
            "io.laboratory-gives-status",
            file=name,
            row=file.header.line("data status"),
            quantity=f"channel {file.code or name}",
            text=file.header.text("data status"),
        )
    indexed = listed.get(number, "")
    if indexed and file.code and indexed.upper() != file.code.upper():
        add_warning(
            told,
            "io.index-file-says-taken",
            file=name,
            row=file.header.line("channel code"),
            quantity="channel code",
            indexed=indexed,
            word=file.code,
        )
    return told


# Channel files of ISO MME: header with the channel code, samples and stamps.


@dataclass(frozen=True, eq=False)
class MmeFile:
    """One channel file.

    `code`: as given in the file or the index; empty if neither has one. `known`: the decoded code,
    if valid.
    """

    path: Path
    header: MmeHeader
    code: str
    known: MmeCode | None


def read_mme_file(path: Path, indexed: str) -> MmeFile:
    """Read the header of a channel file.

    `indexed`: code from the index; empty if the index lacks it.
    """
    header = read_header(path)
    code = header.text("channel code") or indexed
    return MmeFile(path, header, clean(code, LONGEST_NAME), decode_mme(code))


def clock_of(file: MmeFile, others: Mapping[str, tuple[str, MmeFile]]) -> str:
    """Return the code of the channel that holds the stamps; empty if they are even.

    DataError: the test does not have that channel, or the header does not name it.
    """
    kind = file.header.text("reference channel").lower()
    named = file.header.text("reference channel name")
    if kind == "implicit" or (not kind and not named) or file.code[2:6].upper() == "TIRS":
        return ""
    if not kind and file.header.text("sampling interval"):
        return ""
    code = named.split("/")[0].strip()
    if code.upper() not in others:
        raise DataError(
            "io.stamps-those-channel-test-does" if code else "io.stamps-those-another-channel-not",
            file=file.path.name,
            row=file.header.line("reference channel name") or file.header.line("reference channel"),
            quantity="reference channel name",
            word=code,
        )
    return code


def stamps_of(
    file: MmeFile, clock: str, others: Mapping[str, tuple[str, MmeFile]]
) -> Callable[[int], Array]:
    """Read that many stamps, from a channel of stamps or from the header."""
    header = file.header
    if clock:
        held = others[clock.upper()][1]

        def recorded(count: int) -> Array:
            text = held.header.text("unit")
            unit = find_unit(text, OF_CRASHES) if text else ("time", "s")
            if unit is None or unit[0] != "time":
                raise held.header.fault("io.holds-stamps-unit", "unit", text=text[:40])
            stamps = read_samples(held.path, held.header, f"channel {clock}")
            if stamps.size != count:
                raise DataError(
                    "io.samples-stamps",
                    file=file.path.name,
                    quantity="number of samples",
                    count=count,
                    name=held.path.name,
                    size=stamps.size,
                )
            bad = np.flatnonzero(~(np.diff(stamps) > 0.0))
            if bad.size or not np.isfinite(stamps[:1]).all():
                k = int(bad[0]) + 1 if bad.size else 0
                raise DataError(
                    "io.time-goes-2",
                    file=held.path.name,
                    row=held.header.end + k + 1,
                    quantity="time",
                    stamps=stamps[k - 1],
                    stamps_2=stamps[k],
                )
            return stamps * TIME_UNITS[unit[1]]

        return recorded

    def even(count: int) -> Array:
        interval = header.number("sampling interval")
        if interval is None or not interval > 0.0:
            raise header.fault(
                "io.sampling-interval-not-stated"
                if interval is None
                else "io.sampling-interval-none",
                "sampling interval",
                interval=interval,
            )
        first = "0"
        if header.number("time of first sample") is not None:
            first = header.text("time of first sample").split()[0]
        return even_stamps(first, header.text("sampling interval").split()[0], count)

    return even


#: Prefixes of comments in which our writer states data that the standard has no field for.
SAMPLING_NOTE = "sampling "
AXIS_NOTE = "axis "
BODY_NOTE = "fixed to "
VEHICLE_NOTE = "of test object "
NO_VEHICLE = "none"
POINT_NOTE = "measuring point "
PLACE_NOTE = "position "
FILTER_NOTE = "low-pass "
AXES = ("x", "y", "z", "-x", "-y", "-z")
# Names of channels that name nothing.
_NO_NAME = ("nocomment", "nocomments", "none", "notapplicable", "notavailable", "unknown")
_GOOD = ("ok", "o.k.", "good", "valid", "as measured")
_REMARKS = (
    "location",
    "reference system",
    "transducer type",
    "transducer id",
    "pre-filter type",
    "data source",
    "laboratory channel code",
    "customer channel code",
)


def channel_of(file: MmeFile, name: str, others: Mapping[str, tuple[str, MmeFile]]) -> CrashChannel:
    """Make a channel of a crash record from a channel file.

    `name`: unique in the record. `others`: channels of the test by their code in capitals, each
    with its name; one may hold the stamps of another. DataError: a field of the header is not a
    number.
    """
    header, known = file.header, file.known
    text = header.text("unit")
    quantity, unit, factor, against = _unit(file, text)
    notes = header.all("comments")
    change = CHANGE_NOTE in notes
    clock = clock_of(file, others)
    read_stamps = stamps_of(file, clock, others)

    def samples() -> Array:
        values = read_samples(file.path, header, f"channel {name}")
        if quantity == "velocity" and not change and values.size:
            values = values - values[0]
        return values if factor is None else values * factor

    def load() -> tuple[Array, Array]:
        values = samples()
        return values if quantity == "time" else read_stamps(values.size), values

    # Stamps that the header lacks may be stated in a case.
    open_stamps = (
        bool(clock) or quantity == "time" or _plain_number(header, "sampling interval") is None
    )
    full_scale = _plain_number(header, "channel amplitude class")
    cut_off = _plain_number(header, "cut off frequency")
    return CrashChannel(
        name=name,
        quantity=quantity,
        axis=_note(notes, AXIS_NOTE, AXES) or (known.axis if known else ""),
        unit=unit,
        load=load,
        sampling=_note(notes, SAMPLING_NOTE, SAMPLINGS)
        or ("instantaneous" if quantity in ("acceleration", "rate") else None),
        body=_note(notes, BODY_NOTE) or (known.body if known else "not known"),
        point=_point(file),
        low_pass=_note(notes, FILTER_NOTE) or _low_pass(file, cut_off),
        remarks=_remarks(file, against, notes),
        full_scale=None if full_scale is None else full_scale * (factor or 1.0),
        bandwidth=cut_off if cut_off is not None and cut_off > 0.0 else None,
        file=file.path.name,
        row=lambda k: header.end + k + 1,
        clock=others[clock.upper()][0] if clock else "",
        samples=samples if open_stamps else None,
        from_zero=change and quantity == "velocity",
        # Fine location 3; that of a part of the structure is not a dummy's.
        dummy=known.code[10:12] if known and known.code[10:12] in DUMMIES else "",
    )


def _unit(file: MmeFile, text: str) -> tuple[str, str, float | None, str]:
    """Return quantity, unit, factor, and the part of the code that contradicts the unit."""
    said = file.known.quantity if file.known else "other"
    found = find_unit(text, OF_CRASHES) if text else None
    if found is None:
        # Without a known unit the values are as recorded.
        return said, clean(text, LONGEST_NAME), None, ""
    quantity, unit = found
    if said in ("other", quantity):
        # A dimension that is known but not among ours, such as an angle, is not converted.
        plain = file.known is not None and file.code[12:14].upper() in DIMENSIONS
        if said == "other" and plain and file.code[12:14] != "00":
            return "other", unit, None, ""
        return quantity, unit, FACTORS.get(quantity, {}).get(unit), ""
    against = f"its code says {said}, and its unit is one of {quantity}"
    return quantity, unit, FACTORS.get(quantity, {}).get(unit), against


def _note(notes: list[str], key: str, known: tuple[str, ...] = ()) -> str:
    said = next((n[len(key) :] for n in notes if n.startswith(key)), "")
    return said if not known or said in known else ""


def _plain_number(header: MmeHeader, key: str) -> float | None:
    """Return a number of the header whose field may also hold a word."""
    try:
        return header.number(key)
    except DataError:
        return None


def _low_pass(file: MmeFile, cut_off: float | None) -> str:
    parts = []
    stated = file.header.text("channel frequency class")
    if file.known and file.known.code[-1] != NO_CLASS:
        parts.append(file.known.filter)
    elif stated and file.known is None:
        parts.append(stated if not stated.isdecimal() else f"CFC {stated}")
    if cut_off is not None and cut_off > 0.0:
        parts.append(f"{cut_off:g} Hz before the sampler")
    return "; ".join(parts)


def _remarks(file: MmeFile, against: str, notes: list[str]) -> tuple[str, ...]:
    header, known = file.header, file.known
    remarks = [against] if against else []
    if known is None:
        remarks.append(
            f"'{file.code}' is not a channel code of sixteen characters"
            if file.code
            else "it has no channel code"
        )
    else:
        remarks.append(f"{known.test_object}, {known.dimension}, {known.direction}")
        if known.redundant:
            remarks.append("redundant")
        if known.deforms:
            remarks.append(DEFORMS[known.deforms])
        if header.text("name of the channel") and known.place:
            remarks.append(f"place by its code: {known.place}")
        if known.unknown:
            remarks.append(f"not in the tables of codes: {', '.join(known.unknown)}")
        stated = header.text("channel frequency class")
        figures = "".join(c for c in stated if c.isdigit())
        if figures and known.filter.startswith("CFC") and figures not in known.filter.split():
            remarks.append(f"its header says {stated}, and its code {known.filter}")
    if status := header.text("data status"):
        remarks.append(f"status {status}")
    remarks += [f"{key}: {header.text(key)}" for key in _REMARKS if header.text(key)]
    own = (SAMPLING_NOTE, AXIS_NOTE, BODY_NOTE, FILTER_NOTE, VEHICLE_NOTE, POINT_NOTE, PLACE_NOTE)
    remarks += [n for n in notes if not n.startswith(own)]
    return tuple(remarks)


def is_bad(file: MmeFile) -> bool:
    """Whether the laboratory states a status other than good."""
    status = file.header.text("data status").lower()
    return bool(status) and status not in _GOOD


# Text files of ISO MME: lines of ``key :value``, followed by samples.


# Limits: headers have some thousand characters, samples some ten each.
LONGEST_HEADER = 262_144
LARGEST = 1_000_000_000
# Limits of powers of ten and integers that doubles hold exactly.
EXACT_POWER = 22
EXACT_WHOLE = 2**53
_KEY = re.compile(r"([^:]*[^:\s])\s*:(.*)")
_NUMBER = re.compile(r"[+-]?(\d+([.,]\d*)?|[.,]\d+)([eEdD][+-]?\d+)?")
_UNUSUAL = re.compile(r"[^0-9eE+\-. \t\n]")
_MISSING = ("novalue", "nan")


@dataclass(frozen=True)
class MmeHeader:
    """Lines of a header.

    `file`: for messages. `values`: key in lower case with single blanks to its value and line; the
    first of repeated keys. `more`: all values of each key. `end`: number of lines before the
    samples.
    """

    file: str
    values: dict[str, tuple[str, int]]
    more: dict[str, list[str]]
    end: int

    def text(self, key: str) -> str:
        """Return the value of a key on one line; empty if not stated."""
        value = self.values.get(key, ("", 0))[0]
        return "" if value.lower() in ("novalue", "none", "-") else clean(value)

    def all(self, key: str) -> list[str]:
        """Return each stated value of a key."""
        texts = [clean(v) for v in self.more.get(key, [])]
        return [t for t in texts if t and t.lower() not in ("novalue", "none", "-")]

    def line(self, key: str) -> int | None:
        """Return the line number of a key."""
        return self.values[key][1] if key in self.values else None

    def fault(self, code: str, key: str, **data: Any) -> DataError:
        """Make the error for the value of a key."""
        return DataError(code, file=self.file, row=self.line(key), quantity=key, **data)

    def number(self, key: str) -> float | None:
        """Return the value of a key as a number, with or without a unit after it.

        DataError: the value is not a number.
        """
        text = self.text(key)
        if not text:
            return None
        value = read_number(text.split()[0])
        if value is None or not np.isfinite(value):
            raise self.fault("io.no-number", key, text=text[:60])
        return value


def text_of(path: Path, longest: int = LARGEST) -> str:
    """Read a text file of the test, in UTF-8 or Windows-1252.

    DataError: the file is not text, or far too large.
    """
    if path.stat().st_size > LARGEST:
        raise DataError("io.bytes-more-than-channel", file=path.name, st_size=path.stat().st_size)
    with path.open("rb") as stream:
        data = stream.read(longest)
    if len(data) == longest:
        data = data[: data.rfind(b"\n") + 1]
    text = decoded(data, path.name)[0]
    if "\0" in text:
        raise DataError("io.mme-with-zero-bytes", file=path.name)
    return text


def read_header(path: Path) -> MmeHeader:
    """Read the header of a file of the test.

    DataError: the file is empty, not text, or a line is neither ``key :value`` nor the first
    sample.
    """
    values: dict[str, tuple[str, int]] = {}
    more: dict[str, list[str]] = {}
    end = 0
    for row, line in enumerate(_lines(text_of(path, LONGEST_HEADER)), start=1):
        text = line.strip()
        if not text:
            continue
        if is_sample(text):
            end = row - 1
            break
        end = row
        match = _KEY.fullmatch(text)
        if match is None:
            raise DataError(
                "io.mme-line-not-understood", file=path.name, row=row, clean=clean(text, 60)
            )
        key = " ".join(match[1].lower().split())
        values.setdefault(key, (match[2].strip(), row))
        more.setdefault(key, []).append(match[2].strip())
    if not values:
        raise DataError(
            "io.no-header" if end == 0 and path.stat().st_size else "io.file-empty-3",
            file=path.name,
            row=1,
        )
    return MmeHeader(path.name, values, more, end)


def is_sample(text: str) -> bool:
    """Whether a line is a sample, not `key :value`."""
    return bool(_NUMBER.fullmatch(text)) or text.lower() in _MISSING


def read_number(text: str) -> float | None:
    """Read a number, with a point or a comma."""
    if not _NUMBER.fullmatch(text):
        return None
    return float(text.replace(",", ".").replace("d", "e").replace("D", "e"))


def read_samples(path: Path, header: MmeHeader, quantity: str) -> Array:
    """Read the samples of a channel, one per line; NaN for NOVALUE; (n,).

    `header`: header of that file. `quantity`: for messages. DataError: a line is not a number, or
    the number of samples differs from the header.
    """
    lines = _lines(text_of(path))[header.end :]
    while lines and not lines[-1].strip():
        lines.pop()
    promised = header.number("number of samples")
    if promised is not None and promised != len(lines):
        cut = len(lines) < promised
        raise DataError(
            "io.samples-header-says" if cut else "io.samples-header-says-2",
            file=path.name,
            row=header.end + (len(lines) if cut else int(promised) + 1),
            quantity=quantity,
            count=len(lines),
            promised=promised,
        )
    if not lines:
        raise DataError(
            "io.header-no-samples-under", file=path.name, row=header.end, quantity=quantity
        )
    if not _UNUSUAL.search("\n".join(lines)):
        # Most files use decimal points and have no missing samples.
        try:
            return np.array(lines, dtype=np.float64)
        except ValueError:
            pass
    out = np.empty(len(lines))
    for k, line in enumerate(lines):
        text = line.strip()
        value = float("nan") if text.lower() in _MISSING else read_number(text)
        if value is None:
            raise DataError(
                "io.no-number-2",
                file=path.name,
                row=header.end + k + 1,
                quantity=quantity,
                clean=clean(text, 60),
            )
        out[k] = value
    return out


def even_stamps(first: str, interval: str, count: int) -> Array:
    """Compute stamps of even sampling, each the double nearest to the decimal number.

    `first`, `interval`: decimal numbers, s, as in the header. Returns (count,), s, if the decimals
    are integers below 2^53 divided by a power of ten up to 10^22, both of which doubles hold
    exactly, the quotient is rounded once (IEEE 754). A sum of doubles would be off in the last
    digit: -0.0499 would not be reproduced.
    """
    start, step = _decimal(first), _decimal(interval)
    k = np.arange(count, dtype=np.int64)
    places = max(0, *(-int(d.as_tuple().exponent) for d in (start, step)))
    if places <= EXACT_POWER:
        scale = 10**places
        a, b = int(start * scale), int(step * scale)
        if abs(a) + abs(b) * count < EXACT_WHOLE:
            whole = (a + b * k).astype(np.float64)
            return np.asarray(whole / float(scale), dtype=np.float64)
    return np.asarray(float(start) + float(step) * k, dtype=np.float64)


def _decimal(text: str) -> Decimal:
    return Decimal(text.replace(",", ".").lower().replace("d", "e"))


def _lines(text: str) -> list[str]:
    # Not splitlines: it would split at characters that occur in comments.
    return text.replace("\r\n", "\n").replace("\r", "\n").split("\n")

"""Tables of columns as crash records: text tables of any layout, and other logs."""

from __future__ import annotations

import csv as quoting
import io
import json
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import DataError, Finding, add_note, add_warning
from strapdown.formats import csv
from strapdown.formats.arrays import day_nanoseconds, numbers, ticks_of
from strapdown.formats.columns import read_name
from strapdown.formats.crash_record import (
    CHANGE_NOTE,
    LONGEST_NAME,
    QUANTITIES,
    CrashChannel,
    CrashRecord,
    attributes_of,
    check_attributes,
    clean,
    unique,
)
from strapdown.formats.crash_samples import ONE_STEP, Clock, seconds_of
from strapdown.formats.recording import RawLog
from strapdown.formats.text_columns import decoded, is_comment
from strapdown.formats.vocabularies import CRASHES
from strapdown.units import FACTORS, OF_CRASHES, find_unit

Array = NDArray[np.float64]
T = TypeVar("T")

# Fraction of numeric fields from which on a column of text is a damaged column of numbers.
MOSTLY = 0.5
# Relative evenness of the steps of an unnamed column, to be taken for a clock.
EVEN = 0.01
# Limit of a velocity change in its first step, relative to its maximum; a step of 10 ms in a crash
# of 50 ms gains less.
SMALL = 0.2
_OF_TRIAD = {"gyro": "rate", "accel": "acceleration", "mag": "other"}


@dataclass(frozen=True)
class ChannelName:
    """Content of a column name.

    `quantity`: a key of `crash_record.QUANTITIES`. `axis`: ``x y z``, with a minus if the name
    states it, or empty. `unit`: in the spelling of this package, as in the name if unknown, or
    empty. `change`: for a velocity: the name states a change since time zero. `contradiction`: part
    of the name that contradicts the unit, or empty.
    """

    quantity: str
    axis: str = ""
    unit: str = ""
    change: bool = False
    contradiction: str = ""


def read(path: Path) -> CrashRecord:
    """Read a text table.

    One channel for each numeric column, under its name.
    """
    raw, notes, title, remarks = read_text_table(path)
    return record_of(raw, path, "csv", notes=notes, title=title, remarks=remarks)


def record_of(
    raw: RawLog,
    path: Path,
    form: str,
    *,
    notes: Mapping[str, Mapping[str, Any]] | None = None,
    title: str = "",
    remarks: tuple[str, ...] = (),
) -> CrashRecord:
    """Make a record from the columns of a log.

    `form`: key of the format. `notes`: metadata of columns stated in the file, as from
    `attributes_of`. `remarks`: lines above the table. DataError: no column is numeric.
    """
    findings = list(raw.findings)
    kept: list[str] = []
    texts: list[str] = []
    for source in raw.columns:
        (kept if _is_numeric(raw, source) else texts).append(source)
    if texts:
        shown = ", ".join(clean(t, 40) for t in texts[:6]) + (" …" if len(texts) > 6 else "")
        add_note(findings, "io.columns-text-left-out", file=raw.name, value_shown=shown)
    if not kept:
        raise raw.fault("io.no-numeric-column")
    notes = notes or {}
    names = unique(
        [
            (s in notes and notes[s]["name"]) or clean(s, LONGEST_NAME) or f"column {k + 1}"
            for k, s in enumerate(kept)
        ]
    )
    said = {s: _noted(notes[s]) if s in notes else _said(raw, s) for s in kept}
    spelled = dict(zip(kept, names, strict=True))
    clock = _clock(raw, said, spelled, findings)
    if clock and said[clock].quantity != "time":
        said[clock] = ChannelName("time")
    channels = tuple(
        _with_notes(
            _channel(raw, source, name, said, clock, spelled.get(clock, "")), notes.get(source)
        )
        for source, name in spelled.items()
    )
    return CrashRecord(
        path=path,
        format=form,
        title=clean(title) or clean(path.stem),
        facts={},
        channels=channels,
        files=raw.files,
        findings=tuple(findings),
        remarks=remarks,
    )


def _is_numeric(raw: RawLog, source: str) -> bool:
    values = raw.columns[source]
    if values.dtype.kind in "iufbM":
        return True
    import pandas as pd

    texts = pd.Series(values).dropna()
    if texts.empty:
        return False
    if ":" in str(texts.iloc[0]) and str(texts.iloc[0])[:4].isdecimal():
        return True
    found = pd.to_numeric(texts, errors="coerce").notna().mean()
    return bool(found >= MOSTLY)


def _said(raw: RawLog, source: str) -> ChannelName:
    if source in raw.stated:
        quantity, unit = raw.stated[source]
        triad, _, axis = quantity.partition("_")
        if quantity == "time":
            return ChannelName("time", "", unit or "")
        if triad in _OF_TRIAD:
            return ChannelName(_OF_TRIAD[triad], axis, unit or "")
    if raw.columns[source].dtype.kind == "M":
        return ChannelName("time", "", "ns")
    return channel_name(source, raw.units.get(source, ""))


def channel_name(name: str, unit: str = "") -> ChannelName:
    """Read the name of a column as far as it is sure. `unit`: of a row of units under the names."""
    said = read_name(name, CRASHES, unit)
    known = said.quantity in QUANTITIES and said.loose < 2
    known = known and not (said.unit and find_unit(said.unit, OF_CRASHES) is None)
    # Words such as left and normal are axes beside a quantity alone.
    plain = known or said.axis in re.findall(r"[a-z]+", name.lower())
    against = f"its name says {said.spoken}, and its unit is one of {said.quantity}"
    return ChannelName(
        str(said.quantity) if known else "other",
        said.axis if plain and not said.loose else "",
        said.unit or "",
        said.change,
        against if said.spoken else "",
    )


def _noted(note: Mapping[str, Any]) -> ChannelName:
    """Apply metadata; a velocity written as a change counts from zero: subtract no offset."""
    change = note["quantity"] == "velocity"
    return ChannelName(note["quantity"], note["axis"], note["unit"], change)


def _with_notes(channel: CrashChannel, note: Mapping[str, Any] | None) -> CrashChannel:
    if note is None:
        return channel
    of_heading = ("name", "quantity", "axis", "unit", "body")
    kept = {k: v for k, v in note.items() if k not in of_heading}
    return replace(channel, body=note["body"] or "vehicle", **kept)


def _clock(
    raw: RawLog, said: dict[str, ChannelName], names: dict[str, str], findings: list[Finding]
) -> str:
    """Return the column of the stamps, or empty if there is none."""
    times = [s for s, n in said.items() if n.quantity == "time"]
    stated = [s for s in times if said[s].unit] or times
    if len(stated) > 1:
        others = ", ".join(names[s] for s in stated[1:])
        add_warning(
            findings,
            "io.taken-time-could-too",
            file=raw.name,
            quantity="time",
            names=names[stated[0]],
            others=others,
            names_2=names[stated[1]],
        )
    if stated:
        return stated[0]
    first = next(iter(said))
    if _advances(raw.columns[first]) and said[first].quantity == "other" and len(said) > 1:
        add_note(
            findings,
            "io.advances-evenly-taken-time",
            file=raw.name,
            quantity="time",
            names=names[first],
        )
        return first
    return ""


def _advances(values: NDArray[Any]) -> bool:
    """Whether these are evenly spaced stamps, not a sample counter."""
    if values.dtype.kind not in "iuf" or values.size < 6:
        return False
    steps = np.diff(values.astype(np.float64))
    if not (np.isfinite(steps).all() and steps.min() > 0.0):
        return False
    usual = float(np.median(steps))
    counts = usual == 1.0 and bool((steps == 1.0).all()) and values[0] in (0, 1)
    return not counts and bool(np.abs(steps - usual).max() <= EVEN * usual)


def _channel(
    raw: RawLog, source: str, name: str, names: dict[str, ChannelName], clock: str, clock_name: str
) -> CrashChannel:
    said = names[source]
    if _begins_from_rest(raw, source, said, clock):
        said = replace(said, change=True)
    factor = FACTORS.get(said.quantity, {}).get(said.unit) if said.unit else None
    samples = _samples(raw, source, said, factor)
    stamps = _stamps(raw, clock, names[clock].unit if clock else "")
    remarks = []
    if said.contradiction:
        remarks.append(said.contradiction)
    if said.change:
        remarks.append(CHANGE_NOTE)
    return CrashChannel(
        name=name,
        quantity=said.quantity,
        axis=said.axis,
        unit=clean(said.unit, LONGEST_NAME),
        load=lambda: (stamps(), samples().astype(np.float64)),
        sampling=None if said.quantity in ("velocity", "displacement") else raw.sampling,
        remarks=tuple(remarks),
        file=raw.name,
        row=raw.row,
        clock=clock_name,
        samples=samples,
        from_zero=said.change and said.quantity == "velocity",
    )


def _begins_from_rest(raw: RawLog, source: str, said: ChannelName, clock: str) -> bool:
    """Whether a velocity is small one step after time zero: then it is a change from zero."""
    if said.quantity != "velocity" or said.change or not clock:
        return False
    stamps, values = raw.columns[clock], raw.columns[source]
    if stamps.dtype.kind not in "iuf" or values.dtype.kind not in "iuf" or stamps.size < 2:
        return False
    one_step = 0.0 < stamps[0] <= ONE_STEP * (stamps[1] - stamps[0])
    return bool(one_step and abs(values[0]) <= SMALL * np.nanmax(np.abs(values), initial=0.0))


def _samples(
    raw: RawLog, source: str, said: ChannelName, factor: float | None
) -> Callable[[], NDArray[Any]]:
    def read() -> NDArray[Any]:
        if said.quantity == "time":
            return _ticks(raw, source)[0]
        values = _retold(lambda: numbers(raw, source, f"channel {source}")).astype(np.float64)
        if said.quantity == "velocity" and not said.change and values.size:
            # Velocity of the sensor, not a change: subtract the initial value.
            values = values - values[0]
        return values if factor is None else values * factor

    return read


def _ticks(raw: RawLog, source: str) -> tuple[NDArray[Any], bool]:
    return _retold(lambda: ticks_of(raw, source))


def _retold(read: Callable[[], T]) -> T:
    """Translate errors of log readers, without the options of their command."""
    try:
        return read()
    except DataError as error:
        found = error.finding
        raise DataError(
            "io.crash-channel-unusable",
            file=found.file,
            row=found.row,
            quantity=found.quantity,
            reason=found,
        ) from None


def _stamps(raw: RawLog, clock: str, stated: str) -> Callable[[], Array]:
    def read() -> Array:
        if not clock:
            if raw.rate:
                count = len(next(iter(raw.columns.values())))
                return np.arange(count, dtype=np.float64) / raw.rate
            raise raw.fault("io.crash-time-column-missing", "time")
        stamps, dated = _ticks(raw, clock)
        unit = "ns" if dated else stated
        return seconds_of(Clock(clock, stamps, unit, raw.name, raw.row))[0]

    return read


# Text tables exported by recorders: a title above the header, and a row of units under it.


# Most lines above a table that are kept for people.
MOST_REMARKS = 24
# Largest table of a crash, bytes: rows of numbers have some hundred bytes.
LARGEST = 2_000_000_000
_TITLE = "# title: "


def read_text_table(path: Path) -> tuple[RawLog, dict[str, dict[str, Any]], str, tuple[str, ...]]:
    """Read a text table whose header may be below the first line.

    Returns : `units` are those of the row of units, if there is one; : metadata of columns from
    comments, as from `crash_record.attributes_of`; : title in a comment, or empty; : the other
    lines above the table, where recorders write rate, range and axes.
    """
    if path.stat().st_size > LARGEST:
        raise DataError(
            "io.bytes-more-than-table-crash", file=path.name, st_size=path.stat().st_size
        )
    text, findings = decoded(path.read_bytes(), path.name)
    if "\0" in text:
        raise DataError("io.crash-table-with-zero-bytes", file=path.name)
    raw = csv.parse(text.encode(), path.name, (path,), OF_CRASHES)
    raw.findings[:0] = findings
    # Times of day become nanoseconds since midnight.
    stated = dict(raw.stated)
    for name, values in raw.columns.items():
        if values.dtype.kind != "O":
            continue
        ticks = day_nanoseconds(values)
        if ticks is not None:
            raw.columns[name] = ticks
            stated[name] = ("time", "ns")
    raw.stated = stated
    notes = notes_of(text.splitlines(), raw)
    title = next((line[len(_TITLE) :] for line in raw.above[:1] if line.startswith(_TITLE)), "")
    said = [line for line in raw.above if not line.startswith((NOTE, _TITLE))]
    remarks = [clean(line.lstrip("#% "), LONGEST_NAME) for line in said]
    return raw, notes, title, tuple([r for r in remarks if r][:MOST_REMARKS])


def notes_of(lines: list[str], raw: RawLog) -> dict[str, dict[str, Any]]:
    """Parse comments on columns; those not understood are listed in the log's findings."""
    names = list(raw.columns)
    notes: dict[str, dict[str, Any]] = {}
    for row, line in enumerate(lines, start=1):
        if line.strip() and not is_comment(line):
            break
        if not line.startswith(NOTE):
            continue
        try:
            said = json.loads(line[len(NOTE) :])
            checked = check_attributes(said, raw.name, row)
            column = said["column"]
            if not isinstance(column, int) or not 1 <= column <= len(names):
                raise IndexError
            notes[names[column - 1]] = checked
        except (DataError, ValueError, TypeError, KeyError, IndexError, RecursionError) as error:
            reason = error.finding if isinstance(error, DataError) else None
            raw.note(
                "io.comment-of-no-channel" if reason is None else "io.comment-left-out",
                row=row,
                reason=reason,
            )
    return notes


# Crash records written as text tables: units in the headings, the rest in comments.


#: Prefix of a comment on a column.
NOTE = "# channel: "


def write_crash_csv(path: str | Path, record: CrashRecord) -> tuple[Path, ...]:
    """Write a record as text tables.

    Parameters
    ----------
    path : str or Path
        Path of the table. Channels with other stamps go into separate tables beside it, with
        ``_2``, ``_3`` after the name.
    record : CrashRecord
        Values are written in SI units with the fewest digits that reproduce each exactly.

    Returns
    -------
    tuple of Path
        The tables.

    Raises
    ------
    DataError
        The record has no channels.
    """
    groups: dict[bytes, list[tuple[dict[str, Any], Array]]] = {}
    stamps: dict[bytes, Array] = {}
    for channel in record.channels:
        if channel.quantity == "time":
            continue
        time, values = channel.load()
        key = time.tobytes()
        stamps[key] = time
        groups.setdefault(key, []).append((attributes_of(channel), values))
    if not groups:
        raise DataError("io.record-without-channels", file=record.path.name)
    first = Path(path)
    paths = []
    for k, (key, members) in enumerate(groups.items(), start=1):
        paths.append(first if k == 1 else first.with_stem(f"{first.stem}_{k}"))
        _write(paths[-1], record.title, stamps[key], members)
    return tuple(paths)


def _write(
    path: Path, title: str, time: Array, members: list[tuple[dict[str, Any], Array]]
) -> None:
    import pyarrow as pa
    import pyarrow.csv as pa_csv

    comments = [f"# title: {clean(title)}"]
    headings = ["time [s]"]
    columns = {"0": pa.array(time)}
    for k, (said, values) in enumerate(members, start=1):
        unit = clean(said["unit"])
        headings.append(clean(said["name"]) + (f" [{unit}]" if unit else ""))
        comments.append(NOTE + json.dumps({"column": k + 1, **said}, ensure_ascii=True))
        columns[str(k)] = pa.array(values)
    line = io.StringIO()
    quoting.writer(line, lineterminator="\n").writerow(headings)
    with path.open("wb") as stream:
        stream.write(("\n".join(comments) + "\n" + line.getvalue()).encode())
        pa_csv.write_csv(pa.table(columns), stream, pa_csv.WriteOptions(include_header=False))

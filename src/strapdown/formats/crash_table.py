"""Tables of columns as crash records: text tables of any layout, and other logs."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import DataError, Finding
from strapdown.formats.crash_names import ChannelName, read_channel_name
from strapdown.formats.crash_preamble import read_text_table
from strapdown.formats.crash_record import CrashChannel, CrashRecord
from strapdown.formats.crash_stamps import Clock, seconds_of
from strapdown.formats.crash_text import LONGEST_NAME, clean, unique
from strapdown.formats.crash_units import factor_of
from strapdown.formats.crash_velocity import ONE_STEP
from strapdown.formats.find_columns import Column
from strapdown.formats.numbers import numbers, ticks_of
from strapdown.formats.recording import RawLog

Array = NDArray[np.float64]
T = TypeVar("T")

__all__ = ["detect", "read", "record_of"]

# Of a column of text so many fields must be numbers to be one with a fault in it.
MOSTLY = 0.5
# How even the steps of a column without a name must be, to be taken for a clock.
EVEN = 0.01
# A step of 10 ms of a crash of 50 ms gains less than this of it.
SMALL = 0.2
_OF_TRIAD = {"gyro": "rate", "accel": "acceleration", "mag": "other"}


def detect(path: Path) -> bool:
    """Tell whether it is a file; what is no table is refused when it is read."""
    return path.is_file()


def read(path: Path) -> CrashRecord:
    """Read a text table.

    Parameters
    ----------
    path : Path

    Returns
    -------
    CrashRecord
        A channel for each column of numbers, by the column's name.

    Raises
    ------
    DataError
        It is no table, or a damaged one.
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
    """Make a record of the columns of a log.

    Parameters
    ----------
    raw : RawLog
    path : Path
    form : str
        Key of its format.
    notes : dict of str to dict, optional
        What the file says of columns beside their names, as `attributes_of` gives it.
    title : str, optional
    remarks : tuple of str, optional
        Lines above the table.

    Returns
    -------
    CrashRecord

    Raises
    ------
    DataError
        No column holds numbers.
    """
    findings = list(raw.findings)
    kept: list[str] = []
    texts: list[str] = []
    for source in raw.columns:
        (kept if _is_numeric(raw, source) else texts).append(source)
    if texts:
        shown = ", ".join(clean(t, 40) for t in texts[:6]) + (" …" if len(texts) > 6 else "")
        findings.append(
            Finding("io.columns-text-left-out", file=raw.name, severity="note", value_shown=shown)
        )
    if not kept:
        raise DataError("io.no-numeric-column", file=raw.name)
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
    return read_channel_name(source, raw.units.get(source, ""))


def _noted(note: Mapping[str, Any]) -> ChannelName:
    """A velocity that was written counts from where it did: nothing is taken off again."""
    change = note["quantity"] == "velocity"
    return ChannelName(note["quantity"], note["axis"], note["unit"], change)


def _with_notes(channel: CrashChannel, note: Mapping[str, Any] | None) -> CrashChannel:
    if note is None:
        return channel
    kept = ("sampling", "place", "low_pass", "remarks", "full_scale", "bandwidth")
    return replace(channel, body=note["body"] or "vehicle", **{k: note[k] for k in kept})


def _clock(
    raw: RawLog, said: dict[str, ChannelName], names: dict[str, str], findings: list[Finding]
) -> str:
    """Column of the stamps, or empty where there is none."""
    times = [s for s, n in said.items() if n.quantity == "time"]
    stated = [s for s in times if said[s].unit] or times
    if len(stated) > 1:
        others = ", ".join(names[s] for s in stated[1:])
        findings.append(
            Finding(
                "io.taken-time-could-too",
                file=raw.name,
                quantity="time",
                names=names[stated[0]],
                others=others,
                names_2=names[stated[1]],
            )
        )
    if stated:
        return stated[0]
    first = next(iter(said))
    if _advances(raw.columns[first]) and said[first].quantity == "other" and len(said) > 1:
        findings.append(
            Finding(
                "io.advances-evenly-taken-time",
                severity="note",
                file=raw.name,
                quantity="time",
                names=names[first],
            )
        )
        return first
    return ""


def _advances(values: NDArray[Any]) -> bool:
    """Whether these are evenly spaced stamps, and no count of samples."""
    if values.dtype.kind not in "iuf" or values.size < 6:
        return False
    steps = np.diff(values.astype(np.float64))
    if not (np.isfinite(steps).all() and steps.min() > 0.0):
        return False
    usual = float(np.median(steps))
    counts = usual == 1.0 and bool((steps == 1.0).all()) and values[0] in (0, 1)
    return not counts and bool(np.abs(steps - usual).max() <= EVEN * usual)


def _channel(
    raw: RawLog,
    source: str,
    name: str,
    names: dict[str, ChannelName],
    clock: str,
    clock_name: str,
) -> CrashChannel:
    said = names[source]
    if _begins_from_rest(raw, source, said, clock):
        said = replace(said, change=True)
    factor = factor_of(said.quantity, said.unit) if said.unit else None
    samples = _samples(raw, source, said, factor)
    stamps = _stamps(raw, clock, names[clock].unit if clock else "")
    remarks = []
    if said.contradiction:
        remarks.append(said.contradiction)
    if said.change:
        remarks.append("change of velocity since time zero of the recorder")
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
    )


def _begins_from_rest(raw: RawLog, source: str, said: ChannelName, clock: str) -> bool:
    """A velocity that is small one step after time zero was none at zero: it is a change."""
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
        values = _numbers(raw, source).astype(np.float64)
        if said.quantity == "velocity" and not said.change and values.size:
            # Speed of the sensor, not a change: what it was at first is taken off.
            values = values - values[0]
        return values if factor is None else values * factor

    return read


def _numbers(raw: RawLog, source: str) -> NDArray[Any]:
    column = Column(source, None, "")
    return _retold(lambda: numbers(raw, column, f"channel {source}"))


def _ticks(raw: RawLog, source: str) -> tuple[NDArray[Any], bool]:
    return _retold(lambda: ticks_of(raw, Column(source, None, "")))


def _retold(read: Callable[[], T]) -> T:
    """What readers of logs say, without the options of their command."""
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
            raise DataError("io.crash-time-column-missing", file=raw.name, quantity="time")
        stamps, dated = _ticks(raw, clock)
        unit = "ns" if dated else stated
        return seconds_of(Clock(clock, stamps, unit, raw.name, raw.row))[0]

    return read

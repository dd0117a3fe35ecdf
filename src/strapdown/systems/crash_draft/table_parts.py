"""Triads of a table of unknown layout, with their clock, as far as headings tell."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import DataError
from strapdown.formats.crash_record import CrashChannel, CrashRecord
from strapdown.formats.crash_stamps import last_midnight
from strapdown.formats.crash_units import factor_of
from strapdown.formats.stamps import EPOCH
from strapdown.systems.crash_draft.header_words import Heading, read_heading
from strapdown.systems.crash_draft.parts import Part, Skipped
from strapdown.systems.crash_draft.stated_rate import stated_rate
from strapdown.systems.crash_draft.table_clock import evenly, find_clock, likely_rate
from strapdown.systems.crash_draft.table_triads import group_columns

Array = NDArray[np.float64]

__all__ = ["LEAST_SAMPLES", "table_parts"]

#: A crash of a tenth of a second, at the slowest rate that shows it.
LEAST_SAMPLES = 8
# Ticks beyond this are counted from the first, before they become floats.
FAR = 2.0**40
# What the reader calls a column that has no heading.
_NUMBERED = re.compile(r"column \d+")
_KINDS = ("acceleration", "rate", "velocity", "time")


@dataclass(frozen=True)
class _Table:
    columns: Mapping[str, Array]
    headings: Mapping[str, Heading]
    origins: Mapping[str, float]


def table_parts(path: str, record: CrashRecord) -> tuple[list[Part], list[Skipped]]:
    """Find the triads of a table.

    Parameters
    ----------
    path : str
        As a case names it.
    record : CrashRecord
        Whose channels are columns.

    Returns
    -------
    parts : list of Part
        Values as recorded; kind and unit as far as headings tell.
    skipped : list of Skipped

    Raises
    ------
    DataError
        It holds fewer than eight samples, time does not advance, or a value of a sensor is none.
    """
    table, skipped = _columns(path, record)
    rows = max((len(v) for v in table.columns.values()), default=0)
    if rows < LEAST_SAMPLES:
        raise DataError(
            "crash.one-sample" if rows == 1 else "crash.too-few-samples",
            file=record.path.name,
            rows=rows,
            least_samples=LEAST_SAMPLES,
        )
    clock, time = find_clock(table.columns, table.headings)
    if time is None:
        whole = np.column_stack([v for v in table.columns.values() if np.isfinite(v).all()])
        said = stated_rate(record.remarks)
        clock = (
            replace(
                clock,
                unit="s",
                rate=said[0],
                stated=True,
                why=f"stated above the table: '{said[1]}'",
            )
            if said
            else replace(clock, rate=likely_rate(whole))
        )
        stamps = np.arange(rows, dtype=np.float64) / clock.rate
    else:
        _check_advances(record.channel(clock.column), table.columns[clock.column])
        factor = 1.0 / (clock.rate * clock.step)
        origin = table.origins.get(clock.column, 0.0) * factor
        # As those are read who read the case: what counts from far away counts from midnight.
        raw = table.origins.get(clock.column, 0.0) + float(table.columns[clock.column][0])
        far = abs(origin + time[0]) > EPOCH
        stamps = (
            time - time[0] + (raw - last_midnight(raw, factor)) * factor if far else time + origin
        )
        clock, stamps = evenly(clock, stamps)
    others = {n: v for n, v in table.columns.items() if n != clock.column}
    groups, left = group_columns(others, table.headings)
    skipped += [Skipped(path, f"column '{name}'", why, (name,)) for name, why in left]
    parts = []
    for group in groups:
        values, channels = np.full((rows, 3), np.nan), {}
        has = [k for k, axis in enumerate("xyz") if axis in group.columns]
        for k in has:
            name = group.columns["xyz"[k]]
            turned = table.headings[name].reversed
            values[:, k] = -table.columns[name] if turned else table.columns[name]
            channels["xyz"[k]] = f"-{name}" if turned else name
        kept = np.isfinite(values[:, has]).all(axis=1)
        lost = rows - int(kept.sum())
        names = tuple(group.columns.values())
        if rows - lost < LEAST_SAMPLES:
            skipped.append(Skipped(path, ", ".join(names), "hardly a row of it is whole", names))
            continue
        if not np.ptp(values[kept][:, has], axis=0).any():
            skipped.append(Skipped(path, ", ".join(names), "they are constant", names))
            continue
        part = Part(
            path,
            group.quantity,
            channels,
            clock,
            group.unit,
            "axes by the headings" if group.by_heading else "axes in the order of the columns",
            stamps[kept],
            values[kept],
            label=group.label,
            named=group.by_heading,
            notes=(f"{lost} of {rows} rows have no value of it",) if lost else (),
            remarks=record.remarks,
        )
        parts.append(replace(part, sampling=_sampling(record, group.columns.values())))
    return parts, skipped


def _check_advances(channel: CrashChannel, stamps: Array) -> None:
    back = np.flatnonzero(np.diff(stamps) <= 0.0)
    if not back.size:
        return
    k = int(back[0]) + 1
    stays = stamps[k] == stamps[k - 1]
    raise DataError(
        f"crash.time-{'stays' if stays else 'goes-back'}{'' if back.size == 1 else '-often'}",
        file=channel.file or None,
        row=channel.row(k),
        quantity=f"time ({channel.name})",
        before=stamps[k - 1],
        time=stamps[k],
        count=back.size,
    )


def _sampling(record: CrashRecord, names: object) -> str:
    kinds = {c.sampling for c in record.channels if c.name in set(names)}  # type: ignore[call-overload]
    only = kinds.pop() if len(kinds) == 1 else None
    return only or ""


def _columns(path: str, record: CrashRecord) -> tuple[_Table, list[Skipped]]:
    """Columns as recorded: those that cannot be read are left out with what was wrong."""
    columns: dict[str, Array] = {}
    headings: dict[str, Heading] = {}
    origins: dict[str, float] = {}
    skipped: list[Skipped] = []
    for channel in record.channels:
        try:
            raw = channel.samples() if channel.samples is not None else channel.load()[1]
        except DataError as error:
            if _heading(channel).quantity in _KINDS:
                raise
            skipped.append(
                Skipped(path, f"column '{channel.name}'", error.finding, (channel.name,))
            )
            continue
        headings[channel.name] = _heading(channel)
        if raw.dtype.kind in "iu" and raw.size and abs(int(raw[0])) > FAR:
            origins[channel.name] = float(raw[0])
            raw = raw.astype(np.int64) - np.int64(raw[0])
        values = raw.astype(np.float64)
        factor = factor_of(channel.quantity, channel.unit)
        if factor is not None and channel.quantity != "time":
            values = values / factor
        columns[channel.name] = values
    return _Table(columns, headings, origins), skipped


def _heading(channel: CrashChannel) -> Heading:
    """What the heading says: the reader's word where it has a unit, ours in other languages."""
    if _NUMBERED.fullmatch(channel.name) and not channel.unit:
        return Heading("", "", "", "")
    own = read_heading(channel.name)
    axis, turned = channel.axis.lstrip("-"), channel.axis.startswith("-")
    if axis:
        own = replace(own, axis=axis, reversed=turned)
    if channel.quantity in _KINDS and (channel.unit or not own.quantity):
        # One letter g is an acceleration to one maker and a gyro to another.
        if channel.unit or own.stem != "g":
            own = replace(own, quantity=channel.quantity, unit=channel.unit)
    elif channel.quantity in ("displacement", "force"):
        own = replace(own, quantity="other")
    return own

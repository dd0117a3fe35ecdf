"""Joining of single-sensor logs, each with its own stamps, on the stamps of the gyro."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from strapdown.constants import Array
from strapdown.errors import ConfigError, DataError, Finding, add_note, add_warning
from strapdown.formats.arrays import ticks_of
from strapdown.formats.find_columns import Column, as_found, find_columns
from strapdown.formats.inference.conclusion import infer_time_unit
from strapdown.formats.recording import RawLog, ReadOptions
from strapdown.formats.vocabularies import QUANTITIES
from strapdown.tables import find_gaps
from strapdown.units import TIME_UNITS

AXES = "xyz"
TRIADS = ("accel", "mag")
# A sensor that covers a smaller fraction of the gyro's samples is dropped; if it covers more, the
# gyro's samples outside it are.
COVERED = 0.9


@dataclass(frozen=True)
class OwnClock:
    """Stamps as in a log, and their unit if known."""

    ticks: NDArray[Any]
    unit: str | None


def join(
    logs: Sequence[RawLog],
    name: str,
    files: tuple[Path, ...] | None = None,
    *,
    rows_of_member: bool = False,
) -> RawLog:
    """Interpolate accelerometer and magnetometer to the stamps of the gyro.

    Interpolation is linear, without extrapolation.

    `logs`: one has the gyro. Their clocks have a common origin; units may differ. `name`: name of
    the result, for messages. `files`: every file that was read; by default those of the logs.
    `rows_of_member`: name the result after the gyro's log, a member of a folder or an archive,
    because rows are counted in that. Returns the rows of the gyro's log, without those for which
    another sensor has no value; columns are named ``log/column``. The findings list interpolations
    with their distances, and dropped rows. DataError: no log has a gyro; clocks do not overlap; a
    value is not a number; axes differ. ConfigError: two logs have the same quantity.
    """
    found = [find_columns(log, ReadOptions()) for log in logs]
    k = _with_gyro(logs, found, name)
    gyro, own = logs[k], found[k]
    label = _short(gyro)
    columns = {f"{label}/{n}": c for n, c in gyro.columns.items()}
    stated: dict[str, tuple[str, str | None]] = {
        f"{label}/{c.source}": (q, c.unit) for q, c in own.items()
    }
    findings = [f for log in logs for f in log.findings]
    keep = np.ones(len(next(iter(gyro.columns.values()))), dtype=bool)
    given = {triad: gyro.name for triad in TRIADS if f"{triad}_x" in own}
    for log, theirs in zip(logs, found, strict=True):
        if log is gyro:
            continue
        for triad in TRIADS:
            if any(f"{triad}_{a}" not in theirs for a in AXES):
                continue
            if triad in given:
                raise ConfigError(
                    "io.given-name", file=name, quantity=triad, given=given[triad], name=log.name
                )
            given[triad] = log.name
            values, inside = _onto(gyro, own, log, theirs, triad, findings)
            if values is None:
                continue
            if f"{triad}_x" in QUANTITIES:
                keep &= inside
            for j, a in enumerate(AXES):
                column = theirs[f"{triad}_{a}"]
                source = f"{_short(log)}/{column.source}"
                columns[source] = values[:, j]
                stated[source] = (f"{triad}_{a}", column.unit)
    if lost := int((~keep).sum()):
        add_note(
            findings,
            "io.rows-left-out-another-sensor",
            file=gyro.name,
            row=gyro.row(int(np.argmin(keep))),
            lost=lost,
            size=keep.size,
        )
    everything = tuple(dict.fromkeys(f for log in logs for f in log.files))
    rows = np.arange(1, keep.size + 1) if gyro.rows is None else gyro.rows
    return RawLog(
        name=gyro.name if rows_of_member else name,
        files=files or everything,
        columns={n: c[keep] for n, c in columns.items()},
        rows=rows[keep],
        stated=known_only(stated),
        units={f"{label}/{n}": u for n, u in gyro.units.items()},
        triad_units={t: u for log in logs for t, u in log.triad_units.items()},
        rate=gyro.rate,
        sampling=gyro.sampling,
        axes=_one_of("axes", logs, name),
        calibrated=next((log.calibrated for log in logs if log.calibrated), None),
        findings=findings,
    )


def known_only(stated: dict[str, tuple[str, str | None]]) -> dict[str, tuple[str, str | None]]:
    """Keep only the quantities that are used here."""
    return {source: said for source, said in stated.items() if said[0] in QUANTITIES}


def clock_of(log: RawLog, found: dict[str, Column]) -> OwnClock:
    """Return the stamps of a log.

    DataError: the log has no stamps, or they are not numbers.
    """
    if "time" not in found:
        raise log.fault("io.join-time-column-missing", "time", columns=list(log.columns))
    ticks, dated = ticks_of(log, found["time"].source, found["time"].unit)
    return OwnClock(ticks, "ns" if dated else found["time"].unit)


def in_seconds(clock: OwnClock, origin: OwnClock) -> Array:
    """Convert to seconds since the first stamp of another clock; ticks subtract exactly."""
    first = origin.ticks[np.argmax(np.isfinite(origin.ticks.astype(np.float64)))]
    ours, theirs = TIME_UNITS[clock.unit or "s"], TIME_UNITS[origin.unit or "s"]
    if clock.unit == origin.unit:
        return np.asarray((_wide(clock.ticks) - _wide(first)).astype(np.float64) * ours)
    return np.asarray(clock.ticks.astype(np.float64) * ours - float(first) * theirs)


def at_stamps(time: Array, own: Array, values: Array) -> tuple[Array, NDArray[np.bool_], float]:
    """Interpolate samples linearly to stamps.

    `time` ((n,)): stamps of the output. `own` ((m,)): increasing stamps of the samples. `values`
    ((m, 3)). Returns `values` ((n, 3)): NaN before the first sample and after the last; `inside`
    ((n,)); `distance`: largest distance from a stamp inside to its nearest sample.
    """
    inside = (time >= own[0]) & (time <= own[-1])
    out = np.column_stack(
        [np.interp(time, own, values[:, k], left=np.nan, right=np.nan) for k in range(3)]
    )
    after = np.clip(np.searchsorted(own, time[inside]), 1, max(own.size - 1, 1))
    near = np.minimum(
        np.abs(time[inside] - own[after - 1]),
        np.abs(own[np.minimum(after, own.size - 1)] - time[inside]),
    )
    return out, inside, float(near.max(initial=0.0))


def _with_gyro(logs: Sequence[RawLog], found: Sequence[dict[str, Column]], name: str) -> int:
    have = [k for k, f in enumerate(found) if all(f"gyro_{a}" in f for a in AXES)]
    if len(have) == 1:
        return have[0]
    if have:
        raise ConfigError(
            "io.gyro-in-several-logs", file=name, quantity="gyro", have=[logs[k].name for k in have]
        )
    held = "; ".join(f"{_short(log)} ({', '.join(log.columns)})" for log in logs)
    raise DataError(
        "io.no-gyroscope-holds",
        file=name,
        quantity="gyro",
        held=held or "no sensor that is read here",
    )


def _onto(
    gyro: RawLog,
    own: dict[str, Column],
    log: RawLog,
    theirs: dict[str, Column],
    triad: str,
    findings: list[Finding],
) -> tuple[Array | None, NDArray[np.bool_]]:
    """Return a triad at the stamps of the gyro, and where it has values."""
    values = np.column_stack(
        [theirs[f"{triad}_{a}"].values(log, f"{triad}_{a}").astype(np.float64) for a in AXES]
    )
    origin, clock = clock_of(gyro, own), clock_of(log, theirs)
    if (origin.unit is None) != (clock.unit is None):
        mute = gyro if origin.unit is None else log
        raise DataError("io.stamps-no-unit-those-other", file=mute.name, quantity="time")
    time, stamps = in_seconds(origin, origin), in_seconds(clock, origin)
    known = np.isfinite(time)
    # Stamps without a unit are as in the log; messages about them are in s by the likely one.
    open_unit = origin.unit is None and int(known.sum()) > 1
    likely = infer_time_unit(origin.ticks[known]).value if open_unit else None
    factor = TIME_UNITS[str(likely)] if likely else 1.0
    stamps, values = _in_order(stamps, values, log.name, triad, findings)
    if stamps.size == time.size and np.array_equal(stamps, time):
        return values, np.ones(time.size, dtype=bool)
    if not stamps.size or not known.any():
        add_note(findings, "io.left-out-without-number", file=log.name, quantity=triad)
        return None, known
    out, inside, distance = at_stamps(time, stamps, values)
    if not inside.any():
        start = np.nanmin(time)
        raise log.fault(
            "io.stamps-run-after-first-gyro",
            "time",
            stamps=(stamps[0] - start) * factor,
            stamps_2=(stamps[-1] - start) * factor,
            nanmax=(np.nanmax(time) - start) * factor,
        )
    covered = int(inside.sum())
    if covered < COVERED * known.sum():
        add_note(
            findings,
            "io.left-out-few-samples",
            file=log.name,
            quantity=triad,
            covered=covered,
            count=int(known.sum()),
        )
        return None, known
    if distance > 0:
        add_note(
            findings,
            "io.interpolated-stamps-gyro-not-own",
            file=log.name,
            quantity=triad,
            covered=covered,
            distance=distance * factor,
        )
    if gaps := find_gaps(stamps):
        longest = max(gaps, key=lambda g: g.length)
        add_warning(
            findings,
            "io.gaps-in-force" if triad == "accel" else "io.gaps-in-sensor",
            severity="warning" if triad == "accel" else "note",
            file=log.name,
            quantity=triad,
            count=len(gaps),
            length=longest.length * factor,
        )
    # A gyro stamp that is not a number is refused or repaired together with the gyro.
    return np.where(known[:, None], out, 0.0), inside | ~known


def _in_order(
    stamps: Array, values: Array, name: str, triad: str, findings: list[Finding]
) -> tuple[Array, Array]:
    """Keep samples with increasing stamps, without those that are not numbers."""
    use = np.isfinite(stamps) & np.isfinite(values).all(axis=1)
    order = np.flatnonzero(use)[np.argsort(stamps[use], kind="stable")]
    order = order[np.diff(stamps[order], prepend=-np.inf) > 0]
    if lost := stamps.size - order.size:
        add_note(
            findings,
            "io.samples-not-used-no-number",
            file=name,
            quantity=triad,
            lost=lost,
            size=stamps.size,
        )
    return stamps[order], values[order]


def _one_of(what: str, logs: Sequence[RawLog], name: str) -> str | None:
    said = {log.axes: log.name for log in logs if log.axes}
    if len(said) > 1:
        raise DataError(
            "io.axes-of-logs-differ",
            file=name,
            quantity=what,
            stated=[f"{file} says {axes}" for axes, file in said.items()],
        )
    return next(iter(said), None)


def _short(log: RawLog) -> str:
    return PurePosixPath(log.name).name


def _wide(ticks: Any) -> Any:
    """Convert integers to the widest type, so that differences do not overflow."""
    array = np.asarray(ticks)
    return array.astype(np.int64) if array.dtype.kind in "iub" else array.astype(np.float64)


def with_columns(logs: Sequence[RawLog], options: ReadOptions) -> list[RawLog]:
    """Return logs with the columns that the user named, as if the logs stated them.

    `options`: a column is named as in its log, or as ``log/column``. ConfigError: a named column is
    in no log.
    """
    asked: list[dict[str, str]] = [{} for _ in logs]
    for quantity, source in options.columns.items():
        for log, its in zip(logs, asked, strict=True):
            sign = "-" if source.startswith("-") and source not in log.columns else ""
            plain = source.removeprefix(sign).removeprefix(f"{_short(log)}/")
            if plain in log.columns:
                its[quantity] = f"{sign}{plain}"
        if not any(quantity in its for its in asked):
            raise ConfigError(
                "io.no-log-with-column",
                file=", ".join(log.name for log in logs),
                quantity=f"--columns {quantity}",
                source=source,
                logs=[", ".join(log.columns) for log in logs],
            )
    out = []
    for log, its in zip(logs, asked, strict=True):
        own = dataclasses.replace(options, columns=its)
        out.append(as_found(log, find_columns(log, own)) if its else log)
    return out

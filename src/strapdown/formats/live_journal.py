"""Journal of a live session: the folder that `strapdown live` and a killed live run leave.

``run.json`` states how the session was received, ``journal`` holds what was received, in the order
of arrival: ``strapdown journal 1``, a line feed, and records of a length, its complement, a
checksum that continues that of the record before, and a payload. The first byte of a payload is
its kind:

======  ==========================================================================================
``V``   event of a sensor of a phone: kind of `sensor_streams`, stamp in ns, its values
``S``   sample of a sender of lines: seconds, rates (rad/s) if any, forces (m/s²)
``M``   measurement of such a sender, as JSON: name, seconds, values by column
``W``   command
``R``   SHA-256 of ``run.json``; ``E``: of the result that was written
======  ==========================================================================================

Numbers are little-endian. A last record that is incomplete was cut by a kill, and is left out. The
events of a phone are joined as they were when they arrived (`sensor_streams`), to the bit.
"""

from __future__ import annotations

import json
import struct
import zlib
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.errors import DataError, add_note
from strapdown.formats.clocks import RELATIVE, UNIX, Clock
from strapdown.formats.gnss_fixes import RADIUS, UNSTATED_VERTICAL, Fixes
from strapdown.formats.known_formats import lacking
from strapdown.formats.recording import RawLog
from strapdown.formats.sensor_streams import (
    PRESSURE,
    WIDTHS,
    Event,
    Joined,
    Located,
    SensorStreams,
    is_event,
)
from strapdown.formats.signs import Signs, first_bytes
from strapdown.tables import GEODETIC, GNSS, VELOCITY
from strapdown.tables.checks import POSITION_SD, VELOCITY_SD

JOURNAL, RUN = "journal", "run.json"
SCHEMA = "strapdown journal 1"
MAGIC = f"{SCHEMA}\n".encode()
#: Length of a payload, its complement, and checksum.
FRAME = struct.Struct("<HHI")
EVENT, SAMPLE, MEASURED, WORD = b"V", b"S", b"M", b"W"
#: A row of seven numbers, rates and forces, and one of four, forces alone.
ROWS = {n: struct.Struct(f"<{n}d") for n in (4, 7)}
_EVENTS = [struct.Struct(f"<cBq{width}d") for width in WIDTHS]
_KIND = 1
TITLE = "journal of a live session"


def _is_journal(path: Path) -> bool:
    return first_bytes(path / JOURNAL, len(MAGIC)) == MAGIC


detect = Signs(first=rb"\A" + MAGIC, folder=_is_journal)


def session_folder(path: Path) -> Path | None:
    """Return the folder of a session, by itself or by its journal; None if it is neither."""
    if path.is_dir():
        return path if _is_journal(path) else None
    return path.parent if first_bytes(path, len(MAGIC)) == MAGIC else None


def files_of(path: Path) -> tuple[Path, ...]:
    """List the files that are read."""
    folder = session_folder(path) or path
    return tuple(file for file in (folder / JOURNAL, folder / RUN) if file.is_file())


def run_of(folder: Path) -> dict[str, Any]:
    """Return what a session states of itself.

    DataError: it is damaged, or of another version.
    """
    try:
        run = json.loads((folder / RUN).read_bytes())
    except (OSError, ValueError, RecursionError):
        run = None
    if not isinstance(run, dict) or not isinstance(run.get("command"), str):
        raise DataError("live.not-a-journal", file=str(folder / RUN))
    if run.get("schema") != SCHEMA:
        schema = str(run.get("schema"))
        raise DataError(
            "live.journal-of-other-version", file=str(folder), schema=schema, own=SCHEMA
        )
    return run


def records(path: Path, crc: int = 0) -> Iterator[tuple[int, int, bytes]]:
    """Yield the complete records of a journal: where each ends, its checksum, and its payload.

    DataError: it is damaged.
    """
    with path.open("rb") as stream:
        magic = stream.read(len(MAGIC))
        if not MAGIC.startswith(magic):
            raise _damaged(path, 0)
        at, number = len(magic), 0
        while len(frame := stream.read(FRAME.size)) == FRAME.size:
            count, complement, wanted = FRAME.unpack(frame)
            if count ^ 0xFFFF != complement:
                raise _damaged(path, at, number)
            payload = stream.read(count)
            if len(payload) < count:
                return
            crc = zlib.crc32(payload, crc)
            if crc != wanted:
                raise _damaged(path, at, number)
            at, number = at + FRAME.size + count, number + 1
            yield at, crc, payload


def _damaged(path: Path, at: int, number: int = 0) -> DataError:
    if not number:
        return DataError("live.not-a-journal", file=str(path))
    return DataError("live.journal-damaged", file=str(path), path=path, at=at, number=number)


def event_payload(event: Event) -> bytes:
    """Return the payload of an event."""
    return _EVENTS[event.kind].pack(EVENT, event.kind, event.stamp, *event.values)


def events_in(payload: bytes) -> Event | None:
    """Return the event of a payload; None of another kind, or if it is none."""
    if payload[:1] != EVENT or len(payload) < 2 or payload[_KIND] >= len(_EVENTS):
        return None
    form = _EVENTS[payload[_KIND]]
    if len(payload) != form.size:
        return None
    _, kind, stamp, *values = form.unpack(payload)
    event = Event(kind, stamp, tuple(values))
    return event if is_event(*event) else None


def event_streams(run: dict[str, Any]) -> SensorStreams:
    """Return empty streams that join events as the session did."""
    hold = run.get("reorder_s")
    return SensorStreams(float(hold) if isinstance(hold, int | float) else 0.0)


def read(path: Path) -> RawLog:
    """Read gyro, specific force and magnetic field as the session used them."""
    run, rows, streams = _received(path)
    joined = [one for one in rows if isinstance(one, Joined)]
    name = path.resolve().name
    if not joined:
        raise lacking(path, "imu", TITLE, ["gnss"] if rows else [])
    columns: dict[str, tuple[NDArray[Any], str | None]] = {
        "time": (np.array([one.time for one in joined]), "s")
    }
    blocks = {
        "gyro": (np.array([one.gyro for one in joined]), "rad/s"),
        "accel": (np.array([one.accel for one in joined]), "m/s2"),
    }
    if any(one.mag is not None for one in joined):
        none = (np.nan,) * 3
        blocks["mag"] = (np.array([one.mag or none for one in joined]), "uT")
    for triad, (values, unit) in blocks.items():
        columns |= {f"{triad}_{axis}": (values[:, k], unit) for k, axis in enumerate("xyz")}
    live = (run.get("configuration") or {}).get("live") or {}
    sampling = str(live.get("sampling") or "instantaneous")
    log = RawLog.of(path, columns, axes=run.get("axes"), sampling=sampling)
    log.name, log.files = name, files_of(path)
    log.clock, log.epoch = (UNIX, float(streams.epoch)) if streams.epoch else (RELATIVE, 0.0)
    log.sparse = frozenset({"mag"})
    if streams.unused:
        said = [f"{count} {reason}" for reason, count in sorted(streams.unused.items())]
        add_note(log.findings, "io.session-events-not-used", file=name, said=said)
    return log


def read_fixes(path: Path) -> Fixes:
    """Read the fixes of a phone, or the measurements of a sender of lines that are fixes."""
    _, rows, streams = _received(path)
    located = [one for one in rows if isinstance(one, Located)]
    folder = session_folder(path) or path
    payloads = (payload for _, _, payload in records(folder / JOURNAL))
    said = [_measured(one[1:]) for one in payloads if one[:1] == MEASURED]
    if measured := [one for one in said if one is not None]:
        return _fixes_of_lines(measured, path.resolve().name)
    if not located:
        raise lacking(path, "gnss", TITLE, ["imu"] if rows else [])
    clock = Clock(UNIX, float(streams.epoch)) if streams.epoch else Clock(RELATIVE)
    return fixes_of(located, path.resolve().name, clock)


def read_barometer(path: Path) -> RawLog:
    """Read the pressure; its samples count from the epoch of the inertial ones."""
    folder = session_folder(path) or path
    run = run_of(folder)
    streams, found = event_streams(run), []
    for _, _, payload in records(folder / JOURNAL):
        if (event := events_in(payload)) is not None:
            streams.take(event)
            if event.kind == PRESSURE:
                found.append(event)
    if not found:
        raise lacking(path, "barometer", TITLE, ["imu"])
    order = sorted({event.stamp: event for event in found}.items())
    epoch = streams.epoch or 0
    log = RawLog.of(
        path,
        {
            "time": (np.array([(stamp - epoch * 10**9) * 1e-9 for stamp, _ in order]), "s"),
            "pressure": (np.array([event.values[0] for _, event in order]), "hPa"),
        },
    )
    log.name, log.files = path.resolve().name, files_of(path)
    log.clock, log.epoch = (UNIX, float(epoch)) if epoch else (RELATIVE, 0.0)
    return log


def fixes_of(located: Sequence[Located], name: str, clock: Clock) -> Fixes:
    """Convert fixes of a phone: velocity by speed and course, standard deviations by accuracies.

    As `gnss_files` does of the file that the app writes.
    """
    values = np.array([one.values for one in located], dtype=np.float64)
    place, (speed, speed_sd, course, radius, down) = values[:, :3], values[:, 3:].T
    nothing = np.full(len(values), np.nan)
    with np.errstate(invalid="ignore"):
        known = (speed >= 0.0) & (course >= 0.0)
        speed = np.where(known, speed, np.nan)
        sd = np.where(known & (speed_sd > 0.0), speed_sd, np.nan)
        horizontal = np.where(radius > 0.0, radius, np.nan) / RADIUS
        vertical = np.where(down > 0.0, down, np.nan)
    vertical = np.where(np.isnan(down), UNSTATED_VERTICAL * horizontal, vertical)
    angle = np.radians(course)
    return Fixes(
        name=name,
        time=np.array([one.time for one in located]),
        place=place,
        rows=np.arange(1, len(values) + 1),
        clock=clock,
        velocity=np.column_stack([speed * np.cos(angle), speed * np.sin(angle), nothing]),
        position_sd=np.column_stack([horizontal, horizontal, vertical]),
        velocity_sd=np.column_stack([sd, sd, nothing]),
    )


def _received(path: Path) -> tuple[dict[str, Any], list[Joined | Located], SensorStreams]:
    """Return what a journal states, its samples and fixes in order, and the streams after them."""
    folder = session_folder(path) or path
    run = run_of(folder)
    streams = event_streams(run)
    rows: list[Joined | Located] = []
    for _, _, payload in records(folder / JOURNAL):
        if (event := events_in(payload)) is not None:
            rows += streams.take(event)
        elif payload[:1] == SAMPLE and len(payload) == 1 + ROWS[7].size:
            time, *values = ROWS[7].unpack(payload[1:])
            rows.append(Joined(time, tuple(values[:3]), tuple(values[3:]), None))
    return run, [*_in_order(rows), *streams.finish()], streams


def _in_order(rows: Iterable[Joined | Located]) -> Iterator[Joined | Located]:
    """Leave out samples of lines that are not later than the one before."""
    newest = -np.inf
    for row in rows:
        if isinstance(row, Joined):
            if not row.time > newest:
                continue
            newest = row.time
        yield row


def _measured(payload: bytes) -> tuple[float, dict[str, float]] | None:
    """Return time and values of a measurement that is a fix of a receiver."""
    try:
        _, time, values = json.loads(payload)
        row = {str(name): float(value) for name, value in values.items()}
        return (float(time), row) if set(GEODETIC) <= set(row) else None
    except (ValueError, TypeError, AttributeError, RecursionError):
        return None


def _fixes_of_lines(rows: Sequence[tuple[float, dict[str, float]]], name: str) -> Fixes:
    """Convert fixes of a sender of lines, each later than the one before."""
    table = pd.DataFrame([row for _, row in rows], index=[time for time, _ in rows])
    table = table[table.index.to_series().cummax().diff().fillna(1.0) > 0.0]
    table = table.reindex(columns=GNSS)
    groups = [table[list(names)].to_numpy() for names in (VELOCITY, POSITION_SD, VELOCITY_SD)]
    velocity, position_sd, velocity_sd = (
        None if np.isnan(block).all() else block for block in groups
    )
    return Fixes(
        name=name,
        time=table.index.to_numpy(dtype=np.float64),
        place=table[list(GEODETIC)].to_numpy(),
        rows=np.arange(1, len(table) + 1),
        velocity=velocity,
        position_sd=position_sd,
        velocity_sd=velocity_sd,
        quality=table["quality"].fillna(1.0).to_numpy(),
    )

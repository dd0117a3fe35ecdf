"""Crash records as JSON: the complete record."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from strapdown.errors import DataError
from strapdown.formats.crash_record import (
    LONGEST_NAME,
    CrashChannel,
    CrashRecord,
    attributes_of,
    check_attributes,
    clean,
    unique,
)
from strapdown.formats.signs import Signs
from strapdown.tables.checks import Array

FORMAT = "strapdown crash record"
VERSION = 1
LARGEST = 1_000_000_000


def write_crash_json(path: str | Path, record: CrashRecord) -> None:
    """Write a record as JSON.

    Parameters
    ----------
    path : str or Path
    record : CrashRecord
        Values are written in SI units with the fewest digits that reproduce each exactly; a
        missing sample is null. Channels with the same stamps refer to one list.

    Raises
    ------
    DataError
        A value is infinite.
    """
    clocks: dict[bytes, int] = {}
    stamps: list[list[float]] = []
    channels: list[dict[str, Any]] = []
    for channel in record.channels:
        if channel.quantity == "time":
            continue
        time, values = channel.load()
        bad = np.flatnonzero(np.isinf(values) | ~np.isfinite(time))
        if bad.size:
            raise DataError(
                "io.not-finite-number",
                **channel.where,
                row=channel.row(int(bad[0])),
                values=values[bad[0]],
            )
        key = time.tobytes()
        if key not in clocks:
            clocks[key] = len(stamps)
            stamps.append(time.tolist())
        numbers = [None if np.isnan(v) else v for v in values.tolist()]
        channels.append({**attributes_of(channel), "stamps": clocks[key], "values": numbers})
    whole = {
        "format": FORMAT,
        "version": VERSION,
        "title": record.title,
        "facts": dict(record.facts),
        "vehicles": {number: dict(facts) for number, facts in record.vehicles.items()},
        "stamps_s": stamps,
        "channels": channels,
    }
    text = json.dumps(whole, ensure_ascii=True, allow_nan=False, separators=(",", ":"))
    Path(path).write_bytes((text + "\n").encode())


detect = Signs(first=rb"\A\s*+\{.{0,180}?" + FORMAT.encode())


def read(path: Path) -> CrashRecord:
    """Read a record written as JSON."""
    whole = _parsed(path)
    stamps = [
        _numbers(s, path, f"stamps_s {k}") for k, s in enumerate(_list(whole, "stamps_s", path))
    ]
    for k, clock in enumerate(stamps):
        if clock.size and not (np.isfinite(clock).all() and (np.diff(clock) > 0.0).all()):
            raise _form(path, f"stamps_s {k}", "io.crash-json-stamps-do-not-advance")
    said = _list(whole, "channels", path)
    attributes = [check_attributes(s, path.name) for s in said]
    names = unique([a["name"] or f"channel {k + 1}" for k, a in enumerate(attributes)])
    channels = []
    for k, (one, raw) in enumerate(zip(attributes, said, strict=True)):
        at = raw.get("stamps")
        if not isinstance(at, int) or isinstance(at, bool) or not 0 <= at < len(stamps):
            raise _form(path, f"channel {names[k]}", "io.crash-json-no-such-stamps", at=at)
        values = _numbers(raw.get("values"), path, f"channel {names[k]}")
        if values.size != stamps[at].size or not values.size:
            raise _form(
                path,
                f"channel {names[k]}",
                "io.crash-json-count-of-stamps",
                size=values.size,
                size_2=stamps[at].size,
            )
        kept = {key: one[key] for key in one if key != "name"}
        channels.append(
            CrashChannel(name=names[k], load=_loader(stamps[at], values), file=path.name, **kept)
        )
    vehicles = whole.get("vehicles", {})
    if not isinstance(vehicles, dict):
        raise _form(path, "vehicles", "io.crash-json-no-table")
    title = whole.get("title", "")
    return CrashRecord(
        path=path,
        format="json",
        title=clean(title) if isinstance(title, str) else "",
        facts=_texts(whole.get("facts", {}), path, "facts"),
        channels=tuple(channels),
        files=(path,),
        vehicles={
            clean(number, LONGEST_NAME): _texts(facts, path, f"vehicles {clean(number, 20)}")
            for number, facts in vehicles.items()
        },
    )


def _texts(table: object, path: Path, quantity: str) -> dict[str, str]:
    if not isinstance(table, dict):
        raise _form(path, quantity, "io.crash-json-no-table")
    return {clean(k, LONGEST_NAME): clean(str(v)) for k, v in table.items()}


def _loader(time: Array, values: Array) -> Callable[[], tuple[Array, Array]]:
    return lambda: (time.copy(), values.copy())


def _parsed(path: Path) -> dict[str, Any]:
    size = path.stat().st_size
    if size > LARGEST:
        raise _form(path, "the file", "io.crash-json-too-large", size=size)
    try:
        whole = json.loads(path.read_bytes().decode("utf-8-sig"))
    except json.JSONDecodeError as error:
        raise DataError(
            "io.json-ends-or-breaks-off",
            file=path.name,
            row=error.lineno,
            colno=error.colno,
            msg=error.msg,
        ) from None
    except (UnicodeDecodeError, RecursionError, ValueError):
        raise _form(path, "the file", "io.crash-json-no-record") from None
    if not isinstance(whole, dict) or whole.get("format") != FORMAT:
        raise _form(path, "format", "io.crash-json-other-format")
    if whole.get("version") != VERSION:
        raise _form(
            path,
            "version",
            "io.crash-json-other-version",
            get=str(whole.get("version"))[:40],
            version=VERSION,
        )
    return whole


def _list(whole: dict[str, Any], key: str, path: Path) -> list[Any]:
    found = whole.get(key)
    if not isinstance(found, list) or not found:
        raise _form(path, key, "io.crash-json-no-list")
    return found


def _numbers(values: object, path: Path, quantity: str) -> Array:
    if not isinstance(values, list):
        raise _form(path, quantity, "io.crash-json-no-numbers")
    plain = [float("nan") if v is None else v for v in values]
    for k, v in enumerate(plain):
        if isinstance(v, bool) or not isinstance(v, int | float) or abs(v) == float("inf"):
            raise _form(path, quantity, "io.crash-json-no-number", k=k + 1, v=str(v)[:40])
    try:
        return np.array(plain, dtype=np.float64)
    except OverflowError:
        raise _form(path, quantity, "io.crash-json-too-large-number") from None


def _form(path: Path, quantity: str, code: str, **data: Any) -> DataError:
    return DataError(code, file=path.name, quantity=quantity, **data)

"""JSON of samples: lines of one object each, or one list of objects.

Names of members are joined by a dot (``{"gyro": {"x": 0.1}}`` is ``gyro.x``), parts of lists are
numbered from 0 (``gyro[0]``); they are then understood as those of any table. Objects of several
sensors, whose kind a member ``sensor``, ``type``, ``name`` or ``kind`` states, are read as events
(`android_events`).
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from strapdown.errors import DataError, Finding
from strapdown.formats import csv
from strapdown.formats.android_events import joined, kind_of
from strapdown.formats.columns import read_name
from strapdown.formats.known_formats import from_json
from strapdown.formats.recording import RawLog
from strapdown.formats.signs import Signs, head

SUFFIXES = (".json", ".jsonl", ".ndjson", ".jsonlines", ".ldjson")
KINDS = ("sensor", "type", "name", "kind", "sensorType", "sensor_type")
#: Deepest nesting that is unfolded.
DEEP = 6


def _is_object(line: str) -> bool:
    try:
        return isinstance(json.loads(line), dict)
    except (ValueError, RecursionError):
        return False


def _begins(path: Path) -> bool:
    """Whether an object is at the beginning."""
    text = head(path).lstrip()
    if path.suffix.lower() in SUFFIXES[:1] and text.startswith("["):
        return text[1:].lstrip().startswith("{")
    return _is_object(text.partition("\n")[0])


detect = Signs(suffixes=(*SUFFIXES, ".txt", ".log"), text=r"\A\s*+[\[{]", also=_begins)


def read(path: Path) -> RawLog:
    """Read the members of the objects as columns, missing ones as NaN.

    Raises
    ------
    DataError
        A line is not JSON, a value is neither a number nor a text, or the file has no object.
    """
    objects, rows, findings = _objects(path)
    kind = next(
        (k for k in KINDS if len({kind_of(str(o.get(k))) for o in objects} - {None}) > 1), None
    )
    flat = [_unfolded(o) for o in objects]
    if kind is not None and any(
        kind_of(str(o.get(kind))) in ("gyro", "gyro uncalibrated") for o in objects
    ):
        return _events(path, flat, rows, kind, findings)
    columns = {}
    for name in dict.fromkeys(n for one in flat for n in one):
        values = [one.get(name) for one in flat]
        if any(isinstance(v, str) for v in values):
            columns[name] = np.array(["" if v is None else str(v) for v in values], dtype=object)
        else:
            whole = all(isinstance(v, int) for v in values)
            columns[name] = np.array(
                [np.nan if v is None else v for v in values], dtype=None if whole else np.float64
            )
    return RawLog(path.name, (path,), columns, rows=np.array(rows), findings=findings)


def _objects(path: Path) -> tuple[list[dict[str, Any]], list[int], list[Finding]]:
    """Return the objects, each with its line or its number in the list."""
    text, findings = csv.decoded(path.read_bytes(), path.name)
    if text.lstrip().startswith("["):
        content = from_json(path)
        if not content or not all(isinstance(o, dict) for o in content):
            raise DataError("io.not-list-records", file=path.name)
        return content, list(range(1, len(content) + 1)), findings
    objects: list[dict[str, Any]] = []
    rows: list[int] = []
    lines = text.splitlines()
    for row, line in enumerate(lines, 1):
        if not line.strip():
            continue
        try:
            one = json.loads(line)
        except (ValueError, RecursionError) as error:
            if row == len(lines) and objects and not text.endswith("\n"):
                findings.append(
                    Finding("io.last-line-cut-left-out", file=path.name, row=row, severity="note")
                )
                continue
            raise DataError("io.no-json", file=path.name, row=row, msg=str(error)) from None
        if not isinstance(one, dict):
            raise DataError("io.not-list-records", file=path.name, row=row)
        objects.append(one)
        rows.append(row)
    return objects, rows, findings


def _unfolded(value: Any, name: str = "", depth: int = 0) -> dict[str, Any]:
    if depth > DEEP:
        return {}
    if isinstance(value, dict):
        parts = [(f"{name}.{k}" if name else str(k), v) for k, v in value.items()]
    elif isinstance(value, list):
        parts = [(f"{name}[{k}]", v) for k, v in enumerate(value[:16])]
    else:
        plain = value if value is None or isinstance(value, str | int | float) else None
        return {name: plain}
    return {k: v for part, inner in parts for k, v in _unfolded(inner, part, depth + 1).items()}


def _events(
    path: Path, flat: list[dict[str, Any]], rows: list[int], kind: str, findings: list[Finding]
) -> RawLog:
    events: dict[str, list[list[Any]]] = {}
    unit = None
    for one, row in zip(flat, rows, strict=True):
        which = kind_of(str(one.get(kind)))
        if which is None:
            continue
        time = next((n for n in one if read_name(n).quantity == "time"), None)
        axes = [n for a in "xyz" for n in one if n.lower().rpartition(".")[2] == a]
        if len(axes) != 3:
            axes = sorted(n for n in one if n.endswith(("[0]", "[1]", "[2]")))[:3]
        if (
            time is None
            or len(axes) != 3
            or any(not isinstance(one[n], int | float) for n in (time, *axes))
        ):
            raise DataError("io.event-without-values", file=path.name, row=row, quantity=which)
        unit = read_name(time).unit
        events.setdefault(which, []).append([row, one[time], *(one[n] for n in axes)])
    held = {
        k: {n: np.array([e[j] for e in es]) for j, n in enumerate(("row", "time", "x", "y", "z"))}
        for k, es in events.items()
    }
    return joined(path, held, {"time": unit}, findings, android=False)

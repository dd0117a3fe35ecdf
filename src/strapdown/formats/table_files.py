"""Tables in files of their own kind: Excel, JSON, LabVIEW, NumPy, Parquet."""

from __future__ import annotations

import csv as text_csv
import dataclasses
import io
import json
import re
import tempfile
from collections.abc import Mapping
from datetime import datetime, time
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.errors import DataError, Finding, add_note
from strapdown.formats import csv, join
from strapdown.formats.android_events import joined, kind_of
from strapdown.formats.arrays import raw_log
from strapdown.formats.clock_columns import with_one_clock
from strapdown.formats.columns import read_name
from strapdown.formats.gnss_fixes import Fixes
from strapdown.formats.known_formats import from_json, selected, under
from strapdown.formats.phone_apps import with_force_summed
from strapdown.formats.recording import RawLog
from strapdown.formats.sensor_folder import first_line, peek
from strapdown.formats.signs import Signs, first_bytes, head, json_beginning
from strapdown.formats.text_columns import NUMBER, decoded, fields_of
from strapdown.formats.vocabularies import FIXES, TRIADS
from strapdown.parsers import parse
from strapdown.parsers.archives import PACKED, numpy_array
from strapdown.tables.on_disk import room

# Excel workbooks (``.xlsx``) by openpyxl: the sheet with the most numbers, as a table; where it has
# one sensor alone, that and the sheets of the others.
#
# Dates are written as ISO 8601; a cell with a formula has the value that Excel stored. The rest
# is as in a text table with commas (`csv`), headers and lines above them included.


detect_excel = Signs(suffixes=(".xlsx", ".xlsm"), first=rb"\APK\x03\x04")


def read_excel_table(path: Path) -> RawLog:
    """Read the sheet with the most numbers, or one of each sensor, on the stamps of the gyro."""
    sheets = parse("workbooks.sheets", path)
    counts = {
        name: sum(isinstance(c, int | float) for row in rows for c in row)
        for name, rows in sheets.items()
    }
    name = max(counts, key=lambda n: counts[n], default="")
    if not counts.get(name):
        raise DataError("io.excel-without-numbers", file=path.name, sheets=list(sheets))
    of_sensors = {n: _sensors_of(n, rows) for n, rows in sheets.items() if counts[n]}
    used = [n for n, sensors in of_sensors.items() if len(sensors) == 1]
    sensors = [of_sensors[n][0] for n in used]
    whole = len(of_sensors[name]) > 1
    if not whole and "gyro" in sensors and len({*sensors}) == len(sensors) > 1:
        logs = [_of_sheet(path, n, sheets[n]) for n in used]
        raw = join.join(logs, path.name, (path,))
    else:
        used, raw = [name], with_force_summed(_of_sheet(path, name, sheets[name]))
    for n in sheets:
        if n not in used and raw.fixes is None and counts[n] and _has_positions(sheets[n]):
            raw.fixes = _of_sheet(path, n, sheets[n])
            used.append(n)
    if others := [n for n in sheets if n not in used]:
        add_note(raw.findings, "io.sheet-read", file=path.name, names=used, others=others)
    return raw


def _sensors_of(title: str, rows: list[list[Any]]) -> list[str]:
    """Return the sensors whose three axes a sheet names beside a clock."""
    names = [_named_by(title, str(cell)) for cell in rows[0]] if rows else []
    said = [read_name(n) for n in names]
    found = {str(s.quantity) for s in said if not s.linear}
    return [t for t in TRIADS if {"time", *(f"{t}_{a}" for a in "xyz")} <= found]


def _has_positions(rows: list[list[Any]]) -> bool:
    return {"time", "lat", "lon"} <= {read_name(str(cell), FIXES).quantity for cell in rows[0]}


def _named_by(title: str, name: str) -> str:
    """Return the name of a column, with that of its sheet before it if it says no quantity."""
    return name if read_name(name).quantity else f"{title} {name}"


def _of_sheet(path: Path, title: str, rows: list[list[Any]]) -> RawLog:
    buffer = io.StringIO()
    width = max(len(row) for row in rows)
    writer = text_csv.writer(buffer, lineterminator="\n")
    for row in rows:
        writer.writerow([_text_of_excel(cell) for cell in [*row, *[None] * (width - len(row))]])
    raw = csv.parse(buffer.getvalue().encode(), path.name, (path,))
    if len(_sensors_of(title, rows)) == 1:
        raw.columns = {_named_by(title, n): values for n, values in raw.columns.items()}
        raw.units = {_named_by(title, n): unit for n, unit in raw.units.items()}
        raw.name = f"{path.name}/{title}"
    return raw


def _text_of_excel(cell: Any) -> str:
    if cell is None:
        return ""
    if isinstance(cell, datetime):
        return cell.isoformat(" ", "microseconds")
    if isinstance(cell, time):
        return cell.isoformat("microseconds")
    return repr(cell) if isinstance(cell, float) else str(cell)


# Files that are compressed by themselves (``.gz``, ``.bz2``, ``.xz``, ``.zst``), and archives of
# one file: read as the file in them, whatever its format.


PACKED_TITLE = "one file in .gz, .bz2, .xz, .zst or .zip"


def _holds_one(path: Path) -> bool:
    if path.suffix.lower() != ".zip":
        return first_bytes(path, 6).startswith(tuple(PACKED))
    members = peek(path)
    if len(members) != 1 or read_name(f"{members[0].stem} x").quantity is not None:
        return False  # of one sensor, which `sensor_folder` reads
    line = first_line(members[0])
    return line[:1] in tuple("[{") or len(fields_of(line)) > 3


detect_packed = Signs(also=_holds_one)


def read_packed(path: Path) -> RawLog:
    """Read the samples of the file in it."""
    raw = _read_inside(path, "imu")
    assert isinstance(raw, RawLog)
    return raw


def read_packed_fixes(path: Path) -> RawLog | Fixes:
    """Read the fixes of the file in it."""
    raw = _read_inside(path, "gnss")
    assert isinstance(raw, RawLog | Fixes)
    return raw


def _read_inside(path: Path, stream: str) -> Any:
    """Read a stream of the file in a compressed file, which is unpacked into a temporary folder."""
    from strapdown.formats import open_stream

    members = peek(path) if path.suffix.lower() == ".zip" else []
    if members:
        name, data = PurePosixPath(members[0].name).name, members[0].read()
    else:
        name, data = path.stem, parse("archives.unpacked", path)
    if data[:4] == b"PK\x03\x04" or data.startswith(tuple(PACKED)) or name.endswith(".tar"):
        raise DataError("io.packed-twice", file=path.name, name=name)
    with tempfile.TemporaryDirectory(prefix="strapdown-") as folder:
        file = Path(folder) / (name or "log.csv")
        file.write_bytes(data)
        try:
            raw = open_stream(file, stream)
        except DataError as error:
            raise DataError(error.finding, file=f"{path.name}/{name}") from None
    return (
        dataclasses.replace(raw, name=path.name, files=(path,)) if isinstance(raw, RawLog) else raw
    )


# JSON of samples: lines of one object each, or one list of objects, alone or as the member of an
# object.
#
# Names of members are joined by a dot (``{"gyro": {"x": 0.1}}`` is ``gyro.x``), parts of lists
# are numbered from 0 (``gyro[0]``); they are then understood as those of any table. Objects of
# several sensors, whose kind a member ``sensor``, ``type``, ``name`` or ``kind`` states, are read
# as events (`android_events`).


JSON_SUFFIXES = (".json", ".jsonl", ".ndjson", ".jsonlines", ".ldjson")
KINDS = ("sensor", "type", "name", "kind", "sensorType", "sensor_type")
#: Deepest nesting that is unfolded, and most parts of a list.
DEEP, PARTS = 6, 16
#: A stamp after the next block by so many of its samples is behind a gap.
LONG_BLOCK = 1.5


def _form(text: str) -> str:
    """Return how the beginning of a text in JSON holds samples, or an empty text.

    ``objects`` or ``rows`` of values: in a list. ``apart``: sensors and their values, as Edge
    Impulse has them (data acquisition format), ``"sensors": [{"name": "accX", "units": "m/s2"}, …],
    "values": [[…], …]``. ``columns``: members of an object, ``{"time": [0.0, …``, or as pandas
    writes a table. ``member``: objects in the first list of an object, ``{"locations": [{…``.
    ``nested``: columns, or rows under a list of names, in an object in an object. ``streams``: a
    list of each as its ``data``.
    """
    value, end = json_beginning(text)
    if _data_of(value)[0]:
        return "streams"
    if isinstance(value, list):
        first = value[0] if value else None
        if isinstance(first, dict) or _rejoined(value) is not None:
            return "objects"
        return "rows" if _begins_plain(first) else ""
    if not isinstance(value, dict):
        return ""
    held = value.get("payload")
    held = held if isinstance(held, dict) else value
    sensors = held.get("sensors")
    of_words = isinstance(sensors, list) and bool(sensors) and isinstance(sensors[0], dict)
    if of_words and _begins_plain(held.get("values")):
        return "apart"
    lines = end > 0 and text[end:].lstrip().startswith("{")
    parts = [v for v in value.values() if _is_part(v)]
    deep = (v for v in parts if isinstance(v, list) or any(map(_is_part, v.values())))
    if isinstance(first := next(deep, None), list) and first and isinstance(first[0], dict):
        return "" if lines else "member"
    part = parts[0] if parts else None
    if "0" in part if isinstance(part, dict) else _begins_plain(part):
        # Of lines of objects, a list is of the parts of a vector: one object of a line alone has
        # longer ones, or numbers its samples.
        if not end or "\n" in text[:end]:
            return "columns"
        long = any("0" in v if isinstance(v, dict) else len(v) > PARTS for v in parts)
        return "columns" if long and not text[end:].strip() else ""
    whole = isinstance(part, list)
    while isinstance(part, dict):
        part = next(filter(_is_part, part.values()), None)
    if whole or not part or part[0] is None or lines:
        return ""
    return "nested"


#: Words for a position of two numbers, as a stream of Strava has them.
_PAIRS = {"latlng", "latlon"}


def _data_of(content: Any) -> tuple[dict[str, list[Any]], dict[str, str]]:
    """Return the columns of objects that have one each as ``data``, and units; empty without.

    ``{"time": {"data": […], "series_type": …}, "latlng": {"data": [[…, …], …]}}`` or a list of
    such objects with their ``type``, as Strava has the streams of an activity.
    """
    held = content
    if isinstance(held, list):
        kinds = [one.get("type") for one in held if isinstance(one, dict)]
        if not all(isinstance(kind, str) for kind in kinds) or len({*kinds}) < len(held):
            return {}, {}  # events, or parts of columns
        held = dict(zip(kinds, held, strict=True))
    if not isinstance(held, dict) or not all(isinstance(one, dict) for one in held.values()):
        return {}, {}
    out: dict[str, list[Any]] = {}
    units: dict[str, str] = {}
    for name, one in held.items():
        values = one.get("data")
        if not _begins_plain(values):
            return {}, {}
        if name.lower() in _PAIRS and all(isinstance(v, list) and len(v) == 2 for v in values):
            out |= {n: [v[k] for v in values] for k, n in enumerate(("lat", "lon"))}
        else:
            out[name] = values
            if unit := one.get("unit", one.get("units")):
                units[name] = str(unit)
    return out, units


def _is_part(value: Any) -> bool:
    return isinstance(value, dict | list)


def _begins_plain(value: Any) -> bool:
    """Whether a list begins with a number or a word, or with a list that does."""
    first = value[0] if isinstance(value, list) and value else None
    first = first[0] if isinstance(first, list) and first else first
    return isinstance(first, str | int | float)


def _begins(path: Path) -> bool:
    """Whether an object is at the beginning."""
    text = head(path).lstrip()
    form = _form(text)
    if path.suffix.lower() in JSON_SUFFIXES[:1] and form in ("objects", "rows", "nested"):
        return True
    if form in ("apart", "member", "columns", "streams"):
        return True
    value, end = json_beginning(text)
    return isinstance(value, dict) and end > 0 and "\n" not in text[:end]


detect_json = Signs(suffixes=(*JSON_SUFFIXES, ".txt", ".log"), text=r"\A\s*+[\[{]", also=_begins)


def read_json_table(path: Path) -> RawLog:
    """Read the members of the objects as columns, missing ones as NaN."""
    form, whole = _form(head(path).lstrip()), None
    if (joined := _of_parts(path)) is not None:
        form, whole = "member", joined
        if isinstance(joined, dict):
            parts = _sensors_apart(joined)
            return _joined(path, parts) if parts else _of_columns(path, joined)
    if form == "apart":
        return _names_apart(path)
    if form in ("columns", "rows"):
        return _by_columns(path)
    if form == "streams":
        return _of_columns(path, *_data_of(from_json(path)))
    if form in ("member", "nested"):
        whole = from_json(path) if whole is None else {"samples": whole}
        content = _unwrapped(whole)
        if parts := _sensors_apart(content):
            return _joined(path, parts)
        if isinstance(content, dict) and any(isinstance(v, list) for v in content.values()):
            lists = [v for v in content.values() if isinstance(v, list)]
            if not all(v and isinstance(v[0], dict) for v in lists):
                return _of_columns(path, content)
    objects, rows, findings = _objects(path, whole if form == "member" else None)
    if blocks := _of_blocks(objects):
        return _joined_blocks(path, blocks, findings)
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
    raw = RawLog(path.name, (path,), columns, rows=np.array(rows), findings=findings)
    return with_force_summed(_with_one_clock(raw))


#: The end of an object and the beginning of another, as lines of objects have them.
_NEXT_LINE = re.compile(r"\}[ \t]*\r?\n[ \t]*\{")


def _of_parts(path: Path) -> Any:
    """Return the samples of a file that has them in several parts, joined; else None.

    Parts are in a list, alone or as the one member of an object, or one in each line.
    """
    text = head(path).lstrip()
    value, _ = json_beginning(text)
    held = [v for v in value.values() if _is_part(v)] if isinstance(value, dict) else [value]
    if len(held) == 1 and _rejoined(held[0]) is not None:
        whole = from_json(path)
        whole = next(filter(_is_part, whole.values())) if isinstance(whole, dict) else whole
        return _rejoined(whole)
    if not isinstance(value, dict) or _rejoined([value]) is None:
        return None
    lines = _NEXT_LINE.search(decoded(path.read_bytes(), path.name)[0])
    return _rejoined(_objects(path)[0]) if lines else None


def _rejoined(parts: Any) -> Any:
    """Return the rows or columns that are parted in a list, each with its stamps; else None.

    A part is a list of objects, an object with one such list, or one of columns. Where parts name
    sensors of several kinds, the rows of each are apart.
    """
    first = parts[0] if isinstance(parts, list) and parts else None
    if isinstance(first, list) and all(isinstance(one, list) for one in parts):
        rows = [row for one in parts for row in one]
        return rows if rows and all(isinstance(row, dict) for row in rows) else None
    if first is None or not all(isinstance(one, dict) for one in parts):
        return None
    lists = {n: v for n, v in first.items() if isinstance(v, list)}
    kind = next((k for k in KINDS if isinstance(first.get(k), str)), None)
    if any(_is_time(n) and len(v) > PARTS and _begins_plain(v) for n, v in lists.items()):
        if kind is not None or any(isinstance(v, dict) for v in first.values()):
            return None
        if not all(isinstance(one.get(name), list) for one in parts[:-1] for name in lists):
            return None
        return {name: [v for one in parts for v in one.get(name) or ()] for name in lists}
    name = next(iter(lists), "")
    if len(lists) != 1 or not all(isinstance(one.get(name), list) for one in parts[:-1]):
        return None
    rows = lists[name]
    if not rows or not isinstance(rows[0], dict) or not any(map(_is_time, rows[0])):
        return None
    kinds: dict[str, list[Any]] = {}
    for one in parts:
        kinds.setdefault(str(one.get(kind)), []).extend(one.get(name) or ())
    return kinds if len(kinds) > 1 else next(iter(kinds.values()))


def read_json_fixes(path: Path) -> RawLog:
    """Read the object of fixes of an object of sensors; the table of any other file.

    Objects without a position, as reports of a receiver of another kind, are left out.
    """
    if _form(head(path).lstrip()) in ("member", "nested"):
        for name, columns in _sensors_apart(_unwrapped(from_json(path))).items():
            if {"lat", "lon"} <= {read_name(n, FIXES).quantity for n in columns}:
                arrays = {n: _array_of(values) for n, values in columns.items()}
                return RawLog(f"{path.name}/{name}", (path,), arrays)
    raw = read_json_table(path)
    place = [c for n, c in raw.columns.items() if read_name(n, FIXES).quantity in ("lat", "lon")]
    if len(place) != 2 or any(c.dtype.kind != "f" for c in place):
        return raw
    there = np.isfinite(place[0]) & np.isfinite(place[1])
    if there.all() or not there.any():
        return raw
    raw.note("io.fixes-without-position-left-out", count=int((~there).sum()))
    return selected(raw, there)


def _by_columns(path: Path) -> RawLog:
    """Read the lists of an object as columns, and ``columns`` and ``data`` as pandas writes them.

    DataError: it is not an object, or has no numbers.
    """
    content = _unwrapped(from_json(path))
    if parts := _sensors_apart(content):
        return _joined(path, parts)
    return _of_columns(path, content)


def _of_columns(path: Path, content: Any, stated: Mapping[str, str] | None = None) -> RawLog:
    held = content if isinstance(content, dict) else {"rows": content}
    # Columns of a sensor are members of it: {"time": […], "gyro": {"x": […], …}}.
    units = dict(stated or {})
    for name, inner in list(held.items()):
        lists = inner if isinstance(inner, dict) else {}
        lists = {f"{name}.{n}": v for n, v in lists.items() if isinstance(v, list)}
        if lists:
            held = {n: v for n, v in held.items() if n != name} | lists
            unit = next((str(inner[n]) for n in ("unit", "units") if n in inner), None)
            units |= dict.fromkeys(lists, unit) if unit else {}
    tables = [v for v in held.values() if isinstance(v, list) and v and isinstance(v[0], list)]
    if len(tables) == 1 and len(tables[0][0]) > 3:
        rows, width = [row for row in tables[0] if isinstance(row, list)], len(tables[0][0])
        heads = [v for v in held.values() if _are_names(v, width)]
        if not heads and _are_names(rows[0], width):
            heads, rows = [rows[0]], rows[1:]
        if len(heads) == 1 and all(len(row) == width for row in rows):
            held = {str(n): [row[k] for row in rows] for k, n in enumerate(heads[0])}
    arrays: dict[str, NDArray[Any]] = {}
    meta: dict[str, Any] = {}
    for name, values in held.items():
        given = list(values.values()) if isinstance(values, dict) else values
        if not isinstance(given, list):
            meta[str(name)] = given
            continue
        arrays[str(name)] = _array_of(given)
    return with_force_summed(_with_one_clock(raw_log(path, arrays, units, meta)))


def _are_names(value: Any, width: int) -> bool:
    """Whether a value is a list of names, as many as a row has columns."""
    return (
        isinstance(value, list) and len(value) == width and all(isinstance(n, str) for n in value)
    )


def _unwrapped(content: Any) -> Any:
    """Return the one object in an object whose other values are words and numbers."""
    while isinstance(content, dict):
        inside = [v for v in content.values() if isinstance(v, dict | list)]
        if len(inside) != 1 or not isinstance(inside[0], dict):
            break
        content = inside[0]
    return content


def _sensors_apart(content: Any) -> dict[str, dict[str, list[Any]]]:
    """Return the columns of each sensor in an object of sensors, each with its own clock.

    A sensor is an object of columns or a list of objects; empty if there are none.
    """
    out: dict[str, dict[str, list[Any]]] = {}
    for name, held in content.items() if isinstance(content, dict) else ():
        if isinstance(held, list) and held and all(isinstance(one, dict) for one in held):
            flat = [_unfolded(one) for one in held]
            columns = {n: [one.get(n) for one in flat] for n in flat[0]}
        elif isinstance(held, dict) and held and all(isinstance(v, list) for v in held.values()):
            columns = held
        else:
            continue
        if any(read_name(n).quantity == "time" for n in columns):
            # x, y and z of the sensor.
            out[str(name)] = {
                f"{name} {n}" if n.lower() in tuple("xyz") else n: values
                for n, values in columns.items()
            }
    return out if len(out) > 1 else {}


def _joined(path: Path, parts: dict[str, dict[str, list[Any]]]) -> RawLog:
    """Join the sensors of an object on the stamps of the gyro."""
    logs = []
    for name, columns in parts.items():
        arrays = {n: _array_of(values) for n, values in columns.items()}
        if len({a.size for a in arrays.values()}) == 1:
            logs.append(RawLog(f"{path.name}/{name}", (path,), arrays))
    return join.join(logs, path.name, (path,))


#: By sensor: the name of its clock, the stamps of its blocks, their samples, and names of these.
Blocks = dict[str, tuple[str, list[float], list[list[list[Any]]], list[str]]]


def _of_blocks(objects: list[dict[str, Any]]) -> Blocks:
    """Return the blocks of samples that objects hold under one stamp each; empty if they do not.

    ``{"acc": {"Timestamp": 20, "ArrayAcc": [{"x": 0.1, …}, …]}}`` as Movesense writes them, and
    ``{"timestamp": 20, "gyroscope": {"x": [0.1, …], "y": […], "z": […]}}`` as watches of Garmin.
    """
    out: Blocks = {}
    for one in objects:
        held = one
        while len(held) == 1 and isinstance(inside := next(iter(held.values())), dict):
            held = inside
        stamps = [n for n, v in held.items() if isinstance(v, int | float) and _is_time(n)]
        sensors: dict[str, list[list[Any]]] = {}
        for name, value in held.items():
            axes = value[0] if isinstance(value, list) and value else value
            rows = isinstance(axes, list) and len(axes) == len("xyz")
            if not rows and not (isinstance(axes, dict) and {*"xyz"} <= axes.keys()):
                continue
            if rows:
                columns = [[v[k] for v in value if len(v) == len("xyz")] for k in range(3)]
            elif value is axes:
                columns = [value[a] if isinstance(value[a], list) else [] for a in "xyz"]
            else:
                columns = [[v.get(a) for v in value if isinstance(v, dict)] for a in "xyz"]
            sensors[name.removeprefix("Array")] = [list(row) for row in zip(*columns, strict=False)]
        sizes = {len(rows) for rows in sensors.values()}
        if len(stamps) != 1 or len(sizes) != 1 or sizes == {0}:
            return {}
        names = [f"{name} {a}" for name in sensors for a in "xyz"]
        _, times, blocks, _ = out.setdefault(" ".join(sensors), (stamps[0], [], [], names))
        times.append(held[stamps[0]])
        samples = zip(*sensors.values(), strict=True)
        blocks.append([[v for row in rows for v in row] for rows in samples])
    return out


def _is_time(name: str) -> bool:
    return read_name(name).quantity == "time"


def _joined_blocks(path: Path, blocks: Blocks, findings: list[Finding]) -> RawLog:
    """Spread the samples of blocks evenly between their stamps, and join the sensors."""
    parts: dict[str, dict[str, list[Any]]] = {}
    for sensor, (clock, times, rows, names) in blocks.items():
        sizes = np.array([len(one) for one in rows])
        stamps = np.array(times, dtype=np.float64)
        steps = np.diff(stamps) / sizes[:-1]
        usual = float(np.median(steps)) if steps.size else 0.0
        # The block before a gap ends as others do.
        steps = np.where(np.abs(steps) < LONG_BLOCK * abs(usual), steps, usual)
        steps = np.append(steps, usual)
        at = [
            t + k * dt
            for t, dt, n in zip(times, steps.tolist(), sizes, strict=True)
            for k in range(n)
        ]
        values = [row for block in rows for row in block]
        parts[sensor] = {clock: at, **{n: [v[k] for v in values] for k, n in enumerate(names)}}
        if sizes.max() > 1:
            add_note(
                findings,
                "io.stamps-of-blocks",
                file=path.name,
                quantity=sensor,
                count=int(np.median(sizes)),
            )
    if len(parts) > 1:
        raw = _joined(path, parts)
    else:
        (only,) = parts.values()
        raw = RawLog(path.name, (path,), {n: _array_of(v) for n, v in only.items()})
    raw.findings[:0] = findings
    return raw


def _array_of(values: list[Any]) -> NDArray[Any]:
    try:
        return np.array(values, dtype=None if all(type(v) is int for v in values) else float)
    except (TypeError, ValueError):
        return _dates_of(values)


def _with_one_clock(raw: RawLog) -> RawLog:
    """Join a clock in parts (`clock_columns`); the same log."""
    if not raw.stated and not raw.checked:
        raw.columns = with_one_clock(raw.columns, raw.units, raw.findings, raw.name)
    return raw


def _dates_of(values: list[Any]) -> NDArray[Any]:
    """Return texts of ISO 8601 as dates of UTC; other values as they are, which are not read."""
    try:
        dates = pd.to_datetime(pd.Series(values), format="ISO8601", utc=True)
        return dates.dt.tz_localize(None).to_numpy()
    except (TypeError, ValueError):
        return np.array([str(v) for v in values], dtype=object)


def _names_apart(path: Path) -> RawLog:
    """Read rows of values under a list of names and units, at a constant interval."""
    content = from_json(path)
    held = content if isinstance(content, dict) else {}
    held = held.get("payload", held)
    sensors, values = held.get("sensors"), held.get("values")
    try:
        names = [str(one["name"]) for one in sensors]
        units = {str(one["name"]): str(one.get("units", "")) for one in sensors}
        table = np.array(values, dtype=np.float64)
        step = float(held.get("interval_ms") or 0.0)
    except (TypeError, KeyError, ValueError, AttributeError):
        raise DataError("io.not-list-records", file=path.name) from None
    if table.ndim != 2 or table.shape[1] != len(names):
        raise DataError("io.not-list-records", file=path.name)
    return RawLog(
        path.name,
        (path,),
        {name: np.ascontiguousarray(table[:, k]) for k, name in enumerate(names)},
        units={name: unit for name, unit in units.items() if unit and unit != "N/A"},
        rate=1000.0 / step if 0.0 < step < np.inf else None,
    )


def _objects(
    path: Path, whole: Any = None
) -> tuple[list[dict[str, Any]], list[int], list[Finding]]:
    """Return the objects, each with its line or its number in the list.

    `whole`: an object of which the first list has them, parsed before.
    """
    text, findings = decoded(path.read_bytes(), path.name)
    if text.lstrip().startswith("[") or whole is not None:
        content = from_json(path) if whole is None else whole
        if isinstance(content, dict):
            content = next((v for v in content.values() if isinstance(v, list)), [])
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
                add_note(findings, "io.last-line-cut-left-out", file=path.name, row=row)
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
        parts = [(f"{name}[{k}]", v) for k, v in enumerate(value[:PARTS])]
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


# Measurement files of LabVIEW (``.lvm``): a text table under two headers.
#
# The first header names separator and decimal sign; the second has a value of each channel in a
# line, among them ``Y_Unit_Label`` and ``Delta_X`` (National Instruments, Specification for the
# LabVIEW Measurement File). ``X_Value`` is time in s; without it, ``Delta_X`` is the step. The
# last name is ``Comment``, whose field is most often missing in the rows.


LABVIEW_MAGIC, END = "LabVIEW Measurement", "***End_of_Header***"


detect_labview = Signs(text=rf"\A{LABVIEW_MAGIC}")


def read_labview_table(path: Path) -> RawLog:
    """Read the channels, with the units that the header states."""
    text, _ = decoded(path.read_bytes(), path.name)
    lines = text.split("\n")
    ends = [k for k, line in enumerate(lines) if line.startswith(END)]
    if len(ends) != 2 or len(lines) < ends[1] + 3:
        raise DataError("io.labview-headers", file=path.name, count=len(ends))
    about = [line.rstrip("\r").split("\t") for line in lines[: ends[1]]]
    said = {fields[0]: fields[1:] for fields in about}
    names = lines[ends[1] + 1].rstrip("\r").split("\t")
    width = len(lines[ends[1] + 2].rstrip("\r").split("\t"))
    names = ["time" if n == "X_Value" else n for n in names[:width]]
    raw = under(path, ends[1] + 1, "\t".join(names))
    units = [u for u in said.get("Y_Unit_Label", ()) if u]
    channels = [n for n in raw.columns if n not in ("time", "Comment")]
    if len(units) == len(channels):
        raw.units |= dict(zip(channels, units, strict=True))
    raw.units |= {"time": "s"} if "time" in raw.columns else {}
    step = next(iter(said.get("Delta_X", ())), "").replace(",", ".")
    stated = NUMBER.fullmatch(step) is not None and 1e-9 < float(step) < 1e9
    if "time" not in raw.columns and stated:
        raw.rate = 1.0 / float(step)
    return raw


# NumPy archives (``.npz``), arrays (``.npy``), and folders of arrays; none is executed.


detect_numpy = Signs(named=(".npz",))


def read_numpy_table(path: Path) -> RawLog:
    """Read the arrays of a NumPy archive; its content is never executed."""
    found = arrays_of(path)
    arrays = {name: array for name, array in found.items() if array.ndim}
    meta = {name: array for name, array in found.items() if not array.ndim}
    return raw_log(path, arrays, {}, meta)


def arrays_of(path: Path) -> dict[str, NDArray[Any]]:
    """Return the arrays of an archive by name."""
    found: dict[str, NDArray[Any]] = parse("archives.arrays", path)
    return found


def write_numpy(path: Path, arrays: dict[str, NDArray[Any]]) -> None:
    """Write arrays; equal input gives identical bytes."""
    with path.open("wb") as stream:  # by a name NumPy would append an ending
        np.savez(stream, allow_pickle=False, **arrays)


# Single NumPy arrays, from files or archives; their content is never executed.


def load_numpy(path: Path, label: str) -> NDArray[Any]:
    """Load the array of a file.

    `label`: for messages. DataError: the array is damaged, declares more data than it holds, or
    holds Python objects.
    """
    try:
        with path.open("rb") as stream:
            found: NDArray[Any] = numpy_array(stream, path.stat().st_size, None, label)
    except DataError:
        raise
    except Exception as error:  # a damaged header can break NumPy's parser
        raise DataError(
            "io.npy-unreadable", file=label, error=error or type(error).__name__
        ) from None
    return found


# Folders of NumPy arrays, one per quantity: ``time.npy``, ``gyro_rad_s.npy``, ``accel.npy``.


detect_numpy_array = Signs(named=(".npy",))


def read_numpy_array_table(path: Path) -> RawLog:
    """Read one array: its fields as columns, or columns without names.

    DataError: the file is damaged, or the array has neither fields nor two dimensions.
    """
    array = np.squeeze(load_numpy(path, path.name))
    if array.dtype.names:
        return raw_log(path, {name: array[name] for name in array.dtype.names}, {}, {})
    if array.ndim != 2:
        raise DataError("io.no-array-of-numbers", file=path.name, arrays=path.stem)
    rows = array if array.shape[0] >= array.shape[1] else array.T
    return raw_log(path, {f"column {k + 1}": rows[:, k] for k in range(rows.shape[1])}, {}, {})


detect_numpy_folder = Signs(
    folder=lambda path: any(
        str(read_name(p.stem).quantity).startswith("gyro") for p in _arrays(path)
    )
)


def read_numpy_folder_table(path: Path) -> RawLog:
    """Read every array of the folder, each under its file name.

    Returns arrays that differ in length from the gyro's are dropped and listed.
    """
    name = path.resolve().name
    arrays: dict[str, NDArray[Any]] = {}
    meta: dict[str, Any] = {}
    files = _arrays(path)
    for file in files:
        array = load_numpy(file, f"{name}/{file.name}")
        (meta if array.ndim == 0 else arrays)[file.stem] = array
    raw = raw_log(path, arrays, {}, meta)
    return dataclasses.replace(raw, name=name, files=tuple(files))


def _arrays(path: Path) -> list[Path]:
    return sorted(p for p in path.glob("*.npy") if p.is_file()) if path.is_dir() else []


# Parquet and Feather tables: columns, lists of three, structures; units where stated in fields.


PARQUET_SUFFIXES = (".parquet", ".pq", ".geoparquet")
PARQUET_MAGIC = b"PAR1"
FEATHER = ".feather"


detect_parquet = Signs(named=(*PARQUET_SUFFIXES, FEATHER), first=rb"\APAR1|\AARROW1")


def read_parquet(path: Path) -> RawLog:
    """Read the numeric columns of a table.

    Columns of structures are named ``structure.field``, those of lists of equal length ``list[0]``,
    ``list[1]`` …; missing values are NaN. The metadata ``unit`` or ``units`` of a field, and
    ``sampling``, ``axes`` and a rate of the table, are understood.
    """
    found = parse("parquet.table", path, room=room)
    raw = raw_log(path, found["arrays"], found["units"], found["meta"])
    return with_force_summed(_with_one_clock(raw))


def write_parquet(
    path: Path,
    columns: dict[str, NDArray[Any]],
    meta: dict[str, str],
    points: NDArray[np.float64] | None = None,
) -> None:
    """Write columns exactly. `columns` ((n,)): names with their unit. `meta`: of the file.

    `points` ((n, 3)): longitude and latitude, deg of WGS 84, and height over the ellipsoid, m, as
    the geometry of a GeoParquet file.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    table = pa.table({name: pa.array(values) for name, values in columns.items()})
    if points is not None:
        table = table.append_column(GEOMETRY, _wkb(points))
        meta = {**meta, "geo": json.dumps(_geo(points))}
    pq.write_table(
        table.replace_schema_metadata(meta),
        path,
        compression="zstd",
        use_dictionary=False,
        use_byte_stream_split=True if points is None else [*columns],
    )


# GeoParquet 1.1 (https://geoparquet.org/releases/v1.1.0/): a column of points in WKB, and the
# metadata ``geo`` of the file. WKB has longitude first, whatever the order of axes of the CRS.

GEOMETRY = "geometry"
_WKB_POINT = np.dtype([("order", "u1"), ("kind", "<u4"), ("at", "<f8", (3,))])
_POINT_Z = 1001
#: EPSG:4979, WGS 84 with heights over the ellipsoid, as PROJJSON; members of the ensemble by their
#: codes.
_MEMBERS = {
    "Transit": 1166,
    "G730": 1152,
    "G873": 1153,
    "G1150": 1154,
    "G1674": 1155,
    "G1762": 1156,
    "G2139": 1309,
    "G2296": 1383,
}
_AXES = (
    ("Geodetic latitude", "Lat", "north", "degree"),
    ("Geodetic longitude", "Lon", "east", "degree"),
    ("Ellipsoidal height", "h", "up", "metre"),
)
EPSG_4979: dict[str, Any] = {
    "$schema": "https://proj.org/schemas/v0.7/projjson.schema.json",
    "type": "GeographicCRS",
    "name": "WGS 84",
    "datum_ensemble": {
        "name": "World Geodetic System 1984 ensemble",
        "members": [
            {
                "name": f"World Geodetic System 1984 ({name})",
                "id": {"authority": "EPSG", "code": code},
            }
            for name, code in _MEMBERS.items()
        ],
        "ellipsoid": {
            "name": "WGS 84",
            "semi_major_axis": 6378137,
            "inverse_flattening": 298.257223563,
        },
        "accuracy": "2.0",
        "id": {"authority": "EPSG", "code": 6326},
    },
    "coordinate_system": {
        "subtype": "ellipsoidal",
        "axis": [
            {"name": name, "abbreviation": short, "direction": to, "unit": unit}
            for name, short, to, unit in _AXES
        ],
    },
    "id": {"authority": "EPSG", "code": 4979},
}


def _wkb(points: NDArray[np.float64]) -> Any:
    """Return an Arrow array of binary: points with height, of the low byte first."""
    import pyarrow as pa

    rows = np.empty(len(points), dtype=_WKB_POINT)
    rows["order"], rows["kind"], rows["at"] = 1, _POINT_Z, points
    ends = np.arange(len(points) + 1, dtype=np.int64) * _WKB_POINT.itemsize
    if ends[-1] < 2**31:
        ends, kind = ends.astype(np.int32), pa.binary()
    else:
        kind = pa.large_binary()
    buffers = [None, pa.py_buffer(ends), pa.py_buffer(rows)]
    return pa.Array.from_buffers(kind, len(points), buffers)


def _geo(points: NDArray[np.float64]) -> dict[str, Any]:
    column: dict[str, Any] = {"encoding": "WKB", "geometry_types": ["Point Z"], "crs": EPSG_4979}
    low, high = points.min(axis=0), points.max(axis=0)
    # A box across the date line has its west beyond its east (RFC 7946, 5.2): it is left out.
    if high[0] - low[0] <= 180.0:
        column["bbox"] = [*low.tolist(), *high.tolist()]
    return {"version": "1.1.0", "primary_column": GEOMETRY, "columns": {GEOMETRY: column}}

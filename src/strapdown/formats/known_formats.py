"""Common part of the readers of known formats: columns of text, sensors of phones, binary logs."""

from __future__ import annotations

import dataclasses
import json
import re
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.errors import DataError, Finding, StrapdownError
from strapdown.formats import csv, gnss_nmea
from strapdown.formats.arrays import numbers
from strapdown.formats.clocks import Clock, with_clock
from strapdown.formats.columns import read_name
from strapdown.formats.find_columns import Column
from strapdown.formats.gnss_fixes import Fixes
from strapdown.formats.join import OwnClock, at_stamps, in_seconds
from strapdown.formats.recording import NoStreamError, RawLog
from strapdown.formats.signs import head
from strapdown.formats.text_columns import decoded, fields_of
from strapdown.tables import trajectory_table
from strapdown.tables.checks import Array


def under(path: Path, skip: int = 0, header: str | None = None, drop: int = 0) -> RawLog:
    """Read the table of a text under lines of another kind.

    `skip`: lines above the table. `header`: names to use instead of those of the file. `drop`:
    further lines under its names that are not data. Rows are counted as in the file. DataError: the
    text ends before its table, or as `csv.parse`.
    """
    text, found = decoded(path.read_bytes(), path.name)
    lines = text.split("\n")
    if len(lines) <= skip + drop + 1:
        raise DataError("io.csv-without-rows", file=path.name, row=len(lines))
    names = lines[skip] if header is None else header
    # Blank lines keep the count of rows.
    kept = [*[""] * skip, names, *[""] * drop, *lines[skip + 1 + drop :]]
    raw = csv.parse("\n".join(kept).encode(), path.name, (path,))
    raw.findings[:0] = found
    return raw


def column(raw: RawLog, name: str) -> NDArray[Any]:
    """Return a column of numbers; NaN where a field is empty.

    DataError: it is missing, or a value is not a number.
    """
    if name not in raw.columns:
        raise raw.fault("io.no-column-4", missing=[name], columns=", ".join(raw.columns))
    return numbers(raw, name, name)


def optional(
    raw: RawLog, names: Mapping[str, tuple[str, str | None]]
) -> dict[str, tuple[NDArray[Any], str | None]]:
    """Return the quantities whose columns are there: `names` has quantity to column and unit."""
    return {q: (column(raw, c), u) for q, (c, u) in names.items() if c in raw.columns}


def stated_by(
    raw: RawLog, quantities: Mapping[str, tuple[NDArray[Any], str | None]], **stated: Any
) -> RawLog:
    """Make a log of quantities of a table, with its rows and its findings."""
    out = RawLog.of(raw.files[0], quantities, **stated)
    out.name, out.rows = raw.name, raw.rows
    out.findings[:0] = raw.findings
    return out


def selected(log: RawLog, keep: NDArray[np.bool_]) -> RawLog:
    """Keep some rows of a log, which remember their row of the file."""
    rows = np.arange(1, keep.size + 1) if log.rows is None else log.rows
    log.columns = {name: values[keep] for name, values in log.columns.items()}
    log.rows = rows[keep]
    return log


def from_json(path: Path) -> Any:
    """Parse a JSON file.

    DataError: it is not JSON, or nested too deeply.
    """
    text, _ = decoded(path.read_bytes(), path.name)
    try:
        return json.loads(text)
    except json.JSONDecodeError as error:
        raise DataError("io.no-json", file=path.name, row=error.lineno, msg=error.msg) from None
    except (RecursionError, ValueError) as error:
        raise DataError("io.no-json", file=path.name, msg=str(error)) from None


def names_of(path: Path) -> list[str]:
    """Return the names in the first line, for format detection."""
    lines = head(path).splitlines()
    return fields_of(lines[0]) if lines else []


def lacking(path: Path, stream: str, title: str, streams: Iterable[str]) -> DataError:
    """Make the error for a file of a known format that lacks a stream, or all streams."""
    name, there = path.resolve().name, list(streams)
    if there:
        return NoStreamError(name, stream, title, there)
    return DataError("io.no-known-stream", file=name, title=title)


# Tables whose rows are of several sensors of one kind, one after another. Flight controllers write
# the rows of two or three inertial sensors under one header (``I`` 0, 1, 0, 1 …), programs those of
# several units (``DeviceName``). Read as one log they are a body that jumps.


#: Names of the column that distinguishes sensors, without signs and blanks, in lower case.
_OF_SENSORS = {
    *("i", "id", "instance", "imu", "imuid", "sensor", "sensorid", "sensorindex", "sensornumber"),
    *("device", "deviceid", "devicename", "unit", "unitid", "node", "nodeid", "board", "address"),
    *("mac", "macaddress", "serial", "serialnumber", "sensorname", "imuname", "tag", "tagid"),
    *("side", "bodypart", "placement", "sensorlocation", "sensorposition"),
}
#: And of one that says the kind of a row's sensor.
_OF_KINDS = {"sensortype", "typeofsensor", "kind", "type", "attribute"}
#: Most sensors of a table, fewest rows of each, and the share of the rows after which another
#: follows: a number that changes less often is a state.
MOST_SENSORS, FEWEST, CHANGES = 16, 10, 0.1
#: Largest scatter of the lengths of runs, as a share of that without order.
REGULAR = 0.5


def _all_have_rates(raw: RawLog, sensors: NDArray[np.str_]) -> bool:
    """Whether most rows of each sensor have a rate: kinds of sensors fill columns of their own."""
    rate = next(c for n, c in raw.columns.items() if read_name(n).quantity == "gyro_x")
    if rate.dtype.kind not in "iuf":
        return False
    known = np.isfinite(rate)
    return all(known[sensors == one].mean() > 0.5 for one in np.unique(sensors))


def _in_turns(sensors: NDArray[np.str_]) -> bool:
    """Whether the values follow each other as the numbers of sensors that are read in turns do.

    Runs of equal values then have one length, in blocks, too; those of a number without order have
    a geometric distribution, by the share of that value.
    """
    begins = np.flatnonzero(np.r_[True, sensors[1:] != sensors[:-1]])
    lengths = np.diff(np.r_[begins, sensors.size])
    for one in np.unique(sensors):
        runs = lengths[sensors[begins] == one]
        if runs.std() > REGULAR * runs.mean() * np.sqrt(np.mean(sensors == one)):
            return False
    return True


def of_one_sensor(raw: RawLog) -> RawLog:
    """Keep the rows of the first of several sensors, with a warning; the same log if it has one.

    DataError: the rows are of sensors of several kinds, in the columns of one.
    """
    there = {read_name(name).quantity for name in raw.columns}
    if "gyro_x" not in there:
        return raw
    for name, texts, counts in _in_turn_by(raw, _OF_SENSORS | _OF_KINDS):
        if not _all_have_rates(raw, texts):
            continue
        said = {read_name(f"{text} x").quantity for text in counts if text[1:]} - {None}
        of_kinds = _plain(name) in _OF_KINDS
        if of_kinds and len(said) < 2 and np.sum(texts[1:] != texts[:-1]) < len(counts):
            continue  # one block each is a kind of motion, too
        if len(said) > 1 or (of_kinds and "accel_x" not in there):
            raise _kinds_in_turn(raw, name, counts)
        # Where kinds hold the values of each other, the most rows are those of their own.
        first = max(counts, key=lambda one: counts[one]) if of_kinds else str(texts[0])
        finding = Finding(
            "io.rows-of-several-sensors",
            severity="warning",
            file=raw.name,
            name=name,
            count=len(counts),
            sensors=[f"{s} ({n} rows)" for s, n in counts.items()],
            first=first,
        )
        raw = selected(raw, texts == first)
        raw.findings.append(finding)
        return raw
    return raw


#: A column of an axis without a sensor: ``X-Axis``, ``value x``.
_BARE_X = re.compile(r"(?:value[\W_]*)?x(?:[\W_]*(?:axis|value|data))?", re.I)


def rows_of_kinds(raw: RawLog, *, asked: bool) -> DataError | None:
    """Make the error for rows of sensors of several kinds in turn; none if there are no such.

    `asked`: whether the user names the gyro; else its columns may be those without a sensor.
    """
    if not (asked or any(_BARE_X.fullmatch(name.strip()) for name in raw.columns)):
        return None
    # A number of a packet's sample is in turns, too: it is not of kinds.
    words = _OF_KINDS if asked else _OF_SENSORS | _OF_KINDS
    for name, _, counts in _in_turn_by(raw, words):
        return _kinds_in_turn(raw, name, counts)
    return None


def _kinds_in_turn(raw: RawLog, name: str, counts: Mapping[str, int]) -> DataError:
    kinds = [f"{kind} ({n} rows)" for kind, n in counts.items()]
    return raw.fault("io.rows-of-kinds", name=name, kinds=kinds)


def _plain(name: str) -> str:
    return re.sub(r"[^a-z0-9]", "", name.lower())


def _in_turn_by(
    raw: RawLog, words: set[str]
) -> Iterator[tuple[str, NDArray[np.str_], dict[str, int]]]:
    """Yield columns whose values tell sensors apart that are read in turns, with their counts."""
    for name, values in raw.columns.items():
        if _plain(name) not in words or values.dtype.kind not in "iuO":
            continue
        texts = values.astype(str)
        sensors, counts = np.unique(texts, return_counts=True)
        changes = np.count_nonzero(texts[1:] != texts[:-1])
        if not 1 < sensors.size <= MOST_SENSORS or counts.min() < FEWEST:
            continue
        # Words tell sensors apart whose rows follow each other in one block each, too: of units, or
        # where time begins anew with each. It goes on where they are of what was done.
        blocks = values.dtype.kind == "O" and changes == sensors.size - 1
        blocks &= _plain(name) in _OF_UNITS or _begins_anew(raw, texts)
        if blocks or (changes >= CHANGES * texts.size and _in_turns(texts)):
            yield name, texts, dict(zip(map(str, sensors), map(int, counts), strict=True))


#: Of them, those whose values are of one unit each.
_OF_UNITS = {"mac", "macaddress", "serial", "serialnumber"}


def _begins_anew(raw: RawLog, texts: NDArray[np.str_]) -> bool:
    """Whether time goes back wherever texts change."""
    at = np.flatnonzero(texts[1:] != texts[:-1])
    clocks = [v for name, v in raw.columns.items() if read_name(name).quantity == "time"]
    return any(bool((stamps[at + 1] < stamps[at]).all()) for stamps in clocks)


# Sensors of phones, each with the sign of its phone.


# The phone's own axes point right, to the top edge, and out of the screen. It is assumed to lie on
# its back with the top edge forward: forward is y, right is x, down is -z.
AXES = "y,x,-z"
XYZ = "xyz"


def sensor_log(
    name: str,
    file: Path,
    columns: Mapping[str, NDArray[Any]],
    triad: str,
    unit: str | None,
    *,
    time: tuple[str, str],
    xyz: tuple[str, str, str] = ("x", "y", "z"),
    rows: NDArray[np.int64] | None = None,
    findings: list[Finding] | None = None,
) -> RawLog:
    """Make the log of one sensor of a phone.

    `name`: for messages. `columns` ((n,)). `triad`: ``gyro``, ``accel`` or ``mag``. `unit`: none if
    unknown. `time` ((str, str)): column of the stamps and their unit. `xyz` ((str, str, str)):
    columns of the three axes.
    """
    return RawLog(
        name=name,
        files=(file,),
        columns=dict(columns),
        rows=rows,
        stated={time[0]: ("time", time[1])}
        | {column: (f"{triad}_{axis}", unit) for column, axis in zip(xyz, XYZ, strict=True)},
        axes=AXES,
        findings=findings or [],
    )


def force_of(linear: RawLog, gravity: RawLog) -> RawLog:
    """Add linear acceleration and gravity, each with the phone's sign, to specific force.

    `linear`, `gravity`: from `sensor_log`, of the triad ``accel``, in one unit. Returns the sum, at
    the stamps of `linear` that gravity covers. DataError: the two do not overlap in time, or a
    value is not a number.
    """
    clocks, values = [], []
    for log in (linear, gravity):
        columns = {q: Column(s, u, "file") for s, (q, u) in log.stated.items()}
        clocks.append(OwnClock(numbers(log, columns["time"].source, "time"), columns["time"].unit))
        found = [numbers(log, columns[f"accel_{a}"].source, f"accel_{a}") for a in XYZ]
        values.append(np.column_stack(found).astype(np.float64))
    time, own = (in_seconds(clock, clocks[0]) for clock in clocks)
    if time.shape == own.shape and np.array_equal(time, own):
        inside, distance, at = np.ones(time.size, dtype=bool), 0.0, values[1]
    else:
        use = np.isfinite(own) & np.isfinite(values[1]).all(axis=1)
        order = np.flatnonzero(use)[np.argsort(own[use], kind="stable")]
        if not order.size:
            raise DataError("io.holds-no-number", file=gravity.name, quantity="accel")
        at, inside, distance = at_stamps(time, own[order], values[1][order])
    if not inside.any():
        raise DataError(
            "io.logs-without-common-time", file=gravity.name, quantity="time", name=linear.name
        )
    total = (values[0] + at)[inside]
    rows = np.arange(1, time.size + 1) if linear.rows is None else linear.rows
    time_column = next(s for s, (q, _) in linear.stated.items() if q == "time")
    sources = [next(s for s, (q, _) in linear.stated.items() if q == f"accel_{a}") for a in XYZ]
    return RawLog(
        name=linear.name,
        files=tuple(dict.fromkeys([*linear.files, *gravity.files])),
        columns={time_column: linear.columns[time_column][inside]}
        | {source: total[:, k] for k, source in enumerate(sources)},
        rows=rows[inside],
        stated=linear.stated,
        axes=linear.axes,
        findings=[
            *linear.findings,
            *gravity.findings,
            Finding(
                "io.force-summed-interpolated" if distance > 0 else "io.force-summed",
                file=linear.name,
                quantity="accel",
                severity="note",
                linear=linear.name,
                gravity=gravity.name,
                distance=distance,
            ),
        ],
    )


# Binary logs: damage, and solutions of their own.


#: Argument of `RawLog.of`.
Quantities = dict[str, tuple[NDArray[Any], str | None]]


_SENTENCE = re.compile(rb"\$(?:[A-Z]{5}|PSAT),[ -#%-)+-~]*\*[0-9A-Fa-f]{2}")


@contextmanager
def damage(path: Path) -> Iterator[None]:
    """Report whatever a library raises on damaged content as a DataError of this file."""
    try:
        yield
    except StrapdownError:
        raise
    except Exception as error:  # libraries document no common class of their errors
        reason = f"{type(error).__name__}: {error}".strip(": ")[:200]
        raise DataError("io.log-damaged", file=path.name, reason=reason) from None


def interpolated(time: Array, own: Array, values: Sequence[NDArray[Any]]) -> Array:
    """Interpolate columns linearly to other stamps; (n, columns), NaN outside."""
    return np.column_stack([np.interp(time, own, v, left=np.nan, right=np.nan) for v in values])


def turned(time: Array, own: Array, q: Array) -> Array:
    """Interpolate attitude quaternions to other stamps within theirs; roll, pitch, heading, deg."""
    flips = np.cumprod(np.concatenate([[1.0], np.where((q[1:] * q[:-1]).sum(axis=1) < 0, -1, 1)]))
    at = interpolated(np.clip(time, own[0], own[-1]), own, list((q * flips[:, None]).T))
    return rotation.euler_from_quaternion(at / np.linalg.norm(at, axis=1, keepdims=True))


def solution(
    path: Path,
    columns: Sequence[Array],
    clock: Clock,
    findings: Sequence[Finding] = (),
    *,
    of_recorder: bool = True,
) -> pd.DataFrame:
    """Make a Trajectory of a solution.

    `columns`: time (s), position, velocity and attitude, (n,) and three of (n, 3); rows with a
    value that is not a number are left out. `of_recorder`: whether the recorder computed it.
    DataError: no row is left, or as `trajectory_table`.
    """
    everything = np.column_stack(columns)
    use = np.isfinite(everything).all(axis=1)
    use &= np.diff(everything[:, 0], prepend=-np.inf) > 0.0
    if not use.any():
        raise DataError("io.solution-without-rows", file=path.name, quantity="reference")
    kept = everything[use]
    table = trajectory_table(kept[:, 0], kept[:, 1:4], kept[:, 4:7], kept[:, 7:], source=path.name)
    table.attrs["ellipsoid"] = "wgs84"
    code = "io.reference-own-solution" if of_recorder else "io.reference-rows"
    count = {"count": int(use.sum()), "size": use.size}
    note = Finding(code, file=path.name, quantity="reference", severity="note", data=count)
    told = of_recorder or not use.all()
    table.attrs["findings"] = (*([note] if told else []), *findings)
    return with_clock(table, clock)


def or_sentences(read: Callable[[Path], RawLog]) -> Callable[[Path], RawLog | Fixes]:
    """Make a reader of fixes that takes NMEA sentences of the stream if it has no own fixes."""

    def either(path: Path) -> RawLog | Fixes:
        try:
            return read(path)
        except NoStreamError:
            found = _SENTENCE.findall(path.read_bytes())
            if not any(sentence[3:6] == b"GGA" for sentence in found):
                raise
        fixes = _of_sentences(path, found, gnss_nmea.read)
        note = Finding("io.fixes-of-sentences", file=path.name, severity="note", count=len(found))
        fixes.findings.append(note)
        return fixes

    return either


def or_headings(read: Callable[[Path], RawLog]) -> Callable[[Path], RawLog]:
    """Make a reader of headings that takes those of NMEA sentences if the stream has no own."""

    def either(path: Path) -> RawLog:
        try:
            return read(path)
        except NoStreamError:
            found = _SENTENCE.findall(path.read_bytes())
            if not any(sentence[3:6] in _HEADINGS for sentence in found):
                raise
        raw = _of_sentences(path, found, gnss_nmea.read_heading)
        return dataclasses.replace(raw, files=(path,), rows=None)

    return either


#: Letters 3 to 5 of sentences with a heading.
_HEADINGS = {b"HDT", b"THS", b"SHR", b"AT,"}
_Read = TypeVar("_Read", RawLog, Fixes)


def _of_sentences(path: Path, found: list[bytes], read: Callable[[Path], _Read]) -> _Read:
    """Read the sentences of a stream as those of a file of its name."""
    with tempfile.TemporaryDirectory() as folder:
        lines = Path(folder) / path.name
        lines.write_bytes(b"\n".join(found))
        return read(lines)

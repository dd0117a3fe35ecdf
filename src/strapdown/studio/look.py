"""What `doctor` finds in the files of a studio, and their streams as pyramids in its cache.

Both are kept under the digest of the files, the keys with which they were read and the sources of
strapdown: a file that changed, or is read in another way, is another log.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
import shutil
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.bundle import sha256, source_digest
from strapdown.config.logs import DoctorSpec, FixesTable, LogTable
from strapdown.config.spec import specify
from strapdown.constants import STANDARD_GRAVITY
from strapdown.errors import ConfigError, DataError, Finding, StrapdownError
from strapdown.formats import files_of, open_stream, read_raw, reader_of
from strapdown.studio.folder import Folder, is_recording, plain_name
from strapdown.studio.pyramid import LIST, write_stream
from strapdown.studio.questions import (
    FOOT,
    HEIGHTS,
    HEIGHTS_OPEN,
    OF_FILES,
    ROLES,
    axes_question,
    heights_question,
    of_each,
    of_file,
    question_of,
)
from strapdown.studio.reading_process import told
from strapdown.tables import find_gaps
from strapdown.tables.checks import index_of

if TYPE_CHECKING:
    from strapdown.systems.doctor import LogDiagnosis

#: Most bytes of the cache; beyond, what was used last longest ago is removed.
CACHE = 4 << 30
#: Names of the parts of the result: gaps and rests that are listed at most.
MOST = 500
#: By how much the mean force of a rest may differ from gravity, m/s²: bias and scale of a low-cost
#: accelerometer.
OF_GRAVITY = 0.5
#: Endings of headers of crash tests, whose samples are in files of their own.
HEADERS = (".ev5", ".mme")
#: Lists of what `look` finds.
PARTS = (
    *("logs", "between", "said", "uses", "findings", "questions", "streams"),
    *("rests", "gaps"),
)
#: Units of columns of the tables, by the name, or its beginning before ``_``.
UNITS = {
    **dict.fromkeys(("gyro_x", "gyro_y", "gyro_z"), "rad/s"),
    **dict.fromkeys(("accel_x", "accel_y", "accel_z"), "m/s²"),
    **dict.fromkeys(("mag_x", "mag_y", "mag_z"), "µT"),
    **dict.fromkeys(("lat", "lon", "roll", "pitch", "heading", "heading_sd"), "deg"),
    **dict.fromkeys(("alt", "height", "height_sd", "north", "east", "down"), "m"),
    **dict.fromkeys(("north_sd", "east_sd", "down_sd"), "m"),
    **dict.fromkeys(("VN", "VE", "VD", "VN_sd", "VE_sd", "VD_sd", "speed", "speed_sd"), "m/s"),
    **dict.fromkeys(("vx", "vy", "vz", "vx_sd", "vy_sd", "vz_sd"), "m/s"),
}


def look(
    folder: Path, names: Sequence[str], log: Mapping[str, Any], axes: str | None = None
) -> dict[str, Any]:
    """Examine files together, and keep their streams.

    Parameters
    ----------
    folder : Path
        Of the studio.
    names : sequence of str
        Of files in it.
    log : mapping
        Keys of a table ``[log]``, for each; under `OF_FILES` those of single files.
    axes : str, optional
        Of each, where none are stated of a file alone.

    Returns
    -------
    dict
        The JSON of `doctor`; ``questions``; ``streams``, each with the ``rests``, ``steady``
        stretches and ``gaps`` of the samples of its file; ``rests``, steady ones too, and ``gaps``
        of the first log.
    """
    from strapdown.report.doctor import diagnosis_json, headline, uses
    from strapdown.systems.doctor import of_other_file, run_doctor

    place = Folder(folder)
    chosen = [place.file(name) for name in names]
    paths = files_of_recorders(chosen)
    if not paths:
        raise ConfigError("studio.nothing-named")
    keys = _reading(log)
    axes = axes or None
    kept = _cache(place) / _key(paths, keys, axes)
    with suppress(OSError, ValueError):
        found: dict[str, Any] = json.loads((kept / "look.json").read_text(encoding="utf-8"))
        if all((_cache(place) / s["key"] / s["name"] / LIST).is_file() for s in found["streams"]):
            os.utime(kept)
            return _with_unused(found, chosen)
    # Names, not paths: the page does not show where the folder is, in which this process is.
    by_name = {place.name_of(path): path for path in paths}
    try:
        made = run_doctor(_examined(list(by_name), keys, axes))
    except DataError as error:
        # Fixes alone, of which only the level of their heights is open: that is asked, too.
        asked = _heights_of([error.finding], by_name)
        if not asked:
            raise
        return {**{part: [] for part in PARTS}, "questions": asked}
    streams: list[dict[str, Any]] = []
    own_stretches = [_stretches(one) for one in made.logs]
    for one, stretches in zip(made.logs, own_stretches, strict=True):
        path = by_name[Path(one.log.path).as_posix()]
        own = _key([path], *of_file(keys, axes, place.name_of(path)))
        lent = one.data["fixes_from"]
        tables = {n: t for n, t in one.streams.items() if not (n == "gnss" and lent)}
        rates = {str(s["name"]): s["rate_hz"] for s in one.data["streams"]}
        for name, table in tables.items():
            listed = _keep(_cache(place) / own, name, table)
            about = {
                "file": place.name_of(path),
                "key": own,
                "name": name,
                "rate_hz": rates.get(name),
                **stretches,
            }
            streams.append({**about, **listed})
        if one.data["crash_record"]:
            for name, about, listed in _channels(_cache(place) / own, path):
                about = {"file": place.name_of(path), "key": own, "name": name, **about}
                streams.append({**about, **stretches, **listed})
    first = next((k for k, one in enumerate(made.logs) if "imu" in one.streams), 0)
    waiting = [f for one in made.logs for f in one.faults if of_other_file(one, f)]
    said = diagnosis_json(made, "studio")
    # Names from the folder of the studio, as in streams and questions: two files may be alike.
    said["logs"] = [
        {**log, "name": Path(one.log.path).as_posix()}
        for log, one in zip(said["logs"], made.logs, strict=True)
    ]
    found = {
        **said,
        "read": sorted(map(str, files_read(paths))),
        "said": [headline(one) for one in made.logs],
        "uses": [{use: one.answer(use) for use in uses(one)} for one in made.logs],
        "findings": [told(f) for one in made.logs for f in (*one.faults, *one.notes)],
        "questions": [
            *_questions(made.logs, keys),
            *_heights_of([*made.between, *dict.fromkeys(waiting)], by_name),
        ],
        "streams": streams,
        # For what may be found out with them: with those that may be of a drive.
        "rests": sorted(own_stretches[first]["rests"] + own_stretches[first]["steady"]),
        "gaps": own_stretches[first]["gaps"],
    }
    _written(kept, found)
    _forget(_cache(place))
    return _with_unused(found, chosen)


#: Files of a folder that are listed as not used, at most.
MOST_UNUSED = 20


def unused_files(paths: Sequence[Path], used: set[Path]) -> list[Finding]:
    """Return findings for files that are not among those used, by resolved path.

    Those of folders, and those that are not recordings.
    """
    inside = [f for path in paths if path.is_dir() for f in sorted(path.iterdir()) if f.is_file()]
    inside += [path for path in paths if not is_recording(path)]
    left = [f for f in inside if not f.name.startswith(".") and f.resolve() not in used]
    here = Path.cwd()
    return [
        Finding(
            "studio.file-not-used",
            severity="note",
            file=(f.relative_to(here) if f.is_absolute() else f).as_posix(),
        )
        for f in left[:MOST_UNUSED]
    ]


def _with_unused(found: Mapping[str, Any], chosen: Sequence[Path]) -> dict[str, Any]:
    """Return what was found, with the files of chosen folders that were not read."""
    shown = {key: value for key, value in found.items() if key != "read"}
    unused = unused_files(chosen, set(map(Path, found["read"])))
    return {**shown, "between": [*shown["between"], *map(told, unused)]}


def files_read(paths: Sequence[Path]) -> set[Path]:
    """Return the files that are read for paths, resolved."""
    read = {path.resolve() for path in paths}
    return read.union(*(_read_of(path, _digest(path)) for path in paths if path.is_dir()))


@lru_cache(maxsize=256)
def _read_of(folder: Path, _: str) -> frozenset[Path]:
    """Files that are read for a folder of this digest, resolved; it is read once for them.

    Of a crash with those it names.
    """
    from strapdown.formats.crash_records import read_crash_record, stated_format

    own: Sequence[Path] = [folder]
    with suppress(StrapdownError):
        of_crash = stated_format(folder) is not None
        own = read_crash_record(folder).files if of_crash else files_of(folder)
    if own == (folder,) and reader_of(folder)[1] is not None:
        # A format whose reader lists no files is the whole folder.
        own = sorted(file for file in folder.rglob("*") if file.is_file())
    with suppress(StrapdownError):
        own = (*own, *read_raw(folder).files)
    return frozenset(file.resolve() for file in own)


#: Why a folder is not a recording: it has those of several sensors.
SEVERAL = ("io.folder-of-recordings", "io.gyro-in-several-logs")


def files_of_recorders(paths: Sequence[Path]) -> list[Path]:
    """Return paths with the tables of a folder in its place, where they are of several recorders.

    A folder is one recorder, whose tables are joined, unless two have a gyro; in place of
    one with a single recording among other files are that recording, and its fixes and references.
    Without what another path names as its own file, and what is not a recording, unless it is all.
    """
    from strapdown.formats.crash_records import files_named

    named = files_named(paths)
    own = [p for p in paths if p.resolve() not in named and is_recording(p)] or paths
    each = (_recordings_in(path, _digest(path)) if path.is_dir() else [path] for path in own)
    return list(dict.fromkeys(one for found in each for one in found))


@lru_cache(maxsize=256)
def _recordings_in(folder: Path, _: str) -> Sequence[Path]:
    """Recordings of a folder of this digest, which is opened once and not for each look."""
    from strapdown.formats.crash_records import stated_format

    # A file of a folder in a folder has no name in the studio.
    if stated_format(folder) is not None or folder.absolute().parent != Path.cwd():
        return [folder]
    try:
        open_stream(folder, "imu", None)
    except StrapdownError as error:
        if error.finding.code in SEVERAL:
            return _tables(folder)
        if error.finding.code == "io.folder-of-one-recording":
            log = Path(str(error.finding.data["path"]))
            beside = [p for p in _files_in(folder) if p.name != log.name and _aids(p)]
            return [log, *beside]
    return [folder]


def _aids(path: Path) -> bool:
    """Whether a file has fixes, or a reference, that go with the samples of another."""
    from strapdown.systems.doctor import run_doctor

    try:
        (one,) = run_doctor(_examined([path.as_posix()], {}, None)).logs
    except StrapdownError as error:
        # Fixes, of which only the level of their heights is open, are asked about.
        return error.finding.code in HEIGHTS_OPEN
    return not {"gnss", "reference"}.isdisjoint(one.streams)


def _files_in(folder: Path) -> list[Path]:
    """List the files of a folder that may be recordings, by name."""
    inside = (p for p in sorted(folder.iterdir()) if p.is_file() and not p.name.startswith("."))
    return [path for path in inside if is_recording(path)]


def _tables(folder: Path) -> list[Path]:
    """List the tables of a folder that can be read as records of a crash, by name."""
    from strapdown.formats.crash_records import read_crash_record

    found = []
    for path in _files_in(folder):
        with suppress(StrapdownError):
            read_crash_record(path)
            found.append(path)
    return found


def _stretches(one: LogDiagnosis) -> dict[str, list[list[float]]]:
    """List rests, steady stretches and gaps of the samples of a log, from and to in s on its clock.

    What neither turns nor shakes is at rest, or moves evenly. It is called a rest where its mean
    force is gravity, and no impact in the log says that it is of a drive.
    """
    found: dict[str, list[list[float]]] = {"rests": [], "steady": [], "gaps": []}
    if "imu" not in one.streams:
        return found
    driven = any(reason.code == "doctor.impact" for reason in one.fit["crash"])
    for rest in one.rests[:MOST]:
        force = math.nan if rest.accel_mean is None else math.hypot(*rest.accel_mean)
        still = abs(force - STANDARD_GRAVITY) < OF_GRAVITY and not driven
        found["rests" if still else "steady"].append([rest.start, rest.end])
    time = index_of(one.streams["imu"])
    if (np.diff(time) > 0.0).all():
        found["gaps"] = [[g.start, g.end] for g in find_gaps(time)[:MOST]]
    return found


#: Quantities of the channels of a crash, as they are called above their curves.
CHANNELS = {
    "acceleration": "Acceleration",
    "rate": "Angular rate",
    "velocity": "Velocity",
    "displacement": "Displacement",
    "force": "Force",
    "": "As recorded",
}


def _channels(folder: Path, path: Path) -> Iterator[tuple[str, dict[str, Any], dict[str, Any]]]:
    """Keep the channels of a record of a crash, those with the same stamps as one stream.

    Yields the name of the stream, its rate, and its list, whose columns have ``title`` and
    ``label``, too: those of one quantity at one position share a title. Values are in SI where the
    unit is known, else as recorded.
    """
    from strapdown.formats.crash_record import QUANTITIES
    from strapdown.formats.crash_records import read_crash_record

    groups: list[tuple[NDArray[np.float64], dict[str, NDArray[np.float64]], list[Any]]] = []
    for channel in read_crash_record(path).channels:
        if channel.quantity not in CHANNELS:
            continue
        # One without stamps or values is said by `doctor`, or by the proposed case.
        with suppress(DataError):
            time, values = channel.load()
            if not time.size or time.size != values.size or not np.isfinite(time).all():
                continue
            same = (g for g in groups if np.array_equal(g[0], time))
            group = next(same, None)
            if group is None:
                groups.append(group := (time, {}, []))
            group[1][channel.name] = np.asarray(values, dtype=np.float64)
            group[2].append(channel)
    for k, (time, values_of, channels) in enumerate(groups, start=1):
        name = "crash" if k == 1 else f"crash-{k}"
        units = {c.name: QUANTITIES.get(c.quantity, "") if c.unit else "" for c in channels}
        table = pd.DataFrame(values_of, pd.Index(time, name="time"))
        listed = _keep(
            folder, name, table, {c: u.replace("m/s2", "m/s²") for c, u in units.items()}
        )
        columns = [
            {**column, "title": _title(one), "label": _label(one)}
            for column, one in zip(listed["columns"], channels, strict=True)
        ]
        length = float(time.max() - time.min())
        rate = (time.size - 1) / length if length > 0.0 else None
        yield name, {"rate_hz": rate}, {**listed, "columns": columns}


def _title(channel: Any) -> str:
    """Quantity and position of a channel: what the channels of one sensor have in common."""
    where = [channel.vehicle and f"vehicle {channel.vehicle}", channel.place]
    body = "" if channel.body == "vehicle" else channel.body
    if body and body.lower() not in channel.place.lower():
        where.append(body)
    return ", ".join([CHANNELS[channel.quantity], *(one for one in where if one)])


def _label(channel: Any) -> str:
    """Name of a channel; with its axis, where the name is a number."""
    return f"{channel.name} {channel.axis}".strip() if channel.name.isdigit() else channel.name


def _heights_of(unread: Sequence[Finding], names: Mapping[str, Path]) -> list[dict[str, Any]]:
    """Return the questions for the level of the heights of files that were not read for it."""
    found = []
    for one in unread:
        name = next((n for n in names if Path(n).name == one.file), str(one.file))
        asked = heights_question(one, name)
        found += [] if asked is None else [asked]
    return found


def _questions(logs: Sequence[Any], keys: Mapping[str, Any]) -> list[dict[str, Any]]:
    """List what the logs leave open, and how the sensor of each is mounted where none says it."""
    from strapdown.systems.doctor import of_other_file

    found = []
    for one in logs:
        name = Path(one.log.path).as_posix()
        columns = of_file(keys, None, name)[0].get("columns", {})
        found += [question_of(f, one.answers, name, columns) for f in one.questions]
        for ask in (heights_question, axes_question):
            own = [f for f in (*one.faults, *one.notes) if not of_other_file(one, f)]
            asked = [ask(f, name) for f in own]
            found += [q for q in asked if q is not None][:1]
    return found


def stream(
    folder: Path, file: str, name: str, log: Mapping[str, Any], axes: str | None = None
) -> str:
    """Return the folder of a kept stream, from the cache; it is read if it is not there."""
    place = Folder(folder)
    path = place.file(file)
    own = of_file(_reading(log), axes or None, file)
    at = _cache(place) / _key([path], *own) / plain_name(name)
    if not (at / LIST).is_file():
        found = look(folder, [file], log, axes)
        if not (at / LIST).is_file():
            known = [one["name"] for one in found["streams"]]
            raise DataError("studio.no-such-stream", file=file, word=name, known=known)
    os.utime(at.parent)
    return str(at)


def kept_stream(
    folder: Path,
    key: str,
    name: str,
    table: Callable[[], pd.DataFrame],
    unit: Callable[[str], str],
) -> str:
    """Return the folder of a table under a key; it is made if it is not there."""
    at = _cache(Folder(folder)) / key
    if not (at / name / LIST).is_file():
        made = table()
        _keep(at, name, made, {str(column): unit(str(column)) for column in made.columns})
        _forget(_cache(Folder(folder)))
    os.utime(at)
    return str(at / name)


def _reading(log: Mapping[str, Any]) -> dict[str, Any]:
    """Return the keys of a table ``[log]`` that say how it is read; ConfigError: it has others."""
    part = ("path", "from_s", "to_s", "duration_s", FOOT, OF_FILES, *ROLES.values())
    keys = _known(log, KEYS, part)
    own = log.get(OF_FILES) or {}
    if not isinstance(own, dict) or not all(isinstance(one, dict) for one in own.values()):
        raise ConfigError("studio.wrong-type", quantity=OF_FILES, wanted="keys by file")
    of_files = {str(name): _known(one, (*KEYS, "axes")) for name, one in own.items()}
    return keys | ({OF_FILES: of_files} if any(of_files.values()) else {})


#: Keys that say how a file is read.
KEYS = (
    *("format", "columns", "gyro_unit", "accel_unit", "time_unit", "sampling", "rate_hz"),
    *("repair", "calibration", HEIGHTS),
)


def _known(
    log: Mapping[str, Any], known: Sequence[str], more: Sequence[str] = ()
) -> dict[str, Any]:
    """Return the keys that are known and have a value; ConfigError: it has others than `more`."""
    for key in log:
        if key not in known and key not in more:
            raise ConfigError("studio.unknown-key", word=str(key), known=known)
    # Zero is a height.
    said = {key: log[key] for key in known if log.get(key) is not None}
    return {key: value for key, value in said.items() if key == HEIGHTS or value}


def _examined(names: Sequence[str], keys: Mapping[str, Any], axes: str | None) -> DoctorSpec:
    """Return what is examined: each file with its own keys and axes."""
    own = [of_file(keys, axes, name) for name in names]
    parts = [of_each(one) for one, _ in own]
    logs = [specify(LogTable, path=n, **p[0]) for n, p in zip(names, parts, strict=True)]
    fixes = [specify(FixesTable, path=n, **p[1]) for n, p in zip(names, parts, strict=True) if p[1]]
    return specify(
        DoctorSpec,
        name=", ".join(Path(name).stem for name in names),
        logs=tuple(logs),
        fixes=tuple(fixes),
        axes=tuple(one or "" for _, one in own),
    )


def _cache(place: Folder) -> Path:
    return place.state / "cache"


def _key(paths: Sequence[Path], keys: Mapping[str, Any], axes: str | None) -> str:
    digests = [[path.name, _digest(path)] for path in paths]
    said = json.dumps([digests, keys, axes, source_digest()], sort_keys=True)
    return hashlib.sha256(said.encode()).hexdigest()[:40]


def _digest(path: Path) -> str:
    """Digest of a file with those that it names, or of all files of a folder."""
    if path.is_file():
        own = [path]
        if path.suffix.lower() in HEADERS:
            from strapdown.formats.crash_records import read_crash_record

            with suppress(StrapdownError):
                own = sorted({path, *read_crash_record(path).files})
        parts = [(one, one.stat()) for one in own]
        return " ".join(_known_digest(p, a.st_size, a.st_mtime_ns) for p, a in parts)
    files = sorted(p for p in path.rglob("*") if p.is_file())
    return hashlib.sha256(
        json.dumps([[p.relative_to(path).as_posix(), sha256(p)] for p in files]).encode()
    ).hexdigest()


_DIGESTS: dict[tuple[Path, int, int], str] = {}


def _known_digest(path: Path, size: int, changed: int) -> str:
    at = (path, size, changed)
    if at not in _DIGESTS:
        if len(_DIGESTS) > MOST:
            _DIGESTS.clear()
        _DIGESTS[at] = sha256(path)
    return _DIGESTS[at]


def _keep(
    folder: Path, name: str, table: pd.DataFrame, units: Mapping[str, str] = UNITS
) -> dict[str, Any]:
    """Write the numbers of a table as a stream, whole or not at all; return its list."""
    target = folder / name
    with suppress(OSError, ValueError):
        return dict(json.loads((target / LIST).read_text(encoding="utf-8")))
    numbers = table.select_dtypes(include="number")
    columns = {str(c): numbers[c].to_numpy(dtype=np.float64) for c in numbers.columns}
    folder.mkdir(parents=True, exist_ok=True)
    staged = Path(tempfile.mkdtemp(dir=folder, prefix=".partial-"))
    try:
        listed = write_stream(staged / "stream", index_of(table), columns, units)
        with suppress(OSError):  # another process was first
            (staged / "stream").rename(target)
    finally:
        shutil.rmtree(staged, ignore_errors=True)
    return listed


def _written(folder: Path, found: Mapping[str, Any]) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    partial = folder / ".look.json"
    partial.write_text(json.dumps(found, allow_nan=False), encoding="utf-8")
    partial.replace(folder / "look.json")


def _forget(cache: Path) -> None:
    """Remove what was used last longest ago, until the cache is within its size."""
    kept = []
    for one in cache.iterdir():
        with suppress(OSError):
            size = sum(p.stat().st_size for p in one.rglob("*") if p.is_file())
            kept.append((one.stat().st_mtime, size, one))
    total = sum(size for _, size, _ in kept)
    for _, size, one in sorted(kept)[:-1]:
        if total <= CACHE:
            return
        shutil.rmtree(one, ignore_errors=True)
        total -= size

"""What `doctor` finds in the files of a studio, and their streams as pyramids in its cache.

Both are kept under the digest of the files, the keys with which they were read and the sources of
strapdown: a file that changed, or is read in another way, is another log.
"""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import tempfile
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from strapdown.bundle import sha256, source_digest
from strapdown.errors import ConfigError, DataError
from strapdown.studio.folder import Folder
from strapdown.studio.pyramid import LIST, write_stream
from strapdown.studio.questions import (
    HEIGHTS,
    axes_question,
    heights_question,
    of_each,
    question_of,
)
from strapdown.studio.reading_process import told
from strapdown.tables import find_gaps
from strapdown.tables.checks import index_of

__all__ = ["CACHE", "kept_stream", "look", "stream"]

#: Most bytes of the cache; beyond, what was used last longest ago is removed.
CACHE = 4 << 30
#: Names of the parts of the result: gaps and rests that are listed at most.
MOST = 500
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
        Keys of a table ``[log]``, for each.
    axes : str, optional

    Returns
    -------
    dict
        The JSON of `doctor`; ``questions``, ``streams``, ``rests`` and ``gaps``.
    """
    from strapdown.api.doctor import doctor
    from strapdown.report.doctor import diagnosis_json, headline, uses

    place = Folder(folder)
    paths = [place.file(name) for name in names]
    if not paths:
        raise ConfigError("studio.nothing-named")
    keys = _reading(log)
    axes = axes or None
    kept = _cache(place) / _key(paths, keys, axes)
    with suppress(OSError, ValueError):
        found: dict[str, Any] = json.loads((kept / "look.json").read_text(encoding="utf-8"))
        if all((_cache(place) / s["key"] / s["name"] / LIST).is_file() for s in found["streams"]):
            os.utime(kept)
            return found
    # Names, not paths: nothing that is shown tells where the folder is, in which this process is.
    by_name = {place.name_of(path): path for path in paths}
    of_log, of_fixes = of_each(keys)
    made = doctor(list(by_name), axes=axes, gnss=of_fixes or None, **of_log)
    streams: list[dict[str, Any]] = []
    for one in made.logs:
        path = by_name[Path(one.log.path).as_posix()]
        own = _key([path], keys, axes)
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
            }
            streams.append({**about, **listed})
    first = next((one for one in made.logs if "imu" in one.streams), made.logs[0])
    gaps = []
    if "imu" in first.streams:
        time = index_of(first.streams["imu"])
        if (np.diff(time) > 0.0).all():
            gaps = [[g.start, g.end] for g in find_gaps(time)[:MOST]]
    found = {
        **diagnosis_json(made),
        "said": [headline(one) for one in made.logs],
        "uses": [{use: one.answer(use) for use in uses(one)} for one in made.logs],
        "findings": [told(f) for one in made.logs for f in (*one.faults, *one.notes)],
        "questions": _questions(made.logs, keys.get("columns", {})),
        "streams": streams,
        "rests": [[rest.start, rest.end] for rest in first.rests[:MOST]],
        "gaps": gaps,
    }
    _written(kept, found)
    _forget(_cache(place))
    return found


def _questions(logs: Sequence[Any], columns: Mapping[str, str]) -> list[dict[str, Any]]:
    """List what the logs leave open, and how the sensor of each is mounted where none says it."""
    found = []
    for one in logs:
        name = Path(one.log.path).as_posix()
        found += [question_of(f, one.answers, name, columns) for f in one.questions]
        for ask in (heights_question, axes_question):
            asked = [ask(f, name) for f in (*one.faults, *one.notes)]
            found += [q for q in asked if q is not None][:1]
    return found


def stream(
    folder: Path, file: str, name: str, log: Mapping[str, Any], axes: str | None = None
) -> str:
    """Return the folder of a kept stream, from the cache; it is read if it is not there."""
    place = Folder(folder)
    path = place.file(file)
    at = _cache(place) / _key([path], _reading(log), axes or None) / name
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
    known = (
        *("format", "columns", "gyro_unit", "accel_unit", "time_unit", "sampling", "rate_hz"),
        *("repair", "calibration", HEIGHTS),
    )
    part = ("path", "from_s", "to_s", "duration_s")
    for key in log:
        if key not in known and key not in part:
            raise ConfigError("studio.unknown-key", word=str(key), known=known)
    # Zero is a height.
    said = {key: log[key] for key in known if log.get(key) is not None}
    return {key: value for key, value in said.items() if key == HEIGHTS or value}


def _cache(place: Folder) -> Path:
    return place.state / "cache"


def _key(paths: Sequence[Path], keys: Mapping[str, Any], axes: str | None) -> str:
    digests = [[path.name, _digest(path)] for path in paths]
    said = json.dumps([digests, keys, axes, source_digest()], sort_keys=True)
    return hashlib.sha256(said.encode()).hexdigest()[:40]


def _digest(path: Path) -> str:
    """Digest of a file, or of all files of a folder."""
    if path.is_file():
        about = path.stat()
        return _known_digest(path, about.st_size, about.st_mtime_ns)
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

"""Write a log as a clean, canonical file, with a record of everything that was done."""

from __future__ import annotations

import json
import shutil
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.bundle import versions
from strapdown.errors import ConfigError, DataError, Finding
from strapdown.formats import csv, read_log, table_files
from strapdown.formats.clocks import clock_of
from strapdown.formats.gnss_files import read_gnss
from strapdown.formats.gnss_fixes import GnssOptions
from strapdown.formats.recording import CHECKED
from strapdown.formats.trajectory_readers import read_trajectory
from strapdown.formats.triad_units import LIKELY
from strapdown.formats.writers import imu_columns, table_columns
from strapdown.systems.doctor import Diagnosis, LogDiagnosis
from strapdown.tables import POSITION_SD, QUATERNION, TRAJECTORY, VELOCITY, VELOCITY_SD

Columns = Mapping[str, NDArray[Any]]
Write = Callable[[Path, dict[str, NDArray[Any]], dict[str, str]], None]

WRITERS: dict[str, Write] = {".csv": csv.write, ".parquet": table_files.write_parquet}
#: Streams of fixes, a trajectory and other sensors, in files beside that of the samples.
BESIDE = ("gnss", "reference", "magnetometer", "barometer", "wheel", "heading")


def write_clean_log(found: Diagnosis, out: str | Path, *, force: bool = False) -> tuple[Path, ...]:
    """Write the streams of a log in SI and body axes, with increasing stamps and no open question.

    Parameters
    ----------
    found : Diagnosis
        Of one log, and the file of its fixes.
    out : str or Path
        ``.parquet`` or ``.csv``: inertial samples. Other streams are beside it, ``OUT-gnss.csv``,
        and the record of what was done is ``OUT.json``; the file's metadata or comments have it,
        too.
    force : bool
        Replace existing files.

    Returns
    -------
    tuple of Path
        The written files, the record last.

    Raises
    ------
    ConfigError
        There are several logs, a file exists, or the suffix is unknown.
    DataError
        The log leaves something open other than rows to drop; its axes are not stated, and gravity
        contradicts or does not determine that z points down; or it has no samples to write.
    """
    out = Path(out)
    # Fixes in a file of their own are written beside the samples.
    lent = {log.data["fixes_from"] for log in found.logs}
    logs = [log for log in found.logs if log.name not in lent]
    if len(logs) != 1:
        raise ConfigError("doctor.fix-of-several", quantity="--fix", count=len(logs))
    write = WRITERS.get(out.suffix.lower())
    if write is None:
        raise ConfigError("doctor.fix-suffix", quantity="--fix", suffix=out.suffix)
    one = logs[0]
    _refuse_open(one)
    axes_of_clean_log(one)
    parts = _parts(one, out)
    if not parts:
        raise DataError("doctor.fix-without-samples", file=one.name)
    record_file = out.with_suffix(".json")
    for path in (*(path for path, _, _ in parts.values()), record_file):
        if path.exists() and not force:
            raise ConfigError("cli.file-exists", file=str(path), quantity="--fix")
    record = _record(found, one, {name: path.name for name, (path, _, _) in parts.items()})
    text = json.dumps(record, ensure_ascii=False)
    out.absolute().parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=".strapdown-", dir=out.absolute().parent) as folder:
        for path, columns, meta in parts.values():
            write(Path(folder) / path.name, dict(columns), {**meta, "record": text})
        _check(one, {name: Path(folder) / path.name for name, (path, _, _) in parts.items()})
        for path, _, _ in parts.values():
            shutil.move(Path(folder) / path.name, path)
    pretty = json.dumps(record, indent=2, ensure_ascii=False)
    record_file.write_text(f"{pretty}\n", encoding="utf-8", newline="\n")
    return (*(path for path, _, _ in parts.values()), record_file)


def _refuse_open(one: LogDiagnosis) -> None:
    """Refuse a log whose open questions are other than rows to drop."""
    if set(one.answers) <= {"repair"} and one.recording is not None:
        return
    if one.questions:
        answers: dict[str, Any] = {} if one.refused is None else dict(one.refused.data)
        flags = answers.get("flags") or one.data["options"]
        data = {"questions": one.questions, "keys": answers.get("keys", flags), "flags": flags}
        raise DataError("io.questions", file=one.name, **data)
    if not one.streams and one.refused is not None:
        raise DataError(one.refused)


def axes_of_clean_log(one: LogDiagnosis) -> Finding | None:
    """Return that the axes of a clean log are those of the sensor; None if they are stated.

    DataError: they are not stated, and gravity does not show that z points down; or the log has an
    attitude, which is one of stated axes.
    """
    said = [f for f in (*one.faults, *one.notes) if f.code.startswith("io.axes-not-stated")]
    if not said or one.recording is None:
        return None
    (open_axes,) = said
    probability = float(open_axes.data.get("probability", 0.0))
    if probability >= LIKELY and one.recording.truth is None:
        return open_axes.replace(code="doctor.axes-by-gravity", severity="warning")
    code = f"doctor.fix-axes{open_axes.code.removeprefix('io.axes')}"
    raise DataError(code, file=one.name, quantity="axes", data=open_axes.data, flags="--axes AXES")


def _parts(one: LogDiagnosis, out: Path) -> dict[str, tuple[Path, Columns, dict[str, str]]]:
    """Return file, columns and statements of each stream."""
    parts: dict[str, tuple[Path, Columns, dict[str, str]]] = {}
    imu = one.streams.get("imu")
    if imu is not None:
        columns, meta = imu_columns(imu, _truth(one))
        parts["imu"] = (out, columns, {**meta, **_clock(imu)})
    for name in BESIDE:
        table = one.streams.get(name)
        # The truth of a log is among its samples.
        if table is None or (name == "reference" and not set(TRAJECTORY) <= set(table.columns)):
            continue
        if name == "gnss":
            table = _as_stated(table)
        units = table.attrs.get("units")
        columns = table_columns(table) if units is None else _named(table, units)
        path = out.with_name(f"{out.stem}-{name}{out.suffix}") if parts else out
        parts[name] = (path, columns, _clock(table))
    return parts


def _clock(table: pd.DataFrame) -> dict[str, str]:
    clock = clock_of(table)
    return {"clock": clock.name, "clock_origin_s": repr(clock.origin), "checked": CHECKED}


def _truth(one: LogDiagnosis) -> pd.DataFrame | None:
    """Return the attitude of the log at each sample, NaN where it is unknown or does not count."""
    recording, imu = one.recording, one.streams["imu"]
    if recording is None or recording.truth is None:
        return None
    truth = recording.truth
    if recording.scored is not None:
        truth = truth[recording.scored]
    return truth[list(QUATERNION)].reindex(imu.index)


def _as_stated(fixes: pd.DataFrame) -> pd.DataFrame:
    """Return fixes without the standard deviations that were assumed."""
    taken = [
        *(POSITION_SD if "position_sd_taken" in fixes.attrs else ()),
        *(VELOCITY_SD if "velocity_sd_taken" in fixes.attrs else ()),
    ]
    out = fixes.drop(columns=taken)
    if "velocity_sd_taken" in fixes.attrs:
        # A component that is not measured, as the vertical one of speed and course, has no number.
        measured = np.isfinite(fixes[VELOCITY_SD].to_numpy(dtype=np.float64))
        out[VELOCITY] = fixes[VELOCITY].where(measured)
    out.attrs = dict(fixes.attrs)
    return out


def _named(table: pd.DataFrame, units: Mapping[str, str | None]) -> dict[str, NDArray[Any]]:
    """Name the columns of another sensor with their units."""
    columns = {"time_s": table.index.to_numpy(dtype=np.float64)}
    for name in table.columns:
        unit = (units.get(name) or "").replace("/", "_")
        columns[f"{name}_{unit}" if unit else str(name)] = table[name].to_numpy()
    return columns


def _record(found: Diagnosis, one: LogDiagnosis, files: Mapping[str, str]) -> dict[str, Any]:
    """Return everything that was done, as plain data."""
    readings = () if one.recording is None else one.recording.readings
    return {
        "made_by": f"strapdown doctor {versions()['strapdown']}",
        "files": dict(files),
        "source": [
            {"name": file.name, "sha256": digest}
            for source in found.inputs
            for file, digest in zip(source.files, source.digests, strict=True)
        ],
        "options": f"{one.data['options']} {one.data['fixes_options']}".strip(),
        "axes": None if one.recording is None else one.recording.imu.attrs["axes"],
        "columns": [asdict(reading) for reading in readings],
        "streams": list(one.data["streams"]),
        "findings": [f.plain() for f in (*one.questions, *one.faults, *one.notes)],
    }


def _check(one: LogDiagnosis, files: Mapping[str, Path]) -> None:
    """Read the written files back, and compare every number.

    DataError: one differs.
    """
    for name, path in files.items():
        table = one.streams[name]
        if name == "imu":
            same = _equal(read_log(path).imu, table)
        elif name == "gnss":
            options = GnssOptions(
                unstated_position_sd=table.attrs.get("position_sd_taken"),
                unstated_velocity_sd=table.attrs.get("velocity_sd_taken"),
            )
            same = _equal(read_gnss(path, options), table)
        elif name == "reference":
            same = _equal(read_trajectory(path)[list(TRAJECTORY)], table[list(TRAJECTORY)])
        else:
            continue
        if not same:
            raise DataError(Finding("doctor.not-the-same", file=path.name, quantity=name))


def _equal(one: pd.DataFrame, other: pd.DataFrame) -> bool:
    """Whether two tables have the same bits, clock and kind of sampling."""
    keys = ("clock", "clock_origin", "gps_week", "sampling")
    return (
        list(one.columns) == list(other.columns)
        and np.array_equal(one.index.to_numpy(), other.index.to_numpy())
        and np.array_equal(one.to_numpy(), other.to_numpy(), equal_nan=True)
        and all(one.attrs.get(key) == other.attrs.get(key) for key in keys)
    )

"""`write`: streams and tables as files; streams of several files for a conversion."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Callable, Mapping, Sequence
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from strapdown.api.reading import ImuFile, Streams
from strapdown.bundle import read_manifest
from strapdown.config.logs import FixesTable, LogTable
from strapdown.config.spec import specify
from strapdown.errors import (
    ConfigError,
    DataError,
    Finding,
    StrapdownError,
    add_warning,
    check_choice,
)
from strapdown.formats import STREAMS, clocks, open_stream
from strapdown.formats.columns import parse_axes
from strapdown.formats.gnss_files import read_gnss
from strapdown.formats.recording import ABSENT, NoStreamError, RawLog
from strapdown.formats.trajectory_readers import read_trajectory
from strapdown.formats.writers import FileOptions, find_writer, write_streams
from strapdown.tables import GYRO, QUATERNION, attitude_table
from strapdown.tables.checks import GEODETIC, MAG, POSITION_SD
from strapdown.units import ANGLES, MAG_UNITS, PRESSURES, SPEEDS, TIME_UNITS, factor_of

#: A column that identifies the stream of a table, in the order of the tests.
_TELLS = (
    (GYRO[0], "imu"),
    (POSITION_SD[0], "gnss"),
    (GEODETIC[0], "reference"),
    (QUATERNION[0], "reference"),
    (MAG[0], "magnetometer"),
    ("pressure", "barometer"),
    ("speed", "wheel"),
    ("heading", "heading"),
)


def write(
    data: Mapping[str, pd.DataFrame] | pd.DataFrame,
    path: str | Path,
    *,
    format: str | None = None,  # noqa: A002 (the name of the option and of the key)
    epoch: datetime | None = None,
    origin: tuple[float, float, float] | None = None,
    geoid_undulation_m: float | None = None,
    force: bool = False,
) -> tuple[Finding, ...]:
    """Write streams, or one table, in another format: whole or not at all.

    Parameters
    ----------
    data : Streams, mapping of str to DataFrame, or DataFrame
        As of `read`, `read_imu`, `read_gnss`, `read_trajectory`, or the trajectory of a run. A
        mapping names streams: ``imu``, ``gnss``, ``reference``, ``magnetometer``, ``barometer``,
        ``wheel``, ``heading``.
    path : str or Path
        A file, or a folder for formats of several files.
    format : str, optional
        A format of `strapdown modules`; by default that of the path's ending.
    epoch : datetime, optional
        With time zone: the instant of time zero of a clock that is not related to UTC.
    origin : tuple of float, optional
        Latitude and longitude in deg, height over the ellipsoid in m: origin of formats with local
        axes; by default the first position.
    geoid_undulation_m : float, optional
        Height of the geoid over the ellipsoid, for formats with heights over the sea.
    force : bool
        Replace a file, or a folder of the same format, that exists.

    Returns
    -------
    tuple of Finding
        ``io.stream-written`` for each stream that was, with its rows; ``io.stream-not-written``
        for each that the format does not hold; and what else it cannot hold.

    Raises
    ------
    ConfigError
        There is no such format, the path exists or cannot be written, or an option is not valid.
    DataError
        A table is not valid, or the format needs what the streams do not have.
    """
    tables = {_stream_of(data): data} if isinstance(data, pd.DataFrame) else dict(data)
    for name in tables:
        check_choice("api.no-such-stream", STREAMS, quantity="data", name=name)
    options = FileOptions(
        name=getattr(data, "source", None) or Path(path).stem,
        epoch=epoch,
        origin=origin,
        geoid_undulation=geoid_undulation_m,
    )
    return tuple(write_streams(path, tables, format, options=options, force=force))


def _stream_of(table: pd.DataFrame) -> str:
    for column, stream in _TELLS:
        if column in table.columns:
            return stream
    raise DataError(
        "api.table-of-no-stream", quantity="data", columns=list(map(str, table.columns))
    )


def read_streams(
    paths: Sequence[Path],
    log: Mapping[str, Any],
    axes: str | None,
    fixes: Mapping[str, Any],
    wanted: Sequence[str],
) -> tuple[Streams, list[Finding]]:
    """Read every stream of several files for a conversion.

    `log`: keys of a ``[log]``. `axes`: of the sensors. `fixes`: keys of a table of fixes. `wanted`:
    streams that must be readable where they are; others may be refused. Returns the streams, in the
    part of the log that is asked for, with findings of their own, and what was refused.
    ConfigError: two files have one stream. DataError: a wanted stream is refused, or there is none.
    """
    tables: dict[str, pd.DataFrame] = {}
    source: dict[str, Path] = {}
    findings: list[Finding] = []
    absent: list[StrapdownError] = []
    for given in paths:
        for stream, path in _parts(given).items():
            read = _reader(stream, path, log, axes, fixes)
            try:
                table = read()
            except StrapdownError as error:
                if error.finding.code in ABSENT:
                    absent.append(error)
                elif stream in wanted:
                    raise
                else:
                    out = Finding(
                        "api.stream-left-out", file=path.name, quantity=stream, reason=error.finding
                    )
                    findings.append(out)
                continue
            if stream in tables:
                files = [str(source[stream]), str(path)]
                raise ConfigError("api.stream-of-two-files", stream=stream, files=files)
            tables[stream], source[stream] = table, path
    if "reference" not in tables and "imu" in tables and "reference" in tables["imu"].attrs:
        q_nb, stamps = tables["imu"].attrs["reference"]
        truth = attitude_table(stamps, q_nb, tables["imu"].attrs.get("source"))
        truth.attrs |= {k: v for k, v in tables["imu"].attrs.items() if k in clocks.CLOCK}
        tables["reference"] = truth
    if not tables:
        raise absent[0] if absent else DataError("io.no-stream-at-all", file=str(paths[0]))
    part = (log.get("from_s"), log.get("to_s"), log.get("duration_s"))
    if any(p is not None for p in part):
        tables = _cut(tables, part, findings)
    ordered = {name: tables[name] for name in STREAMS if name in tables}
    return Streams(ordered, paths[0].name), findings


def _parts(path: Path) -> dict[str, Path]:
    """Return where each stream may be: in the path itself, or in a file of a result."""
    try:
        read_manifest(path)
    except DataError:
        return dict.fromkeys(STREAMS, path)
    inside = {"imu": "log.*", "reference": "trajectory.*"}
    found: dict[str, Path] = {}
    for stream, pattern in inside.items():
        files = {p.suffix: p for p in sorted(path.glob(pattern))}
        known = [files[end] for end in (".parquet", ".csv", ".npz", ".h5", ".mat") if end in files]
        if known:
            found[stream] = known[0]
    if not found:
        raise DataError("io.result-without-streams", file=path.resolve().name)
    return found


def _reader(
    stream: str, path: Path, log: Mapping[str, Any], axes: str | None, fixes: Mapping[str, Any]
) -> Callable[[], pd.DataFrame]:
    if stream == "imu":
        return lambda: ImuFile(specify(LogTable, path=str(path), **log), axes).read()
    if stream == "reference":
        return lambda: _on_clock_of_run(read_trajectory(path), path)
    # A topic after the format is that of the samples.
    form = (log.get("format") or "").partition(":")[0] or None
    if stream != "gnss":
        return lambda: _beside(path, stream, form, axes)
    keys = {"format": form, "repair": bool(log.get("repair")), **fixes}
    asked = specify(FixesTable, path=str(path), **keys).options()
    # A velocity of unknown accuracy is one, and is written without it.
    known = dataclasses.replace(asked, unstated_position_sd=math.inf, unstated_velocity_sd=1.0)
    return lambda: read_gnss(path, known)


def _on_clock_of_run(trajectory: pd.DataFrame, path: Path) -> pd.DataFrame:
    """Give the trajectory of a navigation result the clock of its samples."""
    run = path.parent / "navigation.json"
    if path.stem != "trajectory" or not run.is_file():
        return trajectory
    clock = json.loads(run.read_text(encoding="utf-8"))["record"].get("clock")
    if clock is None or clocks.clock_of(trajectory).name != clocks.RELATIVE:
        return trajectory
    return clocks.with_clock(
        trajectory, clocks.Clock(clock["name"], clock["origin_s"], clock["gps_week"])
    )


#: Quantities of the streams beside samples and fixes: their columns, units, and that of the table.
_BESIDE: dict[str, tuple[tuple[str, ...], Mapping[str, float], str]] = {
    "magnetometer": (tuple(MAG), MAG_UNITS, "uT"),
    "barometer": (("pressure",), PRESSURES, "Pa"),
    "wheel": (("speed",), SPEEDS, "m/s"),
    "heading": (("heading", "heading_sd"), ANGLES, "deg"),
}


def _beside(path: Path, stream: str, form: str | None, axes: str | None) -> pd.DataFrame:
    """Read a magnetometer (body axes, µT), a barometer (Pa), a wheel (m/s) or a heading (deg).

    Only formats that state what each column is have such a stream. Rows without a number, and
    those not later than the row before, are left out.
    """
    raw = open_stream(path, stream, form)
    names, units, unit = _BESIDE[stream]
    of = {quantity: column for column, (quantity, _) in getattr(raw, "stated", {}).items()}
    names = tuple(n for n in names if n in of or not n.endswith("_sd"))
    if not isinstance(raw, RawLog) or not {"time", *names} <= of.keys():
        raise NoStreamError(path.name, stream, "table", [])
    block = np.column_stack([raw.columns[of[n]].astype(np.float64) for n in names])
    own = raw.stated[of[names[0]]][1] or unit
    block *= factor_of(own, units) / factor_of(unit, units)
    if stream == "magnetometer":
        axis, sign = parse_axes(axes or raw.axes or "x,y,z")
        block = block[:, axis] * np.array(sign)
    ticks, ticks_unit = raw.columns[of["time"]], raw.stated[of["time"]][1]
    usable = np.isfinite(block).all(axis=1) & np.isfinite(ticks.astype(np.float64))
    rows = np.flatnonzero(usable)
    if not rows.size:
        raise DataError("io.no-usable-row", file=path.name)
    stamps = clocks.read_stamps(
        ticks[rows],
        ticks_unit,
        "stated by the file",
        file=path.name,
        row=lambda k: raw.row(int(rows[k])),
        repair=True,
    )
    index = pd.Index(stamps.seconds[stamps.keep], name="time")
    table = pd.DataFrame(block[rows][stamps.keep], columns=list(names), index=index)
    origin = stamps.origin
    table.attrs |= {"source": path.name, "findings": (*raw.findings, *stamps.findings)}
    table.attrs["clock_origin_stamp"] = (origin.stamp, origin.unit)
    first = float(origin.stamp) * factor_of(origin.unit, TIME_UNITS)
    return clocks.with_clock(table, clocks.Clock(raw.clock or clocks.RELATIVE, first))


def _cut(
    tables: Mapping[str, pd.DataFrame],
    part: tuple[float | None, float | None, float | None],
    findings: list[Finding],
) -> dict[str, pd.DataFrame]:
    """Cut every stream to the part of the samples, or to stamps of its own without samples."""
    out = {}
    imu = tables.get("imu")
    for name, table in tables.items():
        if imu is None:
            time = table.index.to_numpy(dtype=np.float64)
            first = time[0] if part[0] is None else part[0]
            last = time[-1] if part[1] is None else part[1]
            last = last if part[2] is None else first + part[2]
            keep = (time >= first) & (time <= last)
        elif clocks.clock_of(table).name == clocks.clock_of(imu).name:
            ns, ends = clocks.own_ns(table), clocks.own_ns(imu)
            keep = (ns >= ends[0]) & (ns <= ends[-1])
        else:
            add_warning(findings, "io.stream-not-cut", quantity=name, stream=name)
            keep = np.ones(len(table), dtype=bool)
        if not keep.any():
            raise ConfigError("io.stream-empty-part", quantity=name, stream=name)
        kept = table[keep]
        kept.attrs = dict(table.attrs)
        out[name] = kept
    return out


def writer_streams(path: Path, form: str | None) -> tuple[str, ...]:
    """Return the streams that the format of a path holds."""
    return tuple(find_writer(path, form)[1].streams)

"""Formats that are written: the table of writers, the mirror of `formats.READERS`.

A writer takes streams by their names (`formats.STREAMS`): ``imu``, ``gnss``, ``reference`` (a
Trajectory or an Attitude table), ``magnetometer``, ``barometer``, ``wheel``, ``heading``. It
returns as findings what the format cannot hold, and what became of stamps that its clock does not
fit.
"""

from __future__ import annotations

import dataclasses
import shutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from functools import partial
from pathlib import Path
from secrets import token_hex
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.errors import ConfigError, DataError, Finding, add_note, check_choice
from strapdown.formats import (
    asl,
    csv,
    gnss_nmea,
    hdf5,
    kf_gins,
    kitti,
    ros,
    table_files,
    tracks,
    tum,
)
from strapdown.formats.clocks import GPS, RELATIVE, UNIX, clock_of, time_column
from strapdown.formats.recording import calibrated_mark
from strapdown.formats.trajectory_writers import (
    told_of,
    write_csv,
    write_geojson,
    write_kml,
    write_parquet,
)
from strapdown.formats.writing import FileOptions as FileOptions
from strapdown.formats.writing import (
    Tables,
    decimal_seconds,
    is_trajectory,
    not_held,
    stream_not_held,
    unix_ns,
)
from strapdown.rotation import within_half_turn
from strapdown.tables import (
    ACCEL,
    EULER,
    GYRO,
    QUATERNION,
    check_attitude,
    check_gnss,
    check_imu,
    check_trajectory,
)
from strapdown.tables.checks import (
    GEODETIC,
    HEIGHTS_AS_STATED,
    MAG,
    NED,
    POSITION_SD,
    VELOCITY,
    VELOCITY_SD,
    height_words,
)

Array = NDArray[Any]
AXES = "forward-right-down"
#: A part that a format holds: always, or of tables with a column.
Part = str | tuple[str, str]


@dataclass(frozen=True)
class Writer:
    """How streams are written in one format.

    `streams`: what it holds of each stream: units, axes, clock. A part that only some tables have
    is a pair with the column that these have. `function`: writes a file, or a folder, that does not
    exist. `reader`: the key of `formats.READERS` that reads it; None if only other programs do.
    `endings`: endings of file names that mean this format; empty for folders. `alone`: whether a
    file holds one stream only: the first of `streams` that there is.
    """

    title: str
    streams: Mapping[str, tuple[Part, ...]]
    function: Callable[[Path, Tables, FileOptions], list[Finding] | None]
    reader: str | None
    endings: tuple[str, ...] = ()
    alone: bool = False

    def write(
        self, path: Path, tables: Tables, options: FileOptions | None = None
    ) -> list[Finding]:
        """Write streams to a path that does not exist; return what could not be held.

        ConfigError: an option does not fit the format. DataError: a table is not valid, or the
        format needs what the streams do not have.
        """
        for stream, table in tables.items():
            _check(stream, table)
        lost = [stream_not_held(self.title, k, tables[k]) for k in tables if k not in self.streams]
        held = {stream: tables[stream] for stream in self.streams if stream in tables}
        if "gnss" in held:
            held["gnss"] = _as_stated(held["gnss"])
        if not held:
            raise DataError("io.written-needs-stream", form=self.title, needed=[*self.streams])
        if self.alone:
            first = next(iter(held))
            kept = {first: held[first]}
            if first == "imu" and _same_rows(held):
                kept["reference"] = held["reference"]
            lost += [_of_own_file(k, held[k]) for k in held if k not in kept]
            held = kept
        chosen = options or FileOptions()
        if any(table.attrs.get(HEIGHTS_AS_STATED) for table in held.values()):
            chosen = dataclasses.replace(chosen, heights_as_stated=True)
        lost += self.function(path, held, chosen) or []
        if self.alone:
            lost += _clock_lost(held)
        left = {f.quantity for f in lost if f.code == "io.stream-not-written"}
        return [*(self._written(k, held) for k in held if k not in left), *lost]

    def _written(self, stream: str, held: Tables) -> Finding:
        table = held[stream]
        there = _known_columns(table)
        if stream == "imu" and _same_rows(held):
            there.add(QUATERNION[0])
        parts = [p for p in self.streams[stream] if isinstance(p, str) or p[1] in there]
        texts = [part if isinstance(part, str) else part[0] for part in parts]
        if stream == "imu" and table.attrs.get("axes", AXES) != AXES:
            texts = ["axes not stated" if text == AXES else text for text in texts]
        return Finding(
            "io.stream-written",
            file=table.attrs.get("source"),
            quantity=stream,
            severity="note",
            rows=len(table),
            held=", ".join(texts),
        )


def _known_columns(table: pd.DataFrame) -> set[str]:
    """Return the columns of a table that hold a value: fixes may state positions alone."""
    columns = set(map(str, table.columns))
    for group, sds in ((VELOCITY, VELOCITY_SD), (POSITION_SD, POSITION_SD)):
        if set(sds) <= columns and not np.isfinite(table[sds].to_numpy(dtype=np.float64)).any():
            columns -= {*group, *sds}
    return columns


def _check(stream: str, table: pd.DataFrame) -> None:
    """Refuse a table that is not one of its stream."""
    if stream == "imu":
        check_imu(table)
    elif stream == "gnss":
        check_gnss(table)
    elif stream == "reference":
        (check_trajectory if is_trajectory(table) else check_attitude)(table)


def _of_own_file(stream: str, table: pd.DataFrame) -> Finding:
    source = table.attrs.get("source")
    data = {"stream": stream, "rows": len(table)}
    return Finding("io.stream-of-own-file", file=source, quantity=stream, data=data)


def _as_stated(gnss: pd.DataFrame) -> pd.DataFrame:
    """Return fixes whose velocities of assumed accuracy have a standard deviation of 0: unknown."""
    if "velocity_sd_taken" not in gnss.attrs:
        return gnss
    sd = gnss[VELOCITY_SD]
    out = gnss.assign(**sd.where(np.isinf(sd), 0.0))
    out.attrs = dict(gnss.attrs)
    return out


def _same_rows(tables: Tables) -> bool:
    """Whether the reference is the attitude of each sample, which becomes further columns."""
    truth = tables.get("reference")
    if truth is None or not set(QUATERNION) <= set(truth.columns):
        return False
    return bool(np.array_equal(truth.index, tables["imu"].index))


# Formats of one table: columns with their units in the names.

_TRIADS = {"gyro": GYRO, "accel": ACCEL, "mag": MAG}
_UNITS = {"gyro": "rad/s", "accel": "m/s2", "mag": "uT"}
_SUFFIX = {"gyro": "_rad_s", "accel": "_m_s2", "mag": "_uT"}
_OF_TABLES = {
    **dict.fromkeys(MAG, _SUFFIX["mag"]),
    **dict.fromkeys(("lat", "lon", *EULER), "_deg"),
    **dict.fromkeys(("alt", "height", *NED), "_m"),
    **dict.fromkeys((*VELOCITY, "speed", "vx", "vy", "vz"), "_m_s"),
    "pressure": "_Pa",
}


def _arrays(imu: pd.DataFrame, truth: pd.DataFrame | None) -> dict[str, Array]:
    """Return triads as arrays of three columns, and the attitude."""
    arrays: dict[str, Array] = {}
    for triad, names in _TRIADS.items():
        if set(names) <= set(imu.columns):
            arrays[triad] = imu[names].to_numpy(dtype=np.float64)
    if truth is not None:
        arrays |= {q: truth[q].to_numpy(dtype=np.float64) for q in QUATERNION}
    return arrays


def imu_columns(
    imu: pd.DataFrame, truth: pd.DataFrame | None
) -> tuple[dict[str, Array], dict[str, str]]:
    """Return the columns of a table, named with their units, and what the file states beside.

    Stamps are those of the table, whatever its clock.
    """
    columns: dict[str, Array] = {"time_s": imu.index.to_numpy(dtype=np.float64)}
    for name, array in _arrays(imu, truth).items():
        if array.ndim == 2:
            for k, axis in enumerate("xyz"):
                columns[f"{name}_{axis}{_SUFFIX[name]}"] = array[:, k]
        else:
            columns[name] = array
    said = {"sampling": imu.attrs["sampling"], "axes": imu.attrs.get("axes", AXES)}
    return columns, said | calibrated_mark(imu)


def table_columns(table: pd.DataFrame) -> dict[str, Array]:
    """Return the columns of a table by time, named after its clock and with their units.

    Stamps are those of the table, whatever the origin of its clock.
    """
    clock = clock_of(table)
    name = {GPS: "gps_sow_s", UNIX: "unix_time_s"}.get(clock.name, "time_s")
    columns: dict[str, Array] = {name: table.index.to_numpy(dtype=np.float64)}
    if clock.name == GPS and clock.week is not None:
        columns["week"] = np.full(len(table), float(clock.week))
    for column in map(str, table.columns):
        unit = _OF_TABLES.get(column.removesuffix("_sd"), "")
        columns[f"{column}{unit}"] = table[column].to_numpy(dtype=np.float64)
    return columns


def table_comments(table: pd.DataFrame) -> dict[str, str]:
    """Return what a file states of a table by time beside its columns: the level of heights."""
    if "alt" not in table.columns:
        return {}
    return {"heights": height_words(as_stated=bool(table.attrs.get(HEIGHTS_AS_STATED)))}


def _columns(tables: Tables) -> tuple[dict[str, Array], dict[str, str]]:
    """Return the columns of the one table of a file on its clock, and what the file states."""
    if "imu" in tables:
        columns, said = imu_columns(tables["imu"], tables.get("reference"))
    else:
        table = next(iter(tables.values()))
        unknown = [c for c in VELOCITY_SD if c in table.columns and (table[c] == 0.0).any()]
        columns = table_columns(table.drop(columns=unknown and VELOCITY_SD))
        said = table_comments(table)
    first = next(iter(columns))
    timed = time_column(next(iter(tables.values())))
    return timed | {name: values for name, values in columns.items() if name != first}, said


def _track_of(tables: Tables) -> pd.DataFrame | None:
    """Return the trajectory if it is the table that a file is to hold."""
    track = tables.get("reference")
    return track if "imu" not in tables and track is not None and is_trajectory(track) else None


def _write_csv(path: Path, tables: Tables, options: FileOptions) -> None:
    if (track := _track_of(tables)) is not None:
        write_csv(path, track, options)
    else:
        csv.write(path, *_columns(tables))


def _write_parquet(path: Path, tables: Tables, options: FileOptions) -> None:
    if (track := _track_of(tables)) is not None:
        write_parquet(path, track, options)
    else:
        table_files.write_parquet(path, *_columns(tables))


def _write_geoparquet(path: Path, tables: Tables, options: FileOptions) -> list[Finding]:
    """Write every row of a trajectory, else of fixes, as a point with all its columns."""
    options.require_wgs84("GeoParquet")
    stream, track, findings = _track_or_fixes(tables, "GeoParquet")
    if track.empty:
        raise DataError("io.trajectory-no-rows")
    points = track[["lon", "lat", "alt"]].to_numpy(dtype=np.float64).copy()
    points[:, 0] = within_half_turn(points[:, 0])
    if stream == "reference":
        write_parquet(path, track, options, points)
        return findings
    columns, _ = _columns({stream: track})
    table_files.write_parquet(path, columns, {"place": told_of(options)["place"]}, points)
    return findings


def _write_npz(path: Path, tables: Tables, options: FileOptions) -> None:
    said = {key: np.array(text) for key, text in _columns(tables)[1].items()}
    table_files.write_numpy(path, _three_columns(tables) | said)


def _write_mat(path: Path, tables: Tables, options: FileOptions) -> None:
    hdf5.write_matlab(path, _three_columns(tables), _columns(tables)[1])


def _three_columns(tables: Tables) -> dict[str, Array]:
    if "imu" not in tables:
        return _columns(tables)[0]
    arrays = _arrays(tables["imu"], tables.get("reference"))
    named = {f"{name}{_SUFFIX.get(name, '')}": array for name, array in arrays.items()}
    return time_column(tables["imu"]) | named


def _write_hdf5(path: Path, tables: Tables, options: FileOptions) -> None:
    if "imu" not in tables:
        hdf5.write(path, _columns(tables)[0], {}, {})
        return
    imu = tables["imu"]
    ((name, stamps),) = time_column(imu).items()
    plain, _, unit = name.rpartition("_")
    arrays = {plain: stamps} | _arrays(imu, tables.get("reference"))
    units = _UNITS | {plain: unit}
    hdf5.write(path, arrays, units, imu_columns(imu, None)[1])


def _clock_lost(tables: Tables) -> list[Finding]:
    """Say that the week of the samples is not held."""
    imu = tables.get("imu")
    if imu is None or (week := clock_of(imu).week) is None:
        return []
    source = imu.attrs.get("source")
    return [Finding("io.written-without-week", file=source, severity="note", week=week)]


def write_attitude_csv(path: Path, attitude: pd.DataFrame) -> None:
    """Write an Attitude table as text."""
    columns = {"time_s": attitude.index.to_numpy(dtype=np.float64)}
    columns |= {q: attitude[q].to_numpy() for q in QUATERNION}
    columns |= {f"{e}_deg": attitude[e].to_numpy() for e in EULER}
    csv.write(
        path, columns, {"attitude": "body forward-right-down to north-east-down, scalar first"}
    )


# Formats of a trajectory.


def _write_tum(path: Path, tables: Tables, options: FileOptions) -> list[Finding]:
    track = _trajectory(tables, "TUM")
    if clock_of(track).name == RELATIVE and options.epoch is None:
        tum.write_tum(path, track, options)
        findings = list[Finding]()
    else:
        stamps, findings = unix_ns(track, options)
        tum.write_tum(path, track, options, decimal_seconds(stamps))
    findings.append(not_held("TUM", "reference", "the velocities", track))
    if options.tum_frame != "ecef":
        first = track[GEODETIC].iloc[0].tolist() if options.origin is None else options.origin
        lat, lon, alt = (float(v) for v in first)
        place = {"lat": lat, "lon": lon, "alt": alt}
        source = track.attrs.get("source")
        add_note(findings, "io.written-origin", file=source, data=place)
    return findings


def _write_map(path: Path, tables: Tables, options: FileOptions, write: Any) -> list[Finding]:
    """Write a map of a trajectory, else of fixes, with dates if the clock is related to UTC."""
    stream, track, findings = _track_or_fixes(tables, "a map")
    if clock_of(track).name != RELATIVE and options.epoch is None:
        stamps, said = unix_ns(track, options)
        findings += said
        if not any(f.code == "io.written-on-own-clock" for f in said):
            zero = int(stamps[0]) // 1000 - round(float(track.index[0]) * 1e6)
            epoch = datetime(1970, 1, 1, tzinfo=UTC) + timedelta(microseconds=zero)
            options = dataclasses.replace(options, epoch=epoch)
    write(path, track, options)
    if len(track) > options.most_points:
        data = {"most": options.most_points, "rows": len(track)}
        source = track.attrs.get("source")
        add_note(findings, "io.written-thinned", file=source, data=data)
    if stream == "reference":
        findings.append(not_held("a map", stream, "attitude and velocities", track))
    elif POSITION_SD[0] in _known_columns(track):
        findings.append(not_held("a map", stream, "standard deviations", track))
    return findings


def _track_or_fixes(tables: Tables, form: str) -> tuple[str, pd.DataFrame, list[Finding]]:
    """Return the stream of positions, and findings on the others."""
    places = {k: t for k, t in tables.items() if k == "gnss" or is_trajectory(t)}
    if not places:
        raise DataError("io.written-needs-stream", form=form, needed=["gnss", "a trajectory"])
    stream, track = next(iter(places.items()))
    return stream, track, [_of_own_file(k, t) for k, t in tables.items() if k != stream]


def _write_nav(path: Path, tables: Tables, options: FileOptions) -> list[Finding]:
    track = _trajectory(tables, "a .nav of KF-GINS")
    if clock_of(track).name == RELATIVE and options.epoch is None:
        kf_gins.write_nav(path, track)
        return []
    return kf_gins.write_dated_nav(path, track, options)


def _trajectory(tables: Tables, form: str) -> pd.DataFrame:
    track = tables["reference"]
    if not is_trajectory(track):
        raise DataError("io.written-needs-stream", form=form, needed=["a trajectory"])
    return track


# The table.

_TABLE: dict[str, tuple[Part, ...]] = {
    "imu": (
        "rad/s",
        ("m/s²", ACCEL[0]),
        ("µT", MAG[0]),
        AXES,
        ("attitude of each sample", QUATERNION[0]),
    ),
    "gnss": ("deg", "m", ("m/s", VELOCITY[0]), ("standard deviations", POSITION_SD[0]), "quality"),
    "reference": (
        ("positions in deg and m", GEODETIC[0]),
        ("velocities in m/s", VELOCITY[0]),
        ("attitude", EULER[0]),
    ),
    "magnetometer": ("µT", AXES),
    "barometer": ("Pa",),
    "wheel": ("m/s",),
    "heading": ("deg",),
}
_PLACES: tuple[Part, ...] = ("positions over WGS 84", "dates", ("speed and course", VELOCITY[0]))
_MAP: dict[str, tuple[Part, ...]] = dict.fromkeys(("reference", "gnss"), ("positions over WGS 84",))

#: In the order in which they are shown; an ending belongs to the first that has it.
WRITERS: dict[str, Writer] = {
    "csv": Writer("text table", _TABLE, _write_csv, "csv", (".csv",), alone=True),
    "parquet": Writer("Parquet", _TABLE, _write_parquet, "parquet", (".parquet",), alone=True),
    "npz": Writer("NumPy archive", _TABLE, _write_npz, "npz", (".npz",), alone=True),
    "h5": Writer("HDF5", _TABLE, _write_hdf5, "hdf5", (".h5", ".hdf5"), alone=True),
    "mat": Writer("MATLAB up to v7", _TABLE, _write_mat, "matlab", (".mat",), alone=True),
    "mcap": Writer(
        "bag of ROS 2 in MCAP",
        {
            "imu": (
                "Imu in rad/s and m/s²",
                ("MagneticField", MAG[0]),
                "forward-left-up",
                "ns since 1970",
            ),
            "gnss": (
                "NavSatFix",
                ("TwistWithCovarianceStamped, east-north-up", VELOCITY[0]),
                "ns since 1970",
            ),
            "magnetometer": ("MagneticField in T", "forward-left-up"),
            "barometer": ("FluidPressure in Pa",),
        },
        ros.write,
        "ros",
        (".mcap",),
    ),
    "euroc": Writer(
        "EuRoC, folder mav0",
        {
            "imu": ("imu0 in rad/s and m/s²", AXES, "ns since 1970"),
            "reference": (
                "state_groundtruth_estimate0",
                ("m, north-west-up at an origin", GEODETIC[0]),
                "quaternion",
            ),
        },
        asl.write,
        "asl",
    ),
    "kitti": Writer(
        "KITTI raw, folder oxts",
        {
            "reference": ("deg, m, m/s, rad", "dates"),
            "imu": ("at the same rows", "rad/s, m/s²", "forward-left-up"),
        },
        kitti.write,
        "kitti",
    ),
    "kf-gins": Writer(
        "KF-GINS, folder",
        {
            "imu": ("imu.txt: increments in rad and m/s", AXES, "seconds of the GPS week"),
            "gnss": (
                "gnss.txt: deg, m",
                ("m/s", VELOCITY[0]),
                ("standard deviations", POSITION_SD[0]),
            ),
            "reference": ("truth.nav: deg, m, m/s",),
        },
        kf_gins.write,
        "kf-gins-folder",
    ),
    "gpx": Writer(
        "GPX track", {"gnss": _PLACES, "reference": _PLACES}, tracks.write_gpx, "gpx", (".gpx",)
    ),
    "nmea": Writer(
        "NMEA 0183",
        {"gnss": (*_PLACES, ("standard deviations", POSITION_SD[0])), "reference": _PLACES},
        gnss_nmea.write,
        "nmea",
        (".nmea",),
    ),
    "tum": Writer(
        "poses as of the TUM RGB-D benchmark",
        {
            "reference": (
                "m, east-north-up at an origin",
                "quaternion of forward-left-up",
                "s since 1970",
            )
        },
        _write_tum,
        "tum",
        (".tum",),
    ),
    "kml": Writer("KML 2.2", _MAP, partial(_write_map, write=write_kml), None, (".kml",)),
    "geojson": Writer(
        "GeoJSON", _MAP, partial(_write_map, write=write_geojson), None, (".geojson",)
    ),
    "geoparquet": Writer(
        "GeoParquet 1.1",
        dict.fromkeys(("reference", "gnss"), (*_MAP["gnss"], "all columns")),
        _write_geoparquet,
        "parquet",
        (".geoparquet",),
    ),
    "nav": Writer(
        "KF-GINS trajectory",
        {"reference": ("deg, m, m/s", "GPS week and seconds of it")},
        _write_nav,
        "kf-gins-nav",
        (".nav",),
    ),
}

#: What `simulate` writes samples in: exact, with the attitude of each.
LOG_FORMATS = ("csv", "parquet", "npz", "h5", "mat")
#: Formats of one file for a trajectory with any clock.
TRAJECTORY_FORMATS = ("csv", "tum", "kml", "geojson", "gpx", "nav", "parquet", "geoparquet")


def log_formats(names: tuple[str, ...]) -> tuple[str, ...]:
    """Look up formats of samples by name.

    `names`: of `LOG_FORMATS`; ``all`` selects every format. ConfigError: a format does not exist.
    """
    for name in names:
        check_choice("io.unknown-writer", (*LOG_FORMATS, "all"), quantity="--format", name=name)
    return LOG_FORMATS if "all" in names else tuple(names)


def find_writer(path: Path, form: str | None) -> tuple[str, Writer]:
    """Return the writer of a format, or that of the ending of a path.

    ConfigError: there is none; the message lists all, with what each holds.
    """
    end = path.suffix.lower()
    name = form or next((n for n, w in WRITERS.items() if end and end in w.endings), None)
    if name not in WRITERS:
        known = [
            Finding("io.writer", name=n, endings=w.endings, streams=list(w.streams), title=w.title)
            for n, w in WRITERS.items()
        ]
        raise ConfigError(
            "io.no-writer-for-ending" if form is None else "io.no-writer",
            file=str(path),
            suffix=path.suffix,
            word=form or end.removeprefix("."),
            known=WRITERS,
            writers=known,
        )
    return name, WRITERS[name]


def write_streams(
    path: str | Path,
    tables: Tables,
    form: str | None = None,
    *,
    options: FileOptions | None = None,
    force: bool = False,
) -> list[Finding]:
    """Write streams, whole or not at all.

    Parameters
    ----------
    path : str or Path
        File, or for some formats a folder.
    tables : mapping of str to DataFrame
        Streams by name.
    form : str, optional
        A key of `WRITERS`; by default that of the path's ending.
    options : FileOptions, optional
    force : bool
        Replace a file, or a folder of this format, that exists.

    Returns
    -------
    list of Finding
        What the format cannot hold, and what became of the stamps.

    Raises
    ------
    ConfigError
        There is no such format, the path exists, or cannot be written.
    DataError
        The format needs what the streams do not have.
    """
    path = Path(path)
    name, writer = find_writer(path, form)
    if path.exists():
        _refuse_existing(path, name, writer, force)
    if not path.absolute().parent.is_dir():
        raise ConfigError("io.not-writable", file=str(path), strerror="no such folder")
    part = path.with_name(f".{path.name}.{token_hex(8)}.part")
    try:
        findings = writer.write(part, tables, options)
        if path.is_dir():
            old = path.with_name(f".{path.name}.{token_hex(8)}.old")
            path.rename(old)
            part.rename(path)
            shutil.rmtree(old, ignore_errors=True)
        else:
            part.replace(path)
    except OSError as error:
        raise ConfigError("io.not-writable", file=str(path), strerror=error.strerror) from None
    finally:
        if part.is_dir():
            shutil.rmtree(part, ignore_errors=True)
        else:
            part.unlink(missing_ok=True)
    return findings


def _refuse_existing(path: Path, name: str, writer: Writer, force: bool) -> None:
    """Refuse to replace what exists: without force, or a folder that is none of this format."""
    from strapdown.formats import READERS

    if path.is_dir() and not any(path.iterdir()):
        return
    if not force:
        raise ConfigError("io.exists", file=str(path))
    if path.is_dir() and (
        writer.endings or writer.reader is None or not READERS[writer.reader].detect(path)
    ):
        raise ConfigError("io.exists-other", file=str(path), form=name)


def write_trajectory(
    path: str | Path,
    trajectory: pd.DataFrame,
    *,
    name: str | None = None,
    options: FileOptions | None = None,
) -> None:
    """Write a trajectory in the format given by the file's suffix.

    Parameters
    ----------
    path : str or Path
        Suffix one of `TRAJECTORY_FORMATS`. An existing file is replaced once the new one is
        complete.
    trajectory : DataFrame
        A Trajectory table.
    name : str, optional
        Title for people who open the file; by default the file name.
    options : FileOptions, optional

    Raises
    ------
    ConfigError
        The suffix is unknown, the folder is missing or not writable, or as the writer.
    DataError
        As the writer.
    """
    path = Path(path)
    chosen = dataclasses.replace(options or FileOptions(), name=name or path.stem)
    write_streams(path, {"reference": trajectory}, options=chosen, force=True)

"""Folders ``oxts`` of KITTI raw recordings: an OXTS RT 3003 with its own solution.

``timestamps.txt`` has one date per line, ``data/0000000000.txt`` and so on have thirty numbers each
(Geiger and others, Vision meets robotics: the KITTI dataset, Int. J. Robotics Research 32 (2013)
1231-1237; dataformat.txt of its development kit): latitude and longitude in deg, height in m; roll,
pitch and yaw in rad; velocity north, east, forward, left, up; acceleration with gravity about x, y,
z and forward, left, up; rates likewise; accuracies of position and velocity in m and m/s; then
states of the receiver. A number that is not measured is nan. x points forward, y left, z up. Roll
is positive with the left side up, pitch with the front down, and yaw counts from east to north:
Rz(yaw) Ry(pitch) Rx(roll) rotates x, y, z to east, north, up. Rows of the folder are counted
from 1.

Poses of KITTI odometry (``00.txt``) have twelve numbers a row: the matrix, three rows of four, from
the axes of the left camera, x right, y down, z forward, to those of its first pose (readme.txt of
its development kit). Stamps are in ``times.txt``. Neither says where on the Earth the first pose is
and how it is oriented: comments at the top do, ``# origin lat lon deg, height m: 49.0 8.4 116`` and
``# roll pitch heading deg: 0 0 57``.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.ellipsoids import WGS84
from strapdown.errors import DataError, Finding
from strapdown.formats import csv
from strapdown.formats.arrays import numbers
from strapdown.formats.clocks import RELATIVE, UNIX, Clock, with_clock
from strapdown.formats.gnss_fixes import Fixes
from strapdown.formats.recording import NoStreamError, RawLog, TruthInSensorAxes
from strapdown.formats.signs import Signs, head
from strapdown.formats.tum import trajectory_of_poses
from strapdown.formats.writing import (
    FLU,
    SECOND,
    FileOptions,
    Tables,
    accel_needed,
    dates,
    imu_not_held,
    is_trajectory,
    stream_not_held,
)
from strapdown.frames import ecef_from_geodetic, q_ne
from strapdown.tables import ACCEL, GYRO, VELOCITY, places_of, trajectory_table
from strapdown.tables import EULER as ANGLES
from strapdown.tables.checks import Array, values_of

TITLE = "KITTI raw, folder oxts"
FIELDS = 30
PLACE, EULER, NORTH_EAST, UP = slice(0, 3), slice(3, 6), slice(6, 8), 10
FORCE, RATE, ACCURACY = slice(11, 14), slice(17, 20), slice(23, 25)
AXES = "x,-y,-z"  # forward, left, up
# From forward, right, down to forward, left, up: half a turn about x.
Q_SB = np.array([0.0, 1.0, 0.0, 0.0])
_NAME = re.compile(r"\d{10}\.txt")


def _has_samples(path: Path) -> bool:
    """Whether there are ``timestamps.txt`` and a first file of thirty numbers."""
    folder = _oxts(path)
    first = None if folder is None else folder / "data" / f"{0:010d}.txt"
    if first is None or not first.is_file():
        return False
    return len(first.read_text(encoding="ascii", errors="replace").split()) == FIELDS


detect = Signs(folder=_has_samples)


def read(path: Path) -> RawLog:
    """Read rates and specific force, with the attitude of the unit's own solution as truth.

    `path`: the folder ``oxts``, or its parent, the folder of the drive. DataError: a file is
    missing or damaged.
    """
    time, values, files = _values(path)
    if np.isnan(values[:, RATE]).all():
        raise NoStreamError(path.resolve().name, "imu", TITLE, ["gnss", "reference"])
    columns = {"timestamp": time}
    stated: dict[str, tuple[str, str | None]] = {"timestamp": ("time", "ns")}
    for triad, part, unit, letter in (("gyro", RATE, "rad/s", "w"), ("accel", FORCE, "m/s2", "a")):
        for k, axis in enumerate("xyz"):
            columns[f"{letter}{axis}"] = np.ascontiguousarray(values[:, part][:, k])
            stated[f"{letter}{axis}"] = (f"{triad}_{axis}", unit)
    q_ns = rotation.compose(
        rotation.quaternion_from_euler(_euler(values)), rotation.conjugate(Q_SB)
    )
    name = path.resolve().name
    return RawLog(
        name=name,
        files=files,
        columns=columns,
        stated=stated,
        axes=AXES,
        truth=TruthInSensorAxes(q_ns, np.ones(len(values), dtype=bool)),
        findings=[
            Finding(
                "io.truth-own-solution-oxts-unit", file=name, quantity="attitude", severity="note"
            )
        ],
        clock=UNIX,
    )


def read_fixes(path: Path) -> Fixes:
    """Read positions and velocities of the unit's own solution as fixes.

    `path`: as `read`. Returns each with the accuracy that the unit states;
    down as north and east.
    """
    time, values, _ = _values(path)
    name = path.resolve().name
    accuracy = values[:, ACCURACY]
    return Fixes(
        name=name,
        time=np.asarray(time * 1e-9, dtype=np.float64),
        place=values[:, PLACE],
        rows=np.arange(1, time.size + 1),
        clock=Clock(UNIX),
        velocity=_velocity(values),
        position_sd=np.repeat(accuracy[:, :1], 3, axis=1),
        velocity_sd=np.repeat(accuracy[:, 1:], 3, axis=1),
        zero_is_unknown=True,
        findings=[
            Finding("io.fixes-of-own-solution", file=name, quantity="lat, lon", severity="note")
        ],
    )


def read_reference(path: Path) -> pd.DataFrame:
    """Read the unit's own solution as a trajectory.

    Parameters
    ----------
    path : Path
        As `read`.

    Returns
    -------
    DataFrame
        A Trajectory table in seconds from 1970.
    """
    time, values, _ = _values(path)
    name = path.resolve().name
    table = trajectory_table(
        time * 1e-9, values[:, PLACE], _velocity(values), _euler(values), source=name
    )
    table.attrs["ellipsoid"] = "wgs84"
    table.attrs["findings"] = (
        Finding(
            "io.own-solution-oxts-unit-these", file=name, quantity="trajectory", severity="note"
        ),
    )
    return with_clock(table, Clock(UNIX))


def files_of(path: Path) -> tuple[Path, ...]:
    """List the files that fixes or a trajectory are read from.

    `path`: as `read`.
    """
    return _files(path)


def _oxts(path: Path) -> Path | None:
    if not path.is_dir():
        return None
    return next((f for f in (path, path / "oxts") if (f / "timestamps.txt").is_file()), None)


def _files(path: Path) -> tuple[Path, ...]:
    """List the file of the stamps, and the data files in order."""
    folder = _oxts(path)
    if folder is None:
        raise DataError("io.no-timestamps-txt", file=path.resolve().name)
    data = sorted(f for f in (folder / "data").glob("*") if _NAME.fullmatch(f.name))
    return (folder / "timestamps.txt", *data)


def _values(path: Path) -> tuple[NDArray[np.int64], Array, tuple[Path, ...]]:
    """Return stamps in ns since 1970, the thirty numbers of each, and the files."""
    stamps, *files = _files(path)
    lines = [n for n in stamps.read_text(encoding="ascii", errors="replace").splitlines() if n]
    dates = pd.to_datetime(pd.Series(lines), format="ISO8601", errors="coerce")
    if dates.isna().any():
        row = int(np.argmax(dates.isna().to_numpy()))
        raise DataError(
            "io.no-date", file=f"oxts/{stamps.name}", row=row + 1, quantity="time", lines=lines[row]
        )
    # In some recordings files are missing: each belongs to the stamp of its number.
    numbers = np.array([int(f.stem) for f in files])
    if not files or numbers[-1] >= len(lines):
        raise DataError(
            "io.files-data-last-stamps",
            file="oxts/data",
            count=len(files),
            name=files[-1].name if files else "-",
            count_2=len(lines),
        )
    values = np.array([_numbers(f) for f in files])
    time = dates.to_numpy().astype("datetime64[ns]").astype(np.int64)[numbers]
    return time, values, (stamps, *files)


def _numbers(file: Path) -> Array:
    fields = file.read_text(encoding="ascii", errors="replace").split()
    try:
        values = np.array(fields, dtype=np.float64)
    except ValueError:
        values = np.empty(0)
    if values.size != FIELDS or not np.isfinite(values[: UP + 1]).all():
        raise DataError(
            "io.fields-numbers-expected",
            file=f"oxts/data/{file.name}",
            count=len(fields),
            fields=FIELDS,
        )
    return values


def _euler(values: Array) -> Array:
    """Compute roll, pitch, heading (forward-right-down to north-east-down), deg."""
    roll, pitch, yaw = np.degrees(values[:, EULER]).T
    return np.column_stack([roll, -pitch, (90.0 - yaw + 180.0) % 360.0 - 180.0])


def _velocity(values: Array) -> Array:
    return np.column_stack([values[:, NORTH_EAST], -values[:, UP]])


# Poses of KITTI odometry.

ODOMETRY_TITLE = "poses of KITTI odometry, twelve numbers a row"
_SAID = re.compile(r"# (origin lat lon deg, height m|roll pitch heading deg): (.*)")
#: From right, down, forward to forward, right, down.
_BODY_CAMERA = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
_ORTHOGONAL = 1e-3  # of a matrix times its transpose


def _has_poses(path: Path) -> bool:
    """Whether the first rows of twelve numbers hold rotations."""
    lines = [line for line in head(path).split("\n")[:-1] if line.strip()]
    rows = [line.split() for line in lines if not line.startswith("#")]
    try:
        block = np.array([[float(f) for f in row] for row in rows[:50]])
    except ValueError:
        return False
    if block.ndim != 2 or block.shape[1] != 12:
        return False
    # One bad row is a fault of the file, not another layout.
    return bool(_are_rotations(block).mean() > 0.9)


def _are_rotations(values: Array) -> NDArray[np.bool_]:
    turn = values.reshape(-1, 3, 4)[:, :, :3]
    off = np.abs(turn @ turn.transpose(0, 2, 1) - np.eye(3)).max(axis=(1, 2))
    return np.asarray((off < _ORTHOGONAL) & (np.linalg.det(turn) > 0.0))


detect_odometry = Signs(
    suffixes=csv.SUFFIXES, text=r"^[ \t]*(?:[^\s,#]+[ \t]+){11}[^\s,#]+[ \t\r]*$", also=_has_poses
)


def files_of_odometry(path: Path) -> tuple[Path, ...]:
    """List the poses, and the stamps beside them or in the folder of their sequence."""
    sequence = path.absolute().parent.parent / "sequences" / path.stem
    beside = (path.parent / "times.txt", sequence / "times.txt")
    return (path, *[p for p in beside if p.is_file() and p != path][:1])


def read_odometry_reference(path: Path) -> pd.DataFrame:
    """Read a trajectory whose comments state where its first pose is.

    DataError: they do not, a stamp is missing, or a row is not a pose.
    """
    raw = csv.read(path)
    said = {m[1]: m[2] for m in map(_SAID.match, head(path).split("\n")) if m}
    if len(said) < 2:
        raise DataError("io.poses-without-origin", file=path.name, quantity="reference")
    values = np.column_stack([numbers(raw, c, c) for c in raw.columns])
    good = _are_rotations(values) & np.isfinite(values).all(axis=1)
    if not good.all():
        bad = int(np.argmin(good))
        raise DataError("io.pose-without-rotation", file=path.name, row=raw.row(bad))
    time: Array = np.zeros(0)
    for stamps in files_of_odometry(path)[1:]:
        time = np.asarray(next(iter(csv.read(stamps).columns.values())), dtype=np.float64)
    if time.size != len(values):
        raise DataError(
            "io.poses-without-times", file=path.name, count=len(values), stamps=time.size
        )
    origin, euler = (np.array(said[key].split(), dtype=np.float64) for key in sorted(said))
    pose = values.reshape(-1, 3, 4)
    q_ew = rotation.compose(
        rotation.conjugate(q_ne(origin[0], origin[1])), rotation.quaternion_from_euler(euler)
    )
    place = rotation.rotate(q_ew, pose[:, :, 3] @ _BODY_CAMERA.T) + ecef_from_geodetic(origin)
    turn = rotation.quaternion_from_dcm(_BODY_CAMERA @ pose[:, :, :3] @ _BODY_CAMERA.T)
    table = trajectory_of_poses(path, time, place, rotation.compose(q_ew, turn), WGS84)
    table.attrs["findings"] = (*raw.findings, *table.attrs["findings"])
    return with_clock(table, Clock(RELATIVE))


# Writing.

# Trajectories with gaps longer than this are not interpolated over them.
LONGEST_STEP = 1.0  # s
_UNKNOWN = ["-1"] * 5  # navigation state, satellites, and modes of the receiver


def write(path: Path, tables: Tables, options: FileOptions) -> list[Finding]:
    """Write a folder ``oxts``: one row has the samples and the solution of one instant.

    Rows are the samples of the Imu table within the trajectory, which is interpolated to them as
    `trajectory_at` does; without samples, the rows of the trajectory, with rates and forces of nan.
    Accuracies are nan, states of the receiver -1: unknown. Numbers have the fewest digits that
    reproduce each, dates nine decimals.

    DataError: the trajectory is missing, the clock is not related to UTC, or the two do not
    overlap.
    """
    track, imu = tables.get("reference"), tables.get("imu")
    if track is None or not is_trajectory(track):
        raise DataError("io.written-needs-stream", form="KITTI", needed=["a trajectory"])
    stamps, findings = dates(track, options, "KITTI")
    if imu is not None:
        accel_needed(imu, "KITTI")
        own, said = dates(imu, options, "KITTI")
        inside = _within(own, stamps)
        findings += [*said, *imu_not_held("KITTI", imu)]
        if not inside.all():
            lost = {"count": int((~inside).sum()), "rows": inside.size}
            source = imu.attrs.get("source")
            findings.append(Finding("io.written-samples-left-out", file=source, data=lost))
        if not inside.any():
            raise DataError("io.written-no-overlap", file=imu.attrs.get("source"), form="KITTI")
        from strapdown.evaluation.trajectory_differences import trajectory_at

        # Doubles of seconds since 1970 are too coarse to interpolate by.
        moved = track.set_axis(pd.Index((stamps - stamps[0]) * 1e-9, name="time"))
        same = np.isin(own[inside], stamps)
        findings += _interpolated(imu, same)
        at = (own[inside] - stamps[0]) * 1e-9
        track, stamps, imu = trajectory_at(moved, at, options.ellipsoid), own[inside], imu[inside]
    if "gnss" in tables:
        findings.append(stream_not_held("KITTI", "gnss", tables["gnss"]))
    rows = _rows(track, imu)
    data = path / "oxts" / "data"
    data.mkdir(parents=True)
    for k, row in enumerate(rows.tolist()):
        fields = [*(repr(v) for v in row), *_UNKNOWN]
        (data / f"{k:010d}.txt").write_text(" ".join(fields) + "\n", encoding="ascii", newline="\n")
    days = (stamps // SECOND).astype("datetime64[s]")
    lines = [
        f"{str(day).replace('T', ' ')}.{ns:09d}\n"
        for day, ns in zip(days, (stamps % SECOND).tolist(), strict=True)
    ]
    (path / "oxts" / "timestamps.txt").write_text("".join(lines), encoding="ascii", newline="\n")
    return findings


def _within(own: NDArray[np.int64], stamps: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Select the stamps within a trajectory, and not within its gaps."""
    after = np.searchsorted(stamps, own)
    inside = (after > 0) & (after < stamps.size)
    after = np.clip(after, 1, stamps.size - 1)
    inside &= stamps[after] - stamps[after - 1] <= LONGEST_STEP * SECOND
    return np.asarray(inside | np.isin(own, stamps))


def _interpolated(imu: pd.DataFrame, same: NDArray[np.bool_]) -> list[Finding]:
    if same.all():
        return []
    data = {"count": int((~same).sum()), "rows": same.size}
    source = imu.attrs.get("source")
    return [Finding("io.written-interpolated", file=source, severity="note", data=data)]


def _rows(track: pd.DataFrame, imu: pd.DataFrame | None) -> Array:
    """Return the twenty-five numbers of each row that are not states of the receiver."""
    n = len(track)
    roll, pitch, heading = np.radians(values_of(track, ANGLES)).T
    north, east, down = values_of(track, VELOCITY).T
    yaw = np.radians((90.0 - track["heading"].to_numpy(dtype=np.float64) + 180.0) % 360.0 - 180.0)
    forward = north * np.cos(heading) + east * np.sin(heading)
    left = north * np.sin(heading) - east * np.cos(heading)
    blocks = [places_of(track), np.column_stack([roll, -pitch, yaw, north, east, forward, left])]
    blocks.append(-down[:, None] + 0.0)
    if imu is None:
        return np.hstack([*blocks, np.full((n, 14), np.nan)])
    level = np.column_stack([values_of(track, ANGLES)[:, :2], np.zeros(n)])
    q_lb = rotation.quaternion_from_euler(level)
    for names in (ACCEL, GYRO):
        body = values_of(imu, names)
        blocks += [FLU * body, FLU * rotation.rotate(q_lb, body)]
    return np.hstack([*blocks, np.full((n, 2), np.nan)])

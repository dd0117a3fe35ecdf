"""Increments of inertial sensors in KF-GINS format: seven columns without a header.

Each line: GPS seconds of week, three increments of angle in rad, three of velocity in m/s, axes
forward, right, down; an increment belongs to the interval that ends at its stamp. At 10 Hz the
increments of velocity at rest are those of a table in g, which therefore needs the format stated.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.errors import DataError, Finding, add_note, add_warning
from strapdown.formats import csv
from strapdown.formats.arrays import numbers, told_by_file_rows
from strapdown.formats.clocks import GPS, WEEK, Clock, clock_of, unrolled, with_clock
from strapdown.formats.gnss_fixes import Fixes
from strapdown.formats.recording import NoStreamError, RawLog
from strapdown.formats.signs import HEAD, Signs, first_bytes
from strapdown.formats.text_columns import is_data
from strapdown.formats.triad_units import intervals
from strapdown.formats.writing import (
    SECOND,
    FileOptions,
    Tables,
    accel_needed,
    gps_ns,
    is_trajectory,
    mark_not_held,
    not_held,
    stream_not_held,
    write_numbers,
)
from strapdown.tables import ACCEL, GYRO, TRAJECTORY, check_trajectory, trajectory_table
from strapdown.tables.checks import MAG, POSITION_SD, VELOCITY_SD, index_of, values_of

Array = NDArray[np.float64]
COLUMNS = ["time", *(f"dtheta_{a}" for a in "xyz"), *(f"dv_{a}" for a in "xyz")]
SUFFIXES = (*csv.SUFFIXES, ".imu")
FOLDER_TITLE = "folder of KF-GINS: increments, fixes, trajectory"
#: Most files of a folder that are looked into.
MOST_FILES = 50
_KINDS = [("time", "s"), *((f"gyro_{a}", "rad") for a in "xyz")]
_KINDS += [(f"accel_{a}", "m/s") for a in "xyz"]
# Norm of the median specific force of a vehicle on the road, in flight or stationary.
_GRAVITY = (9.6, 10.0)  # m/s²
_STEPS = (1e-4, 0.5)  # s
_TURNS = 2.0 * np.pi  # rad/s
_G = (0.9, 1.1)  # of a table in g


def _numbers(line: bytes) -> list[float] | None:
    fields = line.split()
    try:
        return [float(f) for f in fields] if len(fields) == len(COLUMNS) else None
    except ValueError:
        return None


def _are_increments(block: Array) -> bool:
    steps = np.diff(block[:, 0])
    usual = float(np.median(steps))
    if not _STEPS[0] <= usual <= _STEPS[1] or not -1.0 < block[0, 0] <= WEEK + 1.0:
        return False
    size = float(np.median(np.linalg.norm(block[:, 4:], axis=1)))
    if _G[0] <= size <= _G[1]:
        return False
    force = size / usual
    turn = float(np.median(np.linalg.norm(block[:, 1:4], axis=1))) / usual
    return _GRAVITY[0] <= force <= _GRAVITY[1] and turn < _TURNS


def _begins_with_increments(path: Path) -> bool:
    """Whether the first numbers are a clock, and gravity in the increments."""
    data = first_bytes(path, HEAD)
    lines = [line for line in data[: data.rfind(b"\n") + 1].splitlines() if line.strip()]
    lines = [line for line in lines if not line.lstrip().startswith((b"#", b"%"))]
    # One bad line is a fault of the file, not another layout.
    block = [row for line in lines if (row := _numbers(line)) is not None]
    if len(block) < 3 or len(block) < 0.9 * len(lines) or _numbers(lines[0]) is None:
        return False
    return _are_increments(np.array(block))


detect = Signs(suffixes=SUFFIXES, first=rb"\A[^,\0]*\Z", also=_begins_with_increments)


def read(path: Path) -> RawLog:
    """Read increments of angle and velocity.

    Columns `COLUMNS`, in s, rad, m/s. Axes forward, right, down if gravity is on the third axis,
    downward; otherwise not stated.
    """
    raw = csv.read(path)
    names = list(raw.columns)
    if len(names) != len(COLUMNS) or any(n.startswith("column ") is False for n in names):
        raise raw.fault("io.kf-gins-column-count", sample=0, count=len(names), names=names[:8])
    columns = dict(zip(COLUMNS, raw.columns.values(), strict=True))
    axes = raw.axes
    if all(c.dtype.kind in "iuf" for c in columns.values()):
        axes = axes or _axes(columns, raw)
    return RawLog(
        name=raw.name,
        files=(path,),
        columns=columns,
        rows=raw.rows,
        stated=dict(zip(COLUMNS, _KINDS, strict=True)),
        sampling="mean",
        axes=axes,
        findings=raw.findings,
        clock=GPS,
    )


def _axes(columns: dict[str, NDArray[np.float64]], raw: RawLog) -> str | None:
    """Return forward, right, down if gravity agrees; note the assumption."""
    step = float(np.median(np.diff(columns["time"]))) if columns["time"].size > 1 else 0.0
    if not step > 0.0:
        return None
    down = float(np.median(columns["dv_z"])) / step
    told = down < -0.5 * _GRAVITY[0]
    raw.warn(
        "io.taken-for-kf-gins" if told else "io.taken-for-kf-gins-axes-open",
        severity="note" if told else "warning",
        rate_hz=1.0 / step,
        down=down,
    )
    return "x,y,z" if told else None


# Fixes: seven columns without a header, or thirteen with velocity.
#
# Each line: GPS seconds of week; latitude, longitude in deg and height above the ellipsoid in m, of
# the antenna; standard deviations north, east, down in m; and, with thirteen columns, velocity
# north, east, down and its standard deviations in m/s.


NAMES = ("time", "lat", "lon", "alt", "north_sd", "east_sd", "down_sd")
WITH_VELOCITY = (*NAMES, "VN", "VE", "VD", "VN_sd", "VE_sd", "VD_sd")


def _begins_with_fixes(path: Path) -> bool:
    """Whether the first row has seven or thirteen numbers, without a header.

    A standard deviation is not negative.
    """
    lines = [line.split() for line in first_bytes(path, HEAD).splitlines() if line.strip()]
    lines = [line for line in lines if not line[0].startswith((b"#", b"%"))]
    if not lines or len(lines[0]) not in (len(NAMES), len(WITH_VELOCITY)):
        return False
    signed = sum(any(f.startswith(b"-") for f in line[4:7]) for line in lines)
    return 2 * signed <= len(lines) and all(is_data(f.decode("latin-1")) for f in lines[0])


detect_fixes = Signs(
    suffixes=csv.SUFFIXES, text=r"^[ \t]*[^\s#%]\S*(?:[ \t]+\S+){6}", also=_begins_with_fixes
)


def read_fixes(path: Path) -> Fixes:
    """Read fixes without a header."""
    raw = csv.read(path)
    names = WITH_VELOCITY if len(raw.columns) == len(WITH_VELOCITY) else NAMES
    if len(raw.columns) != len(names):
        raise raw.fault("io.kf-gins-fix-column-count", sample=0, count=len(raw.columns))
    return fixes_of(raw, names)


def fixes_of(raw: RawLog, names: tuple[str, ...]) -> Fixes:
    """Convert columns in a known order to fixes."""
    values = {
        name: np.asarray(numbers(raw, column, name), dtype=np.float64)
        for name, column in zip(names, raw.columns, strict=True)
    }

    def block(first: int) -> np.ndarray:
        return np.column_stack([values[n] for n in names[first : first + 3]])

    raw.note(
        "io.taken-for-kf-gins-fixes-with-velocity"
        if len(names) > len(NAMES)
        else "io.taken-for-kf-gins-fixes",
        count=len(names),
    )
    return Fixes(
        name=raw.name,
        time=values["time"],
        place=block(1),
        rows=np.arange(1, values["time"].size + 1) if raw.rows is None else raw.rows,
        clock=Clock(GPS),
        velocity=block(7) if len(names) > len(NAMES) else None,
        position_sd=block(4),
        velocity_sd=block(10) if len(names) > len(NAMES) else None,
        findings=raw.findings,
    )


# Trajectories (``.nav``): eleven columns without a header.
#
# Each line: GPS week, seconds of week; latitude, longitude in deg, height above the ellipsoid in m;
# velocity north, east, down in m/s; roll, pitch, heading in deg, heading from 0 to 360.

TRAJECTORY_NAMES = ("week", "time", *TRAJECTORY)
SUFFIX = ".nav"
# Decimals of the columns: 10 ns; 1e-11 deg is a micrometer; 1e-8 m and m/s; 1e-9 deg.
DECIMALS = (0, 8, 11, 11, 8, 8, 8, 8, 9, 9, 9)
# Largest latitude and longitude (deg), height (m), velocity (m/s), roll, pitch, heading (deg).
_MOST_OF_STATE = (90.0, 360.0, 1e6, 1e4, 1e4, 1e4, 180.0, 90.0, 360.0)


def _begins_with_states(path: Path) -> bool:
    """Whether the first row has eleven numbers, without a header."""
    lines = first_bytes(path, HEAD).splitlines()
    rows = [line.split() for line in lines if line.strip() and line.lstrip()[:1] not in b"#%"]
    if not rows or len(rows[0]) != len(TRAJECTORY_NAMES) or not all(map(_number, rows[0])):
        return False
    # A log of nine axes and a temperature has eleven columns, too.
    week, time, *state = (float(f) for f in rows[0])
    return (
        week == round(week) >= 0.0
        and 0.0 <= time <= WEEK
        and all(abs(x) <= most for x, most in zip(state, _MOST_OF_STATE, strict=True))
    )


detect_trajectory = Signs(
    named=(SUFFIX,),
    suffixes=csv.SUFFIXES,
    text=r"^[ \t]*(?:[^\s,#%]+[ \t]+){10}[^\s,]+[ \t\r]*$",
    also=_begins_with_states,
)


def _number(field: bytes) -> bool:
    try:
        float(field)
    except ValueError:
        return False
    return True


def read_trajectory(path: Path) -> pd.DataFrame:
    """Read a trajectory.

    Returns
    -------
    DataFrame
        A Trajectory table, time in seconds of the week of the first row; week 0 means that the
        week is not known.

    Raises
    ------
    DataError
        A row has another width or a value that is not a number, or as `trajectory_table`.
    """
    raw = csv.read(path)
    if len(raw.columns) != len(TRAJECTORY_NAMES):
        raise raw.fault(
            "io.nav-column-count", sample=0, count=len(raw.columns), count_2=len(TRAJECTORY_NAMES)
        )
    named = zip(TRAJECTORY_NAMES, raw.columns, strict=True)
    values = {n: np.asarray(numbers(raw, c, n), dtype=np.float64) for n, c in named}
    week = values["week"]
    time = values["time"] + WEEK * (week - week[0])
    if np.isfinite(time).all():
        time, _ = unrolled(time)
    with told_by_file_rows(raw.name, raw.row):
        table = trajectory_table(
            time,
            np.column_stack([values[n] for n in TRAJECTORY[:3]]),
            np.column_stack([values[n] for n in TRAJECTORY[3:6]]),
            np.column_stack([values[n] for n in TRAJECTORY[6:]]),
            source=raw.name,
        )
    known = np.isfinite(week[0]) and week[0] > 0
    with_clock(table, Clock(GPS, 0.0, int(week[0]) if known else None))
    table.attrs["findings"] = tuple(raw.findings)
    return table


def write_nav(path: Path, trajectory: pd.DataFrame, options: FileOptions | None = None) -> None:
    """Write a trajectory for KF-GINS and its evaluation tools.

    `trajectory`: a Trajectory table. Its ``attrs`` may state the GPS week (`clocks`); otherwise it
    is 0. `options`: not used. DataError: the
    table is not valid.

    Numbers are rounded to `DECIMALS`: positions to a micrometer, times to 10 ns.
    """
    check_trajectory(trajectory)
    time = index_of(trajectory)
    clock = clock_of(trajectory)
    week, seconds = np.zeros(time.size), time
    if clock.name == GPS and clock.week is not None:
        seconds = time + clock.origin
        more = np.floor(seconds / WEEK)
        week, seconds = clock.week + more, seconds - WEEK * more
    values = values_of(trajectory, TRAJECTORY)
    columns = [week, seconds, *values[:, :8].T, np.mod(values[:, 8], 360.0)]
    from strapdown.formats.trajectory_writers import write_decimals

    write_decimals(path, columns, DECIMALS)


# Folders of all three, as KF-GINS takes them.

IMU_FILE, FIX_FILE, TRUTH_FILE = "imu.txt", "gnss.txt", "truth.nav"


def _member(folder: Path, is_one: Callable[[Path], bool]) -> Path | None:
    """Return the only file of a kind, or None."""
    files = [p for p in sorted(folder.iterdir())[:MOST_FILES] if p.is_file()]
    found = [p for p in files if is_one(p)]
    return found[0] if len(found) == 1 else None


# One text of increments; there may be fixes and a trajectory.
detect_folder = Signs(folder=lambda path: _member(path, detect) is not None)


def _of_folder(path: Path, stream: str, is_one: Callable[[Path], bool]) -> Path:
    found = _member(path, is_one)
    if found is None:
        raise NoStreamError(path.resolve().name, stream, FOLDER_TITLE, ["imu"])
    return found


def _are_fixes(path: Path) -> bool:
    """Whether a text has fixes, and not increments, which have seven columns, too."""
    return detect_fixes(path) and not detect(path)


def read_folder(path: Path) -> RawLog:
    """Read the increments of a folder."""
    return read(_of_folder(path, "imu", detect))


def read_folder_fixes(path: Path) -> Fixes:
    """Read the fixes of a folder."""
    return read_fixes(_of_folder(path, "gnss", _are_fixes))


def read_folder_reference(path: Path) -> pd.DataFrame:
    """Read the trajectory of a folder."""
    return read_trajectory(_of_folder(path, "reference", detect_trajectory))


def files_of_folder(path: Path) -> tuple[Path, ...]:
    """List the files of a folder that are read."""
    found = (_member(path, is_one) for is_one in (detect, _are_fixes, detect_trajectory))
    return tuple(file for file in found if file is not None)


def write(path: Path, tables: Tables, options: FileOptions) -> list[Finding]:
    """Write a folder of increments, fixes and a trajectory: imu.txt, gnss.txt, truth.nav.

    Seconds of the GPS week of each stream's first row; only the trajectory has the week. Means
    over the interval that ends at a stamp become increments by its length, the first that of the
    usual interval. Instantaneous samples become the integral of the straight line between two, and
    the first has none. Fixes without standard deviations are left out, for the format has no word
    for unknown.

    DataError: the specific force is missing, the clock counts beyond a week, or no fix can be
    written.
    """
    path.mkdir()
    findings: list[Finding] = []
    if "imu" in tables:
        findings += _write_increments(path / IMU_FILE, tables["imu"], options)
    if "gnss" in tables:
        findings += _write_fixes(path / FIX_FILE, tables["gnss"], options)
    if "reference" in tables:
        truth = tables["reference"]
        if is_trajectory(truth):
            findings += write_dated_nav(path / TRUTH_FILE, truth, options)
        else:
            findings.append(stream_not_held("KF-GINS", "reference", truth))
    return findings


def write_dated_nav(path: Path, truth: pd.DataFrame, options: FileOptions) -> list[Finding]:
    """Write a trajectory on the clock of GPS, as `write_nav` does."""
    stamps, week, findings = gps_ns(truth, options, "KF-GINS")
    moved = truth.set_axis(pd.Index(stamps / 1e9, name="time"))
    write_nav(path, with_clock(moved, Clock(GPS, 0.0, week)), options)
    return findings


def _seconds_of_week(
    table: pd.DataFrame, options: FileOptions
) -> tuple[NDArray[np.int64], list[Finding]]:
    """Return ns of the week, beginning again with each, and findings."""
    stamps, week, findings = gps_ns(table, options, "KF-GINS")
    if week is not None:
        source = table.attrs.get("source")
        add_note(findings, "io.written-without-week", file=source, week=week)
    return stamps % int(WEEK * SECOND), findings


def _write_increments(path: Path, imu: pd.DataFrame, options: FileOptions) -> list[Finding]:
    accel_needed(imu, "KF-GINS")
    stamps, findings = _seconds_of_week(imu, options)
    values = values_of(imu, [*GYRO, *ACCEL])
    time = index_of(imu)
    if imu.attrs.get("sampling") == "mean":
        sums = values * intervals(time, np.arange(time.size))
    else:
        sums = 0.5 * (values[1:] + values[:-1]) * np.diff(time)[:, None]
        stamps = stamps[1:]
        source = imu.attrs.get("source")
        add_note(findings, "io.written-increments-of-line", file=source)
    if MAG[0] in imu.columns:
        findings.append(not_held("KF-GINS", "imu", "the magnetic field", imu))
    findings += mark_not_held("KF-GINS", imu)
    write_numbers(path, [stamps / 1e9, *sums.T], separator=" ")
    return findings


def _write_fixes(path: Path, gnss: pd.DataFrame, options: FileOptions) -> list[Finding]:
    stamps, findings = _seconds_of_week(gnss, options)
    source = gnss.attrs.get("source")
    sd = values_of(gnss, POSITION_SD)
    keep = (np.isfinite(sd) & (sd > 0.0)).all(axis=1)
    if not keep.any():
        raise DataError("io.written-needs-position-sd", file=source, form="KF-GINS")
    if not keep.all():
        data = {"count": int((~keep).sum()), "rows": keep.size}
        add_warning(findings, "io.written-fixes-without-sd", file=source, data=data)
    velocity_sd = values_of(gnss, VELOCITY_SD)[keep]
    names = list(WITH_VELOCITY[1:])
    if not (np.isfinite(velocity_sd) & (velocity_sd > 0.0)).all():
        names = list(NAMES[1:])
        if np.isfinite(velocity_sd).any():
            lost = "velocities, not all of which have a standard deviation"
            findings.append(not_held("KF-GINS", "gnss", lost, gnss))
    findings.append(not_held("KF-GINS", "gnss", "the quality of the fixes", gnss))
    columns = [stamps[keep] / 1e9, *values_of(gnss, names)[keep].T]
    write_numbers(path, columns, separator=" ")
    return findings

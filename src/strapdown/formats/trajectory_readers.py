"""Readers of trajectory files: their columns, and the consistency of their content."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

import numpy as np
import pandas as pd

from strapdown.dsp.samples import running_integral
from strapdown.errors import DataError, Finding
from strapdown.formats import open_stream
from strapdown.formats.arrays import told_by_file_rows
from strapdown.formats.clocks import Clock, with_clock
from strapdown.formats.find_columns import Found, find_quantities
from strapdown.formats.recording import RawLog
from strapdown.formats.vocabularies import TRAJECTORIES
from strapdown.rotation import within_half_turn
from strapdown.tables import EULER, VELOCITY, trajectory_table
from strapdown.tables.checks import HEIGHTS_AS_STATED, Array

#: Level of the heights, in the comments of a trajectory: that of the fixes.
AS_STATED = "as the fixes state them"
_AS_STATED = re.compile(rf"[#%]\s*heights\s*:\s*{AS_STATED}\s*$", re.M)
_ELLIPSOID = re.compile(r"[#%]\s*ellipsoid\s*:\s*(\S+)\s*$", re.M)


def read_trajectory(path: str | Path, columns: Mapping[str, str] | None = None) -> pd.DataFrame:
    """Read a trajectory.

    Parameters
    ----------
    path : str or Path
        A table with column names, or another format with a ``reference`` (`formats.READERS`).
    columns : mapping of str to str, optional
        Quantity (``time``, ``lat``, ``lon``, ``alt``, ``VN``, ``VE``, ``VD``, ``roll``, ``pitch``,
        ``heading``) to the name of its column, or its number, from 1, if not evident.

    Returns
    -------
    DataFrame
        A Trajectory table. Names may carry a unit: ``lat_deg``, ``Latitude (rad)``, ``vel_north
        [m/s]``, ``time_ms``; the defaults are degrees, meters and seconds. A velocity up is
        negated. Dates are converted to seconds since 1970. ``attrs``: ``source``, the name of the
        file; ``ellipsoid``, if a comment states it, or None; its clock (`clocks`); ``findings``,
        a tuple of Finding.

    Raises
    ------
    ConfigError
        The file does not exist, or `columns` names a column that it does not have.
    DataError
        The file is empty or not a text table, a column is missing or has no numbers, a value is
        not finite, time does not advance, a latitude is beyond the pole; or positions and
        velocities show that latitude and longitude are exchanged or in radians, or that the
        attitude is in radians.
    """
    path = Path(path)
    raw = open_stream(path, "reference")
    if isinstance(raw, pd.DataFrame):
        return raw
    assert isinstance(raw, RawLog)  # the columns of a table
    found = find_trajectory_columns(raw.columns, columns or {}, raw.name)
    time, clock, _ = found["time"].stamps(raw)
    values = {q: found[q].values(raw, q) for q in TRAJECTORIES.quantities if q != "time"}
    with told_by_file_rows(raw.name, raw.row):
        table = trajectory_table(
            time,
            np.column_stack([values[q] for q in ("lat", "lon", "alt")]),
            np.column_stack([values[q] for q in ("VN", "VE", "VD")]),
            np.column_stack([values[q] for q in ("roll", "pitch", "heading")]),
            source=raw.name,
        )
    judged = judge_trajectory(
        table,
        angles_stated=found["lat"].stated and found["lon"].stated,
        euler_stated=found["heading"].stated,
    )
    with path.open("rb") as stream:
        head = stream.read(4096).decode("utf-8", "replace")
    stated = _ELLIPSOID.search(head)
    with_clock(table, Clock(clock))
    table.attrs["ellipsoid"] = stated.group(1) if stated else None
    if _AS_STATED.search(head):
        table.attrs[HEIGHTS_AS_STATED] = True
    table.attrs["findings"] = (*raw.findings, *judged)
    return table


# Assignment of the columns of a text table to the quantities of a trajectory, with units.


def find_trajectory_columns(
    names: Iterable[str], asked: Mapping[str, str], file: str
) -> dict[str, Found]:
    """Find the column of each quantity.

    `names`: as in the file. `asked`: quantity (of `TRAJECTORIES`) to the name of its column, or
    its number, from 1; overrides what the names suggest. `file`: for messages. Returns one for
    each. ConfigError: a requested column does not exist, or its quantity is unknown.
    DataError: a quantity is missing, two columns fit one quantity, or a unit does not fit.
    """
    columns = list(names)
    found = find_quantities(columns, TRAJECTORIES, asked, file)
    missing = [q for q in TRAJECTORIES.quantities if q not in found]
    if missing:
        raise DataError("io.missing-columns-3", file=file, missing=missing, columns=columns)
    return found


# Consistency of a trajectory's positions, velocities and headings.


# A spherical Earth suffices to detect factors of 57.
EARTH = 6.371e6  # m
# Least motion for a conclusion.
LEAST_MOTION = 5.0  # m, root mean square
MOVING = 1.0  # m/s
# Misfit of positions and integrated velocity, as a fraction of the motion: above which they
# disagree, and below which another reading is accepted.
DISAGREE, AGREE = 0.5, 0.1


def judge_trajectory(
    table: pd.DataFrame, *, angles_stated: bool, euler_stated: bool
) -> list[Finding]:
    """Compare positions with the integral of velocity, and heading with the course.

    `table`: a Trajectory table. `angles_stated`, `euler_stated`: whether the file states the unit
    of latitude and longitude, and of the attitude; radians are then not considered. Returns
    positions and velocities that disagree without an apparent reason. DataError: they disagree but
    agree with latitude and longitude exchanged, or taken as radians; or heading disagrees with the
    course but agrees if taken as radians.
    """
    file = table.attrs.get("source")
    if len(table) < 3:
        return []
    time = table.index.to_numpy(dtype=np.float64)
    velocity = table[VELOCITY[:2]].to_numpy(dtype=np.float64)
    if not euler_stated:
        _refuse_radians_of_attitude(table[EULER].to_numpy(dtype=np.float64), velocity, file)
    moved = running_integral(time, velocity)
    moved -= moved.mean(axis=0)
    size = float(np.sqrt(np.square(moved).sum(axis=1).mean()))
    if not size > LEAST_MOTION:
        return []
    lat, lon = table["lat"].to_numpy(dtype=np.float64), table["lon"].to_numpy(dtype=np.float64)

    def misfit(lat_deg: Array, lon_deg: Array) -> float:
        phi, lam = np.radians(lat_deg), np.unwrap(np.radians(lon_deg))
        place = EARTH * np.column_stack([phi, (lam - lam[0]) * np.cos(phi.mean())])
        place -= place.mean(axis=0)
        return float(np.sqrt(np.square(place - moved).sum(axis=1).mean())) / size

    plain = misfit(lat, lon)
    if plain < DISAGREE:
        return []
    readings: list[tuple[str, Callable[[], float], bool]] = [
        ("io.lat-lon-exchanged", lambda: misfit(lon, lat), bool(np.abs(lon).max() <= 90.0)),
        (
            "io.lat-lon-in-radians",
            lambda: misfit(np.degrees(lat), np.degrees(lon)),
            not angles_stated and bool(np.abs(lat).max() < 1.6 and np.abs(lon).max() < 6.3),
        ),
    ]
    for code, of, possible in readings:
        if possible and (other := of()) < AGREE:
            raise DataError(code, file=file, quantity="lat, lon", misfit=plain, other=other)
    return [
        Finding("io.positions-and-velocities-disagree", file=file, quantity="lat, lon", plain=plain)
    ]


def _refuse_radians_of_attitude(euler: Array, velocity: Array, file: str | None) -> None:
    fast = np.hypot(velocity[:, 0], velocity[:, 1]) > MOVING
    if fast.sum() < 3 or np.abs(euler).max() > 6.3:
        return
    course = np.degrees(np.arctan2(velocity[fast, 1], velocity[fast, 0]))

    def apart(heading_deg: Array) -> float:
        return float(np.median(np.abs(within_half_turn(course - heading_deg))))

    heading = euler[fast, 2]
    plain, radians = apart(heading), apart(np.degrees(heading))
    # No vehicle moves 20 deg off its heading and, by coincidence, along 57 times its heading.
    if plain > 20.0 and radians < 5.0:
        raise DataError(
            "io.heading-in-radians", file=file, quantity="heading", plain=plain, radians=radians
        )

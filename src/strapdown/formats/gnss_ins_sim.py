"""Folders of gnss-ins-sim: one table a quantity, and the reference of the simulation.

``time.csv`` (``time (sec)``), ``gyro-0.csv`` (``gyro_x (deg/s)`` …), ``accel-0.csv``,
``mag-0.csv``, ``gps_time.csv``, ``gps-0.csv`` (``gps_lat (deg)`` … ``gps_vD (m/s)``),
``ref_pos.csv``, ``ref_vel.csv``, ``ref_att_euler.csv`` (yaw, pitch, roll); a number counts the runs
of a simulation. Units are in the names. Layout and frames are those of its README and of
``ins_data_manager.py`` (https://github.com/Aceinna/gnss-ins-sim, MIT): the body axes are those
whose attitude to north-east-down is given, forward, right, down; the velocity is along the body
axes in some versions and north, east, down in others, which the positions decide. In the virtual
inertial frame (``ref_pos_x (m)``) positions are not on the Earth.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.errors import DataError, Finding
from strapdown.formats.clocks import RELATIVE, Clock, with_clock
from strapdown.formats.columns import read_name
from strapdown.formats.known_formats import column, lacking, under
from strapdown.formats.recording import RawLog
from strapdown.formats.signs import Signs, head
from strapdown.rotation import dcm_from_euler
from strapdown.tables import trajectory_table

TITLE = "folder of gnss-ins-sim"
_TABLES = re.compile(r"(gyro|accel|mag|gps)-\d+\.csv|ref_\w+\.csv|(gps_)?time\.csv")
NED = {"vN": "VN", "vE": "VE", "vD": "VD"}


def _has_stamps(path: Path) -> bool:
    """Whether the folder, or that of a table, has stamps and a table of a sensor or a reference."""
    folder = _folder(path)
    stamps = head(folder / "time.csv", 64)
    return stamps.startswith("time (sec)") and bool(_streams(folder))


detect = Signs(suffixes=(".csv",), text=r"\A\w+ \(", also=_has_stamps, folder=_has_stamps)


def _folder(path: Path) -> Path:
    """Return the folder of a simulation: it, or that of one of its tables."""
    return path.parent if path.is_file() and _TABLES.fullmatch(path.name) else path


def files_of(path: Path) -> tuple[Path, ...]:
    """List the tables that are read; none if this is no such folder."""
    if not detect(path):
        return ()
    path = _folder(path)
    names = [t.name for k in ("gyro", "accel", "mag", "gps") if (t := _table(path, k))]
    names += ["time.csv", "gps_time.csv", "ref_pos.csv", "ref_vel.csv", "ref_att_euler.csv"]
    return tuple(path / name for name in names if (path / name).is_file())


def read(path: Path) -> RawLog:
    """Read rates, specific force and magnetic field of the first run.

    Raises
    ------
    DataError
        A table is missing or damaged, or has another number of rows than the stamps.
    """
    path = _folder(path)
    findings: list[Finding] = []
    time = _columns(path, path / "time.csv", findings)
    held: dict[str, tuple[NDArray[Any], str | None]] = {"time": (time["time"][0], "s")}
    for kind in ("gyro", "accel", "mag"):
        if table := _first(path, kind, findings):
            columns = _columns(path, table, findings, held["time"][0].size)
            held |= {q: (v, u) for q, (v, u) in columns.items() if q.startswith(kind)}
    if "gyro_x" not in held:
        raise lacking(path, "imu", TITLE, _streams(path))
    return _log(path, held, axes="x,y,z", findings=findings)


def read_fixes(path: Path) -> RawLog:
    """Read the fixes of the first run: latitude, longitude, height, velocity."""
    path = _folder(path)
    findings: list[Finding] = []
    table = _first(path, "gps", findings)
    if table is None or not (path / "gps_time.csv").is_file():
        raise lacking(path, "gnss", TITLE, _streams(path))
    time = _columns(path, path / "gps_time.csv", findings)["time"][0]
    held = _columns(path, table, findings, time.size)
    if "lat" not in held:
        raise DataError("io.sim-without-place", file=table.name, quantity="lat")
    visible = path / "gps_visibility.csv"
    if visible.is_file():
        seen = next(iter(_columns(path, visible, findings, time.size).values()))[0]
        held["quality"] = (np.where(seen > 0, 1.0, 0.0), None)
    return _log(path, {"time": (time, "s"), **held}, findings=findings)


def read_reference(path: Path) -> pd.DataFrame:
    """Read the trajectory of the simulation."""
    path = _folder(path)
    name = path.resolve().name
    findings: list[Finding] = []
    tables = [path / f"ref_{kind}.csv" for kind in ("pos", "vel", "att_euler")]
    if not all(table.is_file() for table in tables):
        raise lacking(path, "reference", TITLE, _streams(path))
    time = _columns(path, path / "time.csv", findings)["time"][0]
    held = [_columns(path, table, findings, time.size) for table in tables]
    place, velocity, euler = (np.column_stack([v for v, _ in h.values()]) for h in held)
    if "lat" not in held[0]:
        raise DataError("io.sim-without-place", file=tables[0].name, quantity="lat")
    euler = euler[:, ::-1]
    turned = np.einsum("nij,nj->ni", dcm_from_euler(np.radians(euler)), velocity)
    moved = _differenced(time, place)
    along_body = np.nansum((turned[1:] + turned[:-1] - 2 * moved) ** 2) < np.nansum(
        (velocity[1:] + velocity[:-1] - 2 * moved) ** 2
    )
    table = trajectory_table(time, place, turned if along_body else velocity, euler, source=name)
    table.attrs["findings"] = tuple(findings)
    return with_clock(table, Clock(RELATIVE))


def _differenced(time: NDArray[Any], place: NDArray[Any]) -> NDArray[Any]:
    """Velocity north, east, down between positions, on a sphere: enough to distinguish frames."""
    lat, radius = np.radians(place[:, 0]), 6.37e6
    north, down = radius * np.diff(lat), -np.diff(place[:, 2])
    east = radius * np.cos(lat[1:]) * np.radians(np.diff(place[:, 1]))
    return np.asarray(np.column_stack([north, east, down]) / np.diff(time)[:, None])


def _streams(path: Path) -> list[str]:
    there = {"imu": "gyro-*.csv", "gnss": "gps-*.csv", "reference": "ref_att_euler.csv"}
    return [stream for stream, name in there.items() if any(path.glob(name))]


def _table(path: Path, kind: str) -> Path | None:
    """Return the table of a sensor with the lowest number."""
    runs = [p for p in path.glob(f"{kind}-*.csv") if p.stem.removeprefix(f"{kind}-").isdecimal()]
    return min(runs, key=lambda p: int(p.stem.rpartition("-")[2]), default=None)


def _first(path: Path, kind: str, findings: list[Finding]) -> Path | None:
    table, count = _table(path, kind), len(list(path.glob(f"{kind}-*.csv")))
    if table is not None and count > 1:
        findings.append(
            Finding(
                "io.first-of-runs", file=table.name, quantity=kind, severity="note", count=count
            )
        )
    return table


def _columns(
    path: Path, table: Path, findings: list[Finding], count: int | None = None
) -> dict[str, tuple[NDArray[Any], str | None]]:
    """Return the columns of a table by quantity, with the units of their names."""
    names = head(table).partition("\n")[0].strip()
    # One name with a blank would be taken for two columns.
    raw = under(table, header=names.replace(" (", "("))
    findings += raw.findings
    held = {}
    for name in raw.columns:
        plain, _, said = name.partition("(")
        quantity = plain.strip().removeprefix("gps_").removeprefix("ref_").removeprefix("pos_")
        unit = {"deg": "deg", "rad": "rad", "m": "m", "sec": "s"}.get(
            said.strip(" )"), read_name(name).unit
        )
        held[NED.get(quantity, quantity)] = (np.asarray(column(raw, name)), unit)
    size = next(iter(held.values()))[0].size
    if count is not None and size != count:
        raise DataError(
            "io.rows-not-those-of-stamps",
            file=raw.name,
            row=raw.row(size - 1),
            size=size,
            count=count,
        )
    return held


def _log(path: Path, held: dict[str, tuple[NDArray[Any], str | None]], **stated: Any) -> RawLog:
    return RawLog.of(path, held, clock=RELATIVE, **stated)

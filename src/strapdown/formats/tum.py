"""Trajectories in the format of the TUM RGB-D benchmark: ``time x y z qx qy qz qw``.

One pose a line, separated by blanks; ``#`` begins a comment: seconds, position in m in a world of
Cartesian axes, and the quaternion of the body to that world, scalar last (Sturm and others, A
benchmark for the evaluation of RGB-D SLAM systems, IROS 2012). The format states neither axes nor
origin; the comments that are written here do, and with them a file becomes a trajectory again.
"""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.ellipsoids import Ellipsoid, find_ellipsoid
from strapdown.errors import DataError, Finding
from strapdown.formats import csv
from strapdown.formats.arrays import numbers
from strapdown.formats.clocks import Clock, clock_of_name, with_clock
from strapdown.formats.signs import HEAD, Signs
from strapdown.formats.text_columns import NUMBER
from strapdown.formats.writing import TUM_FRAMES, FileOptions
from strapdown.frames import ecef_from_geodetic, geodetic_from_ecef, q_ne
from strapdown.rotation import Q_NED_ENU
from strapdown.tables import EULER, VELOCITY, check_trajectory, places_of, trajectory_table

TITLE = "poses as of the TUM RGB-D benchmark"
Array = NDArray[np.float64]

# Half a turn about forward: from forward-left-up to forward-right-down, and back.
_Q_FRD_FLU = (0.0, 1.0, 0.0, 0.0)


def poses(trajectory: pd.DataFrame, options: FileOptions | None = None) -> tuple[Array, Array]:
    """Compute positions and attitudes in one right-handed Cartesian frame.

    Parameters
    ----------
    trajectory : DataFrame
        A Trajectory table of one row or more.
    options : FileOptions, optional
        Its `tum_frame`, `origin` and `ellipsoid`.

    Returns
    -------
    position : ndarray, (n, 3), m
        ``enu`` and ``ned``: from the origin, along the plane tangent to the ellipsoid
        below it; the Earth curves away from that plane by ``d²/2R``. ``ecef``: from the Earth's
        center.
    q_wb : ndarray, (n, 4)
        Body to world, scalar first, with continuous sign. World and body axes are in
        `TUM_FRAMES`. The local level rotates as the vehicle moves over the Earth, while the
        world does not: the attitude accounts for it.
    """
    chosen = options or FileOptions()
    place = places_of(trajectory)
    position = ecef_from_geodetic(place, ellipsoid=chosen.ellipsoid)
    to_level = q_ne(place[:, 0], place[:, 1])
    q_wb = rotation.compose(
        rotation.conjugate(to_level),
        rotation.quaternion_from_euler(trajectory[EULER].to_numpy(dtype=np.float64)),
    )
    if chosen.tum_frame != "ecef":
        origin = place[0] if chosen.origin is None else np.array(chosen.origin)
        q_we = q_ne(origin[0], origin[1])
        if chosen.tum_frame == "enu":
            q_we = rotation.compose(Q_NED_ENU, q_we)
            q_wb = rotation.compose(q_wb, _Q_FRD_FLU)
        position = rotation.rotate(
            q_we, position - ecef_from_geodetic(origin, ellipsoid=chosen.ellipsoid)
        )
        q_wb = rotation.compose(q_we, q_wb)
    # q and -q are the same attitude; readers that interpolate need equal signs of neighbors.
    along = (q_wb[1:] * q_wb[:-1]).sum(axis=1)
    sign = np.cumprod(np.r_[math.copysign(1.0, q_wb[0, 0]), np.where(along < 0.0, -1.0, 1.0)])
    # Avoid negative zeros.
    return position + 0.0, q_wb * sign[:, None] + 0.0


def write_tum(
    path: Path,
    trajectory: pd.DataFrame,
    options: FileOptions | None = None,
    stamps: list[str] | None = None,
) -> None:
    """Write a trajectory as lines of ``time x y z qx qy qz qw``.

    Parameters
    ----------
    path : Path
    trajectory : DataFrame
        A Trajectory table of one row or more.
    options : FileOptions, optional
        Axes and ellipsoid; written to the comments at the top, together with the origin.
    stamps : list of str, optional
        Seconds of each row; by default those of the table.

    Raises
    ------
    DataError
        The table is not valid, or has no rows.

    Notes
    -----
    The quaternion is scalar last, body to world. The format does not include velocities.
    """
    from strapdown.formats.trajectory_writers import one_line

    chosen = options or FileOptions()
    check_trajectory(trajectory)
    if trajectory.empty:
        raise DataError("io.trajectory-no-rows")
    position, q_wb = poses(trajectory, chosen)
    world, body = TUM_FRAMES[chosen.tum_frame]
    first = places_of(trajectory.iloc[:1])[0] if chosen.origin is None else chosen.origin
    lat, lon, alt = (float(v) for v in first)
    head = [
        f"# trajectory: {one_line(chosen.name)}",
        f"# ellipsoid: {chosen.ellipsoid.name}",
        f"# world axes: {world}",
        f"# body axes: {body}",
        "# quaternion: body to world, scalar last",
    ]
    if chosen.tum_frame != "ecef":
        head.append(f"# origin lat lon deg, height m: {lat!r} {lon!r} {alt!r}")
    time = stamps or [repr(t) for t in trajectory.index.to_numpy(dtype=np.float64).tolist()]
    rows = np.column_stack([position, q_wb[:, 1:], q_wb[:, :1]]).tolist()
    lines = [" ".join([t, *map(repr, row)]) for t, row in zip(time, rows, strict=True)]
    text = "\n".join([*head, "# time x y z qx qy qz qw", *lines]) + "\n"
    path.write_bytes(text.encode())


# Reading, by the comments at the top.

_HEAD = re.compile(rb"# (world axes|body axes|ellipsoid|origin lat lon deg, height m): (.*)")
_NORM = 1e-3  # of a quaternion less 1


def _lines(path: Path) -> list[bytes]:
    with path.open("rb") as stream:
        return stream.read(HEAD).split(b"\n")[:-1]


def _has_poses(path: Path) -> bool:
    """Whether the rows are of eight numbers, the last four of which are a unit quaternion."""
    rows = [line.split() for line in _lines(path) if line.strip() and not line.startswith(b"#")]
    try:
        block = np.array([[float(f) for f in row] for row in rows[:50]])
    except ValueError:
        return False
    if block.ndim != 2 or block.shape[1:] != (8,):
        return False
    return bool((np.abs(np.linalg.norm(block[:, 4:], axis=1) - 1.0) < _NORM).all())


detect = Signs(
    suffixes=(*csv.SUFFIXES, ".tum"),
    text=r"^[ \t]*(?:[^\s,#]+[ \t]+){7}[^\s,#]+[ \t\r]*$",
    also=_has_poses,
)


def _three(text: str) -> NDArray[np.float64] | None:
    """Return latitude, longitude and height; None if a text holds anything else."""
    parts = text.split()
    if len(parts) != 3 or not all(NUMBER.fullmatch(p) and "," not in p for p in parts):
        return None
    at = np.array(parts, dtype=np.float64)
    return at if np.isfinite(at).all() and abs(at[0]) <= 90.0 else None


def read(path: Path) -> pd.DataFrame:
    """Read a trajectory whose comments state its axes and its origin.

    Velocities, which the format does not hold, are those of the line between two positions, at its
    middle interpolated to the stamps.

    DataError: the file does not state where on the Earth it is, or has fewer than two poses.
    """
    heads = [m for m in map(_HEAD.match, _lines(path)) if m]
    told = {m[1].decode("utf-8", "replace"): m[2].decode("utf-8", "replace").strip() for m in heads}
    axes = (told.get("world axes"), told.get("body axes"))
    frame = next((name for name, known in TUM_FRAMES.items() if known == axes), None)
    origin = told.get("origin lat lon deg, height m")
    at = _three(origin or "")
    if frame is None or (at is None and (origin is not None or frame != "ecef")):
        raise DataError("io.tum-without-origin", file=path.name)
    raw = csv.read(path)
    values = np.column_stack([numbers(raw, c, c) for c in raw.columns]).astype(np.float64)
    if values.shape[1] != 8 or len(values) < 2:
        raise DataError("io.tum-columns", file=path.name, count=values.shape[1], rows=len(values))
    ellipsoid = find_ellipsoid(told.get("ellipsoid", "wgs84"))
    time, position, q_wb = values[:, 0], values[:, 1:4], values[:, [7, 4, 5, 6]]
    if at is not None:
        q_we = q_ne(at[0], at[1])
        if frame == "enu":
            q_we = rotation.compose(Q_NED_ENU, q_we)
            q_wb = rotation.compose(q_wb, _Q_FRD_FLU)
        position = rotation.rotate(rotation.conjugate(q_we), position)
        position = position + ecef_from_geodetic(at, ellipsoid=ellipsoid)
        q_wb = rotation.compose(rotation.conjugate(q_we), q_wb)
    table = trajectory_of_poses(path, time, position, q_wb, ellipsoid)
    table.attrs["findings"] = (*raw.findings, *table.attrs["findings"])
    return with_clock(table, Clock(clock_of_name("time", float(time[0]))))


def trajectory_of_poses(
    path: Path, time: Array, position: Array, q_eb: Array, ellipsoid: Ellipsoid
) -> pd.DataFrame:
    """Make a Trajectory of poses in axes of the Earth, with the velocities between them.

    `time` ((n,), s). `position` ((n, 3), m): from the center of the Earth. `q_eb` ((n, 4)): body
    (forward, right, down) to axes of the Earth.
    """
    place = geodetic_from_ecef(position, ellipsoid=ellipsoid)
    to_level = q_ne(place[:, 0], place[:, 1])
    middle = 0.5 * (time[1:] + time[:-1])
    steps = np.diff(position, axis=0) / np.diff(time)[:, None]
    velocity = np.column_stack([np.interp(time, middle, steps[:, k]) for k in range(3)])
    table = trajectory_table(
        time,
        place,
        rotation.rotate(to_level, velocity),
        rotation.euler_from_quaternion(rotation.compose(to_level, q_eb)),
        source=path.name,
    )
    note = Finding("io.tum-velocities", file=path.name, quantity=", ".join(VELOCITY))
    table.attrs |= {"ellipsoid": ellipsoid.name, "findings": (note,)}
    return table

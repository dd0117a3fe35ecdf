"""Writers of trajectories: text tables with units, Parquet; GeoJSON (RFC 7946) and KML for maps."""

from __future__ import annotations

import heapq
import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown._kernels.piecewise import farthest
from strapdown.ellipsoids import WGS84, Ellipsoid
from strapdown.errors import DataError
from strapdown.evaluation.trajectory_differences import ROTATION_ERROR
from strapdown.formats import csv, table_files
from strapdown.formats.clocks import clock_of, time_column
from strapdown.formats.trajectory_readers import AS_STATED
from strapdown.formats.writing import FileOptions
from strapdown.frames import ecef_from_geodetic
from strapdown.rotation import within_half_turn
from strapdown.tables import (
    EULER,
    NED,
    POSITION_SD,
    TRAJECTORY,
    TRAJECTORY_ERROR,
    VELOCITY,
    VELOCITY_SD,
    check_gnss,
    check_trajectory,
    check_trajectory_error,
    places_of,
)
from strapdown.tables.checks import Array
from strapdown.tables.on_disk import let_go, parts_of

#: Decimals of time, latitude, longitude, height, velocity and attitude, for fixed digits.
DECIMALS = (9, 11, 11, 6, 8, 8, 8, 9, 9, 9)

_SUFFIX = {
    **dict.fromkeys([*NED, "alt"], "_m"),
    **dict.fromkeys(VELOCITY, "_m_s"),
    **dict.fromkeys([*EULER, *ROTATION_ERROR, "lat", "lon"], "_deg"),
}


def one_line(text: str) -> str:
    """Remove line breaks, which end a comment, and characters invalid in text or XML."""
    return "".join(c for c in " ".join(text.split()) if c.isprintable())


def named_columns(table: pd.DataFrame, columns: list[str]) -> dict[str, NDArray[Any]]:
    """Return time and columns of a table under names with their units, and of its clock."""
    return time_column(table) | {
        c + _SUFFIX[c]: table[c].to_numpy(dtype=np.float64) for c in columns
    }


def told_of(options: FileOptions) -> dict[str, str]:
    """Return the statements of a file on its trajectory: name, ellipsoid, axes, epoch."""
    told = {
        "trajectory": one_line(options.name),
        "ellipsoid": options.ellipsoid.name,
        "place": f"geodetic, height {options.height}",
        "velocity": "relative to the Earth, north east down",
        "attitude": "body forward-right-down to north-east-down",
    }
    if options.heights_as_stated:
        told["heights"] = AS_STATED
    return told if options.epoch is None else {**told, "epoch": options.date(0.0)}


def write_csv(path: Path, trajectory: pd.DataFrame, options: FileOptions | None = None) -> None:
    """Write a Trajectory table as text.

    Parameters
    ----------
    path : Path
    trajectory : DataFrame
    options : FileOptions, optional
        Ellipsoid and epoch are written to the comments at the top. Of its `digits`, ``exact``
        writes the fewest that reproduce each number, and ``fixed`` rounds to `DECIMALS`: a
        micrometer, 10 nm/s, 1e-9 deg of attitude, 1 ns; twice as fast.

    Raises
    ------
    DataError
        The table is not valid.
    """
    chosen = options or FileOptions()
    check_trajectory(trajectory)
    columns = named_columns(trajectory, TRAJECTORY)
    comments = told_of(chosen)
    if chosen.digits == "exact":
        csv.write(path, columns, comments)
        return
    head = "".join(f"# {key}: {value}\n" for key, value in comments.items())
    write_decimals(
        path, list(columns.values()), DECIMALS, separator=",", head=f"{head}{','.join(columns)}\n"
    )


def write_error_csv(path: Path, table: pd.DataFrame, *, name: str = "error") -> None:
    """Write a TrajectoryError table as text.

    Parameters
    ----------
    path : Path
    table : DataFrame
        Errors or standard deviations; with ``phi_N phi_E phi_D`` if available.
    name : str

    Raises
    ------
    DataError
        The table is not valid.
    """
    check_trajectory_error(table)
    more = ROTATION_ERROR if set(ROTATION_ERROR) <= set(table.columns) else []
    comments = {"trajectory error": one_line(name), "sign": "estimate minus reference"}
    if more:
        comments["phi"] = "rotation vector of C_est C_ref^T about north, east, down"
    csv.write(path, named_columns(table, [*TRAJECTORY_ERROR, *more]), comments)


# Fast writing of rows of numbers with fixed decimals.


# Rows converted to text at once.
PIECE = 1 << 15


def write_decimals(
    path: Path,
    columns: Sequence[Array],
    decimals: Sequence[int],
    *,
    separator: str = " ",
    head: str = "",
) -> None:
    """Write columns of numbers as lines.

    `columns` ((n,)): finite numbers. `decimals`: decimals of each column, 0 to 15. The error of a
    number is at most half a unit of its last decimal, plus the precision of a double. `separator`:
    one ASCII character. `head`: header text, with its line feeds.
    """
    from strapdown._kernels.decimal_text import WIDTH, decimal_text

    count = columns[0].size
    places = np.array(decimals, dtype=np.int64)
    text = np.empty(min(count, PIECE) * len(columns) * WIDTH, dtype=np.uint8)
    with path.open("wb") as stream:
        stream.write(head.encode())
        for first in range(0, count, PIECE):
            rows = np.column_stack([c[first : first + PIECE] for c in columns])
            written = decimal_text(rows, places, ord(separator), text)
            if written < 0:
                # A number of more than 15 digits.
                form = separator.join(f"%.{d}f" for d in decimals) + "\n"
                stream.write("".join(form % tuple(row) for row in rows.tolist()).encode())
            else:
                stream.write(text[:written].data)


def write_parquet(
    path: Path,
    trajectory: pd.DataFrame,
    options: FileOptions | None = None,
    points: Array | None = None,
) -> None:
    """Write a Trajectory table as Parquet.

    `trajectory`: further numeric columns, such as standard deviations, are written under their own
    names. `options`: ellipsoid and epoch are written to the file's metadata, like the comments of
    the CSV. `points`: geometry of GeoParquet (`table_files.write_parquet`). DataError: the table is
    not valid.
    """
    chosen = options or FileOptions()
    check_trajectory(trajectory)
    columns = named_columns(trajectory, TRAJECTORY)
    columns |= {
        str(c): trajectory[c].to_numpy(dtype=np.float64)
        for c in trajectory.columns
        if c not in TRAJECTORY and trajectory[c].dtype.kind in "iuf"
    }
    clock = clock_of(trajectory)
    told: dict[str, Any] = told_of(chosen)
    told |= {"clock": clock.name, "clock_origin_s": repr(clock.origin)}
    told |= {} if clock.week is None else {"gps_week": str(clock.week)}
    table_files.write_parquet(path, columns, told, points)


# Trajectories for maps, thinned and split at the date line.


def write_geojson(path: Path, trajectory: pd.DataFrame, options: FileOptions | None = None) -> None:
    """Write a trajectory or fixes as a FeatureCollection: the path, its start and its end.

    Parameters
    ----------
    path : Path
    trajectory : DataFrame
        A Trajectory or Gnss table of one row or more, on WGS 84.
    options : FileOptions, optional
        With `epoch`, dates are added to the times. More than `most_points` rows are thinned to
        those that preserve the path best (`thin`).

    Raises
    ------
    ConfigError
        The ellipsoid is not WGS 84.
    DataError
        The table is not valid, or has no rows.

    Notes
    -----
    Positions are ``[longitude, latitude, height above the ellipsoid]``. A path across the date line
    is a MultiLineString, cut there (3.1.9). The path's property ``time_s`` has one time per
    position, in lists like the coordinates, because RFC 7946 discourages times in positions.
    Longitudes and latitudes have nine decimals (0.1 mm), heights four.
    """
    chosen = options or FileOptions()
    thinned = _thinned(trajectory, chosen, "GeoJSON")
    title = one_line(chosen.name)
    features = [_end(trajectory, 0, "start", title, chosen)]
    if len(trajectory) > 1:
        features = [
            _path_feature(trajectory, thinned, title, chosen),
            *features,
            _end(trajectory, -1, "end", title, chosen),
        ]
    lines = ",\n".join(
        json.dumps(f, ensure_ascii=False, allow_nan=False, separators=(",", ":")) for f in features
    )
    text = f'{{"type":"FeatureCollection","features":[\n{lines}\n]}}\n'
    path.write_bytes(text.encode())


def _thinned(track: pd.DataFrame, options: FileOptions, form: str) -> Thinned:
    """Choose the rows of a map; refuse what is neither a trajectory nor fixes, or has no rows."""
    options.require_wgs84(form)
    (check_gnss if POSITION_SD[0] in track.columns else check_trajectory)(track)
    if track.empty:
        raise DataError("io.trajectory-no-rows")
    return thin(track, options.most_points)


def _known_velocity(track: pd.DataFrame) -> bool:
    """Whether every row has a velocity: fixes may state positions alone."""
    if VELOCITY_SD[0] not in track.columns:
        return True
    return bool(np.isfinite(track[VELOCITY_SD].to_numpy(dtype=np.float64)).all())


#: Decimals of longitude, latitude (0.1 mm) and height.
MAP_DECIMALS = (9, 9, 4)


def _position(point: Array) -> list[float]:
    # Avoid negative zeros.
    return [round(v, d) + 0.0 for v, d in zip(point.tolist(), MAP_DECIMALS, strict=True)]


def _path_feature(
    trajectory: pd.DataFrame, thinned: Thinned, name: str, options: FileOptions
) -> dict[str, Any]:
    kept = trajectory.iloc[thinned.rows]
    time = kept.index.to_numpy(dtype=np.float64)
    points = kept[["lon", "lat", "alt"]].to_numpy(dtype=np.float64)
    parts = cut_at_date_line(np.column_stack([points, time]))
    coordinates = [[_position(p[:3]) for p in part] for part in parts]
    times = [part[:, 3].tolist() for part in parts]
    speeds: dict[str, float] = {}
    if _known_velocity(trajectory):
        speed = np.sqrt(np.square(trajectory[VELOCITY].to_numpy(dtype=np.float64)).sum(axis=1))
        stamps = trajectory.index.to_numpy(dtype=np.float64)
        mean = np.trapezoid(speed, stamps) / (stamps[-1] - stamps[0])
        speeds = {"largest_speed_m_s": float(speed.max()), "mean_speed_m_s": float(mean)}
    properties: dict[str, Any] = {
        "name": name,
        "part": "path",
        "samples": thinned.samples,
        "points": len(thinned.rows),
        "largest_deviation_m": float(f"{thinned.deviation_m:.3g}"),
        "start_s": float(time[0]),
        "end_s": float(time[-1]),
        **speeds,
        "height": options.height,
        **_dates(options, {"start_utc": float(time[0]), "end_utc": float(time[-1])}),
        "time_s": times[0] if len(parts) == 1 else times,
    }
    geometry = (
        {"type": "LineString", "coordinates": coordinates[0]}
        if len(parts) == 1
        else {"type": "MultiLineString", "coordinates": coordinates}
    )
    return {"type": "Feature", "geometry": geometry, "properties": properties}


def _dates(options: FileOptions, times: dict[str, float]) -> dict[str, str]:
    return {} if options.epoch is None else {k: options.date(t) for k, t in times.items()}


def _end(
    trajectory: pd.DataFrame, row: int, part: str, name: str, options: FileOptions
) -> dict[str, Any]:
    at = trajectory.iloc[row]
    time = float(trajectory.index[row])
    point = at[["lon", "lat", "alt"]].to_numpy(dtype=np.float64).copy()
    point[:1] = within_half_turn(point[:1])
    moves = VELOCITY if _known_velocity(trajectory.iloc[[row]]) else []
    properties = {
        "name": name,
        "part": part,
        "time_s": time,
        **_dates(options, {"time_utc": time}),
        **{f"{c}_m_s": float(at[c]) for c in moves},
        **{f"{c}_deg": float(at[c]) for c in EULER if c in trajectory.columns},
    }
    geometry = {"type": "Point", "coordinates": _position(point)}
    return {"type": "Feature", "geometry": geometry, "properties": properties}


# Trajectories as KML, for Google Earth and similar programs.


_HEAD = (
    '<?xml version="1.0" encoding="UTF-8"?>\n'
    '<kml xmlns="http://www.opengis.net/kml/2.2" xmlns:gx="http://www.google.com/kml/ext/2.2">'
)
# Colors are opacity, blue, green, red.
_STYLE = '<Style id="path"><LineStyle><color>ff2d6fd9</color><width>3</width></LineStyle></Style>'


def write_kml(path: Path, trajectory: pd.DataFrame, options: FileOptions | None = None) -> None:
    """Write a trajectory or fixes as OGC KML 2.2: the path, its start and its end.

    Parameters
    ----------
    path, trajectory, options
        As `write_geojson`. With `epoch`, a track with dates (``gx:Track``, Google's extension) is
        written in addition to the path.

    Raises
    ------
    ConfigError, DataError
        As `write_geojson`.

    Notes
    -----
    Heights of ``altitudeMode`` *absolute* are above the EGM96 geoid (OGC 07-147r2), those of a
    trajectory above the ellipsoid. The difference, at most 110 m, is subtracted if given as
    `geoid_undulation`; otherwise the file states that it is not. Longitudes and latitudes have nine
    decimals (0.1 mm), heights four.
    """
    chosen = options or FileOptions()
    thinned = _thinned(trajectory, chosen, "KML")
    kept = trajectory.iloc[thinned.rows]
    points = kept[["lon", "lat", "alt"]].to_numpy(dtype=np.float64).copy()
    points[:, 0] = within_half_turn(points[:, 0])
    points[:, 2] -= chosen.geoid_undulation or 0.0
    time = kept.index.to_numpy(dtype=np.float64)
    lines = [
        _HEAD,
        "<Document>",
        f"<name>{escape(one_line(chosen.name), quote=False)}</name>",
        f"<description>{escape(_description(thinned, chosen), quote=False)}</description>",
        _STYLE,
    ]
    if len(points) > 1:
        lines += _path_placemark(points)
        if chosen.epoch is not None:
            lines += _track(points, [chosen.date(t) for t in time.tolist()])
    ends = [("start", 0)] + ([("end", -1)] if len(points) > 1 else [])
    for label, row in ends:
        date = "" if chosen.epoch is None else chosen.date(float(time[row]))
        stamp = date and f"<TimeStamp><when>{date}</when></TimeStamp>"
        lines.append(
            f"<Placemark><name>{label}</name><description>{time[row]:.9g} s</description>{stamp}"
            f"<Point><altitudeMode>absolute</altitudeMode><coordinates>"
            f"{_coordinates(points[row], ',')}</coordinates></Point></Placemark>"
        )
    lines += ["</Document>", "</kml>"]
    path.write_bytes(("\n".join(lines) + "\n").encode())


def _description(thinned: Thinned, options: FileOptions) -> str:
    if options.heights_as_stated:
        return f"{thinned.sentence} Heights are {options.height}."
    heights = (
        "Heights are over the WGS 84 ellipsoid, and KML counts them from the EGM96 geoid: what "
        "is shown is too high by the height of the geoid over the ellipsoid there, -110 to 90 m."
        if options.geoid_undulation is None
        else f"Heights are over the geoid: {options.geoid_undulation:.9g} m, the same everywhere, "
        "was taken off the heights over the WGS 84 ellipsoid."
    )
    return f"{thinned.sentence} {heights}"


def _coordinates(point: Array, separator: str) -> str:
    texts = (f"{v:.{d}f}" for v, d in zip(_position(point), MAP_DECIMALS, strict=True))
    return separator.join(text.rstrip("0").rstrip(".") for text in texts)


def _path_placemark(points: Array) -> list[str]:
    parts = [
        [
            "<LineString><altitudeMode>absolute</altitudeMode><coordinates>",
            *(_coordinates(p, ",") for p in part),
            "</coordinates></LineString>",
        ]
        for part in cut_at_date_line(points)
    ]
    inner = [line for part in parts for line in part]
    if len(parts) > 1:
        inner = ["<MultiGeometry>", *inner, "</MultiGeometry>"]
    return ["<Placemark><name>path</name><styleUrl>#path</styleUrl>", *inner, "</Placemark>"]


def _track(points: Array, dates: list[str]) -> list[str]:
    return [
        "<Placemark><name>track</name><styleUrl>#path</styleUrl>",
        "<gx:Track><altitudeMode>absolute</altitudeMode>",
        *(f"<when>{date}</when>" for date in dates),
        *(f"<gx:coord>{_coordinates(p, ' ')}</gx:coord>" for p in points),
        "</gx:Track></Placemark>",
    ]


# Splitting of a line on a map where it crosses the date line.


def cut_at_date_line(points: Array) -> list[Array]:
    """Cut a line so that no part crosses the date line (RFC 7946, 3.1.9).

    `points` ((n, m)): two or more; longitude in deg first, then any values to interpolate with it.
    Between points the line takes the shorter way around. Returns (k, m), parts with longitudes
    within -180 to 180 deg, of two points or more; at a crossing one part ends at 180 or -180 deg
    and the next begins at the other.
    """
    lon = np.degrees(np.unwrap(np.radians(points[:, 0])))
    # Longitudes within a turn already are kept to the last digit.
    turns = np.round((lon - points[:, 0]) / 360.0)
    line = points.copy()
    line[:, 0] += 360.0 * turns
    whole = _with_crossings(line)
    middle = 0.5 * (whole[:-1, 0] + whole[1:, 0])
    cells = np.floor((middle + 180.0) / 360.0).astype(np.int64)
    # A section along the date line itself stays with the part before it.
    for k in np.flatnonzero(np.remainder(middle, 360.0) == 180.0):
        cells[k] = cells[k - 1] if k else cells[k]
    parts = []
    starts = np.r_[0, np.flatnonzero(np.diff(cells)) + 1, len(cells)]
    for first, end in pairwise(starts.tolist()):
        part = whole[first : end + 1].copy()
        part[:, 0] -= 360.0 * cells[first]
        parts.append(part)
    return parts


def _with_crossings(line: Array) -> Array:
    """Insert a point wherever the line crosses 180 deg, plus any number of turns."""
    rows = [line[:1]]
    for a, b in pairwise(line):
        low, high = sorted((a[0], b[0]))
        # The only odd multiple of 180 deg within a step of less than half a turn.
        edge = 360.0 * np.ceil((low - 180.0) / 360.0) + 180.0
        if low < edge < high:
            crossing = a + (edge - a[0]) / (b[0] - a[0]) * (b - a)
            crossing[0] = edge
            rows.append(crossing[None])
        rows.append(b[None])
    return np.concatenate(rows)


# Thinning of a trajectory for a map, with the largest deviation.


# Limit of rows examined per split, so that the time is proportional to the length of a track.
LONGEST_PIECE = 4096


@dataclass(frozen=True)
class Thinned:
    """Rows that represent a trajectory on a map.

    `rows`: in order, including both ends. `samples`: number of rows of the trajectory.
    `deviation_m` (m): largest distance of a dropped position from the straight line between its
    neighbors, at its own time.
    """

    rows: NDArray[np.intp]
    samples: int
    deviation_m: float

    @property
    def sentence(self) -> str:
        """Summary of the dropped rows, for reports."""
        if len(self.rows) == self.samples:
            return f"All {self.samples} points."
        return (
            f"{len(self.rows)} of {self.samples} points; those left out lie within "
            f"{self.deviation_m:.2g} m of the line between their neighbours, at their own time."
        )


def thin(trajectory: pd.DataFrame, most: int, ellipsoid: Ellipsoid = WGS84) -> Thinned:
    """Choose the rows that preserve a trajectory's path best.

    `trajectory`: a Trajectory table. `most`: number of rows to keep; all if there are not more.

    Splitting by Douglas and Peucker (Cartographica 10 (1973) 112-122), the farthest row first,
    until the requested number is reached, with the distance at equal times (Meratnia and de By,
    EDBT 2004, doi:10.1007/978-3-540-24741-8_44), which preserves stops. Distances are along the
    axes of the Earth. A long trajectory is first split into even parts.
    """
    n = len(trajectory)
    if n <= most:
        return Thinned(np.arange(n), n, 0.0)
    time = trajectory.index.to_numpy(dtype=np.float64)
    place = np.empty((n, 3))
    for part in parts_of(n, len(TRAJECTORY)):
        of_part = places_of(trajectory.iloc[part])
        place[part] = ecef_from_geodetic(of_part, ellipsoid=ellipsoid)
        let_go(trajectory)
    pieces = max(1, min(-(-n // LONGEST_PIECE), (most - 1) // 2))
    kept = sorted({int(k) for k in np.linspace(0, n - 1, pieces + 1).round()})
    heap: list[tuple[float, int, int, int]] = []

    def push(first: int, last: int) -> None:
        if last - first > 1:
            square, at = farthest(time, place, first, last)
            heapq.heappush(heap, (-math.sqrt(square), first, last, at))

    for first, last in pairwise(list(kept)):
        push(first, last)
    while heap and len(kept) < most and heap[0][0] < 0.0:
        _, first, last, at = heapq.heappop(heap)
        kept.append(at)
        push(first, at)
        push(at, last)
    return Thinned(np.array(sorted(kept)), n, -heap[0][0] if heap else 0.0)

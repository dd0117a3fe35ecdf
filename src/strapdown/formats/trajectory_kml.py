"""Trajectories as KML, for Google Earth and similar programs."""

from __future__ import annotations

from pathlib import Path
from xml.sax.saxutils import escape

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.errors import DataError
from strapdown.formats.date_line import cut_at_date_line
from strapdown.formats.trajectory_csv import one_line
from strapdown.formats.trajectory_options import TrajectoryFileOptions
from strapdown.formats.trajectory_thinning import Thinned, thin
from strapdown.rotation import within_half_turn
from strapdown.tables import check_trajectory

Array = NDArray[np.float64]

__all__ = ["write_kml"]

_HEAD = (
    '<?xml version="1.0" encoding="UTF-8"?>\n'
    '<kml xmlns="http://www.opengis.net/kml/2.2" xmlns:gx="http://www.google.com/kml/ext/2.2">'
)
# Colors are opacity, blue, green, red.
_STYLE = '<Style id="path"><LineStyle><color>ff2d6fd9</color><width>3</width></LineStyle></Style>'


def write_kml(
    path: Path,
    trajectory: pd.DataFrame,
    *,
    name: str = "trajectory",
    options: TrajectoryFileOptions | None = None,
) -> None:
    """Write a trajectory as OGC KML 2.2: the path, its start and its end.

    Parameters
    ----------
    path : Path
    trajectory : DataFrame
        A Trajectory table of one row or more, on WGS 84.
    name : str
    options : TrajectoryFileOptions, optional
        With `epoch`, a track with dates (``gx:Track``, Google's extension) is written in
        addition to the path. More than `most_points` rows are thinned to those that preserve
        the path best (`trajectory_thinning.thin`).

    Raises
    ------
    ConfigError
        The ellipsoid is not WGS 84.
    DataError
        The table is not valid, or has no rows.

    Notes
    -----
    Heights of ``altitudeMode`` *absolute* are above the EGM96 geoid (OGC 07-147r2), those of a
    trajectory above the ellipsoid. The difference, at most 110 m, is subtracted if given as
    `geoid_undulation`; otherwise the file states that it is not. Longitudes and latitudes have nine
    decimals (0.1 mm), heights four.
    """
    chosen = options or TrajectoryFileOptions()
    chosen.require_wgs84("KML")
    check_trajectory(trajectory)
    if trajectory.empty:
        raise DataError("io.trajectory-no-rows")
    thinned = thin(trajectory, chosen.most_points)
    kept = trajectory.iloc[thinned.rows]
    points = kept[["lon", "lat", "alt"]].to_numpy(dtype=np.float64).copy()
    points[:, 0] = within_half_turn(points[:, 0])
    points[:, 2] -= chosen.geoid_undulation or 0.0
    time = kept.index.to_numpy(dtype=np.float64)
    lines = [
        _HEAD,
        "<Document>",
        f"<name>{escape(one_line(name))}</name>",
        f"<description>{escape(_description(thinned, chosen))}</description>",
        _STYLE,
    ]
    if len(points) > 1:
        lines += _path(points)
        if chosen.epoch is not None:
            lines += _track(points, [chosen.date(t) for t in time.tolist()])
    ends = [("start", 0)] + ([("end", -1)] if len(points) > 1 else [])
    for label, row in ends:
        stamp = "" if chosen.epoch is None else _stamp(chosen.date(float(time[row])))
        lines.append(
            f"<Placemark><name>{label}</name><description>{time[row]:.9g} s</description>{stamp}"
            f"<Point><altitudeMode>absolute</altitudeMode><coordinates>"
            f"{_coordinates(points[row], ',')}</coordinates></Point></Placemark>"
        )
    lines += ["</Document>", "</kml>"]
    path.write_bytes(("\n".join(lines) + "\n").encode())


def _description(thinned: Thinned, options: TrajectoryFileOptions) -> str:
    heights = (
        "Heights are over the WGS 84 ellipsoid, and KML counts them from the EGM96 geoid: what "
        "is shown is too high by the height of the geoid over the ellipsoid there, -110 to 90 m."
        if options.geoid_undulation is None
        else f"Heights are over the geoid: {options.geoid_undulation:.9g} m, the same everywhere, "
        "was taken off the heights over the WGS 84 ellipsoid."
    )
    return f"{thinned.sentence} {heights}"


def _coordinates(point: Array, separator: str) -> str:
    # Avoid negative zeros.
    lon, lat, alt = (round(v, d) + 0.0 for v, d in zip(point.tolist(), (9, 9, 4), strict=True))
    return separator.join((_plain(lon, 9), _plain(lat, 9), _plain(alt, 4)))


def _plain(value: float, decimals: int) -> str:
    text = f"{value:.{decimals}f}".rstrip("0").rstrip(".")
    return text or "0"


def _path(points: Array) -> list[str]:
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


def _stamp(date: str) -> str:
    return f"<TimeStamp><when>{date}</when></TimeStamp>"

"""Trajectories as GeoJSON (RFC 7946)."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.errors import DataError
from strapdown.formats.date_line import cut_at_date_line
from strapdown.formats.trajectory_csv import one_line
from strapdown.formats.trajectory_options import TrajectoryFileOptions
from strapdown.formats.trajectory_thinning import Thinned, thin
from strapdown.rotation import within_half_turn
from strapdown.tables import EULER, VELOCITY, check_trajectory

Array = NDArray[np.float64]

__all__ = ["write_geojson"]


def write_geojson(
    path: Path,
    trajectory: pd.DataFrame,
    *,
    name: str = "trajectory",
    options: TrajectoryFileOptions | None = None,
) -> None:
    """Write a trajectory as a FeatureCollection: the path, its start and its end.

    Parameters
    ----------
    path : Path
    trajectory : DataFrame
        A Trajectory table of one row or more, on WGS 84.
    name : str
    options : TrajectoryFileOptions, optional
        With `epoch`, dates are added to the times. More than `most_points` rows are thinned to
        those that preserve the path best (`trajectory_thinning.thin`).

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
    chosen = options or TrajectoryFileOptions()
    chosen.require_wgs84("GeoJSON")
    check_trajectory(trajectory)
    if trajectory.empty:
        raise DataError("io.trajectory-no-rows")
    thinned = thin(trajectory, chosen.most_points)
    title = one_line(name)
    features = [_end(trajectory, 0, "start", title, chosen)]
    if len(trajectory) > 1:
        features = [
            _path(trajectory, thinned, title, chosen),
            *features,
            _end(trajectory, -1, "end", title, chosen),
        ]
    lines = ",\n".join(
        json.dumps(f, ensure_ascii=False, allow_nan=False, separators=(",", ":")) for f in features
    )
    text = f'{{"type":"FeatureCollection","features":[\n{lines}\n]}}\n'
    path.write_bytes(text.encode())


def _position(point: Array) -> list[float]:
    # Avoid negative zeros.
    return [round(v, d) + 0.0 for v, d in zip(point.tolist(), (9, 9, 4), strict=True)]


def _path(
    trajectory: pd.DataFrame, thinned: Thinned, name: str, options: TrajectoryFileOptions
) -> dict[str, Any]:
    kept = trajectory.iloc[thinned.rows]
    time = kept.index.to_numpy(dtype=np.float64)
    points = kept[["lon", "lat", "alt"]].to_numpy(dtype=np.float64)
    parts = cut_at_date_line(np.column_stack([points, time]))
    coordinates = [[_position(p[:3]) for p in part] for part in parts]
    times = [part[:, 3].tolist() for part in parts]
    speed = np.sqrt(np.square(trajectory[VELOCITY].to_numpy(dtype=np.float64)).sum(axis=1))
    properties: dict[str, Any] = {
        "name": name,
        "part": "path",
        "samples": thinned.samples,
        "points": len(thinned.rows),
        "largest_deviation_m": float(f"{thinned.deviation_m:.3g}"),
        "start_s": float(time[0]),
        "end_s": float(time[-1]),
        "largest_speed_m_s": float(speed.max()),
        "mean_speed_m_s": _mean(trajectory.index.to_numpy(dtype=np.float64), speed),
        "height": "over the WGS 84 ellipsoid",
        **_dates(options, {"start_utc": float(time[0]), "end_utc": float(time[-1])}),
        "time_s": times[0] if len(parts) == 1 else times,
    }
    geometry = (
        {"type": "LineString", "coordinates": coordinates[0]}
        if len(parts) == 1
        else {"type": "MultiLineString", "coordinates": coordinates}
    )
    return {"type": "Feature", "geometry": geometry, "properties": properties}


def _mean(time: Array, values: Array) -> float:
    return float(np.trapezoid(values, time) / (time[-1] - time[0]))


def _dates(options: TrajectoryFileOptions, times: dict[str, float]) -> dict[str, str]:
    return {} if options.epoch is None else {k: options.date(t) for k, t in times.items()}


def _end(
    trajectory: pd.DataFrame, row: int, part: str, name: str, options: TrajectoryFileOptions
) -> dict[str, Any]:
    at = trajectory.iloc[row]
    time = float(trajectory.index[row])
    point = at[["lon", "lat", "alt"]].to_numpy(dtype=np.float64).copy()
    point[:1] = within_half_turn(point[:1])
    properties = {
        "name": name,
        "part": part,
        "time_s": time,
        **_dates(options, {"time_utc": time}),
        **{f"{c}_m_s": float(at[c]) for c in VELOCITY},
        **{f"{c}_deg": float(at[c]) for c in EULER},
    }
    geometry = {"type": "Point", "coordinates": _position(point)}
    return {"type": "Feature", "geometry": geometry, "properties": properties}

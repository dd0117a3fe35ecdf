"""A path through waypoints, in time or at a speed."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from strapdown.ellipsoids import WGS84, Ellipsoid
from strapdown.errors import ConfigError
from strapdown.simulation.spline_motion import SplineMotion

Array = NDArray[np.float64]


def through_waypoints(
    places: Sequence[tuple[float, float, float]],
    *,
    times: Sequence[float] | None = None,
    speeds: Sequence[float] | None = None,
    most_acceleration: float = 30.0,
    ellipsoid: Ellipsoid = WGS84,
) -> SplineMotion:
    """A vehicle without roll, nose along its path.

    Parameters
    ----------
    places : sequence of (lat_deg, lon_deg, alt)
        deg, deg, m; two or more.
    times : sequence of float, s
        From zero, one a place.
    speeds : sequence of float, m/s
        Instead of times: the mean speed along the straight line from each place to the next.
    most_acceleration : float, m/s²
        Of the spline through the places.
    ellipsoid : Ellipsoid

    Returns
    -------
    SplineMotion

    Raises
    ------
    ConfigError
        Neither or both of times and speeds are given, or not as many as there are places or legs,
        a place is repeated, or as `SplineMotion`.
    """
    rows = np.array(places, dtype=np.float64).reshape(-1, 3)
    if (times is None) == (speeds is None):
        raise ConfigError("simulation.neither-times-nor-speeds-or", quantity="places")
    same = np.flatnonzero(np.all(np.diff(rows, axis=0) == 0.0, axis=1))
    if same.size:
        k = int(same[0])
        raise ConfigError("simulation.before", quantity=f"place {k + 2}")
    stamps = _times(rows, speeds, ellipsoid) if speeds is not None else np.array(times, dtype=float)
    return SplineMotion(
        stamps,
        rows,
        None,
        ellipsoid,
        most_acceleration,
    )


def _times(places: Array, speeds: Sequence[float], ellipsoid: Ellipsoid) -> Array:
    if len(speeds) != len(places) - 1:
        raise ConfigError(
            "simulation.speeds-legs", quantity="speed", count=len(speeds), count_2=len(places) - 1
        )
    for k, speed in enumerate(speeds):
        if not 0.0 < speed < math.inf:
            raise ConfigError("simulation.speed-2", quantity=f"place {k + 2}, speed", speed=speed)
    from strapdown._kernels.earth import radii

    times = [0.0]
    for (lat, lon, alt), (to_lat, to_lon, to_alt), speed in zip(
        places[:-1], places[1:], speeds, strict=True
    ):
        # The straight line on the ground at the middle; it only shares out time.
        middle = math.radians(0.5 * (lat + to_lat))
        meridian, transverse = radii(
            math.sin(middle), ellipsoid.semi_major_axis, ellipsoid.eccentricity_squared
        )
        height = 0.5 * (alt + to_alt)
        north = (meridian + height) * math.radians(to_lat - lat)
        across = math.remainder(to_lon - lon, 360.0)
        east = (transverse + height) * math.cos(middle) * math.radians(across)
        times.append(times[-1] + math.hypot(north, east, to_alt - alt) / speed)
    return np.array(times)

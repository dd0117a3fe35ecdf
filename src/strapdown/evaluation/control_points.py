"""Compare a path with control points after the best-fitting shift and rotation.

Dead reckoning from an arbitrary start finds a path up to a shift and a rotation, but with its
scale and bends. The fit removes the shift and rotation; the residual is the error. It spends
three of the 2N numbers of N points.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from strapdown.ellipsoids import WGS84, Ellipsoid
from strapdown.errors import DataError
from strapdown.evaluation.trajectory_differences import trajectory_at
from strapdown.frames import ned_from_geodetic
from strapdown.tables import places_of
from strapdown.tables.checks import index_of, source_of, values_of

Array = NDArray[np.float64]

#: Least distance from point to point, m: closer points define no direction.
NO_WAY = 1e-6


@dataclass(frozen=True, eq=False)
class ControlPointScore:
    """Errors of a path at its control points.

    Attributes
    ----------
    time : ndarray, (n,), s
    points : ndarray, (n, 2), m
        Control points, rotated and shifted onto the path: north and east of the path's start.
    error : ndarray, (n, 2), m
        Computed − control points.
    turn_deg : float, deg
        Heading of the run minus that of the points' own north, -180 to 180.
    way : float, m
        From point to point in all.
    given : int
        Number of points, including those before and after the run.
    """

    time: Array
    points: Array
    error: Array
    turn_deg: float
    way: float
    given: int

    @property
    def distance(self) -> Array:
        """Length of the error, (n,), m."""
        return np.asarray(np.hypot(self.error[:, 0], self.error[:, 1]))

    @property
    def rms(self) -> float:
        """Root mean square of the distances, m."""
        return float(np.sqrt(np.square(self.distance).mean()))

    @property
    def median(self) -> float:
        """Median of the distances, m."""
        return float(np.median(self.distance))

    @property
    def largest(self) -> float:
        """Largest of the distances, m."""
        return float(self.distance.max())

    @property
    def largest_at(self) -> float:
        """Time of the largest distance, s."""
        return float(self.time[int(np.argmax(self.distance))])


def rigid_fit(points: ArrayLike, onto: ArrayLike) -> tuple[float, Array]:
    """Return the rotation and the shift that best fit points of a plane to others.

    Parameters
    ----------
    points, onto : array_like, (n, 2)
        North, east.

    Returns
    -------
    turn : float, rad
        From north to east.
    placed : ndarray, (n, 2)
        The points, rotated and shifted: the sum of squared distances to `onto` is least.

    Notes
    -----
    With both about their means, ``turn = atan2(sum p x q, sum p . q)``: Umeyama, IEEE Trans.
    Pattern Analysis 13 (1991) 376, for two dimensions and without scale.
    """
    p, q = np.asarray(points, dtype=np.float64), np.asarray(onto, dtype=np.float64)
    a, b = p - p.mean(axis=0), q - q.mean(axis=0)
    cross = float((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum())
    turn = math.atan2(cross, float((a * b).sum()))
    c, s = math.cos(turn), math.sin(turn)
    return turn, a @ np.array([[c, s], [-s, c]]) + q.mean(axis=0)


def score_control_points(
    trajectory: pd.DataFrame, points: pd.DataFrame, ellipsoid: Ellipsoid = WGS84
) -> ControlPointScore:
    """Compare a trajectory with control points.

    Parameters
    ----------
    trajectory : DataFrame
        Trajectory table.
    points : DataFrame
        By time in s on its clock, ``north`` and ``east`` in m (`read_control_points`). Points
        outside its time span are left out.
    ellipsoid : Ellipsoid

    Returns
    -------
    ControlPointScore

    Raises
    ------
    DataError
        Fewer than two are within its time, or all are at one position.
    """
    time, own = index_of(points), index_of(trajectory)
    within = (time >= own[0]) & (time <= own[-1])
    places = values_of(points, ["north", "east"])[within]
    if len(places) < 2:
        raise DataError(
            "evaluation.control-points-lie-within-run",
            file=source_of(points),
            quantity="time",
            count=len(places),
            count_2=len(time),
            own=own[0],
            own_2=own[-1],
            time=time[0],
            time_2=time[-1],
        )
    way = float(np.hypot(*np.diff(places, axis=0).T).sum())
    if not way > NO_WAY:
        raise DataError(
            "evaluation.all-control-points-within-run",
            file=source_of(points),
            quantity="north, east",
        )
    here = trajectory_at(trajectory, time[within], ellipsoid)
    origin = places_of(trajectory.iloc[:1])[0]
    path = ned_from_geodetic(places_of(here), origin, ellipsoid=ellipsoid)[:, :2]
    turn, placed = rigid_fit(places, path)
    error = path - placed
    return ControlPointScore(time[within], placed, error, math.degrees(turn), way, len(time))

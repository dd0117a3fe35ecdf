"""Thinning of a trajectory for a map, with the largest deviation."""

from __future__ import annotations

import heapq
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.ellipsoids import WGS84, Ellipsoid
from strapdown.frames import ecef_from_geodetic
from strapdown.tables import places_of

Array = NDArray[np.float64]

__all__ = ["Thinned", "thin"]

# Limit of rows examined per split, so that the time is proportional to the length of a track.
LONGEST_PIECE = 4096


@dataclass(frozen=True)
class Thinned:
    """Rows that represent a trajectory on a map.

    Attributes
    ----------
    rows : ndarray of int
        In order, including both ends.
    samples : int
        Number of rows of the trajectory.
    deviation_m : float, m
        Largest distance of a dropped position from the straight line between its neighbors, at
        its own time.
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

    Parameters
    ----------
    trajectory : DataFrame
        A Trajectory table.
    most : int
        Number of rows to keep; all if there are not more.
    ellipsoid : Ellipsoid

    Returns
    -------
    Thinned

    Notes
    -----
    Splitting by Douglas and Peucker (Cartographica 10 (1973) 112-122), the farthest row first,
    until the requested number is reached, with the distance at equal times (Meratnia and de By,
    EDBT 2004, doi:10.1007/978-3-540-24741-8_44), which preserves stops. Distances are along the
    axes of the Earth. A long trajectory is first split into even parts.
    """
    n = len(trajectory)
    if n <= most:
        return Thinned(np.arange(n), n, 0.0)
    time = trajectory.index.to_numpy(dtype=np.float64)
    place = ecef_from_geodetic(places_of(trajectory), ellipsoid=ellipsoid)
    pieces = max(1, min(-(-n // LONGEST_PIECE), (most - 1) // 2))
    kept = sorted({int(k) for k in np.linspace(0, n - 1, pieces + 1).round()})
    heap: list[tuple[float, int, int, int]] = []

    def push(first: int, last: int) -> None:
        if last - first > 1:
            distance, at = _farthest(time, place, first, last)
            heapq.heappush(heap, (-distance, first, last, at))

    for first, last in pairwise(list(kept)):
        push(first, last)
    while heap and len(kept) < most and heap[0][0] < 0.0:
        _, first, last, at = heapq.heappop(heap)
        kept.append(at)
        push(first, at)
        push(at, last)
    return Thinned(np.array(sorted(kept)), n, -heap[0][0] if heap else 0.0)


def _farthest(time: Array, place: Array, first: int, last: int) -> tuple[float, int]:
    """Find the position farthest from the line at its time; return distance and row."""
    inner = slice(first + 1, last)
    share = (time[inner] - time[first]) / (time[last] - time[first])
    line = place[first] + share[:, None] * (place[last] - place[first])
    squares = np.square(place[inner] - line).sum(axis=1)
    worst = int(np.argmax(squares))
    return float(np.sqrt(squares[worst])), first + 1 + worst

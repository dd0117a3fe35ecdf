"""Fewer points for a map, and how far from the line the others lie."""

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

# A split looks at no more rows than this, so that a track of any shape takes time in proportion
# to its length.
LONGEST_PIECE = 4096


@dataclass(frozen=True)
class Thinned:
    """The rows that stand for a trajectory on a map.

    Attributes
    ----------
    rows : ndarray of int
        In order, both ends among them.
    samples : int
        Rows of the trajectory.
    deviation_m : float, m
        How far a place that was left out lies at most from the straight line between its
        neighbours, taken at its own time.
    """

    rows: NDArray[np.intp]
    samples: int
    deviation_m: float

    @property
    def sentence(self) -> str:
        """What was left out, for a person."""
        if len(self.rows) == self.samples:
            return f"All {self.samples} points."
        return (
            f"{len(self.rows)} of {self.samples} points; those left out lie within "
            f"{self.deviation_m:.2g} m of the line between their neighbours, at their own time."
        )


def thin(trajectory: pd.DataFrame, most: int, ellipsoid: Ellipsoid = WGS84) -> Thinned:
    """Choose the rows that keep a trajectory's course best.

    Parameters
    ----------
    trajectory : DataFrame
        A Trajectory table.
    most : int
        Number of rows to keep; all are kept where there are no more.
    ellipsoid : Ellipsoid

    Returns
    -------
    Thinned

    Notes
    -----
    Douglas and Peucker's splitting (Cartographica 10 (1973) 112-122), the farthest row first,
    until so many rows are kept, with the distance taken at equal times (Meratnia and de By,
    EDBT 2004, doi:10.1007/978-3-540-24741-8_44), so that a stop stays a stop. Along the axes of
    the Earth. A trajectory of many rows begins split into even pieces.
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
    """Distance and row of the place that lies farthest from the line at its time."""
    inner = slice(first + 1, last)
    share = (time[inner] - time[first]) / (time[last] - time[first])
    line = place[first] + share[:, None] * (place[last] - place[first])
    squares = np.square(place[inner] - line).sum(axis=1)
    worst = int(np.argmax(squares))
    return float(np.sqrt(squares[worst])), first + 1 + worst

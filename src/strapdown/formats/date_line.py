"""Splitting of a line on a map where it crosses the date line."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

__all__ = ["cut_at_date_line"]


def cut_at_date_line(points: Array) -> list[Array]:
    """Cut a line so that no part crosses the date line (RFC 7946, 3.1.9).

    Parameters
    ----------
    points : ndarray, (n, m)
        Two or more; longitude in deg first, then any values to interpolate with it. Between
        points the line takes the shorter way around.

    Returns
    -------
    list of ndarray, (k, m)
        Parts with longitudes within -180 to 180 deg, of two points or more; at a crossing one
        part ends at 180 or -180 deg and the next begins at the other.
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

"""Area that contains a point with 95 % probability, along its path."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from strapdown.evaluation.plane_bound import PLANE_95

Array = NDArray[np.float64]

__all__ = ["ellipse", "envelope", "hull"]

_CORNERS = 28


def ellipse(centre: Array, covariance: Array, corners: int = _CORNERS) -> Array:
    """95 % ellipse of a normal error in a plane.

    Parameters
    ----------
    centre : ndarray, (2,)
    covariance : ndarray, (2, 2)
    corners : int

    Returns
    -------
    ndarray, (corners, 2)
        Points on the ellipse; all at the center if the error is zero.
    """
    values, vectors = np.linalg.eigh(np.where(np.isfinite(covariance), covariance, 0.0))
    turn = np.linspace(0.0, 2.0 * math.pi, corners, endpoint=False)
    round_ = np.column_stack([np.cos(turn), np.sin(turn)])
    axes = vectors * (PLANE_95 * np.sqrt(np.maximum(values, 0.0)))
    # The sign of an eigenvector, and so the first corner, depends on the library.
    axes = axes * np.where(axes.sum(axis=0) < 0.0, -1.0, 1.0)
    return np.asarray(centre + round_ @ axes.T)


def hull(points: Array) -> Array:
    """Convex hull of points in a plane, (n, 2), counterclockwise; they may be collinear."""
    ordered = sorted({(float(x), float(y)) for x, y in points})
    if len(ordered) < 3:
        return np.array(ordered, dtype=np.float64).reshape(-1, 2)

    def half(run: list[tuple[float, float]]) -> list[tuple[float, float]]:
        kept: list[tuple[float, float]] = []
        for p in run:
            while len(kept) > 1:
                (ax, ay), (bx, by) = kept[-2], kept[-1]
                if (bx - ax) * (p[1] - ay) - (by - ay) * (p[0] - ax) > 0.0:
                    break
                kept.pop()
            kept.append(p)
        return kept[:-1]

    return np.array(half(ordered) + half(ordered[::-1]), dtype=np.float64)


def envelope(places: Array, covariances: Array, pieces: int = 60) -> list[Array]:
    """Areas that together cover the ellipses along a path.

    Parameters
    ----------
    places : ndarray, (n, 2)
    covariances : ndarray, (n, 2, 2)
    pieces : int
        Maximum number of areas.

    Returns
    -------
    list of ndarray, (k, 2)
        Convex hulls of consecutive pairs of ellipses, without gaps between them.
    """
    rows = np.unique(np.linspace(0, len(places) - 1, min(pieces + 1, len(places))).astype(int))
    rings = [ellipse(places[k], covariances[k]) for k in rows]
    if len(rings) < 2:
        return rings
    return [hull(np.vstack([a, b])) for a, b in pairwise(rings)]

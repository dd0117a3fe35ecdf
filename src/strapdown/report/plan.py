"""Paths on a plan: extent, marks of direction and time, positions of labels, 95 % ellipses."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from strapdown.constants import Array
from strapdown.dsp.chi_square import PLANE_95
from strapdown.report.chart import BLACK, GREEN, VERMILLION, Line, dots
from strapdown.report.svg_drawing import overlap

Path = tuple[Array, Array]

# Height of a plan as a share of its width, for one as wide as the picture: least, greatest; a
# panel of height 1 has the third share.
_LEAST, _MOST, _PANEL = 0.3, 0.62, 0.24
# Shares of the longer side of the view.
_ARROW, _APART, _EVERY = 0.008, 0.045, 0.25
# Maximum numbers of arrows between two marks, and of times.
_ARROWS, _TIMES = 3, 8
# Steps between times, s.
_STEPS = (0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 30, 60, 120, 300, 600, 1200, 1800, 3600, 7200, 10800)
_HALF_DAY = 43200.0


@dataclass(frozen=True)
class PlanView:
    """Extent of a plan with equal scales.

    `low`, `high`, (2,): east and north of its corners.
    """

    low: Array
    high: Array

    @classmethod
    def of(cls, paths: list[Path], most: float = _MOST) -> PlanView:
        """Smallest view of all paths with a panel neither too low nor too high.

        `paths`: east and north of each. `most`: largest height of the panel over its width, for one
        as wide as the picture.
        """
        points = np.hstack([np.vstack(path) for path in paths])
        low, high = points.min(axis=1), points.max(axis=1)
        east, north = high - low
        share = np.clip(north / east if east > 0.0 else np.inf, _LEAST, most)
        width = max(east, north / share)
        half = 0.5 * np.array([width, width * share])
        return cls(0.5 * (low + high) - half, 0.5 * (low + high) + half)

    @property
    def width(self) -> float:
        """Extent from west to east."""
        return float(self.high[0] - self.low[0])

    @property
    def height(self) -> float:
        """Height of the panel, in units of an ordinary panel."""
        return float((self.high[1] - self.low[1]) / self.width / _PANEL)

    @property
    def corners(self) -> Array:
        """South-west and north-east, (2, 2)."""
        return np.vstack([self.low, self.high])


def path_marks(time: Array, paths: list[Path], view: PlanView, colour: str) -> list[Line]:
    """Mark start, end, and positions at round times on the first path, with arrows between them.

    `time`, (n,), s: times of the points of the first path. `paths`: east and north of each; labels
    avoid all paths. `colour`: color of the arrows.
    """
    east, north = paths[0]
    way = _way(east, north)
    ends = [(float(east[k]), float(north[k])) for k in (0, -1)]
    seen: list[tuple[float, float]] = []
    labels, lengths = [], [0.0]
    # Multiples of a round step, at most `_TIMES`.
    start, finish = float(time[0]), float(time[-1])
    least = (finish - start) / _TIMES
    step = next((s for s in _STEPS if s >= least), _HALF_DAY * np.ceil(least / _HALF_DAY))
    for at in step * np.arange(np.ceil(start / step), np.floor(finish / step) + 1.0):
        place = (float(np.interp(at, time, east)), float(np.interp(at, time, north)))
        # Skip positions near the start, the end or another mark, as of a stationary vehicle.
        if all(np.hypot(place[0] - x, place[1] - y) > _APART * view.width for x, y in ends + seen):
            seen.append(place)
            labels.append(f"{at + 0.0:.12g} s")  # without the sign of -0
            lengths.append(float(np.interp(at, time, way)))
    points = np.array(ends + seen)
    # Evenly spaced positions along each path, which labels should avoid.
    along = []
    for path in paths:
        whole = _way(*path)
        along.append(_at(whole, np.linspace(0.0, whole[-1], 150), *path).T)
    places = place_labels(
        points[:, 0],
        points[:, 1],
        ["start", "end", *labels],
        np.vstack([view.corners, *along]),
    )
    # The end mark is smaller, so that both show where a path returns to its start.
    marks = [
        ("start", points[:1], GREEN, "circle", 15.0, ("start",), places[:1]),
        ("end", points[1:2], VERMILLION, "square", 9.0, ("end",), places[1:2]),
        ("time", points[2:], BLACK, "circle", 6.0, tuple(labels), places[2:]),
    ]
    tips = _between(np.array([*lengths, way[-1]]), view.width)
    lines = [_arrows(east, north, tips, _ARROW * view.width, colour)]
    for name, xy, mark, symbol, size, words, where in marks:
        if len(xy):
            named = dots(name, xy[:, 0], xy[:, 1], mark, symbol, size, labels=words, places=where)
            lines.append(replace(named, legend=False))
    return lines


def _between(lengths: Array, width: float) -> Array:
    """Path lengths of the arrows: evenly spaced between marks, more for longer distances."""
    found = []
    for start, end in pairwise(lengths.tolist()):
        if end - start > _APART * width:
            count = int(np.clip(round((end - start) / (_EVERY * width)), 1, _ARROWS))
            found += [start + (end - start) * (k + 0.5) / count for k in range(count)]
    return np.array(found)


def _arrows(east: Array, north: Array, tips: Array, size: float, colour: str) -> Line:
    """Arrowheads at given path lengths as one broken curve, to be drawn to one scale."""
    way = _way(east, north)
    behind, ahead = (
        _at(way, np.clip(tips + side, 0.0, way[-1]), east, north) for side in (-size, size)
    )
    along = ahead - behind
    length = np.hypot(*along)
    # At a reversal of the path the direction is undefined.
    good = length > 0.0
    along, tip = along[:, good] / length[good], _at(way, tips, east, north)[:, good]
    across = np.vstack([-along[1], along[0]])
    left, right = (tip + size * (side * across - along) for side in (0.75, -0.75))
    heads = np.stack([left, tip + size * along, right, right], axis=-1)
    heads[1, :, 3] = np.nan
    return Line("direction", heads[0].ravel(), heads[1].ravel(), colour, width=1.8, legend=False)


def _way(east: Array, north: Array) -> Array:
    return np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(east), np.diff(north)))])


def _at(way: Array, where: Array, east: Array, north: Array) -> Array:
    """East and north at given path lengths, (2, m)."""
    return np.vstack([np.interp(where, way, east), np.interp(where, way, north)])


# Positions of point labels that avoid overlap.


#: Label positions, best first: side of the point (-1 left, 0 above or below, 1 right), and lines
#: of text above the point; from two lines on, a thin line leads to the point.
PLACES: tuple[tuple[int, int], ...] = (
    *((side, rise) for rise in (1, -1) for side in (0, 1, -1)),
    (1, 0),
    (-1, 0),
    *((side, sign * rise) for rise in (2, 3, 4) for sign in (1, -1) for side in (0, 1, -1)),
)
# Size of a character, a line of text and a point, as shares of the axis, for a chart of 900 by
# 320 pixels.
_CHARACTER, _LINE, _POINT = 0.0082, 0.05, 0.02


def place_labels(
    x: ArrayLike, y: ArrayLike, labels: Sequence[str], obstacles: ArrayLike = ()
) -> tuple[tuple[int, int], ...]:
    """Choose a position for each label, the longest label first.

    `x`, `y`, (n,): points on linear axes (logarithms for a logarithmic axis). `obstacles`, (m, 2):
    further points that labels should avoid. Returns: entries of `PLACES`, in the order of the
    labels, with the least overlap with other labels, points and the outside of the axes.
    """
    if not labels:
        return ()
    others = np.asarray(obstacles, dtype=np.float64).reshape(-1, 2)
    points = np.column_stack([np.asarray(x, float), np.asarray(y, float)])
    # As shares of the axes, including their margins.
    everything = np.vstack([points, others])
    low, high = everything.min(axis=0), everything.max(axis=0)
    unit, wide = np.full(everything.shape, 0.5), high > low
    unit[:, wide] = 0.05 + 0.9 * (everything - low)[:, wide] / (high - low)[wide]
    dots = np.hstack([unit - 0.5 * _POINT, unit + 0.5 * _POINT])
    taken: list[Array] = []
    chosen: dict[int, tuple[int, int]] = {}
    for k in sorted(range(len(labels)), key=lambda j: (-len(labels[j]), j)):
        boxes = [_box(unit[k], place, len(labels[k])) for place in PLACES]
        covered = []
        for number, box in enumerate(boxes):
            # Of many points few overlap a box.
            apart = np.minimum(dots[:, 2:], box[2:]) <= np.maximum(dots[:, :2], box[:2])
            touched = np.flatnonzero(~apart.any(axis=1)).tolist()
            whole = float((box[2] - box[0]) * (box[3] - box[1]))
            covered.append(
                4.0 * math.fsum(overlap(box, other) for other in taken)
                + math.fsum(overlap(box, dots[j]) for j in touched if j != k)
                # The part outside of the axes weighs most: it would be cut off.
                + 10.0 * (whole - overlap(box, np.array([0.0, 0.0, 1.0, 1.0])))
                # Prefer a near position if none overlaps.
                + 1e-7 * number
            )
        best = int(np.argmin(np.round(covered, 9)))
        chosen[k] = PLACES[best]
        taken.append(boxes[best])
    return tuple(chosen[k] for k in range(len(labels)))


def _box(point: Array, place: tuple[int, int], characters: int) -> Array:
    """Left, bottom, right, top of a label."""
    side, rise = place
    width = _CHARACTER * characters
    left = point[0] + {-1: -width - 0.5 * _POINT, 0: -0.5 * width, 1: 0.5 * _POINT}[side]
    bottom = point[1] + (rise - 0.5) * _LINE
    return np.array([left, bottom, left + width, bottom + _LINE])


# Area that contains a point with 95 % probability, along its path.


_CORNERS = 28


def ellipse(centre: Array, covariance: Array, corners: int = _CORNERS) -> Array:
    """95 % ellipse of a normal error in a plane.

    `centre`, (2,). `covariance`, (2, 2). Returns: (corners, 2), points on the ellipse; all at the
    center if the error is zero.
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

    `places`, (n, 2). `covariances`, (n, 2, 2). `pieces`: maximum number of areas. Returns: (k, 2),
    convex hulls of consecutive pairs of ellipses, without gaps between them.
    """
    rows = np.unique(np.linspace(0, len(places) - 1, min(pieces + 1, len(places))).astype(int))
    rings = [ellipse(places[k], covariances[k]) for k in rows]
    if len(rings) < 2:
        return rings
    return [hull(np.vstack([a, b])) for a, b in pairwise(rings)]

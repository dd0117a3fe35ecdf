"""Arrows, times, start and end that mark direction and timing of a path on a plan."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from strapdown.evaluation.plane_bound import PLANE_95
from strapdown.report.chart import BLACK, GREEN, VERMILLION, Array, Line
from strapdown.report.svg_drawing import INK, SMALL, Drawing, number

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
class View:
    """Extent of a plan with equal scales.

    Attributes
    ----------
    low, high : ndarray, (2,)
        East and north of its corners.
    """

    low: Array
    high: Array

    @classmethod
    def of(cls, paths: list[Path], most: float = _MOST) -> View:
        """Smallest view of all paths with a panel neither too low nor too high.

        Parameters
        ----------
        paths : list of (ndarray, ndarray)
            East and north of each.
        most : float
            Largest height of the panel over its width, for one as wide as the picture.
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


def path_marks(time: Array, paths: list[Path], view: View, colour: str) -> list[Line]:
    """Mark start, end, and positions at round times on the first path, with arrows between them.

    Parameters
    ----------
    time : ndarray, (n,), s
        Times of the points of the first path.
    paths : list of (ndarray, ndarray)
        East and north of each; labels avoid all paths.
    colour : str
        Color of the arrows.
    """
    east, north = paths[0]
    way = _way(east, north)
    ends = [(float(east[k]), float(north[k])) for k in (0, -1)]
    dots: list[tuple[float, float]] = []
    labels, lengths = [], [0.0]
    for at in _round_times(float(time[0]), float(time[-1])):
        place = (float(np.interp(at, time, east)), float(np.interp(at, time, north)))
        # Skip positions near the start, the end or another mark, as of a stationary vehicle.
        if all(np.hypot(place[0] - x, place[1] - y) > _APART * view.width for x, y in ends + dots):
            dots.append(place)
            labels.append(f"{at:.12g} s")
            lengths.append(float(np.interp(at, time, way)))
    points = np.array(ends + dots)
    places = place_labels(
        points[:, 0],
        points[:, 1],
        ["start", "end", *labels],
        np.vstack([view.corners, *map(_along, paths)]),
    )
    # The end mark is smaller, so that both show where a path returns to its start.
    marks = [
        ("start", points[:1], GREEN, "circle", 15.0, ("start",), places[:1]),
        ("end", points[1:2], VERMILLION, "square", 9.0, ("end",), places[1:2]),
        ("time", points[2:], BLACK, "circle", 6.0, tuple(labels), places[2:]),
    ]
    tips = _between(np.array([*lengths, way[-1]]), view.width)
    return [_arrows(east, north, tips, _ARROW * view.width, colour)] + [
        Line(
            name,
            xy[:, 0],
            xy[:, 1],
            mark,
            points=True,
            symbol=symbol,
            size=size,
            labels=words,
            places=where,
            legend=False,
        )
        for name, xy, mark, symbol, size, words, where in marks
        if len(xy)
    ]


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


def _round_times(first: float, last: float) -> Array:
    """Multiples of a round step between two instants, at most `_TIMES`."""
    least = (last - first) / _TIMES
    step = next((s for s in _STEPS if s >= least), _HALF_DAY * np.ceil(least / _HALF_DAY))
    return step * np.arange(np.ceil(first / step), np.floor(last / step) + 1.0)


def _way(east: Array, north: Array) -> Array:
    return np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(east), np.diff(north)))])


def _at(way: Array, where: Array, east: Array, north: Array) -> Array:
    """East and north at given path lengths, (2, m)."""
    return np.vstack([np.interp(where, way, east), np.interp(where, way, north)])


def _along(path: Path) -> Array:
    """Evenly spaced positions along a path that labels should avoid, (m, 2)."""
    way = _way(*path)
    return _at(way, np.linspace(0.0, way[-1], 150), *path).T


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

    Parameters
    ----------
    x, y : array_like, (n,)
        Points on linear axes (logarithms for a logarithmic axis).
    obstacles : array_like, (m, 2)
        Further points that labels should avoid.

    Returns
    -------
    tuple of (int, int)
        Entries of `PLACES`, in the order of the labels, with the least overlap with other labels,
        points and the outside of the axes.
    """
    if not labels:
        return ()
    others = np.asarray(obstacles, dtype=np.float64).reshape(-1, 2)
    points = np.column_stack([np.asarray(x, float), np.asarray(y, float)])
    unit = _on_axes(np.vstack([points, others]))
    dots = np.hstack([unit - 0.5 * _POINT, unit + 0.5 * _POINT])
    taken: list[Array] = []
    chosen: dict[int, tuple[int, int]] = {}
    for k in sorted(range(len(labels)), key=lambda j: (-len(labels[j]), j)):
        boxes = [_box(unit[k], place, len(labels[k])) for place in PLACES]
        covered = [
            4.0 * sum(_overlap(box, other) for other in taken)
            + sum(_overlap(box, dots[j]) for j in _touched(box, dots) if j != k)
            + _outside(box)
            # Prefer a near position if none overlaps.
            + 1e-7 * number
            for number, box in enumerate(boxes)
        ]
        best = int(np.argmin(np.round(covered, 9)))
        chosen[k] = PLACES[best]
        taken.append(boxes[best])
    return tuple(chosen[k] for k in range(len(labels)))


def _on_axes(points: Array) -> Array:
    """Points as shares of the axes, including their margins."""
    low, high = points.min(axis=0), points.max(axis=0)
    unit = np.full(points.shape, 0.5)
    wide = high > low
    unit[:, wide] = 0.05 + 0.9 * (points - low)[:, wide] / (high - low)[wide]
    return unit


def _touched(box: Array, others: Array) -> list[int]:
    """Indices of boxes, (n, 4), that overlap one box."""
    apart = np.minimum(others[:, 2:], box[2:]) <= np.maximum(others[:, :2], box[:2])
    touched: list[int] = np.flatnonzero(~apart.any(axis=1)).tolist()
    return touched


def _box(point: Array, place: tuple[int, int], characters: int) -> Array:
    """Left, bottom, right, top of a label."""
    side, rise = place
    width = _CHARACTER * characters
    left = point[0] + {-1: -width - 0.5 * _POINT, 0: -0.5 * width, 1: 0.5 * _POINT}[side]
    bottom = point[1] + (rise - 0.5) * _LINE
    return np.array([left, bottom, left + width, bottom + _LINE])


def _overlap(a: Array, b: Array) -> float:
    width = min(a[2], b[2]) - max(a[0], b[0])
    height = min(a[3], b[3]) - max(a[1], b[1])
    return float(max(width, 0.0) * max(height, 0.0))


def _outside(box: Array) -> float:
    """Area outside of the axes, which weighs most because it would be cut off."""
    whole = float((box[2] - box[0]) * (box[3] - box[1]))
    return 10.0 * (whole - _overlap(box, np.array([0.0, 0.0, 1.0, 1.0])))


# Positions of the names of vertical marks above a chart, without overlap.


#: Longest name of a level, in letters, that fits beside the axes; longer ones go on its line.
LONGEST_BESIDE = 18
# Gap between names in one row, in letters.
_NAME_GAP = 1.5


def label_side(share: float, label: str, letter: float) -> str:
    """Return the alignment of a name at its mark that keeps it within the axes.

    Parameters
    ----------
    share : float
        Position of the mark, as a share of the axis from the left.
    letter : float
        Width of a letter, as a share of the axis.

    Returns
    -------
    {'left', 'center', 'right'}
        Part of the name at the mark.
    """
    half = 0.5 * letter * len(label)
    if share < half:
        return "left"
    return "right" if share > 1.0 - half else "center"


def label_rows(shares: Sequence[float], labels: Sequence[str], letter: float) -> tuple[int, ...]:
    """Return the row of each name, from 0 at the axes upward.

    Parameters
    ----------
    shares, labels, letter
        As in `label_side`, for every mark.

    Returns
    -------
    tuple of int
        The lowest row without overlap with the names to the left.
    """
    ends: list[float] = []
    rows = [0] * len(shares)
    for k in sorted(range(len(shares)), key=lambda j: (shares[j], j)):
        wide = letter * len(labels[k])
        part = {"left": 0.0, "center": 0.5, "right": 1.0}[label_side(shares[k], labels[k], letter)]
        start = shares[k] - part * wide
        free = (row for row, end in enumerate(ends) if end + _NAME_GAP * letter <= start)
        row = next(free, len(ends))
        if row == len(ends):
            ends.append(0.0)
        ends[row] = start + wide
        rows[k] = row
    return tuple(rows)


# A level plane in a picture: equal scale on both axes, ticks with units, a scale bar.


_SOFT, _GRID = "#4a525c", "#e6e9ed"
# Minimum pixels between neighboring ticks, and of the scale bar.
_TICK, _BAR = 40.0, 60.0
# Height below the points for the scale bar.
_FOOT = 18.0


def nice_step(least: float) -> float:
    """Smallest of 1, 2, 5 times a power of ten that is not below a number."""
    if not (math.isfinite(least) and least > 0.0):
        return 1.0
    power = 10.0 ** math.floor(math.log10(least))
    for factor in (1.0, 2.0, 5.0, 10.0):
        if factor * power >= least * (1.0 - 1e-9):
            return factor * power
    return 10.0 * power


def tick_words(value: float, step: float) -> str:
    """Format a tick with as many digits as its step needs."""
    digits = max(0, -math.floor(math.log10(step) + 1e-9))
    text = f"{value:.{digits}f}"
    return (text if float(text) else text.removeprefix("-")).replace("-", "−")


@dataclass(frozen=True)
class PlanView:
    """Mapping of a level plane to a picture.

    Attributes
    ----------
    left, top, width, height : float
        Of the frame, in pixels.
    middle : (float, float), m
        First and second coordinate (north and east, or forward and right) of the frame's middle.
    scale : float
        Pixels per meter.
    names : (str, str)
        Of the two coordinates. North is drawn up and east to the right; forward to the right and
        right downward, which is the same plane rotated by a quarter turn, seen from above.
    """

    left: float
    top: float
    width: float
    height: float
    middle: tuple[float, float]
    scale: float
    names: tuple[str, str]

    @property
    def north_up(self) -> bool:
        """Whether the first coordinate points up the page."""
        return self.names[0] == "north"

    @classmethod
    def of(
        cls,
        points: Array,
        names: tuple[str, str],
        at: tuple[float, float],
        width: float,
        heights: tuple[float, float],
        margin: float = 14.0,
    ) -> PlanView:
        """The largest view that contains all points.

        Parameters
        ----------
        points : ndarray, (n, 2), m
        names : (str, str)
        at : (float, float)
            Upper left corner of the frame.
        heights : (float, float)
            Minimum and maximum height of the frame.
        margin : float
            Pixels around the points.
        """
        finite = points[np.isfinite(points).all(axis=1)]
        low, high = (finite.min(axis=0), finite.max(axis=0)) if len(finite) else (-np.ones(2),) * 2
        across, up = (high - low)[::-1] if names[0] == "north" else (high - low)
        # Points without extent are shown in a square of one centimeter.
        across, up = max(float(across), 0.01), max(float(up), 0.01)
        edges = 2.0 * margin + _FOOT
        scale = min((width - 2.0 * margin) / across, (heights[1] - edges) / up)
        height = min(max(up * scale + edges, heights[0]), heights[1])
        a, b = (0.5 * (low + high)).tolist()
        if names[0] == "north":
            a -= 0.5 * _FOOT / scale
        else:
            b += 0.5 * _FOOT / scale
        return cls(at[0], at[1], width, height, (a, b), scale, names)

    def pixels(self, points: ArrayLike) -> Array:
        """Pixel positions, (n, 2), of points, (n, 2), m."""
        a, b = (np.asarray(points, dtype=np.float64).reshape(-1, 2) - self.middle).T
        x, y = (b, -a) if self.north_up else (a, b)
        centre = self.left + 0.5 * self.width, self.top + 0.5 * self.height
        return np.column_stack([centre[0] + self.scale * x, centre[1] + self.scale * y])

    @property
    def corners(self) -> Array:
        """Minimum and maximum coordinates within the frame, (2, 2), m."""
        half = 0.5 * np.array([self.width, self.height]) / self.scale
        half = half[::-1] if self.north_up else half
        return np.vstack([np.array(self.middle) - half, np.array(self.middle) + half])

    def draw_grid(self, out: Drawing) -> None:
        """Draw the frame, its ticks and axis names."""
        step = nice_step(_TICK / self.scale)
        low, high = self.corners
        right, bottom = self.left + self.width, self.top + self.height
        box = [(self.left, self.top), (right, self.top), (right, bottom), (self.left, bottom)]
        for axis in (0, 1):
            across = (axis == 1) == self.north_up
            first = math.ceil(low[axis] / step - 1e-9)
            for k in range(first, math.floor(high[axis] / step + 1e-9) + 1):
                point = np.array(self.middle)
                point[axis] = k * step
                x, y = self.pixels(point)[0].tolist()
                words = tick_words(k * step, step)
                if across:
                    out.line((x, self.top), (x, bottom), _GRID, 0.8)
                    if self.left + 8.0 < x < right - 8.0:
                        out.text((x, bottom + 9.0), words, SMALL, _SOFT, anchor="middle")
                else:
                    out.line((self.left, y), (right, y), _GRID, 0.8)
                    if self.top + 5.0 < y < bottom - 5.0:
                        out.text((self.left - 4.0, y), words, SMALL, _SOFT, anchor="end")
            name = f"{self.names[axis]}, m"
            if across:
                at = (0.5 * (self.left + right), bottom + 23.0)
                out.text(at, f"{name} →", 10.5, INK, anchor="middle")
            else:
                at = (self.left - 40.0, 0.5 * (self.top + bottom))
                arrow = "→" if self.north_up else "←"
                told = f"{name} {arrow}" if self.north_up else f"{arrow} {name}"
                out.text(at, told, 10.5, INK, anchor="middle", turn=-90.0)
        out.shape(box, "#c3cad2", 1.0)

    def draw_bar(self, out: Drawing) -> None:
        """Draw a scale bar of round length."""
        length = nice_step(_BAR / self.scale)
        x, y = self.left + 10.0, self.top + self.height - 10.0
        end = x + length * self.scale
        out.line((x, y), (end, y), INK, 2.0)
        for at in (x, end):
            out.line((at, y - 3.5), (at, y + 3.5), INK, 1.4)
        words = _length_words(length)
        out.text((0.5 * (x + end), y - 9.0), words, SMALL, INK, anchor="middle", halo=True)


def _length_words(length: float) -> str:
    if length < 0.01:
        return f"{number(1e3 * length)} mm"
    return f"{number(100 * length)} cm" if length < 1.0 else f"{number(length)} m"


# Area that contains a point with 95 % probability, along its path.


_CORNERS = 28


def ellipse(centre: Array, covariance: Array, corners: int = _CORNERS) -> Array:
    """95 % ellipse of a normal error in a plane.

    Parameters
    ----------
    centre : ndarray, (2,)
    covariance : ndarray, (2, 2)

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

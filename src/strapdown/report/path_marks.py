"""What tells on a plan which way a path goes, and when: arrows, times, start and end."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from strapdown.report.chart import BLACK, GREEN, VERMILLION, Array, Line
from strapdown.report.label_places import place_labels

__all__ = ["View", "path_marks"]

Path = tuple[Array, Array]

# Height of a plan as a share of its width, for one as wide as the picture; a panel of height 1
# has the share 0.24.
_LEAST, _MOST, _PANEL = 0.3, 0.62, 0.24
# Of the longer side of the view.
_ARROW, _APART, _EVERY = 0.008, 0.045, 0.25
# At most: arrows between two marks, and times.
_ARROWS, _TIMES = 3, 8
# s
_STEPS = (0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 30, 60, 120, 300, 600, 1200, 1800, 3600, 7200, 10800)
_HALF_DAY = 43200.0


@dataclass(frozen=True)
class View:
    """What a plan of equal scales shows.

    Attributes
    ----------
    low, high : ndarray, (2,)
        East and north of its corners.
    """

    low: Array
    high: Array

    @classmethod
    def of(cls, paths: list[Path], most: float = _MOST) -> View:
        """The least view of all paths in which the panel is neither too low nor too high.

        Parameters
        ----------
        paths : list of (ndarray, ndarray)
            East and north of each.
        most : float
            Height of the panel over its width, for one as wide as the picture.
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
        """From west to east."""
        return float(self.high[0] - self.low[0])

    @property
    def height(self) -> float:
        """Of the panel, in ordinary ones."""
        return float((self.high[1] - self.low[1]) / self.width / _PANEL)

    @property
    def corners(self) -> Array:
        """South-west and north-east, (2, 2)."""
        return np.vstack([self.low, self.high])


def path_marks(time: Array, paths: list[Path], view: View, colour: str) -> list[Line]:
    """Start, end, and places at round times on the first path, labelled; between them arrows.

    Parameters
    ----------
    time : ndarray, (n,), s
        Of the points of the first path.
    paths : list of (ndarray, ndarray)
        East and north of each; labels keep off all.
    view : View
    colour : str
        Of the arrows.

    Returns
    -------
    list of Line
    """
    east, north = paths[0]
    way = _way(east, north)
    ends = [(float(east[k]), float(north[k])) for k in (0, -1)]
    dots: list[tuple[float, float]] = []
    labels, lengths = [], [0.0]
    for at in _round_times(float(time[0]), float(time[-1])):
        place = (float(np.interp(at, time, east)), float(np.interp(at, time, north)))
        # A vehicle that stands has one dot, and none beside its start and its end.
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
    # The end is the smaller, so that both show where a path comes back.
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
    """Lengths of the way at which arrows stand: even between two marks, and more where far."""
    found = []
    for start, end in pairwise(lengths.tolist()):
        if end - start > _APART * width:
            count = int(np.clip(round((end - start) / (_EVERY * width)), 1, _ARROWS))
            found += [start + (end - start) * (k + 0.5) / count for k in range(count)]
    return np.array(found)


def _arrows(east: Array, north: Array, tips: Array, size: float, colour: str) -> Line:
    """Arrowheads at lengths of the way as one broken curve, to be drawn to one scale."""
    way = _way(east, north)
    behind, ahead = (
        _at(way, np.clip(tips + side, 0.0, way[-1]), east, north) for side in (-size, size)
    )
    along = ahead - behind
    length = np.hypot(*along)
    # Where the path turns back at this very place, it has no direction.
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
    """East and north at lengths of the way, (2, m)."""
    return np.vstack([np.interp(where, way, east), np.interp(where, way, north)])


def _along(path: Path) -> Array:
    """Places at even distances along a path, which a label should not cover, (m, 2)."""
    way = _way(*path)
    return _at(way, np.linspace(0.0, way[-1], 150), *path).T

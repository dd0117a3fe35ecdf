"""A level plane in a picture: equal scale on both axes, ticks with units, a scale bar."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from strapdown.evaluation.plane_bound import PLANE_95
from strapdown.report.svg_drawing import INK, SMALL, Drawing, number

Array = NDArray[np.float64]

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
        width : float
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

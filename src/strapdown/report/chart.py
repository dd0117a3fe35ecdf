"""A chart as plain data, drawn alike in a page and in a picture."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

# Okabe and Ito's colours, which the colour-blind can tell apart.
ORANGE, SKY, GREEN, BLUE = "#E69F00", "#56B4E9", "#009E73", "#0072B2"
VERMILLION, PURPLE, BLACK, GREY = "#D55E00", "#CC79A7", "#1b1f24", "#8a939e"
AXIS_COLOURS = (VERMILLION, GREEN, BLUE)
SERIES_COLOURS = (ORANGE, VERMILLION, GREEN, BLUE, PURPLE, SKY, "#7f6000", GREY)
DASHES = ("solid", "solid", "solid", "dash", "dot", "dashdot", "dash", "dot")

# Points that a screen can show; more only makes the file larger.
BUCKETS = 1500


@dataclass(frozen=True)
class Line:
    """One curve, thinned by `curve`, or points alone. `dash` is solid, dash, dot or dashdot."""

    name: str
    x: Array
    y: Array
    colour: str
    dash: str = "solid"
    width: float = 1.4
    points: bool = False


@dataclass(frozen=True)
class Mark:
    """An instant that matters, as a vertical line with a label."""

    x: float
    label: str


@dataclass(frozen=True)
class Band:
    """A stretch of time, shaded."""

    start: float
    end: float
    label: str


@dataclass(frozen=True)
class Panel:
    """One set of axes."""

    y_label: str
    lines: tuple[Line, ...]
    log: bool = False


@dataclass(frozen=True)
class Chart:
    """Panels above each other that share the horizontal axis.

    Attributes
    ----------
    slug : str
        Name of the file.
    title, caption : str
    x_label : str
        With its unit.
    panels : tuple of Panel
    marks : tuple of Mark
    bands : tuple of Band
    log_x : bool
        Logarithmic horizontal axis.
    """

    slug: str
    title: str
    caption: str
    x_label: str
    panels: tuple[Panel, ...]
    marks: tuple[Mark, ...] = field(default=())
    bands: tuple[Band, ...] = field(default=())
    log_x: bool = False


def curve(
    name: str, x: ArrayLike, y: ArrayLike, colour: str, dash: str = "solid", width: float = 1.4
) -> Line:
    """Make a line of as many points as a screen can show."""
    return Line(name, *thin(x, y), colour, dash, width)


def thin(x: ArrayLike, y: ArrayLike) -> tuple[Array, Array]:
    """Thin a curve to what a screen shows, keeping every peak.

    Parameters
    ----------
    x, y : array_like, (n,)
        NaN in `y` breaks the curve.

    Returns
    -------
    x, y : ndarray
        The least and the greatest of each of 1500 equal runs of samples, in their order.
    """
    xs, ys = np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64)
    if xs.size <= 2 * BUCKETS:
        return xs, ys
    width = -(-xs.size // BUCKETS)
    first = np.arange(0, xs.size, width)
    # The last run is filled up with its own last value, which adds no peak and no break.
    body = np.pad(ys, (0, first.size * width - xs.size), mode="edge").reshape(-1, width)
    gap = np.isnan(body)
    keep = [
        first + np.argmin(np.where(gap, np.inf, body), axis=1),
        first + np.argmax(np.where(gap, -np.inf, body), axis=1),
        (first + np.argmax(gap, axis=1))[gap.any(axis=1)],
        np.array([xs.size - 1]),
    ]
    chosen = np.unique(np.concatenate([[0], *keep]))
    return xs[chosen], ys[chosen]


def break_jumps(angle_deg: ArrayLike) -> Array:
    """Copy of a wrapped angle with NaN where it jumps by more than half a turn."""
    out = np.array(angle_deg, dtype=np.float64)
    jumps = np.flatnonzero(np.abs(np.diff(out)) > 180.0)
    out[jumps + 1] = np.nan
    return out

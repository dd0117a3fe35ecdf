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
SERIES_COLOURS = (ORANGE, VERMILLION, GREEN, BLUE, PURPLE, SKY, "#7f6000", GREY, "#882255")
# Who sees no colour tells lines by these. Nine of each: as many as there are algorithms in a
# usual comparison.
DASHES = ("solid", "solid", "solid", "dash", "dot", "dashdot", "dash", "dot", "longdash")
SYMBOLS = (
    "circle",
    "square",
    "diamond",
    "triangle-up",
    "triangle-down",
    "cross",
    "x",
    "star",
    "pentagon",
)

# Points that a screen can show; more only makes the file larger.
BUCKETS = 1500


@dataclass(frozen=True)
class Line:
    """One curve, thinned by `curve`, or points, or both.

    Attributes
    ----------
    name : str
        For the legend; lines of one name are one entry.
    x, y : ndarray, (n,)
        NaN in `y` breaks the curve.
    colour : str
    dash : {'solid', 'dash', 'dot', 'dashdot', 'longdash'}
    width : float
    points : bool
        Points alone.
    symbol : str
        One of `SYMBOLS`.
    dots : bool
        Points on the curve.
    hollow : bool
        Points are drawn as outlines.
    size : float
        Of a point, in pixels; 0 for a label alone.
    labels : tuple of str
        One a point, or none.
    places : tuple of (int, int)
        Where each label stands (`label_places.PLACES`); above its point if not given.
    low, high : ndarray, (n,), or None
        Ends of a horizontal bar through each point.
    legend : bool
    inside : float
        Opacity of the inside of a closed outline; NaN parts one outline from the next.
    """

    name: str
    x: Array
    y: Array
    colour: str
    dash: str = "solid"
    width: float = 1.4
    points: bool = False
    symbol: str = "diamond"
    dots: bool = False
    hollow: bool = False
    size: float = 9.0
    labels: tuple[str, ...] = ()
    places: tuple[tuple[int, int], ...] = ()
    low: Array | None = None
    high: Array | None = None
    legend: bool = True
    inside: float = 0.0


@dataclass(frozen=True)
class Fill:
    """A band between two curves, below every line: a bound, or what is assumed.

    Attributes
    ----------
    name : str
        For the legend; a line of the same name is the entry of both.
    x, low, high : ndarray, (n,)
        NaN in `low` or `high` breaks the band.
    colour : str
    opacity : float
    legend : bool
    """

    name: str
    x: Array
    low: Array
    high: Array
    colour: str
    opacity: float = 0.18
    legend: bool = True


@dataclass(frozen=True)
class Bars:
    """Bars: across in a panel of categories, else upright.

    Attributes
    ----------
    name : str
        For the legend; bars of one name are one entry.
    at : ndarray, (n,)
        Middle of each: the number of a category, or a value of the horizontal axis.
    values : ndarray, (n,)
        Where each ends.
    colour : str
    start : ndarray, (n,), or None
        Where each begins; zero if not given.
    width : float
        In the unit of `at`.
    pattern : {'', '/', 'x', '-', '|', '+', '.'}
        For who sees no colour.
    labels : tuple of str
        One a bar, at its end, or none.
    legend : bool
    """

    name: str
    at: Array
    values: Array
    colour: str
    start: Array | None = None
    width: float = 0.6
    pattern: str = ""
    labels: tuple[str, ...] = ()
    legend: bool = True


@dataclass(frozen=True)
class Mark:
    """A value of the horizontal axis that matters, as a vertical line with a label."""

    x: float
    label: str


@dataclass(frozen=True)
class Level:
    """A value of the vertical axis that matters, as a horizontal line with a label."""

    y: float
    label: str


@dataclass(frozen=True)
class Band:
    """A stretch of time, shaded."""

    start: float
    end: float
    label: str


@dataclass(frozen=True)
class Panel:
    """One set of axes.

    Attributes
    ----------
    y_label : str
        With its unit.
    lines : tuple of Line
    log : bool
        Whether the vertical axis is logarithmic.
    title : str
    levels : tuple of Level
    categories : tuple of str
        Names on the vertical axis at 0, 1, …, from the top. Where other panels of the chart have
        none, this one is as high as `height` says.
    x_label : str
        With its unit, of a plane: both axes have one scale, and the horizontal one is the panel's
        own, without marks and bands. Empty where the panel shares the chart's horizontal axis.
    height : float
        In ordinary panels.
    steady : float
        Values that span less are drawn as a constant, on an axis that spans one unit: rounding
        should not look like a signal.
    fills : tuple of Fill
    bars : tuple of Bars
    step : float
        Between ticks of the vertical axis, such as 30 degrees; 0 leaves them to the drawing.
    x_step : float
        The same of the horizontal axis, where it is the panel's own, or in the last panel.
    """

    y_label: str
    lines: tuple[Line, ...]
    log: bool = False
    title: str = ""
    levels: tuple[Level, ...] = ()
    categories: tuple[str, ...] = ()
    x_label: str = ""
    height: float = 1.0
    steady: float = 0.0
    fills: tuple[Fill, ...] = ()
    bars: tuple[Bars, ...] = ()
    step: float = 0.0
    x_step: float = 0.0


@dataclass(frozen=True)
class Chart:
    """Panels above each other that share the horizontal axis, or beside each other.

    Planes come first, above what shares the axis.

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
        Whether the horizontal axis is logarithmic.
    beside : bool
        Whether the panels stand beside each other, each with its own horizontal axis.
    """

    slug: str
    title: str
    caption: str
    x_label: str
    panels: tuple[Panel, ...]
    marks: tuple[Mark, ...] = field(default=())
    bands: tuple[Band, ...] = field(default=())
    log_x: bool = False
    beside: bool = False


def steady_range(panel: Panel) -> tuple[float, float] | None:
    """Ends of the vertical axis where the values are steady; else None."""
    if not panel.steady:
        return None
    ends = [v for fill in panel.fills for v in (fill.low, fill.high)]
    found = np.concatenate([*(line.y for line in panel.lines), *ends])
    found = found[np.isfinite(found)]
    if not found.size or np.ptp(found) >= panel.steady:
        return None
    middle = 0.5 * float(found.min() + found.max())
    return middle - 0.5, middle + 0.5


def strip_range(chart: Chart) -> tuple[float, float] | None:
    """Ends of the horizontal axis where a strip of categories stands above other panels."""
    strips = [p for p in chart.panels if p.categories]
    if not strips or len(strips) == len(chart.panels):
        return None
    drawn = [fill.x for p in strips for fill in p.fills]
    drawn += [line.x for p in strips for line in p.lines]
    found = np.concatenate(drawn or [np.empty(0)])
    found = found[np.isfinite(found)]
    if not found.size or not np.ptp(found):
        return None
    return float(found.min()), float(found.max())


def runs(*columns: Array) -> list[slice]:
    """Stretches in which all columns are finite, which is how NaN breaks a curve."""
    whole = np.isfinite(np.vstack(columns)).all(axis=0)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], whole, [False]]).astype(np.int8)))
    return [slice(int(a), int(b)) for a, b in edges.reshape(-1, 2)]


def look(k: int) -> dict[str, str]:
    """Colour, dash and symbol of the k-th series; the same in every chart of a page."""
    return {
        "colour": SERIES_COLOURS[k % len(SERIES_COLOURS)],
        "dash": DASHES[k % len(DASHES)],
        "symbol": SYMBOLS[k % len(SYMBOLS)],
    }


def short_span(values: ArrayLike, most: float = 30.0) -> bool:
    """Tell whether positive numbers span so little that powers of ten would not label them."""
    v = np.asarray(values, dtype=np.float64)
    v = v[np.isfinite(v) & (v > 0.0)]
    return not v.size or float(v.max() / v.min()) < most


def curve(
    name: str,
    x: ArrayLike,
    y: ArrayLike,
    colour: str,
    dash: str = "solid",
    width: float = 1.4,
    buckets: int = BUCKETS,
) -> Line:
    """Make a line of as many points as a screen can show."""
    return Line(name, *thin(x, y, buckets), colour, dash, width)


def thin(x: ArrayLike, y: ArrayLike, buckets: int = BUCKETS) -> tuple[Array, Array]:
    """Thin a curve to what a screen shows, keeping every peak.

    Parameters
    ----------
    x, y : array_like, (n,)
        NaN in `y` breaks the curve.
    buckets : int

    Returns
    -------
    x, y : ndarray
        The least and the greatest of each of so many equal runs of samples, in their order.
    """
    xs, ys = np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64)
    if xs.size <= 2 * buckets:
        return xs, ys
    width = -(-xs.size // buckets)
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

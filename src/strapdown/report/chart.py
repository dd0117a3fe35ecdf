"""A chart as plain data, drawn alike on a page and in a picture."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from strapdown.constants import Array
from strapdown.dsp.samples import true_runs
from strapdown.tables.on_disk import let_go_of_all

# Colors of Okabe and Ito, distinguishable by color-blind readers.
ORANGE, SKY, GREEN, BLUE = "#E69F00", "#56B4E9", "#009E73", "#0072B2"
VERMILLION, PURPLE, BLACK, GREY = "#D55E00", "#CC79A7", "#1b1f24", "#8a939e"
AXIS_COLOURS = (VERMILLION, GREEN, BLUE)
SERIES_COLOURS = (ORANGE, VERMILLION, GREEN, BLUE, PURPLE, SKY, "#7f6000", GREY, "#882255")
# Dashes and symbols distinguish lines without color. Nine of each: the number of algorithms in
# a usual comparison.
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

# Points that a screen can resolve; more only enlarge the file.
BUCKETS = 1500
#: For a curve over time: one point per two pixels of a page.
BUCKETS_OVER_TIME = 350


@dataclass(frozen=True)
class Line:
    """A curve, thinned by `curve`, or points, or both.

    Attributes
    ----------
    name : str
        Legend entry; lines of one name share an entry.
    x, y : ndarray, (n,)
        NaN in `y` breaks the curve.
    dash : {'solid', 'dash', 'dot', 'dashdot', 'longdash'}
    points : bool
        Points alone, without a curve.
    symbol : str
        One of `SYMBOLS`.
    dots : bool
        Points on the curve.
    hollow : bool
        Whether points are drawn as outlines.
    size : float
        Of a point, in pixels; 0 for a label alone.
    labels : tuple of str
        One per point, or none.
    places : tuple of (int, int)
        Position of each label (`plan.PLACES`); by default above its point.
    low, high : ndarray, (n,), or None
        Ends of a horizontal bar through each point.
    inside : float
        Fill opacity of a closed outline; NaN separates outlines.
    stamps : ndarray, (n,), or None
        In a plane: time of each point, on the axis that the chart's `x_label` names. The page shows
        an instant in every chart over that axis at once.
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
    stamps: Array | None = None


@dataclass(frozen=True)
class Fill:
    """A band between two curves, below every line: a bound or an assumption.

    `name`: legend entry; a line of the same name shares it. `x`, `low`, `high`, (n,): NaN in `low`
    or `high` breaks the band.
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
    """Bars: horizontal in a panel of categories, else upright.

    `name`: legend entry; bars of one name share an entry. `at`, (n,): middle of each bar: the
    number of a category, or a value of the horizontal axis. `values`, (n,): end of each bar.
    `start`, (n,), or None: start of each bar; zero by default. `width`: in the unit of `at`.
    `pattern`, {'', '/', 'x', '-', '|', '+', '.'}: distinguishes bars without color. `labels`: one
    per bar, at its end, or none.
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
    """A labeled vertical line at a value of the horizontal axis."""

    x: float
    label: str


@dataclass(frozen=True)
class Level:
    """A labeled horizontal line at a value of the vertical axis."""

    y: float
    label: str


@dataclass(frozen=True)
class Band:
    """A shaded stretch of time."""

    start: float
    end: float
    label: str


@dataclass(frozen=True)
class Picture:
    """A picture in a plane: a square from one corner along two sides.

    `media`, {'png', 'jpeg', 'webp'}. `corner`, `across`, `down`, (2,): upper left corner, and the
    upper and the left side from it, in the unit of the axes.
    """

    data: bytes
    media: str
    corner: Array
    across: Array
    down: Array


@dataclass(frozen=True)
class Backdrop:
    """Pictures below everything else of a plane, and a text on them: whose they are."""

    pictures: tuple[Picture, ...]
    text: str


@dataclass(frozen=True)
class Panel:
    """One set of axes.

    Attributes
    ----------
    y_label : str
        With its unit.
    log : bool
        Whether the vertical axis is logarithmic.
    categories : tuple of str
        Names on the vertical axis at 0, 1, …, from the top. Where other panels of the chart have
        none, this panel has the height `height`.
    x_label : str
        With its unit, for a plane: both axes have one scale, and the horizontal axis is the panel's
        own, without marks and bands. Empty where the panel shares the chart's horizontal axis.
    height : float
        In units of an ordinary panel.
    steady : float
        Values that span less are drawn as a constant, on an axis that spans one unit, so that
        rounding does not look like a signal.
    step : float
        Between ticks of the vertical axis, such as 30 degrees; 0 for automatic ticks.
    x_step : float
        The same for the horizontal axis, if it is the panel's own or in the last panel.
    backdrop : Backdrop or None
        Of a plane.
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
    backdrop: Backdrop | None = None


@dataclass(frozen=True)
class Chart:
    """Panels above each other that share the horizontal axis, or side by side.

    Planes come first, above the panels that share the axis.

    `slug`: file name. `x_label`: with its unit; in a chart of planes alone the axis of their
    `Line.stamps`. `log_x`: whether the horizontal axis is logarithmic. `beside`: whether the panels
    are side by side, each with its own horizontal axis.
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
    """Ends of the vertical axis if the values are steady; else None."""
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
    """Ends of the horizontal axis if a strip of categories is above other panels."""
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
    """Stretches in which all columns are finite; NaN breaks a curve."""
    return true_runs(np.asarray(np.isfinite(np.vstack(columns)).all(axis=0)))


def look(k: int) -> dict[str, str]:
    """Color, dash and symbol of the k-th series; the same in every chart of a page."""
    return {
        "colour": SERIES_COLOURS[k % len(SERIES_COLOURS)],
        "dash": DASHES[k % len(DASHES)],
        "symbol": SYMBOLS[k % len(SYMBOLS)],
    }


def curve(
    name: str,
    x: ArrayLike,
    y: ArrayLike,
    colour: str,
    dash: str = "solid",
    width: float = 1.4,
    buckets: int = BUCKETS,
) -> Line:
    """Make a line thinned to the resolution of a screen, keeping every peak.

    `x`, `y`, (n,): NaN in `y` breaks the curve. `buckets`: equal runs of samples, of each of which
    the minimum and maximum are kept.
    """
    xs, ys = np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64)
    rows = kept_rows((ys,), buckets)
    return Line(name, xs[rows], ys[rows], colour, dash, width)


def dots(
    name: str,
    x: ArrayLike,
    y: ArrayLike,
    colour: str,
    symbol: str = "diamond",
    size: float = 9.0,
    **more: Any,
) -> Line:
    """Make points without a curve; `more`: further fields of a `Line`."""
    xs, ys = np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64)
    return Line(name, xs, ys, colour, points=True, symbol=symbol, size=size, **more)


def break_jumps(angle_deg: ArrayLike) -> Array:
    """Copy of a wrapped angle with NaN where it jumps by more than half a turn."""
    out = np.array(angle_deg, dtype=np.float64)
    jumps = np.flatnonzero(np.abs(np.diff(out)) > 180.0)
    out[jumps + 1] = np.nan
    return out


def kept_rows(columns: tuple[Array, ...], buckets: int = BUCKETS_OVER_TIME) -> NDArray[np.intp]:
    """Rows of the minimum and maximum of each column in each of equal runs.

    `columns`, (n,): NaN is skipped, except the first of each run of samples, which breaks a curve.
    Returns: in order, including both ends; all rows if there are few.
    """
    n = columns[0].size
    if n <= 2 * buckets:
        return np.arange(n)
    width = -(-n // buckets)
    first = np.arange(0, n, width)
    keep = [np.array([0, n - 1])]
    for column in columns:
        # The last run is padded with its own last value, which adds no peak and no break.
        body = np.pad(column, (0, first.size * width - n), mode="edge").reshape(-1, width)
        gap = np.isnan(body)
        keep += [
            first + np.argmin(np.where(gap, np.inf, body), axis=1),
            first + np.argmax(np.where(gap, -np.inf, body), axis=1),
            (first + np.argmax(gap, axis=1))[gap.any(axis=1)],
        ]
    # A chart that is drawn has no use of the tables that it is drawn from.
    let_go_of_all()
    rows = np.unique(np.concatenate(keep))
    return rows[rows < n]


def thin_fill(
    name: str,
    x: Array,
    low: Array,
    high: Array,
    colour: str,
    *,
    opacity: float = 0.18,
    buckets: int = BUCKETS_OVER_TIME // 2,
) -> Fill:
    """Make a band of few points that keeps the lowest and highest values."""
    rows = kept_rows((low, high), buckets)
    return Fill(name, x[rows], low[rows], high[rows], colour, opacity)


def broken(time: Array, *columns: Array, longest: float = 5.0) -> tuple[Array, ...]:
    """Insert a row of NaN in each gap, so that no curve bridges it.

    `time`, (n,), s. `*columns`, (n,). `longest`: longest step without a gap, in usual steps.
    Returns time and the columns.
    """
    if time.size < 3:
        return (time, *columns)
    steps = np.diff(time)
    positive = steps[steps > 0.0]
    usual = float(np.median(positive)) if positive.size else 1.0
    at = np.flatnonzero(steps > longest * usual) + 1
    filled = [np.insert(column, at, np.nan) for column in columns]
    return (np.insert(time, at, 0.5 * (time[at - 1] + time[at])), *filled)

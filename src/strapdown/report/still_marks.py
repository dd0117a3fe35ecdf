"""Points, samples of the legend and patterns of a still."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from strapdown.report.chart import Bars, Chart, Fill, Line
from strapdown.report.svg_drawing import Box, Drawing, text_width

__all__ = ["draw_pattern", "draw_points", "entries", "legend_height", "write_legend"]

Array = NDArray[np.float64]

_SIZE = 10.0  # pixels, of letters
_ROW, _SAMPLE, _GAP = 15.0, 24.0, 16.0
_POINT, _RIM = 0.4, 0.5  # radius of a point: over its size, and more in pixels
_HATCH = 6.0  # pixels between the lines of a pattern


def _star(points: int, inner: float, turn: float = 0.0) -> Array:
    angle = np.arange(2 * points) * math.pi / points + math.radians(turn)
    radius = np.where(np.arange(2 * points) % 2, inner, 1.0)
    return np.column_stack([radius * np.sin(angle), -radius * np.cos(angle)])


def _plus() -> Array:
    a = 1.0 / 3.0
    corners = [(-a, -1), (a, -1), (a, -a), (1, -a), (1, a), (a, a), (a, 1), (-a, 1), (-a, a)]
    return np.array([*corners, (-1, a), (-1, -a), (-a, -a)], dtype=np.float64)


def _turned(points: Array) -> Array:
    c = math.sqrt(0.5)
    return np.asarray(points @ np.array([[c, c], [-c, c]]))


_OUTLINES = {
    "square": np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]),
    "diamond": 1.4 * np.array([[0.0, -1.0], [1.0, 0.0], [0.0, 1.0], [-1.0, 0.0]]),
    "triangle-up": np.array([[0.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]),
    "triangle-down": np.array([[0.0, 1.0], [1.0, -1.0], [-1.0, -1.0]]),
    "cross": _plus(),
    "x": _turned(_plus()),
    "star": 1.1 * _star(5, 0.42),
    "pentagon": _star(5, math.cos(math.pi / 5.0)),
    "circle": np.empty((0, 2)),
}


def draw_points(drawing: Drawing, line: Line, at: Array) -> None:
    """Draw the points of a line at places in the picture, (n, 2)."""
    drawing.points(
        at[np.isfinite(at).all(axis=1)],
        _OUTLINES[line.symbol],
        _POINT * line.size + _RIM if line.size else 0.0,
        line.colour,
        hollow=line.hollow,
    )


def draw_pattern(drawing: Drawing, pattern: str, box: Box) -> None:
    """Draw the pattern of a bar in white, within its box."""
    left, top, right, bottom = box
    if right - left < 0.5 or bottom - top < 0.5:
        return
    width, height = right - left, bottom - top
    with drawing.within(box):
        if pattern == ".":
            columns = np.arange(left + 0.5 * _HATCH, right, _HATCH)
            rows = np.arange(top + 0.5 * _HATCH, bottom, _HATCH)
            at = np.array(np.meshgrid(columns, rows)).reshape(2, -1).T
            drawing.points(at, _OUTLINES["circle"], 1.2, "#ffffff")
        for sign in (1.0, -1.0) if pattern == "x" else (1.0,) if pattern == "/" else ():
            for x in np.arange(left - height, right + height, 1.4 * _HATCH).tolist():
                drawing.line((x, bottom), (x + sign * height, top), "#ffffff")
        if pattern in ("-", "+"):
            for y in np.arange(top + 0.5 * _HATCH, bottom, _HATCH).tolist():
                drawing.line((left, y), (left + width, y), "#ffffff")
        if pattern in ("|", "+"):
            for x in np.arange(left + 0.5 * _HATCH, right, _HATCH).tolist():
                drawing.line((x, top), (x, top + height), "#ffffff")


@dataclass(frozen=True)
class Entry:
    """A name of the legend and what it is shown by."""

    name: str
    shown: Line | Fill | Bars


def entries(chart: Chart) -> list[Entry]:
    """Return the entries of a chart's legend, each name once."""
    found: dict[str, Line | Fill | Bars] = {}
    for panel in chart.panels:
        lines = {line.name for line in panel.lines if line.legend}
        # A line of a band's name is the entry of both.
        fills = [fill for fill in panel.fills if fill.name not in lines]
        shown: list[Line | Fill | Bars] = [*fills, *panel.lines, *panel.bars]
        for one in shown:
            if one.legend and one.name:
                found.setdefault(one.name, one)
    return [Entry(name, shown) for name, shown in found.items()]


def _placed(legend: list[Entry], left: float, right: float) -> Iterator[tuple[Entry, float, int]]:
    """Entries, where each begins, and its row."""
    x, row = left, 0
    for entry in legend:
        wide = _SAMPLE + text_width(entry.name, _SIZE)
        if x > left and x + wide > right:
            x, row = left, row + 1
        yield entry, x, row
        x += wide + _GAP


def legend_height(legend: list[Entry], left: float, right: float) -> float:
    """Return the room that a legend takes below the panels, in pixels."""
    rows = [row for _, _, row in _placed(legend, left, right)]
    return _ROW * (rows[-1] + 1) + 4.0 if rows else 0.0


def write_legend(
    drawing: Drawing, legend: list[Entry], left: float, right: float, top: float
) -> None:
    """Write a legend from a height downward."""
    for entry, x, row in _placed(legend, left, right):
        y = top + _ROW * (row + 0.5)
        _sample(drawing, entry.shown, x, y)
        drawing.text((x + _SAMPLE, y), entry.name, _SIZE)


def _sample(drawing: Drawing, shown: Line | Fill | Bars, x: float, y: float) -> None:
    box = (x, y - 4.5, x + _SAMPLE - 6.0, y + 4.5)
    corners = np.array([[box[0], box[1]], [box[2], box[1]], [box[2], box[3]], [box[0], box[3]]])
    if isinstance(shown, Fill):
        drawing.shape(corners, None, fill=shown.colour, opacity=shown.opacity)
        return
    if isinstance(shown, Bars):
        drawing.shape(corners, None, fill=shown.colour)
        if shown.pattern:
            draw_pattern(drawing, shown.pattern, box)
        return
    if shown.inside:
        drawing.shape(corners, None, fill=shown.colour, opacity=shown.inside)
    if not shown.points:
        drawing.line((box[0], y), (box[2], y), shown.colour, shown.width, shown.dash)
    if shown.points or shown.dots:
        draw_points(drawing, shown, np.array([[0.5 * (box[0] + box[2]), y]]))

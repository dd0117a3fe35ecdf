"""A chart as an SVG, the same bytes every time: in the page, in the PDF and as a file.

Everything that the page's script needs to zoom, show values and hide a series is in ``data-``
attributes: of a panel its scales, of a group the name of its series, of a label its point.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from strapdown.constants import Array
from strapdown.errors import ConfigError
from strapdown.report.chart import (
    Band,
    Bars,
    Chart,
    Fill,
    Line,
    Mark,
    Panel,
    runs,
    steady_range,
    strip_range,
)
from strapdown.report.svg_drawing import (
    INK,
    SMALL,
    Box,
    Drawing,
    nice_step,
    number,
    overlap,
    shortened,
    text_width,
    tick_words,
)

# Points, legend samples and patterns of a static chart.


_SIZE = 10.0  # pixels, font size
_LEGEND_ROW, _SAMPLE, _GAP = 15.0, 24.0, 16.0
_POINT, _RIM = 0.4, 0.5  # radius of a point over its size, and its rim in pixels
_HATCH = 6.0  # pixels between the lines of a pattern


def _star(points: int, inner: float) -> Array:
    angle = np.arange(2 * points) * math.pi / points
    radius = np.where(np.arange(2 * points) % 2, inner, 1.0)
    return np.column_stack([radius * np.sin(angle), -radius * np.cos(angle)])


# Half the width of an arm, and its corners from the top around; turned by 45 deg it is an x.
_A, _C = 1.0 / 3.0, math.sqrt(0.5)
_PLUS = np.array(
    [
        *([-_A, -1.0], [_A, -1.0], [_A, -_A], [1.0, -_A], [1.0, _A], [_A, _A]),
        *([_A, 1.0], [-_A, 1.0], [-_A, _A], [-1.0, _A], [-1.0, -_A], [-_A, -_A]),
    ]
)
_OUTLINES = {
    "square": np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]),
    "diamond": 1.4 * np.array([[0.0, -1.0], [1.0, 0.0], [0.0, 1.0], [-1.0, 0.0]]),
    "triangle-up": np.array([[0.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]),
    "triangle-down": np.array([[0.0, 1.0], [1.0, -1.0], [-1.0, -1.0]]),
    "cross": _PLUS,
    "x": _PLUS @ np.array([[_C, _C], [-_C, _C]]),
    "star": 1.1 * _star(5, 0.42),
    "pentagon": _star(5, math.cos(math.pi / 5.0)),
    "circle": np.empty((0, 2)),
}


def draw_points(drawing: Drawing, line: Line, at: Array) -> None:
    """Draw the points of a line at positions in the picture, (n, 2)."""
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
    with drawing.group(box):
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


Shown = Line | Fill | Bars


def entries(chart: Chart) -> list[Shown]:
    """Return what a chart's legend has a sample of, each name once."""
    found: dict[str, Shown] = {}
    for panel in chart.panels:
        lines = {line.name for line in panel.lines if line.legend}
        # A line with a band's name shares its entry.
        fills = [fill for fill in panel.fills if fill.name not in lines]
        shown: list[Shown] = [*fills, *panel.lines, *panel.bars]
        for one in shown:
            if one.legend and one.name:
                found.setdefault(one.name, one)
    return list(found.values())


def _sample(drawing: Drawing, shown: Shown, x: float, y: float) -> None:
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


# One panel of a static chart: its axes and content.


RED = "#b42318"
#: Pixels: tick labels, axis names, names of levels and marks, tick length.
TICK, AXIS, LEVEL, LONG = 10.0, 10.5, 9.5, 3.5
_FAINT, _GRID, _SHADE = "#8a939e", "#e6e9ed", "#0072B2"
_PT = 96.0 / 72.0  # pixels
_SIDE, _RISE = 9.0, 13.0  # pixels of a label from its point


@dataclass(frozen=True)
class Frame:
    """A panel with its position in the picture and its axes.

    `box`: left, top, right, bottom of the area between the axes. `x`, `y`: `y` from the bottom
    upward; for categories from the top downward. `x_named`, `y_named`: whether the tick labels are
    written here. `group`: panels of one group share the horizontal axis.
    """

    panel: Panel
    box: Box
    x: Scale
    y: Scale
    x_ticks: list[Tick]
    y_ticks: list[Tick]
    x_named: bool = True
    y_named: bool = True
    group: str = ""

    def at(self, x: ArrayLike, y: ArrayLike) -> Array:
        """Return points in the picture, (n, 2); NaN for values that an axis cannot show."""
        left, top, right, bottom = self.box
        across = left + (right - left) * self.x.share(x)
        up = self.y.share(y)
        if self.panel.categories:
            return np.column_stack([across, top + (bottom - top) * up])
        return np.column_stack([across, bottom - (bottom - top) * up])

    def draw(self, drawing: Drawing, bands: tuple[Band, ...], marks: tuple[Mark, ...]) -> None:
        """Draw everything within the axes of the panel."""
        panel, (left, top, right, bottom) = self.panel, self.box
        kind = "plane" if panel.x_label else "categories" if panel.categories else "time"
        # Data of the axes for the page's script.
        axes = {
            "data_kind": kind,
            "data_group": self.group,
            "data_x": self.x.words,
            "data_y": self.y.words,
            "data_named": "x" * self.x_named + "y" * (self.y_named and not panel.categories),
            "data_labels": f"{panel.x_label}|{panel.y_label}",
        }
        with drawing.group(self.box, **axes):
            if panel.backdrop is not None:
                with drawing.group(class_="map", opacity="0.75", aria_hidden="true"):
                    for one in panel.backdrop.pictures:
                        corners = one.corner + np.array([0.0 * one.down, one.across, one.down])
                        drawing.picture(one.data, one.media, self.at(*corners.T))
            with drawing.group(class_="grid"):
                for tick in self.x_ticks:
                    if tick.grid:
                        x = self.across(tick.at)
                        drawing.line((x, top), (x, bottom), _GRID, 0.8)
                for tick in [] if panel.bars and panel.categories else self.y_ticks:
                    if tick.grid:
                        y = self.up(tick.at)
                        drawing.line((left, y), (right, y), _GRID, 0.8)
            for band in bands:
                x0, x1 = self.across(band.start), self.across(band.end)
                corners = np.array([[x0, top], [x1, top], [x1, bottom], [x0, bottom]])
                drawing.shape(corners, None, fill=_SHADE, opacity=0.07)
            for fill in panel.fills:
                with drawing.group(data_series=fill.name):
                    low = np.maximum(fill.low, self.y.low) if self.y.log else fill.low
                    for run in runs(fill.x, low, fill.high):
                        below = self.at(fill.x[run], low[run])
                        above = self.at(fill.x[run], fill.high[run])
                        ring = np.vstack([below, above[::-1]])
                        drawing.area(ring[np.isfinite(ring).all(axis=1)], fill.colour, fill.opacity)
            for bars in panel.bars:
                with drawing.group(data_series=bars.name):
                    self._bars(drawing, bars)
            if panel.bars and panel.categories:
                x = self.across(0.0)
                drawing.line((x, top), (x, bottom), INK, 0.8)
            elif panel.bars:
                y = self.up(0.0)
                drawing.line((left, y), (right, y), INK, 0.8)
            for level in panel.levels:
                y = self.up(level.y)
                drawing.line((left, y), (right, y), RED, 1.2, "dash")
            for mark in marks:
                x = self.across(mark.x)
                drawing.line((x, top), (x, bottom), RED, 1.2, "dot")
            for line in panel.lines:
                with drawing.group(data_series=line.name, data_line=""):
                    self._line(drawing, line)
            if panel.backdrop is not None:
                # In the middle: a scale and a compass are in a corner.
                text = shortened(panel.backdrop.text, 0.7 * (right - left), SMALL)
                at = (0.5 * (left + right), bottom - 0.8 * SMALL)
                drawing.text(at, text, SMALL, anchor="middle", halo=True)
        drawing.line((left, top), (left, bottom), INK, 0.8)
        drawing.line((left, bottom), (right, bottom), INK, 0.8)
        with drawing.group(class_="ticks"):
            self._ticks(drawing)
        with drawing.group(class_="names"):
            self._names(drawing)

    def across(self, x: float) -> float:
        """Return the horizontal position of a value in the picture."""
        return float(self.at([x], [self.y.low])[0, 0])

    def up(self, y: float) -> float:
        """Return the vertical position of a value in the picture."""
        return float(self.at([self.x.low], [y])[0, 1])

    def _bars(self, drawing: Drawing, bars: Bars) -> None:
        start = np.zeros_like(bars.values) if bars.start is None else bars.start
        across = bool(self.panel.categories)
        half = 0.5 * bars.width
        for at, begin, end in zip(bars.at, start, bars.values, strict=True):
            sides, ends = [at - half, at + half], [begin, end]
            corners = self.at(ends, sides) if across else self.at(sides, ends)
            if not np.isfinite(corners).all():
                continue
            (x0, y0), (x1, y1) = corners.min(axis=0), corners.max(axis=0)
            drawing.shape([[x0, y0], [x1, y0], [x1, y1], [x0, y1]], None, fill=bars.colour)
            if bars.pattern:
                draw_pattern(drawing, bars.pattern, (x0, y0, x1, y1))

    def _line(self, drawing: Drawing, line: Line) -> None:
        at = self.at(line.x, line.y)
        for run in runs(at[:, 0], at[:, 1]):
            if line.inside:
                drawing.area(at[run], line.colour, line.inside)
            if not line.points:
                stamps = None if line.stamps is None else line.stamps[run]
                drawing.curve(at[run], line.colour, _PT * line.width, line.dash, stamps)
        if line.low is not None and line.high is not None:
            cap = np.array([0.0, 4.0])
            for begin, end in zip(
                self.at(line.low, line.y), self.at(line.high, line.y), strict=True
            ):
                if np.isfinite([begin, end]).all():
                    drawing.line(begin, end, line.colour, 1.6)
                    for place in (begin, end):
                        drawing.line(place - cap, place + cap, line.colour, 1.2)
        if line.points or line.dots:
            draw_points(drawing, line, at)

    def _ticks(self, drawing: Drawing) -> None:
        left, top, right, bottom = self.box
        for tick in self.x_ticks:
            x = self.across(tick.at)
            if not left - 0.5 <= x <= right + 0.5:
                continue
            drawing.line((x, bottom), (x, bottom + LONG * (1.0 if tick.text else 0.6)), INK, 0.8)
            if tick.text and self.x_named:
                drawing.text((x, bottom + LONG + 8.0), tick.text, TICK, anchor="middle")
        for tick in self.y_ticks:
            y = self.up(tick.at)
            if not top - 0.5 <= y <= bottom + 0.5:
                continue
            drawing.line((left - LONG * (1.0 if tick.text else 0.6), y), (left, y), INK, 0.8)
            if tick.text and self.y_named:
                drawing.text((left - LONG - 3.0, y), tick.text, TICK, anchor="end")

    def _names(self, drawing: Drawing) -> None:
        """Write the labels of points, of the ends of bars, and of levels."""
        left, top, right, bottom = self.box
        taken: list[Box] = []
        for level in self.panel.levels:
            y = self.up(level.y)
            if not top - 0.5 <= y <= bottom + 0.5:
                continue
            beside = len(level.label) <= LONGEST_BESIDE
            at = (right + 4.0, y) if beside else (right, y - 0.6 * LEVEL - 1.0)
            anchor = "start" if beside else "end"
            # Of names at one height the first keeps its position, the next moves up.
            box = drawing.box_of(at, level.label, LEVEL, anchor=anchor)
            while any(overlap(box, other) for other in taken):
                at = (at[0], at[1] - 2.0)
                box = drawing.box_of(at, level.label, LEVEL, anchor=anchor)
            with drawing.group(data_at=f"- {number(y)}"):
                taken.append(drawing.text(at, level.label, LEVEL, RED, anchor=anchor))
        for bars in self.panel.bars:
            self._bar_names(drawing, bars)
        for line in self.panel.lines:
            places = line.places or ((0, 1),) * len(line.labels)
            at_points = self.at(line.x, line.y)
            for (x, y), label, (side, rise) in zip(at_points, line.labels, places, strict=False):
                if not (left - 1 <= x <= right + 1 and top - 1 <= y <= bottom + 1):
                    continue
                place = (x + _SIDE * side, y - _RISE * rise)
                anchor = {-1: "end", 0: "middle", 1: "start"}[side]
                with drawing.group(data_at=f"{number(x)} {number(y)}", data_series=line.name):
                    if abs(rise) > 1:
                        drawing.line((x, y), place, _FAINT, 0.7)
                    drawing.text(place, label, TICK, anchor=anchor, halo=not self.panel.categories)

    def _bar_names(self, drawing: Drawing, bars: Bars) -> None:
        start = np.zeros_like(bars.values) if bars.start is None else bars.start
        across = bool(self.panel.categories)
        for at, begin, end, label in zip(bars.at, start, bars.values, bars.labels, strict=False):
            side = -1 if end < begin else 1
            x, y = (self.at([end], [at]) if across else self.at([at], [end]))[0]
            if not np.isfinite([x, y]).all():
                continue
            with drawing.group(data_at=f"{number(x)} {number(y)}", data_series=bars.name):
                if across:
                    anchor = "start" if side > 0 else "end"
                    drawing.text((x + 5.0 * side, y), label, TICK, anchor=anchor)
                else:
                    drawing.text((x, y - 8.0 * side), label, TICK, anchor="middle")


_WIDTH = 643.0  # pixels: 170 mm
_INCH = 96.0
_EDGE, _BETWEEN = 4.0, 7.0  # pixels
_LINE = 13.0  # pixels per line of an axis name
_TITLE, _HEAD = 12.0, 13.0
_SOFT = "#4a525c"
_DOWN, _ACROSS = 15.0, 64.0  # pixels of a step between ticks
_ROW = LEVEL + 2.0


def still(chart: Chart, *, title: bool = False, caption: bool = False) -> str:
    """Draw a chart for the column of a printed page, 170 mm wide, as a whole SVG.

    `title`, `caption`: whether they are in the picture; a document writes them itself.
    """
    head = _folded(chart.title, _WIDTH - 2.0 * _EDGE, _HEAD, bold=True) if title else []
    foot = _folded(chart.caption, _WIDTH - 2.0 * _EDGE, TICK) if caption else []
    legend, below, room = _legend_of(chart)
    top = 1.35 * _HEAD * len(head) + 4.0 * bool(head)
    end = top + room
    drawing = Drawing(_WIDTH, end + 1.3 * TICK * len(foot) + 4.0 * bool(foot), chart.title)
    for k, line in enumerate(head):
        drawing.text((_EDGE, 1.35 * _HEAD * (k + 0.5)), line, _HEAD, bold=True)
    for frame, panel in zip(_frames(chart, top, end - below), chart.panels, strict=True):
        timed = not panel.x_label
        frame.draw(drawing, chart.bands if timed else (), chart.marks if timed else ())
        _around(drawing, chart, frame)
    for shown, x, row in legend:
        y = end - below + _LEGEND_ROW * (row + 0.5)
        with drawing.group(data_entry=shown.name):
            _sample(drawing, shown, x, y)
            drawing.text((x + _SAMPLE, y), shown.name, _SIZE)
    for k, line in enumerate(foot):
        drawing.text((_EDGE, end + 1.3 * TICK * (k + 0.5)), line, TICK, _SOFT)
    return drawing.svg()


def plane_view(chart: Chart) -> tuple[Array, Array]:
    """Return what the plane of a chart shows: its lower left and upper right corner, (2,) each."""
    _, below, room = _legend_of(chart)
    frame = _frames(chart, 0.0, room - below)[0]
    return np.array([frame.x.low, frame.y.low]), np.array([frame.x.high, frame.y.high])


def _legend_of(chart: Chart) -> tuple[list[tuple[Shown, float, int]], float, float]:
    """Legend entries with left end and row, their height, and that of the chart with them."""
    legend: list[tuple[Shown, float, int]] = []
    x, row = _EDGE, 0
    for one in entries(chart):
        wide = _SAMPLE + text_width(one.name, _SIZE)
        if x > _EDGE and x + wide > _WIDTH - _EDGE:
            x, row = _EDGE, row + 1
        legend.append((one, x, row))
        x += wide + _GAP
    below = _LEGEND_ROW * (row + 1) + 4.0 if legend else 0.0
    # In inches; two charts of three panels fill a page.
    if min(len(panel.categories) for panel in chart.panels):
        height = 0.8 + 0.19 * max(len(panel.categories) for panel in chart.panels)
    elif chart.beside:
        height = 3.2
    else:
        height = 0.85 + 0.95 * math.fsum(panel.height for panel in chart.panels)
        height += 0.18 * sum(bool(panel.title) for panel in chart.panels)
        height += 0.6 * (len(chart.panels) == 1)
    return legend, below, _INCH * height + max(0.0, below - 20.0)


def _frames(chart: Chart, start: float, height: float) -> list[Frame]:
    """Panels between two heights of the picture."""
    count = len(chart.panels)
    xs, ys = _scales(chart)
    named = [chart.beside or bool(p.x_label) or k == count - 1 for k, p in enumerate(chart.panels)]
    rooms = [_upright(chart, k, named[k], xs[k], ys[k]) for k in range(count)]
    if chart.beside:
        above, below = max(a for a, _ in rooms), max(b for _, b in rooms)
        spans = [(start + above, height - below)] * count
    else:
        used = math.fsum(a + b for a, b in rooms) + _BETWEEN * (count - 1)
        ratios = np.array([panel.height for panel in chart.panels])
        heights = np.maximum(height - start - used, 20.0 * count) * ratios / ratios.sum()
        spans, top = [], start
        for (above, below), tall in zip(rooms, heights.tolist(), strict=True):
            spans.append((top + above, top + above + tall))
            top += above + tall + below + _BETWEEN
    y_ticks = [_y_ticks(p, y, b - t) for p, y, (t, b) in zip(chart.panels, ys, spans, strict=True)]
    y_named = [not chart.beside or k == 0 or bool(p.categories) for k, p in enumerate(chart.panels)]
    sides = [
        _sides(chart.panels[k], y_ticks[k] if y_named[k] else [], spans[k]) for k in range(count)
    ]
    if chart.beside:
        free = (_WIDTH - math.fsum(a + b for a, b in sides)) / count
        boxes, at = [], 0.0
        for left, right in sides:
            boxes.append((at + left, at + left + free))
            at += left + free + right
    else:
        boxes = [(max(a for a, _ in sides), _WIDTH - max(b for _, b in sides))] * count
    found = []
    for k, panel in enumerate(chart.panels):
        (left, right), (top, bottom) = boxes[k], spans[k]
        x, y = xs[k], ys[k]
        if panel.x_label:
            # Both axes of a plane have one scale: the one with room is widened.
            shape, wide, high = (right - left) / (bottom - top), x.high - x.low, y.high - y.low
            if wide < shape * high:
                room = 0.5 * (shape * high - wide)
                x = replace(x, low=x.low - room, high=x.high + room)
            else:
                room = 0.5 * (wide / shape - high)
                y = replace(y, low=y.low - room, high=y.high + room)
            y_ticks[k] = _y_ticks(panel, y, bottom - top)
        step = panel.x_step if panel.x_label or k == count - 1 else 0.0
        x_ticks = ticks(x, int((right - left) / _ACROSS), step=step, between=100.0)
        box = (left, top, right, bottom)
        group = f"plane-{k}" if panel.x_label else "time"
        found.append(Frame(panel, box, x, y, x_ticks, y_ticks[k], named[k], y_named[k], group))
    return found


def _scales(chart: Chart) -> tuple[list[Scale], list[Scale]]:
    """Axes of the panels: horizontally one is shared by all, and planes have their own."""
    together: list[Array] = [np.array([b.start, b.end]) for b in chart.bands]
    together.append(np.array([mark.x for mark in chart.marks]))
    margin = 0.05
    own: dict[int, Scale] = {}
    ys = []
    for k, panel in enumerate(chart.panels):
        x = [line.x[np.isfinite(line.y)] for line in panel.lines]
        x += [v for line in panel.lines for v in (line.low, line.high) if v is not None]
        x += [f.x[np.isfinite(f.low) & np.isfinite(f.high)] for f in panel.fills]
        y = [line.y[np.isfinite(line.x)] for line in panel.lines]
        y += [v for fill in panel.fills for v in (fill.low, fill.high)]
        y.append(np.array([level.y for level in panel.levels]))
        for bars in panel.bars:
            ends = [bars.values, np.zeros(1) if bars.start is None else bars.start]
            y += ends
            if panel.categories:
                x += ends
            else:
                x += [bars.at - 0.5 * bars.width, bars.at + 0.5 * bars.width]
        if panel.x_label:
            own[k] = fitted(x)
        else:
            together += x
            margin = max(margin, 0.12 * bool(panel.bars and panel.categories))
        if panel.categories:
            ys.append(Scale(-0.5, len(panel.categories) - 0.5))
        elif (steady := steady_range(panel)) is not None:
            ys.append(Scale(*steady))
        else:
            ys.append(fitted(y, panel.log, 0.12 if panel.bars else 0.05))
    if chart.beside and not any(panel.categories for panel in chart.panels):
        ys = [Scale(min(y.low for y in ys), max(y.high for y in ys), ys[0].log)] * len(ys)
    span = strip_range(chart)
    shared = fitted(together, chart.log_x, margin) if span is None else Scale(*span)
    return [own.get(k, shared) for k in range(len(ys))], ys


def _y_ticks(panel: Panel, scale: Scale, tall: float) -> list[Tick]:
    if panel.categories:
        return [Tick(float(k), name) for k, name in enumerate(panel.categories)]
    return ticks(scale, max(2, min(8, int(tall / _DOWN))), step=panel.step)


def _upright(chart: Chart, k: int, named: bool, x: Scale, y: Scale) -> tuple[float, float]:
    """Margins above and below a panel, in pixels."""
    panel = chart.panels[k]
    above = _EDGE + (_TITLE + 6.0) * bool(panel.title)
    if y.power:
        above += TICK + 2.0
    if chart.marks and k == _first_timed(chart):
        above += 2.0 + _ROW * (1 + max(row for _, _, row, _ in _marks(chart, x)))
    below = 0.0
    if named:
        below += LONG + TICK + 6.0
        if _x_name(chart, k):
            below += _LINE + 3.0
    return above, below


def _first_timed(chart: Chart) -> int:
    return next((k for k, panel in enumerate(chart.panels) if not panel.x_label), -1)


def _x_name(chart: Chart, k: int) -> str:
    panel = chart.panels[k]
    if panel.x_label:
        return panel.x_label
    return chart.x_label if chart.beside or k == len(chart.panels) - 1 else ""


def _marks(chart: Chart, x: Scale) -> list[tuple[Mark, float, int, str]]:
    """Marks, each with its share of the axis, and row above it and alignment of its name."""
    # Approximate width of a letter, as a share of the axis.
    letter = 0.56 * LEVEL / (0.87 * _WIDTH / (len(chart.panels) if chart.beside else 1))
    shares = x.share([mark.x for mark in chart.marks]).tolist()
    rows = label_rows(shares, [mark.label for mark in chart.marks], letter)
    return [
        (mark, share, row, label_side(share, mark.label, letter))
        for mark, share, row in zip(chart.marks, shares, rows, strict=True)
    ]


def _folded(text: str, width: float, size: float, bold: bool = False) -> list[str]:
    """Break a text between words into lines of at most a width."""
    lines = [""]
    for word in text.split():
        longer = f"{lines[-1]} {word}".strip()
        if lines[-1] and text_width(longer, size, bold) > width:
            lines.append(word)
        else:
            lines[-1] = longer
    return [line for line in lines if line]


def _sides(panel: Panel, y_ticks: list[Tick], span: tuple[float, float]) -> tuple[float, float]:
    """Margins to the left and to the right of a panel."""
    left = _EDGE + LONG + 3.0
    left += max((text_width(tick.text, TICK) for tick in y_ticks), default=0.0)
    lines = _folded(panel.y_label, span[1] - span[0] + 2.0 * _BETWEEN, AXIS)
    if lines:
        left += 4.0 + _LINE * len(lines)
    beside = [lv.label for lv in panel.levels if len(lv.label) <= LONGEST_BESIDE]
    right = 6.0 + max((text_width(label, LEVEL) for label in beside), default=8.0)
    ends = [label for bars in panel.bars for label in bars.labels] if panel.categories else []
    right = max(right, max((text_width(label, TICK) for label in ends), default=0.0))
    return left, right


def _around(drawing: Drawing, chart: Chart, frame: Frame) -> None:
    """Write the text outside of a panel's axes."""
    k = next(j for j, panel in enumerate(chart.panels) if panel is frame.panel)
    panel, (left, top, right, bottom) = frame.panel, frame.box
    above = top - 3.0
    if frame.y.power:
        drawing.text((left - LONG, above - 0.5 * TICK), f"× {_power(frame.y.power)}", TICK)
        above -= TICK + 2.0
    if chart.marks and k == _first_timed(chart):
        above = _write_marks(drawing, chart, frame, above)
    if panel.title:
        drawing.text((left, above - 0.5 * _TITLE - 1.0), panel.title, _TITLE, bold=True)
    if frame.x_named and (name := _x_name(chart, k)):
        if frame.x.power:
            name = f"{name} × {_power(frame.x.power)}"
        at = (0.5 * (left + right), bottom + LONG + TICK + 6.0 + 0.5 * _LINE)
        drawing.text(at, name, AXIS, anchor="middle")
    widest = max((text_width(t.text, TICK) for t in frame.y_ticks), default=0.0)
    lines = _folded(panel.y_label, bottom - top + 2.0 * _BETWEEN, AXIS)
    x = left - LONG - 3.0 - (widest if frame.y_named else 0.0) - 4.0
    if not chart.beside:
        x = _EDGE + _LINE * max(1, len(lines))
    for j, line in enumerate(lines):
        place = (x - _LINE * (len(lines) - j - 0.5), 0.5 * (top + bottom))
        drawing.text(place, line, AXIS, anchor="middle", turn=-90.0)


def _write_marks(drawing: Drawing, chart: Chart, frame: Frame, above: float) -> float:
    """Name the marks above the axes, one above the other where they are close."""
    left, _, right, _ = frame.box
    placed = _marks(chart, frame.x)
    for mark, share, row, side in placed:
        anchor = {"left": "start", "center": "middle", "right": "end"}[side]
        at = (left + share * (right - left), above - _ROW * (row + 0.5))
        with drawing.group(data_at=f"{number(at[0])} -", data_group=frame.group):
            drawing.text(at, mark.label, LEVEL, RED, anchor=anchor)
    return above - _ROW * (1 + max(row for _, _, row, _ in placed))


def _power(power: int) -> str:
    return "10" + str(power).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))


# Positions of the names of vertical marks above a chart, without overlap.


#: Longest name of a level, in letters, that fits beside the axes; longer ones go on its line.
LONGEST_BESIDE = 18
# Gap between names in one row, in letters.
_NAME_GAP = 1.5


def label_side(share: float, label: str, letter: float) -> str:
    """Return the alignment of a name at its mark that keeps it within the axes.

    `share`: position of the mark from the left, and `letter`: width of a letter, as shares of the
    axis. ``left``, ``center`` or ``right``: the part of the name at the mark.
    """
    half = 0.5 * letter * len(label)
    if share < half:
        return "left"
    return "right" if share > 1.0 - half else "center"


def label_rows(shares: Sequence[float], labels: Sequence[str], letter: float) -> tuple[int, ...]:
    """Return the row of each name, from 0 at the axes upward; arguments as of `label_side`.

    It is the lowest row without overlap with the names to the left.
    """
    ends: list[float] = []
    rows = [0] * len(shares)
    for k in sorted(range(len(shares)), key=lambda j: (shares[j], j)):
        wide = letter * len(labels[k])
        part = {"left": 0.0, "center": 0.5, "right": 1.0}[label_side(shares[k], labels[k], letter)]
        start = shares[k] - part * wide
        free = (row for row, end in enumerate(ends) if end + _NAME_GAP * letter <= start)
        row = next(free, len(ends))
        ends[row : row + 1] = [start + wide]
        rows[k] = row
    return tuple(rows)


# Axes of a static chart: their ends and ticks.


# Numbers beyond this are written with a power of ten beside the axis.
_SMALL, _LARGE = 1e-3, 1e6


@dataclass(frozen=True)
class Scale:
    """An axis from `low` to `high`."""

    low: float
    high: float
    log: bool = False

    def share(self, values: ArrayLike) -> Array:
        """Return the position of values, from 0 at the low end to 1; NaN if a log axis has none."""
        v = np.asarray(values, dtype=np.float64)
        if not self.log:
            return np.asarray((v - self.low) / (self.high - self.low))
        low, high = math.log10(self.low), math.log10(self.high)
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray((np.log10(np.where(v > 0.0, v, np.nan)) - low) / (high - low))

    @property
    def words(self) -> str:
        """Low and high end, whether logarithmic, and power of ten, for the page's script."""
        return f"{float(self.low)!r} {float(self.high)!r} {int(self.log)} {self.power}"

    @property
    def power(self) -> int:
        """Power of ten by which labels are divided."""
        largest = max(abs(self.low), abs(self.high))
        if self.log or _SMALL <= largest < _LARGE:
            return 0
        return math.floor(math.log10(largest))


@dataclass(frozen=True)
class Tick:
    """A position on an axis; a minor tick has no grid line."""

    at: float
    text: str
    grid: bool = True


def fitted(values: Sequence[ArrayLike], log: bool = False, margin: float = 0.05) -> Scale:
    """Make an axis that contains the values, with a margin at both ends, as a share of their span.

    Values that are not finite, or not positive on a logarithmic axis, are ignored.
    """
    v = np.concatenate([np.empty(0), *(np.asarray(x, dtype=np.float64).ravel() for x in values)])
    v = v[np.isfinite(v) & ((v > 0.0) if log else True)]
    if not v.size:
        return Scale(0.1, 1.0, True) if log else Scale(0.0, 1.0)
    low, high = float(v.min()), float(v.max())
    if log:
        low, high = math.log10(low), math.log10(high)
    room = margin * (high - low)
    if not room > 1e-12 * max(abs(low), abs(high)):
        room = 0.3 if log else 0.05 * abs(low) or 0.05
    low, high = low - room, high + room
    return Scale(10.0**low, 10.0**high, True) if log else Scale(low, high)


def ticks(scale: Scale, most: int, *, step: float = 0.0, between: float = 30.0) -> list[Tick]:
    """Choose the ticks of an axis, of `most` steps at most.

    `step`: requested, if any, and not of a logarithmic axis. `between`: a logarithmic axis of a
    smaller ratio also has labels at 2 and 5 times powers of ten.
    """
    if not scale.log:
        return _even(scale, step or nice_step((scale.high - scale.low) / max(most, 1)))
    found: list[Tick] = []
    first, last = math.floor(math.log10(scale.low)), math.ceil(math.log10(scale.high))
    stride = -(-(last - first) // max(most, 1))
    for power in range(first, last + 1):
        for digit in range(1, 10):
            at = digit * 10.0**power
            if not scale.low <= at <= scale.high * (1.0 + 1e-12):
                continue
            text = f"{at:g}".replace("-", "−")
            if digit == 1:
                found.append(Tick(at, text if power % stride == 0 else ""))
            elif stride == 1:
                said = digit in (2, 5) and scale.high < between * scale.low
                found.append(Tick(at, text if said else "", grid=False))
    if sum(bool(tick.text) for tick in found) < 2:
        return _even(scale, nice_step((scale.high - scale.low) / max(most, 1)))
    return found


def _even(scale: Scale, step: float) -> list[Tick]:
    unit = 10.0**scale.power
    first, last = math.ceil(scale.low / step - 1e-9), math.floor(scale.high / step + 1e-9)
    return [
        Tick(k * step, tick_words(k * step / unit, step / unit)) for k in range(first, last + 1)
    ]


# A chart alone: shown by a notebook, or written as SVG, PNG or PDF.


_PPI = 200
_TYPST = '#set page(width: auto, height: auto, margin: 4pt)\n#image("chart.svg")\n'


@dataclass(frozen=True)
class ChartFigure:
    """A chart as a picture; `panels` hold its data: lines, bands and bars with their values.

    A notebook displays it; `save` writes it.
    """

    chart: Chart

    @property
    def panels(self) -> tuple[Panel, ...]:
        """Panels with their data, from the top."""
        return self.chart.panels

    def svg(self, *, caption: bool = False) -> str:
        """Return the picture as SVG, with its title and, if wanted, its caption below."""
        return still(self.chart, title=True, caption=caption)

    def save(self, path: str | Path, *, caption: bool = False) -> None:
        """Write the picture: SVG, PNG or PDF by the ending of the file's name.

        Parameters
        ----------
        path : str or Path
        caption : bool
            Whether to write the caption in the picture, for use without a page.

        Raises
        ------
        ConfigError
            Another ending.
        """
        path = Path(path)
        ending = path.suffix.lower().lstrip(".")
        if ending == "svg":
            path.write_text(self.svg(caption=caption), encoding="utf-8", newline="\n")
        elif ending in ("png", "pdf"):
            path.write_bytes(_typeset(self.svg(caption=caption), ending))
        else:
            raise ConfigError("report.unknown-picture", file=str(path), word=ending)

    def _repr_svg_(self) -> str:
        return self.svg()

    def __repr__(self) -> str:
        """Return the title and the number of panels."""
        return f"<ChartFigure: {self.chart.title}; {len(self.panels)} panels>"


def _typeset(svg: str, ending: str) -> bytes:
    """Draw an SVG with the fonts inside typst: the same bytes on every machine."""
    from strapdown.report.document_pdf import shown, typst_library

    with tempfile.TemporaryDirectory(prefix="strapdown-") as name:
        folder = Path(name)
        (folder / "chart.svg").write_text(shown(svg), encoding="utf-8", newline="\n")
        (folder / "chart.typ").write_text(_TYPST, encoding="utf-8", newline="\n")
        made: bytes = typst_library().compile(
            str(folder / "chart.typ"),
            root=str(folder),
            font_paths=[],
            ignore_system_fonts=True,
            format=ending,
            ppi=_PPI,
            timestamp=0,
        )
    return made

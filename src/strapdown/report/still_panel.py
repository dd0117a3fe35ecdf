"""One panel of a still: its axes, and what is drawn between them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from strapdown.report.chart import Band, Bars, Fill, Line, Mark, Panel, runs
from strapdown.report.mark_places import LONGEST_BESIDE
from strapdown.report.still_marks import draw_pattern, draw_points
from strapdown.report.still_scale import Scale, Tick
from strapdown.report.svg_drawing import INK, Box, Drawing, overlap

__all__ = ["AXIS", "LEVEL", "LONG", "RED", "TICK", "Frame"]

Array = NDArray[np.float64]

RED = "#b42318"
#: Pixels: of labels of ticks, of names of axes, of names of levels and marks, of a tick.
TICK, AXIS, LEVEL, LONG = 10.0, 10.5, 9.5, 3.5
_FAINT, _GRID, _SHADE = "#8a939e", "#e6e9ed", "#0072B2"
_POINT = 96.0 / 72.0  # pixels
_SIDE, _RISE = 9.0, 13.0  # pixels of a label from its point


@dataclass(frozen=True)
class Frame:
    """A panel with its place in the picture and its axes.

    Attributes
    ----------
    panel : Panel
    box : Box
        Left, top, right, bottom of what is between the axes.
    x, y : Scale
        `y` from the bottom upward; of categories from the top downward.
    x_ticks, y_ticks : list of Tick
    x_named, y_named : bool
        Whether the ticks have their labels here.
    """

    panel: Panel
    box: Box
    x: Scale
    y: Scale
    x_ticks: list[Tick]
    y_ticks: list[Tick]
    x_named: bool = True
    y_named: bool = True

    def at(self, x: ArrayLike, y: ArrayLike) -> Array:
        """Return points in the picture, (n, 2); NaN where an axis has no such value."""
        left, top, right, bottom = self.box
        across = left + (right - left) * self.x.share(x)
        up = self.y.share(y)
        if self.panel.categories:
            return np.column_stack([across, top + (bottom - top) * up])
        return np.column_stack([across, bottom - (bottom - top) * up])

    def draw(self, drawing: Drawing, bands: tuple[Band, ...], marks: tuple[Mark, ...]) -> None:
        """Draw everything but what is outside of the axes for all panels."""
        panel, (left, top, right, bottom) = self.panel, self.box
        with drawing.within(self.box):
            for band in bands:
                (x0, _), (x1, _) = self._edges([band.start, band.end])
                corners = np.array([[x0, top], [x1, top], [x1, bottom], [x0, bottom]])
                drawing.shape(corners, None, fill=_SHADE, opacity=0.07)
            self._grid(drawing)
            for fill in panel.fills:
                self._fill(drawing, fill)
            for bars in panel.bars:
                self._bars(drawing, bars)
            self._zero(drawing)
            for level in panel.levels:
                y = float(self.at([self.x.low], [level.y])[0, 1])
                drawing.line((left, y), (right, y), RED, 1.2, "dash")
            for mark in marks:
                ((x, _),) = self._edges([mark.x])
                drawing.line((x, top), (x, bottom), RED, 1.2, "dot")
            for line in panel.lines:
                self._line(drawing, line)
        drawing.line((left, top), (left, bottom), INK, 0.8)
        drawing.line((left, bottom), (right, bottom), INK, 0.8)
        self._ticks(drawing)
        self._names(drawing)

    def _edges(self, x: list[float]) -> Array:
        return self.at(x, [self.y.low] * len(x))

    def _grid(self, drawing: Drawing) -> None:
        left, top, right, bottom = self.box
        for tick in self.x_ticks:
            if tick.grid:
                ((x, _),) = self._edges([tick.at])
                drawing.line((x, top), (x, bottom), _GRID, 0.8)
        if self.panel.bars and self.panel.categories:
            return
        for tick in self.y_ticks:
            if tick.grid:
                y = float(self.at([self.x.low], [tick.at])[0, 1])
                drawing.line((left, y), (right, y), _GRID, 0.8)

    def _fill(self, drawing: Drawing, fill: Fill) -> None:
        low = np.maximum(fill.low, self.y.low) if self.y.log else fill.low
        for run in runs(fill.x, low, fill.high):
            below, above = self.at(fill.x[run], low[run]), self.at(fill.x[run], fill.high[run])
            ring = np.vstack([below, above[::-1]])
            drawing.area(ring[np.isfinite(ring).all(axis=1)], fill.colour, fill.opacity)

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

    def _zero(self, drawing: Drawing) -> None:
        if not self.panel.bars:
            return
        left, top, right, bottom = self.box
        if self.panel.categories:
            ((x, _),) = self._edges([0.0])
            drawing.line((x, top), (x, bottom), INK, 0.8)
        else:
            y = float(self.at([self.x.low], [0.0])[0, 1])
            drawing.line((left, y), (right, y), INK, 0.8)

    def _line(self, drawing: Drawing, line: Line) -> None:
        at = self.at(line.x, line.y)
        for run in runs(at[:, 0], at[:, 1]):
            if line.inside:
                drawing.area(at[run], line.colour, line.inside)
            if not line.points:
                drawing.curve(at[run], line.colour, _POINT * line.width, line.dash)
        if line.low is not None and line.high is not None:
            self._reaches(drawing, line, line.low, line.high)
        if line.points or line.dots:
            draw_points(drawing, line, at)

    def _reaches(self, drawing: Drawing, line: Line, low: Array, high: Array) -> None:
        cap = np.array([0.0, 4.0])
        for begin, end in zip(self.at(low, line.y), self.at(high, line.y), strict=True):
            if np.isfinite([begin, end]).all():
                drawing.line(begin, end, line.colour, 1.6)
                for place in (begin, end):
                    drawing.line(place - cap, place + cap, line.colour, 1.2)

    def _ticks(self, drawing: Drawing) -> None:
        left, top, right, bottom = self.box
        for tick in self.x_ticks:
            ((x, _),) = self._edges([tick.at])
            if not left - 0.5 <= x <= right + 0.5:
                continue
            drawing.line((x, bottom), (x, bottom + LONG * (1.0 if tick.text else 0.6)), INK, 0.8)
            if tick.text and self.x_named:
                drawing.text((x, bottom + LONG + 8.0), tick.text, TICK, anchor="middle")
        for tick in self.y_ticks:
            y = float(self.at([self.x.low], [tick.at])[0, 1])
            if not top - 0.5 <= y <= bottom + 0.5:
                continue
            drawing.line((left - LONG * (1.0 if tick.text else 0.6), y), (left, y), INK, 0.8)
            if tick.text and self.y_named:
                drawing.text((left - LONG - 3.0, y), tick.text, TICK, anchor="end")

    def _names(self, drawing: Drawing) -> None:
        """Write what stands at points, at the ends of bars, and beside levels."""
        left, top, right, bottom = self.box
        taken: list[Box] = []
        for level in self.panel.levels:
            y = float(self.at([self.x.low], [level.y])[0, 1])
            if not top - 0.5 <= y <= bottom + 0.5:
                continue
            beside = len(level.label) <= LONGEST_BESIDE
            at = (right + 4.0, y) if beside else (right, y - 0.6 * LEVEL - 1.0)
            anchor = "start" if beside else "end"
            # Of names at one height the first has its place, the next gives way.
            box = drawing.box_of(at, level.label, LEVEL, anchor=anchor)
            while any(overlap(box, other) for other in taken):
                at = (at[0], at[1] - 2.0)
                box = drawing.box_of(at, level.label, LEVEL, anchor=anchor)
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
                if abs(rise) > 1:
                    drawing.line((x, y), place, _FAINT, 0.7)
                anchor = {-1: "end", 0: "middle", 1: "start"}[side]
                drawing.text(place, label, TICK, anchor=anchor, halo=not self.panel.categories)

    def _bar_names(self, drawing: Drawing, bars: Bars) -> None:
        start = np.zeros_like(bars.values) if bars.start is None else bars.start
        across = bool(self.panel.categories)
        for at, begin, end, label in zip(bars.at, start, bars.values, bars.labels, strict=False):
            side = -1 if end < begin else 1
            x, y = (self.at([end], [at]) if across else self.at([at], [end]))[0]
            if not np.isfinite([x, y]).all():
                continue
            if across:
                anchor = "start" if side > 0 else "end"
                drawing.text((x + 5.0 * side, y), label, TICK, anchor=anchor)
            else:
                drawing.text((x, y - 8.0 * side), label, TICK, anchor="middle")

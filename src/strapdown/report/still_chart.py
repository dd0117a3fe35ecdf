"""A chart as a still for paper: an SVG of lines and words, the same bytes every time."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from strapdown.report.chart import Chart, Panel, steady_range, strip_range
from strapdown.report.mark_places import LONGEST_BESIDE, label_rows, label_side
from strapdown.report.still_marks import entries, legend_height, write_legend
from strapdown.report.still_panel import AXIS, LEVEL, LONG, RED, TICK, Frame
from strapdown.report.still_scale import Scale, Tick, fitted, ticks
from strapdown.report.svg_drawing import Drawing, text_width

__all__ = ["still"]

Array = NDArray[np.float64]

_WIDTH = 643.0  # pixels: 170 mm
_INCH = 96.0
_EDGE, _BETWEEN = 4.0, 7.0  # pixels
_LINE = 13.0  # of a name of an axis
_TITLE = 12.0
_DOWN, _ACROSS = 15.0, 64.0  # pixels of a step between ticks
_ROW = LEVEL + 2.0


def still(chart: Chart) -> str:
    """Draw a chart as a still for the column of a printed page, which says the title itself.

    Parameters
    ----------
    chart : Chart

    Returns
    -------
    str
        A whole SVG, 170 mm wide.

    Notes
    -----
    `svg_chart.draw` shows the same by matplotlib, for who wants a picture of a chart alone; it
    takes some 100 ms a chart, mostly for the objects that its ticks are made of.
    """
    legend = entries(chart)
    below = legend_height(legend, _EDGE, _WIDTH - _EDGE)
    height = _INCH * _height(chart) + max(0.0, below - 20.0)
    drawing = Drawing(_WIDTH, height, chart.title)
    for frame, panel in zip(_frames(chart, height - below), chart.panels, strict=True):
        timed = not panel.x_label
        frame.draw(drawing, chart.bands if timed else (), chart.marks if timed else ())
        _around(drawing, chart, frame)
    write_legend(drawing, legend, _EDGE, _WIDTH - _EDGE, height - below)
    return drawing.svg()


def _height(chart: Chart) -> float:
    """Inches of a chart in a column of print: two of three panels fill a page with what is said."""
    if min(len(panel.categories) for panel in chart.panels):
        return 0.8 + 0.19 * max(len(panel.categories) for panel in chart.panels)
    if chart.beside:
        return 3.2
    titles = 0.18 * sum(bool(panel.title) for panel in chart.panels)
    alone = 0.6 * (len(chart.panels) == 1)
    return 0.85 + 0.95 * sum(panel.height for panel in chart.panels) + titles + alone


@dataclass(frozen=True)
class _Room:
    """What a panel needs outside of its axes, in pixels."""

    left: float = 0.0
    right: float = 0.0
    above: float = 0.0
    below: float = 0.0


def _frames(chart: Chart, height: float) -> list[Frame]:
    count = len(chart.panels)
    xs, ys = _x_scales(chart), [_y_scale(panel) for panel in chart.panels]
    if chart.beside and not any(panel.categories for panel in chart.panels):
        same = Scale(min(y.low for y in ys), max(y.high for y in ys), ys[0].log)
        ys = [same] * count
    named = [chart.beside or bool(p.x_label) or k == count - 1 for k, p in enumerate(chart.panels)]
    rooms = [_upright(chart, k, named[k], xs[k], ys[k]) for k in range(count)]
    if chart.beside:
        above, below = max(r.above for r in rooms), max(r.below for r in rooms)
        spans = [(above, height - below)] * count
    else:
        used = sum(r.above + r.below for r in rooms) + _BETWEEN * (count - 1)
        ratios = np.array([panel.height for panel in chart.panels])
        free = np.maximum(height - used, 20.0 * count) * ratios / ratios.sum()
        spans, top = [], 0.0
        for room, tall in zip(rooms, free.tolist(), strict=True):
            spans.append((top + room.above, top + room.above + tall))
            top += room.above + tall + room.below + _BETWEEN
    y_ticks = [_y_ticks(p, y, b - t) for p, y, (t, b) in zip(chart.panels, ys, spans, strict=True)]
    y_named = [not chart.beside or k == 0 or bool(p.categories) for k, p in enumerate(chart.panels)]
    sides = [
        _Room(*_sides(chart.panels[k], y_ticks[k] if y_named[k] else [], spans[k]))
        for k in range(count)
    ]
    boxes = _across(chart, sides)
    found = []
    for k, panel in enumerate(chart.panels):
        (left, right), (top, bottom) = boxes[k], spans[k]
        x, y = xs[k], ys[k]
        if panel.x_label:
            x, y = _one_scale(x, y, (right - left) / (bottom - top))
            y_ticks[k] = _y_ticks(panel, y, bottom - top)
        step = panel.x_step if panel.x_label or k == count - 1 else 0.0
        x_ticks = ticks(x, int((right - left) / _ACROSS), step=step, between=100.0)
        box = (left, top, right, bottom)
        found.append(Frame(panel, box, x, y, x_ticks, y_ticks[k], named[k], y_named[k]))
    return found


def _x_scales(chart: Chart) -> list[Scale]:
    """Horizontal axes: one that all panels share, and their own of planes."""
    values: list[Array] = [np.array([b.start, b.end]) for b in chart.bands]
    values.append(np.array([mark.x for mark in chart.marks]))
    margin = 0.05
    for panel in chart.panels:
        if not panel.x_label:
            values += _x_values(panel)
            margin = max(margin, 0.12 * bool(panel.bars and panel.categories))
    shared = fitted(values, chart.log_x, margin)
    if (span := strip_range(chart)) is not None:
        shared = Scale(*span)
    return [fitted(_x_values(p)) if p.x_label else shared for p in chart.panels]


def _x_values(panel: Panel) -> list[Array]:
    found = [line.x[np.isfinite(line.y)] for line in panel.lines]
    found += [v for line in panel.lines for v in (line.low, line.high) if v is not None]
    found += [f.x[np.isfinite(f.low) & np.isfinite(f.high)] for f in panel.fills]
    for bars in panel.bars:
        if panel.categories:
            found += [bars.values, np.zeros(1) if bars.start is None else bars.start]
        else:
            found += [bars.at - 0.5 * bars.width, bars.at + 0.5 * bars.width]
    return found


def _y_scale(panel: Panel) -> Scale:
    if panel.categories:
        return Scale(-0.5, len(panel.categories) - 0.5)
    if (ends := steady_range(panel)) is not None:
        return Scale(*ends)
    values = [line.y[np.isfinite(line.x)] for line in panel.lines]
    values += [v for fill in panel.fills for v in (fill.low, fill.high)]
    values.append(np.array([level.y for level in panel.levels]))
    for bars in panel.bars:
        values += [bars.values, np.zeros(1) if bars.start is None else bars.start]
    return fitted(values, panel.log, 0.12 if panel.bars else 0.05)


def _one_scale(x: Scale, y: Scale, shape: float) -> tuple[Scale, Scale]:
    """Widen one axis of a plane, so that both have one scale in a panel of a shape."""
    wide, high = x.high - x.low, y.high - y.low
    if wide < shape * high:
        room = 0.5 * (shape * high - wide)
        return replace(x, low=x.low - room, high=x.high + room), y
    room = 0.5 * (wide / shape - high)
    return x, replace(y, low=y.low - room, high=y.high + room)


def _y_ticks(panel: Panel, scale: Scale, tall: float) -> list[Tick]:
    if panel.categories:
        return [Tick(float(k), name) for k, name in enumerate(panel.categories)]
    return ticks(scale, max(2, min(8, int(tall / _DOWN))), step=panel.step)


def _upright(chart: Chart, k: int, named: bool, x: Scale, y: Scale) -> _Room:
    """Room above and below a panel."""
    panel = chart.panels[k]
    above = _EDGE + (_TITLE + 6.0) * bool(panel.title)
    if y.power:
        above += TICK + 2.0
    if chart.marks and k == _first_timed(chart):
        above += 2.0 + _ROW * (1 + max(_mark_rows(chart, x)))
    below = 0.0
    if named:
        below += LONG + TICK + 6.0
        if _x_name(chart, k):
            below += _LINE + 3.0
    return _Room(above=above, below=below)


def _first_timed(chart: Chart) -> int:
    return next((k for k, panel in enumerate(chart.panels) if not panel.x_label), -1)


def _x_name(chart: Chart, k: int) -> str:
    panel = chart.panels[k]
    if panel.x_label:
        return panel.x_label
    return chart.x_label if chart.beside or k == len(chart.panels) - 1 else ""


def _letter(chart: Chart) -> float:
    """Width of a letter of a mark's name as a share of the axis, about."""
    beside = len(chart.panels) if chart.beside else 1
    return 0.56 * LEVEL / (0.87 * _WIDTH / beside)


def _mark_rows(chart: Chart, x: Scale) -> tuple[int, ...]:
    shares = x.share([mark.x for mark in chart.marks]).tolist()
    return label_rows(shares, [mark.label for mark in chart.marks], _letter(chart))


def _name_lines(name: str, tall: float) -> list[str]:
    """A name of an axis in lines that its panel is long enough for, broken between words."""
    lines = [""]
    for word in name.split():
        longer = f"{lines[-1]} {word}".strip()
        if lines[-1] and text_width(longer, AXIS) > tall:
            lines.append(word)
        else:
            lines[-1] = longer
    return [line for line in lines if line]


def _sides(panel: Panel, y_ticks: list[Tick], span: tuple[float, float]) -> tuple[float, float]:
    """Room to the left and to the right of a panel."""
    left = _EDGE + LONG + 3.0
    left += max((text_width(tick.text, TICK) for tick in y_ticks), default=0.0)
    lines = _name_lines(panel.y_label, span[1] - span[0] + 2.0 * _BETWEEN)
    if lines:
        left += 4.0 + _LINE * len(lines)
    beside = [lv.label for lv in panel.levels if len(lv.label) <= LONGEST_BESIDE]
    right = 6.0 + max((text_width(label, LEVEL) for label in beside), default=8.0)
    ends = [label for bars in panel.bars for label in bars.labels] if panel.categories else []
    right = max(right, max((text_width(label, TICK) for label in ends), default=0.0))
    return left, right


def _across(chart: Chart, sides: list[_Room]) -> list[tuple[float, float]]:
    """Left and right of each panel's axes."""
    if not chart.beside:
        left, right = max(s.left for s in sides), max(s.right for s in sides)
        return [(left, _WIDTH - right)] * len(sides)
    free = (_WIDTH - sum(s.left + s.right for s in sides)) / len(sides)
    found, at = [], 0.0
    for side in sides:
        found.append((at + side.left, at + side.left + free))
        at += side.left + free + side.right
    return found


def _around(drawing: Drawing, chart: Chart, frame: Frame) -> None:
    """Write what stands outside of a panel's axes."""
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
    x = left - LONG - 3.0 - (widest if frame.y_named else 0.0) - 4.0
    if not chart.beside:
        x = _EDGE + _LINE * max(1, len(_name_lines(panel.y_label, _tall(frame))))
    lines = _name_lines(panel.y_label, _tall(frame))
    for j, line in enumerate(lines):
        place = (x - _LINE * (len(lines) - j - 0.5), 0.5 * (top + bottom))
        drawing.text(place, line, AXIS, anchor="middle", turn=-90.0)


def _tall(frame: Frame) -> float:
    return frame.box[3] - frame.box[1] + 2.0 * _BETWEEN


def _write_marks(drawing: Drawing, chart: Chart, frame: Frame, above: float) -> float:
    """Name the marks above the axes, one above the other where they are close."""
    left, _, right, _ = frame.box
    rows = _mark_rows(chart, frame.x)
    shares = frame.x.share([mark.x for mark in chart.marks]).tolist()
    for mark, share, row in zip(chart.marks, shares, rows, strict=True):
        side = label_side(share, mark.label, _letter(chart))
        anchor = {"left": "start", "center": "middle", "right": "end"}[side]
        at = (left + share * (right - left), above - _ROW * (row + 0.5))
        drawing.text(at, mark.label, LEVEL, RED, anchor=anchor)
    return above - _ROW * (1 + max(rows))


def _power(power: int) -> str:
    return "10" + str(power).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))

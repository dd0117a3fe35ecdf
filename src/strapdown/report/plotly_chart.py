"""Charts for a page as plotly figures in plain data, without loading plotly itself."""

from __future__ import annotations

import html
import math
from typing import Any

import numpy as np

from strapdown.report.chart import (
    Array,
    Bars,
    Chart,
    Fill,
    Line,
    Mark,
    Panel,
    runs,
    short_span,
    steady_range,
    strip_range,
)
from strapdown.report.path_marks import LONGEST_BESIDE, label_rows, label_side

__all__ = ["bar_labels", "bar_traces", "fill_traces", "numbers", "see_through"]


_GRID, _RED, _INK, _FAINT = "#e6e9ed", "#b42318", "#1b1f24", "#8a939e"
FONT = {"family": "Inter, Segoe UI, Helvetica, Arial, sans-serif", "size": 13, "color": _INK}
LOOK = {"font": FONT, "paper_bgcolor": "#ffffff", "plot_bgcolor": "#ffffff"}
_LETTER = 0.008  # width of a letter of a mark's name, as a share of the axis
_ROW = 30  # pixels per category
_UNDER_PLANE = 58  # pixels
_SPACE = {False: 0.06, True: 0.09}  # between panels, above or beside each other


def figure(chart: Chart) -> dict[str, Any]:
    """Return the data and layout of a chart.

    Parameters
    ----------
    chart : Chart

    Returns
    -------
    dict
        For ``Plotly.newPlot``. Names are escaped, because plotly interprets some HTML in them.
    """
    count = len(chart.panels)
    # Planes come first and have their own horizontal axes; the other panels share one.
    planes = sum(bool(panel.x_label) for panel in chart.panels)
    layout: dict[str, Any] = {
        **LOOK,
        "margin": {"l": 70, "r": 18, "t": 34, "b": 54},
        "height": _height(chart),
        "hovermode": "closest" if chart.log_x or planes else "x unified",
        # No thousands separators: axis values may be time stamps.
        "separators": ".",
        "legend": {"orientation": "h", "y": 1.0, "yanchor": "bottom", "x": 0},
        "shapes": [],
        "annotations": [],
    }
    if chart.marks or any(panel.title for panel in chart.panels):
        # The panel titles or the names of marks occupy the usual position of the legend.
        layout["legend"] |= {"y": -60.0 / layout["height"] - 0.06, "yanchor": "top"}
    traces: list[dict[str, Any]] = []
    named: set[str] = set()
    domains = _domains(chart)
    rows = 0
    longest = max((len(v.label) for p in chart.panels for v in p.levels), default=0)
    if 0 < longest <= LONGEST_BESIDE:
        layout["margin"]["r"] = 14 + 6 * longest
    for number, panel in enumerate(chart.panels):
        suffix = _suffix(number)
        own = chart.beside or number < planes
        x_suffix = suffix if own else _suffix(planes)
        across, domain = domains[number]
        layout[f"yaxis{suffix}"] = _y_axis(panel, domain) | {"anchor": f"x{x_suffix}"}
        if own or number == planes:
            anchor = f"y{suffix if own else _suffix(count - 1)}"
            layout[f"xaxis{x_suffix}"] = _x_axis(chart, across, panel) | {"anchor": anchor}
            if chart.beside and number:
                # Panels side by side are to be compared.
                layout[f"xaxis{x_suffix}"]["matches"] = "x"
                if not panel.categories:
                    layout[f"yaxis{suffix}"]["matches"] = "y"
            if not panel.x_label:
                rows = _mark(layout, chart, x_suffix, domain[1])
                # A title is above the labels of marks.
                beyond = rows if panel.title else rows - 1
                layout["margin"]["t"] += max(0, 15 * beyond)
        if panel.x_label:
            layout[f"yaxis{suffix}"] |= {
                "scaleanchor": f"x{x_suffix}",
                "scaleratio": 1,
                "exponentformat": "none",
            }
        lifted = 6 + (15 * rows if number == planes else 0)
        _decorate(layout, panel, f"x{x_suffix}", f"y{suffix}", chart.log_x, lifted)
        axes = (f"x{x_suffix}", f"y{suffix}")
        traces += fill_traces(panel, axes, named)
        traces += bar_traces(panel, axes, named)
        traces += _traces(panel, *axes, named)
    if any(panel.bars for panel in chart.panels):
        layout["barmode"] = "overlay"
        layout["hovermode"] = "closest"
    layout["showlegend"] = any(trace["showlegend"] for trace in traces)
    return {"data": traces, "layout": layout}


def _height(chart: Chart) -> int:
    rows = min(len(panel.categories) for panel in chart.panels)
    if rows:
        return 150 + _ROW * max(len(panel.categories) for panel in chart.panels)
    if chart.beside:
        return 440
    if len(chart.panels) == 1 and not chart.panels[0].x_label:
        return 400
    return 150 + round(190 * sum(panel.height for panel in chart.panels))


def _suffix(number: int) -> str:
    """Plotly's suffix for the axis names of a panel."""
    return str(number + 1) if number else ""


def _domains(chart: Chart) -> list[tuple[tuple[float, float], tuple[float, float]]]:
    """Horizontal and vertical extent of each panel, as shares of the whole."""
    count, space = len(chart.panels), _SPACE[chart.beside]
    if chart.beside or count == 1:
        width = (1.0 - space * (count - 1)) / count
        starts = [number * (width + space) for number in range(count)]
        return [((start, min(1.0, start + width)), (0.0, 1.0)) for start in starts]
    planes = [bool(panel.x_label) for panel in chart.panels]
    # Low panels are closer together; below a plane is its own axis with its title.
    least = min(panel.height for panel in chart.panels)
    gaps = [_UNDER_PLANE / _height(chart) if own else space * least for own in planes[:-1]]
    length = (1.0 - sum(gaps)) / sum(panel.height for panel in chart.panels)
    found, top = [], 1.0
    for panel, gap in zip(chart.panels, [*gaps, 0.0], strict=True):
        bottom = max(0.0, top - length * panel.height)
        found.append(((0.0, 1.0), (bottom, top)))
        top = bottom - gap
    return found


def _log_ticks(values: Array, most: float = 30.0) -> dict[str, Any]:
    """Labels at powers of ten, or at 1, 2 and 5 where those would be too few."""
    return {
        "type": "log",
        "tickformat": "~g",
        "dtick": "D2" if short_span(values, most) else 1,
    }


def _all(lines: tuple[Line, ...], what: str) -> Array:
    found = [getattr(line, what) for line in lines]
    return np.concatenate([v for v in found if v is not None] or [np.empty(0)])


def _x_axis(chart: Chart, domain: tuple[float, float], panel: Panel) -> dict[str, Any]:
    label = html.escape(panel.x_label or chart.x_label)
    axis: dict[str, Any] = {
        "title": {"text": label, "font": {"size": 13}, "standoff": 8},
        "gridcolor": _GRID,
        "zeroline": False,
        "domain": list(domain),
        # Time stamps and meters with all their digits.
        "exponentformat": "none",
    }
    if panel.bars and panel.categories:
        axis |= {"zeroline": True, "zerolinecolor": _INK, "zerolinewidth": 1}
    if panel.x_step:
        axis["dtick"] = panel.x_step
    if (ends := strip_range(chart)) is not None:
        axis["range"] = list(ends)
    if panel.x_label or not chart.log_x:
        return axis
    values = [_all(p.lines, what) for p in chart.panels for what in ("x", "low", "high")]
    marks = np.array([mark.x for mark in chart.marks])
    # A row of labels has room for those of two powers of ten.
    return axis | _log_ticks(np.concatenate([*values, marks]), most=100.0)


def _y_axis(panel: Panel, domain: tuple[float, float]) -> dict[str, Any]:
    axis: dict[str, Any] = {
        "title": {"text": html.escape(panel.y_label), "font": {"size": 13}},
        "gridcolor": _GRID,
        "zeroline": False,
        "domain": list(domain),
        "type": "linear",
    }
    if panel.bars and not panel.categories:
        axis |= {"zeroline": True, "zerolinecolor": _INK, "zerolinewidth": 1}
    if panel.categories:
        last = len(panel.categories) - 0.5
        return axis | {
            "tickvals": list(range(len(panel.categories))),
            "ticktext": [html.escape(name) for name in panel.categories],
            "range": [last, -0.5],
            "automargin": True,
        }
    if panel.log:
        levels = np.array([level.y for level in panel.levels])
        ends_of_fills = [v for fill in panel.fills for v in (fill.low, fill.high)]
        return axis | _log_ticks(np.concatenate([_all(panel.lines, "y"), levels, *ends_of_fills]))
    if panel.step:
        axis["dtick"] = panel.step
    if (ends := steady_range(panel)) is not None:
        return axis | {"range": list(ends)}
    return axis


def _mark(layout: dict[str, Any], chart: Chart, suffix: str, top: float) -> int:
    """Draw the marks and bands of a horizontal axis; return the number of rows of their names."""
    axis = f"x{suffix}"
    for band in chart.bands:
        layout["shapes"].append(
            _upright("rect", axis, band.start, band.end, top)
            | {"fillcolor": "#0072B2", "opacity": 0.07, "line": {"width": 0}}
        )
    shares = _shares(chart)
    rows = label_rows(shares, [mark.label for mark in chart.marks], _LETTER)
    for mark, share, row in zip(chart.marks, shares, rows, strict=True):
        layout["shapes"].append(
            _upright("line", axis, mark.x, mark.x, top)
            | {"line": {"width": 1.4, "color": _RED, "dash": "dot"}}
        )
        side = label_side(share, mark.label, _LETTER)
        place = {"yshift": 1 + 15 * row, "xanchor": side}
        layout["annotations"].append(_mark_label(mark, axis, chart.log_x, top) | place)
    return 1 + max(rows, default=-1)


def _shares(chart: Chart) -> list[float]:
    """Position of each mark on the horizontal axis, as a share of the drawn range."""
    panels = [panel for panel in chart.panels if not panel.x_label]
    drawn = [
        x for p in panels for x in (*(v.x for v in p.lines), *(v.x for v in p.fills)) if x.size
    ]
    marks = np.array([mark.x for mark in chart.marks])
    found = np.concatenate([*drawn, marks])
    ends = np.array([np.nanmin(found), np.nanmax(found)]) if found.size else np.array([0.0, 1.0])
    if chart.log_x:
        marks, ends = np.log10(marks), np.log10(ends)
    span = max(float(ends[1] - ends[0]), 1e-12)
    return [float(v) for v in (marks - ends[0]) / span]


def _upright(kind: str, axis: str, x0: float, x1: float, top: float) -> dict[str, Any]:
    edges = {"x0": x0, "x1": x1, "y0": 0, "y1": top}
    return {"type": kind, "xref": axis, "yref": "paper", "layer": "below"} | edges


def _mark_label(mark: Mark, axis: str, log: bool, top: float) -> dict[str, Any]:
    # On a logarithmic axis plotly expects an annotation's position as a logarithm, a shape's not.
    return {
        "x": math.log10(mark.x) if log else mark.x,
        "xref": axis,
        "y": top,
        "yref": "paper",
        "yanchor": "bottom",
        "showarrow": False,
        "text": html.escape(mark.label),
        "font": {"size": 11, "color": _RED},
    }


def _decorate(
    layout: dict[str, Any], panel: Panel, x: str, y: str, log_x: bool, lifted: int
) -> None:
    """Draw a panel's title and its levels."""
    if panel.title:
        layout["annotations"].append(
            {
                "x": 0,
                "xref": f"{x} domain",
                "y": 1,
                "yref": f"{y} domain",
                "xanchor": "left",
                "yanchor": "bottom",
                "yshift": lifted,
                "showarrow": False,
                "text": f"<b>{html.escape(panel.title)}</b>",
            }
        )
    for line in panel.lines:
        layout["annotations"] += _labels(line, x, y, (log_x, panel.log))
    layout["annotations"] += bar_labels(panel, x, y)
    for level in panel.levels:
        layout["shapes"].append(
            {
                "type": "line",
                "xref": f"{x} domain",
                "x0": 0,
                "x1": 1,
                "yref": y,
                "y0": level.y,
                "y1": level.y,
                "line": {"width": 1.4, "color": _RED, "dash": "dash"},
                "layer": "below",
            }
        )
        beside = len(level.label) <= LONGEST_BESIDE
        layout["annotations"].append(
            {
                "x": 1,
                "xref": f"{x} domain",
                "y": math.log10(level.y) if panel.log else level.y,
                "yref": y,
                "xanchor": "left" if beside else "right",
                "yanchor": "middle" if beside else "bottom",
                "showarrow": False,
                "text": html.escape(level.label),
                "font": {"size": 11, "color": _RED},
            }
        )


def _mode(line: Line) -> str:
    if line.points:
        # Points without a size are labels alone.
        return "markers" if line.size else "none"
    return "lines+markers" if line.dots else "lines"


def _labels(line: Line, x: str, y: str, log: tuple[bool, bool]) -> list[dict[str, Any]]:
    """Return point labels as annotations, with a leader line for the more distant ones."""
    found = []
    places = line.places or ((0, 1),) * len(line.labels)
    for at, value, label, (side, rise) in zip(
        line.x.tolist(), line.y.tolist(), line.labels, places, strict=False
    ):
        found.append(
            {
                "x": math.log10(at) if log[0] else at,
                "xref": x,
                "y": math.log10(value) if log[1] else value,
                "yref": y,
                "ax": 10 * side,
                "ay": -15 * rise,
                "xanchor": {-1: "right", 0: "center", 1: "left"}[side],
                "yanchor": "middle",
                "showarrow": True,
                "arrowhead": 0,
                "arrowwidth": 0.7,
                "arrowcolor": _FAINT if abs(rise) > 1 else "rgba(0,0,0,0)",
                "text": html.escape(label),
                "font": {"size": 11},
            }
        )
    return found


def _traces(panel: Panel, x_axis: str, y_axis: str, named: set[str]) -> list[dict[str, Any]]:
    out = []
    for line in panel.lines:
        name = html.escape(line.name)
        shown = line.legend and name not in named
        if shown:
            named.add(name)
        trace: dict[str, Any] = {
            "type": "scatter",
            "mode": _mode(line),
            "name": name,
            "legendgroup": name,
            "showlegend": shown,
            "x": numbers(line.x, 9),
            "y": numbers(line.y, 6),
            "xaxis": x_axis,
            "yaxis": y_axis,
            "line": {"color": line.colour, "width": line.width, "dash": line.dash},
            "marker": {
                "color": line.colour,
                "size": line.size,
                "symbol": line.symbol + ("-open" if line.hollow else ""),
            },
        }
        if line.hollow:
            trace["marker"]["line"] = {"width": 1.8}
        if line.inside:
            trace |= {"fill": "toself", "fillcolor": see_through(line.colour, line.inside)}
        if panel.categories:
            trace["hovertemplate"] = f"%{{x:.3g}}<extra>{name}</extra>"
        if line.low is not None and line.high is not None:
            trace["error_x"] = {
                "type": "data",
                "symmetric": False,
                "array": numbers(line.high - line.x, 6),
                "arrayminus": numbers(line.x - line.low, 6),
                "thickness": 1.6,
                "width": 5,
            }
        out.append(trace)
    return out


# Areas of a page's chart: bands between curves, and bars.


Axes = tuple[str, str]


def see_through(colour: str, opacity: float) -> str:
    """A color such as ``#0072B2`` with an opacity, in CSS notation."""
    red, green, blue = (int(colour[k : k + 2], 16) for k in (1, 3, 5))
    return f"rgba({red},{green},{blue},{opacity:g})"


def fill_traces(panel: Panel, axes: Axes, named: set[str]) -> list[dict[str, Any]]:
    """Return the bands of a panel, which are below its lines.

    Parameters
    ----------
    panel : Panel
    axes : (str, str)
        Names of the horizontal and the vertical axis.
    named : set of str
        Names already in the legend; extended here.

    Returns
    -------
    list of dict
    """
    lines = {line.name for line in panel.lines if line.legend}
    return [_fill_trace(fill, axes, named, fill.name in lines) for fill in panel.fills]


def _fill_trace(fill: Fill, axes: Axes, named: set[str], has_line: bool) -> dict[str, Any]:
    name = html.escape(fill.name)
    shown = fill.legend and not has_line and name not in named
    if shown:
        named.add(name)
    x: list[float | None] = []
    y: list[float | None] = []
    for run in runs(fill.x, fill.low, fill.high):
        there = fill.x[run]
        # Forward along the low curve, back along the high one; None separates polygons.
        x += [*numbers(np.concatenate([there, there[::-1]]), 9), None]
        y += [*numbers(np.concatenate([fill.low[run], fill.high[run][::-1]]), 6), None]
    return {
        "type": "scatter",
        "mode": "lines",
        "name": name,
        "legendgroup": name,
        "showlegend": shown,
        "x": x[:-1],
        "y": y[:-1],
        "xaxis": axes[0],
        "yaxis": axes[1],
        "line": {"width": 0, "color": fill.colour},
        "fill": "toself",
        "fillcolor": see_through(fill.colour, fill.opacity),
        "hoverinfo": "skip",
    }


def bar_traces(panel: Panel, axes: Axes, named: set[str]) -> list[dict[str, Any]]:
    """Return the bars of a panel.

    Parameters
    ----------
    panel : Panel
    axes : (str, str)
    named : set of str
        Names already in the legend; extended here.

    Returns
    -------
    list of dict
    """
    return [_bar_trace(bars, axes, named, bool(panel.categories)) for bars in panel.bars]


def _bar_trace(bars: Bars, axes: Axes, named: set[str], across: bool) -> dict[str, Any]:
    name = html.escape(bars.name)
    shown = bars.legend and name not in named
    if shown:
        named.add(name)
    start = np.zeros_like(bars.values) if bars.start is None else bars.start
    length, places = numbers(bars.values - start, 6), numbers(bars.at, 9)
    x, y = (length, places) if across else (places, length)
    end = [f"{value:.3g}" for value in bars.values.tolist()]
    trace: dict[str, Any] = {
        "type": "bar",
        "orientation": "h" if across else "v",
        "name": name,
        "legendgroup": name,
        "showlegend": shown,
        "x": x,
        "y": y,
        "base": numbers(start, 6),
        "width": bars.width,
        "xaxis": axes[0],
        "yaxis": axes[1],
        "marker": {"color": bars.colour, "line": {"width": 0}},
        "customdata": end,
        "hovertemplate": f"%{{customdata}}<extra>{name}</extra>",
    }
    if bars.pattern:
        trace["marker"]["pattern"] = {"shape": bars.pattern, "fgcolor": "#ffffff", "solidity": 0.25}
    return trace


def bar_labels(panel: Panel, x: str, y: str) -> list[dict[str, Any]]:
    """Return the labels at the ends of the bars of a panel."""
    across, found = bool(panel.categories), []
    for bars in panel.bars:
        start = np.zeros_like(bars.values) if bars.start is None else bars.start
        for at, end, begin, label in zip(
            bars.at.tolist(), bars.values.tolist(), start.tolist(), bars.labels, strict=False
        ):
            back = end < begin
            place: dict[str, Any] = (
                {"x": end, "y": at, "yanchor": "middle"}
                | ({"xanchor": "right", "xshift": -5} if back else {"xanchor": "left", "xshift": 5})
                if across
                else {"x": at, "y": end, "xanchor": "center"}
                | ({"yanchor": "top"} if back else {"yanchor": "bottom"})
            )
            style = {"showarrow": False, "text": html.escape(label), "font": {"size": 11}}
            found.append(place | {"xref": x, "yref": y} | style)
    return found


# Numbers in plotly's form.


def numbers(values: Array, digits: int) -> list[float | None]:
    """Round to significant digits; NaN becomes None, which breaks a line."""
    return [None if math.isnan(v) else float(f"{v:.{digits}g}") for v in values.tolist()]

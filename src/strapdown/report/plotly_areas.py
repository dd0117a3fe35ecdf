"""What a page's chart shows as areas: bands between curves, and bars."""

from __future__ import annotations

import html
from typing import Any

import numpy as np

from strapdown.report.chart import Bars, Fill, Panel, runs
from strapdown.report.plotly_numbers import numbers

__all__ = ["bar_labels", "bar_traces", "fill_traces", "see_through"]

_LAST = 1001  # after the lines' entries of the legend
Axes = tuple[str, str]


def see_through(colour: str, opacity: float) -> str:
    """A colour such as ``#0072B2`` with an opacity, as CSS writes it."""
    red, green, blue = (int(colour[k : k + 2], 16) for k in (1, 3, 5))
    return f"rgba({red},{green},{blue},{opacity:g})"


def fill_traces(panel: Panel, axes: Axes, named: set[str]) -> list[dict[str, Any]]:
    """Return the bands of a panel, which lie below its lines.

    Parameters
    ----------
    panel : Panel
    axes : (str, str)
        Names of the horizontal and the vertical axis.
    named : set of str
        What the legend names already; added to.

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
        # There along the low curve, back along the high one; None parts it from the next.
        x += [*numbers(np.concatenate([there, there[::-1]]), 9), None]
        y += [*numbers(np.concatenate([fill.low[run], fill.high[run][::-1]]), 6), None]
    return {
        "type": "scatter",
        "mode": "lines",
        "name": name,
        "legendgroup": name,
        "legendrank": _LAST,
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
        What the legend names already; added to.

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
    """Return what stands at the ends of the bars of a panel."""
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

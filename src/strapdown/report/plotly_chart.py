"""Charts for a page: plotly's figure as plain data, without loading plotly itself."""

from __future__ import annotations

import html
from typing import Any

import numpy as np

from strapdown.report.chart import Array, Chart, Panel

_GRID = "#e6e9ed"
_FONT = {"family": "Inter, Segoe UI, Helvetica, Arial, sans-serif", "size": 13, "color": "#1b1f24"}


def figure(chart: Chart) -> dict[str, Any]:
    """Return the data and layout of a chart.

    Parameters
    ----------
    chart : Chart

    Returns
    -------
    dict
        For ``Plotly.newPlot``. Names are escaped, because plotly reads some HTML in them.
    """
    count = len(chart.panels)
    gap = 0.06
    height = (1.0 - gap * (count - 1)) / count
    layout: dict[str, Any] = {
        "font": _FONT,
        "paper_bgcolor": "#ffffff",
        "plot_bgcolor": "#ffffff",
        "margin": {"l": 70, "r": 18, "t": 34, "b": 46},
        "height": 150 + 190 * count if count > 1 else 380,
        "hovermode": "x unified",
        "legend": {"orientation": "h", "y": 1.0, "yanchor": "bottom", "x": 0},
        "xaxis": {
            "title": {"text": html.escape(chart.x_label)},
            "gridcolor": _GRID,
            "zeroline": False,
            "anchor": "y" if count == 1 else f"y{count}",
            "type": "log" if chart.log_x else "linear",
        },
        "shapes": [],
        "annotations": [],
    }
    traces: list[dict[str, Any]] = []
    shown: set[str] = set()
    for number, panel in enumerate(chart.panels):
        top = 1.0 - number * (height + gap)
        suffix = "" if number == 0 else str(number + 1)
        layout[f"yaxis{suffix}"] = _axis(panel, (max(0.0, top - height), top))
        traces += _traces(panel, f"y{suffix}", shown)
    for band in chart.bands:
        layout["shapes"].append(
            _shape("rect", band.start, band.end, fillcolor="#0072B2", opacity=0.07, line_width=0)
        )
    for mark in chart.marks:
        layout["shapes"].append(_shape("line", mark.x, mark.x, line_width=1.4))
        layout["annotations"].append(
            {
                # On a logarithmic axis shapes take the value and labels its logarithm.
                "x": float(np.log10(mark.x)) if chart.log_x else mark.x,
                "y": 1.0,
                "yref": "paper",
                "yanchor": "top",
                "xanchor": "left",
                "showarrow": False,
                "text": html.escape(mark.label),
                "font": {"size": 11, "color": "#b42318"},
                "bgcolor": "rgba(255,255,255,0.8)",
            }
        )
    return {"data": traces, "layout": layout}


def _axis(panel: Panel, domain: tuple[float, float]) -> dict[str, Any]:
    return {
        "title": {"text": html.escape(panel.y_label)},
        "gridcolor": _GRID,
        "zeroline": False,
        "domain": list(domain),
        "type": "log" if panel.log else "linear",
    } | ({"exponentformat": "power", "dtick": _decades(panel)} if panel.log else {})


def _decades(panel: Panel) -> int:
    """Decades from one tick to the next, so that there are seven at most."""
    values = np.concatenate([line.y for line in panel.lines])
    values = values[np.isfinite(values) & (values > 0.0)]
    if not values.size:
        return 1
    return max(1, int(np.ceil(np.log10(values.max() / values.min()) / 7.0)))


def _shape(kind: str, x0: float, x1: float, **style: Any) -> dict[str, Any]:
    width = style.pop("line_width")
    return {
        "type": kind,
        "xref": "x",
        "yref": "paper",
        "x0": x0,
        "x1": x1,
        "y0": 0,
        "y1": 1,
        "line": {"width": width, "color": "#b42318", "dash": "dot"},
        "layer": "below",
    } | style


def _traces(panel: Panel, axis: str, shown: set[str]) -> list[dict[str, Any]]:
    """Traces of a panel; a name stands in the legend once, and is added to `shown`."""
    out = []
    for line in panel.lines:
        out.append(
            {
                "type": "scatter",
                "mode": "markers" if line.points else "lines",
                "name": html.escape(line.name),
                "legendgroup": html.escape(line.name),
                "showlegend": line.name not in shown,
                "x": _numbers(line.x, 9),
                "y": _numbers(line.y, 6),
                "xaxis": "x",
                "yaxis": axis,
                "line": {"color": line.colour, "width": line.width, "dash": line.dash},
                "marker": {"color": line.colour, "size": 9, "symbol": "diamond"},
            }
        )
        shown.add(line.name)
    return out


def _numbers(values: Array, digits: int) -> list[float | None]:
    """Numbers to so many significant digits; None, which breaks a line, for NaN."""
    return [None if np.isnan(v) else float(f"{v:.{digits}g}") for v in values.tolist()]

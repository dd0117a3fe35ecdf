"""What a picture's chart shows as areas: bands between curves, outlines filled, and bars."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from strapdown.report.chart import Bars, Fill, Line, Panel, runs

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["draw_bars", "draw_fills", "fill_outline", "set_ticks"]

_INK = "#1b1f24"
# Matplotlib's patterns are sparse where plotly's are dense.
_PATTERN = {"": "", ".": ".."}


def draw_fills(panel: Panel, axis: Axes) -> None:
    """Draw the bands of a panel, below its lines."""
    for fill in panel.fills:
        _draw_fill(fill, axis)


def _draw_fill(fill: Fill, axis: Axes) -> None:
    whole = np.zeros(fill.x.size, dtype=np.bool_)
    for run in runs(fill.x, fill.low, fill.high):
        whole[run] = True
    axis.fill_between(
        fill.x,
        fill.low,
        fill.high,
        where=whole.tolist(),
        color=fill.colour,
        alpha=fill.opacity,
        lw=0,
        label=fill.name if fill.legend else "_",
    )


def fill_outline(line: Line, axis: Axes) -> None:
    """Fill the inside of a closed outline, or of several."""
    for run in runs(line.x, line.y):
        axis.fill(line.x[run], line.y[run], color=line.colour, alpha=line.inside, lw=0)


def draw_bars(panel: Panel, axis: Axes) -> None:
    """Draw the bars of a panel: across if it has categories, else upright."""
    for bars in panel.bars:
        _draw_bars(bars, axis, bool(panel.categories))
    if panel.bars and panel.categories:
        axis.axvline(0.0, color=_INK, lw=0.8)
        axis.grid(visible=False, axis="y")
        axis.margins(x=0.12)
    elif panel.bars:
        axis.axhline(0.0, color=_INK, lw=0.8)
        axis.margins(y=0.12)


def _draw_bars(bars: Bars, axis: Axes, across: bool) -> None:
    start = np.zeros_like(bars.values) if bars.start is None else bars.start
    style: dict[str, Any] = {
        "color": bars.colour,
        "label": bars.name if bars.legend else "_",
        "lw": 0,
    }
    if bars.pattern:
        style |= {"hatch": _PATTERN.get(bars.pattern, 2 * bars.pattern), "edgecolor": "#ffffff"}
    if across:
        axis.barh(bars.at, bars.values - start, bars.width, left=start, **style)
    else:
        axis.bar(bars.at, bars.values - start, bars.width, bottom=start, **style)
    for at, end, begin, label in zip(bars.at, bars.values, start, bars.labels, strict=False):
        side = -1 if end < begin else 1
        axis.annotate(
            label,
            (end, at) if across else (at, end),
            xytext=(4 * side, 0) if across else (0, 3 * side),
            textcoords="offset points",
            fontsize=7.5,
            color=_INK,
            ha=("left" if side > 0 else "right") if across else "center",
            va="center" if across else ("bottom" if side > 0 else "top"),
        )


def set_ticks(panel: Panel, axis: Axes) -> None:
    """Set ticks at equal steps where a panel asks for it."""
    from matplotlib.ticker import MultipleLocator

    if panel.step:
        axis.yaxis.set_major_locator(MultipleLocator(panel.step))
    if panel.x_step:
        axis.xaxis.set_major_locator(MultipleLocator(panel.x_step))

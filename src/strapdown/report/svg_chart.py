"""Charts as pictures: SVG and PNG, the same bytes every time, or a figure for a notebook."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from textwrap import fill as wrapped
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine

from strapdown.report.chart import Bars, Chart, Fill, Line, Panel, runs, steady_range, strip_range
from strapdown.report.path_marks import LONGEST_BESIDE, label_rows, label_side

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis

__all__ = ["RoundedLayout", "draw_bars", "draw_fills", "fill_outline", "set_ticks"]


_RED, _FAINT, _TEXT = "#b42318", "#8a939e", "#4a525c"
_DASH: dict[str, Any] = {
    "solid": "-",
    "dash": "--",
    "dot": ":",
    "dashdot": "-.",
    "longdash": (0, (8, 3)),
}
_MARKER = {
    "circle": "o",
    "square": "s",
    "diamond": "D",
    "triangle-up": "^",
    "triangle-down": "v",
    "cross": "P",
    "x": "X",
    "star": "*",
    "pentagon": "p",
}
_STYLE: Any = {
    "svg.hashsalt": "strapdown",
    "svg.fonttype": "path",
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#e6e9ed",
    "axes.axisbelow": True,
    "text.parse_math": False,
}
_WIDTH = 9.0  # inches
_DPI = 160
_MARK = 7.0  # points, font size of the names of marks and levels
_TITLE, _CAPTION = 90, 155  # characters per line


def draw(chart: Chart, path: Path, *, caption: bool = False) -> None:
    """Draw a chart into an SVG or a PNG file, by its extension.

    Parameters
    ----------
    chart : Chart
    path : Path
    caption : bool
        Whether to write the caption in the picture, for use without a page.
    """
    with _own_style():
        figure = _figure(chart, caption)
        if path.suffix == ".png":
            figure.savefig(path, format="png", dpi=_DPI, metadata={"Software": None})
        else:
            figure.savefig(path, format="svg", metadata={"Date": None, "Creator": "strapdown"})


def notebook_figure(chart: Chart) -> Figure:
    """Return a chart as a figure that belongs to no window and no global state.

    Parameters
    ----------
    chart : Chart

    Returns
    -------
    matplotlib.figure.Figure
        Displays itself in a notebook; `savefig` writes it.
    """
    with _own_style():
        return _figure(chart)


@contextmanager
def _own_style() -> Iterator[None]:
    """Use a fixed style instead of the user's, because the picture is sealed."""
    import matplotlib as mpl

    with mpl.rc_context(), warnings.catch_warnings():
        # A character that the font lacks, in a user's name, is drawn as a box.
        warnings.filterwarnings("ignore", "Glyph .* missing from font")
        mpl.rcdefaults()
        mpl.rcParams.update(_STYLE)
        yield


def _figure(chart: Chart, caption: bool = False) -> Figure:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    class Picture(Figure):
        """Display itself in a notebook where pyplot was never loaded."""

        def _repr_png_(self) -> bytes:
            from io import BytesIO

            with _own_style(), BytesIO() as stream:
                self.savefig(stream, format="png", dpi=_DPI)
                return stream.getvalue()

        def draw(self, renderer: Any) -> None:
            engine = self.get_layout_engine()
            if isinstance(engine, RoundedLayout) and self.canvas.is_saving():
                # Saving first draws only for the layout, and then removes the layout engine.
                engine.execute(self)
                return
            super().draw(renderer)

    figure = Picture(figsize=(_WIDTH, _height(chart)), layout=RoundedLayout())
    FigureCanvasAgg(figure)
    axes = _axes(chart, figure)
    for panel, axis in zip(chart.panels, axes, strict=True):
        _draw_panel(panel, axis, chart)
    for axis in axes if chart.beside else axes[-1:]:
        if not chart.panels[-1].x_label:
            axis.set_xlabel(chart.x_label)
    timed = [a for p, a in zip(chart.panels, axes, strict=True) if not p.x_label]
    if timed:
        _label_marks(chart, timed[0])
    figure.suptitle(wrapped(chart.title, _TITLE), x=0.01, ha="left", fontweight="bold")
    entries: dict[str, Any] = {}
    for axis in axes:
        for handle, label in zip(*axis.get_legend_handles_labels(), strict=True):
            entries.setdefault(label, handle)
    if entries or caption:
        widest = max(map(len, entries), default=0)
        columns = max(1, min(6, 110 // (widest + 7)))
        legend = figure.legend(
            list(entries.values()),
            list(entries),
            loc="outside lower left",
            ncols=columns,
            frameon=False,
            # Only a legend gets space below the panels, so the caption is its title.
            title=wrapped(chart.caption, _CAPTION) if caption else None,
            title_fontsize=8,
            alignment="left" if caption else "center",
        )
        legend.get_title().set_color(_TEXT)
    return figure


def _axes(chart: Chart, figure: Figure) -> list[Axes]:
    count = len(chart.panels)
    if chart.beside:
        share_y = not any(panel.categories for panel in chart.panels)
        return list(figure.subplots(1, count, sharex=True, sharey=share_y, squeeze=False).ravel())
    planes = sum(bool(panel.x_label) for panel in chart.panels)
    if not planes:
        heights = [panel.height for panel in chart.panels]
        return list(
            figure.subplots(count, 1, sharex=True, squeeze=False, height_ratios=heights).ravel()
        )
    grid = figure.add_gridspec(count, 1, height_ratios=[panel.height for panel in chart.panels])
    axes: list[Axes] = []
    for row in range(count):
        axes.append(figure.add_subplot(grid[row], sharex=axes[planes] if row > planes else None))
        if planes <= row < count - 1:
            axes[row].tick_params(labelbottom=False)
    figure.align_ylabels(axes)
    return axes


def _height(chart: Chart) -> float:
    if min(len(panel.categories) for panel in chart.panels):
        return 1.5 + 0.3 * max(len(panel.categories) for panel in chart.panels)
    if chart.beside:
        return 4.6
    return 1.4 + 2.0 * sum(panel.height for panel in chart.panels) + (len(chart.panels) == 1)


def _label_marks(chart: Chart, axis: Axes) -> None:
    """Name the marks above the first axes, one above the other where they are close."""
    from matplotlib.transforms import blended_transform_factory

    if not chart.marks:
        return
    shares = axis.transLimits.transform(
        axis.transScale.transform([(mark.x, 1.0) for mark in chart.marks])
    )[:, 0]
    letter = 0.56 * _MARK / (72.0 * 0.87 * _WIDTH)
    rows = label_rows(shares.tolist(), [mark.label for mark in chart.marks], letter)
    across = blended_transform_factory(axis.transData, axis.transAxes)
    for mark, share, row in zip(chart.marks, shares.tolist(), rows, strict=True):
        axis.annotate(
            mark.label,
            (mark.x, 1.0),
            xycoords=across,
            xytext=(0, 2 + (_MARK + 1.5) * row),
            textcoords="offset points",
            color=_RED,
            fontsize=_MARK,
            va="bottom",
            ha=label_side(share, mark.label, letter),
            annotation_clip=False,
        )
    if title := axis.get_title(loc="left"):
        # The panel's title moves up.
        pad = 6.0 + (_MARK + 1.5) * (1 + max(rows))
        axis.set_title(title, loc="left", fontsize=9, fontweight="bold", pad=pad)


def _draw_panel(panel: Panel, axis: Axes, chart: Chart) -> None:
    draw_fills(panel, axis)
    draw_bars(panel, axis)
    for line in panel.lines:
        _draw_line(line, axis)
    if chart.log_x:
        axis.set_xscale("log")
        _plain_labels(axis.xaxis, most=100.0)
    if panel.log:
        axis.set_yscale("log")
        _plain_labels(axis.yaxis)
    if panel.categories:
        axis.set_yticks(range(len(panel.categories)), panel.categories)
        axis.set_ylim(len(panel.categories) - 0.5, -0.5)
    axis.set_ylabel(panel.y_label)
    if panel.title:
        axis.set_title(panel.title, loc="left", fontsize=9, fontweight="bold")
    for level in panel.levels:
        axis.axhline(level.y, color=_RED, ls="--", lw=1.2, zorder=1.5)
        beside = len(level.label) <= LONGEST_BESIDE
        axis.annotate(
            level.label,
            (1.0, level.y),
            xycoords=("axes fraction", "data"),
            xytext=(3, 0) if beside else (0, 2),
            textcoords="offset points",
            color=_RED,
            fontsize=_MARK,
            ha="left" if beside else "right",
            va="center" if beside else "baseline",
        )
    if (ends := steady_range(panel)) is not None:
        axis.set_ylim(*ends)
    set_ticks(panel, axis)
    if panel.steady:
        axis.ticklabel_format(axis="y", useOffset=False)
    if (span := strip_range(chart)) is not None:
        axis.set_xlim(*span)
    if panel.x_label:
        axis.set_xlabel(panel.x_label)
        axis.set_aspect("equal", adjustable="datalim")
        return
    for band in chart.bands:
        axis.axvspan(band.start, band.end, color="#0072B2", alpha=0.07, lw=0)
    for mark in chart.marks:
        axis.axvline(mark.x, color=_RED, ls=":", lw=1.2)


def _draw_line(line: Line, axis: Axes) -> None:
    if line.inside:
        fill_outline(line, axis)
    # Matplotlib omits a name that begins with an underscore from the legend.
    style: dict[str, Any] = {
        "color": line.colour,
        "label": line.name if line.legend else "_",
        "ls": "" if line.points else _DASH[line.dash],
        "lw": line.width,
    }
    if line.points or line.dots:
        style |= {"marker": _MARKER[line.symbol], "ms": 0.6 * line.size}
        if line.hollow:
            style |= {"mfc": "none", "mew": 1.2}
    if line.low is not None and line.high is not None:
        ends = [line.x - line.low, line.high - line.x]
        axis.errorbar(line.x, line.y, xerr=ends, capsize=3, elinewidth=1.3, **style)
    else:
        axis.plot(line.x, line.y, **style)
    places = line.places or ((0, 1),) * len(line.labels)
    for x, y, label, (side, rise) in zip(line.x, line.y, line.labels, places, strict=False):
        axis.annotate(
            label,
            (x, y),
            xytext=(7 * side, 10 * rise),
            textcoords="offset points",
            fontsize=7.5,
            ha={-1: "right", 0: "center", 1: "left"}[side],
            va="center",
            arrowprops={"arrowstyle": "-", "lw": 0.5, "color": _FAINT} if abs(rise) > 1 else None,
        )


def _plain_labels(axis: Axis, most: float = 30.0) -> None:
    """Label a logarithmic axis without math text.

    Matplotlib's own labels are math text, which is switched off for names that contain a dollar
    sign.
    """
    from matplotlib.ticker import FuncFormatter

    def between(value: float, _: int | None) -> str:
        low, high = axis.get_view_interval()
        digit = f"{value:.0e}"[0]
        return f"{value:g}" if high < most * low and digit in "25" else ""

    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(FuncFormatter(between))


# Areas of a picture's chart: bands between curves, filled outlines, and bars.


_INK = "#1b1f24"
# Matplotlib's patterns are sparse where plotly's are dense.
_PATTERN = {"": "", ".": ".."}


def draw_fills(panel: Panel, axis: Axes) -> None:
    """Draw the bands of a panel, below its lines."""
    lines = {line.name for line in panel.lines if line.legend}
    for one in panel.fills:
        _draw_fill(one, axis, one.legend and one.name not in lines)


def _draw_fill(fill: Fill, axis: Axes, named: bool) -> None:
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
        label=fill.name if named else "_",
    )


def fill_outline(line: Line, axis: Axes) -> None:
    """Fill the inside of one or more closed outlines."""
    for run in runs(line.x, line.y):
        axis.fill(line.x[run], line.y[run], color=line.colour, alpha=line.inside, lw=0)


def draw_bars(panel: Panel, axis: Axes) -> None:
    """Draw the bars of a panel: horizontal if it has categories, else upright."""
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
    """Set ticks at equal steps if the panel requests them."""
    from matplotlib.ticker import MultipleLocator

    if panel.step:
        axis.yaxis.set_major_locator(MultipleLocator(panel.step))
    if panel.x_step:
        axis.xaxis.set_major_locator(MultipleLocator(panel.x_step))


# Reproducible layout of a picture. Loads matplotlib.


class RoundedLayout(ConstrainedLayoutEngine):
    """Matplotlib's constrained layout, rounded.

    Its solver sums in the order of memory addresses, so the last bit of a position differs from run
    to run, and with it the names of clips in an SVG, which are hashes.
    """

    def execute(self, fig: Figure) -> None:
        """Position the axes of a figure, to a millionth of its size."""
        super().execute(fig)
        for axes in fig.axes:
            bounds = [round(float(v), 6) for v in axes.get_position(original=True).bounds]
            axes.set_position((bounds[0], bounds[1], bounds[2], bounds[3]), which="original")
            # Axes with a set position are left out of the next layout.
            axes.set_in_layout(True)

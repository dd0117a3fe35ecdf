"""Charts as SVG pictures, the same bytes every time."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from strapdown.report.chart import Chart

_DASH = {"solid": "-", "dash": "--", "dot": ":", "dashdot": "-."}
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


def draw(chart: Chart, path: Path) -> None:
    """Draw a chart into an SVG file.

    Parameters
    ----------
    chart : Chart
    path : Path
    """
    import matplotlib as mpl
    from matplotlib.backends.backend_svg import FigureCanvasSVG
    from matplotlib.figure import Figure
    from matplotlib.ticker import FuncFormatter

    with mpl.rc_context():
        # Not the style of whoever runs it: the picture belongs to the seal.
        mpl.rcdefaults()
        mpl.rcParams.update(_STYLE)
        count = len(chart.panels)
        figure = Figure(figsize=(9.0, 1.4 + 2.0 * count), layout="constrained")
        FigureCanvasSVG(figure)
        axes = figure.subplots(count, 1, sharex=True, squeeze=False)[:, 0]
        for panel, axis in zip(chart.panels, axes, strict=True):
            for line in panel.lines:
                style: dict[str, Any] = {"color": line.colour}
                if line.points:
                    style |= {"ls": "", "marker": "D", "ms": 5}
                else:
                    style |= {"ls": _DASH[line.dash], "lw": line.width}
                axis.plot(line.x, line.y, label=line.name, **style)
            if panel.log:
                axis.set_yscale("log")
                # Matplotlib's own label is mathematics, which is switched off for the sake of
                # names that contain a dollar sign.
                axis.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
            axis.set_ylabel(panel.y_label)
            for band in chart.bands:
                axis.axvspan(band.start, band.end, color="#0072B2", alpha=0.07, lw=0)
            for mark in chart.marks:
                axis.axvline(mark.x, color="#b42318", ls=":", lw=1.2)
        for mark in chart.marks:
            axes[0].annotate(
                mark.label,
                (mark.x, 1.0),
                xycoords=("data", "axes fraction"),
                color="#b42318",
                fontsize=7,
                va="top",
                rotation=90,
                ha="right",
            )
        axes[-1].set_xlabel(chart.x_label)
        if chart.log_x:
            axes[-1].set_xscale("log")
            axes[-1].xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
            axes[-1].xaxis.set_minor_formatter(FuncFormatter(lambda value, _: ""))
        figure.suptitle(chart.title, x=0.01, ha="left", fontweight="bold")
        named: dict[str, Any] = {}
        for axis in axes:
            for handle, label in zip(*axis.get_legend_handles_labels(), strict=True):
                named.setdefault(label, handle)
        figure.legend(
            list(named.values()), list(named), loc="outside lower left", ncols=6, frameon=False
        )
        figure.savefig(path, format="svg", metadata={"Date": None, "Creator": "strapdown"})

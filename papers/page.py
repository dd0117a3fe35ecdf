"""A reproduced paper as files: JSON of its statements and curves, figures, and one page."""

from __future__ import annotations

import argparse
import io
import json
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jinja2
import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure as Canvas
from matplotlib.ticker import FuncFormatter, NullFormatter
from numpy.typing import NDArray

from papers.reproduction import (
    VERDICTS,
    Figure,
    FigurePanel,
    Progress,
    Reproduction,
    Statement,
    Trace,
    amount,
)
from strapdown import __version__

Array = NDArray[np.float64]

# Okabe and Ito's colors, which the color-blind tell apart, and five more that differ from them.
BLUE, ORANGE, GREEN, PURPLE = "#0072B2", "#E69F00", "#009E73", "#CC79A7"
SKY, VERMILLION, BLACK, GREY = "#56B4E9", "#D55E00", "#000000", "#7f7f7f"
_FREE = (
    *(BLUE, ORANGE, GREEN, PURPLE, SKY, VERMILLION),
    *("#7f6000", "#882255", "#332288", "#999933", "#b07aa1"),
)
_PREFERRED = {
    # Attitude algorithms, axes of a gyro, and the recorders of a crash keep their color in every
    # figure.
    "naive": ORANGE,
    "euler": VERMILLION,
    "dcm": GREEN,
    "quaternion": BLUE,
    "gyro x": VERMILLION,
    "gyro y": GREEN,
    "gyro z": BLUE,
    "LAB1": BLUE,
    "LAB2": SKY,
    "IMU1": VERMILLION,
    "IMU2": ORANGE,
    "LAB": BLUE,
    "IMU low-g": ORANGE,
    "IMU high-g": VERMILLION,
    "5 g": SKY,
    "10 g": VERMILLION,
}
_DASHES = ("-", "--", "-.", (0, (8, 2)), (0, (3, 1, 1, 1, 1, 1)))
_MARKERS = "osD^vPX*p<>"
_BUCKETS = 1500
_STYLE: Any = {
    "svg.hashsalt": "strapdown",
    "svg.fonttype": "none",
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#e6e9ed",
    "axes.axisbelow": True,
    "text.parse_math": False,
}


# --- Numbers --------------------------------------------------------------------------------


def reproduction_json(made: Reproduction) -> dict[str, Any]:
    """Return a reproduction as plain data, with every number that is shown.

    Parameters
    ----------
    made : Reproduction

    Returns
    -------
    dict
        Values that are not finite are null.
    """
    return {
        "schema": "strapdown reproduction 1",
        "name": made.name,
        "paper": made.paper,
        "headline": made.headline,
        "verdicts": {verdict: made.count(verdict) for verdict in VERDICTS},
        "statements": [
            {
                "key": s.key,
                "place": s.place,
                "quote": s.quote,
                "verdict": s.verdict,
                "condition": s.condition,
                "because": s.because,
                "evidence": [
                    {"what": e.what, "value": _finite(e.value), "unit": e.unit} for e in s.evidence
                ],
                "figure": s.figure,
            }
            for s in made.statements
        ],
        "tables": [
            {
                "slug": t.slug,
                "title": t.title,
                "columns": t.columns,
                "rows": [
                    {"name": name, "values": [None if v is None else _finite(v) for v in values]}
                    for name, values in t.rows
                ],
            }
            for t in made.tables
        ],
        "figures": [
            {"slug": f.slug, "title": f.title, "parameters": f.parameters} for f in made.figures
        ],
    }


def curves_json(made: Reproduction) -> dict[str, Any]:
    """Return the curves of all figures as plain data, thinned as they are drawn.

    Parameters
    ----------
    made : Reproduction

    Returns
    -------
    dict
        Nine digits; values that are not finite are null.
    """
    return {
        "schema": "strapdown curves 1",
        "figures": [
            {
                "slug": f.slug,
                "x_label": f.x_label,
                "panels": [
                    {"y_label": panel.y_label, "curves": [_curve(t) for t in panel.traces]}
                    for panel in f.panels
                ],
            }
            for f in made.figures
        ],
    }


def _curve(trace: Trace) -> dict[str, Any]:
    x, y = thinned(trace)
    return {"name": trace.name, "x": _rounded(x), "y": _rounded(y)}


def _finite(value: float) -> float | None:
    return float(value) if abs(value) < float("inf") else None


def _rounded(values: Array) -> list[float | None]:
    """Nine digits: enough for a curve, and free of the rounding in the last ones."""
    return [_finite(float(f"{v:.9g}")) for v in values.tolist()]


def thinned(trace: Trace) -> tuple[Array, Array]:
    """Return the least and the greatest of each of 1500 equal runs of samples, in their order."""
    x, y = np.asarray(trace.x, dtype=np.float64), np.asarray(trace.y, dtype=np.float64)
    if trace.points or len(x) <= 2 * _BUCKETS:
        return x, y
    kept: set[int] = {0, len(x) - 1}
    for run in np.array_split(np.arange(len(x)), _BUCKETS):
        broken = run[np.isnan(y[run])]
        whole = run[~np.isnan(y[run])]
        kept.update(broken[:1].tolist())
        if whole.size:
            kept.update((int(whole[y[whole].argmin()]), int(whole[y[whole].argmax()])))
    rows = np.array(sorted(kept))
    return x[rows], y[rows]


# --- Figures --------------------------------------------------------------------------------


def looks(figure: Figure) -> dict[str, tuple[str, Any, str]]:
    """Choose color, dash and marker of each name of a figure.

    Parameters
    ----------
    figure : Figure

    Returns
    -------
    dict of (str, dash, str)
        References are black and dotted, a second one grey. Curves that share a panel, and so a
        legend, differ in color; points that share one differ in their marker as well.
    """
    names = {t.name: t for panel in figure.panels for t in panel.traces}
    chosen: dict[str, tuple[str, Any, str]] = {}
    for name, trace in names.items():
        beside = [
            chosen[t.name]
            for panel in figure.panels
            if any(t.name == name for t in panel.traces)
            for t in panel.traces
            if t.name in chosen
        ]
        colors = {color for color, _, _ in beside}
        dashed = sum(dash != ":" for _, dash, _ in beside)
        marker = next(m for m in _MARKERS if m not in {m for _, _, m in beside})
        if trace.reference:
            color = next(c for c in (BLACK, GREY, *_FREE) if c not in colors)
            chosen[name] = color, ":", marker
            continue
        own = _preferred(name)
        if own is None or own in colors:
            own = next(c for c in _FREE if c not in colors)
        chosen[name] = own, _DASHES[dashed % len(_DASHES)], marker
    return chosen


def _preferred(name: str) -> str | None:
    starts = (name, name.split(",")[0], name.replace(",", " ").replace(":", " ").split()[0])
    return next((_PREFERRED[s] for s in starts if s in _PREFERRED), None)


def svg(figure: Figure) -> str:
    """Draw a figure as SVG, the same text every time."""
    with mpl.rc_context(_STYLE):
        count = len(figure.panels)
        canvas = Canvas(figsize=(9.0, 1.0 + 2.6 * count), layout="constrained")
        axes = canvas.subplots(count, 1, sharex=True, squeeze=False)[:, 0]
        style = looks(figure)
        for ax, panel in zip(axes, figure.panels, strict=True):
            _panel(ax, panel, style)
            if figure.x_log:
                ax.set_xscale("log")
                _plain_ticks(ax.xaxis)
        for k, (x, label) in enumerate(figure.marks):
            for ax in axes:
                ax.axvline(x, color="#b42318", lw=0.8, ls=(0, (2, 2)))
            # Labels of neighbors take turns in height, or they lie on each other.
            axes[0].annotate(
                label,
                (x, 1.0),
                xycoords=("data", "axes fraction"),
                xytext=(2, 3 + 9 * (k % 2)),
                textcoords="offset points",
                fontsize=7,
                color="#b42318",
            )
        axes[-1].set_xlabel(figure.x_label)
        canvas.suptitle(figure.title, fontsize=10)
        text = io.StringIO()
        canvas.savefig(text, format="svg", metadata={"Date": None, "Creator": None})
    return text.getvalue()


def _panel(ax: Any, panel: FigurePanel, style: dict[str, tuple[str, Any, str]]) -> None:
    for trace in panel.traces:
        color, dash, marker = style[trace.name]
        x, y = thinned(trace)
        if trace.points:
            ax.plot(x, y, ls="", marker=marker, ms=5, color=color, label=trace.name)
        else:
            width = 1.2 if trace.reference else 1.6
            ax.plot(x, y, ls=dash, lw=width, color=color, label=trace.name)
    if panel.log:
        ax.set_yscale("log")
        _plain_ticks(ax.yaxis)
    ax.set_ylabel(panel.y_label)
    ax.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False, fontsize=8)


def _plain_ticks(axis: Any) -> None:
    """Numbers in place of powers in mathematical script, which is not parsed here."""
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())


# --- Page and folder ------------------------------------------------------------------------


def verdict_words(statement: Statement) -> str:
    """Return the verdict with its condition."""
    return f"{statement.verdict} {statement.condition}".strip()


def statements_markdown(made: Reproduction) -> str:
    """Return the statements as a table of Markdown: place and quote, verdict, evidence."""
    lines = ["| the paper says | verdict | measured |", "|---|---|---|"]
    for s in made.statements:
        numbers = "; ".join(f"{e.what}: {e.shown}" for e in s.evidence) or "–"
        cells = (f"{s.place}: “{s.quote}”", f"**{s.verdict}** {s.condition}".strip(), numbers)
        lines.append("| " + " | ".join(_cell(c) for c in cells) + " |")
    return "\n".join(lines) + "\n"


def _cell(text: str) -> str:
    for char in "|_":
        text = text.replace(char, f"\\{char}")
    return text


def reproduction_page(made: Reproduction, drawn: dict[str, str] | None = None) -> str:
    """Return a reproduction as one offline HTML page.

    Parameters
    ----------
    made : Reproduction
    drawn : dict of str, optional
        SVG of each figure by its slug; drawn here if not given.

    Returns
    -------
    str
    """
    drawn = drawn if drawn is not None else {f.slug: svg(f) for f in made.figures}
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(Path(__file__).parent),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template("page.html").render(
        made=made,
        title=f"{made.name.capitalize()}, reproduced",
        verdicts=VERDICTS,
        # Ids of one picture must not be those of another on the same page.
        pictures={slug: _embedded(slug, text) for slug, text in drawn.items()},
        amount=amount,
        version=__version__,
    )


def _embedded(slug: str, text: str) -> str:
    text = text[text.index("<svg") :]
    for start in ('id="', 'href="#', "url(#"):
        text = text.replace(start, f"{start}{slug}-")
    return text


def write_reproduction(made: Reproduction, out: str | Path) -> None:
    """Write ``reproduction.json``, ``curves.json``, ``figures/`` and ``report.html``.

    Parameters
    ----------
    made : Reproduction
    out : str or Path
        Folder; files of the same names in it are overwritten.
    """
    folder = Path(out)
    (folder / "figures").mkdir(parents=True, exist_ok=True)
    drawn = {f.slug: svg(f) for f in made.figures}
    texts = {
        "reproduction.json": json.dumps(reproduction_json(made), ensure_ascii=False, indent=2)
        + "\n",
        "curves.json": json.dumps(curves_json(made), ensure_ascii=False, allow_nan=False) + "\n",
        "report.html": reproduction_page(made, drawn),
        **{f"figures/{slug}.svg": text for slug, text in drawn.items()},
    }
    for name, text in texts.items():
        (folder / name).write_text(text, encoding="utf-8", newline="\n")


def run(name: str, reproduce: Callable[[Progress], Reproduction]) -> None:
    """Reproduce a paper from the command line: ``python -m papers.NAME --out DIR``."""
    parser = argparse.ArgumentParser(
        prog=f"python -m papers.{name}",
        description="Reproduce the figures of a paper and judge each of its statements.",
    )
    parser.add_argument("--out", type=Path, default=Path(f"{name}-reproduced"), metavar="DIR")
    parser.add_argument("--quiet", action="store_true", help="print nothing but errors")
    given = parser.parse_args()
    start = time.monotonic()

    def show(stage: str, share: float) -> None:
        if not given.quiet:
            print(f"{time.monotonic() - start:6.1f} s  {share:4.0%}  {stage}", file=sys.stderr)

    made = reproduce(show)
    write_reproduction(made, given.out)
    if not given.quiet:
        for s in made.statements:
            print(f"{s.key:32} {verdict_words(s)}")
        print(f"\n{made.headline}\n\n{given.out / 'report.html'}")

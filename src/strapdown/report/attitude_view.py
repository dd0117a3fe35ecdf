"""A bench in a notebook: a short text with its table, and its charts as figures."""

from __future__ import annotations

from html import escape

from strapdown.errors import ConfigError
from strapdown.report import attitude_words as words
from strapdown.report.attitude_charts import charts
from strapdown.report.attitude_tables import result_tables
from strapdown.report.chart_figure import ChartFigure
from strapdown.report.document import TableBlock
from strapdown.results.attitude_bench import AttitudeBench

__all__ = ["KINDS", "plot", "short_html"]

#: Chart kinds, and the data that a bench needs for each.
KINDS = {
    "cost": "costs",
    "sweep": "a sweep of rates",
    "gyro": "samples",
    "attitude": "a run",
    "error": "a truth",
    "reference-error": "reference points",
    "difference": "two algorithms",
    "share": "shares",
    "trials": "trials",
    "peers": "scores of other libraries",
}


def plot(bench: AttitudeBench, kind: str = "cost") -> ChartFigure:
    """Draw one chart of a bench, as the page shows it.

    Parameters
    ----------
    bench : AttitudeBench
    kind : str
        One of `KINDS`.

    Returns
    -------
    ChartFigure
        Displays itself in a notebook; `save` writes it as SVG, PNG or PDF.

    Raises
    ------
    ConfigError
        The chart does not exist, or the bench lacks its data.
    """
    if kind not in KINDS:
        raise ConfigError(
            "report.no-chart-bench", quantity="kind", kind=kind, word=kind, known=KINDS
        )
    drawn = {chart.slug: chart for chart in charts(bench)}
    if kind not in drawn:
        raise ConfigError(
            "report.nothing-draw-needs", quantity=f"kind '{kind}'", kinds=KINDS[kind], drawn=drawn
        )
    return ChartFigure(drawn[kind])


def short_html(bench: AttitudeBench) -> str:
    """Return the answer and the table of results as HTML for a notebook.

    Parameters
    ----------
    bench : AttitudeBench

    Returns
    -------
    str
        Everything from outside is escaped.
    """
    parts = [
        f"<div><b>{escape(bench.source)}</b></div>",
        f'<p style="font-size:1.25em;margin:.3em 0"><b>{escape(bench.answer.sentence)}</b></p>',
        f'<p style="margin:.3em 0">{escape(words.standing(bench))}</p>',
        *(_table(table) for table in result_tables(bench)),
    ]
    return "<div>" + "".join(parts) + "</div>"


def _table(table: TableBlock) -> str:
    def row(cells: tuple[str, ...], tag: str, bold: bool) -> str:
        weight = ";font-weight:bold" if bold else ""
        return (
            "<tr>"
            + "".join(
                f'<{tag} style="text-align:{"left" if k in table.text else "right"}{weight}">'
                f"{escape(cell)}</{tag}>"
                for k, cell in enumerate(cells)
            )
            + "</tr>"
        )

    rows = "".join(row(r, "td", k in table.strong) for k, r in enumerate(table.rows))
    note = f"<div><small>{escape(table.caption)}</small></div>" if table.caption else ""
    head = row(table.columns, "th", False)
    return f"<table><thead>{head}</thead><tbody>{rows}</tbody></table>{note}"

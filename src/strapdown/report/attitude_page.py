"""The attitude bench as one offline page."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from strapdown import __version__
from strapdown.errors import Finding
from strapdown.report import attitude_tables as tables
from strapdown.report import attitude_words as words
from strapdown.report.attitude_body import body_caption, body_figure
from strapdown.report.attitude_charts import charts
from strapdown.report.attitude_places import offer_lines, place_table
from strapdown.report.chart import Chart
from strapdown.report.page import embedded, render
from strapdown.report.plotly_chart import figure
from strapdown.results.attitude_bench import AttitudeBench

__all__ = ["attitude_page"]

# Where on the page a chart stands.
_PLACES = {
    "answer": ("cost", "sweep"),
    "log": ("gyro", "attitude"),
    "error": ("error", "reference-error", "difference"),
    "share": ("share",),
    "trials": ("trials",),
    "peers": ("peers",),
}


def attitude_page(bench: AttitudeBench, drawn: Sequence[Chart] | None = None) -> str:
    """Return a bench as one offline HTML page.

    Parameters
    ----------
    bench : AttitudeBench
    drawn : sequence of Chart, optional
        Its charts, where they have been made already.

    Returns
    -------
    str
    """
    shown = {c.slug: _chart(c) for c in (charts(bench) if drawn is None else drawn)}
    body = body_figure(bench)
    return render(
        "attitude.html",
        {
            "title": bench.source,
            "answer": bench.answer,
            "standing": words.standing(bench),
            "charts": {
                place: [shown[slug] for slug in slugs if slug in shown]
                for place, slugs in _PLACES.items()
            },
            "body": {
                "json": embedded(body),
                "height": body["layout"]["height"],
                "caption": body_caption(bench),
            },
            "results": tables.result_tables(bench),
            "sweeps": tables.sweep_tables(bench),
            "cost": tables.cost_table(bench),
            "conditions": tables.condition_table(bench),
            "trials": tables.trial_table(bench),
            "peers": tables.peer_table(bench),
            "references": words.reference_lines(bench),
            "places": place_table(bench),
            "offers": offer_lines(bench),
            "hint": "" if bench.scores else words.HOW_TO_REFERENCE,
            "findings": _findings(bench.findings),
            "differences": tables.difference_table(bench),
            "facts": words.facts(bench),
            "readings": bench.readings,
            "first_value": words.first_value,
            "conventions": words.CONVENTIONS,
            "version": __version__,
        },
    )


def _chart(chart: Chart) -> dict[str, Any]:
    data = figure(chart)
    return {
        "slug": chart.slug,
        "title": chart.title,
        "caption": chart.caption,
        "height": data["layout"]["height"],
        "json": embedded(data),
    }


def _findings(findings: Iterable[Finding]) -> list[dict[str, str | None]]:
    return [
        {
            "place": ", ".join(
                str(part)
                for part in (f.file, f"row {f.row}" if f.row else None, f.quantity)
                if part
            ),
            "what": f.what,
            "remedy": f.remedy,
        }
        for f in findings
    ]

"""A paper re-made, as files: page, figures, JSON, sealed in a bundle."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from strapdown import __version__
from strapdown.bundle.destination import check_destination
from strapdown.bundle.json_text import to_json
from strapdown.bundle.seal import Seal
from strapdown.bundle.writing import write_bundle
from strapdown.config import ReproduceSpec, specify
from strapdown.errors import ConfigError
from strapdown.report.page import embedded, render
from strapdown.report.plotly_chart import figure as plotly_figure
from strapdown.report.reproduction_charts import chart
from strapdown.report.svg_chart import draw
from strapdown.systems.progress import Progress, silent
from strapdown.systems.reproduce_alexiev import reproduce_alexiev
from strapdown.systems.reproduce_chernodarov import reproduce_chernodarov
from strapdown.systems.reproduce_tadic import reproduce_tadic
from strapdown.systems.reproduction import (
    VERDICTS,
    Figure,
    Reproduction,
    Statement,
    Table,
    amount,
)

__all__ = [
    "REPRODUCTIONS",
    "curves_json",
    "make_reproduction",
    "reproduce",
    "reproduction_json",
    "reproduction_page",
    "statements_markdown",
    "write_reproduction",
]

REPRODUCTIONS: dict[str, Callable[[Progress], Reproduction]] = {
    "alexiev": reproduce_alexiev,
    "tadic": reproduce_tadic,
    "chernodarov": reproduce_chernodarov,
}


def reproduce(
    paper: str, out: str | Path, *, force: bool = False, progress: Progress = silent
) -> Seal:
    """Re-make a paper and write it as a sealed bundle.

    Parameters
    ----------
    paper : str
        One of `REPRODUCTIONS`.
    out : str or Path
        Folder to make.
    force : bool
        Replace a bundle that is there.
    progress : callable, optional
        Called with a stage and the share that is done.

    Returns
    -------
    Seal

    Raises
    ------
    ConfigError
        The paper is unknown, or `out` may not be written.
    """
    spec = reproduction_specification(paper)
    check_destination(Path(out), force)
    return write_reproduction(make_reproduction(spec, progress), out, force=force)


def reproduction_specification(paper: str) -> ReproduceSpec:
    """Return the specification of a paper's reproduction, or say which there are.

    Raises
    ------
    ConfigError
    """
    name = paper.strip().lower()
    if name not in REPRODUCTIONS:
        raise ConfigError(
            "report.no-paper-re-made-here",
            quantity="paper",
            paper=paper,
            word=name,
            known=REPRODUCTIONS,
        )
    return specify(ReproduceSpec, paper=name)


def make_reproduction(spec: ReproduceSpec, progress: Progress = silent) -> Reproduction:
    """Re-make a paper from its specification.

    Raises
    ------
    ConfigError
        The paper is unknown.
    """
    return REPRODUCTIONS[reproduction_specification(spec.paper).paper](progress)


def write_reproduction(made: Reproduction, out: str | Path, *, force: bool = False) -> Seal:
    """Write a reproduction as a sealed bundle.

    Parameters
    ----------
    made : Reproduction
    out : str or Path
        Folder to make.
    force : bool
        Replace a bundle that is there.

    Returns
    -------
    Seal

    Raises
    ------
    ConfigError
        `out` exists and may not be replaced.
    """
    seals: list[Seal] = []
    with write_bundle(
        Path(out),
        command="reproduce",
        configuration=specify(ReproduceSpec, paper=made.name).model_dump(mode="json"),
        force=force,
        seals=seals,
    ) as folder:
        (folder / "reproduction.json").write_text(
            to_json(reproduction_json(made)), encoding="utf-8", newline="\n"
        )
        # Too many numbers for a person, and the only ones that a picture holds.
        (folder / "curves.json").write_text(
            json.dumps(curves_json(made), ensure_ascii=False, allow_nan=False) + "\n",
            encoding="utf-8",
            newline="\n",
        )
        (folder / "figures").mkdir()
        for figure in made.figures:
            draw(chart(figure), folder / "figures" / f"{figure.slug}.svg")
        (folder / "report.html").write_text(reproduction_page(made), encoding="utf-8", newline="\n")
    return seals[0]


def reproduction_json(made: Reproduction) -> dict[str, Any]:
    """Return a reproduction as plain data, with every number that is shown.

    Parameters
    ----------
    made : Reproduction

    Returns
    -------
    dict
        What is not a number is null.
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
        Nine digits; what is not a number is null.
    """
    return {
        "schema": "strapdown curves 1",
        "figures": [
            {
                "slug": f.slug,
                "x_label": f.x_label,
                "panels": [
                    {
                        "y_label": panel.y_label,
                        "curves": [
                            {"name": t.name, "x": _rounded(t.x), "y": _rounded(t.y)}
                            for t in panel.lines
                        ],
                    }
                    for panel in chart(f).panels
                ],
            }
            for f in made.figures
        ],
    }


def _finite(value: float) -> float | None:
    return float(value) if abs(value) < float("inf") else None


def _rounded(values: Any) -> list[float | None]:
    """Nine digits: what a curve needs, and not what rounding makes of the last ones."""
    return [_finite(float(f"{v:.9g}")) for v in values.tolist()]


def verdict_words(statement: Statement) -> str:
    """Return the verdict with its condition, as a reader sees it."""
    return f"{statement.verdict} {statement.condition}".strip()


def statements_markdown(made: Reproduction) -> str:
    """Return the statements as a table of Markdown, for the manual.

    Parameters
    ----------
    made : Reproduction

    Returns
    -------
    str
        Place and quote, verdict, and the evidence to three digits.
    """
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


def reproduction_page(made: Reproduction) -> str:
    """Return a reproduction as one offline HTML page.

    Parameters
    ----------
    made : Reproduction

    Returns
    -------
    str
    """
    return render(
        "reproduction.html",
        {
            "title": made.name.capitalize() + ", re-made",
            "paper": made.paper,
            "headline": made.headline,
            "verdicts": [(v, v.replace(" ", "-"), made.count(v)) for v in VERDICTS],
            "statements": [
                {
                    "key": s.key,
                    "place": s.place,
                    "quote": s.quote,
                    "verdict": s.verdict,
                    "kind": s.verdict.replace(" ", "-"),
                    "condition": s.condition,
                    "because": s.because,
                    "evidence": [(e.what, e.shown) for e in s.evidence],
                    "figure": s.figure,
                }
                for s in made.statements
            ],
            "tables": [_shown(t) for t in made.tables],
            "charts": [_embedded(f) for f in made.figures],
            "conventions": made.conventions,
            "version": __version__,
        },
    )


def _shown(table: Table) -> dict[str, Any]:
    return {
        "slug": table.slug,
        "title": table.title,
        "caption": table.caption,
        "columns": table.columns,
        "rows": [
            (name, ["–" if v is None else amount(v) for v in values]) for name, values in table.rows
        ],
    }


def _embedded(figure: Figure) -> dict[str, Any]:
    data = plotly_figure(chart(figure))
    return {
        "slug": figure.slug,
        "title": figure.title,
        "caption": figure.caption,
        "parameters": figure.parameters,
        "height": data["layout"]["height"],
        "json": embedded(data),
    }

"""A document as plain data, from which a page and a PDF are laid out alike."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from strapdown.report.chart import Chart
from strapdown.report.document import (
    Animation,
    Block,
    ChartBlock,
    Document,
    Facts,
    Items,
    KeyFigures,
    Paragraph,
    Picture,
    TableBlock,
)
from strapdown.report.document_text import plain_document

__all__ = ["Numbered", "document_data", "draw_stills"]

Place = Callable[[str], str]


def draw_stills(document: Document) -> dict[str, str]:
    """Draw the charts of a document for paper.

    Parameters
    ----------
    document : Document

    Returns
    -------
    dict of str to str
        SVG by the chart's slug.
    """
    plain = plain_document(document)
    blocks = [*plain.front, *(block for section in plain.sections for block in section.blocks)]
    charts = {block.chart.slug: block.chart for block in blocks if isinstance(block, ChartBlock)}
    return {slug: _drawn(chart) for slug, chart in charts.items()}


def _drawn(chart: Chart) -> str:
    from strapdown.report.svg_chart import draw

    with tempfile.TemporaryDirectory(prefix="strapdown-") as folder:
        path = Path(folder) / "chart.svg"
        draw(chart, path, paper=True)
        return path.read_text(encoding="utf-8")


class Numbered:
    """Numbers of figures and tables, in their order; one for a whole document."""

    def __init__(self) -> None:
        self._figures = self._tables = 0

    def figure(self) -> int:
        """Return the number of the next figure."""
        self._figures += 1
        return self._figures

    def table(self) -> int:
        """Return the number of the next table."""
        self._tables += 1
        return self._tables


def document_data(
    document: Document, stills: dict[str, str], place: Place, *, alive: bool
) -> dict[str, Any]:
    """Return a document as data for a template.

    Parameters
    ----------
    document : Document
        Its texts are made plain here.
    stills : dict of str to str
        From `draw_stills`.
    place : callable
        Takes a whole SVG, and returns what the template refers to it by.
    alive : bool
        Whether charts come with plotly's data, too.

    Returns
    -------
    dict
        Strings, numbers, lists and dicts; charts under ``figure`` where alive.
    """
    plain = plain_document(document)
    numbers = Numbered()
    writer = _Writer(stills, place, numbers, alive)
    return {
        "title": plain.title,
        "subtitle": plain.subtitle,
        "footer": plain.footer,
        "facts": _pairs(plain.facts),
        "front": [writer.block(block) for block in plain.front],
        "sections": [
            {
                "number": number,
                "anchor": f"{number}-{section.slug}",
                "title": section.title,
                "blocks": [writer.block(block) for block in section.blocks],
            }
            for number, section in enumerate(plain.sections, start=1)
        ],
    }


def _pairs(rows: tuple[tuple[str, str], ...]) -> list[list[str]]:
    return [[name, text] for name, text in rows]


class _Writer:
    """Blocks as data."""

    def __init__(
        self, stills: dict[str, str], place: Place, numbers: Numbered, alive: bool
    ) -> None:
        self._stills, self._place = stills, place
        self._numbers, self._alive = numbers, alive

    def block(self, block: Block) -> dict[str, Any]:
        """Return one block."""
        if isinstance(block, Paragraph):
            return {"kind": "paragraph", "style": block.kind, "text": block.text}
        if isinstance(block, Items):
            return {"kind": "items", "rows": _pairs(block.rows), "numbered": block.numbered}
        if isinstance(block, Facts):
            return {"kind": "facts", "rows": _pairs(block.rows)}
        if isinstance(block, TableBlock):
            return self._table(block)
        if isinstance(block, ChartBlock):
            return self._chart(block.chart)
        if isinstance(block, Picture):
            return self._picture(block) | {"kind": "picture", "number": self._numbers.figure()}
        if isinstance(block, Animation):
            return self._animation(block)
        return self._key_figures(block)

    def _table(self, table: TableBlock) -> dict[str, Any]:
        return {
            "kind": "table",
            "title": "",
            "number": self._numbers.table() if table.caption else 0,
            "columns": list(table.columns),
            "rows": [list(row) for row in table.rows],
            "words": [index in table.text for index in range(len(table.columns))],
            "caption": table.caption,
            "strong": [index in table.strong for index in range(len(table.rows))],
        }

    def _chart(self, chart: Chart) -> dict[str, Any]:
        number = self._numbers.figure()
        data: dict[str, Any] = {
            "kind": "chart",
            "number": number,
            "id": f"figure-{number}",
            "title": chart.title,
            "caption": chart.caption,
            "alt": f"{chart.title}. {chart.caption}".strip(),
            "still": self._place(self._stills[chart.slug]),
            "width_mm": 170.0,
            "still_caption": "",
        }
        if self._alive:
            from strapdown.report.plotly_chart import figure

            data["figure"] = figure(chart)
        return data

    def _picture(self, picture: Picture) -> dict[str, Any]:
        return {
            "number": 0,
            "still_caption": "",
            "title": picture.title,
            "caption": picture.caption,
            "alt": picture.alt or picture.title,
            "still": self._place(picture.svg),
            "width_mm": float(picture.width_mm),
        }

    def _animation(self, animation: Animation) -> dict[str, Any]:
        number = self._numbers.figure()
        data: dict[str, Any] = {
            **self._picture(animation.stills),
            "kind": "animation",
            "number": number,
            "id": f"figure-{number}",
            "title": animation.title,
            "caption": animation.caption,
            "still_caption": animation.stills.caption,
        }
        if self._alive:
            data["figure"] = dict(animation.figure)
            data["interval_ms"] = 60
        return data

    def _key_figures(self, block: KeyFigures) -> dict[str, Any]:
        return {
            "kind": "key_figures",
            "figures": [
                {"name": f.name, "value": f.value, "bound": f.bound, "note": f.note}
                for f in block.figures
            ],
            "pictures": [self._picture(picture) for picture in block.pictures],
        }

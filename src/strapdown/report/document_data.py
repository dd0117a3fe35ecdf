"""A document as plain data, from which page and PDF are laid out alike."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import count
from typing import Any
from xml.etree import ElementTree

from strapdown.errors import DataError
from strapdown.report.chart import Chart
from strapdown.report.chart_svg import still
from strapdown.report.document import (
    Animation,
    Block,
    ChartBlock,
    Document,
    Facts,
    Items,
    KeyFigures,
    Links,
    Paragraph,
    Picture,
    TableBlock,
    plain_document,
)

__all__ = ["document_data", "draw_stills"]

Place = Callable[[str], str]


def draw_stills(document: Document) -> tuple[str, ...]:
    """Draw the charts of a document for paper.

    Parameters
    ----------
    document : Document

    Returns
    -------
    tuple of str
        One SVG per chart, in document order.
    """
    return tuple(still(chart) for chart in _charts(plain_document(document)))


def _charts(document: Document) -> list[Chart]:
    blocks = [
        *document.front,
        *(block for section in document.sections for block in section.blocks),
    ]
    return [block.chart for block in blocks if isinstance(block, ChartBlock)]


def document_data(
    document: Document, stills: Sequence[str], place: Place, *, alive: bool
) -> dict[str, Any]:
    """Return a document as data for a template.

    Parameters
    ----------
    document : Document
        Its texts are made plain here.
    stills : sequence of str
        From `draw_stills`.
    place : callable
        Takes a whole SVG and returns the template's reference to it.
    alive : bool
        For the page: a chart has its drawing under ``svg``, an animation its scene.

    Returns
    -------
    dict
        Strings, numbers, lists and dicts.

    Raises
    ------
    DataError
        If a picture is not XML.
    ValueError
        If a row of a table does not have as many cells as there are columns.
    """
    plain = plain_document(document)
    writer = _Writer(iter(stills), place, alive)
    return {
        "title": plain.title,
        "subtitle": plain.subtitle,
        "footer": plain.footer,
        "facts": _pairs(plain.facts),
        "links": _pairs(plain.links),
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
    """Blocks as data; figures and tables are numbered in document order."""

    def __init__(self, stills: Iterator[str], place: Place, alive: bool) -> None:
        self._stills, self._place, self._alive = stills, place, alive
        self._figures, self._tables = count(1), count(1)

    def block(self, block: Block) -> dict[str, Any]:
        """Return one block."""
        if isinstance(block, Paragraph):
            return {"kind": "paragraph", "style": block.kind, "text": block.text}
        if isinstance(block, Items):
            return {"kind": "items", "rows": _pairs(block.rows), "numbered": block.numbered}
        if isinstance(block, Links):
            return {"kind": "links", "rows": _pairs(block.rows)}
        if isinstance(block, Facts):
            return {"kind": "facts", "rows": _pairs(block.rows)}
        if isinstance(block, TableBlock):
            return self._table(block)
        if isinstance(block, ChartBlock):
            return self._chart(block.chart)
        if isinstance(block, Picture):
            return self._picture(block) | {"kind": "picture", "number": next(self._figures)}
        if isinstance(block, Animation):
            return self._animation(block)
        return self._key_figures(block)

    def _table(self, table: TableBlock) -> dict[str, Any]:
        if any(len(row) != len(table.columns) for row in table.rows):
            raise ValueError(
                f"a row of the table {table.caption!r} has not as many cells as columns"
            )
        return {
            "kind": "table",
            "title": table.title,
            "number": next(self._tables) if table.caption or table.title else 0,
            "columns": list(table.columns),
            "rows": [list(row) for row in table.rows],
            "words": [index in table.text for index in range(len(table.columns))],
            "caption": table.caption,
            "strong": [index in table.strong for index in range(len(table.rows))],
            "passed": [
                [(row, column) in table.passed for column in range(len(table.columns))]
                for row in range(len(table.rows))
            ],
        }

    def _chart(self, chart: Chart) -> dict[str, Any]:
        number = next(self._figures)
        data: dict[str, Any] = {
            "kind": "chart",
            "number": number,
            "title": chart.title,
            "caption": chart.caption,
            "alt": f"{chart.title}. {chart.caption}".strip(),
            "width_mm": 170.0,
            "still_caption": "",
            "live_caption": "",
        }
        drawn = next(self._stills)
        if self._alive:
            return data | {"svg": drawn, "x_label": chart.x_label}
        return data | {"still": self._place(drawn)}

    def _picture(self, picture: Picture) -> dict[str, Any]:
        try:
            ElementTree.fromstring(picture.svg)
        except ElementTree.ParseError as error:
            raise DataError(
                "report.picture-no-svg",
                file="report",
                quantity=picture.title,
                slug=picture.slug,
                error=error,
            ) from error
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
        number = next(self._figures)
        still: dict[str, Any] = {"still": "", "still_caption": "", "alt": animation.title}
        if animation.stills is not None:
            still = self._picture(animation.stills)
            still["still_caption"] = animation.stills.caption
        data: dict[str, Any] = {
            **still,
            "kind": "animation",
            "number": number,
            "title": animation.title,
            "caption": animation.caption,
            "live_caption": animation.live_caption,
        }
        return data | {"scene": animation.scene} if self._alive else data

    def _key_figures(self, block: KeyFigures) -> dict[str, Any]:
        return {
            "kind": "key_figures",
            "figures": [
                {"name": f.name, "value": f.value, "bound": f.bound, "note": f.note}
                for f in block.figures
            ],
            "pictures": [self._picture(picture) for picture in block.pictures],
        }

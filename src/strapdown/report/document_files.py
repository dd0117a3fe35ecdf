"""Drawings of a document as files beside the page."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from strapdown.report.document import Animation, ChartBlock, Document, KeyFigures, Picture

__all__ = ["drawings", "write_drawings", "write_text"]


def drawings(document: Document) -> list[ChartBlock | Picture | Animation]:
    """Return every chart, picture and animation, in report order."""
    found: list[ChartBlock | Picture | Animation] = []
    for block in (*document.front, *(b for s in document.sections for b in s.blocks)):
        if isinstance(block, ChartBlock | Picture | Animation):
            found.append(block)
        elif isinstance(block, KeyFigures):
            found += block.pictures
    return found


def write_drawings(document: Document, stills: Sequence[str], folder: Path) -> None:
    """Write every drawing of a report to a folder, which is created.

    Parameters
    ----------
    document : Document
    stills : sequence of str
        Drawn charts from `document_data.draw_stills`, one per chart.
    folder : Path
    """
    folder.mkdir()
    drawn = iter(stills)
    for block in drawings(document):
        match block:
            case ChartBlock(chart=chart):
                write_text(folder / f"{chart.slug}.svg", next(drawn))
            case Picture() as picture:
                write_text(folder / f"{picture.slug}.svg", picture.svg)
            case Animation(stills=Picture() as picture):
                write_text(folder / f"{picture.slug}.svg", picture.svg)


def write_text(path: Path, text: str) -> None:
    """Write a text file, the same bytes on every system."""
    path.write_text(text, encoding="utf-8", newline="\n")

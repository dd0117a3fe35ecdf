"""A report as plain data: sections of blocks, which a page and a PDF show alike."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from strapdown.report.chart import Chart

__all__ = [
    "Animation",
    "Block",
    "ChartBlock",
    "Document",
    "Facts",
    "Items",
    "KeyFigure",
    "KeyFigures",
    "Paragraph",
    "Picture",
    "Section",
    "TableBlock",
]


@dataclass(frozen=True)
class Paragraph:
    """Words in a row; plain text, which no reader takes for markup.

    Attributes
    ----------
    text : str
    kind : {'plain', 'lead', 'note', 'warning', 'mono'}
        ``lead`` is the one paragraph of page one; ``mono`` a command or digest.
    """

    text: str
    kind: str = "plain"


@dataclass(frozen=True)
class Items:
    """A list; each with a head, which may be empty, and its text."""

    rows: tuple[tuple[str, str], ...]
    numbered: bool = False


@dataclass(frozen=True)
class Facts:
    """Names and what they are: two columns without a head."""

    rows: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class TableBlock:
    """A table.

    Attributes
    ----------
    columns : tuple of str
        With units.
    rows : tuple of tuple of str
    text : tuple of int
        Columns of words, to the left; others are numbers, to the right.
    caption : str
    strong : tuple of int
        Rows that stand out, such as a sum.
    """

    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    text: tuple[int, ...] = (0,)
    caption: str = ""
    strong: tuple[int, ...] = ()


@dataclass(frozen=True)
class ChartBlock:
    """A chart: alive in the page, drawn as SVG in the PDF and among the figures."""

    chart: Chart


@dataclass(frozen=True)
class Picture:
    """A picture drawn by hand, the same in page and PDF.

    Attributes
    ----------
    slug : str
        Name of the file among the figures.
    svg : str
        A whole SVG; every text in it from outside is escaped.
    title, caption : str
    alt : str
        In words, for who cannot see it.
    width_mm : float
        On paper.
    """

    slug: str
    svg: str = field(repr=False)
    title: str
    caption: str = ""
    alt: str = ""
    width_mm: float = 170.0


@dataclass(frozen=True)
class Animation:
    """A figure of plotly with frames in the page; stills in the PDF.

    Attributes
    ----------
    slug : str
    figure : mapping
        Plain data: ``data``, ``layout``, ``frames``, each with a name that says when it is, and
        ``interval_ms`` between them, if not 60. The page has the button and the slider.
    stills : Picture
    live_caption : str
        What is true of the page alone.
    """

    slug: str
    title: str
    caption: str
    figure: Mapping[str, Any] = field(repr=False)
    stills: Picture = field(repr=False)
    live_caption: str = ""


@dataclass(frozen=True)
class KeyFigure:
    """A number that matters: its name, the value with its unit, and its bound in words."""

    name: str
    value: str
    bound: str
    note: str = ""


@dataclass(frozen=True)
class KeyFigures:
    """Numbers that matter, beside each other, and the pictures that belong to them."""

    figures: tuple[KeyFigure, ...]
    pictures: tuple[Picture, ...] = ()


Block = Paragraph | Items | Facts | TableBlock | ChartBlock | Picture | Animation | KeyFigures


@dataclass(frozen=True)
class Section:
    """A part of the report under a heading; `slug` is its anchor."""

    slug: str
    title: str
    blocks: tuple[Block, ...]


@dataclass(frozen=True)
class Document:
    """A whole report.

    Attributes
    ----------
    title, subtitle : str
    facts : tuple of (str, str)
        Under the title: case, vehicle, what it was made with.
    front : tuple of Block
        Page one.
    sections : tuple of Section
    footer : str
        On every page of the PDF, beside the page number.
    links : tuple of (str, str)
        Files beside the page, and what they are; of the page alone.
    """

    title: str
    subtitle: str
    facts: tuple[tuple[str, str], ...]
    front: tuple[Block, ...]
    sections: tuple[Section, ...]
    footer: str = ""
    links: tuple[tuple[str, str], ...] = ()

"""A report as plain data: sections of blocks, shown alike by page and PDF."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, fields, is_dataclass, replace
from itertools import count
from pathlib import Path
from typing import Any, TypeVar
from xml.etree import ElementTree

from strapdown.errors import DataError, Finding, Words
from strapdown.report.chart import Chart
from strapdown.report.chart_svg import still
from strapdown.report.scene import Scene


@dataclass(frozen=True)
class Paragraph:
    """A paragraph of plain text, never interpreted as markup.

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
    """A list; each item has a head, which may be empty, and its text."""

    rows: tuple[tuple[str, str], ...]
    numbered: bool = False


@dataclass(frozen=True)
class Links:
    """Files beside the page, each with its description; in the page only."""

    rows: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class Facts:
    """Names and values in two columns without a header."""

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
        Left-aligned text columns; the others are right-aligned numbers.
    caption, title : str
    strong : tuple of int
        Emphasized rows, such as a sum.
    passed : frozenset of (int, int)
        Row and column of cells within a tolerance; these also have a tick.
    """

    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    text: tuple[int, ...] = (0,)
    caption: str = ""
    strong: tuple[int, ...] = ()
    title: str = ""
    passed: frozenset[tuple[int, int]] = frozenset()


@dataclass(frozen=True)
class ChartBlock:
    """A chart: interactive in the page, a still in the PDF and among the figures."""

    chart: Chart


@dataclass(frozen=True)
class Picture:
    """A custom SVG picture, the same in page and PDF.

    Attributes
    ----------
    slug : str
        File name among the figures.
    svg : str
        A whole SVG; all external text in it is escaped.
    title, caption : str
    alt : str
        Text alternative for readers who cannot see it.
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
    """A scene that the page plays and turns; stills without scripts and on paper.

    `live_caption` applies to the page's scene only.
    """

    slug: str
    title: str
    caption: str
    scene: Scene = field(repr=False)
    stills: Picture | None = field(default=None, repr=False)
    live_caption: str = ""


@dataclass(frozen=True)
class KeyFigure:
    """A key number: its name, the value with its unit, and its bound in words."""

    name: str
    value: str
    bound: str
    note: str = ""


@dataclass(frozen=True)
class KeyFigures:
    """Key numbers side by side, with their pictures."""

    figures: tuple[KeyFigure, ...]
    pictures: tuple[Picture, ...] = ()


Block = (
    Paragraph | Items | Links | Facts | TableBlock | ChartBlock | Picture | Animation | KeyFigures
)


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
        Under the title: case, vehicle, software.
    front : tuple of Block
        Page one.
    sections : tuple of Section
    footer : str
        On every page of the PDF, beside the page number.
    links : tuple of (str, str)
        Files beside the page, with their descriptions; in the page only.
    """

    title: str
    subtitle: str
    facts: tuple[tuple[str, str], ...]
    front: tuple[Block, ...]
    sections: tuple[Section, ...]
    footer: str = ""
    links: tuple[tuple[str, str], ...] = ()


def findings_list(findings: Iterable[Finding]) -> Items | Paragraph:
    """Return findings with their locations and remedies."""
    rows = []
    for finding in findings:
        parts = (finding.file, finding.quantity, finding.row and f"row {finding.row}")
        text = finding.what if not finding.remedy else f"{finding.what}. {finding.remedy}."
        rows.append((", ".join(str(p) for p in parts if p), text))
    return Items(tuple(rows)) if rows else Paragraph("None.")


def finding_json(finding: Finding, words: Words = "file") -> dict[str, Any]:
    """Return a finding for programs, with its sentence and remedy for people."""
    said = {"sentence": finding.sentence(words), "remedy": finding.advice(words)}
    return {**finding.plain(), **said}


# Conversion of every text in a document to plain text.


# Maximum characters, by block: a heading, a cell or a chart has less room than a paragraph.
_TITLE, _LABEL, _CELL, _WORDS = 300, 160, 1000, 4000
_LIMITS: dict[type, dict[str, int]] = {
    Chart: {"caption": _WORDS, "title": _TITLE},
    TableBlock: {"caption": _WORDS, "rows": _CELL},
    KeyFigure: {"value": 40, "bound": _TITLE, "note": _TITLE},
    Document: {"facts": _CELL, "subtitle": _TITLE, "title": _TITLE},
    Section: {"title": _TITLE},
    Facts: {"rows": _CELL},
    Items: {"rows": _WORDS},
    Paragraph: {"text": _WORDS},
    Picture: {"caption": _WORDS, "alt": _WORDS, "title": _TITLE},
    Animation: {"caption": _WORDS, "live_caption": _TITLE, "title": _TITLE},
}
_MARKED = len("[U+10FFFF]")
_SLUG = re.compile(r"[^A-Za-z0-9_-]+")

T = TypeVar("T")


def plain_document(document: Document) -> Document:
    """Return a document in which every text is plain and of bounded length.

    Returns
    -------
    Document
        Texts as `plain_text`: paragraphs, items and captions to 4000 characters, facts and cells to
        1000, titles and the notes of a key figure to 300, its value to 40, other words to 160;
        slugs to 80 letters, digits, ``_`` and ``-``. The page and the PDF call this themselves;
        call it before writing charts to separate files. The operation is idempotent.
    """
    return _plain(document, _LABEL)


def _plain(value: T, limit: int) -> T:
    """Copy of a value of any depth with plain texts."""
    made: Any = value
    if isinstance(value, str):
        made = plain_text(value, limit)
    elif isinstance(value, tuple):
        made = tuple(_plain(item, limit) for item in value)
    elif is_dataclass(value) and not isinstance(value, type):
        made = replace(value, **{f.name: _field(value, f.name) for f in fields(value) if f.init})
    return made  # type: ignore[no-any-return]


def _field(owner: Any, name: str) -> Any:
    value = getattr(owner, name)
    limit = _LIMITS.get(type(owner), {}).get(name, _LABEL)
    if name == "slug":
        return _SLUG.sub("-", value)[:80].strip("-") or "part"
    if isinstance(owner, Picture) and name == "svg":
        return plain_text(value, _MARKED * len(value) + 1, lines=True)
    if isinstance(owner, Paragraph) and owner.kind == "mono" and name == "text":
        return plain_text(value, limit, lines=True)
    return _plain(value, limit)


# Sanitizing of external text: no control characters, no invisible characters.


_CUT = "… ({} characters)"
# More combining marks on one letter would overlap the lines above and below.
_MOST_COMBINING = 3
# Control, format (direction, zero width), lone surrogates, private use: no glyph of their own.
_SHAPELESS = frozenset({"Cc", "Cf", "Cs", "Co"})
_COMBINING = frozenset({"Mn", "Me"})


def plain_text(text: str, limit: int = 4000, *, lines: bool = False) -> str:
    r"""Return text in which every character is visible and none acts as a control.

    Parameters
    ----------
    text : str
        From a file, a case or a user.
    limit : int
        Maximum length of the result; a longer text is cut and its length stated.
    lines : bool
        Whether line ends are kept; otherwise they become spaces, as do tabs.

    Returns
    -------
    str
        Characters without a glyph (``\x00``, the override of direction U+202E, the joiner of zero
        width U+200D, a lone surrogate) are written as ``[U+202E]``, as are combining marks after
        the third on one letter. Plain text is unchanged, so the operation is idempotent.
    """
    marked = _marked(text[:limit].replace("\r\n", "\n"), "\n" if lines else " ")
    if len(text) <= limit and len(marked) <= limit:
        return marked
    count = _CUT.format(len(text))
    return marked[: max(0, limit - len(count))] + count


def _marked(text: str, end_of_line: str) -> str:
    # Printable characters have a glyph; only too many combining marks must be marked.
    if text.isprintable() and (text.isascii() or not _COMBINING & _kinds(text)):
        return text
    out: list[str] = []
    combining = 0
    for char in text:
        kind = unicodedata.category(char)
        combining = combining + 1 if kind in _COMBINING else 0
        if char in "\n\r\u2028\u2029":
            out.append(end_of_line)
        elif char == "\t":
            out.append(" ")
        elif kind in _SHAPELESS or _is_no_character(char) or combining > _MOST_COMBINING:
            out.append(f"[U+{ord(char):04X}]")
        else:
            out.append(char)
    return "".join(out)


def _kinds(text: str) -> set[str]:
    return set(map(unicodedata.category, set(text)))


def _is_no_character(char: str) -> bool:
    code = ord(char)
    return code & 0xFFFE == 0xFFFE or 0xFDD0 <= code <= 0xFDEF


# A document as plain data, from which page and PDF are laid out alike.


Place = Callable[[str], str]


def draw_stills(document: Document) -> tuple[str, ...]:
    """Draw the charts of a document for paper.

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


# Drawings of a document as files beside the page.


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

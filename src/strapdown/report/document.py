"""A report as plain data: sections of blocks, shown alike by page and PDF."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable
from dataclasses import dataclass, field, fields, is_dataclass, replace
from typing import Any, TypeVar

from strapdown.errors import Finding, Words
from strapdown.report.chart import Chart
from strapdown.report.scene import Scene

__all__ = [
    "Animation",
    "Block",
    "ChartBlock",
    "Document",
    "Facts",
    "Items",
    "KeyFigure",
    "KeyFigures",
    "Links",
    "Paragraph",
    "Picture",
    "Section",
    "TableBlock",
    "finding_json",
    "findings_list",
    "plain_document",
    "plain_text",
]


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

    Parameters
    ----------
    document : Document

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

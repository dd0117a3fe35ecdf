"""A report as plain data: sections of blocks, shown alike by page and PDF."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, fields, is_dataclass, replace
from functools import cached_property
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from strapdown import __version__
from strapdown.errors import DataError, Finding, Words
from strapdown.report.chart import Chart

if TYPE_CHECKING:
    from strapdown.report.scene import Scene


@dataclass(frozen=True)
class Paragraph:
    """A paragraph of plain text, never interpreted as markup.

    `kind`, {'plain', 'lead', 'note', 'warning', 'mono'}: ``lead`` is the one paragraph of page one;
    ``mono`` a command or digest.
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

    `columns`: with units. `text`: left-aligned text columns; the others are right-aligned numbers.
    `strong`: emphasized rows, such as a sum. `passed`: row and column of cells within a tolerance;
    these also have a tick.
    """

    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    text: tuple[int, ...] = (0,)
    caption: str = ""
    strong: tuple[int, ...] = ()
    title: str = ""
    passed: frozenset[tuple[int, int]] = frozenset()


@dataclass(frozen=True)
class Picture:
    """A custom SVG picture, the same in page and PDF.

    `slug`: file name among the figures. `svg`: a whole SVG; all external text in it is escaped.
    `alt`: text alternative for readers who cannot see it. `width_mm`: on paper.
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


#: A chart is interactive in the page, a still in the PDF and among the figures.
Block = Paragraph | Items | Links | Facts | TableBlock | Chart | Picture | Animation | KeyFigures


#: Figures of a page that are not behind folds, in all and of one section.
MOST_OPEN, MOST_OF_SECTION = 8, 3


@dataclass(frozen=True)
class Section:
    """A part of the report under a heading; without blocks it is left out.

    On paper every section is whole.

    `slug`: its anchor. `folded`: whether the page shows its heading alone, until a reader opens it.
    `figures`: of its figures so many are shown at most; the others are behind a fold at its end.
    """

    slug: str
    title: str
    blocks: tuple[Block, ...]
    folded: bool = False
    figures: int = MOST_OF_SECTION


def blocks(*found: Block | None) -> tuple[Block, ...]:
    """Return the blocks that there are."""
    return tuple(block for block in found if block is not None)


def section(
    slug: str,
    title: str,
    *found: Block | None,
    folded: bool = False,
    figures: int = MOST_OF_SECTION,
) -> Section:
    """Make a section of the blocks that there are."""
    return Section(slug, title, blocks(*found), folded, figures)


@dataclass(frozen=True)
class Document:
    """A whole report.

    `facts`: under the title: case, vehicle, software. `front`: page one. `footer`: on every page of
    the PDF, beside the page number. `links`: files beside the page, with their descriptions; in the
    page only.
    """

    title: str
    subtitle: str
    facts: tuple[tuple[str, str], ...]
    front: tuple[Block, ...]
    sections: tuple[Section, ...]
    footer: str = ""
    links: tuple[tuple[str, str], ...] = ()

    @cached_property
    def plain(self) -> Document:
        """The document with every text as `plain_text`, idempotent.

        Paragraphs, items and captions have up to 4000 characters, facts and cells 1000, titles and
        notes of a key figure 300, its value 40, other words 160; slugs 80 letters, digits, ``_``
        and ``-``.
        """
        return _plain(self, _LABEL)


def document_of(
    title: str,
    subtitle: str,
    facts: Iterable[tuple[str, str]],
    front: Iterable[Block | None],
    sections: Iterable[Section | None],
    *,
    footer: str = "",
    links: Iterable[tuple[str, str]] = (),
) -> Document:
    """Make a report of the blocks and sections that there are; its facts end with the software."""
    return Document(
        title,
        subtitle,
        (*facts, ("Software", f"strapdown {__version__}")),
        blocks(*front),
        tuple(one for one in sections if one is not None),
        footer,
        tuple(links),
    )


def paragraph(text: str | None, kind: str = "plain") -> Paragraph | None:
    """Make a paragraph if there is a text."""
    return Paragraph(text, kind) if text else None


def items_of(rows: Iterable[tuple[str, str]], *, numbered: bool = False) -> Items | None:
    """Make a list if there are rows."""
    return Items(found, numbered) if (found := tuple(rows)) else None


def listed(texts: Iterable[str]) -> Items:
    """Make a list without heads."""
    return Items(tuple(("", text) for text in texts))


def table_of(
    head: str | Sequence[str],
    rows: Iterable[Sequence[str]],
    caption: str = "",
    *,
    text: Sequence[int] = (0,),
    strong: Iterable[int] = (),
    title: str = "",
) -> TableBlock | None:
    """Make a table if there are rows; `head`: the columns, as one text with ``|`` between them."""
    columns = [name.strip() for name in head.split("|")] if isinstance(head, str) else head
    found = tuple(tuple(row) for row in rows)
    if not found:
        return None
    return TableBlock(tuple(columns), found, tuple(text), caption, tuple(strong), title)


def assumed(*texts: str) -> tuple[Block, ...]:
    """Return the assumptions of a report."""
    return Paragraph("Assumptions:"), listed(texts)


def run_again(name: str) -> tuple[Block, ...]:
    """Return the command that verifies a folder; empty without the name of the folder."""
    if not name:
        return ()
    return (
        Paragraph("To repeat the run and compare every byte:"),
        Paragraph(f"strapdown verify {name}", "mono"),
    )


def capital(text: str) -> str:
    """Return a text with a capital first letter; that of a name, ``gnss.position``, stays."""
    return text if _NAME.match(text) else f"{text[:1].upper()}{text[1:]}"


#: A file or a measurement at the beginning of a text.
_NAME = re.compile(r"[\w-]+\.\w")


def findings_list(findings: Iterable[Finding], words: Words = "python") -> Items | Paragraph:
    """Return findings with their locations and remedies."""
    rows = []
    for finding in findings:
        parts = (finding.file, finding.quantity, finding.row and f"row {finding.row}")
        text, remedy = finding.sentence(words), finding.advice(words)
        where = ", ".join(str(p) for p in parts if p)
        rows.append((where, f"{text}. {capital(remedy)}." if remedy else text))
    return Items(tuple(rows)) if rows else Paragraph("None.")


# Whether an answer can be trusted, and why.


MOST_SAID = 2  # reasons against an answer in one sentence
WORDS = {
    "trusted": "The result can be trusted",
    "reserve": "Use with caution",
    "distrusted": "Do not trust the result",
}


@dataclass(frozen=True)
class Trust:
    """Verdict on an answer, with its reasons.

    `verdict`, {'trusted', 'reserve', 'distrusted'}. `reasons`: a note supports the answer, a
    warning contradicts it. `short`: supporting reasons in short form.
    """

    verdict: str
    reasons: tuple[Finding, ...]
    short: tuple[Finding, ...] = ()

    @property
    def supporting(self) -> tuple[Finding, ...]:
        """Reasons that support the answer."""
        return tuple(one for one in self.reasons if one.severity == "note")

    @property
    def against(self) -> tuple[Finding, ...]:
        """Reasons against the answer."""
        return tuple(one for one in self.reasons if one.severity != "note")

    @property
    def sentence(self) -> str:
        """The verdict in words, with the reasons against the answer."""
        against = [one.sentence() for one in self.against]
        said = WORDS[self.verdict]
        if against:
            more = len(against) - MOST_SAID
            rest = f"; and {more} more, under 'The answer'" if more > 0 else ""
            return f"{said}: {'; '.join(against[:MOST_SAID])}{rest}."
        short = [one.sentence() for one in self.short]
        if len(short) > 1:
            short = [f"{', '.join(short[:-1])}, and {short[-1]}"]
        return f"{said}: {short[0]}." if short else f"{said}."

    @property
    def paragraph(self) -> Paragraph:
        """The verdict for page one."""
        return Paragraph(self.sentence, "lead" if self.verdict == "trusted" else "warning")

    @property
    def blocks(self) -> tuple[Block, ...]:
        """Every reason, for and against."""
        said = tuple(
            ("For" if one.severity == "note" else "Against", f"{one.sentence()}.")
            for one in self.reasons
        )
        if not said:
            return ()
        return Paragraph("Evidence for and against the answer:"), Items(said)

    def json(self) -> dict[str, Any]:
        """Return the verdict for programs."""
        return {
            "verdict": self.verdict,
            "for": [f.plain("file") for f in self.supporting],
            "against": [f.plain("file") for f in self.against],
        }


def reason(good: bool, code: str, **data: Any) -> Finding:
    """Return a reason for an answer or against it."""
    return Finding(code, severity="note" if good else "warning", data=data)


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


def _plain(value: T, limit: int) -> T:
    """Copy of a value of any depth with plain texts."""
    made: Any = value
    if isinstance(value, str):
        made = plain_text(value, limit)
    elif isinstance(value, tuple):
        made = tuple(_plain(item, limit) for item in value)
    elif is_dataclass(value) and not isinstance(value, type):
        limits, plain = _LIMITS.get(type(value), {}), {}
        for name in (f.name for f in fields(value) if f.init):
            part, most = getattr(value, name), limits.get(name, _LABEL)
            if name == "slug":
                plain[name] = _SLUG.sub("-", part)[:80].strip("-") or "part"
            elif isinstance(value, Picture) and name == "svg":
                plain[name] = plain_text(part, _MARKED * len(part) + 1, lines=True)
            elif isinstance(value, Paragraph) and value.kind == "mono" and name == "text":
                plain[name] = plain_text(part, most, lines=True)
            else:
                plain[name] = _plain(part, most)
        made = replace(value, **plain)
    return made  # type: ignore[no-any-return]


# Sanitizing of external text: no control characters, no invisible characters.


_CUT = "… ({} characters)"
# More combining marks on one letter would overlap the lines above and below.
_MOST_COMBINING = 3
# Control, format (direction, zero width), lone surrogates, private use: no glyph of their own.
_SHAPELESS = frozenset({"Cc", "Cf", "Cs", "Co"})
_COMBINING = frozenset({"Mn", "Me"})
# Anything but printable ASCII, which needs no look.
_OTHER = re.compile(r"[^ -~]+")


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

    def marked(found: re.Match[str]) -> str:
        """Characters with a mark for each that has no glyph of its own."""
        out: list[str] = []
        combining = 0
        for char in found[0]:
            kind = unicodedata.category(char)
            combining = combining + 1 if kind in _COMBINING else 0
            # No characters, and never will be.
            never = ord(char) & 0xFFFE == 0xFFFE or 0xFDD0 <= ord(char) <= 0xFDEF
            if char in "\n\r\u2028\u2029":
                out.append("\n" if lines else " ")
            elif char == "\t":
                out.append(" ")
            elif kind in _SHAPELESS or never or combining > _MOST_COMBINING:
                out.append(f"[U+{ord(char):04X}]")
            else:
                out.append(char)
        return "".join(out)

    made = _OTHER.sub(marked, text[:limit].replace("\r\n", "\n"))
    if len(text) <= limit and len(made) <= limit:
        return made
    count = _CUT.format(len(text))
    return made[: max(0, limit - len(count))] + count


# A document as plain data, from which page and PDF are laid out alike.


Place = Callable[[str], str]


def draw_stills(document: Document) -> tuple[str, ...]:
    """Draw the charts of a document for paper.

    Returns: one SVG per chart, in document order.
    """
    from strapdown.report.chart_svg import still

    return tuple(still(c) for c in drawings(document.plain) if isinstance(c, Chart))


def document_data(
    document: Document, stills: Sequence[str], place: Place, *, alive: bool
) -> dict[str, Any]:
    """Return a document as data for a template.

    `document`: its texts are made plain here. `stills`: from `draw_stills`. `place`: takes a whole
    SVG and returns the template's reference to it. `alive`: for the page: a chart has its drawing
    under ``svg``, an animation its scene. `DataError`: if a picture is not XML. `ValueError`: if a
    row of a table does not have as many cells as there are columns.
    """
    plain = document.plain
    writer = _Writer(iter(stills), place, alive)
    front = [writer.block(block) for block in plain.front]
    left = MOST_OPEN - sum(map(_figures_in, plain.front))
    sections = []
    for number, section in enumerate((s for s in plain.sections if s.blocks), start=1):
        kept: list[dict[str, Any]] = []
        more: list[dict[str, Any]] = []
        shown = 0 if section.folded else max(0, min(section.figures, left))
        for block in section.blocks:
            figures = _figures_in(block)
            beyond = alive and not section.folded and figures > shown
            (more if beyond else kept).append(writer.block(block))
            if figures and not beyond and not section.folded:
                shown, left = shown - figures, left - figures
        held = (
            (sum(map(_figures_in, section.blocks)), "figure"),
            (sum(isinstance(block, TableBlock) for block in section.blocks), "table"),
        )
        holds = ", ".join(f"{n} {name}{'s' * (n > 1)}" for n, name in held if n)
        sections.append(
            {
                "number": number,
                "anchor": f"{number}-{section.slug}",
                "title": section.title,
                "folded": section.folded,
                "holds": holds if section.folded else "",
                "blocks": kept,
                "more": more,
            }
        )
    return {
        "title": plain.title,
        "subtitle": plain.subtitle,
        "footer": plain.footer,
        "facts": plain.facts,
        "links": plain.links,
        "front": front,
        "sections": sections,
    }


def _figures_in(block: Block) -> int:
    """Figures that a block shows."""
    if isinstance(block, KeyFigures):
        return len(block.pictures)
    return int(isinstance(block, Chart | Picture | Animation))


@dataclass
class _Writer:
    """Blocks as data; figures and tables are numbered in document order."""

    stills: Iterator[str]
    place: Place
    alive: bool
    figures: Iterator[int] = field(default_factory=lambda: count(1))
    tables: Iterator[int] = field(default_factory=lambda: count(1))

    def block(self, block: Block) -> dict[str, Any]:
        """Return one block."""
        match block:
            case Paragraph():
                return {"kind": "paragraph", "style": block.kind, "text": block.text}
            case Items():
                return {"kind": "items", "rows": block.rows, "numbered": block.numbered}
            case Links() | Facts():
                return {"kind": type(block).__name__.lower(), "rows": block.rows}
            case TableBlock():
                columns, rows = range(len(block.columns)), range(len(block.rows))
                if any(len(row) != len(columns) for row in block.rows):
                    raise ValueError(
                        f"a row of the table {block.caption!r} has not as many cells as columns"
                    )
                return {
                    "kind": "table",
                    "title": block.title,
                    "number": next(self.tables) if block.caption or block.title else 0,
                    "columns": list(block.columns),
                    "rows": [list(row) for row in block.rows],
                    "words": [column in block.text for column in columns],
                    "caption": block.caption,
                    "strong": [row in block.strong for row in rows],
                    "passed": [[(row, c) in block.passed for c in columns] for row in rows],
                }
            case Chart():
                drawn = next(self.stills)
                shown = {"svg": drawn, "x_label": block.x_label}
                return {
                    "kind": "chart",
                    "number": next(self.figures),
                    "title": block.title,
                    "caption": block.caption,
                    "alt": f"{block.title}. {block.caption}".strip(),
                    "width_mm": 170.0,
                    "still_caption": "",
                    "live_caption": "",
                    **(shown if self.alive else {"still": self.place(drawn)}),
                }
            case Picture():
                return self._picture(block) | {"kind": "picture", "number": next(self.figures)}
            case Animation():
                number = next(self.figures)
                still: dict[str, Any] = {"still": "", "still_caption": "", "alt": block.title}
                if block.stills is not None:
                    still = self._picture(block.stills)
                    still["still_caption"] = block.stills.caption
                return {
                    **still,
                    "kind": "animation",
                    "number": number,
                    "title": block.title,
                    "caption": block.caption,
                    "live_caption": block.live_caption,
                    **({"scene": block.scene} if self.alive else {}),
                }
            case KeyFigures():
                pictures = [self._picture(picture) for picture in block.pictures]
                figures = [vars(one) for one in block.figures]
                return {"kind": "key_figures", "figures": figures, "pictures": pictures}

    def _picture(self, picture: Picture) -> dict[str, Any]:
        from xml.etree import ElementTree

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
            "still": self.place(picture.svg),
            "width_mm": float(picture.width_mm),
        }


# Drawings of a document as files beside the page.


def drawings(document: Document) -> list[Chart | Picture | Animation]:
    """Return every chart, picture and animation, in report order."""
    found: list[Chart | Picture | Animation] = []
    for block in (*document.front, *(b for s in document.sections for b in s.blocks)):
        if isinstance(block, Chart | Picture | Animation):
            found.append(block)
        elif isinstance(block, KeyFigures):
            found += block.pictures
    return found


def write_drawings(document: Document, stills: Sequence[str], folder: Path) -> None:
    """Write every drawing of a report to a folder, which is created.

    `stills`: drawn charts from `draw_stills`, one per chart.
    """
    folder.mkdir()
    drawn = iter(stills)
    for block in drawings(document):
        match block:
            case Chart(slug=slug):
                write_text(folder / f"{slug}.svg", next(drawn))
            case Picture() as picture:
                write_text(folder / f"{picture.slug}.svg", picture.svg)
            case Animation(stills=Picture() as picture):
                write_text(folder / f"{picture.slug}.svg", picture.svg)


def write_text(path: Path, text: str) -> None:
    """Write a text file, the same bytes on every system."""
    path.write_text(text, encoding="utf-8", newline="\n")

"""A document with every text made plain, whoever wrote it."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import fields, is_dataclass, replace
from typing import Any, TypeVar

from strapdown.report.chart import Chart
from strapdown.report.document import (
    Animation,
    Document,
    Facts,
    Items,
    KeyFigure,
    Paragraph,
    Picture,
    Section,
    TableBlock,
)
from strapdown.report.plain_text import plain_text

__all__ = ["plain_document"]

# Characters, by what holds them: there is less room in a heading, a cell or a chart than in a
# paragraph.
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
# What plotly may read as markup; it would make links of others.
_MARKUP = re.compile(r"<(?!/?(?:b|i|br|sub|sup)\s*/?>)", re.IGNORECASE)
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
        By `plain_text`: paragraphs, items and captions to 4000 characters, facts and cells to
        1000, titles and what stands under a key figure to 300, its value to 40, other words to
        160; slugs to 80 letters, digits, ``_`` and ``-``. The page and the PDF do this themselves;
        whoever writes charts to files beside them does it first. A second pass does nothing.
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
    if isinstance(owner, Animation) and name == "figure":
        return _plain_figure(value)
    if isinstance(owner, Paragraph) and owner.kind == "mono" and name == "text":
        return plain_text(value, limit, lines=True)
    return _plain(value, limit)


def _plain_figure(value: Any) -> Any:
    """Copy of plotly's plain data in which texts cannot link to anywhere."""
    if isinstance(value, str):
        # Numbers may be packed into long texts: nothing is cut.
        return _MARKUP.sub("&lt;", plain_text(value, _MARKED * len(value) + 1))
    if isinstance(value, Mapping):
        return {str(key): _plain_figure(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain_figure(item) for item in value]
    return value

"""A document with every text made plain, whoever wrote it."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import fields, is_dataclass, replace
from typing import Any, TypeVar

from strapdown.report.chart import Chart
from strapdown.report.document import Animation, Document, Paragraph, Picture
from strapdown.report.plain_text import LONGEST, plain_text

__all__ = ["plain_document"]

# Words in a chart and in a heading have little room.
_LABEL, _TITLE = 160, 300
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
        By `plain_text`: titles to 300 characters, words in charts to 160, others to 4000; slugs
        to letters, digits, ``_`` and ``-``. The page and the PDF do this themselves; whoever
        writes charts to files beside them may do it first. A second pass does nothing.
    """
    return _plain(document, LONGEST)


def _plain(value: T, limit: int) -> T:
    """Copy of a value of any depth with plain texts."""
    made: Any = value
    if isinstance(value, str):
        made = plain_text(value, limit)
    elif isinstance(value, tuple):
        made = tuple(_plain(item, limit) for item in value)
    elif is_dataclass(value) and not isinstance(value, type):
        made = replace(value, **{f.name: _field(value, f.name, limit) for f in fields(value)})
    return made  # type: ignore[no-any-return]


def _field(owner: Any, name: str, limit: int) -> Any:
    value = getattr(owner, name)
    if name == "slug":
        return _SLUG.sub("-", value)[:80].strip("-") or "part"
    if isinstance(owner, Picture) and name == "svg":
        return value
    if isinstance(owner, Animation) and name == "figure":
        return _plain_figure(value)
    if isinstance(owner, Paragraph) and owner.kind == "mono" and name == "text":
        return plain_text(value, lines=True)
    if name in ("caption", "alt"):
        return plain_text(value)
    if name in ("title", "subtitle"):
        return plain_text(value, _TITLE)
    return _plain(value, _LABEL if isinstance(owner, Chart) else limit)


def _plain_figure(value: Any) -> Any:
    """Copy of plotly's plain data in which texts cannot link to anywhere."""
    if isinstance(value, str):
        # Numbers may be packed into long texts: nothing is cut.
        return _MARKUP.sub("&lt;", plain_text(value, len(value) * 10 + 1))
    if isinstance(value, Mapping):
        return {str(key): _plain_figure(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain_figure(item) for item in value]
    return value

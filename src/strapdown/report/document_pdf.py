"""A document as a PDF: the same bytes for the same document and version of typst."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any

from strapdown.errors import ConfigError, DataError
from strapdown.report.document import Document
from strapdown.report.document_data import document_data, draw_stills
from strapdown.report.pdf_letters import shown

__all__ = ["write_pdf"]

_TEMPLATE = "document.typ"


def write_pdf(document: Document, path: Path, *, stills: Sequence[str] | None = None) -> None:
    """Write a document as a PDF of A4 pages.

    Parameters
    ----------
    document : Document
        Texts are made plain by `document_text.plain_document`, and reach typst as values only.
    path : Path
    stills : sequence of str, optional
        Charts for paper from `document_data.draw_stills`, where they are drawn already.

    Raises
    ------
    ConfigError
        If typst is not installed.
    DataError
        If a picture is no SVG, or the document cannot be laid out.

    Notes
    -----
    No date, and no font but those inside typst; what these cannot show stands as its number, such
    as ``[U+1F697]``. Tagged, PDF/UA-1. Typst reads from a folder of its own, which is gone
    afterwards, and from nowhere else.
    """
    path.write_bytes(_pdf(document, draw_stills(document) if stills is None else stills))


def _pdf(document: Document, stills: Sequence[str]) -> bytes:
    typst = _typst()
    with tempfile.TemporaryDirectory(prefix="strapdown-") as name:
        folder = Path(name)
        count = 0

        def place(svg: str) -> str:
            nonlocal count
            count += 1
            file = f"picture-{count}.svg"
            (folder / file).write_text(shown(svg), encoding="utf-8", newline="\n")
            return file

        data = document_data(document, stills, place, alive=False)
        text = shown(json.dumps(data, ensure_ascii=False, allow_nan=False))
        (folder / "document.json").write_text(text, encoding="utf-8", newline="\n")
        template = files("strapdown.report").joinpath("templates", _TEMPLATE).read_bytes()
        (folder / _TEMPLATE).write_bytes(template)
        try:
            return _compiled(typst, folder)
        except typst.TypstError as error:
            raise DataError(
                "report.document-cannot-laid-out",
                file="report.pdf",
                splitlines=str(error).splitlines()[0],
            ) from error


def _compiled(typst: Any, folder: Path) -> bytes:
    """Return the PDF, for readers of the screen if its letters allow it (PDF/UA-1)."""

    def compiled(**options: Any) -> bytes:
        pdf: bytes = typst.compile(
            str(folder / _TEMPLATE),
            root=str(folder),
            font_paths=[],
            ignore_system_fonts=True,
            format="pdf",
            package_path=str(folder),
            package_cache_path=str(folder),
            timestamp=0,
            **options,
        )
        return pdf

    try:
        return compiled(pdf_standards="ua-1")
    except typst.TypstError as error:
        # Marks that no font joins to their letter are shown as boxes, which PDF/UA does not allow.
        if "PDF/UA-1" not in str(error):
            raise
        return compiled()


def _typst() -> Any:
    try:
        import typst
    except ImportError as error:
        raise ConfigError("report.pdf-laid-out-typst-not") from error
    return typst

"""A document as a PDF: the same bytes everywhere, no date, no words that act."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tempfile
import zlib
from pathlib import Path

import pytest
from tests.coded import coded

import strapdown
from strapdown.errors import ConfigError, DataError
from strapdown.report.document import (
    Document,
    Facts,
    Items,
    KeyFigures,
    Paragraph,
    Picture,
    TableBlock,
    draw_stills,
)
from strapdown.report.document_html import document_page
from strapdown.report.document_pdf import shown, write_pdf

sys.path.insert(0, str(Path(__file__).parent))
from rich_document import EVIL, picture, rich_document

HEAD = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 9 9">'


def short(*blocks):
    return Document("Title", "", (("name", "text"),), blocks, (), "footer")


def streams(pdf):
    """Everything in a PDF, unpacked."""
    found = [pdf]
    for match in re.finditer(rb"stream\r?\n(.*?)endstream", pdf, re.S):
        try:
            found.append(zlib.decompressobj().decompress(match.group(1)))
        except zlib.error:
            continue
    return b"\n".join(found)


@pytest.fixture(scope="module")
def evil_pdf(tmp_path_factory):
    path = tmp_path_factory.mktemp("pdf") / "report.pdf"
    document = rich_document(EVIL, charts=3)
    write_pdf(document, path, stills=draw_stills(document))
    return path.read_bytes()


def test_a_pdf_of_hostile_texts_has_title_language_outline_and_tags(evil_pdf):
    inside = streams(evil_pdf)
    assert evil_pdf.startswith(b"%PDF-1.7")
    assert b"/Type/Outlines" in inside.replace(b" ", b"")
    assert b"/Lang" in inside
    assert b"/StructTreeRoot" in inside
    assert b"<pdfuaid:part>1" in inside
    # 12 sections and more, none of which is empty.
    assert inside.count(b"/Type/Page/") + inside.count(b"/Type/Page\n") > 8


@pytest.mark.skipif(not shutil.which("pdftotext"), reason="poppler is not installed")
def test_its_text_can_be_searched_and_copied(tmp_path):
    word = "9f86d081884c7d659a2feaa0c55ad015a3bf4f1b2b0b822cd15d6c15b0f00a08"
    write_pdf(short(Paragraph(f"sha256 {word}"), Paragraph('#eval("1") $x$ ±')), tmp_path / "a.pdf")
    command = ["pdftotext", str(tmp_path / "a.pdf"), "-"]
    text = subprocess.run(command, capture_output=True, check=True, encoding="utf-8").stdout
    for words in ("Title", "name", "text", f"sha256 {word}", '#eval("1") $x$ ±', "1 of 1"):
        assert words in text


def test_no_date_and_no_one_to_run(evil_pdf):
    inside = streams(evil_pdf)
    for word in (b"CreationDate", b"ModDate", b"CreateDate", b"ModifyDate", b"/JavaScript", b"/JS"):
        assert word not in inside
    assert b"/Launch" not in inside
    assert b"/URI" not in inside


def test_nothing_in_a_block_is_no_reason_to_fail(tmp_path):
    empty = (
        Paragraph(""),
        Items(()),
        Facts(()),
        TableBlock((), ()),
        TableBlock(("a",), ()),
        KeyFigures(()),
    )
    for document in (Document("", "", (), (), ()), short(*empty)):
        write_pdf(document, tmp_path / "a.pdf")
        assert "<h1>" in document_page(document)
    with pytest.raises(ValueError, match="'units' has not as many cells"):
        write_pdf(short(TableBlock(("a",), (("1", "2"),), caption="units")), tmp_path / "a.pdf")


def test_a_picture_higher_than_a_page_is_made_to_fit(tmp_path):
    svg = '<svg xmlns="http://www.w3.org/2000/svg" width="100" height="{}"/>'
    sizes = []
    for height in (100, 400):
        write_pdf(short(Picture("p", svg.format(height), "p", alt="alt")), tmp_path / "a.pdf")
        inside = streams((tmp_path / "a.pdf").read_bytes())
        box = re.search(rb"BBox ?\[([^]]*)\]", inside)
        left, bottom, right, top = map(float, box.group(1).split())
        sizes.append((right - left, top - bottom))
    point = 25.4 / 72.0  # mm
    # As wide as the column, 170 mm; not 680 mm high, but 215 mm. The file has seven digits.
    assert sizes[0] == pytest.approx((170.0 / point, 170.0 / point), abs=1e-3)
    assert sizes[1] == pytest.approx((215.0 / 4 / point, 215.0 / point), abs=1e-3)


def test_the_bytes_depend_on_nothing_around(tmp_path):
    """Folder, time zone, language, home, mask, date of the build: none is in the file."""
    code = (
        "import os, sys; os.umask(int(sys.argv[2], 8))\n"
        "from pathlib import Path\n"
        "from rich_document import picture, table\n"
        "from strapdown.report.document import Document, Paragraph\n"
        "from strapdown.report.document_pdf import write_pdf\n"
        "blocks = (Paragraph('words'), picture(), table(3))\n"
        "write_pdf(Document('t', '', (), blocks, ()), Path(sys.argv[1]))\n"
    )
    places = [str(Path(strapdown.__file__).parents[1]), str(Path(__file__).parent)]
    around = [
        {"TZ": "Asia/Tokyo", "LC_ALL": "C", "HOME": str(tmp_path), "mask": "077"},
        {"TZ": "UTC", "LC_ALL": "C.UTF-8", "SOURCE_DATE_EPOCH": "1700000000", "mask": "022"},
    ]
    made = []
    for k, more in enumerate(around):
        folder = tmp_path / f"{k}" / ("deep" * k)
        folder.mkdir(parents=True)
        mask = more.pop("mask")
        paths = {"PYTHONPATH": os.pathsep.join(places), "TMPDIR": str(folder)}
        environment = os.environ | {"PYTHONHASHSEED": str(k)} | paths | more
        command = [sys.executable, "-c", code, str(folder / "a.pdf"), mask]
        subprocess.run(command, check=True, env=environment, cwd=folder)
        assert [p.name for p in folder.iterdir()] == ["a.pdf"]
        made.append((folder / "a.pdf").read_bytes())
    assert made[0] == made[1]


@pytest.mark.parametrize(
    "inside",
    [
        '<image href="/etc/hostname" width="9" height="9"/>',
        '<image href="../../../etc/hostname" width="9" height="9"/>',
        '<image href="http://127.0.0.1:9/x.png" width="9" height="9"/>',
    ],
)
def test_a_picture_reaches_nothing_outside(inside, tmp_path):
    evil = Picture("evil", f"{HEAD}{inside}</svg>", "title", alt="alt")
    with pytest.raises(DataError, check=coded("report.document-cannot-laid-out")):
        write_pdf(short(evil), tmp_path / "a.pdf")
    assert not (tmp_path / "a.pdf").exists()


def test_without_typst_the_remedy_is_said_and_nothing_is_left(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "typst", None)
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    with pytest.raises(ConfigError, check=coded("report.pdf-laid-out-typst-not")):
        write_pdf(short(), tmp_path / "a.pdf")
    assert not list(tmp_path.iterdir())


def test_what_no_font_shows_stands_as_its_number(tmp_path):
    assert shown("Straße ± 2° − Ω") == "Straße ± 2° − Ω"
    assert shown("\U0001f697 \u8eca \u26a0\ufe0f") == "[U+1F697] [U+8ECA] \u26a0"
    # The whole repertoire, which typst refuses as PDF/UA if a glyph is missing.
    letters = [chr(c) for c in range(0xA1, 0x20000) if shown(chr(c)) == chr(c)]
    assert len(letters) > 7000
    parts = (Paragraph(" ".join(letters[k::5])) for k in range(5))
    write_pdf(short(*parts, picture(text="\u8eca")), tmp_path / "a.pdf")
    assert b"pdfuaid" in streams((tmp_path / "a.pdf").read_bytes())

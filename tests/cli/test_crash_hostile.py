"""Texts of a case and of its records that attack: they reach every output as text alone."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
import unicodedata
from html.parser import HTMLParser
from pathlib import Path
from xml.etree import ElementTree

import pytest

sys.path.insert(0, str(Path(__file__).parent))

from hostile_case import EVIL, write_hostile_case

from strapdown.formats import read_raw

ALERT = "alert(1)"
SVG = "{http://www.w3.org/2000/svg}"
# What charts and pictures draw with: nothing that runs, links or loads.
DRAWING = {
    "svg", "g", "path", "defs", "use", "style", "clipPath", "rect", "text", "tspan", "title",
    "line", "circle", "ellipse", "polygon", "polyline", "desc", "marker", "metadata", "pattern",
}  # fmt: skip
FOREIGN = {"img", "svg", "iframe", "object", "embed", "a", "form", "base", "link", "meta", "b"}


class Page(HTMLParser):
    def __init__(self):
        super().__init__()
        self.tags, self.scripts, self.text, self._in = [], [], [], ""

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        self._in = tag if tag in ("script", "style") else ""
        if tag == "script":
            self.scripts.append((dict(attrs), ""))

    def handle_endtag(self, tag):
        self._in = "" if tag == self._in else self._in

    def handle_data(self, data):
        if self._in == "script":
            attrs, text = self.scripts[-1]
            self.scripts[-1] = (attrs, text + data)
        elif not self._in:
            self.text.append(data)


@pytest.fixture(scope="module")
def hostile(sealed_crash, tmp_path_factory, run_cli):
    root = tmp_path_factory.mktemp("hostile")
    made = run_cli("simulate", "pole", "-q", "--format", "mme", "--out", root / "mme")
    assert made.code == 0, made.err
    case = write_hostile_case(sealed_crash.records, root / "mme", root / "case")
    done = run_cli("crash", case, "--out", root / "out")
    assert done.code == 0, done.err
    return root / "out", done


@pytest.fixture(scope="module")
def page(hostile):
    parser = Page()
    parser.feed((hostile[0] / "report.html").read_text(encoding="utf-8"))
    return parser


def commands(text):
    """Characters that act: of control, of direction, of no width; the end of a line may stay."""
    return {c for c in text if c != "\n" and unicodedata.category(c) in ("Cc", "Cf", "Zl", "Zp")}


@pytest.mark.slow
def test_the_page_has_no_tag_attribute_or_script_from_outside(page, sealed_crash):
    ours = Page()
    ours.feed((sealed_crash.folder / "report.html").read_text(encoding="utf-8"))
    known = {(tag, key) for tag, attrs in ours.tags for key in attrs}
    # A chart of this case may have points where the other has none, its summary a warning.
    known |= {("path", "class"), ("g", "data-at"), ("text", "stroke-linejoin"), ("p", "role")}
    assert {attrs["role"] for tag, attrs in page.tags if tag == "p" and "role" in attrs} <= {"note"}
    assert {tag for tag, _ in page.tags} <= {tag for tag, _ in ours.tags}
    assert {(tag, key) for tag, attrs in page.tags for key in attrs} <= known
    assert not [k for _, attrs in page.tags for k in attrs if k.startswith("on")]
    # The program is the same as ever; the others are data that no browser runs.
    running = [text for attrs, text in page.scripts if attrs.get("type", "") != "application/json"]
    assert running == [t for a, t in ours.scripts if a.get("type", "") != "application/json"]
    for attrs, text in page.scripts:
        if attrs.get("type") == "application/json":
            json.loads(text)
            assert "<" not in text
    for tag, attrs in page.tags:
        for key in ("src", "href"):
            value = attrs.get(key) or ""
            assert value.startswith(("data:image/svg+xml;base64,", "#")) or not value, (tag, value)


def test_the_page_says_the_texts_as_they_are(page):
    text = "".join(page.text)
    assert text.count(EVIL) >= 5
    assert "[U+202E]" in text
    assert "[U+0007]" in text
    assert not commands(text)
    assert "49" not in re.findall(r"\\\{(.*?)\}", text)


def test_pictures_hold_nothing_that_runs(hostile):
    pictures = sorted((hostile[0] / "figures").glob("*.svg"))
    assert len(pictures) > 15
    said = 0
    for path in pictures:
        text = path.read_text(encoding="utf-8")
        for element in ElementTree.fromstring(text).iter():
            name = element.tag.removeprefix(SVG)
            assert name in DRAWING or element.tag.startswith("{"), (path.name, element.tag)
            assert name not in {"script", "foreignObject", "image", "a", "set", "animate"}
            for key, value in element.attrib.items():
                assert not key.lower().startswith("on"), path.name
                if key.endswith("href"):
                    assert value.startswith("#"), path.name
            said += ALERT in (element.text or "")
        assert not commands(text)
    assert said > 0


def test_the_pdf_says_the_texts_and_runs_nothing(hostile):
    pdf = hostile[0] / "report.pdf"
    raw = pdf.read_bytes()
    for name in (b"/JavaScript", b"/JS", b"/Launch", b"/OpenAction", b"/URI", b"/EmbeddedFile"):
        assert name not in raw
    if shutil.which("pdftotext") is None:
        pytest.skip("no pdftotext here")
    done = subprocess.run(["pdftotext", str(pdf), "-"], capture_output=True, check=True)
    text = re.sub(r"\s+", "", done.stdout.decode("utf-8"))
    assert text.count(re.sub(r"\s+", "", EVIL)) >= 3
    assert '#eval("1")' in text
    assert "[U+202E]" in text


def test_the_json_holds_the_texts_and_is_json(hostile):
    text = (hostile[0] / "crash.json").read_text(encoding="utf-8")
    told = json.loads(text)
    assert told["title"] == told["case"]["number"] == EVIL
    assert told["answers"][0]["recorder"] == EVIL + "1"
    # U+202E of a text is kept in data, as an escape it is not; bytes are UTF-8 throughout.
    text.encode("utf-8")


def test_tables_have_columns_and_numbers_alone(hostile):
    for path in hostile[0].glob("*.csv"):
        assert re.fullmatch(r"[a-z0-9-]+\.csv", path.name)
        text = path.read_text(encoding="utf-8")
        assert "alert" not in text
        assert not commands(text)
        assert len(read_raw(path).columns) > 5


def test_the_terminal_is_not_commanded(hostile):
    _, done = hostile
    assert not commands(done.out)
    assert not commands(done.err)
    assert EVIL in done.out


def test_nothing_was_written_beside_the_folder(hostile):
    root = hostile[0].parent
    assert sorted(p.name for p in root.iterdir()) == ["case", "mme", "out"]
    names = {p.relative_to(hostile[0]).parts[0] for p in hostile[0].rglob("*")}
    assert {"report.html", "report.pdf", "crash.json", "inputs", "figures"} <= names


def test_it_verifies_with_such_names_of_files(hostile, monkeypatch):
    import strapdown.report.verify as module

    class RunAgainError(Exception):
        pass

    def refuse(command, configuration, out, sealed):
        for unit in configuration["case"]["units"]:
            for triad in unit["accelerometers"]:
                assert Path(triad["path"]).exists()
        raise RunAgainError

    monkeypatch.setattr(module, "_rerun", refuse)
    with pytest.raises(RunAgainError):
        module.verify(hostile[0])

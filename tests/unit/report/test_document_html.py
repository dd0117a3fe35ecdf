"""A document as a page: whole, offline, and safe from its own texts."""

from __future__ import annotations

import base64
import json
import re
import sys
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from tests.coded import coded

from strapdown.errors import DataError
from strapdown.report.chart import BLUE, Chart, Line, Panel
from strapdown.report.document import (
    Animation,
    Document,
    KeyFigure,
    KeyFigures,
    Paragraph,
    Picture,
    TableBlock,
    document_data,
    draw_stills,
    section,
)
from strapdown.report.document_html import document_page

sys.path.insert(0, str(Path(__file__).parent))
from rich_document import EVIL, picture, rich_document


class Page(HTMLParser):
    """Elements with their attributes, text outside scripts and styles, and the scripts."""

    def __init__(self, page):
        super().__init__()
        self.elements, self.scripts, self.words, self._in = [], [], [], ""
        self.feed(page)
        self.text = " ".join(" ".join(self.words).split())

    def handle_starttag(self, tag, attrs):
        self.elements.append((tag, dict(attrs)))
        self._in = tag if tag in ("script", "style") else self._in
        if tag == "script":
            self.scripts.append("")

    def handle_endtag(self, tag):
        self._in = "" if tag in ("script", "style") else self._in

    def handle_data(self, data):
        if self._in == "script":
            self.scripts[-1] += data
        elif not self._in:
            self.words.append(data)

    def all(self, tag):
        return [attributes for name, attributes in self.elements if name == tag]


@pytest.fixture(scope="module")
def document():
    return rich_document(EVIL, charts=3)


@pytest.fixture(scope="module")
def stills(document):
    return draw_stills(document)


@pytest.fixture(scope="module")
def text(document, stills):
    return document_page(document, stills=stills)


@pytest.fixture(scope="module")
def page(text):
    return Page(text)


def test_texts_from_outside_stay_texts(page):
    assert "alert(1)" not in page.scripts[-1]
    assert "<script>alert(1)</script>" in page.text
    # Every image is a picture of ours; nothing has a handler.
    assert all(image["src"].startswith("data:image/svg+xml;base64,") for image in page.all("img"))
    assert not [a for _, a in page.elements if any(name.startswith("on") for name in a)]
    kinds = [a.get("type") for a in page.all("script")]
    assert kinds == ["application/json"] * 2 + [None]
    assert "[U+202E]right to left" in page.text
    assert not re.search("[\u202e\u200b\x00\x07]", page.text)
    assert "aaaa… (20000 characters)" in page.text


def test_nothing_is_fetched_and_no_other_script_may_run(text, page):
    for tag, attributes in page.elements:
        for name in ("src", "href", "action", "data", "poster", "srcset"):
            assert attributes.get(name, "#")[:1] == "#" or tag == "img", (tag, attributes)
    # The address that stands in a text from outside is text.
    own = re.sub(r"<script.*?</script>|http://example.org", "", text, flags=re.S)
    assert not re.search(r"(?:https?:)?//\w+\.", re.sub(r"base64,[\w+/=]+", "", own))
    style = re.search(r"<style>(.*?)</style>", text, re.S).group(1)
    assert "url(" not in style
    assert "@import" not in style
    policy = page.all("meta")[1]["content"]
    assert policy.startswith("default-src 'none'; script-src 'sha256-")
    assert "unsafe-inline" not in policy.split("style-src")[0]


def test_the_policy_names_the_scripts_that_stand_in_the_page(page):
    import hashlib

    named = re.findall(r"'sha256-([\w+/=]+)'", page.all("meta")[1]["content"])
    digests = [hashlib.sha256(script.encode()).digest() for script in page.scripts[-1:]]
    assert named == [base64.b64encode(digest).decode() for digest in digests]


def test_charts_stand_as_svg_and_scenes_as_data_with_a_still(document, page):
    kinds = [a.get("data-figure") for a in page.all("figure")]
    blocks = [b for s in document.sections for b in s.blocks]
    assert kinds.count("chart") == len([b for b in blocks if isinstance(b, Chart)])
    assert len([a for a in page.all("svg") if "data-x" in a]) >= kinds.count("chart")
    assert not page.all("title")[1:]
    for script in page.scripts[:-1]:
        scene = json.loads(script)
        assert len(scene["frames"]) == len(scene["bodies"][0]["q"]) == 21
        assert "<script" not in script
    stills = [a for a in page.all("img") if a.get("class") == "still"]
    assert len(stills) == kinds.count("scene") == 2
    assert all(image["alt"] for image in page.all("img"))


def test_headings_are_numbered_and_listed(document, page):
    anchors = [a["href"] for a in page.all("a")][1:]
    heads = [a["id"] for a in page.all("h2")][1:]
    assert anchors == [f"#{name}" for name in heads]
    assert len(heads) == len(document.sections)
    assert [tag for tag, _ in page.elements if tag in ("h1", "h2", "h3")] == ["h1"] + ["h2"] * (
        len(heads) + 1
    )
    assert {a["scope"] for a in page.all("th")} == {"row", "col"}
    assert page.all("html") == [{"lang": "en"}]


def test_a_document_without_charts_has_no_script():
    page = Page(document_page(Document("t", "", (), (picture(),), ())))
    assert not page.scripts
    assert "script-src 'none'" in page.all("meta")[1]["content"]


def test_a_second_cleaning_does_nothing(document):
    once = document.plain
    again = once.plain
    assert (again.title, again.facts) == (once.title, once.facts)
    for a, b in zip(again.sections, once.sections, strict=True):
        for one, other in zip(a.blocks, b.blocks, strict=True):
            if hasattr(one, "scene"):
                assert one.scene.data() == other.scene.data()
            elif not isinstance(one, Chart):  # arrays have no single answer to ==
                assert one == other
    blocks = [block for section in once.sections for block in section.blocks]
    slugs = [b.slug for b in blocks if isinstance(b, Picture | Animation)]
    slugs += [b.slug for b in blocks if isinstance(b, Chart)]
    assert all(re.fullmatch(r"[\w-]{1,80}", slug) for slug in slugs), slugs


def test_what_is_no_svg_is_named():
    broken = Picture("plan", "<svg><g></svg>", "The plan")
    with pytest.raises(
        DataError, check=coded("report.picture-no-svg", quantity="The plan", file="report")
    ):
        document_page(Document("t", "", (), (broken,), ()))


def test_a_key_figure_breaks_before_its_bound_alone():
    keys = KeyFigures((KeyFigure("Heading", "180.8143\u00a0±\u00a00.0044°", "95 % bound"),))
    page = document_page(Document("t", "", (), (keys,), ()))
    assert '<dd class="value"><span>180.8143</span> <span>±&nbsp;0.0044°</span></dd>' in page
    (style,) = re.findall(r"\.keys \.value \{[^}]*\}", page)[:1]
    assert "nowrap" not in style


# Folds: what is open, and what is one click away.


def charts_of(count, slug="c"):
    return tuple(
        Chart(f"{slug}{k}", f"{slug} {k}", "", "time, s", (Panel("y", (curve_of(k),)),))
        for k in range(count)
    )


def curve_of(k):
    return Line(f"line {k}", np.array([0.0, 1.0]), np.array([0.0, k]), BLUE)


def paged(front, *sections):
    return document_page(Document("t", "", (), front, sections))


def open_figures(text):
    """Titles of the figures outside of any fold."""
    while "<details>" in text:
        text = re.sub(r"<details>(?:(?!<details>).)*?</details>", "", text, flags=re.S)
    return re.findall(r"<b>Figure \d+\.</b> <b>([^<]*)\.</b>", text)


def test_a_page_has_at_most_eight_open_figures():
    sections = [section(f"s{k}", f"S{k}", *charts_of(4, f"s{k}c")) for k in range(4)]
    text = paged(charts_of(2, "front"), *sections)
    # Two on the front, three of a section at most, eight in all; all of them are in the page.
    names = ["front 0", "front 1", "s0c 0", "s0c 1", "s0c 2", "s1c 0", "s1c 1", "s1c 2"]
    assert open_figures(text) == names
    assert text.count("<figure") == 18
    assert '<summary class="more">s0c 3</summary>' in text
    assert '<summary class="more">s2c 0; s2c 1; s2c 2; s2c 3</summary>' in text


def test_tables_and_words_of_an_open_section_stay_open():
    table = TableBlock(("a", "b"), (("x", "1"),), title="T")
    one = section("s", "S", *charts_of(2), table, Paragraph("Words."), figures=1)
    text = paged((), one)
    before = text[: text.index("<details>")]
    assert "Words." in before and "<table>" in before
    assert open_figures(text) == ["c 0"]


def test_a_folded_section_says_what_it_holds_and_takes_no_room_of_others():
    table = TableBlock(("a", "b"), (("x", "1"),), title="T")
    text = paged(
        (),
        section("method", "Method", *charts_of(9, "m"), table, folded=True),
        section("after", "After", *charts_of(3, "after")),
    )
    assert '<span class="holds">9 figures, 1 table</span>' in text
    assert open_figures(text) == ["after 0", "after 1", "after 2"]
    # The anchor of its heading is where the contents lead.
    assert re.search(r'<details><summary><h2 id="1-method">', text)


def test_paper_has_no_folds():
    document = Document("t", "", (), (), (section("s", "S", *charts_of(5), folded=False),))
    data = document_data(document, draw_stills(document), str, alive=False)
    assert [len(s["blocks"]) for s in data["sections"]] == [5]
    assert [s["more"] for s in data["sections"]] == [[]]


def test_a_page_of_folds_alone_has_its_script():
    text = paged((), section("s", "S", Paragraph("x"), folded=True))
    assert "beforeprint" in text


# For readers who do not see it.


def test_a_chart_is_a_group_and_a_column_without_a_name_has_no_header(text):
    table = TableBlock(("", "b"), (("x", "1"),), title="T")
    page = Page(paged(charts_of(1), section("s", "S", table)))
    # Names in a legend can be pressed: within an image a screen reader would not find them.
    (drawn,) = [a for a in page.all("svg") if "aria-label" in a]
    assert drawn["role"] == "group" and drawn["aria-label"] == "c 0."
    assert [a for a in page.all("svg") if a.get("role") == "img"] == []
    assert len(page.all("th")) == 2 and page.all("th")[0].get("scope") == "col"


def test_the_path_of_a_plan_has_the_time_of_each_of_its_points():
    stamps = np.array([10.0, 10.5, np.nan, 12.0, 13.25])
    x = np.array([0.0, 1.0, np.nan, 2.0, 3.0])
    line = Line("path", x, x, BLUE, stamps=stamps)
    plan = Chart("plan", "Path", "", "time, s", (Panel("north", (line,), x_label="east"),))
    text = paged((plan,))
    assert re.findall(r'data-stamps="([^"]*)"', text) == ["10.000 10.500", "12.000 13.250"]
    # It is linked with the charts over this axis, and does not write its name.
    assert 'data-x-label="time, s"' in text
    assert ">time, s</text>" not in text

"""The page: one offline file, in which nothing from outside can act."""

from __future__ import annotations

import re
from html.parser import HTMLParser

import pytest

from strapdown.api.attitude import compare_attitude
from strapdown.report.attitude import write_attitude
from strapdown.report.attitude_charts import charts
from strapdown.report.attitude_document import attitude_document
from strapdown.report.chart import BUCKETS, break_jumps, curve
from strapdown.report.document_html import document_page

EVIL = "</script><script>alert(1)</script><!--<img src=x onerror=alert(2)>"


class Elements(HTMLParser):
    """Every element with its attributes, and the text in scripts."""

    def __init__(self):
        super().__init__()
        self.found, self.scripts, self._in_script = [], [], False

    def handle_starttag(self, tag, attrs):
        self.found.append((tag, dict(attrs)))
        self._in_script = tag == "script"
        if self._in_script:
            self.scripts.append("")

    def handle_endtag(self, tag):
        self._in_script = False

    def handle_data(self, data):
        if self._in_script:
            self.scripts[-1] += data


@pytest.fixture(scope="module")
def evil_page(tmp_path_factory):
    folder = tmp_path_factory.mktemp("evil")
    path = folder / "<b>log&amp;.csv"
    lines = [f"t,{EVIL},wy,wz"] + [f"{0.01 * k:.2f},0.1,0.2,{0.001 * k}" for k in range(50)]
    path.write_text("\n".join(lines) + "\n")
    bench = compare_attitude(
        path,
        columns={"gyro_x": EVIL},
        gyro_unit="rad/s",
        reference=["end same as start", "0.2 roll 0 pitch 0 heading 0"],
    )
    return bench, document_page(attitude_document(bench))


def test_text_from_outside_stays_text(evil_page):
    bench, page = evil_page
    assert any(r.source == EVIL for r in bench.readings)
    elements = Elements()
    elements.feed(page)
    assert "alert(1)" not in "".join(elements.scripts)
    assert not [t for t, a in elements.found if t == "img" or "onerror" in a]
    assert "&lt;/script&gt;&lt;script&gt;alert(1)" in page
    assert "<b>log" not in page


def test_nothing_is_fetched(evil_page):
    elements = Elements()
    elements.feed(evil_page[1])
    for tag, attributes in elements.found:
        assert not {"src", "action", "data"} & attributes.keys(), (tag, attributes)
        assert attributes.get("href", "#")[0] == "#"
    style = re.search(r"<style>(.*?)</style>", evil_page[1], re.S).group(1)
    assert "url(" not in style
    assert "@import" not in style


def test_every_figure_of_the_page_also_stands_beside_it(evil_page, tmp_path):
    bench, page = evil_page
    seal = write_attitude(bench, tmp_path / "out")
    assert page.count('data-figure="chart"') == len(charts(bench))
    assert {p.stem for p in (seal.path / "figures").iterdir()} == {c.slug for c in charts(bench)}
    for chart in charts(bench):
        text = (seal.path / "figures" / f"{chart.slug}.svg").read_text(encoding="utf-8")
        assert "<script" not in text
        for panel in chart.panels:
            label = panel.x_label or chart.x_label
            assert re.search(r", (s|deg|deg/s|Hz|\S+ cycles per sample)$", label)


def test_thinning_keeps_peaks_ends_and_breaks():
    import numpy as np

    x = np.arange(100_000.0)
    y = np.sin(x / 500.0)
    y[54_321], y[70_000] = 9.0, np.nan
    line = curve("y", x, y, "#000000")
    a, b = line.x, line.y
    assert len(a) <= 2 * BUCKETS + 3
    assert (a[0], a[-1]) == (x[0], x[-1])
    assert np.nanmax(b) == 9.0
    assert np.isnan(b[a == 70_000]).all()
    assert (np.diff(a) > 0).all()


def test_a_heading_that_passes_north_is_no_vertical_line():
    import numpy as np

    out = break_jumps([350.0, 359.0, 2.0, 5.0])
    assert np.isnan(out[2])
    assert out[[0, 1, 3]].tolist() == [350.0, 359.0, 5.0]

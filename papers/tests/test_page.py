"""The folder that a reproduction is written to: numbers, figures and page, the same every time."""

from __future__ import annotations

import json
import re
import sys

import numpy as np
import pytest

from papers import page
from papers.reproduction import (
    HOLDS,
    Evidence,
    Figure,
    FigurePanel,
    Reproduction,
    Statement,
    Table,
    Trace,
)


def sample() -> Reproduction:
    x = np.linspace(0.0, 1.0, 5001)
    traces = (
        Trace("IMU1, ahead", x, np.sin(40.0 * x)),
        Trace("IMU1, aside", x, np.cos(40.0 * x)),
        Trace("truth", x, x, reference=True),
        Trace("taken", x[::500], x[::500], points=True),
    )
    panels = (FigurePanel("speed, m/s", traces), FigurePanel("place, m", traces[:1], log=True))
    return Reproduction(
        "sample",
        "A. Author, A <Title>, 2001",
        "It holds.",
        (Statement("key", "Section 1", "it is so", HOLDS, "", "seen", (Evidence("a", 1.0),), "f"),),
        (Table("t", "Numbers", "of a run", ("name", "m"), (("row", (1.0, None)),)),),
        (
            Figure(
                "f", "A figure", "caption", "chosen: 1 m", "time, s", panels, marks=((0.5, "m"),)
            ),
        ),
        (("Error", "computed - true"),),
    )


def test_writing_twice_gives_the_same_bytes(tmp_path):
    for name in ("one", "two"):
        page.write_reproduction(sample(), tmp_path / name)
    files = sorted(p.relative_to(tmp_path / "one") for p in (tmp_path / "one").rglob("*.*"))
    assert [str(f) for f in files] == [
        "curves.json",
        "figures/f.svg",
        "report.html",
        "reproduction.json",
    ]
    for f in files:
        assert (tmp_path / "one" / f).read_bytes() == (tmp_path / "two" / f).read_bytes()


def test_the_page_shows_statements_tables_and_figures_and_fetches_nothing():
    text = page.reproduction_page(sample())
    for part in ('id="key"', 'id="figure-f"', 'id="table-t"', "&lt;Title&gt;", "computed - true"):
        assert part in text
    assert not re.search(r'(src|href)="(?!#)', text)
    assert "mathdefault" not in text
    ids = re.findall(r'\bid="([^"]+)"', text)
    assert len(set(ids)) == len(ids)
    assert set(re.findall(r"url\(#([^)]+)\)", text)) <= set(ids)


def test_numbers_are_written_and_what_is_not_finite_is_null():
    made = sample()
    made.figures[0].panels[0].traces[3].y[2] = np.inf
    json.dumps(page.curves_json(made), allow_nan=False)
    found = json.loads(json.dumps(page.reproduction_json(made), allow_nan=False))
    assert found["verdicts"][HOLDS] == 1
    assert found["tables"][0]["rows"][0]["values"] == [1.0, None]


def test_a_long_curve_keeps_its_peaks():
    x = np.linspace(0.0, 1.0, 100_001)
    y = np.zeros_like(x)
    y[51_234], y[70_000], y[80_000] = 3.0, -2.0, np.nan
    _, kept = page.thinned(Trace("a", x, y))
    assert len(kept) < 4600
    assert np.nanmax(kept) == 3.0
    assert np.nanmin(kept) == -2.0
    assert np.isnan(kept).sum() == 1


def test_curves_of_one_legend_differ_in_color():
    x = np.zeros(2)
    names = ["IMU1, a", "IMU1, b", "10 g", "dcm", "dcm again", "quaternion", "LAB1", "gyro x", "z"]
    figure = Figure("f", "", "", "", "", (FigurePanel("", tuple(Trace(n, x, x) for n in names)),))
    colors = [color for color, _, _ in page.looks(figure).values()]
    assert len(set(colors)) == len(names)


@pytest.mark.parametrize("quiet", [True, False])
def test_the_command_writes_the_folder(tmp_path, monkeypatch, capsys, quiet):
    options = ["sample", "--out", str(tmp_path / "out"), *(["--quiet"] if quiet else [])]
    monkeypatch.setattr(sys, "argv", options)
    page.run("sample", lambda progress: sample())
    assert (tmp_path / "out" / "report.html").is_file()
    assert ("It holds." in capsys.readouterr().out) is not quiet

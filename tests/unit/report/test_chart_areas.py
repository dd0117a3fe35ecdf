"""Bands, filled outlines and bars: the same in a page and in a picture."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from matplotlib.lines import Line2D

from strapdown.report.chart import BLUE, VERMILLION, Bars, Chart, Fill, Line, Panel, runs
from strapdown.report.plotly_chart import figure, see_through
from strapdown.report.svg_chart import draw, notebook_figure

T = np.array([0.0, 1.0, 2.0, 3.0, 4.0])
GAP = np.array([0.0, 1.0, np.nan, 3.0, 4.0])


def one(**panel):
    return Chart("s", "title", "caption", "time, s", (Panel("y, m", **panel),))


def budget(**changes):
    bars = Bars("share", np.arange(2.0), np.array([3.0, -2.0]), BLUE, labels=("<3>", "-2"))
    panel = {"lines": (), "bars": (bars,), "categories": ("clock", "mounting")}
    return one(**(panel | changes))


def test_runs_are_what_nan_leaves():
    assert runs(GAP) == [slice(0, 2), slice(3, 5)]
    assert runs(GAP, np.array([np.nan, 1, 1, 1, np.inf])) == [slice(1, 2), slice(3, 4)]
    assert runs(np.full(3, np.nan)) == []


def test_a_band_goes_there_and_back_and_a_gap_parts_it():
    line = Line("delta-V", T, T, BLUE)
    chart = one(lines=(line,), fills=(Fill("95 %", T, GAP - 1.0, T + 1.0, BLUE, 0.25),))
    band, curve = figure(chart)["data"]
    assert band["x"] == [0, 1, 1, 0, None, 3, 4, 4, 3]
    assert band["y"] == [-1, 0, 2, 1, None, 2, 3, 5, 4]
    assert band["fillcolor"] == see_through(BLUE, 0.25) == "rgba(0,114,178,0.25)"
    assert (band["showlegend"], curve["showlegend"]) == (True, True)
    legend = notebook_figure(chart).legends[0]
    assert [text.get_text() for text in legend.get_texts()] == ["95 %", "delta-V"]


def test_a_band_of_a_line_is_one_entry_with_it():
    line = Line("delta-V", T, T, BLUE)
    chart = one(lines=(line,), fills=(Fill("delta-V", T, T - 1, T + 1, BLUE),))
    band, curve = figure(chart)["data"]
    assert (band["showlegend"], curve["showlegend"]) == (False, True)
    assert band["legendgroup"] == curve["legendgroup"]
    legend = notebook_figure(chart).legends[0]
    assert [text.get_text() for text in legend.get_texts()] == ["delta-V"]
    assert isinstance(legend.legend_handles[0], Line2D)


def test_a_picture_draws_the_same_band():
    picture = notebook_figure(one(lines=(), fills=(Fill("f", T, GAP - 1, T + 1, BLUE),)))
    (band,) = picture.axes[0].collections
    assert len(band.get_paths()) == 2
    corners = {tuple(v) for v in band.get_paths()[1].vertices}
    assert corners == {(3, 2), (4, 3), (4, 5), (3, 4)}


def test_outlines_are_filled_each_for_itself():
    square = np.array([0.0, 1.0, 1.0, 0.0, 0.0])
    x = np.concatenate([square, [np.nan], square + 3.0])
    y = np.concatenate([[0.0, 0.0, 1.0, 1.0, 0.0], [np.nan], [0.0, 0.0, 1.0, 1.0, 0.0]])
    panel = {"lines": (Line("car", x, y, VERMILLION, inside=0.1),), "x_label": "x, m"}
    (trace,) = figure(one(**panel))["data"]
    assert trace["fill"] == "toself"
    assert trace["x"][5] is None
    assert len(notebook_figure(one(**panel)).axes[0].patches) == 2


def test_bars_lie_across_by_category_and_start_where_they_should():
    (trace,) = figure(budget())["data"]
    assert (trace["orientation"], trace["x"], trace["y"]) == ("h", [3, -2], [0, 1])
    notes = {a["text"]: a for a in figure(budget())["layout"]["annotations"]}
    assert notes["&lt;3&gt;"]["xanchor"] == "left"
    assert notes["-2"]["xanchor"] == "right"
    axis = notebook_figure(budget()).axes[0]
    assert [p.get_width() for p in axis.patches] == [3, -2]


def test_stacked_upright_bars():
    below = Bars("a", T, T + 1, BLUE, pattern="/")
    above = Bars("b", T, T + 3, VERMILLION, start=T + 1)
    chart = one(lines=(), bars=(below, above))
    first, second = figure(chart)["data"]
    assert (first["orientation"], first["marker"]["pattern"]["shape"]) == ("v", "/")
    assert (second["base"], second["y"]) == ([1, 2, 3, 4, 5], [2] * 5)
    patches = notebook_figure(chart).axes[0].patches
    assert [p.get_y() for p in patches[5:]] == [1, 2, 3, 4, 5]
    assert [p.get_height() for p in patches[5:]] == [2] * 5


def test_ticks_stand_at_the_steps_asked_for():
    line = Line("heading", T, 60.0 * T, BLUE)
    chart = one(lines=(line,), step=30.0, x_step=2.0)
    layout = figure(chart)["layout"]
    assert (layout["yaxis"]["dtick"], layout["xaxis"]["dtick"]) == (30, 2)
    axis = notebook_figure(chart).axes[0]
    assert {b - a for a, b in pairwise(axis.get_yticks())} == {30.0}
    assert {b - a for a, b in pairwise(axis.get_xticks())} == {2.0}


@pytest.mark.parametrize("chart", [budget(), one(lines=(), fills=(Fill("f", T, T, T + 1, BLUE),))])
def test_areas_have_the_same_bytes_every_time(chart, tmp_path):
    draw(chart, tmp_path / "a.svg")
    draw(chart, tmp_path / "b.svg")
    assert (tmp_path / "a.svg").read_bytes() == (tmp_path / "b.svg").read_bytes()

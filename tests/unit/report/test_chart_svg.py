"""Charts as SVG: what is where, by its own numbers."""

from __future__ import annotations

import re
from itertools import combinations, pairwise
from xml.etree import ElementTree

import numpy as np
import pytest

from strapdown.errors import ConfigError
from strapdown.report.chart import (
    BLUE,
    GREEN,
    SYMBOLS,
    Band,
    Bars,
    Chart,
    Fill,
    Level,
    Line,
    Mark,
    Panel,
    runs,
)
from strapdown.report.chart_svg import ChartFigure, Scale, fitted, still, ticks
from strapdown.report.svg_drawing import overlap, text_width

SVG = "{http://www.w3.org/2000/svg}"
T = np.array([0.0, 1.0, 2.0, 3.0, 4.0])
GAP = np.array([0.0, 1.0, np.nan, 3.0, 4.0])
#: Coordinates of curves are written to a hundredth of a pixel.
PIXELS = 0.0051


def one(**panel):
    return Chart("s", "title", "caption", "time, s", (Panel("y, m", **panel),))


def parsed(chart):
    return ElementTree.fromstring(still(chart))


def curves(root, colour, kind="stroke"):
    """Points of each curve, or of each area and polygon, of a colour."""
    found = []
    for one in root.iter():
        if colour != one.get(kind):
            continue
        if one.tag == f"{SVG}polygon":
            found.append(np.array([p.split(",") for p in one.get("points").split()], float))
        elif one.tag == f"{SVG}path" and one.get("class") != "points":
            steps = re.findall(r"(-?[\d.]+),(-?[\d.]+)", one.get("d"))
            found.append(np.cumsum(np.array(steps, float), axis=0))
    return found


def words(root):
    """Every text with its place, size, anchor and whether it is turned."""
    for text in root.iter(f"{SVG}text"):
        place = float(text.get("x")), float(text.get("y"))
        yield text.text, *place, text.get("text-anchor", "start"), "transform" in text.attrib


def tick_places(root, names):
    """Height of the labels of the vertical axis, by their numbers."""
    return {
        float(text.replace("−", "-")): y - 0.35 * 10.0
        for text, _, y, anchor, _ in words(root)
        if anchor == "end" and text in names
    }


def test_a_curve_passes_where_its_ticks_say():
    root = parsed(one(lines=(Line("a", T, 10.0 * T - 20.0, BLUE),)))
    (curve,) = curves(root, BLUE)
    at = tick_places(root, {"−20", "0", "20"})
    # y of the curve at its first, middle and last point, which are ticks themselves.
    np.testing.assert_allclose(curve[[0, 2, 4], 1], [at[-20], at[0], at[20]], atol=PIXELS + 0.005)
    assert np.allclose(np.diff(curve[:, 0]), np.diff(curve[:, 0])[0], atol=2 * PIXELS)


def test_nan_breaks_curves_and_bands():
    fill = Fill("b", T, GAP - 1.0, T + 1.0, GREEN)
    root = parsed(one(lines=(Line("a", T, GAP, BLUE),), fills=(fill,)))
    assert [len(c) for c in curves(root, BLUE)] == [2, 2]
    bands = [c for c in curves(root, GREEN, "fill") if len(c) == 4]
    # The sample of the legend is a rectangle, too: the two bands are those that slant.
    assert sum(len({y for _, y in c}) == 4 for c in bands) == 2


def test_a_logarithmic_axis_shows_what_is_positive():
    y = np.array([1e-2, 1.0, -1.0, 0.0, 1e2])
    root = parsed(one(lines=(Line("a", T, y, BLUE),), log=True))
    # The one point after the gap is no curve.
    (curve,) = curves(root, BLUE)
    assert len(curve) == 2
    at = tick_places(root, {"0.01", "1", "100"})
    np.testing.assert_allclose(curve[:, 1], [at[0.01], at[1]], atol=PIXELS + 0.005)


def test_a_plane_has_one_scale():
    x = np.array([0.0, 300.0, 300.0, 0.0])
    chart = Chart(
        "p", "plan", "", "", (Panel("n", (Line("a", x, x[::-1] / 10, BLUE),), x_label="e"),)
    )
    (curve,) = curves(parsed(chart), BLUE)
    wide, high = np.ptp(curve, axis=0)
    assert wide == pytest.approx(10.0 * high, rel=0.01)


def test_every_symbol_is_about_as_large_as_it_says():
    lines = tuple(
        Line(s, np.array([float(k)]), np.zeros(1), BLUE, points=True, symbol=s, size=20.0)
        for k, s in enumerate(SYMBOLS)
    )
    paths = [p.get("d") for p in parsed(one(lines=lines)).iter(f"{SVG}path")]
    assert len(paths) == 2 * len(SYMBOLS)  # each in the legend, too
    for path in paths[: len(SYMBOLS)]:
        steps = np.array(re.findall(r"(-?[\d.]+),(-?[\d.]+)(?=[ z])", path), float)
        span = np.ptp(np.cumsum(steps, axis=0), axis=0).max() if "a" not in path else 17.0
        assert 12.0 < span < 26.0, path


def test_bars_end_where_their_axis_says():
    bars = Bars("share", np.arange(2.0), np.array([30.0, -20.0]), BLUE, labels=("30", "-20"))
    root = parsed(one(lines=(), bars=(bars,), categories=("clock", "mounting")))
    boxes = [c for c in curves(root, BLUE, "fill") if np.ptp(c[:, 1]) > 9.5]
    at = {t.replace("−", "-"): x for t, x, _, a, _ in words(root) if a == "middle"}
    ends = {round(v, 1) for c in boxes for v in c[:, 0]}
    for name in ("0", "-20"):
        assert any(abs(at[name] - end) < 0.1 for end in ends), name
    assert len(boxes) == 2


@pytest.mark.parametrize("pattern", ["/", "x", "-", "|", "+", "."])
def test_patterns_are_within_their_bars(pattern):
    bars = Bars("share", np.arange(2.0), np.array([30.0, 20.0]), BLUE, pattern=pattern)
    root = parsed(one(lines=(), bars=(bars,)))
    assert len([s for s in root.iter(f"{SVG}svg") if s.get("overflow") == "hidden"]) == 4


def full(marks=(), levels=(), **more):
    lines = tuple(Line(f"line {k}", T, T + k, BLUE) for k in range(9))
    panels = tuple(Panel(f"a longer name {k}, m/s", lines, levels=levels, **more) for k in range(3))
    return Chart("s", "t", "c", "time, s", panels, marks=marks, bands=(Band(1.0, 2.0, "outage"),))


@pytest.mark.parametrize(
    "chart",
    [
        full(),
        full(levels=(Level(2.0, "2.5 %"), Level(2.0, "97.5 %"))),
        full(marks=(Mark(1.0, "begin of the event"), Mark(1.1, "end of the event")), title="one"),
        one(lines=(Line("a", T, 3e-7 * T, BLUE),)),
        one(lines=(Line("a", 1e8 * T, 1e9 * T, BLUE),)),
    ],
)
def test_no_word_lies_on_another_or_leaves_the_picture(chart):
    root = parsed(chart)
    width, height = float(root.get("width")), float(root.get("height"))
    boxes = []
    for text, x, y, anchor, turned in words(root):
        size = 10.0
        wide = 0.8 * text_width(text, size)  # it says rather too much
        left = x - {"start": 0.0, "middle": 0.5, "end": 1.0}[anchor] * wide
        middle = y - 0.35 * size
        if turned:
            box = (x - 4.0, middle - 0.5 * wide, x + 4.0, middle + 0.5 * wide)
        else:
            box = (left, middle - 4.0, left + wide, middle + 4.0)
        assert box[0] >= 0.0 and box[2] <= width and box[1] >= -1.0 and box[3] <= height, text
        boxes.append((text, box))
    for (a, first), (b, second) in combinations(boxes, 2):
        assert overlap(first, second) < 4.0, (a, b)


def test_texts_from_outside_stay_texts_and_it_repeats():
    chart = one(lines=(Line("<b>&$a$", T, T, BLUE, labels=("<script>",)),))
    assert "<script>" not in still(chart)
    assert "&lt;b&gt;&amp;$a$" in still(chart)
    assert still(chart) == still(chart)


def test_a_chart_of_nothing_is_drawn():
    nothing = np.full(5, np.nan)
    for log in (False, True):
        assert "nan" not in still(one(lines=(Line("a", T, nothing, BLUE),), log=log))


@pytest.mark.parametrize("low", [-3.7e5, -1.0, 0.0, 2e-9, 21.099, 456300.0])
@pytest.mark.parametrize("span", [1e-9, 3e-4, 0.7, 12.0, 3.3e7])
def test_ticks_are_round_inside_and_few(low, span):
    scale = Scale(low, low + span)
    found = ticks(scale, 5)
    assert 2 <= len(found) <= 6
    at = np.array([tick.at for tick in found])
    room = 1e-6 * span
    assert (at >= low - room).all() and (at <= low + span + room).all()
    assert len({tick.text for tick in found}) == len(found)


@pytest.mark.parametrize(("low", "high"), [(0.03, 50.0), (1e-9, 1e9), (1.1, 1.9), (3.0, 40.0)])
def test_a_logarithmic_axis_has_two_labels_at_least(low, high):
    said = [tick for tick in ticks(Scale(low, high, True), 4) if tick.text]
    assert 2 <= len(said) <= 9
    for tick in said:
        assert low <= tick.at <= high * (1.0 + 1e-9)
        assert float(tick.text.replace("−", "-")) == pytest.approx(tick.at, rel=1e-5)


def test_an_axis_holds_its_values_with_a_margin():
    assert fitted([[1.0, 3.0], [np.nan, 2.0]], margin=0.1) == Scale(0.8, 3.2)
    same = fitted([[5.0, 5.0]])
    assert same.low < 5.0 < same.high
    log = fitted([[0.0, -1.0, 0.1, 10.0]], log=True)
    assert 0.05 < log.low < 0.1 and 10.0 < log.high < 20.0


def test_runs_are_what_nan_leaves():
    assert runs(GAP) == [slice(0, 2), slice(3, 5)]
    assert runs(GAP, np.array([np.nan, 1, 1, 1, np.inf])) == [slice(1, 2), slice(3, 4)]
    assert runs(np.full(3, np.nan)) == []


def test_a_series_is_one_entry_of_the_legend_with_its_band():
    line = Line("delta-V", T, T, BLUE)
    root = parsed(one(lines=(line,), fills=(Fill("delta-V", T, T - 1, T + 1, BLUE),)))
    assert [g.get("data-entry") for g in root.iter() if g.get("data-entry")] == ["delta-V"]
    assert [g.get("data-series") for g in root.iter() if g.get("data-series")] == ["delta-V"] * 2


def test_the_script_of_a_page_reads_the_values_back():
    y = np.array([3.0, -1.0, 7.5, 2.0, 4.0])
    for log in (False, True):
        values = 10.0**y if log else y
        root = parsed(one(lines=(Line("a", T, values, BLUE),), log=log))
        (panel,) = [s for s in root.iter(f"{SVG}svg") if s.get("data-x")]
        low, high, is_log, power = map(float, panel.get("data-y").split())
        assert (is_log == 1.0, power) == (log, 0.0)
        left, top, width, height = (float(panel.get(k)) for k in ("x", "y", "width", "height"))
        (curve,) = curves(root, BLUE)
        share = 1.0 - (curve[:, 1] - top) / height
        found = low * (high / low) ** share if log else low + share * (high - low)
        span = np.log(high / low) if log else high - low
        apart = np.log(found / values) if log else found - values
        assert np.abs(apart).max() < 0.011 / height * span
        x = map(float, panel.get("data-x").split()[:2])
        assert np.allclose(np.interp((curve[:, 0] - left) / width, [0, 1], list(x)), T, atol=1e-3)


def test_outlines_are_filled_each_for_itself():
    square = np.array([0.0, 1.0, 1.0, 0.0, 0.0])
    x = np.concatenate([square, [np.nan], square + 3.0])
    y = np.concatenate([[0.0, 0.0, 1.0, 1.0, 0.0], [np.nan], [0.0, 0.0, 1.0, 1.0, 0.0]])
    line = Line("car", x, y, GREEN, inside=0.1, legend=False)
    root = parsed(one(lines=(line,), x_label="x, m"))
    assert [len(c) for c in curves(root, GREEN, "fill")] == [5, 5]


def test_ticks_stand_at_the_steps_asked_for():
    root = parsed(one(lines=(Line("heading", T, 60.0 * T, BLUE),), step=30.0, x_step=2.0))
    texts = [(t.replace("−", "-"), a) for t, _, _, a, turned in words(root) if not turned]
    up = [float(t) for t, a in texts if a == "end"]
    across = [float(t) for t, a in texts if a == "middle" and t[-1].isdigit()]
    assert {b - a for a, b in pairwise(up)} == {30.0}
    assert {b - a for a, b in pairwise(across)} == {2.0}


@pytest.mark.parametrize("ending", ["svg", "png", "pdf"])
def test_a_chart_alone_is_a_file_with_the_same_bytes_every_time(ending, tmp_path):
    figure = ChartFigure(full())
    for name in "ab":
        figure.save(tmp_path / f"{name}.{ending}", caption=True)
    a, b = ((tmp_path / f"{name}.{ending}").read_bytes() for name in "ab")
    assert a == b and a.startswith({"svg": b"<svg", "png": b"\x89PNG", "pdf": b"%PDF"}[ending])
    assert figure._repr_svg_() == figure.svg()


def test_another_format_is_refused(tmp_path):
    with pytest.raises(ConfigError) as error:
        ChartFigure(full()).save(tmp_path / "a.bmp")
    assert error.value.finding.code == "report.unknown-picture"

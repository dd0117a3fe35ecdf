"""The charts: what is in them, and that page and picture are drawn from the same data."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from strapdown.report.attitude_charts import LEAST_ERROR, charts
from strapdown.report.attitude_words import share_basis
from strapdown.report.chart import DASHES, SERIES_COLOURS, Level, look
from strapdown.report.chart_svg import entries, still
from strapdown.report.plan import PLACES, place_labels


def by_slug(bench):
    return {c.slug: c for c in charts(bench)}


def points(chart, name):
    return next(line for p in chart.panels for line in p.lines if line.name == name)


def test_nine_series_are_told_apart_with_and_without_colour():
    assert len({tuple(look(k).values()) for k in range(9)}) == 9
    assert len({look(k)["colour"] for k in range(9)}) == 9
    assert len({look(k)["symbol"] for k in range(9)}) == 9
    assert len(DASHES) == len(SERIES_COLOURS)


def test_cost_against_error_shows_what_the_answer_judges(full_bench):
    chart = by_slug(full_bench)["cost"]
    panel = chart.panels[0]
    assert chart.log_x
    assert panel.log
    assert panel.levels == (Level(2.0, "tolerance 2°"),)
    rows = full_bench.sweep[full_bench.sweep["factor"] == 1].set_index("algorithm")["error_deg"]
    for cost, share in zip(full_bench.costs, full_bench.shares, strict=True):
        whole, own = (
            points(chart, cost.algorithm),
            points(chart, f"{cost.algorithm}, algorithm error"),
        )
        assert (whole.x[0], whole.y[0]) == (cost.cycles, rows[cost.algorithm].iloc[0])
        assert own.y[0] == share.own_deg[2]
        assert (whole.hollow, own.hollow) == (False, True)
        assert whole.labels == (cost.algorithm,)


def test_the_front_holds_exactly_what_nothing_beats(full_bench):
    chart = by_slug(full_bench)["cost"]
    front = points(chart, "Pareto front")
    corners = set(zip(front.x.tolist(), front.y.tolist(), strict=True))
    whole = {c.algorithm: points(chart, c.algorithm) for c in full_bench.costs}
    at = {name: (float(line.x[0]), float(line.y[0])) for name, line in whole.items()}
    for x, y in at.values():
        beaten = any((a <= x and b <= y) and (a, b) != (x, y) for a, b in at.values())
        assert ((x, y) in corners) != beaten


def test_the_sweep_has_both_ways_and_rings_the_answer_in_its_own(full_bench):
    chart = by_slug(full_bench)["sweep"]
    assert [p.title for p in chart.panels] == ["Samples averaged", "Samples left out"]
    rings = [[line for line in p.lines if line.name == "the answer"] for p in chart.panels]
    assert [len(r) for r in rings] == [0, 1]
    assert rings[1][0].x.tolist() == [full_bench.answer.rate_hz]
    for panel in chart.panels:
        named = [line for line in panel.lines if line.legend and line.dots]
        assert [line.name for line in named] == [r.algorithm for r in full_bench.runs]
        widths = [line.width for line in named]
        assert widths == sorted(widths, reverse=True)


def test_shares_stand_beside_each_other_and_say_their_basis(full_bench):
    chart = by_slug(full_bench)["share"]
    names = [line.name for line in chart.panels[0].lines]
    assert names == ["of the sensor", "of the algorithm at this rate", "of single precision"]
    assert chart.panels[0].categories == tuple(s.algorithm for s in full_bench.shares)
    assert "Exact: " in chart.caption
    # A log has a sampling error, too: an estimate.
    log = replace(full_bench, specification={"source": {"kind": "log"}})
    assert share_basis(log).startswith("Estimate: ")


def test_an_interval_below_zero_ends_at_the_axis(full_bench):
    trials = full_bench.trials
    ranking = trials.ranking.copy()
    ranking.loc[0, "low_deg"] = -1.0
    bench = replace(full_bench, trials=replace(trials, ranking=ranking))
    chart = by_slug(bench)["trials"]
    mean = points(chart, "mean, with its 95 % interval")
    assert mean.low[0] == LEAST_ERROR
    assert len(points(chart, "trial").x) == len(trials.errors)


def test_aided_filters_never_share_axes_with_gyros_alone(full_bench):
    alone, aided = by_slug(full_bench)["peers"].panels
    assert "ahrs 0.4.0 AngularRate" in alone.categories
    assert not [name for name in alone.categories if "vqf" in name or "imufusion" in name]
    assert aided.categories == ("vqf 2.1.1 (gyro+accel)", "imufusion 1.2.5 (gyro+accel+mag)")


@pytest.mark.parametrize(
    ("options", "slugs"),
    [
        ({}, ["cost", "sweep", "share"]),
        ({"sweep": False}, ["cost", "share"]),
        ({"truth": False}, ["cost", "sweep", "share"]),
        ({"truth": False, "sweep": False, "algorithms": ("dcm",)}, ["cost", "share"]),
    ],
)
def test_what_there_is_not_is_not_drawn(make_bench, options, slugs):
    bench = make_bench(**options)
    assert [s for s in by_slug(bench) if s in {"cost", "sweep", "share"}] == slugs
    # The other charts are of the runs, which are the same however many there are.
    for chart in charts(bench) if len(bench.runs) == 1 else by_slug(bench).values():
        assert "data-line" in still(chart)


def test_a_sweep_without_columns_is_no_sweep(make_bench):
    bench = replace(make_bench(sweep=False), sweep=pd.DataFrame())
    assert "sweep" not in by_slug(bench)


def test_pictures_have_the_same_bytes_every_time(full_bench):
    for chart in charts(full_bench):
        assert still(chart) == still(chart)


def test_one_name_is_one_entry_of_the_legend(full_bench):
    for chart in charts(full_bench):
        names = [entry.name for entry in entries(chart)]
        assert len(names) == len(set(names))


def test_labels_of_a_crowd_do_not_cover_each_other():
    x = np.log10([160, 230, 250, 280, 290, 355])
    labels = ["rk4", "quaternion", "rotvec", "rotvec:samples=4", "dcm", "euler"]
    places = place_labels(x, np.zeros(6), labels, [[0.0, 2.0], [4.0, -1.0]])
    assert set(places) <= set(PLACES)
    # Boxes in the units that the places are chosen in: 0.0082 a character, 0.05 a line.
    at = 0.05 + 0.9 * x / 4.0
    left = [
        a + {-1: -0.0082 * len(t) - 0.01, 0: -0.0041 * len(t), 1: 0.01}[side]
        for a, t, (side, _) in zip(at, labels, places, strict=True)
    ]
    for i in range(6):
        for j in range(i):
            apart = (
                places[i][1] != places[j][1]
                or left[i] >= left[j] + 0.0082 * len(labels[j]) - 1e-12
                or left[j] >= left[i] + 0.0082 * len(labels[i]) - 1e-12
            )
            assert apart, (labels[i], labels[j])


def test_a_lone_label_stands_above_its_point():
    assert place_labels([1.0], [1.0], ["dcm"]) == ((0, 1),)
    assert place_labels([], [], []) == ()

"""Fixes that are withheld are not used, and the score by them is the error by the truth."""

from __future__ import annotations

import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from tests.coded import coded

sys.path.insert(0, str(Path(__file__).parents[2]))

import town_drive as town
from strapdown.config.navigation import WithholdTable
from strapdown.config.spec import specify
from strapdown.errors import ConfigError
from strapdown.navigation.outage_test import WithheldScore, judge_outages, spans_to_withhold
from strapdown.navigation.record import Span
from strapdown.systems.navigation_run import _test_outages
from strapdown.tables import gnss_table
from withheld_fixes import score_withheld, scores_table

LENGTH = 20.0
NOISE = 0.01


@cache
def fixes():
    return town.fixes(position_noise=NOISE, velocity_noise=0.03)


@cache
def scored(arm=town.ARM):
    navigator, state = town.begun(town.gnss(lever_arm=arm))
    spans = spans_to_withhold(60.0, 180.0, LENGTH)
    return score_withheld(navigator, state, *town.increments(), "gnss", fixes(), spans)


def test_spans_are_spread_from_the_begin_to_the_end():
    spans = spans_to_withhold(100.0, 200.0, 20.0, 5)
    assert [s.begin for s in spans] == [100.0, 120.0, 140.0, 160.0, 180.0]
    assert [s.end for s in spans] == [120.0, 140.0, 160.0, 180.0, 200.0]
    assert [s.begin for s in spans_to_withhold(0.0, 10.0, 4.0, 1)] == [3.0]
    assert [s.begin for s in spans_to_withhold(0.0, 10.0, 0.5, 2)] == [0.0, 9.5]
    # Five, if not stated; one that fits exactly is there five times.
    assert [s.begin for s in spans_to_withhold(1.0, 5.0, 4.0)] == [1.0] * 5
    for length, places in ((12.0, 5), (4.0, 0), (0.0, 5)):
        with pytest.raises(ConfigError, check=coded("evaluation.spans-do-not-fit-within")):
            spans_to_withhold(0.0, 10.0, length, places)


def test_places_without_a_fix_to_compare_with_are_left_out():
    time = np.append(np.arange(0.0, 100.0), np.arange(150.0, 300.0))
    n = time.size
    table = gnss_table(time, np.zeros((n, 3)), np.zeros((n, 3)), (1.0,) * 3, (np.inf,) * 3)
    asked = specify(WithholdTable, lengths_s=[20.0], places=7, from_s=0.0)
    begins = [one.begin for one in _test_outages(asked, 0.0, 299.0, table)]
    # Every 46.5 s; from 93.0 to 113.0 s there are fixes up to 99 s, from 139.5 s on from 150 s.
    assert begins == pytest.approx(np.linspace(0.0, 279.0, 7))
    asked = specify(WithholdTable, lengths_s=[20.0], places=13, from_s=0.0)
    begins = [one.begin for one in _test_outages(asked, 0.0, 299.0, table)]
    assert begins == pytest.approx(np.delete(np.linspace(0.0, 279.0, 13), 5))
    # What the user names is not changed, and where nothing is left the run says why.
    asked = specify(WithholdTable, spans_s=[[110.0, 130.0]])
    assert [one.begin for one in _test_outages(asked, 0.0, 299.0, table)] == [110.0]
    asked = specify(WithholdTable, lengths_s=[20.0], places=1, from_s=100.0)
    assert len(_test_outages(asked, 0.0, 149.0, table)) == 1


def test_the_score_of_a_span_is_the_error_of_a_run_without_its_fixes():
    for score in scored()[1:2]:
        navigator, state = town.begun(town.gnss())
        table = fixes()
        table = table[(table.index <= score.span.begin) | (table.index > score.span.end)]
        piece = town.run(navigator, state, table)[1]
        at = np.searchsorted(piece.time, score.time - 1e-9)
        # Antenna and sensors are off by the same but for the arm, by a heading of 0.3 deg; the fix
        # by its noise. The steps are not cut at fixes that are not there: 50 Hz and 2 Hz fall
        # together, so that they are not cut at all.
        apart = town.off(piece)[at] - score.error
        assert np.abs(apart).max() < 5.0 * NOISE + 1.3 * np.radians(0.3)
        assert score.largest > 10.0 * NOISE


def test_errors_are_within_their_bounds_as_often_as_they_should_be():
    table = scores_table(scored())
    # Five of 95 %: two outside are as improbable as 2 %.
    assert (table["distance"] < 2.45).sum() >= 4
    assert table["distance"].max() > 0.1
    assert (table["error"] < table["bound"]).equals(table["distance"] < np.sqrt(-2 * np.log(0.05)))
    assert (table["fixes"] == 2 * LENGTH).all()


def made_up(rng, size=1.0, noise=1.0):
    """Five outages whose errors are a random walk and the white noise of 60 fixes."""
    steps = np.arange(1.0, 61.0)
    for begin in range(0, 500, 100):
        walk = np.cumsum(rng.normal(scale=0.05, size=(60, 2)), axis=0)
        error = np.zeros((60, 3))
        error[:, :2] = size * (walk + noise * rng.normal(size=(60, 2)))
        drift = 2.0 * 0.05**2 * steps
        covariance = (0.5 * drift + noise**2)[:, None, None] * np.eye(2)
        yield WithheldScore(
            Span("60 s", begin, begin + 60.0), begin + steps, error, covariance, drift
        )


def test_many_good_fixes_are_not_condemned_by_the_largest_of_their_errors():
    rng = np.random.default_rng(61)
    runs = [list(made_up(rng)) for _ in range(60)]
    # The largest of sixty is beyond the bound of one in 95 % of the outages.
    assert sum(one.inside.all() for run in runs for one in run) < 60
    # One of a hundred good runs is condemned; four of sixty have a probability of 0.3 %.
    assert sum(not judge_outages(run).consistent for run in runs) < 4
    # The share inside a bound that is 1.5 times too small, 1 - exp(-3 / 1.5²) = 0.74.
    assert not any(judge_outages(list(made_up(rng, 1.5))).consistent for _ in range(20))


def test_a_drift_counts_once_and_a_single_gross_error_as_what_it_is():
    rng = np.random.default_rng(62)
    runs = [list(made_up(rng, noise=1e-3)) for _ in range(60)]
    assert sum(not judge_outages(run).consistent for run in runs) < 4
    assert not any(judge_outages(list(made_up(rng, 3.0, 1e-3))).consistent for _ in range(20))
    # Of one walk from step 1 to 60 the share has the weight of one or two errors.
    assert 1.0 <= runs[0][0].independent()[0] < 3.0
    one = next(made_up(rng))
    one.error[30, :2] = 8.0, 0.0
    assert not judge_outages([one]).consistent
    assert judge_outages([one.without(one.time[[30]])]).consistent
    found = judge_outages([one])
    assert (found.count, found.worst, found.error) == (60, 0, 8.0)


def test_outages_that_overlap_count_once():
    (one, *_) = made_up(np.random.default_rng(63))
    one.error[::2, 0] = 3.0  # more often than far
    assert judge_outages([one] * 5).probability == pytest.approx(
        judge_outages([one]).probability, rel=1e-9
    )


def test_each_span_is_by_itself():
    navigator, state = town.begun(town.gnss())
    whole = scored()
    again = score_withheld(
        navigator, state, *town.increments(), "gnss", fixes(), [whole[3].span, whole[1].span]
    )
    assert (again[0].error == whole[3].error).all()
    assert (again[1].error == whole[1].error).all()


@pytest.mark.parametrize(
    ("name", "span", "words"),
    [
        ("gps", (60.0, 70.0), "no measurement '"),
        ("gnss", (60.1, 60.2), "no fixes"),
    ],
)
def test_what_cannot_be_withheld_is_refused(name, span, words):
    navigator, state = town.begun(town.gnss())
    with pytest.raises(ConfigError, match=words):
        score_withheld(navigator, state, *town.increments(), name, fixes(), [Span("a", *span)])

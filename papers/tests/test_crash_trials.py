"""Simulated crashes through the whole chain against exact truth: are the bounds right?"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from papers.crash_trials.cases import TrialPriors, Untold, draw_case
from papers.crash_trials.outcomes import coverage, each_case, judge_case, reconstruct_case
from papers.crash_trials.pole_runs import (
    RINGINGS,
    degradation,
    degradation_table,
    ideal_design,
    paper_experiment,
    perfect_sensors,
    ringing_at_200_hz,
    short_design,
    without_a_rest,
)
from strapdown import reconstruct_crash
from strapdown.crash import Entry, sample_paths
from strapdown.simulation import (
    CRASHES,
    ExactAnswers,
    Ringing,
    find_crash,
    point_kinematics,
    record_crash,
)
from strapdown.tables import NED

POLE = CRASHES["pole"]
FEW = 40


def test_exact_answers_are_those_of_the_pulse():
    # The haversine changes the velocity over ground by what it was made with, to rounding.
    truth = ExactAnswers(POLE.motion, POLE.start)
    change = truth.over_ground(0.0, 0.113)
    assert change[0] == pytest.approx(POLE.delta_v[0][0], abs=2e-6)
    # Along the turning axes it is the integral of C_bn (a - g) + g_body at rest: by a sum of
    # 200 000 midpoints, whose error is 1e-9 of the largest slope times its length.
    t = POLE.start + (np.arange(200_000) + 0.5) * (0.113 / 200_000)
    f = POLE.motion.specific_force(t) - POLE.motion.specific_force(np.zeros(1))
    np.testing.assert_allclose(truth.along_body(0.0, 0.113), f.mean(axis=0) * 0.113, atol=1e-8)
    place, velocity = truth.course([0.0, 0.75])
    np.testing.assert_allclose(place[0], 0.0, atol=1e-8)
    np.testing.assert_allclose(velocity[0], [7.1, 0.0, 0.0], atol=2e-6)


def test_a_point_beside_the_origin_feels_the_turning():
    # Beside the middle by r to the right, a yaw rate w adds -w r to the velocity ahead.
    here = ExactAnswers(POLE.motion, POLE.start)
    there = ExactAnswers(POLE.motion, POLE.start, (0.0, 0.5, 0.0))
    end = POLE.start + 0.113
    rate = POLE.motion.rate(np.array([end]))[0]
    more = there.over_ground(0.0, 0.113) - here.over_ground(0.0, 0.113)
    heading = np.radians(POLE.motion.trajectory(np.array([end]))["heading"].iloc[0])
    # Earth's rate, and roll and pitch that stay below 2 deg: 1e-3 of the product.
    ahead = np.cos(heading) * more[0] + np.sin(heading) * more[1]
    assert ahead == pytest.approx(-rate[2] * 0.5, rel=3e-3)


@pytest.fixture(scope="module")
def few():
    return coverage(FEW, seed=2, workers=1)


def test_bounds_hold_the_truth_in_few_cases(few):
    assert (few.excluded == "").all()
    table = few.table()
    # 40 cases: 0.95 +- 3 sqrt(0.95 0.05/40), which leaves 0.847 at the least.
    assert (table["inside"] >= table["low"]).all(), table["inside"]
    # And bounds that are far too wide would hold all: the quadratic mean of error over sd has the
    # standard error 1/sqrt(2 n), 0.11. Three of them; and half a one more upwards, since its
    # distribution is that of a chi, and there are 26 answers.
    slack = 1.0 / np.sqrt(2.0 * FEW)
    assert table["ratio"].between(1.0 - 3.0 * slack, 1.0 + 3.5 * slack).all(), table["ratio"]


def test_a_case_hangs_on_its_number_alone(few):
    again = judge_case(draw_case(17, 2))
    row = pd.Series({k: v.error for k, v in again.answers.items()})
    pd.testing.assert_series_equal(few.errors.loc[17], row, check_names=False, check_exact=True)
    # What is not told has streams of its own: the same crash and mounting, told the same.
    late = draw_case(17, 2, untold=Untold(trigger_sd=0.01))
    same = draw_case(17, 2)
    assert late.unit.mounting == same.unit.mounting
    assert late.unit.trigger_sd == same.unit.trigger_sd
    assert late.unit.trigger != same.unit.trigger


@pytest.mark.slow
def test_bounds_are_not_blind():
    # A recorder that is four times worse than it says must fall out of its bounds.
    priors = TrialPriors()
    triads = priors.design.accelerometers
    worse = tuple(
        replace(t, uncertainty=replace(t.uncertainty, scale=0.08, misalignment=0.1)) for t in triads
    )
    design = replace(priors.design, accelerometers=worse)
    cases = [draw_case(k, 4, TrialPriors(design=design)) for k in range(20)]
    inside = []
    for case in cases:
        told = tuple(
            replace(t, uncertainty=priors.design.told(k))
            for k, t in enumerate(case.unit.accelerometers)
        )
        lying = replace(case, unit=replace(case.unit, accelerometers=told))
        inside.append(judge_case(lying).answers["body event resultant"].inside)
    # Half of a normal distribution lies within 0.67 sd; four times worse, 1.96/4 = 0.49: 38 %. Of
    # 20 cases, 15 inside have a chance of 0.001.
    assert sum(inside) < 15


def test_a_sensor_at_its_end_is_counted_apart():
    design = TrialPriors().design
    low, high = design.accelerometers
    short = replace(high, uncertainty=replace(high.uncertainty, full_scale=60.0))
    priors = TrialPriors(kinds=("frontal",), design=replace(design, accelerometers=(low, short)))
    # Frontal crashes here have peaks of 130 m/s² at the least.
    outcome = judge_case(draw_case(1, 2, priors))
    assert outcome.excluded == "accelerometer at its end"
    assert outcome.answers
    slow = replace(design.gyro, uncertainty=replace(design.gyro.uncertainty, full_scale=0.5))
    priors = TrialPriors(kinds=("pole",), design=replace(design, gyro=slow))
    excluded = {judge_case(draw_case(k, 2, priors)).excluded for k in range(3)}
    assert "gyro at its end" in excluded


def test_linear_covariance_and_monte_carlo_agree():
    for number in (0, 3):
        path = reconstruct_case(draw_case(number, 2)).path
        runs = 600
        samples = sample_paths(path, runs=runs, seed=1)
        drawn = samples.errors[:, -1, 6:].std(axis=0, ddof=1)
        told = np.sqrt(np.diagonal(path.covariance[-1])[6:])
        # Standard error 1/sqrt(2 n) = 2.9 %, of six numbers 3.5 of them; second order (angles of
        # 1 deg, scale of 2 %) adds below 1 %.
        np.testing.assert_allclose(drawn, told, rtol=3.5 / np.sqrt(2.0 * runs) + 0.01)
        # And the normal bounds hold 95 % of the full runs: three and a half standard errors.
        inside = (np.abs(samples.errors[:, -1, 6:]) <= 1.96 * told).mean(axis=0)
        assert (np.abs(inside - 0.95) < 3.5 * np.sqrt(0.95 * 0.05 / runs) + 0.002).all()


def test_perfect_sensors_without_ringing_are_within_a_millimetre():
    # Theory has 0.18 mm; chords between samples leave out force times angular acceleration,
    # 0.4 mm (test_path).
    assert np.linalg.norm(perfect_sensors()) < 1e-3
    ringing = Ringing(POLE.start + 0.0012, *RINGINGS["10 g at 195 Hz"])
    rings = perfect_sensors(scenario=POLE, ringing=ringing)
    # As the formula of test_ringing_at_200_hz says: 0.98 m on the mean, 1.45 at most.
    assert 0.5 < abs(rings[0]) < 1.5


@pytest.mark.parametrize("name", ["pole", "frontal", "oblique", "side", "rear", "rollover"])
def test_perfect_sensors_are_within_a_millimetre_on_every_axis(name):
    scenario = find_crash(name)
    impact = scenario.impacts[0]
    unit, _ = record_crash(scenario.motion, ideal_design(), impact=impact, seed=0)
    at = scenario.motion.trajectory(np.array([impact])).iloc[0]
    entry = Entry(time=0.0, velocity=(at["VN"], at["VE"], at["VD"]), heading_deg=at["heading"])
    path = reconstruct_crash([unit], entry).main.path
    exact = point_kinematics(scenario.motion, (0.0, 0.0, 0.0), path.time + impact, epoch=impact)
    # The Earth's rate, that the rest took for bias and the navigation takes off again, would be
    # 5e-5 rad/s over the approach of 8 s: 4e-4 rad of 17 m/s, 5 mm in the frontal one.
    assert np.abs(path.table[NED].to_numpy() - exact.position).max() < 1e-3


def test_ringing_table_has_what_was_asked():
    table = ringing_at_200_hz(1, workers=1)
    assert table.loc[("none", "means"), "largest"] < 1e-3
    for name in RINGINGS:
        # True means lose nothing: millimetres where instants lose decimetres.
        assert table.loc[(name, "means"), "largest"] < 0.003
        assert table.loc[(name, "instants"), "largest"] > 0.03


def test_nothing_to_do_is_refused():
    with pytest.raises(ValueError, match="0 cases"):
        each_case(abs, 0)


def test_short_error_model_is_that_of_theory():
    # By hand, as sds at T = 0.75 s after a pulse about 57 ms: bias 0.2 T²/2 = 0.056 m on each
    # axis; scale 2 % of the velocity change 7.2 m/s over 0.69 s = 0.100 m ahead, and of what the
    # slide brakes; 2 % of g downwards, 0.055 m; noise 0.4 sqrt(dt T³/3) = 0.011 m.
    table = without_a_rest(150, seed=1).table()["rms"]
    slack = 3.5 / np.sqrt(2.0 * 150)
    assert table["north"] == pytest.approx(np.sqrt(0.056**2 + 0.10**2 + 0.011**2), rel=slack + 0.1)
    assert table["east"] == pytest.approx(0.058, rel=slack + 0.05)
    assert table["down"] == pytest.approx(np.hypot(0.056, 0.055), rel=slack + 0.05)


@pytest.mark.slow
def test_coverage_of_two_thousand_cases():
    trials = coverage(2000, seed=1)
    table = trials.table()
    assert (trials.excluded == "").mean() > 0.99
    # Three standard errors of 2000: 1.46 %.
    assert table["inside"].between(0.9354, 0.9646).all(), table["inside"]


@pytest.mark.slow
def test_outcomes_do_not_depend_on_the_number_of_workers():
    one, two = coverage(12, seed=9, workers=1), coverage(12, seed=9, workers=2)
    pd.testing.assert_frame_equal(one.errors, two.errors, check_exact=True)
    pd.testing.assert_frame_equal(one.sds, two.sds, check_exact=True)


@pytest.mark.slow
def test_paper_experiment_says_decimetres():
    found = paper_experiment(500, seed=0)
    table = found.table()
    # Decimetre on every axis: the quadratic means are 1 to 2 dm, the bound says so, and holds.
    assert table["rms"].between(0.05, 0.2).all()
    ratio = table["rms"] / table["sd"]
    assert ratio.between(1.0 - 4.0 / np.sqrt(1000.0), 1.0 + 4.0 / np.sqrt(1000.0)).all()
    slack = 3.0 * np.sqrt(0.95 * 0.05 / 500)
    assert (table["inside"] > 0.95 - slack).all()
    chain = paper_experiment(100, seed=0, design=short_design()).table()
    # At rest the tilt takes the horizontal bias: what is left to the right is the scale factor's.
    assert chain.loc["east", "rms"] < 0.04


@pytest.mark.slow
def test_bounds_fail_where_they_were_not_told():
    untold = {
        "nothing": Untold(),
        "ringing": Untold(ringing=(RINGINGS["10 g at 195 Hz"],)),
        "trigger": Untold(trigger_sd=0.01),
    }
    table = degradation_table(degradation(100, seed=3, untold=untold))
    slack = 3.5 * np.sqrt(0.95 * 0.05 / 100)
    assert (table["nothing"] > 0.95 - slack).all()
    assert table.loc["place north", "ringing"] < 0.8
    # 10 ms of a pulse: the windows are elsewhere, and their directions the same.
    assert table.loc["body peak resultant", "trigger"] < 0.8
    assert table.loc["body peak direction", "trigger"] > 0.95 - slack

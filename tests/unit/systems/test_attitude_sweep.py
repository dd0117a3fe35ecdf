"""Lower rates, by both meanings, against the same scenario simulated at them."""

from __future__ import annotations

from itertools import pairwise, takewhile

import numpy as np
import pandas as pd
import pytest
from tests.coded import coded

from strapdown import rotation
from strapdown.api.attitude import compare_attitude
from strapdown.attitude_algorithms import make_algorithm
from strapdown.attitude_comparison.sweep import (
    Grounds,
    choose_factors,
    sum_increments,
    sweep_rates,
)
from strapdown.errors import ConfigError
from strapdown.evaluation.differences import Known
from strapdown.increments import increments_from_imu
from strapdown.orientation_filters import run_filter
from strapdown.simulation import ImuErrors, find_scenario, simulate_imu
from strapdown.tables import ACCEL, DTHETA, GYRO, QUATERNION, THETA, imu_table, references_table
from strapdown.tables.sample_clock import sample_clock

ALGORITHMS = ["naive", "euler", "dcm", "quaternion", "rk4", "rotvec", "rotvec:samples=4"]
NUMBERS = ["own_deg", "final_deg", "rms_deg", "max_deg", "error_deg"]


def cells(bench, meaning, factor):
    table = bench.sweep
    return table[(table["meaning"] == meaning) & (table["factor"] == factor)].set_index("algorithm")


@pytest.mark.parametrize("interpolation", ["linear", "cubic"])
@pytest.mark.parametrize("name", ["alexiev-fig2c", "coning-slow", "alexiev-fig4"])
def test_leaving_samples_out_is_the_scenario_at_the_lower_rate(name, interpolation):
    """Stamps are k/100 and k/50, the nearest floating-point numbers to the same instants."""
    asked = {"algorithms": ALGORITHMS, "interpolation": interpolation}
    full = compare_attitude(name, rate_hz=100, rates_hz=[50, 25], **asked)
    for rate, factor in ((50, 2), (25, 4)):
        if len(full.imu) % factor != 1:
            continue  # a scenario at the lower rate would end earlier
        slow = compare_attitude(name, rate_hz=rate, rates_hz=[rate], **asked)
        found, expected = cells(full, "drop", factor), cells(slow, "drop", 1)
        np.testing.assert_array_equal(found[NUMBERS], expected.loc[found.index, NUMBERS])
        assert found["rate_hz"].iloc[0] == pytest.approx(rate, rel=1e-12)


@pytest.mark.parametrize("name", ["alexiev-fig2c", "coning-slow", "intensive"])
def test_summing_mean_rates_is_the_slower_integrating_sensor(name):
    full = compare_attitude(
        name, rate_hz=100, rates_hz=[50, 25], sampling="mean", algorithms=ALGORITHMS
    )
    for rate, factor in ((50, 2), (25, 4)):
        if len(full.imu) % factor != 1:
            continue
        slow = compare_attitude(
            name, rate_hz=rate, rates_hz=[rate], sampling="mean", algorithms=ALGORITHMS
        )
        found, expected = cells(full, "sum", factor), cells(slow, "sum", 1)
        # Sums are rounded, by 1e-16 of the turn in each of a few thousand steps; the exact
        # attitude is the same function of the same instants.
        np.testing.assert_allclose(
            found[NUMBERS], expected.loc[found.index, NUMBERS], rtol=1e-9, atol=1e-9
        )
        # To leave means out is not to integrate: the two differ.
        assert (cells(full, "drop", factor).loc["dcm", NUMBERS] != found.loc["dcm", NUMBERS]).any()


def test_the_full_rate_is_the_same_by_both_meanings_and_is_what_the_runs_say():
    bench = compare_attitude("alexiev-fig2e", algorithms=ALGORITHMS, rates_hz=[20])
    drop, both = cells(bench, "drop", 1), cells(bench, "sum", 1)
    assert drop.drop(columns="meaning").equals(both.drop(columns="meaning"))
    scores = {s.algorithm: s for s in bench.scores if s.against == "truth"}
    for name, cell in drop.iterrows():
        assert cell["max_deg"] == pytest.approx(scores[name].max_deg, abs=1e-12)
        assert cell["final_deg"] == pytest.approx(scores[name].error_deg, abs=1e-12)
        assert cell["rms_deg"] == pytest.approx(scores[name].rms_deg, abs=1e-12)
        share = next(s for s in bench.shares if s.algorithm == name)
        assert cell["own_deg"] == pytest.approx(share.own_deg[2], abs=1e-12)


@pytest.mark.parametrize(
    ("count", "factor", "kept"),
    [
        (11, 4, [0, 4, 8, 10]),
        (9, 4, [0, 4, 8]),
        (10, 4, [0, 4, 8, 9]),
        (5, 1, [0, 1, 2, 3, 4]),
        (3, 7, [0, 2]),
    ],
)
def test_every_so_many_samples_and_the_last(count, factor, kept):
    assert sample_clock(np.arange(count) * 0.01).every(factor).tolist() == kept


def irregular(count=203, sampling="instantaneous"):
    rng = np.random.default_rng(5)
    time = np.cumsum(rng.uniform(0.002, 0.02, count))
    return imu_table(time, rng.normal(0.0, 0.5, (count, 3)), sampling=sampling)


@pytest.mark.parametrize("sampling", ["instantaneous", "mean"])
@pytest.mark.parametrize("factor", [1, 3, 4, 101, 300])
def test_sums_of_increments_lose_nothing_and_end_at_the_same_instant(sampling, factor):
    imu = irregular(sampling=sampling)
    whole = increments_from_imu(imu)
    samples = sample_clock(imu.index.to_numpy()).every(factor)
    summed = sum_increments(whole, samples)
    dropped = increments_from_imu(imu.iloc[samples])
    for table in (summed, dropped):
        assert table.index[-1] == imu.index[-1]
        assert len(table) == len(samples) - 1
        np.testing.assert_array_equal(table.index, imu.index[samples[1:]])
        # A sum of 200 steps of 0.02 s, each rounded by 2^-53 of 4 s.
        np.testing.assert_allclose(table["dt"], np.diff(imu.index[samples]), atol=200 * 5e-16)
    for k, (a, b) in enumerate(pairwise(samples)):
        expected = whole[THETA].to_numpy()[a:b].sum(axis=0)
        np.testing.assert_allclose(summed[THETA].to_numpy()[k], expected, atol=1e-14)
        kept = whole[DTHETA].to_numpy()[a] if b - a == 1 else np.zeros(3)
        np.testing.assert_array_equal(summed[DTHETA].to_numpy()[k], kept)


def test_a_ragged_end_is_judged_at_the_last_sample():
    """A constant turn is exact for every algorithm but the naive, whatever the steps."""
    time = np.append(np.arange(101) * 0.01, 1.013)
    imu = imu_table(time, np.tile([0.3, -0.2, 0.5], (102, 1)))
    q_nb = np.array([1.0, 0.0, 0.0, 0.0])
    algorithms = [make_algorithm(n) for n in ("dcm", "quaternion", "rotvec", "rotvec:samples=3")]
    exact = np.empty((102, 4))
    angle = 0.5 * time * np.linalg.norm([0.3, -0.2, 0.5])
    exact[:, 0] = np.cos(angle)
    exact[:, 1:] = np.sin(angle)[:, None] * np.array([0.3, -0.2, 0.5]) / np.sqrt(0.38)
    known = Known(exact, np.ones(102, dtype=bool))
    clock = sample_clock(time)
    grounds = Grounds(imu, q_nb, "linear", references_table([]), known, known, imu, clock)
    sweep = sweep_rates(algorithms, grounds, (1, 2, 7, 40, 60), lambda stage, share: None)
    # Rounding of some 100 steps, and the square root of rounding nowhere: the angle is by sines.
    assert sweep[NUMBERS].to_numpy().max() < 1e-11
    for factor in (1, 2, 7, 40, 60):
        rate = sweep[sweep["factor"] == factor]["rate_hz"]
        # The ragged end is not of the clock.
        assert rate.to_numpy() == pytest.approx(100.0 / factor, rel=1e-3)


def test_what_does_not_count_in_the_truth_is_not_judged():
    imu = irregular(41)
    q = np.tile([1.0, 0.0, 0.0, 0.0], (41, 1))
    still = imu_table(imu.index, np.zeros((41, 3)))
    wrong = q.copy()
    wrong[10:30] = [0.0, 1.0, 0.0, 0.0]
    counts = np.ones(41, dtype=bool)
    counts[10:30] = False
    grounds = Grounds(
        still,
        q[0],
        "linear",
        references_table([]),
        Known(wrong, counts),
        Known(q, np.ones(41, dtype=bool)),
        None,
        sample_clock(imu.index.to_numpy()),
    )
    sweep = sweep_rates([make_algorithm("dcm")], grounds, (1, 2, 15), lambda stage, share: None)
    assert (sweep["max_deg"] == 0.0).all()


def test_rates_are_taken_as_what_one_sample_in_so_many_gives():
    imu = simulate_imu(find_scenario("alexiev-fig2a").motion, ImuErrors(), rate=100.0)[0]
    clock = sample_clock(imu.index.to_numpy())
    findings = []
    assert choose_factors(clock, (), findings) == (1, 2, 4, 8, 16)
    assert choose_factors(clock, (50.0, 100.0, 10.0), findings) == (1, 2, 10)
    assert findings == []
    assert choose_factors(clock, (30.0, 200.0), findings) == (1, 3)
    assert "30 Hz was requested; 33.33 Hz is what one sample in 3 gives" in findings[0].what
    assert "200 Hz was requested; 100 Hz is the log's own rate" in findings[1].what
    # The remedy of the error is a rate that is not refused.
    with pytest.raises(ConfigError, check=coded("attitude.hz-leaves-fewer-than-two")) as refused:
        choose_factors(clock, (0.1,), findings)
    least = float(str(refused.value).split("use at least ")[1].split(" Hz")[0])
    assert len(choose_factors(clock, (least * 1.01,), findings)) == 2


@pytest.mark.parametrize("rate", [0.0, -5.0, float("nan"), float("inf")])
def test_what_is_no_rate_is_refused(rate):
    with pytest.raises(ConfigError):
        choose_factors(sample_clock(irregular().index.to_numpy()), (rate,), [])
    with pytest.raises(ConfigError):
        compare_attitude("alexiev-fig2a", rates_hz=[rate])


def test_a_scenario_without_a_rate_is_sampled_at_the_highest_asked_for():
    bench = compare_attitude("alexiev-fig2a", rates_hz=[50, 200, 25], algorithms=["dcm"])
    assert bench.sweep[bench.sweep["meaning"] == "drop"]["factor"].tolist() == [1, 4, 8]
    assert bench.sweep["rate_hz"].max() == pytest.approx(200.0)


def test_an_algorithm_that_leaves_the_numbers_has_an_infinite_error():
    """Of first order a quaternion grows by sqrt(1 + (theta/2)^2) a step: at 6.4 rad by 3.35, so
    that 325 steps make 1e170 and its square is no number; at 0.05 rad 41600 steps make 3e5."""
    imu = imu_table(np.arange(41601) * 0.01, np.tile([0.0, 0.0, 5.0], (41601, 1)))
    growing = make_algorithm("quaternion:order=1,normalise=false")
    q_nb = np.array([1.0, 0.0, 0.0, 0.0])
    known = Known(np.tile(q_nb, (41601, 1)), np.ones(41601, dtype=bool))
    points = references_table([{"time": 400.0, "kind": "same", "since": 0.0}])
    clock = sample_clock(imu.index.to_numpy())
    grounds = Grounds(imu, q_nb, "linear", points, known, known, None, clock)
    sweep = sweep_rates([growing], grounds, (1, 128), lambda stage, share: None)
    assert np.isfinite(sweep[sweep["factor"] == 1][NUMBERS].to_numpy()).all()
    columns = [*NUMBERS, "reference_deg"]
    assert np.isinf(sweep[sweep["factor"] == 128][columns].to_numpy()).all()


def test_errors_at_reference_points_are_at_the_same_instants_at_every_rate():
    bench = compare_attitude("gestures", algorithms=["quaternion"], rates_hz=[100, 50])
    assert (bench.sweep["reference_deg"] > 0.0).all()
    assert (bench.sweep["error_deg"] >= bench.sweep["reference_deg"]).all()
    largest = max(s.error_deg for s in bench.scores if s.against != "truth")
    found = cells(bench, "drop", 1)["reference_deg"].iloc[0]
    assert found == pytest.approx(largest, abs=1e-12)
    assert QUATERNION[0] in bench.runs[0].attitude


def test_the_lowest_rate_of_a_filter_is_that_of_averaged_samples():
    """It passes at that rate and at every higher one, and not at the next lower one."""
    rates = [100.0, 50.0, 25.0, 12.5, 6.25, 3.125, 1.5625]
    bench = compare_attitude("gestures", sensor="icm-42688-p", rates_hz=rates, tolerance_deg=3.0)
    peer = next(p for p in bench.peers if p.peer == "strapdown error-state")
    truth = bench.truth[QUATERNION].to_numpy()
    largest = {}
    for factor in (1, 2, 4, 8, 16, 32, 64):
        imu = bench.imu.iloc[: 1 + (len(bench.imu) - 1) // factor * factor]
        blocks = imu.iloc[1:].to_numpy().reshape(-1, factor, imu.shape[1]).mean(axis=1)
        index = imu.index[::factor]
        part = pd.DataFrame(np.vstack([imu.iloc[:1], blocks]), index=index, columns=imu.columns)
        q = run_filter(peer.ran, part[GYRO + ACCEL], sampling="mean").q_nb
        there = truth[: len(imu) : factor]
        q = rotation.compose(about_down(q[0], there[0]), q)
        largest[100.0 / factor] = float(rotation.rotation_angle(q, there).max())
    passing = list(takewhile(lambda rate: largest[rate] <= 3.0, rates))
    assert 1 < len(passing) < len(rates), largest
    assert peer.lowest_hz == pytest.approx(passing[-1])
    # The answer names the one of fewest operations.
    few = min((p for p in bench.peers if p.lowest_hz), key=lambda p: p.cost.cycles)
    assert f"{few.peer} stays within 3° down to {few.lowest_hz:.4g} Hz" in bench.answer.why[-1]


def about_down(q, truth):
    """The turn about the vertical that brings a heading to the true one."""
    error = rotation.compose(truth[None], rotation.conjugate(q[None]))[0]
    return rotation.normalise(error * [1.0, 0.0, 0.0, 1.0])[None]

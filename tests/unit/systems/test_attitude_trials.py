"""Several trials: intervals and ranks against scipy, by drawing, and an answer for the worst."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from scipy import stats
from tests.coded import coded

from strapdown import simulate
from strapdown.api.attitude import compare_attitude
from strapdown.attitude_comparison.sweep import rank, trial_names, worst_sweep
from strapdown.config.sources import LogSpec, ScenarioSpec
from strapdown.errors import ConfigError
from strapdown.formats.writers import WRITERS
from strapdown.simulation import ImuErrors, find_scenario, simulate_imu

ALGORITHMS = ["naive", "quaternion"]


def errors(**values):
    return pd.DataFrame(
        {"trial": f"t{k}", "algorithm": name, "error_deg": value}
        for name, series in values.items()
        for k, value in enumerate(series)
    )


def test_an_interval_is_students_and_a_rank_is_of_paired_differences():
    rng = np.random.default_rng(2)
    common = rng.normal(9.0, 3.0, 7)
    b = common + rng.normal(0.1, 0.2, 7)
    c = common + rng.normal(2.0, 0.2, 7)
    found = rank(errors(c=c, a=common, b=b)).set_index("algorithm")
    means = {"a": common.mean(), "b": b.mean(), "c": c.mean()}
    assert list(found.index) == sorted(means, key=means.get)
    for name, values in (("a", common), ("b", b), ("c", c)):
        low, high = stats.ttest_1samp(values, 0.0).confidence_interval(0.95)
        assert found.loc[name, "mean_deg"] == pytest.approx(values.mean())
        assert found.loc[name, "low_deg"] == pytest.approx(low)
        assert found.loc[name, "high_deg"] == pytest.approx(high)
    best, second, last = found.index
    series = {"a": common, "b": b, "c": c}
    for one, two in ((best, second), (second, last)):
        test = stats.ttest_rel(series[two], series[one], alternative="greater")
        assert found.loc[one, "luck"] == pytest.approx(test.pvalue)
    assert np.isnan(found.loc[last, "luck"])
    # The trials scatter by 3 deg; paired, 2 deg of difference are no luck.
    assert found.loc[second, "luck"] < 1e-4


def test_the_interval_covers_the_mean_as_often_as_it_says():
    """2000 times 95 %: a binomial, of which 4 standard deviations are 39."""
    draws = np.random.default_rng(7).normal(50.0, 2.0, (2000, 5))
    found = rank(errors(**{f"a{k}": row for k, row in enumerate(draws)}))
    inside = (found["low_deg"] <= 50.0) & (found["high_deg"] >= 50.0)
    assert len(found) == 2000
    assert abs(int(inside.sum()) - 1900) <= 39


def test_luck_is_even_where_two_are_alike():
    """Twice the luck of the better of two is then a number between 0 and 1 like any other: of 400
    draws 100 lie in each quarter, to 4 standard deviations of 8.7."""
    rng = np.random.default_rng(8)
    lucks = [rank(errors(a=a, b=b))["luck"].iloc[0] for a, b in rng.normal(50, 2, (400, 2, 5))]
    counts, _ = np.histogram(lucks, bins=[0.0, 0.125, 0.25, 0.375, 0.5])
    assert counts.sum() == 400
    assert (np.abs(counts - 100) <= 35).all()


def test_equals_are_as_likely_either_way():
    found = rank(errors(a=[1.0, 2.0, 3.0], b=[1.0, 2.0, 3.0]))
    assert found["luck"].iloc[0] == 0.5
    apart = rank(errors(a=[1.0, 2.0, 3.0], b=[1.5, 2.5, 3.5]))
    assert apart["luck"].iloc[0] == 0.0
    one = rank(errors(a=[1.0], b=[2.0]))
    assert one["luck"].isna().all()
    assert one["low_deg"].isna().all()
    # A mean of angles is not negative.
    assert rank(errors(a=[0.0, 5.0]))["low_deg"].iloc[0] == 0.0


def test_names_are_all_different():
    sources = [
        LogSpec(path="a/log.csv"),
        LogSpec(path="b/log.csv"),
        LogSpec(path="c/other.csv"),
        ScenarioSpec(name="coning", seed=0),
        ScenarioSpec(name="coning", seed=1),
        ScenarioSpec(name="coning", seed=1, rate_hz=50),
    ]
    names = trial_names(sources)
    assert len(set(names)) == len(sources)
    assert names[2] == "other.csv"
    assert names[3] == "coning, seed 0"


def test_seeds_of_a_scenario_are_those_of_separate_runs():
    asked = {"algorithms": ALGORITHMS, "rates_hz": [100, 50]}
    bench = compare_attitude("alexiev-fig2d", trials=3, seed=5, **asked)
    assert bench.trials.names == tuple(f"alexiev-fig2d, seed {k}" for k in (5, 6, 7))
    table = bench.trials.errors.set_index(["trial", "algorithm"])
    assert len(table) == 6
    alone = [compare_attitude("alexiev-fig2d", seed=k, **asked) for k in (5, 6, 7)]
    for k, one in zip((5, 6, 7), alone, strict=True):
        for score in one.scores:
            cell = table.loc[(f"alexiev-fig2d, seed {k}", score.algorithm)]
            assert cell["error_deg"] == score.max_deg
            assert cell["rms_deg"] == pytest.approx(score.rms_deg, abs=1e-12)
            assert cell["final_deg"] == pytest.approx(score.error_deg, abs=1e-12)
    # What is judged is the worst of them, cell by cell.
    together = np.maximum.reduce([a.sweep["error_deg"].to_numpy() for a in alone])
    np.testing.assert_array_equal(bench.sweep["error_deg"], together)
    assert list(bench.sweep.columns) == list(alone[0].sweep.columns)
    assert len({e.sweep["error_deg"].iloc[0] for e in alone}) == 3


def test_the_answer_holds_for_the_worst_trial():
    """Between the smallest and the largest error of the trials no trial's answer may decide."""
    asked = {"algorithms": ["quaternion"], "rates_hz": [100]}
    alone = [compare_attitude("alexiev-fig2d", seed=k, **asked) for k in (0, 1, 2)]
    largest = [float(a.sweep["error_deg"].max()) for a in alone]
    between = 0.5 * (min(largest) + max(largest))
    assert min(largest) < between < max(largest)
    bench = compare_attitude("alexiev-fig2d", trials=3, tolerance_deg=between, **asked)
    assert bench.answer.verdict != "enough"
    wide = compare_attitude("alexiev-fig2d", trials=3, tolerance_deg=max(largest), **asked)
    assert wide.answer.verdict == "enough"
    assert f"{max(largest):.3g}°" in wide.answer.sentence


def test_what_would_help_several_trials_is_what_helps_the_worst():
    asked = {"algorithms": ["quaternion"], "rates_hz": [100], "gyro_bias": "none"}
    bench = compare_attitude("alexiev-fig2e", trials=2, **asked)
    alone = [compare_attitude("alexiev-fig2e", seed=k, **asked) for k in (0, 1)]

    def left(answer):
        said = next(h for h in answer.helps if "--gyro-bias rest" in h)
        return float(said.split(") ")[1].split("°")[0])

    assert left(bench.answer) == max(left(a.answer) for a in alone)
    coning = compare_attitude(["coning", "coning-slow"], algorithms=["rk4"], rates_hz=[100])
    # By the trapezoid rk4 is of second order: sqrt of the error, and not its fourth root.
    error = float(coning.sweep["error_deg"].max())
    needed = next(h for h in coning.answer.helps if "higher rate" in h)
    rate = float(needed.split("about ")[1].split(" Hz")[0])
    assert rate == pytest.approx(100.0 * np.sqrt(error), rel=0.05)


@pytest.fixture(scope="module")
def logs(tmp_path_factory):
    """Two logs of one name with a truth each, the second of twice the rate and of errors."""
    folder = tmp_path_factory.mktemp("logs")
    for name, scenario, rate in (("a", "alexiev-fig2c", 50), ("b", "alexiev-fig2e", 100)):
        simulate(scenario, rate_hz=rate).save(folder / name, formats=["csv"])
    return [folder / "a" / "log.csv", folder / "b" / "log.csv"]


def test_logs_of_different_rates_are_judged_at_rates_that_both_have(logs):
    for order in (logs, logs[::-1]):
        bench = compare_attitude(order, algorithms=ALGORITHMS)
        alone = {p: compare_attitude(p, algorithms=ALGORITHMS).sweep for p in order}
        assert bench.trials.names == ("log.csv (1)", "log.csv (2)")
        for cell in bench.sweep.to_dict("records"):
            # What is said of a rate holds for each log at that rate or at a lower one.
            largest = []
            for table in alone.values():
                cells = table[
                    (table["algorithm"] == cell["algorithm"])
                    & (table["meaning"] == cell["meaning"])
                    & (table["rate_hz"] <= cell["rate_hz"] * (1 + 1e-12))
                ]
                largest.append(cells.sort_values("rate_hz")["error_deg"].iloc[-1])
            assert cell["error_deg"] == max(largest)
        assert bench.sweep["rate_hz"].max() == pytest.approx(50 if order is logs else 100)


def test_rates_without_a_partner_are_left_out():
    def sweep(*rates):
        return pd.DataFrame(
            {
                "algorithm": "dcm",
                "meaning": "drop",
                "factor": range(1, 1 + len(rates)),
                "rate_hz": rates,
                **dict.fromkeys(("own_deg", "final_deg", "rms_deg", "max_deg"), 1.0),
                "reference_deg": np.nan,
                "error_deg": [100.0 / r for r in rates],
            }
        )

    found = worst_sweep([sweep(100.0, 50.0, 5.0), sweep(110.0, 40.0, 10.0)])
    assert found["rate_hz"].tolist() == [110.0, 50.0]
    assert found["error_deg"].tolist() == [1.0, 2.5]
    assert found["reference_deg"].isna().all()
    with pytest.raises(ConfigError, check=coded("attitude.no-rate-common-all-trials")):
        worst_sweep([sweep(1.0), sweep(10.0)])


def test_a_log_of_which_nothing_is_known_among_others(logs, tmp_path):
    imu, _ = simulate_imu(find_scenario("alexiev-fig2c").motion, ImuErrors(), rate=50.0)
    WRITERS["csv"].write(tmp_path / "unknown.csv", {"imu": imu})
    for order in ([logs[0], tmp_path / "unknown.csv"], [tmp_path / "unknown.csv", logs[0]]):
        bench = compare_attitude(order, algorithms=ALGORITHMS, rates_hz=[50])
        assert bench.answer.verdict == "enough"
        told = [f for f in bench.findings if "is not known" in f.what]
        assert [f.file for f in told] == ["unknown.csv"]


def test_findings_and_inputs_are_told_of_every_trial(logs):
    bench = compare_attitude(logs, algorithms=ALGORITHMS, rates_hz=[50])
    assert [i.path for i in bench.inputs] == logs
    assert all(f.file for f in bench.findings)
    assert len(bench.specification["also"]) == 1


@pytest.mark.parametrize(
    "asked",
    [
        {"source": "alexiev-fig2d", "trials": 0},
        {"source": "alexiev-fig2d", "trials": -1},
        {"source": ["alexiev-fig2d", "alexiev-fig2d"]},
        {"source": ["alexiev-fig2d", "Alexiev-Fig2d"], "trials": 3},
        {"source": []},
        {"source": ["alexiev-fig2d", " "]},
    ],
)
def test_what_are_no_trials_is_refused(asked):
    with pytest.raises(ConfigError):
        compare_attitude(asked.pop("source"), **asked)


def test_a_log_is_not_drawn_again_or_named_twice(logs):
    with pytest.raises(ConfigError, check=coded("attitude.recorded-log-not-drawn-again")):
        compare_attitude(logs[0], trials=3)
    with pytest.raises(ConfigError, check=coded("attitude.named-twice-trial-does-not")):
        compare_attitude([logs[0], logs[0]])

"""The answer: on tables that were made up, and on scenarios where what it says is run."""

from __future__ import annotations

import re

import numpy as np
import pandas as pd
import pytest

from strapdown.api.attitude import compare_attitude
from strapdown.attitude_algorithms import make_algorithm
from strapdown.attitude_algorithms.cost import count_cost
from strapdown.attitude_comparison.answer import Evidence, choices, find_answer
from strapdown.formats.writers import WRITERS
from strapdown.simulation import SCENARIOS, ImuErrors, find_scenario, simulate_imu
from strapdown.tables import imu_table

NAMES = ("naive", "quaternion", "rk4")
FULL = 100.0


def evidence(errors, own=None, **other):
    """Errors an algorithm, at 100, 50, 25, … Hz; with samples left out twice as far off."""
    algorithms = [make_algorithm(n) for n in errors]
    rows = []
    for meaning, more in (("sum", 1.0), ("drop", 2.0)):
        for name, values in errors.items():
            for k, value in enumerate(values):
                all_of_it = value if k == 0 else more * value
                mine = all_of_it if own is None else own[name][k]
                rows.append(
                    {
                        "algorithm": name,
                        "meaning": meaning,
                        "factor": 2**k,
                        "rate_hz": FULL / 2**k,
                        "own_deg": mine,
                        "final_deg": value,
                        "rms_deg": value,
                        "max_deg": value,
                        "reference_deg": other.get("reference_deg", np.nan),
                        "error_deg": all_of_it,
                    }
                )
    table = pd.DataFrame(rows).sample(frac=1.0, random_state=1)
    if "reference_deg" in other:
        table["error_deg"] = table[["error_deg", "reference_deg"]].max(axis=1)
    standard = {
        "sensor": (0.0, 0.0, 0.0),
        "known": True,
        "exact": True,
        "without_bias": None,
        "with_cubic": None,
    }
    other.pop("reference_deg", None)
    costs = tuple(count_cost(a) for a in algorithms)
    return Evidence(algorithms, costs, table, **(standard | other))


def test_costs_are_in_the_order_that_the_tests_take_for_granted():
    cycles = [count_cost(make_algorithm(n)).cycles for n in NAMES]
    assert cycles == sorted(cycles)
    assert cycles[0] < cycles[1] < cycles[2]


def test_the_simplest_that_passes_at_its_lowest_rate():
    found = find_answer(
        evidence({"rk4": [0.01, 0.02, 0.04], "naive": [3, 6, 9], "quaternion": [0.1, 0.6, 1.2]}), 1
    )
    assert (found.verdict, found.algorithm, found.meaning, found.rate_hz) == (
        *("enough", "quaternion", "sum"),
        50.0,
    )
    assert "averaged to 50 Hz" in found.sentence
    assert "its largest error is 0.6°" in found.sentence
    why = " ".join(found.why)
    assert "At 25 Hz it would be 1.2°, beyond 1°." in why
    # Twice 0.6 is beyond: with samples left out only the full rate will do.
    assert found.dropped_hz == 100.0
    assert "needs 100 Hz (0.1°)" in why
    assert "naive is simpler, and 3° off at 100 Hz already." in why
    # At 25 Hz a step of rk4 may cost less than twice that of the quaternion at 50 Hz.
    cheap = {n: count_cost(make_algorithm(n)).cycles for n in NAMES}
    fewer = 25 * cheap["rk4"] < 50 * cheap["quaternion"]
    assert ("Fewest operations a second: rk4 at 25 Hz" in why) == fewer
    assert found.helps == ()


def test_the_simplest_is_taken_even_where_only_the_full_rate_will_do():
    errors = {"quaternion": [0.9, 1.1, 2, 4, 8], "rk4": [0, 0, 0, 0, 0.1]}
    found = find_answer(evidence(errors), 1)
    assert (found.algorithm, found.rate_hz) == ("quaternion", 100.0)
    told = re.search(
        r"Fewest operations a second: rk4 at 6.25 Hz, ([\d.]+) thousand .* against ([\d.]+) th",
        " ".join(found.why),
    )
    for text, name, rate in ((told[1], "rk4", 6.25), (told[2], "quaternion", 100.0)):
        cycles = count_cost(make_algorithm(name)).cycles
        assert float(text) == pytest.approx(1e-3 * rate * cycles, rel=5e-3)
    assert float(told[1]) < float(told[2])


def test_a_lower_rate_that_passes_while_a_higher_fails_is_luck():
    table = evidence({"quaternion": [0.2, 1.5, 0.1, 0.9], "rk4": [1.2, 0.1, 0.1, 0.1]})
    found = find_answer(table, 1)
    assert (found.algorithm, found.rate_hz) == ("quaternion", 100.0)
    assert "At 50 Hz it would be 1.5°" in found.why[0]
    # rk4 fails at the full rate, and passes nowhere by right.
    assert [c.cost.algorithm for c in choices(table, "error_deg", 1.0)] == ["quaternion"]


def test_at_the_tolerance_is_within_and_nan_is_not():
    assert find_answer(evidence({"naive": [1.0, np.inf]}), 1).rate_hz == 100.0
    assert "At 50 Hz it runs away." in find_answer(evidence({"naive": [1.0, np.inf]}), 1).why
    assert find_answer(evidence({"naive": [np.nan, 0.1]}), 1).verdict == "rate"
    lowest = find_answer(evidence({"naive": [0.1, 0.1]}), 1)
    assert "50 Hz is the lowest rate that was tried." in lowest.why


def test_nothing_known_judges_the_own_error_and_says_so():
    found = find_answer(evidence({"naive": [0.5, 2.0]}, known=False, sensor=None), 1)
    assert found.verdict == "own"
    assert "its largest own error is 0.5°" in found.sentence
    assert "Nothing is known of the attitude" in found.why[-1]
    assert "--reference" in found.helps[0]
    # And where its own error is too large, the sensor cannot be blamed.
    rate = find_answer(evidence({"naive": [5.0]}, known=False, sensor=None), 1)
    assert rate.verdict == "rate"
    assert "--reference" in rate.helps[0]


def test_the_sensor_is_the_limit():
    table = evidence(
        {"naive": [21, 22, 24], "quaternion": [20.1, 20.2, 25.0]},
        own={"naive": [1.9, 2.2, 4.0], "quaternion": [0.1, 0.2, 5.0]},
        sensor=(3.0, 10.0, 20.0),
        without_bias=0.4,
    )
    found = find_answer(table, 1)
    # naive is within a tenth of 20 deg, and not within the tolerance itself.
    assert (found.verdict, found.algorithm, found.rate_hz) == ("sensor", "quaternion", 50.0)
    assert "none could: the sensor alone makes 20°" in found.sentence
    assert "its own error, 0.2°, is small beside that" in found.sentence
    assert "At 25 Hz it would be 5°, beyond 1°." in found.why
    # A tenth of 3 deg is less than the tolerance: what is seen of it counts.
    near = evidence({"quaternion": [3.0, 3.5]}, own={"quaternion": [0.1, 0.6]}, sensor=(3, 3, 3))
    assert find_answer(near, 1).rate_hz == 100.0
    assert "quaternion at 100 Hz, is 20.1° off; its own part is 0.1°" in found.why[0]
    assert "--gyro-bias rest) 0.4° would be left" in found.helps[0]
    assert "20 times smaller" in found.helps[1]
    estimate = find_answer(evidence({"naive": [20.0]}, own={"naive": [0.1]}, exact=False), 1)
    assert estimate.verdict == "rate"  # of a sensor without error


def test_a_bias_that_would_not_help_is_not_suggested():
    told = {"own": {"naive": [0.1]}, "sensor": (20.0, 20.0, 20.0)}
    for left, said in ((19.9, False), (25.0, False), (5.0, True)):
        found = find_answer(evidence({"naive": [20.0]}, without_bias=left, **told), 1)
        assert any("--gyro-bias rest" in h for h in found.helps) == said


def test_reference_points_alone_tell_of_the_sensor():
    """Five degrees off at a point, a tenth of a degree of it the algorithm's."""
    table = evidence({"quaternion": [5.0, 5.5]}, own={"quaternion": [0.1, 0.6]}, sensor=None)
    found = find_answer(table, 1)
    assert found.verdict == "sensor"
    assert "sensor and reference points are 4.9° apart" in found.sentence
    assert (found.algorithm, found.rate_hz) == ("quaternion", 100.0)


def test_a_wrong_reference_point_beside_a_good_truth_is_not_the_rate():
    found = find_answer(evidence({"quaternion": [0.01, 0.02]}, reference_deg=30.0), 1)
    assert found.verdict == "sensor"
    assert "sensor and reference points are 30° apart" in found.sentence


def test_a_start_that_is_off_is_named():
    found = find_answer(
        evidence(
            {"quaternion": [5.1]},
            own={"quaternion": [0.1]},
            sensor=(5.0, 5.0, 5.0),
            start=5.0,
        ),
        1,
    )
    assert "sensor and start make 5°, and the start is 5° off" in found.sentence
    assert "--initial" in found.helps[0]


def test_the_rate_is_the_limit_and_how_much_higher_it_should_be():
    found = find_answer(evidence({"quaternion": [4.0, 16.0], "naive": [50.0, 70.0]}), 1)
    # Second order: four times the error, twice the rate.
    assert found.verdict == "rate"
    assert (found.algorithm, found.meaning, found.rate_hz) == (None, None, None)
    assert "the best, quaternion, is 4° off" in found.sentence
    assert "about 200 Hz" in found.helps[0]
    assert not any("cubic" in h for h in found.helps)
    cubic = find_answer(evidence({"rk4": [16.0]}, with_cubic=0.3), 1)
    assert "--interpolation cubic): 0.3° would be left" in cubic.helps[0]
    # rk4 is of second order by the trapezoid, and of fourth where nothing runs along chords.
    assert "about 400 Hz" in cubic.helps[1]
    assert "about 200 Hz" in find_answer(evidence({"rk4": [16.0]}), 1).helps[0]


def test_of_a_higher_rate_the_sensors_part_stays():
    """Half of the tolerance is the sensor's: the algorithm's 2 deg must fall to half a degree."""
    found = find_answer(
        evidence({"quaternion": [2.5]}, own={"quaternion": [2.0]}, sensor=(0.5, 0.5, 0.5)), 1
    )
    assert found.verdict == "rate"
    assert "about 200 Hz" in found.helps[0]


def test_an_order_is_not_carried_on_for_ever():
    found = find_answer(
        evidence({"quaternion": [1.9]}, own={"quaternion": [0.91]}, sensor=(0.999, 0.999, 0.999)), 1
    )
    assert not any("higher rate" in h for h in found.helps)
    # The naive sum has no order: a higher rate does not help it.
    assert not any("higher rate" in h for h in find_answer(evidence({"naive": [9.0]}), 1).helps)


# From here on, on scenarios.


def number_before(unit, text):
    return float(re.findall(rf"([\d.e+-]+) ?{unit}", text)[0])


def test_the_sentence_says_what_the_sweep_says():
    bench = compare_attitude("alexiev-fig5-large", tolerance_deg=0.6)
    answer, table = bench.answer, bench.sweep
    assert (answer.verdict, answer.algorithm) == ("enough", "quaternion")
    chosen = table[(table["algorithm"] == answer.algorithm) & (table["meaning"] == answer.meaning)]
    cell = chosen[chosen["rate_hz"] == answer.rate_hz].iloc[0]
    words = re.fullmatch(
        r"Quaternion \(quaternion\) with samples averaged to ([\d.]+) Hz is the simplest that "
        r"stays within 0.6°: its largest error is ([\d.]+)°\.",
        answer.sentence,
    )
    assert words is not None
    # Four digits of the rate, three of the angle.
    assert float(words[1]) == pytest.approx(cell["rate_hz"], rel=5e-4)
    assert float(words[2]) == pytest.approx(cell["max_deg"], rel=5e-3)
    for factor in chosen["factor"]:
        at = chosen[chosen["factor"] == factor].iloc[0]
        if at["rate_hz"] >= answer.rate_hz:
            assert at["error_deg"] <= 0.6
    lower = chosen[chosen["rate_hz"] < answer.rate_hz].sort_values("rate_hz").iloc[-1]
    assert lower["error_deg"] > 0.6
    told = re.match(r"At ([\d.]+) Hz it would be ([\d.]+)°, beyond 0.6°\.", answer.why[0])
    assert float(told[1]) == pytest.approx(lower["rate_hz"], rel=5e-4)
    assert float(told[2]) == pytest.approx(lower["error_deg"], rel=5e-3)
    dropped = table[(table["algorithm"] == "quaternion") & (table["meaning"] == "drop")]
    told = re.search(r"leaves samples out.* needs ([\d.]+) Hz \(([\d.]+)°\)", " ".join(answer.why))
    cell = dropped.iloc[(dropped["rate_hz"] - float(told[1])).abs().argmin()]
    assert cell["rate_hz"] == answer.dropped_hz > answer.rate_hz
    assert float(told[2]) == pytest.approx(cell["error_deg"], rel=5e-3)
    naive = table[(table["algorithm"] == "naive") & (table["factor"] == 1)].iloc[0]
    told = next(w for w in answer.why if w.startswith("naive"))
    assert number_before("°", told) == pytest.approx(naive["error_deg"], rel=5e-3)
    cycles = {c.algorithm: c.cycles for c in bench.costs}
    simpler = {name for name in cycles if cycles[name] < cycles["quaternion"]}
    assert simpler == {w.split()[0] for w in answer.why if "is simpler" in w}


def test_what_helps_a_biased_gyro_helps():
    plain = compare_attitude("alexiev-fig2e", gyro_bias="none")
    assert plain.answer.verdict == "sensor"
    said = next(h for h in plain.answer.helps if "--gyro-bias rest" in h)
    left = float(re.search(r"([\d.]+)° would be left", said)[1])
    better = compare_attitude("alexiev-fig2e")
    assert better.gyro_bias["rad_per_s"] is not None
    full = better.sweep[(better.sweep["factor"] == 1) & (better.sweep["meaning"] == "drop")]
    # By the most accurate of those that were run, which is not the most accurate that there is:
    # their own errors are apart by as much as the two differ by.
    own = min(s.own_deg[2] for s in better.shares)
    assert abs(full["error_deg"].min() - left) <= 2.0 * own
    assert better.answer.verdict == "enough"
    # What was said to be all that is needed at the bias is no more than a tenth of its error.
    cell = plain.sweep[
        (plain.sweep["algorithm"] == plain.answer.algorithm)
        & (plain.sweep["meaning"] == plain.answer.meaning)
        & (plain.sweep["rate_hz"] == plain.answer.rate_hz)
    ].iloc[0]
    sensor = float(re.search(r"sensor alone makes ([\d.]+)°", plain.answer.sentence)[1])
    assert cell["own_deg"] <= 0.1 * sensor * 1.005
    smaller = next(h for h in plain.answer.helps if "times smaller" in h)
    assert number_before("times", smaller) == pytest.approx(sensor, rel=0.05)


def test_what_helps_at_too_low_a_rate_helps():
    at = {"algorithms": ["quaternion", "rk4"]}
    plain = compare_attitude("coning", rates_hz=[100], **at)
    assert plain.answer.verdict == "rate"
    cubic, higher = plain.answer.helps[:2]
    left = float(re.search(r"([\d.]+)° would be left", cubic)[1])
    better = compare_attitude("coning", rates_hz=[100], interpolation="cubic", **at)
    assert better.sweep["error_deg"].min() <= left * 1.01
    assert better.answer.verdict == "enough"
    rate = float(re.search(r"about (\d+) Hz", higher)[1])
    faster = compare_attitude("coning", rates_hz=[rate], **at)
    # By the leading power alone: the next one, of (2 pi 10/100)^2, may take a part.
    assert faster.sweep["error_deg"].min() < 1.2
    assert faster.sweep["error_deg"].min() > 0.5


@pytest.fixture(scope="module")
def turned(tmp_path_factory):
    """A log of a scenario without its truth."""
    imu, _ = simulate_imu(find_scenario("alexiev-fig2c").motion, ImuErrors(), rate=50.0)
    path = tmp_path_factory.mktemp("logs") / "turned.csv"
    WRITERS["csv"].write(path, {"imu": imu})
    return path


def test_a_log_of_which_nothing_is_known(turned):
    bench = compare_attitude(turned, algorithms=["naive", "quaternion"])
    assert bench.answer.verdict == "own"
    assert bench.answer.algorithm == "quaternion"
    # A wrong reference point: the sensor, and not the rate, is what is far from it.
    wrong = compare_attitude(
        turned, algorithms=["naive", "quaternion"], reference="end roll 0 pitch 0 heading 90"
    )
    assert wrong.answer.verdict == "sensor"
    assert "reference points" in wrong.answer.sentence


def test_a_log_that_turns_faster_than_it_is_sampled(tmp_path):
    """Ten turns a second about axes that change, at 15 Hz, of which nothing is known."""
    time = np.arange(60) / 15.0
    gyro = 20.0 * np.column_stack([np.sin(9 * time), np.cos(7 * time), np.sin(5 * time + 1)])
    WRITERS["csv"].write(tmp_path / "fast.csv", {"imu": imu_table(time, gyro)})
    bench = compare_attitude(tmp_path / "fast.csv", algorithms=["naive", "quaternion"])
    assert bench.answer.verdict == "rate"
    assert bench.answer.algorithm is None


def test_the_tolerance_moves_the_answer(turned):
    rates = []
    for tolerance in (0.3, 1.0, 3.0, 10.0):
        answer = compare_attitude(
            "coning-slow", tolerance_deg=tolerance, algorithms=["quaternion"]
        ).answer
        rates.append(answer.rate_hz)
        assert answer.tolerance_deg == tolerance
    assert rates == sorted(rates, reverse=True)
    assert len(set(rates)) > 2


@pytest.mark.parametrize("name", SCENARIOS)
def test_every_scenario_has_an_answer(name):
    bench = compare_attitude(name, algorithms=["naive", "quaternion"], rates_hz=[100])
    answer = bench.answer
    assert answer.verdict in ("enough", "sensor", "rate")
    error = bench.sweep.set_index("algorithm")["error_deg"]
    assert (answer.verdict == "enough") == bool((error <= 1.0).any())
    assert answer.sentence.endswith(".")
    assert all(text.endswith((".", ").")) for text in (*answer.why, *answer.helps))


def test_one_that_is_right_by_luck_is_not_chosen():
    """Its whole error is small because its own cancels the sensor's."""
    errors = {"naive": [0.2, 0.3], "quaternion": [0.8, 0.9]}
    own = {"naive": [5.0, 6.0], "quaternion": [0.01, 0.04]}
    found = find_answer(evidence(errors, own), 1)
    assert (found.algorithm, found.rate_hz) == ("quaternion", 50.0)
    assert "naive is simpler, and 5° off at 100 Hz already." in found.why


def test_reference_points_that_are_hardly_known_are_the_limit():
    table = evidence(
        {"quaternion": [4.0]}, own={"quaternion": [0.1]}, sensor=None, reference_sd=2.5
    )
    found = find_answer(table, 1)
    assert "the reference points are themselves known to 2.5° (1σ) only" in found.sentence
    assert found.helps[0].startswith("Better reference points")
    assert not any("times smaller" in line for line in found.helps)


def test_what_the_rate_does_between_its_stamps_is_said():
    quiet = find_answer(evidence({"quaternion": [0.01]}, known=False, sampling=0.05), 1)
    told = find_answer(evidence({"quaternion": [0.01]}, known=False, sampling=0.36), 1)
    assert not any("between its stamps" in line for line in quiet.why)
    assert any("by up to 0.36°" in line for line in told.why)


def test_an_attitude_that_is_lost_has_no_ratio():
    found = find_answer(
        evidence({"quaternion": [170.0]}, own={"quaternion": [0.1]}, sensor=(1, 2, 170.0)), 1
    )
    assert any("the attitude is lost" in line for line in found.helps)

"""Where a run starts, and what is taken off its rates."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from tests.coded import coded

from strapdown.api.attitude import compare_attitude
from strapdown.attitude_comparison.options import AttitudeOptions
from strapdown.errors import ConfigError, DataError
from strapdown.formats.writers import WRITERS
from strapdown.tables import ACCEL, GYRO, MAG, imu_table

BIAS = np.array([0.02, -0.03, 0.01])


@pytest.fixture
def log(tmp_path) -> Path:
    """Six seconds at rest with a bias, a turn, six at rest."""
    time = np.arange(1500) * 0.01
    gyro = np.tile(BIAS, (1500, 1))
    gyro[600:900, 2] += 0.5
    WRITERS["csv"].write(tmp_path / "log.csv", {"imu": imu_table(time, gyro)})
    return tmp_path / "log.csv"


@pytest.mark.parametrize(
    "bias", ["rest", "0.02,-0.03,0.01", "0.02, -0.03, 0.01 rad/s", tuple(BIAS), BIAS, "REST"]
)
def test_the_bias_is_taken_off(log, bias):
    bench = compare_attitude(log, gyro_bias=bias)
    assert np.abs(bench.imu[GYRO].to_numpy()[:500]).max() < 1e-15


def test_a_bias_in_degrees_and_from_a_log(log):
    words = ",".join(str(v) for v in np.degrees(BIAS)) + " deg/s"
    for bias in (words, log, str(log)):
        bench = compare_attitude(log, gyro_bias=bias)
        assert np.abs(bench.imu[GYRO].to_numpy()[:500]).max() < 1e-15


@pytest.mark.parametrize("bias", ["1,2", "a,b,c", "1,2,3 furlong", "nan,0,0", "typo", ""])
def test_what_is_no_bias_is_refused(log, bias):
    with pytest.raises(ConfigError):
        compare_attitude(log, gyro_bias=bias)


@pytest.mark.parametrize("initial", ["10,-20,300", (10, -20, 300), np.array([10.0, -20, 300])])
def test_the_start_is_as_given(log, initial):
    found = compare_attitude(log, initial=initial).initial
    angles = [found[k] for k in ("roll_deg", "pitch_deg", "heading_deg")]
    assert angles == pytest.approx([10, -20, 300], abs=1e-9)


@pytest.mark.parametrize("initial", ["1,2", "north", "nan,0,0", "1e300,0,0", "truth", "level"])
def test_a_start_that_cannot_be_had_is_refused(log, initial):
    with pytest.raises(ConfigError):
        compare_attitude(log, initial=initial)


@pytest.mark.parametrize(
    "options",
    [
        {"seed": -1},
        {"seed": 1.5},
        {"rate_hz": float("nan")},
        {"rate_hz": "fast"},
        {"from_s": float("-inf")},
        {"axes": ["x"]},
        {"columns": {"time": 1}},
        {"columns": {"gyr": "x"}},
        {"algorithms": []},
        {"algorithms": ["dcm", "dcm"]},
        {"reference": [None]},
        {"reference": ["x" * 400]},
    ],
)
def test_values_that_do_not_fit_are_our_own_errors(log, options):
    with pytest.raises((ConfigError, DataError)):
        compare_attitude(log, **options)


def test_one_text_stands_for_a_list_of_one(log):
    bench = compare_attitude(log, algorithms="QUATERNION", reference="end same as start")
    assert [s.algorithm for s in bench.scores] == ["quaternion"]


@pytest.mark.parametrize("option", [{"axes": "x,-y,-z"}, {"gyro_unit": "deg/s"}, {"repair": True}])
def test_a_scenario_is_not_read_from_a_file(option):
    with pytest.raises(ConfigError, check=coded("attitude.scenario-not-read-file")):
        compare_attitude("alexiev-fig4", **option)


def test_the_part_that_was_used_is_told(log):
    bench = compare_attitude(log, from_s=2.0, to_s=8.0)
    assert "601 samples in 6 s" in bench.description
    assert "the part from 2 to 8 s" in bench.description


def test_a_run_through_the_pole_is_told_at_any_rate():
    for rate in (5, 20, 50):
        bench = compare_attitude("alexiev-fig4", rate_hz=rate, algorithms=["euler"])
        near = bench.runs[0].diagnostics["closest_to_pole_deg"]
        pitch = bench.runs[0].attitude["pitch"]
        # Read as 3-2-1 angles an attitude beyond the pole has turned roll and heading around.
        beyond = bool((bench.runs[0].attitude["roll"].abs() > 90).any())
        assert (near == 0.0) == beyond, (rate, near, pitch.max())


def test_turns_on_a_log_of_means(tmp_path):
    time = np.arange(101) * 0.1
    gyro = np.zeros((101, 3))
    gyro[1:51, 2] = 2 * np.pi / 5.0
    WRITERS["csv"].write(tmp_path / "log.csv", {"imu": imu_table(time, gyro, sampling="mean")})
    bench = compare_attitude(
        tmp_path / "log.csv",
        algorithms=["naive", "euler", "dcm", "quaternion"],
        reference="end 1 turn about z since start",
    )
    assert bench.scores[0].turned_deg == pytest.approx(360.0, abs=1e-9)
    assert {round(s.error_deg, 9) for s in bench.scores} == {0.0}


def test_a_summary_of_nothing_still_has_its_columns(log):
    summary = compare_attitude(log).summary
    assert len(summary) == 0
    assert {"algorithm", "against", "error_deg"} <= set(summary.columns)


@pytest.mark.parametrize(("rate", "doubted"), [(0.05, True), (0.01, False)])
def test_a_large_bias_may_be_a_turn_and_stated_ones_are_not_doubted(tmp_path, rate, doubted):
    """Level, ten seconds of a rate about the vertical, a turn about another axis, again ten."""
    rng, time = np.random.default_rng(2), np.arange(2500) * 0.01
    gyro = 1e-4 * rng.normal(size=(2500, 3)) + [0.0, 0.0, rate]
    gyro[1000:1500, 0] += np.sin(2.0 * np.pi * time[:500] / 5.0)
    force = np.array([0.0, 0.0, -9.81]) + 0.01 * rng.normal(size=gyro.shape)
    path = tmp_path / "log.csv"
    WRITERS["csv"].write(path, {"imu": imu_table(time, gyro, force)})
    found = compare_attitude(path)
    assert ("attitude.bias-or-turn" in [f.code for f in found.findings]) == doubted
    assert found.gyro_bias["rad_per_s"][2] == pytest.approx(rate, abs=1e-5)
    for stated in ("rest", (0.0, 0.0, rate), "none"):
        stated_codes = [f.code for f in compare_attitude(path, gyro_bias=stated).findings]
        assert "attitude.bias-or-turn" not in stated_codes
    # A magnetic field that stays tells a rest from a turn.
    field = np.tile([20.0, 0.0, 40.0], (2500, 1)) + 0.1 * rng.normal(size=gyro.shape)
    units = dict.fromkeys(GYRO, "rad/s") | dict.fromkeys(ACCEL, "m/s2") | dict.fromkeys(MAG, "uT")
    names = ["time_s", *(f"{name}_{unit}" for name, unit in units.items())]
    columns = np.column_stack([time, gyro, force, field])
    pd.DataFrame(columns, columns=names).to_csv(path, index=False)
    assert "attitude.bias-or-turn" not in [f.code for f in compare_attitude(path).findings]


@pytest.mark.parametrize(("across", "warned"), [(0.02, True), (0.045, True), (0.1, False)])
def test_a_motion_about_one_axis_is_said_to_prove_little(across, warned):
    time = np.arange(2000) * 0.01
    # About an axis that is none of the body's; `across` is the share of the rate beside it.
    rates = np.outer(np.sin(time), [0.6, 0.0, 0.8]) + np.outer(across * np.cos(time), [0, 1, 0])
    imu = pd.DataFrame(rates, columns=list(GYRO), index=pd.Index(time, name="time"))
    found = compare_attitude(imu, gyro_bias="none").findings
    (one,) = [f for f in found if f.code == "attitude.one-axis"] or [None]
    assert (one is not None) == warned
    assert one is None or one.data["across"] == pytest.approx(across, rel=0.1)


def test_a_log_that_hardly_turns_proves_nothing_about_algorithms():
    time = np.arange(2000) * 0.01
    rates = 0.04 * np.column_stack([np.sin(time), np.cos(time), np.sin(2 * time)])
    imu = pd.DataFrame(rates, columns=list(GYRO), index=pd.Index(time, name="time"))
    codes = [f.code for f in compare_attitude(imu, gyro_bias="none").findings]
    assert "attitude.hardly-turns" in codes and "attitude.one-axis" not in codes


def test_a_rest_after_the_begin_is_named_as_a_start(tmp_path):
    time = np.arange(2000) * 0.01
    moving = (time < 3.0) | (time > 12.0)
    rates = 0.5 * np.column_stack([np.sin(5 * time), np.cos(4 * time), np.sin(3 * time)])
    force = np.tile([0.0, 0.0, -9.8], (time.size, 1)) + 2.0 * rates * moving[:, None]
    imu = imu_table(time, rates * moving[:, None], force)
    said = [f for f in compare_attitude(imu).findings if f.code == "attitude.rest-after-begin"]
    assert len(said) == 1 and said[0].data["begin"] == pytest.approx(3.0, abs=0.5)
    assert f"--from {said[0].data['begin']:.2f}" in said[0].advice("cli")
    later = compare_attitude(imu, options=AttitudeOptions(from_s=said[0].data["begin"]))
    assert "attitude.rest-after-begin" not in [f.code for f in later.findings]

"""Whose the error is: what was split recombines, against algorithms run apart from the bench."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from scipy.spatial.transform import Rotation

from strapdown import simulate
from strapdown.api.attitude import compare_attitude
from strapdown.attitude_algorithms import RotationVector, attitude_history, make_algorithm
from strapdown.formats.writers import WRITERS
from strapdown.increments import increments_from_imu
from strapdown.simulation import ImuErrors, find_scenario, simulate_imu
from strapdown.tables import QUATERNION, imu_table

SINGLE = 2.0**-24
# Two attitudes of unit quaternions, each good to a few roundings.
ROUNDING = 1e-12  # deg

CASES = [
    ("alexiev-fig2c", "mpu-6050", "instantaneous"),
    ("alexiev-fig4", "bmi270", "instantaneous"),
    ("coning-slow", "stim300", "mean"),
    ("alexiev-sequence", "mpu-9250", "instantaneous"),
]


def scipy(table):
    return Rotation.from_quat(np.asarray(table)[:, [1, 2, 3, 0]])


@pytest.mark.parametrize(("name", "sensor", "sampling"), CASES)
def test_sensor_and_algorithm_recombine_to_the_total(name, sensor, sampling):
    bias = "none" if name == "coning-slow" else "rest"
    bench = compare_attitude(
        name,
        sensor=sensor,
        sampling=sampling,
        rate_hz=50,
        rates_hz=[50],
        gyro_bias=bias,
        algorithms=["quaternion", "dcm", "rk4"],
    )
    clean, truth = simulate_imu(
        find_scenario(name).motion, ImuErrors(), rate=50.0, sampling=sampling
    )
    exact = scipy(truth[QUATERNION])
    for run, share in zip(bench.runs, bench.shares, strict=True):
        apart = attitude_history(
            make_algorithm(run.algorithm),
            increments_from_imu(clean),
            truth[QUATERNION].to_numpy()[0],
        )
        q, q_clean = scipy(run.attitude[QUATERNION]), scipy(apart)
        total = (exact.inv() * q).as_rotvec()
        own = (exact.inv() * q_clean).as_rotvec()
        sensors = (q_clean.inv() * q).as_rotvec()
        sizes = [np.linalg.norm(v, axis=1) for v in (own, sensors, total)]
        for size, told in zip(sizes, (share.own_deg, share.sensor_deg), strict=False):
            degrees = np.degrees(size)
            expected = (degrees[-1], np.sqrt((degrees**2).mean()), degrees.max())
            assert told == pytest.approx(expected, rel=1e-9, abs=1e-9)
        # log(exp a exp b) = a + b + a x b / 2 + ((a x (a x b)) + (b x (b x a))) / 12 + ...: what
        # follows the first product is a geometric series of ratio |a| + |b|, of which the first
        # term has a sixth; here it is below a third.
        a, b, _ = sizes
        assert (a + b).max() < 0.4
        off = np.linalg.norm(total - own - sensors, axis=1)
        assert (off <= 0.5 * a * b * (1.0 + a + b) + 1e-13).all()
        # And it is a split of something: neither part is nothing.
        assert share.own_deg[2] > 1e-4
        assert share.sensor_deg[2] > 1e-4
        score = next(s for s in bench.scores if s.algorithm == run.algorithm)
        assert score.error_deg == pytest.approx(np.degrees(sizes[2][-1]), abs=1e-9)
        # The angle of a rotation is a distance.
        assert score.error_deg <= share.own_deg[0] + share.sensor_deg[0] + ROUNDING


def test_without_sensor_errors_all_of_it_is_the_algorithms():
    bench = compare_attitude("alexiev-fig4", rates_hz=[100], algorithms=["naive", "euler", "dcm"])
    for share, score in zip(bench.shares, bench.scores, strict=True):
        assert max(share.sensor_deg) < ROUNDING
        expected = (score.error_deg, score.rms_deg, score.max_deg)
        assert share.own_deg == pytest.approx(expected, abs=ROUNDING)


def test_a_start_that_was_given_is_not_the_algorithms_error():
    at = {"algorithms": ["quaternion"], "rates_hz": [100]}
    plain = compare_attitude("alexiev-fig2c", **at)
    turned = compare_attitude("alexiev-fig2c", initial="10,-20,5", **at)
    assert turned.shares[0].own_deg == pytest.approx(plain.shares[0].own_deg, abs=1e-9)
    # The start: what a rotation of 10, -20, 5 deg from level turns by.
    start = np.degrees(Rotation.from_euler("ZYX", [5, -20, 10], degrees=True).magnitude())
    error = float(turned.sweep["error_deg"].iloc[0])
    assert abs(error - start) <= plain.shares[0].own_deg[2] + 1e-9
    assert turned.answer.verdict == "sensor"
    assert f"the start is {start:.3g}° off" in turned.answer.sentence


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    """A noisy log with its truth in a file beside it."""
    folder = tmp_path_factory.mktemp("log") / "s"
    simulate("alexiev-fig2e", rate_hz=50, seed=3).save(folder, formats=["csv"])
    plain = folder / "plain.csv"
    table = pd.read_csv(folder / "log.csv", comment="#")
    table[[c for c in table if not c.startswith(("q_", "roll", "pitch", "heading"))]].to_csv(
        plain, index=False
    )
    return plain


def test_on_a_log_the_most_accurate_algorithm_stands_for_the_truth(log):
    bench = compare_attitude(log, reference=log.with_name("truth.csv"), rates_hz=[50])
    best = RotationVector(samples=4, coefficients="fit")
    q = attitude_history(
        best, increments_from_imu(bench.imu), bench.runs[0].attitude[QUATERNION].to_numpy()[0]
    )
    exact = simulate_imu(find_scenario("alexiev-fig2e").motion, ImuErrors(), rate=50.0)[1]
    sensor = np.degrees((scipy(exact[QUATERNION]).inv() * scipy(q)).magnitude())
    for run, share in zip(bench.runs, bench.shares, strict=True):
        own = np.degrees((scipy(q).inv() * scipy(run.attitude[QUATERNION])).magnitude())
        assert share.own_deg[0] == pytest.approx(own[-1], abs=1e-9)
        assert share.own_deg[2] == pytest.approx(own.max(), abs=1e-9)
        # The truth's file has nine or more digits behind the point.
        assert share.sensor_deg[0] == pytest.approx(sensor[-1], abs=1e-6)
        assert share.sensor_deg[2] == pytest.approx(sensor.max(), abs=1e-6)


def test_on_a_log_without_a_truth_nothing_is_the_sensors(log):
    bench = compare_attitude(log, rates_hz=[50], reference="end same as 6")
    assert {s.sensor_deg for s in bench.shares} == {None}
    assert all(s.own_deg[2] < 180.0 for s in bench.shares)


def turning(steps: int, rate: float, path):
    """About all axes, at a constant rate, which every step rounds alike."""
    gyro = np.tile(rate * np.array([0.6, -0.48, 0.64]), (steps + 1, 1))
    WRITERS["csv"].write(path, {"imu": imu_table(np.arange(steps + 1) * 0.01, gyro)})
    return path


@pytest.mark.parametrize("name", ["quaternion", "dcm", "rotvec"])
def test_single_precision_grows_with_the_steps(name, tmp_path):
    """Each step rounds a few dozen times by 2^-24; a constant rate and step are rounded alike in
    every step, by 2^-24 of the turn each, and the product of both once more."""
    found = []
    for steps in (400, 12800):
        path = turning(steps, 1.0, tmp_path / f"{steps}.csv")
        bench = compare_attitude(path, algorithms=[name], rates_hz=[100])
        final, _, largest = bench.shares[0].single_deg
        turn = 0.01 * steps
        assert largest <= np.degrees(SINGLE * (3.0 * turn + 40.0 * steps))
        assert largest >= final
        found.append(largest)
    # Of 32 times as many steps the roundings grow 5.7 times if they are like a random walk, and
    # 32 times if they are all alike: in any case they grow.
    assert found[1] > 2.0 * found[0] > 0.0

"""What Alexiev says of Figs. 5 and 6, judged on motions with exact truth."""

from __future__ import annotations

import numpy as np
import pytest

from strapdown import rotation
from strapdown.attitude_algorithms import make_algorithm, run_attitude
from strapdown.increments import increments_from_imu
from strapdown.simulation import ImuErrors, find_scenario, simulate_imu
from strapdown.tables import QUATERNION


def final_error(name: str, algorithm: str, rate: float, sampling: str = "instantaneous") -> float:
    motion = find_scenario(name).motion
    imu, truth = simulate_imu(motion, ImuErrors(), rate=rate, sampling=sampling)
    q = truth[QUATERNION].to_numpy()
    run = run_attitude(make_algorithm(algorithm), increments_from_imu(imu), q[0])
    return float(rotation.rotation_angle(run.attitude[QUATERNION].to_numpy()[-1], q[-1]))


@pytest.mark.parametrize(("name", "known"), [("alexiev-fig5", 1.08), ("alexiev-fig5-large", 89.6)])
def test_no_rate_helps_the_naive_sum(name, known):
    """From mean rates its sums are exact, and what remains is that rotations do not commute."""
    errors = [final_error(name, "naive", rate, "mean") for rate in (5.0, 100.0, 10_000.0)]
    assert errors == pytest.approx([errors[0]] * 3, abs=1e-9)
    motion = find_scenario(name).motion
    end = [motion.duration]
    read = rotation.quaternion_from_euler(np.degrees(motion.angle(end)[0]))
    assert errors[0] == pytest.approx(
        float(rotation.rotation_angle(read, motion.attitude(end)[0])), abs=1e-9
    )
    assert errors[0] == pytest.approx(known, abs=0.05)


def test_the_naive_error_grows_with_the_square_of_the_turns():
    motion = find_scenario("alexiev-fig5").motion
    x, y, z = (abs(p.rate) * (p.end - p.start) for p in motion.pulses)
    # Half of each pair of turns at most as a commutator, and once more from reading sums of body
    # rates as angles of three different axes.
    assert np.radians(final_error("alexiev-fig5", "naive", 100.0)) < x * y + y * z + z * x


def test_what_a_low_rate_costs_is_the_edges_and_not_the_algorithm():
    """Off the grid of 5 Hz, the exact algorithm is as far off as its samples are."""
    assert final_error("alexiev-fig5", "dcm", 5.0) > 0.3
    # At 100 Hz all edges are on the grid and only the steps in which two rates meet are left.
    assert final_error("alexiev-fig5", "dcm", 100.0) < 1e-4
    assert final_error("alexiev-fig5", "dcm", 100.0, "mean") < 1e-11


def test_at_20_hz_the_rate_alone_costs_degrees_and_twice_the_rate_takes_three_quarters():
    # 17.6 deg at 20 Hz, 0.71 at 100 Hz, 0.007 at 1 kHz: no sensor error in any of them.
    errors = {
        rate: final_error("alexiev-fig6", "dcm", rate) for rate in (20.0, 100.0, 200.0, 400.0)
    }
    assert errors[20.0] == pytest.approx(17.6, abs=0.1)
    # Second order; the next term is of the fourth, and 2 % of it at 100 Hz is generous.
    assert errors[100.0] / errors[200.0] == pytest.approx(4.0, rel=0.02)
    assert errors[200.0] / errors[400.0] == pytest.approx(4.0, rel=0.005)


def test_decimating_a_faster_record_gives_the_slower_one():
    motion = find_scenario("alexiev-fig6").motion
    fast, _ = simulate_imu(motion, ImuErrors(), rate=100.0)
    slow, _ = simulate_imu(motion, ImuErrors(), rate=20.0)
    # The stamps differ by a rounding of 11 s, and the rates change by 300 rad/s² at most.
    assert np.abs(fast.iloc[::5].to_numpy() - slow.to_numpy()).max() < 300 * 4e-15

"""Fig. 4 of Alexiev (2021): x 0.1 rad/s and y 2 rad/s, both on [2 s, 3 s), no noise.

The exact final attitude is exp([0.1, 2, 0]); the expected errors of Euler's kinematics were
derived apart from this code (theory notes, part A).
"""

from __future__ import annotations

import numpy as np
import pytest

from strapdown import rotation
from strapdown.api.attitude import compare_attitude


def final_errors(rate: float, algorithms: str, **options) -> dict[str, float]:
    bench = compare_attitude("alexiev-fig4", rate_hz=rate, algorithms=algorithms.split(), **options)
    return {s.algorithm: s.error_deg for s in bench.scores}


def test_exact_final_attitude():
    bench = compare_attitude("alexiev-fig4")
    final = bench.truth.iloc[-1]
    # As printed in the notes, to their six decimals.
    assert final["heading"] == pytest.approx(170.323182, abs=5e-7)
    assert final["pitch"] == pytest.approx(65.110571, abs=5e-7)
    assert final["roll"] == pytest.approx(173.813343, abs=5e-7)
    exact = rotation.quaternion_from_rotation_vector([0.1, 2.0, 0.0])
    assert (
        rotation.rotation_angle(final[["q_w", "q_x", "q_y", "q_z"]].to_numpy(float), exact) < 1e-12
    )


@pytest.mark.parametrize("rate", [10, 50, 100, 1000, 10000])
@pytest.mark.parametrize("sampling", ["instantaneous", "mean"])
def test_dcm_and_quaternion_reach_it_to_rounding(rate, sampling):
    errors = final_errors(rate, "dcm quaternion", sampling=sampling)
    # Rounding of one product of rotations is about 1e-16 rad = 6e-15 deg; it adds up over the
    # steps of the pulse at most linearly.
    bound = 6e-15 * 4 * (rate + 10)
    assert max(errors.values()) < bound


@pytest.mark.parametrize(
    ("rate", "error", "digits"),
    [(10, 5.57, 2), (50, 21.4, 1), (100, 2.55, 2), (1000, 0.252, 3), (10000, 0.0251, 4)],
)
def test_euler_with_trapezoidal_rates(rate, error, digits):
    found = final_errors(rate, "euler")["euler"]
    assert found == pytest.approx(error, abs=0.5 * 10**-digits)


@pytest.mark.parametrize(("rate", "error", "digits"), [(10, 25.2, 1), (50, 4.16, 2)])
def test_plain_forward_euler(rate, error, digits):
    """With the rate at the start of each step instead of the mean of its two ends."""
    from strapdown.attitude_algorithms import EulerKrylov, run_attitude
    from strapdown.simulation import find_scenario
    from strapdown.tables import QUATERNION, increments_table

    motion = find_scenario("alexiev-fig4").motion
    time = np.arange(5 * rate + 1) / rate
    dt = np.diff(time)
    increments = increments_table(time[1:], dt, motion.rate(time[:-1]) * dt[:, None])
    run = run_attitude(EulerKrylov(), increments)
    found = rotation.rotation_angle(
        run.attitude[QUATERNION].to_numpy()[-1], motion.attitude([5.0])[0]
    )
    assert found == pytest.approx(error, abs=0.5 * 10**-digits)


def test_a_closed_pulse_costs_its_sampling_error_and_no_algorithm_is_to_blame():
    bench = compare_attitude("alexiev-fig4-closed", rate_hz=100)
    # The trapezoid of the half-open pulse is exact; the closed one holds one sample more.
    assert bench.sampling_error_deg[0] == pytest.approx(
        np.degrees(np.hypot(0.1, 2.0) / 100), rel=1e-6
    )
    exact = {s.algorithm: s.error_deg for s in bench.scores}
    assert exact["dcm"] == pytest.approx(bench.sampling_error_deg[0], rel=1e-9)


def test_naive_has_an_error_that_no_rate_removes():
    errors = [final_errors(rate, "naive")["naive"] for rate in (10, 100, 10000)]
    assert np.ptp(errors) < 1e-9
    assert errors[0] == pytest.approx(5.12, abs=0.005)


def test_euler_says_how_near_it_came_to_the_pole():
    bench = compare_attitude("alexiev-fig4", rate_hz=100, algorithms=["euler"])
    near = bench.runs[0].diagnostics
    assert near["closest_to_pole_deg"] == pytest.approx(1.48, abs=0.005)
    assert 2.7 < near["closest_to_pole_time_s"] < 2.9
    assert any("±90° pitch" in f.what for f in bench.findings)

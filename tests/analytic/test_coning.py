"""Coning: the axis of the rate turns within the step, and what that makes drift.

Half-angle 1°, 10 Hz. The attitude is exactly ``q(t) = [cos(b/2), sin(b/2) (cos wt, sin wt, 0)]``,
and the drifts about the cone axis at a step of 10 ms were derived apart from this code (theory
notes, part A), in deg/h.
"""

from __future__ import annotations

import numpy as np
import pytest

from strapdown import rotation
from strapdown.attitude import make_algorithm, run_attitude
from strapdown.increments import increments_from_imu
from strapdown.simulation import Coning, GyroErrors, find_scenario, simulate_gyro
from strapdown.tables import QUATERNION, imu_table, increments_table

HALF_ANGLE = np.radians(1.0)
OMEGA = 2 * np.pi * 10.0


def attitude(time):
    s = np.sin(HALF_ANGLE / 2)
    q = np.full((len(time), 4), np.cos(HALF_ANGLE / 2))
    q[:, 1], q[:, 2], q[:, 3] = s * np.cos(OMEGA * time), s * np.sin(OMEGA * time), 0.0
    return q


def rates(time):
    """2 q* dq/dt, written out."""
    side = OMEGA * np.sin(HALF_ANGLE)
    along = 2 * OMEGA * np.sin(HALF_ANGLE / 2) ** 2
    return np.column_stack(
        [-side * np.sin(OMEGA * time), side * np.cos(OMEGA * time), np.full(len(time), -along)]
    )


def exact_increments(time):
    """The integral of the rate, in closed form."""
    side = np.sin(HALF_ANGLE)
    along = 2 * OMEGA * np.sin(HALF_ANGLE / 2) ** 2
    angle = np.column_stack(
        [side * np.cos(OMEGA * time), side * np.sin(OMEGA * time), -along * time]
    )
    return increments_table(time[1:], np.diff(time), np.diff(angle, axis=0))


def drift(increments, variant: str, seconds: float) -> float:
    """Turn about the cone axis against the truth after whole cycles, deg/h."""
    time = np.concatenate([[0.0], increments.index])
    truth = attitude(time)
    run = run_attitude(make_algorithm(variant), increments, truth[0])
    error = rotation.compose(run.attitude[QUATERNION].to_numpy()[-1], rotation.conjugate(truth[-1]))
    return float(np.degrees(rotation.rotation_vector_from_quaternion(error)[2]) / seconds * 3600)


def test_the_rates_are_those_of_the_attitude():
    time = np.linspace(0.0, 0.1, 100_001)
    increments = increments_from_imu(imu_table(time, rates(time)))
    # Trapezoid of order 2: halving 1 µs changes nothing that shows.
    assert abs(drift(increments, "quaternion", 0.1)) < 1e-3


@pytest.mark.parametrize(
    ("source", "variant", "expected", "digits"),
    [
        ("increments", "naive", -1974.0, 0),
        ("increments", "quaternion", -127.3, 1),
        ("increments", "dcm", -127.3, 1),
        ("rates", "quaternion", -247.6, 1),
        ("rates", "dcm", -247.6, 1),
        ("rates", "euler:step=rk4", -126.0, 0),
    ],
)
def test_the_drift_at_10_ms(source, variant, expected, digits):
    time = np.arange(1001) * 0.01
    imu = imu_table(time, rates(time))
    increments = increments_from_imu(imu) if source == "rates" else exact_increments(time)
    assert drift(increments, variant, 10.0) == pytest.approx(expected, abs=0.51 * 10**-digits)


def test_the_scenario_is_this_motion():
    motion = find_scenario("coning").motion
    time = np.linspace(0.0, 60.0, 4001)
    # Six hundred cycles: the phase is known to 2 pi 600 x 1e-16 = 4e-13 here, where no whole
    # cycles are taken away, times the sine of half a degree or the rate of 1.1 rad/s.
    assert np.abs(motion.attitude(time) - attitude(time)).max() < 1e-14
    assert np.abs(motion.rate(time) - rates(time)).max() < 1e-12
    whole = increments_table(time[1:], np.diff(time), np.diff(motion.angle(time), axis=0))
    known = exact_increments(time)
    assert np.abs(whole.to_numpy() - known.to_numpy()).max() < 3e-14


@pytest.mark.parametrize("axis", [(0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (1.0, -2.0, 3.0)])
@pytest.mark.parametrize(("sampling", "expected"), [("mean", -127.3), ("instantaneous", -247.6)])
def test_the_drift_is_about_the_cone_axis_wherever_it_points(axis, sampling, expected):
    motion = Coning(1.0, 10.0, 10.0, axis=axis, q_nb=(0.5, 0.5, -0.5, 0.5))
    imu, truth = simulate_gyro(motion, GyroErrors(), rate=100.0, sampling=sampling)
    q = truth[QUATERNION].to_numpy()
    run = run_attitude(make_algorithm("quaternion"), increments_from_imu(imu), q[0])
    final = run.attitude[QUATERNION].to_numpy()[-1]
    # Seen from the mean attitude, in whose axes the cone axis is the one that is given.
    mean = rotation.conjugate(motion.q_nb)
    error = rotation.rotation_vector_from_quaternion(
        rotation.compose(
            rotation.compose(mean, final), rotation.conjugate(rotation.compose(mean, q[-1]))
        )
    )
    along = error @ np.array(axis) / np.linalg.norm(axis)
    assert np.degrees(along) / 10.0 * 3600 == pytest.approx(expected, abs=0.051)
    assert np.linalg.norm(error) == pytest.approx(abs(along), rel=1e-3)


@pytest.mark.parametrize("name", ["coning", "coning-slow"])
def test_the_naive_drift_is_the_solid_angle(name):
    """Each cycle leaves 2 pi (1 - cos(half-angle)) of a turn that never was."""
    motion = find_scenario(name).motion
    cycles = motion.frequency * motion.duration
    solid = 2 * np.pi * (1 - np.cos(np.radians(motion.half_angle))) * cycles
    # Whole cycles: nothing is left about the other two axes.
    assert np.abs(motion.angle([motion.duration])[0] - [0, 0, -solid]).max() < 1e-12

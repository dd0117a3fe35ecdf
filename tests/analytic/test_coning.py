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

"""No turn at a rest: what gyros read there is their errors, whatever the others are."""

from __future__ import annotations

import numpy as np
import pytest

from strapdown import rotation
from strapdown.estimation.error_model import RotationVectorModel
from strapdown.estimation.sensor_blocks import (
    accel_bias,
    accel_scale,
    g_sensitivity,
    gyro_bias,
    gyro_misalignment,
    gyro_scale,
)
from strapdown.mechanization.ned import NorthEastDown
from strapdown.nav_state import NavState
from strapdown.navigation.measurements.measurement import View
from strapdown.navigation.measurements.standstill import ZeroRate

MODEL = RotationVectorModel(
    sensors=(
        gyro_bias(0.05),
        accel_bias(0.4),
        gyro_scale(0.02),
        gyro_misalignment(0.01),
        g_sensitivity(1e-4),
        accel_scale(0.02),
    )
)
EARTH = 7.292115e-5
#: Errors of an uncalibrated unit: 5 deg/s, 60 mg, 3 %, 2 %, 0.1 deg/s/g.
BIAS = np.array([0.087, -0.052, 0.07])
SCALE, ACROSS = np.array([0.03, -0.02, 0.025]), np.array([0.02, -0.01, 0.015, 0.02, -0.02, 0.01])
BY_FORCE = 1.8e-4 * np.array([[1.0, -0.5, 0.8], [0.3, -1.0, 0.6], [-0.7, 0.9, 1.0]])
ACCEL_BIAS, ACCEL_SCALE = np.array([0.6, -0.5, 0.4]), np.array([-0.03, 0.02, 0.03])


@pytest.fixture
def standing():
    """A tilted body at rest, what its errors are taken to be, and what an epoch tells of it."""
    here = NavState.from_degrees(48.0, 11.0, 500.0, roll_deg=5.0, pitch_deg=-15.0, heading_deg=70.0)
    used = NorthEastDown()
    state = used.begin(here)
    lat = np.radians(48.0)
    back = rotation.dcm_from_quaternion(here.q_nb).T
    rate = back @ (EARTH * np.array([np.cos(lat), 0.0, -np.sin(lat)]))
    force = back @ np.array([0.0, 0.0, -9.81])
    off = np.zeros((3, 3))
    off[[0, 0, 1, 1, 2, 2], [1, 2, 0, 2, 0, 1]] = ACROSS
    read_rate = BIAS + (np.diag(1.0 + SCALE) + off) @ rate + BY_FORCE @ force
    read_force = ACCEL_BIAS + (1.0 + ACCEL_SCALE) * force
    sensors = np.concatenate([BIAS, ACCEL_BIAS, SCALE, ACROSS, BY_FORCE.ravel(), ACCEL_SCALE])
    row = used.history_row(state)
    view = View(used, MODEL, 0.0, state, row, sensors, rate, force)
    return view, rate, np.concatenate([[100.0], read_rate, read_force, [1e-6] * 3])


def test_with_every_error_known_nothing_is_left(standing):
    """To rounding, and to what five rounds leave of an accelerometer's 7 %.

    That is 0.07**6 of 10 m/s², times 2e-4. Scale factors that are taken of the reading leave 3 % of
    the bias, 2.6e-3 rad/s.
    """
    view, _, values = standing
    (one,) = ZeroRate(name="still").observe(view, values)
    np.testing.assert_allclose(one.z, 0.0, atol=1e-9)


def test_a_scale_factor_goes_with_the_turn_of_the_earth_and_not_with_a_bias(standing):
    """Or a bias would be told by the scale factor, and a heading be claimed that it does not know.

    A bias of 3 deg/s over a minute is a turn of 180 deg that nobody made: 1.7 % of it are 3 deg.
    """
    view, rate, values = standing
    (one,) = ZeroRate(name="still").observe(view, values)
    np.testing.assert_allclose(one.H[:, view.place("gyro_scale")], np.diag(rate), atol=1e-15)
    np.testing.assert_array_equal(one.H[:, view.place("gyro_bias")], np.eye(3))

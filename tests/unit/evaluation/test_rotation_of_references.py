"""Whether a reference attitude rotates as the gyro does."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from strapdown.attitude_algorithms import Quaternion, run_attitude
from strapdown.evaluation.differences import rotation_contradicted
from strapdown.increments import increments_from_imu
from strapdown.rotation import euler_from_quaternion
from strapdown.tables import EULER, QUATERNION, imu_table

TIME = np.arange(2000) * 0.01
RATE = np.column_stack([0.4 * np.sin(TIME), 0.3 * np.cos(0.7 * TIME), 1.0 + 0.5 * np.sin(2 * TIME)])


def imu_of(rate):
    return imu_table(TIME, rate, np.tile([0.0, 0.0, -9.81], (TIME.size, 1)))


def reference(rate):
    return run_attitude(Quaternion(), increments_from_imu(imu_of(rate))).attitude[QUATERNION]


def test_a_reference_of_the_same_motion_agrees_despite_clock_bias_and_axes():
    known = reference(RATE)
    later = known.set_axis(known.index + 0.7)
    # A constant rotation on either side is that of other axes; a bias as data sheets allow it.
    assert rotation_contradicted(imu_of(1.03 * RATE[:, [2, 0, 1]] + 0.03), later) is None


@pytest.mark.parametrize("scale", [0.0, np.pi / 180.0, 2.0])
def test_a_reference_that_rotates_otherwise_is_said(scale):
    found = rotation_contradicted(imu_of(RATE), reference(scale * RATE))
    assert found.code == "evaluation.reference-rotates-otherwise"
    windows = RATE[: 100 * found.data["windows"]].reshape(-1, 100, 3).mean(axis=1)
    # The angle of a second is the norm of the mean rate, less the coning within it.
    expected = np.degrees(np.sqrt((windows**2).sum(axis=1).mean()))
    if scale < 2.0:
        assert found.data["gyro_deg_s"] == pytest.approx(expected, rel=0.02)
        assert found.data["reference_deg_s"] == pytest.approx(scale * expected, rel=0.02, abs=1e-9)


def test_euler_angles_are_a_reference_and_rows_without_them_are_left_out():
    known = reference(0.0 * RATE)
    euler = pd.DataFrame(euler_from_quaternion(known.to_numpy()), known.index, EULER)
    euler.iloc[::3] = np.nan
    imu = imu_of(RATE)
    imu.iloc[100:120, 0] = np.nan
    assert rotation_contradicted(imu, euler) is not None
    assert rotation_contradicted(imu_of(0.0 * RATE), euler) is None


def test_too_little_in_common_or_no_attitude_says_nothing():
    known = reference(0.0 * RATE)
    assert rotation_contradicted(imu_of(RATE), known.iloc[:400]) is None
    assert rotation_contradicted(imu_of(RATE), pd.DataFrame(np.nan, known.index, EULER)) is None
    assert rotation_contradicted(imu_of(RATE), known[["q_w"]]) is None
    assert rotation_contradicted(imu_of(RATE), known.set_axis(known.index + 100.0)) is None

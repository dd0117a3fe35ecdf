"""The bias of a gyro from its rests: average, drift, what lies between."""

from __future__ import annotations

import numpy as np
import pytest
from tests.coded import coded

from strapdown.errors import DataError
from strapdown.sensors.rest import (
    RestStretch,
    gyro_bias_at,
    gyro_bias_from_rests,
    without_gyro_bias,
)
from strapdown.tables import GYRO, imu_table


def rest(start, mean, sd=(1e-4, 1e-4, 1e-4), length=2.0):
    return RestStretch(start, start + length, tuple(mean), (1e-2,) * 3, None, tuple(sd))


def test_between_rests_it_is_a_line_and_outside_it_stays():
    course = gyro_bias_from_rests([rest(0, [1, 0, 0]), rest(10, [3, 0, 1]), rest(30, [3, 4, 1])])
    at = gyro_bias_at(course, [-5, 1, 6, 11, 21, 31, 99])
    assert at[:, 0] == pytest.approx([1, 1, 2, 3, 3, 3, 3])
    assert at[:, 1] == pytest.approx([0, 0, 0, 0, 2, 4, 4])
    assert at[:, 2] == pytest.approx([0, 0, 0.5, 1, 1, 1, 1])


def test_it_comes_off_the_rates_and_the_log_stays():
    imu = imu_table([0.0, 6.0, 12.0], np.ones((3, 3)))
    course = gyro_bias_from_rests([rest(0, [1, 0, 0]), rest(10, [3, 0, 0])])
    out = without_gyro_bias(imu, course)
    assert out["gyro_x"].tolist() == [0.0, -1.0, -2.0]
    assert (imu[GYRO].to_numpy() == 1.0).all()
    assert out.attrs["sampling"] == "instantaneous"


def test_average_and_drift_are_as_well_known_as_they_say():
    """200 draws of five rests of unequal length: mean square ratios within 1 ± 4 √(2/200).

    The widening by the scatter is at least 1, so that the ratio may lie lower: by the mean of
    1/max(1, chi²/dof), 0.7 for three or four degrees of freedom.
    """
    rng = np.random.default_rng(1)
    starts, sds = np.array([0.0, 20, 50, 80, 150]), np.array([1.0, 2, 1, 3, 1]) * 1e-4
    for slope in (0.0, 3e-6):
        ratio = []
        for _ in range(200):
            means = 0.01 + slope * (starts + 1) + sds * rng.normal(size=5)
            course = gyro_bias_from_rests(
                [rest(t, [m] * 3, [s] * 3) for t, m, s in zip(starts, means, sds, strict=True)]
            )
            off = [(course.drift[0] - slope) / course.drift_sd[0]]
            if slope == 0.0:
                off.append((course.average[0] - 0.01) / course.average_sd[0])
            ratio.append(np.square(off))
        mean = np.mean(ratio, axis=0)
        assert (mean < 1 + 4 * np.sqrt(2 / 200)).all(), mean
        assert (mean > 0.7 - 4 * np.sqrt(2 / 200)).all(), mean


def test_a_bias_that_wanders_widens_the_average():
    course = gyro_bias_from_rests([rest(0, [0] * 3), rest(10, [1e-3] * 3), rest(20, [0] * 3)])
    # (1/3, 2/3, 1/3)·1e-3 from the average, in units of 1e-4, over two degrees of freedom.
    assert course.scatter[0] == pytest.approx(np.sqrt((1 + 4 + 1) / 9 / 2) * 10)
    assert course.average_sd[0] == pytest.approx(1e-4 / np.sqrt(3) * course.scatter[0])
    assert course.drift[0] == pytest.approx(0.0, abs=1e-18)


def test_one_rest_says_nothing_of_drift_and_none_nothing_at_all():
    course = gyro_bias_from_rests([rest(0, [1, 2, 3])])
    assert course.drift is None
    assert course.average == (1, 2, 3)
    with pytest.raises(DataError, check=coded("sensors.no-stationary-stretch-found-take")):
        gyro_bias_from_rests([])
    with pytest.raises(DataError, check=coded("sensors.rests-not-order-time")):
        gyro_bias_from_rests([rest(5, [0] * 3), rest(0, [0] * 3)])

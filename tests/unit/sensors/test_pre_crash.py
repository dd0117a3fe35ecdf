"""The stretch before a crash: found where there is one, graded by what it can be."""

from __future__ import annotations

import math

import numpy as np
import pytest

from strapdown.sensors.pre_crash import find_pre_crash_rest, gyro_bias_from, in_axes
from strapdown.sensors.rest import RestStretch
from strapdown.tables import imu_table

BIAS = np.array([0.02, -0.05, 0.01])  # rad/s


def drive(
    *, start=-30.0, stand_until=-6.0, drive_until=-2.0, accel=2.5, rate=200.0, sd=0.05, seed=0
):
    """Stands, accelerates steadily along x, coasts, is struck at zero."""
    rng = np.random.default_rng(seed)
    time = np.arange(round(start * rate), round(0.5 * rate)) / rate
    force = np.tile([0.2, 0.1, -9.8], (time.size, 1))
    force[(time >= stand_until) & (time < drive_until), 0] += accel
    force[(time >= 0) & (time < 0.1), 0] -= 150.0
    force += sd * rng.normal(size=force.shape)
    gyro = BIAS + 0.01 * sd * rng.normal(size=force.shape)
    return imu_table(time, gyro, force)


@pytest.mark.parametrize("sd", [0.0, 0.01, 0.2, 0.6])
def test_the_rest_is_told_from_driving_off_and_from_the_coast(sd):
    # A gyro does not feel that the car drives off along a straight line.
    rest = find_pre_crash_rest(drive(sd=sd), accel_noise=sd, gyro_noise=0.01 * sd)
    assert rest.grade == "still"
    # Blocks of half a second.
    assert rest.start == pytest.approx(-30.0, abs=0.6)
    assert rest.end == pytest.approx(-6.0, abs=0.6)
    # Means of n samples, five of their standard deviations.
    n = 200 * (rest.end - rest.start)
    assert np.abs(np.subtract(rest.gyro_mean, BIAS)).max() <= 5 * 0.01 * sd / math.sqrt(n) + 1e-12
    assert np.abs(np.subtract(rest.accel_mean, [0.2, 0.1, -9.8])).max() <= (
        5 * sd / math.sqrt(n) + 1e-12
    )


def test_a_noise_that_was_not_stated_is_found():
    rest = find_pre_crash_rest(drive(sd=0.2))
    assert rest.grade == "still"
    assert rest.end == pytest.approx(-6.0, abs=0.6)


def test_what_is_quiet_up_to_the_impact_is_a_coast_unless_it_stood():
    table = drive(start=-3.0, stand_until=-9.0, drive_until=-9.0)
    coast = find_pre_crash_rest(table)
    assert coast.grade == "steady"
    assert coast.start == pytest.approx(-3.0, abs=0.6)
    assert find_pre_crash_rest(table, moving_at_impact=False).grade == "still"


@pytest.mark.parametrize("rate", [200.0, 10_000.0])
@pytest.mark.parametrize("seed", range(5))
def test_a_record_that_starts_a_tenth_of_a_second_before(rate, seed):
    table = drive(start=-0.1, stand_until=-9.0, drive_until=-9.0, rate=rate, seed=seed)
    found = find_pre_crash_rest(table, accel_noise=0.05, gyro_noise=0.003)
    assert found.grade == "steady"
    assert found.end - found.start >= 0.075
    assert found.end < 0.0


def test_a_record_that_starts_in_the_crash_has_none():
    assert find_pre_crash_rest(drive(start=0.02)) is None


def test_a_bumpy_road_has_none():
    table = drive(start=-20.0, stand_until=-30.0, drive_until=-30.0)
    rng = np.random.default_rng(1)
    for name, size in (("gyro_x", 0.2), ("gyro_y", 0.2), ("accel_z", 2.0)):
        table[name] += size * rng.normal(size=len(table))
    assert find_pre_crash_rest(table, accel_noise=0.05, gyro_noise=0.003) is None


def test_the_longest_recent_rest_comes_before_a_longer_one_long_ago():
    table = drive(start=-200.0)
    moving = (table.index > -100.0) & (table.index < -30.0)
    table.loc[moving, "gyro_z"] += np.sin(table.index[moving] * 2.0)
    rest = find_pre_crash_rest(table)
    assert rest.start == pytest.approx(-30.0, abs=1.1)


def rest(grade):
    return RestStretch(
        -2.0, -1.0, (0.02, 0.0, 0.0), (0.01,) * 3, (0.0, 0.0, -9.8), (0.001,) * 3, grade=grade
    )


def test_the_bias_of_the_gyro_and_its_sd():
    still = gyro_bias_from(rest("still"), (0.05,) * 3)
    assert still.bias == (0.02, 0.0, 0.0)
    earth = 7.292115e-5 / math.sqrt(3)
    assert still.sd == pytest.approx((math.hypot(0.001, earth),) * 3)
    # Two measurements of one number: the mean with sd s, and zero with the stated sd b.
    steady = gyro_bias_from(rest("steady"), (0.05, 0.01, 0.0))
    s2, b2 = 0.001**2 + earth**2 + 0.01**2, 0.05**2
    assert steady.bias[0] == pytest.approx(0.02 * b2 / (b2 + s2))
    assert steady.sd[0] == pytest.approx(math.sqrt(b2 * s2 / (b2 + s2)))
    assert steady.bias[2] == 0.0
    assert steady.sd[2] == 0.0
    assert gyro_bias_from(None, (0.05, 0.05, 0.02)).sd == (0.05, 0.05, 0.02)


def test_a_rest_in_other_axes():
    quarter = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    turned = in_axes(rest("still"), quarter)
    assert turned.gyro_mean == (0.0, 0.02, 0.0)
    assert turned.accel_mean == (0.0, 0.0, -9.8)
    assert turned.gyro_mean_sd == pytest.approx((0.001,) * 3)

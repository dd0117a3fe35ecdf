"""Rests that shake: found where one attitude is kept, and not on a road or in a hand."""

from __future__ import annotations

import numpy as np
import pytest
from tests.coded import coded

from strapdown.errors import DataError
from strapdown.sensors.rest import (
    find_rests,
    find_rests_of_every_grade,
    find_shaking_rests,
    rest_between,
    sd_of_mean,
)
from strapdown.tables import ACCEL, imu_table

RATE = 100.0


def log(shaking, moving, *, seconds=40.0, seed=0):
    """At rest with noise; shaken at 12 and 17 Hz in `shaking`; moved as by a hand in `moving`."""
    rng = np.random.default_rng(seed)
    time = np.arange(int(seconds * RATE)) / RATE
    gyro = 1e-3 * rng.normal(size=(len(time), 3)) + [0.01, -0.02, 0.005]
    force = 0.02 * rng.normal(size=gyro.shape) + [0.3, -0.2, -9.8]
    for start, end in shaking:
        part = (time >= start) & (time < end)
        gyro[part, 1] += 0.06 * np.sin(2 * np.pi * 12.0 * time[part])
        force[part, 0] += 0.4 * np.sin(2 * np.pi * 17.0 * time[part])
    for start, end in moving:
        part = (time >= start) & (time < end)
        gyro[part] += 0.5 * np.sin(2 * np.pi * 0.7 * time[part])[:, None]
        force[part] += 0.8 * np.cos(2 * np.pi * 0.9 * time[part])[:, None]
    return imu_table(time, gyro, force)


def test_a_shaken_rest_is_found_and_its_means_are_right():
    imu = log([(0.0, 15.0)], [(15.0, 25.0)])
    assert all(r.start >= 15.0 for r in find_rests(imu))
    shaken, still = find_rests_of_every_grade(imu)
    assert (shaken.grade, still.grade) == ("shaking", "still")
    # Windows start every second and last four.
    assert shaken.start == 0.0
    assert 14.0 <= shaken.end <= 15.01
    # 15 s of 12 Hz are whole periods but for one at most: 0.06/(2π 12·14) rad/s, and noise.
    off = np.subtract(shaken.gyro_mean, [0.01, -0.02, 0.005])
    assert np.abs(off).max() < 6e-5 + 4 * 1e-3 / np.sqrt(1400)
    assert still.start == pytest.approx(25.0, abs=0.5)


def test_a_hand_a_road_and_a_gyro_alone_are_none():
    assert find_shaking_rests(log([], [(0.0, 40.0)])) == ()
    road = log([(0.0, 40.0)], [])
    # A road: 0.1 m/s² of what is slow, root mean square, is more than any rest has.
    road["accel_x"] += 0.15 * np.sin(2 * np.pi * 0.4 * road.index.to_numpy())
    assert find_shaking_rests(road) == ()
    assert find_shaking_rests(log([(0, 15)], []).drop(columns=ACCEL)) == ()


def test_too_few_samples_and_a_force_beyond_gravity_are_none():
    imu = log([], [])
    # Eight parts of half a second with two samples each.
    assert find_shaking_rests(imu.iloc[::25]) == ()
    assert len(find_shaking_rests(imu.iloc[::10])) == 1
    imu[ACCEL] *= 1.5
    assert find_shaking_rests(imu) == ()


def test_a_still_rest_stays_as_it_is():
    imu = log([], [(15.0, 25.0)])
    assert find_rests_of_every_grade(imu) == find_rests(imu)
    assert len(find_shaking_rests(imu)) == 2


def test_the_sd_of_a_mean_sees_what_is_correlated():
    """White noise: sd/√n. A random telegraph of half-seconds: that of its pieces, √50 more.

    From 20 parts the sd is known to 1/√38, 16 %; four of these.
    """
    rng = np.random.default_rng(3)
    time = np.arange(4000) / RATE
    white = rng.normal(size=(4000, 1))
    assert sd_of_mean(time, white)[0] == pytest.approx(1 / np.sqrt(4000), rel=0.65)
    pieces = np.repeat(rng.normal(size=(80, 1)), 50, axis=0)
    assert sd_of_mean(time, pieces)[0] == pytest.approx(1 / np.sqrt(80), rel=0.65)


def test_a_stretch_is_taken_on_the_users_word():
    imu = log([], [(0.0, 40.0)])
    rest = rest_between(imu, 3.0, 4.0)
    assert (rest.start, rest.end, rest.grade) == (3.0, 4.0, "stated")
    with pytest.raises(DataError, check=coded("sensors.samples-between-too-few-mean")):
        rest_between(imu, 3.0, 3.02)

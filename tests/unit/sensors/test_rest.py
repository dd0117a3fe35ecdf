"""Stationary stretches: found where there are some, not invented where there are none."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from strapdown.sensors.rest import (
    could_be_a_turn,
    find_rest_spans,
    find_rests,
    find_rests_of_every_grade,
    sd_of_mean,
)
from strapdown.tables import imu_table


def log(rate, noise, moving, *, seconds=20.0, bias=(0.0, 0.0, 0.0), accel=True, seed=0):
    """Moves between the instants of `moving` as a hand does; at rest otherwise."""
    rng = np.random.default_rng(seed)
    time = np.arange(int(seconds * rate)) / rate
    busy = np.zeros_like(time)
    for start, end in moving:
        busy[(time >= start) & (time < end)] = 1.0
    shake = np.column_stack([np.sin(9 * time), np.cos(7 * time), np.sin(11 * time + 1)])
    gyro = noise * rng.normal(size=(len(time), 3)) + np.asarray(bias) + busy[:, None] * shake
    force = np.array([0, 0, -9.81]) + 0.02 * rng.normal(size=gyro.shape) + busy[:, None] * shake
    return imu_table(time, gyro, force if accel else None)


@pytest.mark.parametrize("accel", [True, False])
@pytest.mark.parametrize("noise", [0.0, 1e-5, 2e-3, 1e-2])
@pytest.mark.parametrize("rate", [20, 100, 1000])
def test_both_rests_are_found_whatever_the_noise_and_the_rate(rate, noise, accel):
    bias = (0.08, -0.002, 0.02)  # rad/s, a cheap gyro's
    rests = find_rests(log(rate, noise, [(6.0, 14.0)], bias=bias, accel=accel))
    assert len(rests) == 2
    # A window is 0.5 s long and they start every 0.25 s: no edge is off by more than that.
    assert rests[0].start == pytest.approx(0.0, abs=0.5)
    assert rests[0].end == pytest.approx(6.0, abs=0.5)
    assert rests[1].start == pytest.approx(14.0, abs=0.5)
    # The mean of n samples is known to noise/√n; four of these is a fair bound.
    for rest in rests:
        samples = (rest.end - rest.start) * rate
        assert (
            np.abs(np.subtract(rest.gyro_mean, bias)).max() <= 4 * noise / np.sqrt(samples) + 1e-12
        )


def test_a_hand_is_never_at_rest():
    assert find_rests(log(100, 2e-3, [(0.0, 20.0)])) == ()


def test_a_pause_shorter_than_a_second_is_none():
    assert find_rests(log(100, 2e-3, [(0.0, 10.0), (10.8, 20.0)])) == ()


def test_a_steady_turn_is_not_taken_for_a_bias_where_a_rest_shows_it():
    table = log(100, 2e-3, [(6.0, 8.0), (14.0, 16.0)], accel=False)
    turning = (table.index >= 8.0) & (table.index < 14.0)
    table.loc[turning, "gyro_z"] += 0.1
    rests = find_rests(table)
    assert [round(r.start) for r in rests] == [0, 16]


@pytest.mark.parametrize("most", [2.0, 4.0])
def test_a_vehicle_that_speeds_up_smoothly_is_not_at_rest(most):
    """No gyro shows it: specific force changes from second to second, and with no other sign."""
    table = log(100, 2e-3, [])
    part = np.clip((table.index.to_numpy() - 6.0) / 8.0, 0.0, 1.0)
    table["accel_x"] += most * 0.5 * (1.0 - np.cos(2.0 * np.pi * part))
    first, last = find_rests(table)
    # A change of 0.1 m/s² within a second is seen, where the ramp's steepest is pi / 8 of `most`;
    # with four standard deviations of the means, 0.02 / sqrt(50) an axis, 0.12. Both are less far
    # into the ramp than the mean of a window is long, and the second after it.
    assert 5.0 < first.end < 8.0
    assert 12.0 < last.start < 15.0
    # A bias that drifts is a rest still.
    table = log(100, 2e-3, [])
    table["accel_x"] += 0.05 * (table.index.to_numpy() / 20.0)
    assert len(find_rests(table)) == 1


def test_too_short_a_log_has_none():
    assert find_rests(imu_table([0.0, 0.1], np.zeros((2, 3)))) == ()


def test_a_shake_that_does_not_turn_is_no_rest():
    """On a vibrating table the gyro may be quiet; the accelerometer is not."""
    table = log(100, 1e-4, [])
    time = table.index.to_numpy()
    busy = (time > 6.0) & (time < 14.0)
    table.loc[busy, "accel_x"] += 2.0 * np.sin(300.0 * time[busy])
    assert [(round(r.start), round(r.end)) for r in find_rests(table)] == [(0, 6), (14, 20)]


def test_a_steady_turn_alone_is_no_rest():
    assert find_rests(log(100, 2e-3, [], bias=(0.0, 0.0, 0.5))) == ()


def test_a_bias_at_the_limit_of_a_cheap_gyro_is_a_rest():
    assert len(find_rests(log(100, 2e-3, [], bias=tuple(np.radians([18.0, 5.0, 0.0]))))) == 1


def test_a_mean_of_two_seconds_of_rocking_is_not_white_noise():
    """A moored boat: a second of a slow swing has a mean rate, and next to no scatter about it."""
    time = np.arange(120) / 100.0
    rng = np.random.default_rng(2)
    noise = 1e-3 * rng.normal(size=(120, 3))
    assert (sd_of_mean(time, noise) < 1.5e-3 / np.sqrt(120)).all()
    phases = np.linspace(0.0, np.pi, 60)
    swing = 0.02 * np.sin(2.0 * np.pi * 0.3 * time[:, None] + phases)
    sd = sd_of_mean(time, swing + 1e-3 * rng.normal(size=swing.shape))
    # Its mean over whole periods is zero: the mean over this part is the error. A swing that is
    # longer than the part scatters less than it is off; as white noise it is off by fifteen.
    off = np.abs(swing.mean(axis=0))
    assert np.median(off / sd) < 3.0 < 10.0 < np.median(off / (swing.std(axis=0) / np.sqrt(120)))


def lap(seconds=120.0, rate=100, gyro_sd=3e-4, accel_sd=8e-3, seed=3):
    """A vehicle that laps an ellipse smoothly: level, its nose along the way, without vibration.

    Semi-axes 150 and 90 m, a lap in 80 s: rates of 2.7 to 7.5 deg/s and forces along the way of up
    to 0.4 m/s², both always changing. Exact rates and forces but for the sensors' noise.
    """
    rng = np.random.default_rng(seed)
    time = np.arange(int(seconds * rate)) / rate
    w, a, b = 2.0 * np.pi / 80.0, 150.0, 90.0
    c, s = np.cos(w * time), np.sin(w * time)
    velocity = np.stack([-a * w * s, b * w * c])
    acceleration = np.stack([-a * w * w * c, -b * w * w * s])
    speed = np.hypot(*velocity)
    turn = (velocity[0] * acceleration[1] - velocity[1] * acceleration[0]) / speed**2
    along = (velocity * acceleration).sum(axis=0) / speed
    zero = np.zeros_like(time)
    gyro = np.column_stack([zero, zero, turn]) + gyro_sd * rng.normal(size=(time.size, 3))
    force = np.column_stack([along, turn * speed, zero - 9.81])
    return imu_table(time, gyro, force + accel_sd * rng.normal(size=gyro.shape))


@pytest.mark.parametrize("seconds", [20.0, 60.0, 120.0])
@pytest.mark.parametrize("seed", range(3))
def test_a_smooth_drive_that_always_turns_is_never_at_rest(seconds, seed):
    """Its quietest twentieth is as quiet as a rest; over seconds, rate and force change."""
    table = lap(seconds, seed=seed)
    assert find_rests(table) == ()
    assert find_rests_of_every_grade(table) == ()


def test_a_rest_before_a_smooth_drive_remains():
    still, drive = log(100, 3e-4, [], seconds=10.0), lap(60.0)
    drive.index = drive.index + 10.0
    first, *more = find_rests_of_every_grade(pd.concat([still, drive]))
    assert not more
    assert first.start == 0.0
    # The step to the drive is that of a window, 0.5 s long and one in 0.25 s; a comparison over 2 s
    # marks no window before that.
    assert 8.0 < first.end <= 10.5


def test_a_jolt_ends_no_rest_for_longer_than_it_lasts():
    """Half a second in which somebody leans on a parked car: no drift over seconds."""
    table = log(100, 2e-3, [], seconds=30.0)
    table.loc[(table.index >= 15.0) & (table.index < 15.5), "gyro_x"] += 0.5
    rests = find_rests(table)
    assert [(round(r.start), round(r.end)) for r in rests] == [(0, 15), (16, 30)]


@pytest.mark.parametrize(
    ("rate", "force", "turns"),
    [
        ((0.0, 0.0, 0.06), (0.0, 0.0, -9.81), True),
        ((0.0, 0.0, 0.015), (0.0, 0.0, -9.81), False),
        ((0.06, 0.0, 0.0), (0.0, 0.0, -9.81), False),
        ((0.06, 0.0, 0.0), (-9.81, 0.0, 0.0), True),
        ((0.06, 0.0, 0.0), None, True),
    ],
)
def test_a_rate_about_the_vertical_could_be_a_turn(rate, force, turns):
    table = log(100, 1e-3, [], bias=rate, accel=False)
    if force is not None:
        noise = 0.01 * np.random.default_rng(1).normal(size=(len(table), 3))
        table = imu_table(table.index, table.to_numpy()[:, :3], np.array(force) + noise)
    (rest,) = find_rests(table)
    assert could_be_a_turn(rest) == turns


@pytest.mark.parametrize("phase", [0.0, 0.25, 0.6])
def test_two_rests_with_a_motion_between_are_not_one(phase):
    """A table that turns at 5 deg/s for a minute, and one that stays; the windows of 4 s touch."""
    time = np.arange(10000) / 100
    rng, zero = np.random.default_rng(0), np.zeros(10000)
    at = np.array([20.0, 20.2, 80.0, 80.2]) + phase
    turn = np.interp(time, at, np.radians([0.0, 5.0, 5.0, 0.0]))
    push = np.interp(time, at, [0.0, 0.3, 0.3, 0.0])
    level = np.column_stack([zero, zero, zero - 9.81]) + 0.01 * rng.normal(size=(10000, 3))
    noise = 1e-3 * rng.normal(size=(10000, 3))
    turned = imu_table(time, noise + np.column_stack([zero, zero, turn]), level)
    pushed = imu_table(time, noise, level + np.column_stack([push, zero, zero]))
    for table in (turned, pushed):
        rests = find_rests_of_every_grade(table)
        assert not any(r.start < 19.0 and r.end > 22.0 + phase for r in rests)
        assert rests[0].start == 0.0
        assert rests[0].end == pytest.approx(20.0 + phase, abs=1.1)


def test_a_slow_drift_of_the_sensor_before_a_nudge_is_still_a_rest():
    """Ten minutes in which the accelerometer creeps by 3 mg, then a tilt by a degree."""
    time = np.arange(0.0, 630.0, 0.02)
    rng, zero = np.random.default_rng(1), np.zeros_like(time)
    creep = 0.03 * np.minimum(time / 600.0, 1.0) + np.interp(time, [600.0, 603.0], [0.0, 0.17])
    force = np.column_stack([creep, zero, zero - 9.81]) + 0.01 * rng.normal(size=(time.size, 3))
    before, after = find_rests(imu_table(time, 1e-3 * rng.normal(size=force.shape), force))
    assert (before.start, after.end) == (0.0, pytest.approx(630.0, abs=0.1))
    # A comparison over 8 s marks no more than the twelve around the change.
    assert before.end > 588.0
    assert after.start < 615.0


def test_a_touch_of_half_a_second_is_no_drift():
    """0.26 deg/s for as long as a window: beyond the limit in one, within it over half a lag."""
    rng, time = np.random.default_rng(2), np.arange(3000) / 100
    gyro = 3e-4 * rng.normal(size=(3000, 3))
    gyro[:, 1] += np.where((time >= 15.0) & (time < 15.5), 0.0045, 0.0)
    # A quarter of the windows scatter more, so that the touch is still within three times theirs.
    gyro[:, 0] += np.where(
        time < 12.0, 1.2e-3 * rng.normal(size=3000), 1.2e-3 * np.sin(300.0 * time)
    )
    (rest,) = find_rests(imu_table(time, gyro))
    assert rest.end - rest.start > 29.0


def textbook(seed):
    """A sine about each axis and gravity on one: the log that a textbook's example makes."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, rng.uniform(15.0, 60.0), 1.0 / rng.choice([25, 50, 100, 200]))
    amplitude, phase = rng.uniform(0.05, 0.5, 3), rng.choice([0.0, 1.0]) * rng.uniform(0.0, 6.3, 3)
    omega = 2.0 * np.pi * 10.0 ** rng.uniform(-1.7, -0.3, 3)
    noise = rng.choice([0.0, 1e-4, 2e-3])
    force = np.tile([0.0, 0.0, -9.81], (time.size, 1))
    force[:, :2] += rng.choice([0.0, 0.1]) * np.column_stack([np.sin(time), np.cos(time)])
    gyro = amplitude * np.sin(time[:, None] * omega + phase)
    shape = gyro.shape
    return imu_table(
        time,
        gyro + noise * rng.standard_normal(shape),
        force + 10.0 * noise * rng.standard_normal(shape),
    )


def test_a_sine_has_no_rest_at_its_turning_points():
    """Of 300 such logs 39 had a rest of 1.2 to 1.7 s, and up to 28 deg/s removed as gyro bias.

    Now 3 of 1,000 have: at a point that bends by less than 3 % of its rate within a second.
    """
    found = [seed for seed in range(300) if find_rests_of_every_grade(textbook(seed))]
    assert len(found) <= 3


@pytest.mark.parametrize("accel", [False, True])
def test_spans_are_those_of_the_rests(accel):
    """Of one rest, of two that share their bias, of none, and of a steady turn beside a rest."""
    tables = [
        log(100, 2e-3, [(6.0, 20.0)], accel=accel),
        log(100, 2e-3, [(0.0, 4.0), (9.0, 14.0)], accel=accel),
        log(100, 2e-3, [(0.0, 20.0)], accel=accel),
    ]
    turning = log(100, 2e-3, [(8.0, 12.0)], accel=accel)
    turning.loc[13.0:, "gyro_z"] += 0.05
    counts = []
    for table in (*tables, turning):
        rests = find_rests(table)
        counts.append(len(rests))
        assert find_rest_spans(table) == tuple((r.start, r.end) for r in rests)
    assert counts == [1, 2, 0, 1]

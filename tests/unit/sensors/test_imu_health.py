"""Faults put into sound simulated logs are found by name, and sound logs have none."""

from __future__ import annotations

import functools
import math

import numpy as np
import pytest
from tests.coded import coded
from tests.sensor_faults import (
    Burst,
    Dead,
    DropOut,
    Jump,
    Noisy,
    Saturated,
    Stuck,
    inject_faults,
)

from strapdown.errors import ConfigError, DataError
from strapdown.sensors.catalogue import SENSORS, load_sensor
from strapdown.sensors.error_chain import apply, child
from strapdown.sensors.health_log import equal_runs, longest_by_chance, tail_limit
from strapdown.sensors.imu_health import TESTS, check_imu_channels
from strapdown.sensors.uncertainty import ImuUncertainty
from strapdown.simulation import (
    ImuErrors,
    Origin,
    SmoothRandom,
    StationaryMotion,
    simulate_imu,
)
from strapdown.tables import ACCEL, GYRO, imu_table

# Of each class, from the phone's to the navigator's.
GRADES = ("mpu-6050", "adis16448", "stim300", "hg1700", "hg9900", "fog-1000")
BOTH = tuple(name for name in SENSORS if {"gyro", "accel"} <= set(load_sensor(name).rates))
RATE = 100.0


@functools.cache
def at_rest(name, seed=0, seconds=90.0):
    sensor = load_sensor(name)
    motion = StationaryMotion(seconds, Origin(45.0, 10.0, 100.0), 3.0, -5.0, 40.0)
    imu, _ = simulate_imu(motion, sensor.draw(seed), rate=RATE, sampling="mean", seed=seed)
    return imu, ImuUncertainty.of_sensor(sensor)


def sample_sd(uncertainty, channel):
    triad = uncertainty.gyro if channel.startswith("gyro") else uncertainty.accel
    axis = "xyz".index(channel[-1])
    white = triad.axis("noise_density")[axis] * math.sqrt(RATE)
    return math.hypot(white, triad.axis("quantization")[axis] / math.sqrt(12.0))


@pytest.mark.slow
@pytest.mark.parametrize("name", BOTH)
def test_sound_units_at_rest_have_no_faults(name):
    # 6 channels, 6 tests, 2 runs, 2 ways at 1e-6 each: 1.4e-4 for all of a sensor.
    for seed in range(2):
        imu, uncertainty = at_rest(name, seed)
        for sensors in (uncertainty, None):
            assert check_imu_channels(imu, sensors).faults == ()


@functools.cache
def true_motion():
    motion = SmoothRandom(100.0, seed=1, rms_rate=20.0, rms_acceleration=1.0, band=(0.1, 2.0))
    return simulate_imu(motion, ImuErrors(), rate=RATE, sampling="mean")[0]


@pytest.mark.parametrize("name", GRADES)
def test_sound_units_in_motion_have_no_faults(name):
    sensor, true = load_sensor(name), true_motion()
    force = true[ACCEL].to_numpy()
    for seed in range(3):
        errors = sensor.draw(seed)
        # The low-pass, which is slow to simulate between samples, is left out.
        more = {"sampling": "mean", "sampled": True}
        gyro = apply(
            errors.gyro, true.index, true[GYRO], seed=child(seed, 0), specific_force=force, **more
        )
        accel = apply(errors.accel, true.index, force, seed=child(seed, 1), **more)
        imu = imu_table(true.index, gyro, accel, sampling="mean")
        for sensors in (ImuUncertainty.of_sensor(sensor), None):
            assert check_imu_channels(imu, sensors).faults == ()


@pytest.mark.parametrize("name", GRADES)
@pytest.mark.parametrize("channel", ["gyro_y", "accel_x"])
def test_every_fault_is_found_in_every_grade(name, channel):
    imu, uncertainty = at_rest(name)
    sd = sample_sd(uncertainty, channel)
    # Three seconds of mean know a level to 0.06 sd: a jump of 3 sd is fifty times that, and the
    # tail's limit some twelve. Noise of 6 sd is twice the limit of 3. An outlier of 20 sd in five
    # samples raises the rms to nine.
    broken = {
        "stuck": Stuck(channel, 40.0, 42.0),
        "dead": Dead(channel),
        "jump": Jump(channel, 40.0, size=3.0 * sd),
        "noisy": Noisy(channel, 40.0, 50.0, sd=6.0 * sd),
        "burst": Burst(channel, 40.0, 50.0, size=20.0 * sd),
        "missing": DropOut(channel, 40.0, 41.0),
    }
    for kind, fault in broken.items():
        health = check_imu_channels(inject_faults(imu, [fault], seed=1), uncertainty)
        (found,) = health.of(channel)
        assert found.kind == kind
        assert health.healthy == tuple(c for c in health.channels if c != channel), kind
        # A block is 1 s; a jump is placed to within a few samples of noise.
        assert found.begin == pytest.approx(max(fault.begin, 0.0), abs=1.0)
        if fault.end < math.inf:
            assert found.end == pytest.approx(fault.end, abs=1.0)
        assert found.finding.row == found.first + 1
        assert found.finding.quantity == channel
        assert found.finding.remedy


def test_a_dead_gyro_is_named_in_words():
    imu, _ = at_rest("fog-1000")
    (fault,) = check_imu_channels(inject_faults(imu, [Dead("gyro_z")])).faults
    assert fault.kind == "dead"
    assert str(fault.finding).startswith(
        "row 1, gyro_z: the gyro about z (down) is dead: exactly zero from the first "
        "sample to the last (9001 samples)"
    )
    late = check_imu_channels(inject_faults(imu, [Dead("gyro_z", 50.0)])).faults
    assert [f.kind for f in late] == ["dead"]
    assert "from 50 s to the end" in late[0].finding.what


def moving(seed=0, n=20000, step=1.3e-4):
    """A body that turns and shakes, its gyros read in steps of twice their noise, 100 Hz."""
    rng = np.random.default_rng(seed)
    t = np.arange(n) / RATE
    phases = rng.uniform(0.0, 6.28, 6)
    slow = np.sin(2.0 * np.pi * np.outer(t, [0.11, 0.23, 0.31, 0.17, 0.05, 0.29]) + phases)
    gyro = np.round((0.5 * slow[:, :3] + 0.5 * step * rng.standard_normal((n, 3))) / step) * step
    accel = slow[:, 3:] + 0.05 * rng.standard_normal((n, 3)) + [0.0, 0.0, -9.8]
    return imu_table(t, gyro, accel)


def test_in_motion_a_gyro_that_sticks_stops_or_clips_is_found():
    imu = moving()
    assert check_imu_channels(imu).faults == ()
    for kind, fault in (
        # Half a second: fifty samples where motion repeats one in ten at its turning points.
        ("stuck", Stuck("gyro_x", 77.0, 77.5)),
        ("dead", Dead("gyro_x", 150.0)),
        ("saturated", Saturated("gyro_x", limit=0.45)),
        ("noisy", Noisy("gyro_x", 100.0, 120.0, sd=0.01)),
    ):
        health = check_imu_channels(inject_faults(imu, [fault]))
        assert {(f.channel, f.kind) for f in health.faults} == {("gyro_x", kind)}


def test_a_channel_that_does_not_feel_the_road_is_no_noisier_where_the_car_stops():
    # The others shake with the road, by twenty times their noise, in all but two rests.
    rng = np.random.default_rng(7)
    t = np.arange(30000) / RATE
    driving = ~((t < 60.0) | ((t > 200.0) & (t < 240.0)))
    noise = rng.standard_normal((t.size, 6))
    noise[:, [0, 1, 2, 5]] *= np.where(driving, 20.0, 1.0)[:, None]
    gyro, accel = 1e-3 * noise[:, :3], 7e-3 * noise[:, 3:]
    assert check_imu_channels(imu_table(t, gyro, accel)).faults == ()
    # A channel that does become noisier, in a rest and on the road, is named.
    for begin, end in ((20.0, 40.0), (100.0, 120.0)):
        at = (t >= begin) & (t < end)
        faulty = accel.copy()
        faulty[at, 0] += 0.2 * rng.standard_normal(int(at.sum()))
        (fault,) = check_imu_channels(imu_table(t, gyro, faulty)).faults
        assert (fault.channel, fault.kind) == ("accel_x", "noisy")
        assert fault.begin == pytest.approx(begin, abs=1.0)


def test_coarse_counts_of_a_quiet_rest_are_not_stuck():
    # Noise of a fifth of a step, which moves one sample in 80, between two stretches of motion:
    # runs of hundreds of samples are what such an output is.
    rng = np.random.default_rng(4)
    n = 30000
    t = np.arange(n) / RATE
    still = (t > 100.0) & (t < 200.0)
    turning = np.where(still[:, None], 0.0, np.sin(np.outer(t, [1.0, 1.3, 1.7])))
    gyro = np.round((turning + 2e-4 * rng.standard_normal((n, 3))) / 1e-3) * 1e-3
    accel = np.round((turning + 2e-3 * rng.standard_normal((n, 3))) / 1e-2) * 1e-2
    imu = imu_table(t, gyro, accel)
    assert equal_runs(gyro[still, 0])[1].max() > 200
    assert check_imu_channels(imu).faults == ()


def test_a_tilt_is_no_jump_and_a_slow_onset_is_none():
    imu, uncertainty = at_rest("hg1700")
    time = imu.index.to_numpy()
    tilted = imu.copy()
    # Half a degree within half a second, told by gyro and accelerometers alike: motion.
    angle = np.radians(0.5) * np.clip((time - 40.2) / 0.5, 0.0, 1.0)
    tilted["gyro_y"] += np.gradient(angle, time)
    force = imu[["accel_x", "accel_z"]].to_numpy()
    tilted["accel_x"] = np.cos(angle) * force[:, 0] - np.sin(angle) * force[:, 1]
    tilted["accel_z"] = np.sin(angle) * force[:, 0] + np.cos(angle) * force[:, 1]
    tilted.attrs = dict(imu.attrs)
    assert check_imu_channels(tilted, uncertainty).faults == ()
    # The same step of the accelerometer alone is a jump.
    alone = inject_faults(imu, [Jump("accel_x", 40.2, size=float(np.radians(0.5) * 9.8))])
    assert [f.kind for f in check_imu_channels(alone, uncertainty).faults] == ["jump"]
    # A turntable that takes 0.2 s to begin to turn about the vertical.
    table = imu.copy()
    table["gyro_z"] += 0.1 * np.clip((time - 40.2) / 0.2, 0.0, 1.0)
    table.attrs = dict(imu.attrs)
    assert "jump" not in {f.kind for f in check_imu_channels(table).faults}


def test_what_gravity_and_the_earth_do_not_explain():
    imu, uncertainty = at_rest("fog-1000")
    scaled = imu.copy()
    scaled[["accel_x", "accel_y", "accel_z"]] *= 1.01
    scaled.attrs = dict(imu.attrs)
    (fault,) = check_imu_channels(scaled, uncertainty).faults
    # One per cent of gravity is 98 mm/s², and gravity anywhere differs by 75 mm/s² at most.
    assert (fault.channel, fault.kind) == ("accel_z", "implausible")
    doubled = imu.copy()
    doubled[["gyro_x", "gyro_y", "gyro_z"]] *= 1.2
    doubled.attrs = dict(imu.attrs)
    (fault,) = check_imu_channels(doubled, uncertainty).faults
    assert (fault.channel, fault.kind) == ("gyro", "implausible")
    assert fault.size == pytest.approx(1.2 * 7.292115e-5, rel=1e-2)


def test_the_longest_run_by_chance():
    r, n = 0.6, 10000
    (limit,) = longest_by_chance(np.array([r]), n, 0.2)
    over = 0
    for seed in range(400):
        repeats = np.random.default_rng(seed).random(n) < r
        values = np.cumsum(~repeats).astype(float)
        over += equal_runs(values)[1].max() > limit
    # (1 - r) 0.2 of each is expected where the limit is a whole number, 32 of all, and r times
    # that at the least, 19; with 3 sd of the count on either side.
    assert 6 <= over <= 49


def test_the_limit_of_an_exponential_tail():
    over = 0
    for seed in range(300):
        x = np.random.default_rng(seed).exponential(2.0, 4000)
        over += x.max() > tail_limit(x, 800, 80, 0.05)
    # 15 expected; the scale is known to 1/√80, which moves that by half; 3 sd of the count are 12.
    assert 3 <= over <= 35
    assert tail_limit([1.0, 2.0], 5, 1, 0.1) == math.inf


def test_what_is_refused():
    imu, _ = at_rest("fog-1000")
    with pytest.raises(DataError, check=coded("sensors.samples-too-few-tell-channel")):
        check_imu_channels(imu.iloc[:30])
    with pytest.raises(ConfigError, check=coded("sensors.no-rate-false-alarms")):
        check_imu_channels(imu, false_alarm=2.0)
    with pytest.raises(ConfigError, match="gravity"):
        check_imu_channels(imu, gravity=-9.8)
    with pytest.raises(DataError, check=coded("tables.missing-columns")):
        check_imu_channels(imu.drop(columns="gyro_x"))


def test_gyros_alone_and_what_is_sound():
    imu, _ = at_rest("hg1700")
    gyros = imu[["gyro_x", "gyro_y", "gyro_z"]]
    broken = inject_faults(gyros, [Stuck("gyro_y", 10.0, 20.0)])
    health = check_imu_channels(broken)
    assert health.healthy == ("gyro_x", "gyro_z")
    sound = health.sound(broken)
    assert not sound["gyro_y"].to_numpy()[1000:2000].any()
    assert sound.to_numpy().sum() == 3 * len(imu) - 1000
    assert set(TESTS) >= {f.kind for f in health.faults}

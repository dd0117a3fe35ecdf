"""Real recordings, whose sound channels must not be called faulty."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

sys.path.insert(0, str(Path(__file__).parent))

import raw_recordings
from tests.sensor_faults import Dead, DropOut, Stuck, inject_faults

from strapdown.formats import read_log
from strapdown.sensors.imu_health import check_imu_channels
from strapdown.tables import ACCEL, GYRO, imu_table

TRIALS = (
    "02_undisturbed_slow_rotation_B",
    "07_undisturbed_fast_rotation_B",
    "14_undisturbed_slow_translation_with_breaks_B",
    "27_disturbed_phone_vibration_B",
)
TURNS = (
    "rotate-360ccw-around-x-pointing-forward",
    "rotate-360ccw-around-y-pointing-left",
    "rotate-360ccw-around-z-pointing-up",
    "unmoved-10min",
    "unmoved-x-pointing-forward",
    "unmoved-x-pointing-up",
    "unmoved-z-pointing-left",
)


def ring_laser(recordings) -> pd.DataFrame:
    bare = raw_recordings.ring_laser(recordings("rlg_static/part1_first900s.imu"), scaled=True)
    # Increments over 0.01 s; right-forward-up.
    turn = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]]) / 0.01
    return imu_table(bare.time, bare.gyro @ turn.T, bare.accel @ turn.T, sampling="mean")


def foot(recordings) -> pd.DataFrame:
    bare = raw_recordings.foot(recordings("foot/SensorConnectData_32_LLIO.mat"))
    return imu_table(bare.time, bare.gyro, bare.accel)


@pytest.mark.parametrize("name", [f"broad/{t}.hdf5" for t in TRIALS])
def test_broad(recordings, name):
    assert check_imu_channels(read_log(recordings(name)).imu).faults == ()


@pytest.mark.parametrize("name", TURNS)
def test_mpu6050(recordings, name):
    imu = read_log(recordings("mpu6050_turns") / name).imu
    health = check_imu_channels(imu)
    assert health.faults == ()
    if name == "unmoved-10min":
        assert health.rest_time > 600.0


def test_phone_and_foot(recordings):
    assert check_imu_channels(read_log(recordings("phone_comma2k19")).imu).faults == ()
    assert check_imu_channels(foot(recordings)).faults == ()


def test_coarse_counts_of_a_ring_laser(recordings):
    # The x gyro repeats a count for up to 52 samples, the z accelerometer for up to 48, while the
    # stand rocks now and then: sound.
    imu = ring_laser(recordings)
    health = check_imu_channels(imu)
    assert health.faults == ()
    assert health.rest_time > 600.0
    # Two seconds that are stuck are not: the longest that its tail allows is shorter.
    for channel in ("gyro_x", "gyro_y"):
        broken = inject_faults(imu, [Stuck(channel, 400.0, 402.0)])
        (fault,) = check_imu_channels(broken).faults
        assert (fault.channel, fault.kind) == (channel, "stuck")
        assert fault.begin == pytest.approx(400.0, abs=0.3)
    (fault,) = check_imu_channels(inject_faults(imu, [Dead("gyro_y")])).faults
    assert fault.kind == "dead"


def test_the_pitch_gyro_of_the_car(recordings):
    # Its source: "shakes", 2.3 deg/s at rest beside neighbours of 0.6 and 0.07.
    health = check_imu_channels(read_log(recordings("car_rtk/part1_imu_frd_si.csv")).imu)
    assert {(f.channel, f.kind) for f in health.faults} == {("gyro_y", "noisy")}
    first = health.faults[0]
    assert np.degrees(first.size) == pytest.approx(2.3, abs=0.3)
    # It is told for the rest, which the record begins with, 37.8 s.
    assert first.first == 0
    assert 30.0 < first.end - first.begin < 38.0


@pytest.mark.parametrize("channel", [*GYRO, *ACCEL])
def test_faults_in_a_real_walk(recordings, channel):
    imu = foot(recordings)
    begin = float(imu.index[0])
    # At 200 Hz in motion no value of 24 bits repeats: a tenth of a second is stuck.
    broken = inject_faults(
        imu,
        [Stuck(channel, begin + 30.0, begin + 30.1), DropOut(channel, begin + 50.0, begin + 50.2)],
    )
    kinds = [(f.channel, f.kind) for f in check_imu_channels(broken).faults]
    assert kinds == [(channel, "stuck"), (channel, "missing")]

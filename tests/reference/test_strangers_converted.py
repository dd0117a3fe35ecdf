"""Logs of strangers, converted and read again: what a format holds comes back to the last bit."""

from __future__ import annotations

import numpy as np
import pytest

import strapdown as sd
from strapdown.formats.clocks import own_ns
from strapdown.tables import ACCEL, GYRO
from strapdown.tables.checks import GEODETIC, POSITION_SD, VELOCITY

pytestmark = pytest.mark.slow

#: File, what its owner states, and formats that hold the samples.
SAMPLES = {
    "ardupilot/test.BIN": {},
    "px4_ulg/sample_log_small.ulg": {},
    "apdm/imuData01.csv": {},
    "gopro/hero7.raw": {},
    "xio/short_walk.csv": {"axes": "x,-y,-z"},
    "rosbag1_loc/test1.bag": {"axes": "-z,x,-y"},
}
FIXES = {
    "rtklib_pos/rtklib_rtk_result.pos": {},
    "nmea/MTV.Local1.SPAN.20200206-181434.gga": {},
    "gsdc/Pixel4_ground_truth.csv": {},
    "ardupilot/test.BIN": {"datum_height_m": 0.0},
    "gpx/around-visnjan-with-car.gpx": {"datum_height_m": 45.0},
}
TRAJECTORIES = ("novatel_span/ins2.gps", "sbet/2-points.sbet")


@pytest.mark.parametrize("name", SAMPLES)
@pytest.mark.parametrize("form", ["csv", "parquet", "npz", "h5", "mat", "mcap"])
def test_samples_of_strangers_come_back(name, form, recordings, tmp_path):
    imu = sd.read_imu(recordings("zoo") / name, **SAMPLES[name])
    sd.write({"imu": imu}, tmp_path / f"a.{form}")
    # MCAP has forward, left, up.
    axes = {"axes": "x,-y,-z"} if form == "mcap" else {}
    again = sd.read_imu(tmp_path / f"a.{form}", **axes)
    columns = [c for c in (*GYRO, *ACCEL) if c in imu]
    assert set(columns) <= set(again.columns)
    assert np.array_equal(again[columns], imu[columns])
    assert np.array_equal(own_ns(again), own_ns(imu))


@pytest.mark.parametrize("name", FIXES)
@pytest.mark.parametrize("form", ["csv", "parquet", "h5"])
def test_fixes_of_strangers_come_back(name, form, recordings, tmp_path):
    gnss = sd.read_gnss(recordings("zoo") / name, position_sd_m=5.0, **FIXES[name])
    sd.write({"gnss": gnss}, tmp_path / f"a.{form}")
    again = sd.read_gnss(tmp_path / f"a.{form}")
    assert np.array_equal(again[GEODETIC], gnss[GEODETIC])
    assert np.array_equal(again[POSITION_SD], gnss[POSITION_SD])
    assert np.array_equal(again[VELOCITY], gnss[VELOCITY])
    assert np.array_equal(own_ns(again), own_ns(gnss))


@pytest.mark.parametrize("name", TRAJECTORIES)
@pytest.mark.parametrize("form", ["csv", "parquet", "h5"])
def test_trajectories_of_strangers_come_back(name, form, recordings, tmp_path):
    track = sd.read_trajectory(recordings("zoo") / name)
    sd.write({"reference": track}, tmp_path / f"a.{form}")
    again = sd.read_trajectory(tmp_path / f"a.{form}")
    assert list(again.columns) == list(track.columns)
    assert np.array_equal(again, track)
    assert np.array_equal(own_ns(again), own_ns(track))

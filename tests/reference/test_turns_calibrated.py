"""Turns of a cheap sensor by hand: the vertical after them, before and after calibration."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
import pytest

import strapdown as sd
from strapdown import rotation
from strapdown.tables import ACCEL, GYRO
from strapdown.tables.sample_clock import sample_clock

UNMOVED = ("10min", "x-pointing-forward", "x-pointing-up", "z-pointing-left")
TURNED = ("x-pointing-forward", "y-pointing-left", "z-pointing-up")


def tilt_left(imu):
    """Angle between the vertical by the gyro after a log and that of the force, deg."""
    clock = sample_clock(imu.index.to_numpy(), imu[GYRO].to_numpy())
    even = pd.DataFrame(imu.to_numpy(), columns=imu.columns, index=pd.Index(clock.time))
    even.index.name, even.attrs["sampling"] = "time", "instantaneous"
    force, t = even[ACCEL].to_numpy(), clock.time
    roll, pitch = rotation.level(force[t < t[0] + 0.5].mean(axis=0))
    attitude = sd.attitude(even, initial=(roll, pitch, 0.0))
    up = attitude.rotation[len(attitude) - 1].apply(force[t > t[-1] - 0.5].mean(axis=0))
    return math.degrees(math.acos(-up[2] / np.linalg.norm(up)))


@pytest.mark.slow
def test_attitude_errors_before_and_after(recordings, tmp_path):
    folder = recordings("mpu6050_turns")
    still = [folder / f"unmoved-{name}" for name in UNMOVED]
    turns = [folder / f"rotate-360ccw-around-{name}" for name in TURNED]
    file = tmp_path / "calibration.toml"
    for k, turn in enumerate(turns):
        others = [one for one in turns if one != turn]
        run = sd.calibrate([*still, *others], turns="720", turn_sd_deg=10.0, lat=52.0)
        file.write_text(run.calibration_text())
        before = tilt_left(sd.read_imu(turn))
        after = tilt_left(sd.read_imu(turn, calibration=file))
        # 4.6 deg/s of bias over 15 s; a hand of 0.3 m/s2 is 2 deg at either end, and gaps of the
        # log of up to 0.5 s at 10 to 20 deg/s are several.
        assert before > (60.0, 15.0, 30.0)[k]
        assert after < 10.0

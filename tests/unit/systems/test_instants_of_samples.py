"""When the samples of a log were taken, and what it costs a velocity not to know it."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from strapdown.navigation.record import NavigationRecord
from strapdown.systems.navigation_run import with_late_samples
from strapdown.systems.navigation_source import on_even_clock
from strapdown.tables import ACCEL, GYRO, TRAJECTORY, TRAJECTORY_ERROR

STEP = 0.005


def walk(scatter):
    """A minute of a walk at 200 Hz, with stamps that scatter, and the true instants."""
    random = np.random.default_rng(3)
    true = STEP * np.arange(12_000)
    swing = np.sin(2.0 * np.pi * np.outer(true, [0.9, 1.8, 3.1]))
    values = np.hstack([swing, 2.0 * swing - [0.0, 0.0, 9.8]])
    values += 1e-3 * random.standard_normal(values.shape)
    stamps = true + scatter * np.clip(random.standard_normal(len(true)), -3.0, 3.0)
    index = pd.Index(np.sort(stamps), name="time")
    return pd.DataFrame(values, index=index, columns=[*GYRO, *ACCEL]), true


def test_samples_are_put_on_the_clock_about_which_their_stamps_scatter():
    imu, true = walk(0.2 * STEP)
    imu.attrs["source"] = "walk.csv"
    out, (said,) = on_even_clock(imu)
    assert said.code == "attitude.stamps-jitter"
    assert said.data["spread"] == pytest.approx(0.2 * STEP, rel=0.1)
    off = out.index.to_numpy() - true
    assert np.abs(np.diff(off)).max() < 0.02 * STEP
    assert np.abs(off).max() < 0.2 * STEP
    assert (out.to_numpy() == imu.to_numpy()).all()
    assert out.attrs == imu.attrs


def test_stamps_of_an_even_clock_are_left_as_they_are():
    imu, _ = walk(0.0)
    assert on_even_clock(imu) == (imu, ())


def record(speed):
    """A record with velocities north, at 10 Hz, and marks each second; known to 3 mm/s."""
    time = 0.1 * np.arange(601)
    trajectory = pd.DataFrame(0.0, index=pd.Index(time, name="time"), columns=TRAJECTORY)
    trajectory["VN"] = speed(time)
    marks = pd.Index(np.arange(61.0), name="time")
    sd = pd.DataFrame(0.003, index=marks, columns=TRAJECTORY_ERROR)
    covariance = np.tile(0.003**2 * np.eye(9), (len(marks), 1, 1))
    nothing = pd.DataFrame(index=marks)
    return NavigationRecord(trajectory, sd, covariance, nothing, nothing, {}, {})


def test_a_velocity_is_as_uncertain_as_the_acceleration_over_the_instant():
    late, rate = 0.0025, 2.0 * np.pi * 0.5
    swings = record(lambda time: 2.0 * np.sin(rate * time))
    out = with_late_samples(swings, late)
    # The mean square over a second is that of half a swing.
    more = np.sqrt(out.sd["VN"].to_numpy()[1:-1] ** 2 - 0.003**2)
    assert more == pytest.approx(late * 2.0 * rate / np.sqrt(2.0), rel=0.02)
    assert out.covariance[:, 3, 3] == pytest.approx(np.square(out.sd["VN"].to_numpy()))
    others = [name for name in TRAJECTORY_ERROR if name != "VN"]
    assert (out.sd[others] == swings.sd[others]).all(axis=None)
    assert (swings.covariance[:, 3, 3] == 0.003**2).all()
    steady = with_late_samples(record(lambda time: 0.0 * time + 30.0), late)
    assert steady.sd.to_numpy() == pytest.approx(0.003)

"""When the samples of a log were taken, and what it costs a state not to know it."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from scipy.spatial.transform import Rotation

from strapdown.errors import Finding
from strapdown.navigation.record import NavigationRecord
from strapdown.systems.navigation_run import _late, with_late_samples
from strapdown.systems.navigation_source import UNSTATED, on_even_clock
from strapdown.tables import ACCEL, EULER, GYRO, TRAJECTORY, TRAJECTORY_ERROR, VELOCITY
from strapdown.tables.checks import index_of

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
    others = [name for name in TRAJECTORY_ERROR if name not in ("VN", "north", *EULER)]
    assert (out.sd[others] == swings.sd[others]).all(axis=None)
    assert (swings.covariance[:, 3, 3] == 0.003**2).all()
    steady = with_late_samples(record(lambda time: 0.0 * time + 30.0), late)
    assert steady.sd[VELOCITY].to_numpy() == pytest.approx(0.003)


def test_a_position_is_as_uncertain_as_the_velocity_over_the_instant():
    late = 0.005
    out = with_late_samples(record(lambda time: 0.0 * time + 30.0), late)
    assert out.sd["north"].to_numpy() == pytest.approx(np.hypot(0.003, 30.0 * late))
    assert out.sd[["east", "down"]].to_numpy() == pytest.approx(0.003)
    assert out.covariance[:, 0, 0] == pytest.approx(0.003**2 + (30.0 * late) ** 2)


@pytest.mark.parametrize("axis", range(3))
def test_an_attitude_is_as_uncertain_as_its_rate_over_the_instant(axis):
    late, rate = 0.005, np.radians(40.0)
    still = record(lambda time: 0.0 * time)
    # The body turns about an axis of its own that is tilted against all three of north-east-down.
    begin = Rotation.from_euler("ZYX", [70.0, 25.0, -35.0], degrees=True)
    turned = begin * Rotation.from_rotvec(
        rate * index_of(still.trajectory)[:, None] * np.eye(3)[axis]
    )
    table = still.trajectory.copy()
    table[EULER] = turned.as_euler("ZYX", degrees=True)[:, ::-1]
    moved = with_late_samples(replace(still, trajectory=table), late)
    added = (moved.covariance - still.covariance)[:, 6:, 6:]
    # Over a second the axis stays nearly where it is: the mean square is that of its directions.
    rows = np.searchsorted(index_of(table), index_of(moved.sd))
    want = np.square(late * rate * turned[rows].as_matrix()[:, :, axis])
    got = np.diagonal(added, axis1=1, axis2=2)
    assert got[1:-1] == pytest.approx(want[1:-1], abs=2e-3 * (late * rate) ** 2)


def logged(sampling, *codes):
    """A source of samples at 100 Hz."""
    imu, _ = walk(0.0)
    imu.attrs["sampling"] = sampling
    findings = tuple(Finding(code) for code in codes)
    return SimpleNamespace(imu=imu, findings=findings)


def test_readings_at_an_instant_are_late_by_a_filter_and_means_are_not():
    assert _late(logged("mean")) == 0.0
    assert _late(logged("instantaneous")) == pytest.approx(0.5 * STEP)
    unstated = _late(logged("instantaneous", UNSTATED))
    assert unstated == pytest.approx(0.5 * STEP * np.sqrt(2.0))

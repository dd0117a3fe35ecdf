"""Simulated gyros and accelerometers against closed forms."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pytest

from strapdown import rotation
from strapdown.constants import STANDARD_GRAVITY as G
from strapdown.errors import ConfigError
from strapdown.simulation import (
    SCENARIOS,
    ImuErrors,
    PulseMotion,
    TriadErrors,
    simulate_imu,
)
from strapdown.simulation.motion import FlatMotion
from strapdown.tables import ACCEL, GYRO


@dataclass(frozen=True)
class Swing(FlatMotion):
    """Rolls as phi sin(w t) about the body's x axis, and shakes along north as sin(w t)."""

    frequency: float
    duration: float
    phi: float = 0.5
    shake: float = 3.0  # m/s²

    @property
    def w(self):
        return 2.0 * math.pi * self.frequency

    def rate(self, time):
        return np.outer(self.phi * self.w * np.cos(self.w * np.asarray(time)), [1.0, 0.0, 0.0])

    def angle(self, time):
        return np.outer(self.phi * np.sin(self.w * np.asarray(time)), [1.0, 0.0, 0.0])

    def attitude(self, time):
        return rotation.quaternion_from_rotation_vector(self.angle(time))

    def acceleration(self, time):
        return np.outer(self.shake * np.sin(self.w * np.asarray(time)), [1.0, 0.0, 0.0])

    def velocity(self, time):
        return np.outer(self.shake / self.w * (1 - np.cos(self.w * np.asarray(time))), [1, 0, 0])

    def position(self, time):
        t = np.asarray(time)
        return np.outer(self.shake / self.w * (t - np.sin(self.w * t) / self.w), [1, 0, 0])


@pytest.mark.parametrize("name", SCENARIOS)
def test_a_body_feels_its_acceleration_less_gravity(name):
    motion = SCENARIOS[name].motion
    imu, truth = simulate_imu(motion, ImuErrors(), rate=50.0)
    felt = rotation.rotate(truth[["q_w", "q_x", "q_y", "q_z"]].to_numpy(), imu[ACCEL].to_numpy())
    acceleration = motion.acceleration(imu.index)
    # Two rotations of about ten roundings each.
    largest = G + np.abs(acceleration).max()
    assert np.abs(felt - acceleration - [0.0, 0.0, -G]).max() < 20 * largest * 2.0**-52


@pytest.mark.parametrize("name", SCENARIOS)
def test_the_gyros_of_a_scenario_do_not_depend_on_the_accelerometer(name):
    s = SCENARIOS[name]
    both, _ = simulate_imu(s.motion, s.errors, rate=50.0, seed=2)
    alone, _ = simulate_imu(s.motion, s.errors, rate=50.0, seed=2, accelerometer=False)
    assert list(alone.columns) == GYRO
    assert both[GYRO].equals(alone)


def test_the_specific_force_is_the_closed_form():
    swing = Swing(1.0, 2.0)
    imu, _ = simulate_imu(swing, ImuErrors(), rate=100.0)
    t = imu.index.to_numpy()
    roll = swing.phi * np.sin(swing.w * t)
    expected = np.column_stack(
        [swing.shake * np.sin(swing.w * t), -G * np.sin(roll), -G * np.cos(roll)]
    )
    assert np.abs(imu[ACCEL].to_numpy() - expected).max() < 1e-14


@pytest.mark.parametrize("frequency", [1.0, 20.0])
def test_means_of_rate_and_specific_force_are_exact(frequency):
    """One twentieth of a period in an interval, and a whole one."""
    swing, rate = Swing(frequency, 3.0, phi=0.0), 20.0
    imu, _ = simulate_imu(swing, ImuErrors(), rate=rate, sampling="mean")
    t = imu.index.to_numpy()
    expected = np.diff(swing.velocity(t)[:, 0]) * rate
    # Eight nodes: one period in the interval to 1e-9 of the amplitude.
    assert np.abs(imu["accel_x"].to_numpy()[1:] - expected).max() < 3e-9
    # A constant through weights that sum to 1.
    assert np.abs(imu["accel_z"].to_numpy() + G).max() < 8 * G * 2.0**-53
    roll, _ = simulate_imu(Swing(frequency, 3.0), ImuErrors(), rate=rate, sampling="mean")
    turned = np.cumsum(roll["gyro_x"].to_numpy()[1:]) / rate
    # Sixty additions of up to 60 rad/s, each rounded to 2^-53.
    assert np.abs(turned - Swing(frequency, 3.0).angle(t[1:])[:, 0]).max() < 1e-13


@pytest.mark.parametrize("rate", [7.0, 100.0, 2000.0])
@pytest.mark.parametrize("corner", [3.0, 40.0])
@pytest.mark.parametrize("sampling", ["instantaneous", "mean"])
def test_the_low_pass_acts_on_the_motion_and_not_on_its_samples(rate, corner, sampling):
    """The same response at every rate, far below the corner's and far above it."""
    swing = Swing(2.0, 3.0, phi=1.0)
    errors = ImuErrors(TriadErrors(bandwidth=corner))
    imu, _ = simulate_imu(swing, errors, rate=rate, sampling=sampling)
    t = imu.index.to_numpy()
    h = 1.0 / (1.0 + 1j * swing.frequency / corner)
    amplitude = swing.w
    # The response to cos(w t) from rest with its first value: the steady part, and a start
    # that dies away as exp(-2 pi corner t).
    decay = 2.0 * math.pi * corner
    start = 1.0 - h.real
    if sampling == "instantaneous":
        expected = np.real(h * np.exp(1j * swing.w * t)) + start * np.exp(-decay * t)
    else:
        turned = np.real(h * np.exp(1j * swing.w * t) / (1j * swing.w))
        turned -= start * np.exp(-decay * t) / decay
        expected = np.concatenate([[1.0], np.diff(turned) * rate])
    # Quadrature with stretches up to a time constant: 1e-9 of the amplitude at the most.
    assert np.abs(imu["gyro_x"].to_numpy() - amplitude * expected).max() < 1e-9 * amplitude


def test_jitter_reads_the_motion_at_another_instant_than_the_stamp():
    swing = Swing(2.0, 60.0, phi=1.0)
    errors = ImuErrors(TriadErrors(jitter=1e-4), TriadErrors(jitter=1e-4))
    clean, _ = simulate_imu(swing, ImuErrors(), rate=100.0)
    imu, _ = simulate_imu(swing, errors, rate=100.0, seed=5)
    t = imu.index.to_numpy()[1:-1]
    slope = -swing.phi * swing.w**2 * np.sin(swing.w * t)
    off = (imu - clean)["gyro_x"].to_numpy()[1:-1]
    steep = np.abs(slope) > 0.5 * swing.phi * swing.w**2
    late = off[steep] / slope[steep]
    # First order in the jitter: the rest is w * jitter = 1e-3 of it; 4000 numbers, 5 sigma.
    assert late.std() == pytest.approx(1e-4, rel=5 / math.sqrt(2 * late.size) + 1e-3)
    assert abs((imu - clean)["accel_x"]).max() > 0.0
    mean, _ = simulate_imu(swing, errors, rate=100.0, seed=5, sampling="mean")
    # What an interval gains by a late edge, the next one loses: the sum stays.
    total = np.cumsum(mean["gyro_x"].to_numpy()[1:]) / 100.0
    assert np.abs(total - swing.angle(mean.index.to_numpy()[1:])[:, 0]).max() < 2 * 6e-4 * swing.w


def test_a_gyro_with_g_sensitivity_feels_the_gravity_without_an_accelerometer():
    errors = ImuErrors(TriadErrors(g_sensitivity=((0, 0, 0), (0, 0, 0), (0, 0, 1e-3))))
    imu, _ = simulate_imu(PulseMotion((), 1.0), errors, rate=10.0, accelerometer=False)
    assert imu["gyro_z"].to_numpy() == pytest.approx(-1e-3 * G)
    assert not imu[["gyro_x", "gyro_y"]].to_numpy().any()


def test_the_triads_draw_from_streams_of_their_own():
    both = TriadErrors(noise_density=0.1)
    still = PulseMotion((), 10.0)
    imu, _ = simulate_imu(still, ImuErrors(both, both), rate=100.0, seed=3)
    only, _ = simulate_imu(still, ImuErrors(TriadErrors(), both), rate=100.0, seed=3)
    assert only[ACCEL].equals(imu[ACCEL])
    gyro, accel = imu[GYRO].to_numpy(), imu[ACCEL].to_numpy() - [0.0, 0.0, -G]
    # 3003 pairs of independent numbers: the correlation is within 5/sqrt(3003) of zero.
    assert abs(np.corrcoef(gyro.ravel(), accel.ravel())[0, 1]) < 5 / math.sqrt(gyro.size)


def test_too_much_jitter_is_refused():
    errors = ImuErrors(TriadErrors(jitter=0.01))
    with pytest.raises(ConfigError, match="jitter"):
        simulate_imu(Swing(1.0, 2.0), errors, rate=50.0)

"""Specific force moved from one point of a body to another, and the noise that this adds."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import savgol_coeffs, savgol_filter
from tests.coded import coded

from strapdown.dsp.derivative import local_slope
from strapdown.errors import ConfigError, DataError
from strapdown.sensors.lever_arm import move_imu
from strapdown.tables import ACCEL, imu_table

R = np.array([-0.6, 0.5, -0.2])
RATE = 200.0
TIME = np.arange(400) / RATE


def turning(time, f=3.0):
    """Rates of several rad/s, their exact derivative."""
    a, p = np.array([2.0, -3.0, 4.0]), np.array([0.3, 1.0, 2.0])
    w = 2 * np.pi * f
    return a * np.sin(w * time[:, None] + p), w * a * np.cos(w * time[:, None] + p)


def carried(alpha, omega, r):
    return np.cross(alpha, r) + np.cross(omega, np.cross(omega, r))


def test_the_force_at_the_point_is_the_closed_form():
    omega, alpha = turning(TIME)
    force = np.tile([1.0, 2.0, -9.8], (TIME.size, 1))
    moved = move_imu(imu_table(TIME, omega, force), R)
    error = moved.imu[ACCEL].to_numpy() - force - carried(alpha, omega, R)
    # Degree four over seven samples, the weights 22, -67, -58, 0, 58, 67, -22 over 252 h: the slope
    # is short by w⁴ h⁴ (sum of weight j⁵) / 120 = 131/630 w⁴ h⁴ of itself, and at the edges, where
    # it is a one-sided fit, by ten times that.
    short = 131 / 630 * (2 * np.pi * 3 / RATE) ** 4
    largest = np.linalg.norm(alpha, axis=1).max() * np.linalg.norm(R)
    assert np.abs(error[3:-3]).max() <= 1.05 * short * largest
    assert np.abs(error[3:-3]).max() >= 0.3 * short * largest
    assert np.abs(error).max() <= 20 * short * largest


def test_the_force_keeps_its_arm_in_the_steepest_turns_of_a_crash():
    # A rate that comes within 60 ms: a parabola through five samples would be 15 % short.
    x = np.clip((TIME - 0.5) / 0.06, 0.0, 1.0)
    omega = np.zeros((TIME.size, 3))
    omega[:, 2] = 3.0 * (x - np.sin(2 * np.pi * x) / (2 * np.pi))
    alpha = 3.0 * (1 - np.cos(2 * np.pi * x)) / 0.06
    forward = move_imu(imu_table(TIME, omega, np.zeros_like(omega)), [0.0, 1.0, 0.0]).imu["accel_x"]
    # 131/630 w⁴ h⁴ = 1.6 % of half of the peak; the corners of the third derivative as much again.
    assert np.abs(forward.to_numpy() + alpha).max() <= 2 * 131 / 630 * (2 * np.pi / 12) ** 4 * 50.0


def test_there_and_back_again():
    omega, _ = turning(TIME, 30.0)
    force = np.random.default_rng(1).normal(size=omega.shape)
    there = move_imu(imu_table(TIME, omega, force), R)
    back = move_imu(there.imu, -R)
    size = np.abs(there.imu[ACCEL].to_numpy()).max()
    assert np.abs(back.imu[ACCEL].to_numpy() - force).max() <= 4 * np.spacing(size)


def test_with_equal_steps_it_is_the_filter_of_savitzky_and_golay():
    omega, _ = turning(TIME)
    for window, width, degree in ((None, 7, 4), (0.04, 9, 4), (0.02, 5, 2), (0.01, 3, 2)):
        slope = local_slope(TIME, window=window)
        there = savgol_filter(omega, width, degree, deriv=1, delta=1 / RATE, axis=0)
        # The sums of a few products of the size of the rates over the step.
        assert np.abs(slope.slope_of(omega) - there).max() <= 1e-10
        gain = np.sqrt((savgol_coeffs(width, degree, deriv=1, delta=1 / RATE) ** 2).sum())
        assert np.sqrt((slope.slope[100] ** 2).sum()) == pytest.approx(gain, rel=1e-10)


def test_unequal_steps_are_exact_for_a_parabola():
    time = np.cumsum(np.random.default_rng(3).uniform(0.003, 0.007, 300))
    y = np.column_stack([2.0 + 3.0 * time - 4.0 * time**2])
    slope = local_slope(time, delay=0.002)
    late = time + 0.002
    # Sums of five products of 1e3 size: 1e-10 is many roundings.
    assert np.abs(slope.slope_of(y)[:, 0] - (3.0 - 8.0 * late)).max() <= 1e-10
    assert np.abs(slope.value_of(y)[:, 0] - (2 + 3 * late - 4 * late**2)).max() <= 1e-11


def test_the_bandwidth_is_where_a_sine_comes_out_at_half_power():
    slope = local_slope(TIME)
    f = slope.bandwidth
    y = np.sin(2 * np.pi * f * TIME)[:, None]
    true = 2 * np.pi * f * np.cos(2 * np.pi * f * TIME)
    got = slope.slope_of(y)[2:-2, 0]
    ratio = (got @ true[2:-2]) / (true[2:-2] @ true[2:-2])
    # Frequencies are searched in steps of 0.05 Hz, over which the ratio changes by 0.2 %.
    assert ratio == pytest.approx(np.sqrt(0.5), abs=3e-3)


def test_the_delay_of_the_gyro_is_taken_out():
    late = 0.002
    omega, _ = turning(TIME - late)
    true_omega, true_alpha = turning(TIME)
    force = np.zeros_like(omega)
    table = imu_table(TIME, omega, force)
    truth = carried(true_alpha, true_omega, R)

    def rms(delay):
        got = move_imu(table, R, gyro_delay=delay).imu[ACCEL].to_numpy()
        return np.sqrt(((got - truth)[5:-5] ** 2).mean())

    # Left in it costs w tau = 3.8 % of the force; taken out, what the fit is short of.
    assert rms(late) < 0.2 * rms(0.0)


@pytest.mark.parametrize("delay", [0.0, 0.003])
def test_the_added_noise_is_what_many_draws_show(delay):
    time = TIME[:20]
    omega, _ = turning(time)
    sd = np.array([0.004, 0.008, 0.002])
    table = imu_table(time, omega, np.zeros_like(omega))
    clean = move_imu(table, R, gyro_noise=sd, gyro_delay=delay)
    rng, draws = np.random.default_rng(4), 300
    errors = np.empty((draws, time.size, 3))
    for k in range(draws):
        noisy = imu_table(time, omega + sd * rng.normal(size=omega.shape), np.zeros_like(omega))
        moved = move_imu(noisy, R, gyro_delay=delay).imu[ACCEL].to_numpy()
        errors[k] = moved - clean.imu[ACCEL].to_numpy()
    for row in (0, 1, 2, 10, 18, 19):
        z = np.linalg.solve(np.linalg.cholesky(clean.added[row]), errors[:, row].T)
        # Elements of a sample covariance of unit normals scatter by sqrt(2/n) or less; squares
        # of the noise in omega x (omega x r) add 1e-4 of the size: five sigma of 18 x 2 elements.
        assert np.abs(z @ z.T / draws - np.eye(3)).max() <= 5 * np.sqrt(2 / draws)


def test_what_is_refused():
    table = imu_table(TIME, np.zeros((400, 3)), np.zeros((400, 3)))
    with pytest.raises(
        ConfigError, check=coded("sensors.not-three-finite-numbers", quantity="lever arm")
    ):
        move_imu(table, [1.0, np.nan, 0.0])
    with pytest.raises(ConfigError, match="window"):
        move_imu(table, R, window=-1.0)
    with pytest.raises(ConfigError, match="delay"):
        move_imu(table, R, gyro_delay=0.1)
    with pytest.raises(
        ConfigError, check=coded("sensors.standard-deviations-shape-do-not", quantity="gyro_noise")
    ):
        move_imu(table, R, gyro_noise=[1.0, 2.0])
    with pytest.raises(DataError, check=coded("tables.missing-columns")):
        move_imu(imu_table(TIME, np.zeros((400, 3))), R)
    with pytest.raises(DataError, check=coded("dsp.samples-too-few-derivative")):
        local_slope(np.array([0.0, 1.0]))

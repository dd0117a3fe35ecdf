"""A unit that stands, is levelled, and waits: what the wait shows, and what it does not show."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from scipy.stats import chi2

from strapdown.config.navigation import NavigationSpec
from strapdown.navigation import handover
from strapdown.sensors.uncertainty import ImuUncertainty, TriadUncertainty
from strapdown.systems.navigation_run import run_navigation
from strapdown.tables import ACCEL, GYRO

TEXT = """
[simulation]
rate_hz = 50.0
seed = {seed}

[simulation.motion]
kind = "stationary"
duration_s = 60.0
lat_deg = 50.0
lon_deg = 10.0
alt_m = 100.0
heading_deg = 70.0

[simulation.gnss.rtk]
rate_hz = 1.0
position_noise_m = 0.01
velocity_noise_m_per_s = 0.03

[sensors]
sensor = "mpu-6050"

[coarse]
kind = "known_heading"
heading_deg = 70.0
sd_deg = 2.0
duration_s = 10.0

[fine]
kind = "none"

[aiding.rtk]
kind = "gnss"
time_offset_sd_s = 0.3
use_velocity = false
"""


@pytest.fixture(scope="module", params=[0, 1, 2])
def result(request, tmp_path_factory):
    file = tmp_path_factory.mktemp("stands") / "navigate.toml"
    file.write_text(TEXT.format(seed=request.param))
    return run_navigation(NavigationSpec.read(file), file)


def test_the_offset_of_a_clock_stays_unknown_while_nothing_moves(result):
    """Its deviation fell to a sixtieth in seconds, by the noise of the velocity."""
    sd = result.record.sensors_sd["rtk.time_offset_t"]
    assert sd.iloc[-1] > 0.2


def test_the_rest_that_was_levelled_shows_the_gyro_biases(result):
    """A heading that was stated was lost at the rate of an unknown bias, 5 deg/s as stated."""
    bias_sd = result.record.sensors_sd[[f"gyro_bias_{x}" for x in "xyz"]].iloc[0]
    # 0.005 deg/s/√Hz over ten seconds, and the drift in the run of the sensor; a rest cannot part
    # the effect of gravity on a gyro, 0.1 deg/s for each g at most, from its bias.
    assert np.degrees(bias_sd).max() < np.hypot(0.05, 0.1 / np.sqrt(3.0))
    sd, error = result.record.sd, result.differences
    apart = error["heading"].reindex(sd.index, method="nearest") / sd["heading"]
    assert apart.abs().max() < chi2.isf(1e-4, 1) ** 0.5
    assert sd["heading"].max() < 6.0


def test_each_fix_has_a_bound_before_it_and_one_after(result):
    """Between two bounds after fixes a third would be too small: what grew would not be seen."""
    sd, fixes = result.record.sd, result.record.innovations["rtk.position"].index
    at = sd.index.to_numpy()
    for fix in fixes[(fixes > at[0] + 0.5) & (fixes < at[-1])]:
        k = int(np.argmin(np.abs(at - fix)))
        before, after = sd["down"].iloc[k - 1], sd["down"].iloc[k]
        assert at[k] - at[k - 1] == pytest.approx(1e-6, rel=0.1)
        assert before > after


@pytest.fixture
def begun():
    """A filter at its start, with biases of 0.01 rad/s."""
    from strapdown.estimation.covariance import COVARIANCES
    from strapdown.estimation.error_filter import ErrorFilter
    from strapdown.estimation.error_model import ERROR_MODELS
    from strapdown.estimation.sensor_blocks import accel_bias, gyro_bias
    from strapdown.mechanization import MECHANIZATIONS
    from strapdown.nav_state import NavState

    sensors = (gyro_bias(1e-2), accel_bias(1e-2))
    model = ERROR_MODELS["rotation_vector"]((1e-5,) * 3, (1e-3,) * 3, sensors)
    filter_ = ErrorFilter(MECHANIZATIONS["ned"](), model, COVARIANCES["ud"]())
    start = NavState.from_degrees(50.0, 10.0, 100.0)
    P = np.diag(np.repeat([1.0, 0.1, 0.05], 3)) ** 2
    return filter_, handover.from_state(filter_, start, P)


STATED = ImuUncertainty(TriadUncertainty(1e-5, bias=1e-2), TriadUncertainty(1e-3, bias=1e-2))


def stood(time, rate):
    """An Imu table of a body at rest, but for its rate about the vertical, rad/s."""
    noise = 1e-4 * np.random.default_rng(0).normal(size=(len(time), 3))
    noise[:, 2] += rate
    rows = np.column_stack([noise, np.tile([0.0, 0.0, -9.81], (len(time), 1))])
    imu = pd.DataFrame(rows, index=pd.Index(time, name="time"), columns=[*GYRO, *ACCEL])
    imu.attrs["sampling"] = "instantaneous"
    return imu


def test_a_turn_is_no_bias(begun):
    """What the gyros read beyond what is stated of them is a rotation."""
    filter_, state = begun
    for rate, learnt in ((5e-3, True), (0.1, False)):
        after = handover._rested(filter_, state, stood(np.arange(500) / 50.0, rate), STATED)
        assert (after is not state) == learnt
        if learnt:
            assert after.sensors[2] == pytest.approx(rate, abs=2e-4)


def test_a_swing_in_a_hand_is_no_bias(begun):
    """Two seconds of a slow swing: its mean rate, up to 5 deviations of a bias, is its own.

    By the scatter of the rate alone a quarter of these biases were beyond their bounds, by up to
    7.5 of their standard deviations, and a heading that was stated was lost.
    """
    filter_, state = begun
    time = np.arange(0.0, 2.0, 0.02)
    inside = []
    for phase in np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False):
        rate = 0.05 * np.sin(2.0 * np.pi * time / 6.0 + phase)
        after = handover._rested(filter_, state, stood(time, rate), STATED)
        sd = np.sqrt(filter_.physical_covariance(after)[11, 11])
        inside.append(abs(after.sensors[2]) < 1.96 * sd)
    assert all(inside)

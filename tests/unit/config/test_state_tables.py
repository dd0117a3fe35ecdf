"""[states.NAME]: what it may say, in its units, and what becomes of it."""

from __future__ import annotations

import math

import numpy as np
import pytest

from strapdown.config.alignment import sensors_of
from strapdown.config.navigation import NavigationSpec, make_filter
from strapdown.errors import ConfigError

FILE = """[log]
path = "log.csv"
[start]
lat_deg = 55.0
lon_deg = 37.0
roll_deg = 0.0
pitch_deg = 0.0
heading_deg = 0.0
[sensors]
states = ["gyro_bias", "accel_bias"]
[sensors.gyro]
noise_density_deg_per_sqrt_h = 0.1
bias_sd_deg_per_h = 2.0
[sensors.accel]
noise_density_ug_per_sqrt_hz = 50.0
bias_sd_ug = 100.0
"""


def states_of(folder, text):
    path = folder / "run.toml"
    path.write_text(FILE + text)
    spec = NavigationSpec.read(path, files=False)
    made = make_filter(spec, sensors_of(spec))
    return {one.block.name: one for one in made.model.sensors}


def test_what_is_not_stated_is_constant(tmp_path):
    states = states_of(tmp_path, "")
    assert list(states) == ["gyro_bias", "accel_bias"]
    assert all(math.isinf(one.correlation_time) for one in states.values())
    assert not states["gyro_bias"].drive.any()


def test_a_bias_that_fades_keeps_its_size_and_a_scale_factor_is_added(tmp_path):
    states = states_of(
        tmp_path,
        "[states.gyro_bias]\ncorrelation_time_s = 100.0\n"
        "[states.accel_scale]\nsd_ppm = [100, 200, 300]\ncorrelation_time_s = 14400\n",
    )
    assert list(states) == ["gyro_bias", "accel_bias", "accel_scale"]
    bias, scale = states["gyro_bias"], states["accel_scale"]
    size = math.radians(2.0) / 3600.0
    np.testing.assert_allclose(bias.sd, size)
    # Stationary: what is driven in a second is what fades in it.
    np.testing.assert_allclose(bias.drive, size * math.sqrt(2.0 / 100.0))
    np.testing.assert_allclose(scale.sd, [1e-4, 2e-4, 3e-4])
    assert scale.correlation_time == 14400.0


def test_a_walk_is_of_the_root_of_an_hour(tmp_path):
    states = states_of(
        tmp_path, "[states.gyro_bias]\nsd_deg_per_h = 5.0\nwalk_deg_per_h_per_sqrt_h = 0.6\n"
    )
    bias = states["gyro_bias"]
    np.testing.assert_allclose(bias.sd, math.radians(5.0) / 3600.0)
    # After an hour it has walked by 0.6 deg/h.
    np.testing.assert_allclose(bias.drive * 60.0, math.radians(0.6) / 3600.0)
    assert math.isinf(bias.correlation_time)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[states.gyro_bais]\nsd_deg_per_h = 1.0\n", r"states, gyro_bais.*gyro_bias"),
        ("[states.gyro_bias]\nsd_ppm = 1.0\n", r"sd_ppm: unknown key"),
        ("[states.gyro_bias]\ncorrelation_time = 1.0\n", r"correlation_time_s"),
        ("[states.gyro_scale]\ncorrelation_time_s = 9.0\n", r"deviation of 'gyro_scale'"),
        (
            "[states.gyro_bias]\nwalk_deg_per_h_per_sqrt_h = 1.0\ncorrelation_time_s = 9.0\n",
            r"random walk and a correlation time",
        ),
        ("[states.gyro_bias]\nsd_deg_per_h = 1.0\nsd_deg_per_s = 1.0\n", r"in two units"),
        ("[states.gyro_drift]\nsd_deg_per_h = 1.0\n", r"correlation time of 'gyro_drift'"),
        ("[states.gyro_bias]\ncorrelation_time_s = 0.0\n", r"correlation_time_s"),
    ],
)
def test_what_does_not_fit_is_told_at_its_line(tmp_path, text, said):
    with pytest.raises(ConfigError, match=rf"(?s)run.toml, line 1[6-9].*{said}"):
        states_of(tmp_path, text)

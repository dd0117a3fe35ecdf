"""Starts of a fiber-optic unit at rest, on a rocking base and in motion: errors are as stated."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2

from strapdown.config.navigation import NavigationSpec
from strapdown.systems.navigation_run import run_navigation

PLACE = "lat_deg = 55.75\nlon_deg = 37.62\nalt_m = 150.0\n"
TEXT = """
[simulation]
rate_hz = 100.0
sampling = "mean"
seed = {seed}

[sensors]
sensor = "fog-1000"

[recorder]
kind = "interval"
rate_hz = 10.0

[trust]
repeat = false

[simulation.motion]
heading_deg = {heading}
"""
STANDS = f"""
[site]
{PLACE}
position_sd_m = 0.05

[coarse]
kind = "inertial_frame"
duration_s = 60.0

[fine]
kind = "filter"
duration_s = 140.0
"""
REST = f'kind = "car"\n{PLACE}manoeuvres = [{{ do = "straight", duration_s = 205.0 }}]\n'
# A ship at its berth: rocks by degrees, heaves by a decimeter.
ROCKING = f"""kind = "ship"
{PLACE}
manoeuvres = [{{ do = "straight", duration_s = 205.0 }}]
roll_waves = [{{ amplitude_deg = 2.0, period_s = 7.3, phase_deg = 10.0 }}]
pitch_waves = [{{ amplitude_deg = 1.0, period_s = 5.1, phase_deg = 70.0 }}]
heading_waves = [{{ amplitude_deg = 1.5, period_s = 11.0, phase_deg = 33.0 }}]
heave_waves = [{{ amplitude_m = 0.1, period_s = 6.0 }}]
"""
# It drives from the first sample on; position and velocity at 1 Hz.
DRIVE = f"""kind = "car"
{PLACE}
speed_km_per_h = 50.0
manoeuvres = [
  {{ do = "straight", duration_s = 20.0 }},
  {{ do = "turn_left", angle_deg = 90.0, radius_m = 60.0 }},
  {{ do = "straight", duration_s = 20.0 }},
  {{ do = "accelerate", to_km_per_h = 80.0, duration_s = 8.0 }},
  {{ do = "turn_right", angle_deg = 60.0, radius_m = 120.0 }},
  {{ do = "straight", duration_s = 145.0 }},
]

[simulation.gnss.gps]
rate_hz = 1.0
position_noise_m = 3.0
velocity_noise_m_per_s = 0.1

[coarse]
kind = "gnss_course"
duration_s = 60.0
backtrack = true

[fine]
kind = "none"

[aiding.gps]
kind = "gnss"
"""
STARTS = {"rest": REST + STANDS, "rocking": ROCKING + STANDS, "motion": DRIVE}
RUNS = 16


@pytest.mark.slow
@pytest.mark.parametrize("start", STARTS)
def test_attitude_at_200_s_is_as_stated(start, tmp_path):
    """Roll, pitch and heading of 12 units, headings all round: chi-square of each axis."""
    squares, heading = [], []
    for seed in range(1, RUNS + 1):
        file = tmp_path / f"{seed}.toml"
        text = TEXT.format(seed=seed, heading=37.0 * seed % 360.0) + STARTS[start]
        file.write_text(text)
        result = run_navigation(NavigationSpec.read(file), file)
        names = ["roll", "pitch", "heading"]
        error = result.differences.loc[200.0:].iloc[0][names]
        sd = result.record.sd.loc[200.0:].iloc[0][names]
        squares.append(np.square((error / sd).to_numpy(dtype=float)))
        heading.append(float(error["heading"]))
    low, high = chi2.isf([0.9995, 0.0005], RUNS)
    total = np.sum(squares, axis=0)
    assert (low < total).all() and (total < high).all(), total
    # Gyros of 0.01 deg/h find north to 0.01/15/cos(55.75 deg), 0.07 deg, and 0.04 deg more by
    # their noise; the accelerations of a drive show it better. Three standard deviations of the
    # root mean square of twelve.
    most = {"rest": 0.08, "rocking": 0.10, "motion": 0.06}[start]
    assert np.sqrt(np.mean(np.square(heading))) < most * (1.0 + 3.0 / np.sqrt(2.0 * RUNS))

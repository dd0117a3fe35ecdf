"""Filter and smoother are compared about the same states, whatever passes follow."""

from __future__ import annotations

import numpy as np
import pytest
from tests.unit.systems.test_start_lost import TEXT as ALIGNED

from strapdown.config.navigation import NavigationSpec
from strapdown.errors import DivergenceError
from strapdown.navigation.truth_comparison import smoother_consistency
from strapdown.systems.navigation_run import run_navigation

# A shorter drive, from a known start.
TEXT = (
    ALIGNED.partition("[coarse]")[0]
    .replace("rate_hz = 100.0", "rate_hz = 50.0")
    .replace("duration_s = 20.0", "duration_s = 5.0")
    .replace("mpu-6050", "adis16448")
    + """
[start]
lat_deg = 55.75
lon_deg = 37.62
alt_m = 150.0
heading_deg = 30.0
roll_deg = 0.0
pitch_deg = 0.0
v_ned_m_per_s = [12.03, 6.94, 0.0]
position_sd_m = 1.0
velocity_sd_m_per_s = 0.5
tilt_sd_deg = 1.0
heading_sd_deg = 3.0

[aiding.rtk]
kind = "gnss"
lever_arm_sd_m = 1.0

[smoother]
kind = "rts"
"""
)


def test_passes_leave_the_agreement_as_it_was(tmp_path):
    file, found = tmp_path / "navigate.toml", []
    for passes in ("", "passes = 1"):
        file.write_text(TEXT + passes)
        found.append(run_navigation(NavigationSpec.read(file), file))
    again, once = found
    assert again.record.trajectory["alt"].iloc[-1] != once.record.trajectory["alt"].iloc[-1]
    own = smoother_consistency(once.forward, once.record)
    np.testing.assert_array_equal(again.agreement.rms, own.rms)
    np.testing.assert_array_equal(again.agreement.share, own.share)
    mixed = smoother_consistency(again.forward, again.record)
    assert (mixed.rms != own.rms).any()


def test_a_smoother_over_a_filter_that_diverged_says_so(tmp_path):
    """Gyros of 11 deg/s from the first metre on, and nothing that rejects: not a table's row."""
    file = tmp_path / "navigate.toml"
    file.write_text(TEXT.replace("adis16448", "mpu-6050"))
    with pytest.raises(DivergenceError) as found:
        run_navigation(NavigationSpec.read(file), file)
    assert found.value.finding.code == "navigation.covariance-lost"

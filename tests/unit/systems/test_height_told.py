"""What a run says of a height that nothing corrects."""

from __future__ import annotations

import numpy as np
import pytest

from strapdown.config.navigation import NavigationSpec
from strapdown.systems.navigation_checks import look_through
from strapdown.tables import imu_table

FREE, HELD = {"kind": "wander_azimuth"}, {"kind": "wander_azimuth", "height": "held"}
QUATERNIONS = {"kind": "error_state", "error_model": {"kind": "quaternions"}}
BAROMETER = {"baro": {"kind": "barometer"}}


def said(seconds, **tables):
    spec = NavigationSpec.checked(
        {
            "live": {"sampling": "mean"},
            "start": {"lat_deg": 50.0, "lon_deg": 30.0, "alt_m": 0.0, "roll_deg": 0.0}
            | {"pitch_deg": 0.0, "heading_deg": 0.0},
            "sensors": {"sensor": "stim300"},
            **tables,
        }
    )
    time = np.linspace(0.0, seconds, 20)
    still = np.zeros((20, 3)), np.tile([0.0, 0.0, -9.8], (20, 1))
    return [finding.what for finding in look_through(spec, imu_table(time, *still), {})]


@pytest.mark.parametrize("aiding", [{}, BAROMETER])
def test_quaternions_have_no_height_whatever_aids(aiding):
    (what,) = said(60.0, mechanization=FREE, filter=QUATERNIONS, aiding=aiding)
    assert what.startswith("the error model 'quaternions' has no height state: the height")
    assert said(60.0, mechanization=HELD, filter=QUATERNIONS) == []


def test_other_models_are_told_of_where_nothing_aids_them_for_long():
    assert said(60.0, mechanization=FREE) == []
    assert said(3600.0, mechanization=FREE, aiding=BAROMETER) == []
    (what,) = said(3600.0, mechanization=FREE)
    # e^(3600 / 570) = 553
    assert "60 minutes" in what and "5.5e+02 times in all" in what

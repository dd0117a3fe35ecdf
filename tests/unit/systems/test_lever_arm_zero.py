"""A lever arm of zero, which no antenna has, beside fixes that are finer than one."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from strapdown.config.navigation import NavigationSpec
from strapdown.errors import Finding
from strapdown.report.verdict import without_arm
from strapdown.systems.navigation_checks import look_through
from strapdown.tables import GNSS, POSITION_SD, imu_table

STATE = {"lat_deg": 50.0, "lon_deg": 30.0, "alt_m": 0.0, "roll_deg": 0.0, "pitch_deg": 0.0}
TIME = np.arange(0.0, 60.0, 1.0)


def warned(sd, log=True, **aid):
    """Names and stated sizes of the warnings of a record that stands among fixes."""
    spec = NavigationSpec.checked(
        {
            "log": {"path": "log.csv"},
            "start": STATE | {"heading_deg": 0.0},
            "sensors": {"sensor": "stim300"},
            "aiding": {"rtk": {"kind": "gnss", "path": "fixes.csv", **aid}},
        }
    )
    spec = spec if log else spec.model_copy(update={"log": None})
    still = np.zeros((60, 3)), np.tile([0.0, 0.0, -9.8], (60, 1))
    fixes = pd.DataFrame(0.0, pd.Index(TIME, name="time"), list(GNSS))
    fixes[["lat", "lon"]] = 50.0, 30.0
    fixes["quality"] = 4
    fixes[[one for one in GNSS if "sd" in one]] = 0.1
    fixes[POSITION_SD] = sd
    found = look_through(spec, imu_table(TIME, *still), {"rtk": fixes})
    return [(f.data["name"], f.severity) for f in found if f.code == "navigation.lever-arm-zero"]


@pytest.mark.parametrize("aid", [{}, {"lever_arm_m": [0, 0, 0]}, {"lever_arm_sd_m": 0.02}])
def test_an_arm_of_zero_is_a_caution_beside_fixes_that_are_finer_than_an_arm(aid):
    assert warned(0.05, **aid) == [("rtk", "warning")]
    assert warned(1.9, **aid) == [("rtk", "warning")]
    assert warned(2.1, **aid) == []


@pytest.mark.parametrize(
    "aid", [{"lever_arm_m": [0.0, 0.03, 0.0]}, {"lever_arm_sd_m": 0.5}, {"use_position": False}]
)
def test_an_arm_that_is_stated_or_estimated_is_none(aid):
    assert warned(0.05, **aid) == []


def test_simulated_fixes_have_the_arm_of_their_receiver():
    assert warned(0.05, log=False) == []


def test_the_bound_of_a_position_says_what_it_does_not_have():
    one = Finding("navigation.lever-arm-zero", severity="warning", data={"name": "rtk", "sd_m": 1})
    run = SimpleNamespace(findings=(one,))
    assert without_arm(run) == "without the lever arm of rtk, taken as zero"
    assert without_arm(SimpleNamespace(findings=())) == ""

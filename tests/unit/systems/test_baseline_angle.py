"""The angle of two antennas in the vehicle, by their headings against the course."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from strapdown.systems.baseline_angle import baseline_angle


def drive(turn=2.0, speed=10.0, seconds=60.0, angle=90.0, step=1.0):
    """A circle by fixes at 1 Hz, and exact headings of a baseline at 2 Hz between them."""
    time = np.arange(0.0, seconds + 0.5, step)
    course = np.radians(100.0 + turn * time)
    fixes = pd.DataFrame(
        {"VN": speed * np.cos(course), "VE": speed * np.sin(course), "VN_sd": 0.1, "VE_sd": 0.1},
        index=time,
    )
    at = np.arange(0.0, seconds + 0.25, 0.5)
    headings = pd.DataFrame({"heading": (100.0 + turn * at + angle) % 360.0}, index=at)
    return headings, fixes


@pytest.mark.parametrize("angle", [0.0, 90.0, -91.5, 179.9])
def test_the_angle_is_heading_less_course(angle):
    found = baseline_angle(*drive(angle=angle))
    assert found.angle_deg == pytest.approx(angle, abs=1e-9)
    assert found.scatter_deg == pytest.approx(0.0, abs=1e-9)
    assert found.duration == 60.0


def test_its_standard_deviation_is_that_of_the_mean_of_lasting_errors():
    headings, fixes = drive(seconds=400.0)
    headings["heading"] += 3.0 * np.sign(np.sin(headings.index.to_numpy() * 0.9))
    found = baseline_angle(headings, fixes)
    assert found.scatter_deg == pytest.approx(3.0, abs=0.01)
    assert found.sd_deg == pytest.approx(found.scatter_deg / np.sqrt(400.0 / 10.0), rel=1e-12)
    assert found.angle_deg == pytest.approx(90.0, abs=0.2)


@pytest.mark.parametrize(
    "given",
    [
        {"turn": 5.5},  # not straight
        {"speed": 2.9},  # too slow for a course
        {"seconds": 29.0},
        {"step": 3.0},  # fixes too far apart
    ],
)
def test_what_does_not_show_an_angle(given):
    assert baseline_angle(*drive(**given)) is None


def test_just_enough_shows_it():
    for given in ({"turn": 4.5}, {"speed": 3.1}, {"seconds": 30.0}, {"step": 2.0}):
        assert baseline_angle(*drive(**given)).angle_deg == pytest.approx(90.0, abs=1e-6)


def test_a_vehicle_that_also_reverses_shows_none():
    headings, fixes = drive(seconds=100.0)
    later = headings.index > 88.0
    headings.loc[later, "heading"] = (headings.loc[later, "heading"] + 180.0) % 360.0
    assert baseline_angle(headings, fixes) is None
    headings, fixes = drive(seconds=100.0)
    few = headings.index > 95.0
    headings.loc[few, "heading"] = (headings.loc[few, "heading"] + 180.0) % 360.0
    assert baseline_angle(headings, fixes).angle_deg == pytest.approx(90.0, abs=1e-9)


def test_fixes_without_velocities_show_none():
    headings, fixes = drive()
    assert baseline_angle(headings, fixes.assign(VN_sd=np.inf)) is None
    # A gap of the headings is no time of driving.
    assert baseline_angle(headings[::30], fixes) is None

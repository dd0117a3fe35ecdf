"""Trials of an alignment by course: the time and the limits that are proposed."""

import math
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from tests import town_drive as town

from strapdown.alignment.gnss_course import GnssCourse
from strapdown.errors import DataError
from strapdown.systems.navigation_proposal import (
    HEADING,
    NO_ERRORS,
    WELL,
    _bias_by_turns,
    _levelled,
    _tried,
)
from strapdown.tables import imu_table

CHOSEN = {"coarse": {"until_heading_sd_deg": HEADING, "until_tilt_sd_deg": WELL}}


def tried(monkeypatch, heading, clock=None):
    """Try alignments over 200 s, with a standard deviation of heading by their length."""
    seen = []

    def align(self, part, site, sensors, fixes, antenna):
        seen.append(antenna)
        sd = heading(float(part.index[-1]))
        if math.isinf(sd):
            raise DataError("navigation.course-too-uncertain", sd=sd)
        sd_deg = np.array([1.0, 1.0, sd])
        return SimpleNamespace(sd_deg=sd_deg, sd_deg_to_begin=sd_deg)

    monkeypatch.setattr(GnssCourse, "align", align)
    imu = pd.DataFrame(index=pd.Index(np.arange(0.0, 200.1, 0.1), name="time"))
    fixes = town.fixes(5)
    chosen, _, findings = _tried(CHOSEN, "", imu, fixes, (NO_ERRORS, None), 2.0, clock or {})
    return chosen["coarse"], findings, seen


def test_an_alignment_that_meets_its_limits_has_a_margin_for_what_is_answered_later(monkeypatch):
    """A boat's was at 5.8° with a zero arm, and at 7.9° with its arm: `navigate` refused it."""
    clock = {"time_offset_sd_s": 0.2}
    coarse, findings, seen = tried(monkeypatch, lambda t: 600.0 / max(t, 1.0), clock)
    assert coarse["least_s"] >= 100.0
    assert coarse["until_heading_sd_deg"] == 2.0 * HEADING
    assert coarse["until_tilt_sd_deg"] == 2.0 * WELL
    assert not findings
    assert {one.time_offset_sd for one in seen} == {0.2}  # as the run itself


@pytest.mark.parametrize(("least", "limit"), [(7.0, 14.0), (9.0, 15.0)])
def test_one_that_misses_them_is_the_best_at_its_time(monkeypatch, least, limit):
    """Later ones may be worse, as over an outage: it is not to be left to chance which is met."""
    coarse, findings, _ = tried(monkeypatch, lambda t: least + abs(t - 100.0))
    assert coarse["least_s"] == pytest.approx(100.0, abs=15.0)
    assert limit <= coarse["until_heading_sd_deg"] <= 15.0
    assert coarse["until_tilt_sd_deg"] == 2.0 * WELL
    assert not findings


@pytest.mark.parametrize("heading", [lambda t: 30.0, lambda t: math.inf])
def test_without_any_the_heading_is_asked(monkeypatch, heading):
    coarse, findings, _ = tried(monkeypatch, heading)
    assert coarse["kind"] == "known_heading"
    assert [one.code for one in findings] == ["navigation.course-too-uncertain"]


def carried(rate_deg_s, steps, duration=100.0):
    """A unit in motion: turning about z, with the force of steps."""
    time = np.arange(0.0, duration, 0.02)
    gyro = np.zeros((len(time), 3))
    gyro[:, 2] = np.radians(rate_deg_s)
    accel = np.zeros((len(time), 3))
    accel[:, 2] = 9.8 + steps * np.sin(2.0 * np.pi * 1.9 * time)
    return imu_table(time, gyro, accel, sampling="mean", source="log.csv")


@pytest.mark.parametrize(
    ("steps", "rest", "until", "length"),
    [
        (2.5, 0.0, 60.0, 2.0),  # fixes of a phone do not prove a walk for a minute
        (0.3, 0.0, 60.0, 10.0),  # a boat at its berth
        (0.3, 0.0, 5.0, 2.0),
        (0.3, 6.0, 5.0, 6.0),
    ],
)
def test_a_walk_is_levelled_by_two_seconds(steps, rest, until, length):
    assert _levelled(carried(0.0, steps), rest, until) == length


def test_an_engine_is_no_walk():
    imu = carried(0.0, 0.0)
    time = imu.index.to_numpy()
    imu["accel_z"] += 3.0 * np.sin(2.0 * np.pi * 23.0 * time)
    assert _levelled(imu, 0.0, 60.0) == 10.0


def test_the_turns_of_a_record_bound_the_biases():
    """One turn of a standard deviation: 3.6 deg/s of 100 s; and the rate of one that turns on."""
    assert np.degrees(_bias_by_turns(carried(0.0, 1.0))) == pytest.approx(3.6, rel=0.01)
    assert np.degrees(_bias_by_turns(carried(0.0, 1.0, 400.0))) == pytest.approx(0.9, rel=0.01)
    assert np.degrees(_bias_by_turns(carried(-18.0, 1.0))) == pytest.approx(18.4, rel=0.01)

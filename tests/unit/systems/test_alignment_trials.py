"""Trials of an alignment by course: the time and the limits that are proposed."""

import math
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from tests import town_drive as town

from strapdown.alignment.gnss_course import GnssCourse
from strapdown.errors import DataError
from strapdown.systems.navigation_proposal import HEADING, NO_ERRORS, WELL, _tried

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

"""A smoothed stretch without fixes is scored by the antenna of the smoothed run, arm and clock."""

from __future__ import annotations

import sys
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from tests.coded import coded

sys.path.insert(0, str(Path(__file__).parents[2]))

import town_drive as town
from strapdown import rotation
from strapdown.ellipsoids import WGS84
from strapdown.errors import ConfigError
from strapdown.frames import place_difference
from strapdown.navigation.filter_options import DAMPINGS
from strapdown.navigation.measurements.gnss import CLEAR
from strapdown.navigation.measurements.vehicle import NoSlip
from strapdown.navigation.outage_test import (
    blinded,
    end_of_what_tells,
    judge_outages,
    score_by_truth,
    score_of_smoothed,
)
from strapdown.navigation.record import Span
from strapdown.navigation.recorder import FullRecorder
from strapdown.navigation.smoother import RauchTungStriebel
from strapdown.tables import EULER
from withheld_fixes import score_withheld, score_withheld_smoothed

NOISE = 0.05
#: So early that most of what is known of arm and clock comes after it.
SPAN = Span("early", 15.0, 35.0)
OFFSET = 0.05
#: Wrong by half a metre and by 0.05 s.
UNKNOWN = {
    "lever_arm": (0.7, 0.0, -1.2),
    "lever_arm_sd": 0.5,
    "time_offset": OFFSET,
    "time_offset_sd": 0.1,
}


@cache
def fixes():
    return town.fixes(position_noise=NOISE, velocity_noise=0.03)


def begun(*aids, damping="feedback"):
    navigator, state = town.begun(*aids)
    navigator = replace(navigator, smoother=RauchTungStriebel(), damping=DAMPINGS[damping]())
    state = navigator.begin_from(state.engine.filter)
    return navigator, navigator.tell(state, "gnss", fixes())


def antenna_less_fix(navigator, pieces, later, time):
    """Of the record that a smoother makes: place and arm and clock, with no linear model."""
    tape, smoothing = FullRecorder().begin(navigator), navigator.smoother.begin(navigator)
    for piece in (*pieces, *later):
        tape.take(piece)
        smoothing.take(piece)
    record = tape.record(smoothing=smoothing)
    sensors = record.sensors.iloc[np.searchsorted(record.sensors.index, time - 1e-9)]
    assert np.abs(sensors.index.to_numpy() - time).max() < 1e-6
    at = navigator.filter.model.columns_of
    arm, late = (
        sensors.to_numpy()[:, at[f"gnss.{name}"].start - 9 : at[f"gnss.{name}"].stop - 9]
        for name in ("lever_arm", "time_offset")
    )
    arm = np.array(UNKNOWN["lever_arm"]) - arm
    rows = record.trajectory
    places = rows[["lat", "lon", "alt"]].to_numpy()
    q = rotation.quaternion_from_euler(rows[EULER].to_numpy())
    table, out = fixes(), []
    for at, by, r in zip(time, late[:, 0], arm, strict=True):
        # From where the sensors are at the epoch, along the path to the instant of the fix.
        k = int(np.searchsorted(rows.index, at - 1e-9))
        near = slice(max(k - 20, 0), k + 21)
        path = place_difference(places[near], np.tile(places[k], (len(places[near]), 1)))
        path += rotation.rotate(q[near], np.tile(r, (len(path), 1)))
        there = [np.interp(at + by, rows.index[near], one) for one in path.T]
        row = int(np.searchsorted(table.index, at + OFFSET - 1e-6))
        fix = table[["lat", "lon", "alt"]].to_numpy()[row : row + 1]
        out.append(there + place_difference(places[k : k + 1], fix)[0])
    return np.array(out)


# What the score leaves out is of the second order: of an arm of 1.6 m turned by a degree that the
# smoother takes off, 2e-4 m; of 0.05 s and what it takes off the velocity, some 0.2 m/s, 0.01 m.
# Where nothing is fed back, it is of what the mechanization alone is off by: within 35 s, of
# 0.2 deg of tilt and a bias of 0.02 m/s², 1.9 m/s in 0.05 s.
@pytest.mark.parametrize(("damping", "least"), [("feedback", 0.015), ("feedforward", 0.1)])
def test_it_is_the_antenna_of_the_smoothed_run_less_the_fix(damping, least):
    navigator, state = begun(town.gnss(**UNKNOWN), damping=damping)
    time, rows = town.increments()
    ends = [SPAN.begin, SPAN.end, end_of_what_tells(SPAN)]
    first, last, after = np.searchsorted(time, ends, side="right").tolist()
    state, _ = navigator.advance(state, time[:first], rows[:first])
    blind = blinded(navigator, "gnss")
    through, piece = blind.advance(state, time[first:last], rows[first:last])
    _, later = navigator.advance(through, time[last:after], rows[last:after])
    smoothing = navigator.smoother.begin(navigator)
    smoothing.take(piece)
    smoothing.take(later)
    score = score_of_smoothed([piece], smoothing, "gnss", SPAN)
    expected = antenna_less_fix(navigator, [piece], [later], score.time)
    assert len(score.time) == 40
    # The derivative by the offset is the velocity of the last epoch at which its change was clear
    # of its own error: old by so many standard deviations at most.
    marks = [mark for mark in piece.marks if mark.time in score.time]
    sd = np.sqrt([np.diag(mark.covariance)[3:6] for mark in marks])
    assert len(marks) == 40
    assert (np.abs(score.error - expected) < least + CLEAR * sd * OFFSET).all()
    # It matters which arm and which clock: those of the filter were wrong by far more.
    found = later.marks[-1].sensors - piece.marks[-1].sensors
    assert np.abs(found[-4:]).max() > 0.02
    # And that is the error of the run: within its bounds as often as it should be.
    assert np.mean(score.distance < 2.45) > 0.8


def test_a_stretch_is_scored_with_less_than_its_filter_states():
    navigator, state = begun(town.gnss(**UNKNOWN))
    (smoothed,) = score_withheld_smoothed(navigator, state, *town.increments(), "gnss", [SPAN])
    plain, state = town.begun(town.gnss(**UNKNOWN))
    (forward,) = score_withheld(plain, state, *town.increments(), "gnss", fixes(), [SPAN])
    np.testing.assert_array_equal(smoothed.time, forward.time)
    less, more = (np.einsum("kii->ki", one.covariance) for one in (smoothed, forward))
    assert (less < more).all()
    # The fix has its noise, whatever is known of the place.
    assert (less > 0.99 * NOISE**2).all()
    # Without that it is the place's own, which grows to the middle of the stretch.
    assert (smoothed.drift > 0.0).all()
    np.testing.assert_allclose(less.sum(axis=1) - smoothed.drift, 2.0 * NOISE**2, rtol=0.1)
    assert smoothed.largest < forward.largest


def test_the_truth_scores_where_the_sensors_are():
    navigator, state = begun(town.gnss(**UNKNOWN))
    time, rows = town.increments()
    blind = blinded(navigator, "gnss")
    first, last, after = np.searchsorted(time, [15.0, 35.0, 100.0], side="right").tolist()
    state, _ = navigator.advance(state, time[:first], rows[:first])
    through, piece = blind.advance(state, time[first:last], rows[first:last])
    _, later = navigator.advance(through, time[last:after], rows[last:after])
    truth = town.motion().trajectory(time)
    forward = score_by_truth(blind, [piece], SPAN, truth, WGS84)
    assert forward.against == "truth"
    # At the marks the true path is one of its rows; the axes are those of the one or the other
    # place, which turns an error by itself over the radius of the Earth.
    at = np.searchsorted(piece.time, forward.time - 1e-9)
    assert np.abs(forward.error - town.off(piece)[at]).max() < forward.largest**2 / 6.3e6
    smoothing = navigator.smoother.begin(navigator)
    smoothing.take(piece)
    smoothing.take(later)
    smoothed = score_by_truth(blind, [piece, later], SPAN, truth, WGS84, smoothing)
    assert smoothed.time[-1] <= SPAN.end + 1e-9
    assert smoothed.largest < forward.largest
    assert (smoothed.drift < forward.drift).all()
    assert judge_outages([forward]).consistent and judge_outages([smoothed]).consistent


def test_it_does_not_matter_which_aid_comes_first():
    tires, receiver = NoSlip(name="tires"), town.gnss(**UNKNOWN)
    scores = []
    for aids in ((tires, receiver), (receiver, tires)):
        navigator, state = begun(*aids)
        (score,) = score_withheld_smoothed(navigator, state, *town.increments(), "gnss", [SPAN])
        scores.append(score)
    one, other = scores
    # Observations of an epoch are independent of each other: but for rounding, whose part in the
    # states is some 1e-9 of their deviations, and for what the order of two tilts does.
    assert np.abs(one.error - other.error).max() < 1e-5
    np.testing.assert_allclose(one.covariance, other.covariance, rtol=1e-5, atol=1e-5 * NOISE**2)


def test_a_stretch_without_fixes_is_refused():
    navigator, state = begun(town.gnss())
    with pytest.raises(ConfigError, check=coded("evaluation.no-fixes-score")):
        score_withheld_smoothed(
            navigator, state, *town.increments(), "gnss", [Span("none", 60.1, 60.2)]
        )

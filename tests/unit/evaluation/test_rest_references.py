"""Rests as reference points: the tilt, how well it is known, and poses that look alike."""

from __future__ import annotations

import numpy as np
import pytest
from tests.coded import coded

from strapdown import rotation
from strapdown.attitude_algorithms.algorithm import AttitudeRun
from strapdown.constants import STANDARD_GRAVITY as G
from strapdown.errors import DataError
from strapdown.evaluation.reference_points import (
    in_words,
    parse_reference,
    references_from_words,
    same_pose_candidates,
    score_references,
    tilt_references,
    tilt_sd_deg,
    with_tilt,
)
from strapdown.formats.references import read_reference_words
from strapdown.sensors.rest import RestStretch
from strapdown.tables import attitude_table, imu_table


def rest_at(start, angles, *, noise=(0.0, 0.0, 0.0), bias=(0.0, 0.0, 0.0), g=G):
    up = rotation.rotate(rotation.conjugate(rotation.quaternion_from_euler(angles)), [0.0, 0.0, -g])
    force = tuple(float(v) for v in up + np.asarray(bias))
    zero = (0.0, 0.0, 0.0)
    return RestStretch(start, start + 2.0, zero, zero, force, zero, noise, noise)


def run_of(angles, seconds=30.0):
    time = np.array([0.0, seconds])
    q = np.tile(rotation.quaternion_from_euler(angles), (2, 1))
    return AttitudeRun("given", "", "", attitude_table(time, q), {}), imu_table(
        time, np.zeros((2, 3))
    )


@pytest.mark.parametrize(
    "angles", [(0, 0, 0), (30, -50, 200), (180, 0, 10), (0, 90, 0), (-120, 80, 5)]
)
@pytest.mark.parametrize("heading", [0.0, 77.0, -150.0])
def test_the_error_is_the_angle_between_directions_of_gravity(angles, heading):
    """Whatever the heading; to the rounding of an arccosine near zero and half a turn, 2e-6 deg."""
    roll, pitch, _ = angles
    run, imu = run_of([roll, pitch, heading])
    for other in [(0, 0, 33), (30, -50, 0), (-140, 20, 300), (180, 0, 0)]:
        table = tilt_references([rest_at(5.0, other)])
        (score,) = score_references(run, table, imu)
        a, b = (
            rotation.rotate(rotation.conjugate(rotation.quaternion_from_euler(e)), [0.0, 0.0, 1.0])
            for e in (angles, other)
        )
        expected = np.degrees(np.arccos(np.clip(a @ b, -1.0, 1.0)))
        assert score.error_deg == pytest.approx(expected, abs=2e-6)
        assert score.time == 6.0


def test_turning_to_a_tilt_gives_that_tilt_by_the_least_turn():
    rng = np.random.default_rng(0)
    for q in rotation.quaternion_from_rotation_vector(rng.normal(size=(50, 3))):
        roll, pitch = rng.uniform(-170, 170), rng.uniform(-85, 85)
        near = with_tilt(q, roll, pitch)
        assert rotation.euler_from_quaternion(near)[:2] == pytest.approx([roll, pitch], abs=1e-9)
        others = rotation.quaternion_from_euler([[roll, pitch, h] for h in range(360)])
        assert rotation.rotation_angle(q, near) <= rotation.rotation_angle(q, others).min() + 1e-9


def test_the_sd_of_a_tilt_is_that_of_its_errors():
    """4000 draws of bias and noise: mean square angle over variance within 4 √(1/4000).

    Two axes make chi² of two degrees of freedom, whose half has variance 1; second order of
    0.05/9.8 is nothing. The bias along gravity raises the assumed one only where it is larger.
    """
    rng = np.random.default_rng(2)
    bias, noise = 0.05, (0.03, 0.03, 0.03)
    angles = (25.0, -40.0, 0.0)
    true = np.array(rest_at(0.0, angles).accel_mean)
    sd = tilt_sd_deg(rest_at(0.0, angles, noise=noise), bias_sd=bias)
    off = true + bias * rng.normal(size=(4000, 3)) + 0.03 * rng.normal(size=(4000, 3))
    cosine = off @ true / np.linalg.norm(off, axis=1) / np.linalg.norm(true)
    square = np.mean(np.degrees(np.arccos(cosine)) ** 2)
    assert square / sd**2 == pytest.approx(1.0, abs=4 / np.sqrt(4000) + 1e-4)


def test_the_length_may_refute_the_assumed_bias_and_not_confirm_it():
    plain = tilt_sd_deg(rest_at(0, (0, 0, 0)), bias_sd=0.05)
    assert plain == pytest.approx(np.degrees(np.sqrt(2) * 0.05 / G))
    off = tilt_sd_deg(rest_at(0, (0, 0, 0), bias=(0, 0, -0.4)), bias_sd=0.05)
    assert off == pytest.approx(np.degrees(np.sqrt(2) * 0.4 / (G + 0.4)))
    assert tilt_sd_deg(rest_at(0, (0, 0, 0), g=9.78), bias_sd=0.0, gravity=9.78) < 1e-6


def test_the_rest_that_levelled_the_run_is_left_out():
    rests = [rest_at(0, (1, 2, 0)), rest_at(10, (3, 4, 0))]
    table = tilt_references(rests, levelled_from=rests[0])
    assert table["time"].tolist() == [11.0]
    assert (table["kind"] == "tilt").all()
    assert (
        in_words(tilt_references(rests).iloc[1]) == "11 s: roll 3°, pitch 4°, whatever the heading"
    )


def test_poses_that_look_alike_are_offered_with_a_caveat():
    noise = (0.005, 0.005, 0.005)  # on two axes of two rests: 0.058 deg; three of it: 0.175
    rests = [
        rest_at(0, (10, 5, 0), noise=noise),
        rest_at(5, (0, 0, 0), noise=noise),
        rest_at(9, (10.1, 5, 120), noise=noise),
        rest_at(20, (10.5, 5, 0), noise=noise),
        rest_at(25, (10.0, 5, 0), noise=noise),
    ]
    found = same_pose_candidates(rests)
    assert [c.words for c in found] == ["10.00 same as 1.00", "26.00 same as 1.00"]
    # A roll at a pitch of 5 deg moves gravity by its cosine.
    assert found[0].apart_deg == pytest.approx(0.1 * np.cos(np.radians(5.0)), abs=1e-6)
    assert found[0].sd_deg == pytest.approx(np.degrees(np.sqrt(4) * 0.005 / G))
    assert "assumed" in found[0].caveat
    parse_reference(found[0].words, 0.0, 30.0)


def test_roll_and_pitch_may_be_said_without_a_heading(tmp_path):
    row = parse_reference("12.5 roll 1 pitch -2 sd 0.5", 0.0, 20.0)
    assert row == {"time": 12.5, "kind": "tilt", "roll": 1.0, "pitch": -2.0, "sd": 0.5}
    run, imu = run_of([1.0, -2.0, 123.0])
    (score,) = score_references(run, references_from_words(["12.5 roll 1 pitch 1"], 0, 20), imu)
    assert score.error_deg == pytest.approx(3.0, abs=1e-9)
    (tmp_path / "points.csv").write_text("time_s,kind,roll_deg,pitch_deg\n5,tilt,1,-2\n")
    assert read_reference_words(tmp_path / "points.csv") == ["5 roll 1 pitch -2"]
    (tmp_path / "points.txt").write_text("5 roll 1 pitch -2\n")
    assert read_reference_words(tmp_path / "points.txt") == ["5 roll 1 pitch -2"]


def test_a_rest_without_gravity_is_refused():
    zero = (0.0, 0.0, 0.0)
    with pytest.raises(DataError, check=coded("evaluation.rest-no-acceleration", quantity="accel")):
        tilt_sd_deg(RestStretch(0.0, 2.0, zero, zero, None))
    with pytest.raises(DataError, match=r"at rest it is 9.8"):
        tilt_sd_deg(RestStretch(0.0, 2.0, zero, zero, (0.0, 0.0, -1.0)))
    assert tilt_references([RestStretch(0.0, 2.0, zero, zero, None)]).empty

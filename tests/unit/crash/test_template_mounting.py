"""Roll and pitch of a mounting by gravity, and which way it faces by the blow: exact."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from strapdown import rotation
from strapdown.crash.template import TURNS, sitting_at_rest

G = 9.80665
UP = np.array([0.0, 0.0, -G])


def right_angles():
    """The 24 rotations that turn axes into axes, as vehicle from sensor."""
    for axes in itertools.permutations(range(3)):
        for signs in itertools.product((1.0, -1.0), repeat=3):
            C = np.zeros((3, 3))
            C[range(3), axes] = signs
            if np.linalg.det(C) > 0.0:
                yield C


def test_there_are_24():
    assert len(list(right_angles())) == 24


@pytest.mark.parametrize("C_vs", list(right_angles()))
def test_every_right_angle_is_found_but_for_its_heading(C_vs):
    sitting = sitting_at_rest(C_vs.T @ UP)
    assert sitting is not None
    assert sitting.lean_deg == pytest.approx(0.0, abs=1e-6)
    found = [rotation.dcm_from_euler((sitting.roll_deg, sitting.pitch_deg, h)) for h in TURNS]
    # One of the four headings is it; rounding of sines of right angles.
    assert sum(np.allclose(C, C_vs, atol=1e-12) for C in found) == 1


@pytest.mark.parametrize("angles", [(30.0, 25.0, 70.0), (-140.0, -40.0, 10.0), (0.0, 45.0, -100.0)])
def test_a_leaning_unit_is_told_by_its_angles(angles):
    C_vs = rotation.dcm_from_euler(angles)
    sitting = sitting_at_rest(C_vs.T @ UP)
    # Angles are written in tenths of a degree.
    assert (sitting.roll_deg, sitting.pitch_deg) == pytest.approx(angles[:2], abs=0.0501)
    assert sitting.along == ""


def test_a_small_lean_is_the_road():
    C_vs = rotation.dcm_from_euler((180.0 + 6.0, -5.0, 0.0))
    sitting = sitting_at_rest(C_vs.T @ UP)
    assert (sitting.roll_deg, sitting.pitch_deg, sitting.along) == (180.0, 0.0, "z")
    # The angle between the two verticals: cos 6° cos 5°.
    lean = np.degrees(np.arccos(np.cos(np.radians(6.0)) * np.cos(np.radians(5.0))))
    assert sitting.lean_deg == pytest.approx(lean, abs=1e-6)


@pytest.mark.parametrize("length", [0.0, 0.7 * G, 1.3 * G])
def test_what_is_not_gravity_tells_nothing(length):
    assert sitting_at_rest(np.array([0.0, 0.0, -length])) is None


def test_vectors_are_turned_into_vehicle_axes():
    C_vs = rotation.dcm_from_euler((180.0, 0.0, 90.0))
    v = np.array([[1.0, 2.0, 3.0]])
    sitting = sitting_at_rest(C_vs.T @ UP)
    np.testing.assert_allclose(sitting.into_vehicle(v @ C_vs, 90.0), v, atol=1e-12)

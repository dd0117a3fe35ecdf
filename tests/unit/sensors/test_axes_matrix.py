"""The matrix from sensor axes to body axes: what is let through, what is refused and why."""

from __future__ import annotations

import numpy as np
import pytest

from strapdown import rotation
from strapdown.errors import ConfigError
from strapdown.formats.columns import parse_axes
from strapdown.sensors.triad_errors import (
    NAMED_AXES,
    axes_letters,
    check_axes_matrix,
    report_transposed,
)

RNG = np.random.default_rng(11)
FLU = [[1, 0, 0], [0, -1, 0], [0, 0, -1]]


def turned(*angles):
    return rotation.dcm_from_euler(np.array(angles, dtype=float))


def test_any_rotation_is_let_through():
    for angles in RNG.uniform(-180, 180, (50, 3)) * [1, 0.5, 1]:
        m = turned(*angles)
        # An SVD of a rotation gives it back to a few roundings.
        assert check_axes_matrix(m) == pytest.approx(m, abs=1e-14)


def test_rounded_cosines_become_the_nearest_rotation():
    m = turned(1.0, -2.0, 30.0)
    # Four decimals are off by 5e-5 each; the nearest rotation is no farther than that in any
    # direction, three of them together by less than 1e-4.
    assert check_axes_matrix(np.round(m, 4)) == pytest.approx(m, abs=1e-4)
    made = check_axes_matrix(np.round(m, 4))
    # Two orthogonal factors, each so to some roundings of the linear algebra at hand, and two
    # products of three terms.
    assert made @ made.T == pytest.approx(np.eye(3), abs=16 * np.finfo(float).eps)


@pytest.mark.parametrize(
    ("matrix", "code", "data"),
    [
        ([[1, 0, 0], [0, 1, 0], [0, 0, -1]], "matrix-mirror-image", {"down": (0, 0, 1)}),
        ([[0, 1, 0], [1, 0, 0], [0, 0, 1]], "matrix-mirror-image", {"down": (0, 0, -1)}),
        (
            [[1, 0, 0], [0, 1, 0], [0, 0, 1.01]],
            "matrix-row-not-unit",
            {"row_number": 3, "row_name": "down", "length": pytest.approx(1.01)},
        ),
        (
            [[1, 0, 0], [np.sin(0.1), np.cos(0.1), 0], [0, 0, 1]],
            "matrix-rows-not-perpendicular",
            {"names": ("forward", "right"), "angle": pytest.approx(90.0 - np.degrees(0.1))},
        ),
        ([[1, 0, 0], [0, 1, 0]], "not-three-rows-three-finite", {}),
        ([[1, 0, 0], [0, 1, 0], [0, 0, float("nan")]], "not-three-rows-three-finite", {}),
        ("x,y,z", "not-three-rows-three-finite", {}),
        ([[1, 0], [0, 1, 0], [0, 0, 1]], "not-three-rows-three-finite", {}),
    ],
)
def test_what_is_no_rotation_is_refused(matrix, code, data):
    with pytest.raises(ConfigError) as error:
        check_axes_matrix(matrix)
    finding = error.value.finding
    assert finding.code == f"sensors.{code}" and finding.advice()
    assert {name: finding.data[name] for name in data} == data


def test_letters_and_the_turn_that_is_left():
    for _ in range(30):
        small = turned(*RNG.uniform(-15, 15, 3))
        letters = RNG.choice(["x,y,z", "y,x,-z", "-y,x,z", "z,-x,-y", "x,-y,-z"])
        axis, sign = parse_axes(letters)
        plain = np.eye(3)[axis] * np.array(sign)[:, None]
        found, turn = axes_letters(small @ plain)
        # 15° in three axes can add to 26° and stay nearest to where it began.
        assert found == letters
        assert turn == pytest.approx(small, abs=1e-14)


def test_the_design_that_the_paper_prints():
    """2 dq/dt = Π0 q with (1,4) = -Θz is q (0, M Θ) with the named matrix."""
    m = check_axes_matrix(NAMED_AXES["chernodarov-2009"])
    assert axes_letters(m)[0] == "-y,x,z"
    x, y, z = theta = RNG.normal(size=3)
    pi_0 = np.array([[0, y, -x, -z], [-y, 0, z, -x], [x, -z, 0, -y], [z, x, y, 0]])
    q = RNG.normal(size=4)
    w = m @ theta
    product = np.concatenate([[-q[1:] @ w], q[0] * w + np.cross(q[1:], w)])
    assert pi_0 @ q == pytest.approx(product, abs=1e-14)
    # As printed, (1,4) = +Θz: then the norm of q is not kept.
    pi_0[0, 3] = z
    assert abs(q @ pi_0 @ q) > 0.1


@pytest.mark.parametrize(
    ("words", "letters"),
    [
        ("right-forward-up", "y,x,-z"),
        ("forward-left-up", "x,-y,-z"),
        ("forward, right, down", "x,y,z"),
        ("Up Right Back", "-z,y,-x"),
    ],
)
def test_directions_in_words(words, letters):
    assert parse_axes(words) == parse_axes(letters)


def test_one_direction_twice_is_refused():
    with pytest.raises(ConfigError, match="twice"):
        parse_axes("right-left-up")


def test_a_transposed_matrix_is_told_by_gravity():
    m = turned(0, 0, 0) @ np.array([[0.0, 1, 0], [0, 0, 1], [1, 0, 0]])
    force = m.T @ [0, 0, -9.8]
    assert not report_transposed(m, m @ force, "log.csv")
    said = report_transposed(m.T, m.T @ force, "log.csv")
    assert "90° from level" in said[0].what
    # One that is its own transpose cannot be it.
    flu = np.array(FLU, dtype=float)
    assert not report_transposed(flu, flu @ [0, 0, -9.8], "log.csv")

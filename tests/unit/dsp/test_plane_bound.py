"""The ellipse of 95 % of an error in a plane: its longer half axis, and its reach."""

from __future__ import annotations

import math

import numpy as np
import pytest

from strapdown.dsp.chi_square import PLANE_95, plane_bound, plane_reach


def covariances(angles, long, short):
    c, s = np.cos(angles), np.sin(angles)
    turn = np.moveaxis(np.array([[c, -s], [s, c]]), 2, 0)
    return turn @ np.diag([long**2, short**2]) @ turn.transpose(0, 2, 1)


def test_the_share_within_is_95_percent():
    # Of a standard normal point of a plane the square of the distance is exponential, mean two.
    assert 1.0 - math.exp(-0.5 * PLANE_95**2) == pytest.approx(0.95, rel=1e-15)


def test_the_longer_half_axis_whatever_its_direction_and_whatever_else_is_in_the_matrix():
    whole = np.full((7, 9, 9), 1e3)
    whole[:, :2, :2] = covariances(np.linspace(0.0, 3.0, 7), 4.0, 0.5)
    # Sixteen digits, squared axes that differ by 64.
    np.testing.assert_allclose(plane_bound(whole), PLANE_95 * 4.0, rtol=1e-13)
    # What rounding made negative is known exactly.
    assert plane_bound(-1e-20 * np.eye(2)[None])[0] == 0.0


def test_the_reach_is_where_the_ray_leaves_the_ellipse():
    angles = np.linspace(0.0, 6.0, 13)
    P = np.repeat(covariances(np.array([0.4]), 4.0, 0.5), 13, axis=0)
    errors = 2.3 * np.column_stack([np.cos(angles), np.sin(angles)])
    weighed = np.linalg.solve(P, errors[:, :, None])[..., 0]
    size, distance = np.hypot(*errors.T), np.sqrt((errors * weighed).sum(axis=1))
    reach = plane_reach(size, distance, P)
    np.testing.assert_array_equal(size <= reach, distance <= PLANE_95)
    at = errors * (reach / size)[:, None]
    on = (at * np.linalg.solve(P, at[:, :, None])[..., 0]).sum(axis=1)
    # A condition of 64 costs two digits.
    np.testing.assert_allclose(on, PLANE_95**2, rtol=1e-12)


def test_no_error_has_no_direction():
    P = covariances(np.array([0.4]), 4.0, 0.5)
    assert plane_reach(np.zeros(1), np.zeros(1), P)[0] == plane_bound(P)[0]

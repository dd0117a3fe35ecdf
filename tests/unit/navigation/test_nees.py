"""Normalised squares are chi-square where the covariance is that of the errors."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import kstest

from strapdown.errors import DataError
from strapdown.navigation.truth_comparison import band_of_mean, bounds, normalised_squares


def test_squares_are_those_of_the_inverse_also_with_units_far_apart():
    rng = np.random.default_rng(0)
    A = rng.normal(size=(5, 4, 4)) * np.array([1e3, 1.0, 1e-5, 1e-9])[:, None]
    P = A @ np.swapaxes(A, 1, 2)
    y = rng.normal(size=(5, 4))
    e = np.einsum("nij,nj->ni", A, y)
    # Squares of 4 numbers; the condition of a drawn 4x4 is some thousands at most.
    assert normalised_squares(e, P) == pytest.approx((y**2).sum(axis=1), rel=1e-8)


def test_squares_of_drawn_errors_are_chi_square():
    rng = np.random.default_rng(1)
    A = rng.normal(size=(3, 3))
    e = rng.normal(size=(2000, 3)) @ A.T
    squares = normalised_squares(e, np.broadcast_to(A @ A.T, (2000, 3, 3)))
    # A sound one is refused once in a thousand times.
    assert kstest(squares, "chi2", args=(3,)).pvalue > 1e-3


def test_bounds_are_those_of_the_tables():
    # Abramowitz and Stegun, Table 26.8: 2.5 % and 97.5 % of 3 degrees of freedom.
    assert bounds(3) == pytest.approx((0.215795, 9.34840), rel=1e-5)
    low, high = band_of_mean(15, 100)
    # Normal in the limit: 15 with a standard deviation of sqrt(2 15 / 100).
    assert (low, high) == pytest.approx((15.0 - 1.0735, 15.0 + 1.0735), abs=0.03)


def test_what_is_no_covariance_is_named_by_its_row():
    P = np.stack([np.eye(2), np.diag([1.0, 0.0]), np.eye(2)])
    with pytest.raises(DataError, match="row 2"):
        normalised_squares(np.ones((3, 2)), P)
    P[1] = [[1.0, 2.0], [2.0, 1.0]]
    with pytest.raises(DataError, match="row 2"):
        normalised_squares(np.ones((3, 2)), P)

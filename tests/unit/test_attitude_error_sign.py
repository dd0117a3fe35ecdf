"""The sign of a small attitude error, here and in Tadic and Vukajlovic (2016), Eqs. (20), (21)."""

from __future__ import annotations

import numpy as np
import pytest

from strapdown import rotation
from strapdown.evaluation.trajectory_differences import ROTATION_ERROR, trajectory_differences
from strapdown.tables import trajectory_table

TRUE = [3.0, -4.0, 120.0]
PHI = np.array([0.01, -0.02, 0.03])  # rad


def first_order(phi):
    """Matrix (20) as it is printed."""
    n, e, d = phi
    return np.array([[1.0, -d, e], [d, 1.0, -n], [-e, n, 1.0]])


def difference(estimate):
    """phi_N, phi_E, phi_D in rad, as a comparison of trajectories has them."""
    tables = [
        trajectory_table([0.0], [[45.0, 20.0, 0.0]], np.zeros((1, 3)), [angles])
        for angles in (estimate, TRUE)
    ]
    return np.radians(trajectory_differences(*tables)[ROTATION_ERROR].to_numpy()[0])


@pytest.mark.parametrize("size", [1.0, 0.1, 0.01])
def test_20_is_the_exact_rotation_to_first_order(size):
    phi = size * PHI
    exact = rotation.dcm_from_rotation_vector(phi)
    off = np.linalg.norm(first_order(phi) - exact, 2)
    # [phi x]²/2, of which the largest singular value is |phi|²/2; the third order is smaller still.
    assert off == pytest.approx(0.5 * phi @ phi, rel=0.01)
    # With the other sign it would be off by all of twice phi.
    assert np.linalg.norm(first_order(-phi) - exact, 2) > 1.9 * np.linalg.norm(phi)


def test_21_mends_what_a_comparison_finds_wrong():
    true = rotation.dcm_from_euler(TRUE)
    estimate = rotation.dcm_from_rotation_vector(PHI) @ true
    found = difference(rotation.euler_from_dcm(estimate))
    # Angles of a table pass through degrees: rounding.
    np.testing.assert_allclose(found, PHI, atol=1e-14)
    mended = rotation.dcm_from_rotation_vector(-found) @ estimate
    np.testing.assert_allclose(mended, true, atol=1e-14)
    np.testing.assert_allclose(first_order(-found) @ estimate, true, atol=0.51 * float(PHI @ PHI))


def test_a_heading_that_is_too_large_is_positive_here_and_negative_in_20():
    found = difference([3.0, -4.0, 121.0])
    np.testing.assert_allclose(found, [0.0, 0.0, np.radians(1.0)], atol=1e-14)


def test_what_it_does_to_specific_force():
    up = np.array([0.0, 0.0, -9.8])
    error = rotation.dcm_from_rotation_vector(1e-6 * PHI) @ up - up
    # Second order, 9.8 (3.7e-8)²/2 = 7e-15, and rounding of 9.8.
    expected = 9.8e-6 * np.array([-PHI[1], PHI[0], 0.0])
    np.testing.assert_allclose(error, expected, rtol=0.0, atol=2e-14)

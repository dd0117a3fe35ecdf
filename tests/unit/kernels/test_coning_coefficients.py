"""The coefficients of rotation-vector updates, derived in whole numbers.

The rotation vector of a block is to second order ``1/2 int(alpha x omega)``. For a rate
``w0 + w1 t + w2 t^2 + ...`` both this and the products of increments are sums of
``wm x wn`` with rational factors, which must agree for every pair that a set of coefficients
promises to integrate exactly.
"""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from strapdown import rotation
from strapdown._kernels import rotation_vector as kernel
from strapdown._kernels.rotation import quat_multiply

COEFFICIENTS = {
    2: {(0, 1): Fraction(2, 3)},
    3: {(0, 2): Fraction(9, 20), (1, 2): Fraction(27, 40), (0, 1): Fraction(27, 40)},
    4: {
        (0, 1): Fraction(232, 315),
        (2, 3): Fraction(232, 315),
        (0, 2): Fraction(46, 105),
        (1, 3): Fraction(46, 105),
        (0, 3): Fraction(54, 105),
        (1, 2): Fraction(178, 315),
    },
}


def power(m, a, b):
    """Integral of t^m."""
    return (Fraction(b) ** (m + 1) - Fraction(a) ** (m + 1)) / (m + 1)


def exact(m, n, samples):
    """Factor of wm x wn in 1/2 int(alpha x omega) over a block about time zero."""
    low, high = -Fraction(samples, 2), Fraction(samples, 2)

    def one(m, n):
        return (power(m + 1 + n, low, high) - low ** (m + 1) * power(n, low, high)) / (m + 1)

    return (one(m, n) - one(n, m)) / 2


def by_products(m, n, samples):
    """Factor of wm x wn in the products of the increments."""
    low = -Fraction(samples, 2)

    def increment(power_of_t, k):
        return power(power_of_t, low + k, low + k + 1)

    return sum(
        k * (increment(m, i) * increment(n, j) - increment(n, i) * increment(m, j))
        for (i, j), k in COEFFICIENTS[samples].items()
    )


@pytest.mark.parametrize(
    ("samples", "pairs"),
    [(2, [(0, 1), (0, 2)]), (3, [(0, 1), (0, 2)]), (4, [(0, 1), (0, 2), (1, 2), (0, 3)])],
)
def test_they_integrate_rates_exactly(samples, pairs):
    for m, n in pairs:
        assert by_products(m, n, samples) == exact(m, n, samples)


def test_those_of_four_are_by_distance_the_best_for_coning():
    """Ignagni: what is a distance apart counts together on pure coning: 214, 92, 54 over 105."""
    by_distance = {1: Fraction(0), 2: Fraction(0), 3: Fraction(0)}
    for (i, j), k in COEFFICIENTS[4].items():
        by_distance[j - i] += k
    assert by_distance == {1: Fraction(214, 105), 2: Fraction(92, 105), 3: Fraction(54, 105)}


@pytest.mark.parametrize("samples", [2, 3, 4])
def test_the_kernel_has_these_coefficients(samples):
    theta = np.random.default_rng(3).normal(0.0, 0.1, (samples, 3))
    state = np.zeros(kernel.STATE)
    for k in range(samples):
        state[9 + 4 * k : 13 + 4 * k] = [0.01, *theta[k]]
    expected = theta.sum(axis=0)
    for (i, j), k in COEFFICIENTS[samples].items():
        expected = expected + float(k) * np.cross(theta[i], theta[j])
    # A dozen roundings of numbers below 0.3.
    assert np.allclose(kernel.miller_vector(state, samples), expected, rtol=0, atol=1e-15)


def polynomial_block(samples, length):
    """A block of unequal steps of one polynomial rate: the fit's vector, and the exact turn."""
    rng = np.random.default_rng(samples)
    ends = np.cumsum(rng.uniform(0.5, 1.5, samples))
    ends *= length / ends[-1]
    rates = [np.polynomial.Polynomial(rng.normal(0.0, 1.0, samples)) for _ in range(3)]
    turned = np.column_stack([r.integ()(np.append(0.0, ends)) for r in rates])
    state = np.zeros(kernel.STATE)
    for k, (dt, theta) in enumerate(
        zip(np.diff(np.append(0.0, ends)), np.diff(turned, axis=0), strict=True)
    ):
        state[9 + 4 * k : 13 + 4 * k] = [dt, *theta]

    def slope(t, q):
        return 0.5 * np.array(quat_multiply(*q, 0.0, *(r(t) for r in rates)))

    q = solve_ivp(slope, (0.0, length), [1.0, 0, 0, 0], "DOP853", rtol=1e-13, atol=1e-15).y[:, -1]
    return kernel.fitted_vector(state, samples), q / np.linalg.norm(q)


@pytest.mark.parametrize("samples", [2, 3, 4])
def test_the_fit_integrates_its_own_polynomial_to_the_sixth_order(samples):
    """A local error of the seventh power of the block, against scipy's DOP853."""
    errors = []
    for length in (0.4, 0.2):
        vector, exact = polynomial_block(samples, length)
        found = rotation.quaternion_from_rotation_vector(vector)
        errors.append(np.radians(rotation.rotation_angle(found, exact)))
    # The error at 0.2 s, some 1e-8 rad, is far above the reference's 1e-13; the next term is
    # 0.4 of the first at the longer block, so that the power of two blocks is 7 to 8.
    assert errors[1] < 1e-6
    assert 6.5 < np.log2(errors[0] / errors[1]) < 8.5

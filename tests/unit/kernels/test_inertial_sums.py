"""Sums in the body's first axes against plain numpy, and Legendre moments against exact ones."""

from __future__ import annotations

import numpy as np
import pytest

from strapdown import rotation
from strapdown._kernels.sums import inertial_sums, legendre_moments


def test_the_sums_are_those_of_plain_products():
    rng = np.random.default_rng(1)
    rows = rng.normal(0.0, 0.3, (57, 10))
    rows[:, 0] = rng.uniform(0.01, 0.2, 57)
    last = np.array([9, 10, 40, 56])
    turned, fallen = np.empty((58, 4)), np.empty((58, 3))
    velocity = np.empty((4, 3))
    times, turns, pushes = np.zeros((4, 3, 3)), np.zeros((4, 3, 3, 3)), np.zeros((4, 3, 3, 3))
    inertial_sums(rows, last, turned, fallen, velocity, times, turns, pushes)

    C, v, s, node = np.eye(3), np.zeros(3), np.zeros(3), 0
    sums = [np.zeros((4, 3, 3)), np.zeros((4, 3, 3, 3)), np.zeros((4, 3, 3, 3))]
    for k, (dt, *rest) in enumerate(rows):
        turn, dv, dr = np.split(np.array(rest), 3)
        s = s + v * dt + C @ dr
        v = v + C @ dv
        sums[0][node] += C * dt
        sums[1][node] += C[:, :, None] * turn
        sums[2][node] += C[:, :, None] * dv
        C = C @ rotation.dcm_from_rotation_vector(turn)
        assert np.allclose(fallen[k + 1], s, atol=1e-12)
        assert np.allclose(rotation.dcm_from_quaternion(turned[k + 1]), C, atol=1e-12)
        if k == last[node]:
            assert np.allclose(velocity[node], v, atol=1e-12)
            node += 1
    for found, wanted in zip((times, turns, pushes), sums, strict=True):
        assert np.allclose(found, wanted, atol=1e-12)


@pytest.mark.parametrize("even", [True, False])
def test_moments_give_back_the_polynomials(even):
    rng = np.random.default_rng(2)
    n = 20_001
    u = np.linspace(-1.0, 1.0, n)
    if not even:
        u[1:-1] += rng.uniform(-0.4, 0.4, n - 2) * (u[1] - u[0])
    coefficients = rng.normal(0.0, 1.0, (6, 2))
    values = np.polynomial.legendre.legvander(u, 5) @ coefficients
    out = np.empty((9, 2))
    legendre_moments(u, np.ascontiguousarray(values), out)
    # The trapezoidal rule leaves a twelfth of the square of the step times a derivative that
    # grows as the fourth power of the degree; (2 d + 1)/2 = 8.5 of the highest.
    bound = 8.5 * 13**4 / 12.0 * (1.9 / n * 2) ** 2
    assert np.abs(out[:6] - coefficients).max() < bound
    assert np.abs(out[6:]).max() < bound

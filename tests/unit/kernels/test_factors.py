"""Factors of semidefinite matrices of every rank and scale, and weighted Gram-Schmidt."""

import numpy as np
import pytest
from numba import njit

from strapdown._kernels.compilation import MODE, _fma_interpreted, fma
from strapdown._kernels.covariance import mwgs, semidefinite_factor, udu_factor, udu_matrix


def nearly_singular(rng):
    """A covariance of any rank: small directions, doubled rows, units far apart."""
    n = int(rng.integers(2, 16))
    rank = int(rng.integers(1, n + 1))
    B = rng.normal(size=(n, rank))
    for _ in range(int(rng.integers(0, 3))):
        B[:, rng.integers(rank)] *= 10.0 ** rng.uniform(-9, -5)
    if rng.random() < 0.4:
        B[rng.integers(n)] = B[0] * (1.0 + 10.0 ** rng.uniform(-9, -6) * rng.normal(size=rank))
    B *= 10.0 ** rng.uniform(-6, 6, (n, 1))
    P = B @ B.T
    return 0.5 * (P + P.T)


def test_factors_of_what_is_nearly_singular():
    """Without pivots 1 of 100 of these gave a D below minus its own variance."""
    rng = np.random.default_rng(0)
    for _ in range(3000):
        P = nearly_singular(rng)
        n = len(P)
        out, back = np.empty((n, n)), np.empty((n, n))
        assert udu_factor(P, out) == -1
        assert (np.diagonal(out) >= 0.0).all()
        udu_matrix(out, back)
        sd = np.sqrt(np.diagonal(P))
        # Gram-Schmidt loses in orthogonality what a row loses in length, here a factor of 1e5 to
        # 1e7 of a rounding (seen: 3e-11 in 40,000).
        assert np.abs((back - P) / sd / sd[:, None]).max() < 1e-9


def test_rank_is_found_and_diagonals_are_exact():
    rng = np.random.default_rng(1)
    for rank in range(7):
        B = rng.normal(size=(6, rank))
        G, d = np.empty((6, 6)), np.empty(6)
        assert semidefinite_factor(B @ B.T, G, d) == rank
        np.testing.assert_allclose(G * d @ G.T, B @ B.T, atol=1e-13)
    D = np.diag(10.0 ** rng.uniform(-15, 15, 6))
    D[2, 2] = 0.0
    out = np.empty((6, 6))
    assert udu_factor(D, out) == -1
    assert np.array_equal(out, D)


@pytest.mark.parametrize(
    ("P", "state"),
    [
        ([[1.0, 2.0], [2.0, 1.0]], 0),
        ([[1.0, 0.5], [0.5, 0.0]], 1),
        ([[1.0, 0.0], [0.0, -1e-300]], 1),
        ([[1.0, 0.0], [0.0, np.nan]], 1),
        ([[1.0, np.nan], [np.nan, 1.0]], 0),
        # Correlations of 0.9, -0.9 and 0.9 cannot be.
        ([[1.0, 0.9, -0.9], [0.9, 1.0, 0.9], [-0.9, 0.9, 1.0]], 2),
    ],
)
def test_what_is_not_semidefinite_is_told(P, state):
    assert udu_factor(np.array(P), np.empty((len(P), len(P)))) == state


def test_gram_schmidt_is_the_weighted_product():
    rng = np.random.default_rng(2)
    for n, size in ((1, 1), (3, 2), (5, 9), (15, 33)):
        W, d = rng.normal(size=(n, size)), rng.uniform(0.0, 2.0, size)
        d[0] = 0.0
        out, back = np.empty((n, n)), np.empty((n, n))
        mwgs(W.copy(), d, out)
        udu_matrix(out, back)
        np.testing.assert_allclose(back, W * d @ W.T, atol=1e-12)
        assert (np.diagonal(out) >= 0.0).all()


@pytest.mark.skipif(MODE != "numba", reason="numba compiles nothing")
def test_a_product_and_a_sum_are_rounded_once_interpreted_too():
    """To the bit as compiled, where a product cancels, overflows or is not a number, too."""
    rng = np.random.default_rng(3)
    compiled = njit(lambda a, b, c: fma(a, b, c))
    a, b = rng.normal(size=(2, 500)) * 10.0 ** rng.uniform(-8, 8, (2, 500))
    for x, y in zip(a, b, strict=True):
        for z in (-x * y, y, 0.0):
            assert _fma_interpreted(x, y, z) == compiled(x, y, z)
    assert _fma_interpreted(1e200, 1e200, 0.0) == compiled(1e200, 1e200, 0.0) == np.inf
    assert np.isnan(_fma_interpreted(np.nan, 1.0, 0.0))

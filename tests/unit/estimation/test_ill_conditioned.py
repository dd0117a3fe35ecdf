"""Observations much better than what is known: where the plain form fails, and factors do not.

Truth is the same update in 80 digits.
"""

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from strapdown.estimation.covariance import COVARIANCES

DIGITS = 80


def bierman(eps):
    """Bierman 1977, Chapter V: two states, one of them hardly seen; eps^2 is lost beside 1."""
    return np.eye(2) / eps**2, np.array([[1.0, eps], [1.0, 1.0]]), np.ones(2)


def nearly_the_same(eps):
    """Two accurate observations that differ by eps in one state."""
    return np.eye(3), np.array([[1.0, 1.0, 1.0], [1.0, 1.0, 1.0 + eps]]), np.full(2, eps**2)


def exact(P, H, R):
    with mpmath.workdps(DIGITS):
        P = mpmath.matrix(P.tolist())
        for h, r in zip(H.tolist(), R.tolist(), strict=True):
            g = P * mpmath.matrix(h)
            s = (mpmath.matrix([h]) * g)[0] + mpmath.mpf(r)
            P = P - g * g.T / s
        return P


def updated(name, P, H, R):
    form = COVARIANCES[name]()
    state, _, _ = form.update(form.begin(P), np.zeros(len(P)), np.zeros(len(R)), H, R)
    return form, state


def error(P, truth):
    """Largest error in standard deviations of its row and column."""
    with mpmath.workdps(DIGITS):
        sd = [mpmath.sqrt(truth[i, i]) for i in range(len(P))]
        return float(
            max(
                abs((mpmath.mpf(float(P[i, j])) - truth[i, j]) / sd[i] / sd[j])
                for i in range(len(P))
                for j in range(len(P))
            )
        )


def smallest(state):
    """Smallest eigenvalue of U D U' without rounding."""
    with mpmath.workdps(DIGITS):
        U = mpmath.matrix((np.triu(state, 1) + np.eye(len(state))).tolist())
        D = mpmath.diag(np.diagonal(state).tolist())
        return min(mpmath.eigsy(U * D * U.T, eigvals_only=True))


@pytest.mark.parametrize("eps", [1e-6, 1e-8, 1e-9, 1e-10, 1e-12])
@pytest.mark.parametrize("problem", [bierman, nearly_the_same])
def test_factors_stay_positive_and_right(problem, eps):
    P, H, R = problem(eps)
    truth = exact(P, H, R)
    for name in ("ud", "wd"):
        form, state = updated(name, P, H, R)
        assert (np.diagonal(state) > 0.0).all()
        assert smallest(state) > 0
        # Bierman's update keeps all that the data have. 1 - K h loses what cancels: eps 2^-52 of a
        # gain, of a prior with the standard deviation 1 / eps; seen are 6e-9 for 1e-12.
        assert error(form.matrix(state), truth) < (1e-8 if name == "ud" else 1e-7)
    # D tells of the smallest eigenvalues, which P itself cannot hold.
    form, state = updated("ud", *bierman(eps))
    with mpmath.workdps(DIGITS):
        product = mpmath.fprod(mpmath.mpf(float(d)) for d in np.diagonal(state))
        assert abs(product / mpmath.det(exact(*bierman(eps))) - 1) < 1e-12


def test_the_plain_form_fails_where_they_do_not():
    P, H, R = bierman(1e-12)
    truth = exact(P, H, R)
    form, state = updated("plain", P, H, R)
    assert form.matrix(state).diagonal().min() < 0.0
    for name in ("joseph", "ud", "wd"):
        form, state = updated(name, P, H, R)
        assert form.matrix(state).diagonal().min() > 0.0
        assert error(form.matrix(state), truth) < 1e-3
    # Positive and wrong is worse, for it is not seen: 130 times the variance that it should be.
    P, H, R = bierman(1e-9)
    form, state = updated("plain", P, H, R)
    assert error(form.matrix(state), exact(P, H, R)) > 100.0


def test_a_matrix_of_its_own_has_half_of_the_digits():
    """Joseph's P is off by a fifth, and no covariance, where U-D has ten digits."""
    P, H, R = nearly_the_same(1e-10)
    truth = exact(P, H, R)
    form, state = updated("joseph", P, H, R)
    assert error(form.matrix(state), truth) > 0.1
    assert np.linalg.eigvalsh(form.matrix(state))[0] < -1e-15
    form, state = updated("ud", P, H, R)
    assert error(form.matrix(state), truth) < 1e-9


@pytest.mark.parametrize("name", ["joseph", "ud", "wd"])
def test_variances_stay_positive_over_a_long_run(name):
    """A day of observations a million times better than the prior, with hardly any noise."""
    form = COVARIANCES[name]()
    state, x = form.begin(np.diag([1e12, 1e6, 1.0, 1e-6])), np.zeros(4)
    Phi = np.eye(4) + np.diag([1.0, 1.0, 1.0], 1)
    Q = np.diag([0.0, 0.0, 1e-14, 1e-16])
    H, R = np.array([[1.0, 0.0, 0.0, 0.0], [1.0, 1e-7, 0.0, 0.0]]), np.full(2, 1e-6)
    for _ in range(4000):
        state, x, _ = form.epoch(state, Phi, Q, x, np.zeros(2), H, R)
        P = form.matrix(state)
        assert (np.diagonal(P) > 0.0).all()
        if name != "joseph":
            assert (np.diagonal(state) > 0.0).all()


@settings(deadline=None, max_examples=60)
@given(seed=st.integers(0, 2**32 - 1), n=st.integers(1, 10), apart=st.floats(0.0, 9.0))
@pytest.mark.parametrize("name", ["ud", "wd"])
def test_d_is_never_negative_whatever_the_units(name, seed, n, apart):
    """States, noises and observations up to 10^9 and 10^-9 of each other, of any rank."""
    rng, form = np.random.default_rng(seed), COVARIANCES[name]()

    def size(*shape):
        return 10.0 ** rng.uniform(-apart, apart, shape)

    B = rng.normal(size=(n, rng.integers(1, n + 1))) * size(n, 1)
    P = B @ B.T
    state, x = form.begin(0.5 * (P + P.T)), np.zeros(n)
    for _ in range(6):
        G = rng.normal(size=(n, rng.integers(0, 3))) * size(n, 1)
        Phi = np.eye(n) + np.triu(rng.normal(size=(n, n)), 1)
        H, R = rng.normal(size=(3, n)) * size(3, n), size(3) ** 2
        state, x, told = form.epoch(state, Phi, G @ G.T, x, rng.normal(size=3), H, R)
        assert (np.diagonal(state) >= 0.0).all()
        assert np.isfinite(state).all()
        assert np.isfinite(x).all()
        assert (told.s > 0.0).all()

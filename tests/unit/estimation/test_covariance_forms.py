"""All forms of a covariance are one filter; each refuses what no covariance can be."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.coded import coded

from strapdown.errors import ConfigError, DataError
from strapdown.estimation.covariance import COVARIANCES, Step

FORMS = sorted(COVARIANCES)


def covariance(rng, n, spread=1.0):
    A = rng.normal(size=(n, n)) * 10 ** rng.uniform(-spread, spread, (n, 1))
    return A @ A.T + np.diag(np.diagonal(A @ A.T)) * 0.1


def epochs(seed, n=15, count=12, observations=3, rank=4):
    """Transition, noise, observations of a well-conditioned filter."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        G = rng.normal(size=(n, rank))
        yield (
            np.eye(n) + 0.1 * rng.normal(size=(n, n)),
            0.1 * G @ G.T,
            rng.normal(size=observations),
            rng.normal(size=(observations, n)),
            rng.uniform(0.5, 2.0, observations),
        )


def dense(P, x, Phi, Q, z, H, R):
    """All observations of an epoch at once."""
    P = Phi @ P @ Phi.T + Q
    S = H @ P @ H.T + np.diag(R)
    K = np.linalg.solve(S, H @ P).T
    A = np.eye(len(x)) - K @ H
    return A @ P @ A.T + K @ np.diag(R) @ K.T, x + K @ (z - H @ x)


@pytest.mark.parametrize("name", FORMS)
def test_each_is_the_dense_filter_of_fifteen_states(name):
    form = COVARIANCES[name]()
    P = covariance(np.random.default_rng(7), 15)
    state, x, expected = form.begin(P), np.zeros(15), np.zeros(15)
    for Phi, Q, z, H, R in epochs(8):
        state = form.predict(state, Phi, Q)
        state, x, told = form.update(state, x, z, H, R)
        P, expected = dense(P, expected, Phi, Q, z, H, R)
        sd = np.sqrt(np.diagonal(P))
        # In standard deviations: the condition of these P is below 1e5, times 2^-53 a rounding.
        assert np.abs((form.matrix(state) - P) / sd / sd[:, None]).max() < 1e-9
        assert np.abs((x - expected) / sd).max() < 1e-9
        assert np.array_equal(form.matrix(state), form.matrix(state).T)
        np.testing.assert_allclose(form.sd(state), sd, rtol=1e-9)
        assert (told.weight == 1.0).all()


@settings(deadline=None, max_examples=40)
@given(
    seed=st.integers(0, 2**32 - 1),
    n=st.integers(1, 17),
    observations=st.integers(0, 4),
    rank=st.integers(0, 5),
)
def test_forms_agree_whatever_the_sizes(seed, n, observations, rank):
    P = covariance(np.random.default_rng(seed), n, spread=2.0)
    forms = [COVARIANCES[name]() for name in FORMS]
    states, x = [form.begin(P) for form in forms], [np.zeros(n)] * len(forms)
    for Phi, Q, z, H, R in epochs(seed, n, 4, observations, rank):
        done = [f.epoch(s, Phi, Q, e, z, H, R) for f, s, e in zip(forms, states, x, strict=True)]
        states, x = [d[0] for d in done], [d[1] for d in done]
        sd = forms[0].sd(states[0])
        for form, (state, estimate, told) in zip(forms, done, strict=True):
            assert np.abs((form.matrix(state) - forms[0].matrix(states[0])) / sd).max() < 1e-9 * (
                1 + sd.max()
            )
            assert np.abs((estimate - x[0]) / sd).max() < 1e-9
            np.testing.assert_allclose(told.nu, done[0][2].nu, rtol=1e-9, atol=1e-9)
            np.testing.assert_allclose(told.s, done[0][2].s, rtol=1e-9)


@pytest.mark.parametrize("name", FORMS)
def test_an_epoch_is_a_prediction_and_an_update(name):
    form = COVARIANCES[name]()
    first = form.begin(covariance(np.random.default_rng(1), 6))
    Phi, Q, z, H, R = next(epochs(2, n=6))
    together = form.epoch(first, Phi, Q, np.ones(6), z, H, R)
    apart = form.update(form.predict(first, Phi, Q), np.ones(6), z, H, R)
    np.testing.assert_allclose(form.matrix(together[0]), form.matrix(apart[0]), rtol=1e-11)
    np.testing.assert_allclose(together[1], apart[1], rtol=1e-11)


class Given:
    """A rule that says what it was told to say."""

    def __init__(self, *steps):
        self.steps = itertools.cycle(steps)

    def step(self, nu, s, r):
        return next(self.steps)


@pytest.mark.parametrize("name", FORMS)
@pytest.mark.parametrize("slope", [1.0, 0.3, 0.0, -0.004])
def test_a_step_is_what_its_definition_says(name, slope):
    form, rng = COVARIANCES[name](), np.random.default_rng(3)
    P = covariance(rng, 5, 0.3)
    h, x, moved, r = rng.normal(size=(1, 5)), rng.normal(size=5), 2.5, 1.7
    rule = Given(Step(moved, slope, r, 0.5))
    state, after, told = form.update(form.begin(P), x, np.ones(1), h, np.ones(1), rule)
    s = (h @ P @ h.T).item()
    K = P @ h[0] / (slope * s + r)
    A = np.eye(5) - slope * np.outer(K, h[0])
    expected = A @ P @ A.T + slope * r * np.outer(K, K)
    assert np.abs(form.matrix(state) - expected).max() < 1e-12 * np.abs(expected).max()
    np.testing.assert_allclose(after, x + K * moved, rtol=1e-12)
    assert told.nu[0] == pytest.approx(1.0 - h[0] @ x, rel=1e-12)
    assert told.s[0] == pytest.approx(s + 1.0, rel=1e-12)
    assert told.weight[0] == 0.5


@pytest.mark.parametrize("name", FORMS)
def test_a_rule_for_each_observation_and_no_weight_changes_nothing(name):
    form = COVARIANCES[name]()
    P = covariance(np.random.default_rng(4), 4)
    _, _, z, H, R = next(epochs(5, n=4))
    full = [Step(float(v), 1.0, float(r), 1.0) for v, r in zip(z, R, strict=True)]
    nothing = Given(Step(1e9, 1.0, 1e-9, 0.0))
    state, x, told = form.update(form.begin(P), np.zeros(4), z, H, R, [nothing] * 3)
    np.testing.assert_allclose(form.matrix(state), P, rtol=1e-12)
    assert not x.any()
    assert not told.weight.any()
    one = form.update(form.begin(P), np.zeros(4), z, H, R, [nothing, Given(full[1]), nothing])
    alone = form.update(form.begin(P), np.zeros(4), z[1:2], H[1:2], R[1:2])
    np.testing.assert_allclose(form.matrix(one[0]), form.matrix(alone[0]), rtol=1e-12)
    with pytest.raises(
        ConfigError,
        check=coded("estimation.rules-observations", quantity="rule", count=2, count_2=3),
    ):
        form.update(form.begin(P), np.zeros(4), z, H, R, [nothing] * 2)


@pytest.mark.parametrize("name", FORMS)
def test_what_is_known_stays_known_and_nothing_given_is_changed(name):
    """A null direction of the 17 states is a row of zeros: it must stay one, exactly."""
    form, n, known = COVARIANCES[name](), 8, [0, 3, 7]
    P = covariance(np.random.default_rng(6), n)
    P[known] = P[:, known] = 0.0
    state, x = form.begin(P), np.zeros(n)
    for Phi, Q, z, H, R in epochs(9, n=n, count=50):
        for matrix in (Phi, Q):
            matrix[known] = matrix[:, known] = 0.0
        Phi[known, known] = 1.0
        before = [a.copy() for a in (state, x, Phi, Q, z, H, R)]
        state, x, _ = form.epoch(state, Phi, Q, x, z, H, R)
        for kept, given_ in zip(before[2:], (Phi, Q, z, H, R), strict=True):
            assert np.array_equal(kept, given_)
        P = form.matrix(state)
        assert not P[known].any()
        assert not P[:, known].any()
        assert not x[known].any()
        assert (np.diagonal(P) >= 0.0).all()


@pytest.mark.parametrize("name", FORMS)
def test_an_exact_observation_of_something_and_of_nothing(name):
    form = COVARIANCES[name]()
    h = np.array([[1.0, 1.0, 0.0], [1.0, 1.0, 0.0]])
    state, x, _ = form.update(
        form.begin(np.diag([1.0, 3.0, 2.0])), np.zeros(3), np.array([2.0, 2.0]), h, np.zeros(2)
    )
    np.testing.assert_allclose(x, [0.5, 1.5, 0.0], atol=1e-14)
    exact = [[0.75, -0.75, 0.0], [-0.75, 0.75, 0.0], [0.0, 0.0, 2.0]]
    np.testing.assert_allclose(form.matrix(state), exact, atol=1e-14)


@pytest.mark.parametrize("name", ["ud", "wd"])
def test_factors_of_any_rank_have_no_negative_d(name):
    form, rng = COVARIANCES[name](), np.random.default_rng(10)
    for rank in range(8):
        B = rng.normal(size=(7, rank)) * 10 ** rng.uniform(-6, 6, (7, 1))
        P = B @ B.T
        state = form.begin(P)
        assert (np.diagonal(state) >= 0.0).all()
        assert not np.tril(state, -1).any()
        sd = np.sqrt(np.diagonal(P)) + 1e-300
        assert np.abs((form.matrix(state) - P) / sd / sd[:, None]).max(initial=0) < 1e-11
        predicted = form.predict(state, np.eye(7), P)
        assert (np.diagonal(predicted) >= 0.0).all()
        assert np.abs((form.matrix(predicted) - 2 * P) / sd / sd[:, None]).max(initial=0) < 1e-11


@pytest.mark.parametrize("name", FORMS)
@pytest.mark.parametrize(
    ("P", "what"),
    [
        (np.zeros((2, 3)), r"shape \(2, 3\)"),
        (np.array([[1.0, np.nan], [0.0, 1.0]]), "nan in row 1, column 2"),
        (np.diag([1.0, -2.0]), "the covariance has a negative variance"),
        (
            np.array([[0.0, 1.0], [1.0, 1.0]]),
            "of the covariance has zero variance and a nonzero covariance with anot",
        ),
        (np.array([[1.0, 0.1], [0.2, 1.0]]), "not symmetric"),
        (np.array([[1.0, 2.0], [2.0, 1.0]]), "negative eigenvalue: -1"),
    ],
)
def test_what_is_no_covariance_is_refused(name, P, what):
    with pytest.raises(DataError, match=what) as told:
        COVARIANCES[name]().begin(P)
    assert told.value.finding.remedy


@pytest.mark.parametrize("name", ["joseph", "ud", "wd"])
def test_bad_predictions_and_observations_are_named(name):
    form, one, x = COVARIANCES[name](), np.eye(2), np.zeros(2)
    state, h = form.begin(one), np.ones((1, 2))
    with pytest.raises(DataError, check=coded("estimation.shape-covariance", quantity="Q")):
        form.predict(state, one, np.eye(3))
    with pytest.raises(DataError, match="Phi is nan in row 2, column 1"):
        form.predict(state, np.array([[1.0, 0.0], [np.nan, 1.0]]), one)
    with pytest.raises(
        DataError,
        check=lambda refused: (
            refused.finding.code == "estimation.predicted-variance-state-no-variance"
        ),
    ):
        form.predict(state, one, np.diag([0.0, -2.0]))
    with pytest.raises(DataError, match="H"):
        form.update(state, x, np.ones(2), h, np.ones(1))
    for rule in (None, Given(Step(1.0, 1.0, 1.0, 1.0))):
        with pytest.raises(
            DataError,
            check=lambda refused: refused.finding.code == "estimation.variance-observation",
        ):
            form.update(state, x, np.ones(1), h, -np.ones(1), rule)
        with pytest.raises(
            DataError, check=lambda refused: refused.finding.code == "estimation.observation"
        ):
            form.update(state, x, np.full(1, np.nan), h, np.ones(1), rule)


@pytest.mark.parametrize("name", ["ud", "wd"])
def test_noise_that_is_not_semidefinite_is_found_by_the_factors(name):
    form = COVARIANCES[name]()
    with pytest.raises(DataError, check=coded("estimation.predicted-variance-state-no-variance")):
        form.predict(form.begin(np.eye(2)), np.eye(2), np.array([[1.0, 2.0], [2.0, 1.0]]))
    with pytest.raises(DataError, match="state 2"):
        form.predict(form.begin(np.eye(2)), np.eye(2), np.array([[1.0, 0.5], [0.5, 0.0]]))

"""The robust update: outages, gross errors, and what the printed single step does instead."""

import math

import numpy as np
import pytest
from tests.coded import coded

from strapdown.errors import ConfigError
from strapdown.estimation.covariance import COVARIANCES, BiermanThornton
from strapdown.estimation.robust import (
    INFLUENCES,
    UPDATE_RULES,
    Huber,
    PaperUpdate,
    RobustUpdate,
    Tukey,
)

ALL = sorted(INFLUENCES)
ROBUST = [name for name in ALL if name != "none"]
POSITION = np.array([[1.0, 0.0]])
ONE = np.ones(1)


def velocity_model(q, dt=1.0):
    Phi = np.array([[1.0, dt], [0.0, 1.0]])
    return Phi, q * np.array([[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]])


def errors(rule, seed, gross=0.0, steps=400, q=1e-4, outage=None, form=None):
    """Position errors and variances; positions with noise of 1, a tenth of them off by `gross`."""
    form = form or BiermanThornton()
    rng = np.random.default_rng(seed)
    Phi, Q = velocity_model(q)
    drive = rng.normal(size=(steps, 2)) @ np.linalg.cholesky(Q).T
    noise, sign = rng.normal(size=steps), rng.choice([-1.0, 1.0], steps)
    noise += np.where(rng.random(steps) < 0.1, gross * sign, 0.0)
    truth, x, state = np.zeros(2), np.zeros(2), form.begin(np.eye(2))
    out = []
    for k in range(steps):
        truth, x = Phi @ truth + drive[k], Phi @ x
        state = form.predict(state, Phi, Q)
        if outage is None or k not in outage:
            z = truth[:1] + noise[k]
            state, x, _ = form.update(state, x, z, POSITION, ONE, rule)
        if form.name != "joseph":
            assert (np.diagonal(state) >= 0.0).all()
        out.append((x[0] - truth[0], form.matrix(state)[0, 0]))
    return np.array(out)


def rms(e):
    return math.sqrt(np.mean(np.square(e[20:, 0])))


# --- gross errors ------------------------------------------------------------------------


@pytest.mark.parametrize("name", ROBUST)
def test_a_tenth_of_gross_errors_costs_a_fifth_of_accuracy_at_most(name):
    rule = RobustUpdate(INFLUENCES[name]())
    clean = np.mean([rms(errors(None, seed)) for seed in range(8)])
    spoiled = np.mean([rms(errors(rule, seed, gross=50.0)) for seed in range(8)])
    plain = np.mean([rms(errors(RobustUpdate(INFLUENCES["none"]()), s, 50.0)) for s in range(3)])
    assert spoiled < 1.2 * clean
    assert plain > 5.0 * clean


@pytest.mark.parametrize("name", ROBUST)
def test_without_gross_errors_it_costs_little(name):
    """95 % efficiency is 2.6 % of a standard deviation, of an observation."""
    rule = RobustUpdate(INFLUENCES[name]())
    clean = np.mean([rms(errors(None, seed)) for seed in range(8)])
    assert np.mean([rms(errors(rule, seed)) for seed in range(8)]) < 1.06 * clean


# --- outages -----------------------------------------------------------------------------


@pytest.mark.parametrize("form", ["joseph", "ud", "wd"])
@pytest.mark.parametrize("name", ALL)
def test_the_first_observation_after_an_outage_is_absorbed(name, form):
    """One dimension: the prediction has drifted by 1.5 of its standard deviations, 1500 of ours."""
    form = COVARIANCES[form]()
    state, x = form.begin(np.array([[1e6]])), np.array([1500.0])
    rule, h = RobustUpdate(INFLUENCES[name]()), np.ones((1, 1))
    first = None
    for k in range(1, 21):
        state, x, told = form.update(state, x, np.zeros(1), h, ONE, rule)
        first = told.nu[0] if first is None else first
        # The exact posterior of k observations of zero; a weight of 0.995 is the most that is lost.
        assert form.matrix(state)[0, 0] == pytest.approx(1.0 / (1e-6 + k), rel=5e-3)
        assert x[0] == pytest.approx(1500.0 / (1.0 + 1e6 * k), rel=5e-3)
        assert told.weight[0] > 0.995
    assert first == -1500.0


@pytest.mark.parametrize("name", ALL)
@pytest.mark.parametrize("seed", range(3))
def test_an_outage_in_a_run_leaves_no_oscillation(name, seed):
    """Constant velocity, 200 s without positions: the error must be that of a plain filter."""
    rule = RobustUpdate(INFLUENCES[name]())
    gap = range(100, 300)
    e = errors(rule, seed, outage=gap)
    plain = errors(None, seed, outage=gap)
    before, after = e[299], e[300]
    assert before[1] > 100.0  # ten standard deviations of a position
    assert after[1] < 1.05
    # From the first position on what is left is noise of positions, and less and less of it.
    late = slice(300, 400)
    assert np.abs(e[late, 0] / np.sqrt(e[late, 1])).max() < 4.5
    assert np.abs(e[late, 0] - plain[late, 0]).max() < 1.2
    turns = np.count_nonzero(np.diff(np.sign(e[300:330, 0])))
    assert turns <= np.count_nonzero(np.diff(np.sign(plain[300:330, 0]))) + 4


# --- the printed step --------------------------------------------------------------------


def test_the_printed_step_overshoots_thirteen_times():
    """theory: s = 100, alpha = 1, nu = 10 is an innovation of one standard deviation."""
    x, state = {}, {}
    form = COVARIANCES["ud"]()
    for name, rule in UPDATE_RULES.items():
        state[name], x[name], _ = form.update(
            form.begin(np.array([[100.0]])),
            np.zeros(1),
            np.array([10.0]),
            np.ones((1, 1)),
            ONE,
            rule(Huber()),
        )
    assert x["paper"][0] == pytest.approx(134.5, rel=1e-12)
    assert state["paper"][0, 0] == 100.0
    assert x["robust"][0] == pytest.approx(1000.0 / 101.0, rel=1e-12)
    assert x["robust"][0] == pytest.approx(9.90, abs=5e-3)
    # It is the minimiser of what both are to minimise.
    grid = np.linspace(-50.0, 200.0, 250_001)
    values = grid**2 / 200.0 + np.vectorize(Huber().rho)(10.0 - grid)
    assert grid[np.argmin(values)] == pytest.approx(x["robust"][0], abs=1e-3)


@pytest.mark.parametrize("name", ["joseph", "ud", "wd"])
def test_the_printed_step_oscillates_for_ever_after_an_outage(name):
    """Observations of a constant, without any noise; it never comes nearer, nor knows more."""
    form, rule = COVARIANCES[name](), PaperUpdate(Huber())
    state, x = form.begin(np.array([[1e4]])), np.array([300.0])
    seen = []
    for _ in range(200):
        state, x, _ = form.update(state, x, np.zeros(1), np.ones((1, 1)), ONE, rule)
        seen.append(x[0])
    # psi' = 0: the gain is s / alpha^2 and the step 1e4 x 1.345, whatever the innovation is.
    np.testing.assert_allclose(np.abs(np.diff(seen)), 13450.0)
    assert (np.sign(seen[1:]) == -np.sign(seen[:-1])).all()
    assert form.matrix(state)[0, 0] == pytest.approx(1e4, rel=1e-12)


def test_the_printed_step_makes_a_variance_negative_where_psi_comes_down():
    """Tukey at 3 alpha: psi' = (1 - t)(1 - 5 t) with t = (3 / 4.685)^2."""
    t = (3.0 / 4.685) ** 2
    slope = (1.0 - t) * (1.0 - 5.0 * t)
    assert slope < 0.0
    for name in ("joseph", "ud", "wd"):
        form = COVARIANCES[name]()
        state, _, told = form.update(
            form.begin(np.array([[100.0]])),
            np.zeros(1),
            np.array([3.0]),
            np.ones((1, 1)),
            ONE,
            PaperUpdate(Tukey()),
        )
        expected = 100.0 - slope * 1e4 / (slope * 100.0 + 1.0)
        assert expected < 0.0
        assert form.matrix(state)[0, 0] == pytest.approx(expected, rel=1e-9)
        assert told.weight[0] == pytest.approx((1.0 - t) ** 2)
    # The default never does: here the observation has all its weight but a millionth.
    for name in ROBUST:
        for nu in np.linspace(0.0, 40.0, 401):
            step = RobustUpdate(INFLUENCES[name]()).step(float(nu), 100.0, 1.0)
            assert step.slope == 1.0
            assert step.r > 0.0


@pytest.mark.parametrize("name", ["joseph", "ud", "wd"])
def test_the_step_is_newtons_and_w_is_deflated(name):
    """(12)-(14) against the Newton step of the whole function, with dense matrices.

    As printed, (14) would leave W as it was, and the covariance would grow by an observation.
    """
    rng = np.random.default_rng(11)
    A = rng.normal(size=(6, 6))
    P, m, h = A @ A.T, rng.normal(size=6), rng.normal(size=6)
    alpha, influence = 1.3, Tukey(9.0)
    z = h @ m + 2.0 * alpha
    beta = (z - h @ m) / alpha
    hessian = np.linalg.inv(P) + influence.psi_prime(beta) * np.outer(h, h) / alpha**2
    newton = m + np.linalg.solve(hessian, h * influence.psi(beta) / alpha)
    form = COVARIANCES[name]()
    state, x, _ = form.update(
        form.begin(P), m, np.array([z]), h[None], np.array([alpha**2]), PaperUpdate(influence)
    )
    # Inverting P, with a condition of 342, costs 342 roundings: 4e-14 (seen: 3e-15 and 7e-15).
    np.testing.assert_allclose(x, newton, rtol=0.0, atol=1e-12)
    covariance = np.linalg.inv(hessian)
    scale = np.abs(covariance).max()
    assert np.abs(form.matrix(state) - covariance).max() < 4e-14 * scale
    K = P @ h / (h @ P @ h * influence.psi_prime(beta) + alpha**2)
    printed = P + alpha**2 * influence.psi_prime(beta) * np.outer(K, K)
    assert np.trace(printed) > np.trace(P) > 1.05 * np.trace(form.matrix(state))


# --- the rule ----------------------------------------------------------------------------


def test_scale_multiplies_the_standard_deviation():
    for rule in (RobustUpdate, PaperUpdate):
        one, three = rule(Huber()), rule(Huber(), scale=3.0)
        assert three.step(30.0, 9.0, 1.0).weight == pytest.approx(one.step(10.0, 1.0, 1.0).weight)
        with pytest.raises(
            ConfigError, check=coded("estimation.scale-update", quantity="scale", scale=0)
        ):
            rule(Huber(), scale=0)


@pytest.mark.parametrize("name", ALL)
def test_what_is_impossible_weighs_nothing_or_next_to_nothing(name):
    step = RobustUpdate(INFLUENCES[name]()).step(1e12, 1.0, 1.0)
    assert step.weight == (1.0 if name == "none" else pytest.approx(0.0, abs=1e-11))
    assert math.isfinite(step.r)


def test_names_are_those_of_the_table():
    assert [rule.name for rule in UPDATE_RULES.values()] == list(UPDATE_RULES)
    assert [form.name for form in COVARIANCES.values()] == list(COVARIANCES)

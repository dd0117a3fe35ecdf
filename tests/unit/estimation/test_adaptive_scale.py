"""A scale learnt from innovations: it converges, keeps through outages, and lets go again."""

import json
import math

import numpy as np
import pytest

from strapdown.errors import ConfigError
from strapdown.estimation.covariance import Joseph
from strapdown.estimation.robust import (
    INFLUENCES,
    AdaptiveRule,
    AdaptiveScale,
    Huber,
    RobustUpdate,
    ScaleState,
    Tukey,
    linear_range,
)

H, ONE = np.ones((1, 1)), np.ones(1)


def run(options, influence, noise, q=0.01, x=0.0, P=1.0, state=None, keep=None):
    """A random walk that stands still, observed with `noise` and a stated variance of one."""
    form = Joseph()
    state = options.begin() if state is None else state
    P, x, factors, weights = np.array([[P]]), np.array([x]), [], []
    for k, value in enumerate(noise):
        P = form.predict(P, np.eye(1), np.array([[q]]))
        rule = options.rule(state, influence)
        P, x, told = form.update(P, x, np.array([value]), H, ONE, rule)
        state = options.after(state, told.nu[0], told.s[0] - 1.0, 1.0, told.weight[0])
        factors.append(state.factor)
        weights.append(told.weight[0])
        if keep is not None:
            keep.append((k, P.copy(), x.copy(), state))
    return np.array(factors), np.array(weights), x[0]


@pytest.mark.parametrize("name", sorted(INFLUENCES))
@pytest.mark.parametrize("true", [0.5, 1.0, 3.0, 10.0])
def test_it_converges_to_the_true_scale(name, true):
    """The truth stands still, so that q makes s too large: below 0.1 of r, worth 5 % at 0.5.

    A mean of 100 clipped squares scatters by 0.5 sqrt(0.157 / 100) / 0.199 = 10 % (its variance,
    and its slope in the log of c^2 (1 - s / (s + r))); over the last 500 of 1500 by 5 %.
    """
    noise = true * np.random.default_rng(0).normal(size=1500)
    factors, _, _ = run(AdaptiveScale(), INFLUENCES[name](), noise, q=1e-4)
    assert np.mean(factors[-500:]) == pytest.approx(true, rel=0.15)


def test_a_tenth_of_gross_errors_moves_it_by_a_fifth_at_most():
    rng = np.random.default_rng(1)
    noise = rng.normal(size=2000) + np.where(rng.random(2000) < 0.1, 50.0, 0.0)
    factors, _, _ = run(AdaptiveScale(), Tukey(), noise, q=1e-4)
    assert 1.0 < np.mean(factors[-1000:]) < 1.25


def test_an_outage_teaches_nothing():
    """Innovations after it are the prediction's own error, whatever they are."""
    options = AdaptiveScale()
    learnt = ScaleState(math.log(4.0), 100.0, 0)
    state = learnt
    for nu in (3000.0, -2500.0, 10.0):
        state = options.after(state, nu, 1e6, 1.0)
    assert state.factor == pytest.approx(2.0, rel=1e-6)
    assert state.information == pytest.approx(100.0, rel=1e-6)
    # In a filter: absorbed at once, and what was learnt is still there.
    noise = 2.0 * np.random.default_rng(2).normal(size=300)
    factors, weights, x = run(options, Tukey(), noise, x=1500.0, P=1e6, state=learnt)
    assert weights[0] > 0.99
    assert abs(factors[0] - 2.0) < 1e-3
    assert np.mean(factors) == pytest.approx(2.0, rel=0.15)
    assert abs(x) < 2.0


@pytest.mark.parametrize("name", ["hampel", "tukey", "igg3"])
def test_it_cannot_be_driven_to_reject_for_ever(name):
    """A receiver that repeats itself, then works again; and an estimate that is wrong."""
    options, rng = AdaptiveScale(), np.random.default_rng(3)
    silent = np.zeros(5000)
    factors, weights, _ = run(
        options, INFLUENCES[name](), np.concatenate([silent, rng.normal(size=500)]), q=1e-4
    )
    assert factors[4999] == pytest.approx(options.lowest)
    # The log of c^2 rises by (1 - 0.516) / 0.199 / 100 = 0.024 at most: 100 for 0.3 to 1.
    assert np.mean(weights[5200:] > 0.0) > 0.97
    # 50 of its standard deviations off, and no noise that would make it doubtful.
    factors, weights, x = run(options, INFLUENCES[name](), np.zeros(800), q=0.0, x=50.0, P=1.0)
    assert weights[0] == 0.0
    # It says that its variance is 1, so that observations are believed to be 50 times worse; of
    # those it takes all, and goes the way of 800 observations with a variance of 2500.
    assert np.mean(weights[-100:]) > 0.95
    assert factors[-1] == pytest.approx(50.0, rel=0.3)
    assert abs(x) < 42.0


def test_after_some_rejections_in_a_row_one_is_taken_by_huber():
    """Three standard deviations after an outage: Tukey rejects each, together they are certain."""
    options, tukey = AdaptiveScale(patience=5), Tukey()
    assert options.rule(ScaleState(0.0, 10.0, 4), tukey).influence == tukey
    assert options.rule(ScaleState(0.0, 10.0, 5), tukey).influence == Huber()
    _, weights, x = run(options, tukey, np.zeros(20), q=0.0, x=3000.0, P=1e6)
    assert not weights[:5].any()
    assert (weights[5:] > 0.98).all()
    assert abs(x) < 0.01


def test_a_run_that_is_cut_goes_on_with_the_same_numbers():
    options, noise = AdaptiveScale(), 3.0 * np.random.default_rng(4).normal(size=200)
    whole, parts = [], []
    run(options, Tukey(), noise, keep=whole)
    run(options, Tukey(), noise[:77], keep=parts)
    _, P, x, state = parts[-1]
    stored = ScaleState(*json.loads(json.dumps(state)))
    run(options, Tukey(), noise[77:], x=x[0], P=P[0, 0], state=stored, keep=parts)
    assert [p[1:] for p in parts] == [w[1:] for w in whole]


def test_bounds_hold_and_start_is_the_stated_variance():
    options = AdaptiveScale(lowest=0.5, highest=4.0)
    assert options.begin() == ScaleState(0.0, 10.0, 0)
    low = high = options.begin()
    for _ in range(3000):
        low, high = options.after(low, 0.0, 0.0, 1.0), options.after(high, 1e9, 0.0, 1.0)
    assert low.factor == pytest.approx(0.5)
    assert high.factor == pytest.approx(4.0)
    for bad in ((math.nan, 1.0, 1.0), (1.0, 1.0, 0.0)):
        assert options.after(low, *bad)[:2] == low[:2]


@pytest.mark.parametrize(
    ("wrong", "what"),
    [
        ({"memory": 0.0}, "memory = 0.0"),
        ({"clip": math.inf}, "clip = inf"),
        ({"patience": 2.5}, "patience = 2.5 .* not a whole number"),
        ({"prior": 200.0}, "prior = 200 of the adaptive scale is above memory = 100"),
        ({"lowest": 200.0}, "lowest = 200 .* above highest = 100"),
    ],
)
def test_options_are_checked(wrong, what):
    with pytest.raises(ConfigError, match=what):
        AdaptiveScale(**wrong)


def test_a_loop_takes_within_their_linear_range_exactly_the_rules_that_it_knows():
    class Own(RobustUpdate):
        pass

    assert linear_range(None).size == 0
    assert linear_range(RobustUpdate(Huber(2.0), 1.5))[:3].tolist() == [2.0, 1.5, 0.0]
    assert linear_range(AdaptiveRule(Huber(2.0)))[:3].tolist() == [2.0, 1.0, 1.0]
    # Linear nowhere: asked for each.
    assert linear_range(AdaptiveRule(Tukey()))[:3].tolist() == [0.0, 1.0, 1.0]
    # A subclass may have another step.
    assert linear_range(Own(Huber())) is None

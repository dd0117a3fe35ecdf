"""The minimiser along P h' is the lowest point that a search of the whole range finds."""

import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from strapdown.estimation.robust import (
    INFLUENCES,
    NO_WEIGHT,
    Hampel,
    Huber,
    Igg3,
    LeastSquares,
    RobustUpdate,
    Tukey,
    post_fit,
)

parameter = st.floats(0.2, 4.0)
FUNCTIONS = st.one_of(
    st.builds(Huber, parameter),
    st.builds(Tukey, st.floats(1.0, 9.0)),
    st.builds(lambda a, b, c: Hampel(a, a + b, a + b + c), parameter, parameter, parameter),
    st.builds(lambda a, b: Igg3(a, a + b), parameter, parameter),
    st.just(LeastSquares()),
)


def loss(f, beta, b, kappa):
    return (b - beta) ** 2 / (2.0 * kappa) + f.rho(beta)


@settings(deadline=None, max_examples=300)
@given(f=FUNCTIONS, b=st.floats(0.0, 2000.0), log_kappa=st.floats(-4.0, 6.0))
def test_nothing_is_lower(f, b, log_kappa):
    kappa = 10.0**log_kappa
    beta = post_fit(f, b, kappa)
    assert 0.0 <= beta <= b
    # Dense where the functions bend, and over the whole range, on both sides of zero.
    grid = np.concatenate(
        [np.linspace(-b, b, 301), np.linspace(0.0, min(b, 15.0), 301), [b / (1.0 + kappa)]]
    )
    lowest = min(loss(f, float(u), b, kappa) for u in grid)
    # b - beta has a rounding of b, whose square over kappa enters the loss that is compared.
    noise = 1e-12 * lowest + (1e-15 * b) ** 2 / kappa + 1e-15 * b * abs(b - beta) / kappa
    # Squares below the smallest normal number are multiples of 2^-1074, two of them in a loss.
    assert loss(f, beta, b, kappa) <= lowest + noise + 4 * math.ulp(0.0)


@settings(deadline=None, max_examples=300)
# A weight of 1e-31 at the end of a redescending function.
@example(f=Tukey(1.0), nu=1.0, s=1.0, r=1.0, scale=1.0000000000000002)
@given(
    f=FUNCTIONS,
    nu=st.floats(-1000.0, 1000.0),
    s=st.floats(1e-3, 1e6),
    r=st.floats(1e-3, 1e3),
    scale=st.floats(0.2, 5.0),
)
def test_the_step_goes_to_the_minimiser(f, nu, s, r, scale):
    """Also where the fast path is taken: it must not differ."""
    step = RobustUpdate(f, scale).step(nu, s, r)
    # Rounded as the rule does: a redescending function jumps where two minima are equally low.
    square = r * (scale * scale)
    alpha = np.sqrt(square)
    beta = post_fit(f, abs(nu) / alpha, s / square)
    weight = f.weight(beta)
    assert step.weight == pytest.approx(weight, rel=1e-9, abs=1e-12)
    if weight < NO_WEIGHT:
        assert (step.moved, step.weight) == (0.0, 0.0)
    else:
        assert step.slope == 1.0
        residual = nu - s / (s + step.r) * nu
        assert residual == pytest.approx(np.copysign(alpha * beta, nu), rel=1e-9, abs=1e-9 * alpha)
        assert step.r >= alpha**2 * (1.0 - 1e-12)


def test_two_valleys_and_which_is_lower():
    """A redescending function has two minima; the limit is where their losses are equal.

    Accepted, the loss is nu^2 / 2 (s + r) nearly, rejected it is rho(inf) = c^2 / 6.
    """
    f, kappa = Tukey(), 1e6
    limit = np.sqrt(2.0 * f.rho(np.inf) * (1.0 + kappa))
    assert post_fit(f, 0.999 * limit, kappa) < 0.01
    assert post_fit(f, 1.001 * limit, kappa) == 1.001 * limit


@pytest.mark.parametrize("name", sorted(INFLUENCES))
def test_nothing_to_fit_and_nothing_to_move(name):
    f = INFLUENCES[name]()
    assert post_fit(f, 0.0, 3.0) == 0.0
    assert post_fit(f, 2.5, 0.0) == 2.5
    rule = RobustUpdate(f)
    assert rule.step(0.0, 4.0, 1.0) == (0.0, 1.0, 1.0, 1.0)
    # An exact observation has no residual to weigh.
    assert rule.step(7.0, 4.0, 0.0) == (7.0, 1.0, 0.0, 1.0)

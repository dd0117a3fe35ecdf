"""Cubics between samples against scipy, and against polynomials that they reproduce."""

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline, CubicSpline

from strapdown.dsp.samples import hermite, spline

# The operations are scipy's, whose compiler may fuse products with sums: a spline's value is some
# fifty roundings from that.
ROUNDINGS = 50 * np.finfo(np.float64).eps


def cases() -> list[tuple[np.ndarray, np.ndarray]]:
    rng = np.random.default_rng(4)
    even = np.arange(200) * 0.2
    # Of a receiver with pauses: a step far longer than its neighbors exchanges rows.
    paused = np.cumsum(np.where(rng.random(150) < 0.1, 80.0, rng.uniform(0.5, 1.5, 150)))
    all_knots = (even, paused, np.array([0.0, 1.0, 1.5, 4.0]))
    return [(k, np.cumsum(rng.normal(size=(len(k), 3)), axis=0)) for k in all_knots]


@pytest.mark.parametrize(("knots", "values"), cases())
def test_spline_and_integral_are_those_of_scipy(knots, values):
    ours, theirs = spline(knots, values), CubicSpline(knots, values)
    between = np.linspace(knots[0] - 0.3, knots[-1] + 0.3, 997)
    for at in (knots, between):
        for one, other in ((ours, theirs), (ours.integral(), theirs.antiderivative())):
            expected = other(at)
            np.testing.assert_allclose(
                one(at), expected, rtol=0.0, atol=ROUNDINGS * np.abs(expected).max()
            )


@pytest.mark.parametrize(("knots", "values"), cases())
def test_cubics_through_slopes_are_those_of_scipy(knots, values):
    slopes = np.roll(values, 7, axis=0)
    at = np.linspace(knots[0] - 0.3, knots[-1] + 0.3, 997)
    expected = CubicHermiteSpline(knots, values, slopes)(at)
    found = hermite(knots, values, slopes)(at)
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=ROUNDINGS * np.abs(expected).max())


def test_a_cubic_is_reproduced_with_its_integral():
    knots = np.array([0.0, 0.5, 2.0, 2.5, 4.0, 7.0])
    cubic = np.polynomial.Polynomial([1.0, -2.0, 0.5, 0.25])
    ours, at = spline(knots, cubic(knots)[:, None]), np.linspace(-1.0, 8.0, 91)
    # Rounding of a value at the knots, 84 at most, by a condition number below ten.
    np.testing.assert_allclose(ours(at)[:, 0], cubic(at), rtol=0.0, atol=84 * 10 * ROUNDINGS)
    whole = cubic.integ()
    np.testing.assert_allclose(
        ours.integral()(at)[:, 0], whole(at), rtol=0.0, atol=8.0 * 84 * 10 * ROUNDINGS
    )

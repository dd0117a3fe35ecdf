"""Running integrals and moving means against scipy's, and against a signal of known integral."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid
from scipy.ndimage import uniform_filter1d

from strapdown.dsp.samples import AT_ONCE, moving_mean, running_integral


@pytest.mark.parametrize("shape", [(), (3,), (3, 2)])
def test_trapezoids_are_those_of_scipy(shape):
    drawn = np.random.default_rng(3)
    time = 5.0 + np.cumsum(drawn.uniform(0.001, 0.3, 400))
    values = drawn.normal(size=(400, *shape))
    # Halves are exact: the products and sums of both are the same, in the same order.
    np.testing.assert_array_equal(
        running_integral(time, values), cumulative_trapezoid(values, time, axis=0, initial=0)
    )


def test_a_long_record_is_summed_in_parts():
    drawn = np.random.default_rng(5)
    time = np.cumsum(drawn.uniform(0.001, 0.3, AT_ONCE + 7))
    values = drawn.normal(size=(len(time), 2))
    np.testing.assert_array_equal(
        running_integral(time, values), cumulative_trapezoid(values, time, axis=0, initial=0)
    )


def test_means_give_the_integral_that_they_were_made_of():
    time = np.cumsum(np.random.default_rng(4).uniform(0.001, 0.3, 400))
    way = np.column_stack([np.sin(time), time**2])
    steps = np.diff(time)[:, None]
    # What stands in the first row belongs to an interval before the first stamp.
    means = np.vstack([[np.nan, 1e9], np.diff(way, axis=0) / steps])
    # Each of 400 steps rounds a quotient, a product and a sum of at most the largest way, by
    # half of 2.2e-16 of it.
    bound = 3 * 400 * 1.1e-16 * np.abs(way).max()
    found = running_integral(time, means, means=True)
    np.testing.assert_allclose(found, way - way[0], rtol=0.0, atol=bound)


def test_one_stamp_has_nothing_behind_it():
    assert running_integral(np.array([7.0]), np.array([[1.0, 2.0]])).tolist() == [[0.0, 0.0]]


@pytest.mark.parametrize(("count", "width"), [(400, 201), (57, 10), (9, 9), (5, 2), (3, 4), (7, 1)])
@pytest.mark.parametrize("shape", [(), (3,)])
def test_moving_means_are_those_of_scipy(count, width, shape):
    values = np.random.default_rng(5).normal(size=(count, *shape))
    # The same sums in the same order: a window, then what enters less what leaves.
    np.testing.assert_array_equal(
        moving_mean(values, width), uniform_filter1d(values, width, axis=0, mode="nearest")
    )

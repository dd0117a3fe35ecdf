"""The end of a range is seen, where it was stated and where it was not."""

from __future__ import annotations

import numpy as np
import pytest

from strapdown.sensors.saturation import find_limits

TIME = np.arange(400) / 200.0


def crash(peak, *, sd=0.3, q=0.0, full=1e9, seed=1, length=0.113):
    rng = np.random.default_rng(seed)
    x = np.clip((TIME - 1.0) / length, 0, 1)
    y = np.outer(np.sin(np.pi * x) ** 2, [-peak, 0.5 * peak, 0.0]) + np.array([0.0, 0.0, -9.8])
    y = np.clip(y + sd * rng.normal(size=y.shape), -full, full)
    return np.rint(y / q) * q if q else y


def limits(y, full, q=0.0):
    return find_limits(TIME, y, np.full(3, full), np.full(3, q))


@pytest.mark.parametrize("q", [0.0, 0.5])
def test_the_stated_end(q):
    y = crash(600.0, full=500.0, q=q)
    out = limits(y, 500.0, q)
    assert np.array_equal(out.clipped[:, 0], y[:, 0] <= -500.0 + q)
    assert not out.clipped[:, 1:].any()
    assert not out.beyond.any()


@pytest.mark.parametrize("stated", [1000.0, np.inf])
@pytest.mark.parametrize("q", [0.0, 0.5])
def test_an_end_that_is_not_where_it_was_stated_is_found(stated, q):
    y = crash(600.0, full=400.0, q=q)
    out = limits(y, stated, q)
    assert out.found.tolist() == [True, False, False]
    assert out.lower[0] == -400.0
    assert out.upper[0] == stated
    assert np.array_equal(out.clipped[:, 0], y[:, 0] == -400.0)


@pytest.mark.parametrize("q", [0.0, 0.5, 8.0])
@pytest.mark.parametrize("sd", [0.0, 0.3])
@pytest.mark.parametrize("seed", range(5))
def test_the_top_of_a_pulse_and_a_rest_are_no_ends(q, sd, seed):
    for peak in (60.0, 130.0, 600.0):
        out = limits(crash(peak, sd=sd, q=q, seed=seed), 980.0, q)
        assert not out.clipped.any()
        assert not out.found.any()


def test_more_than_the_stated_full_scale_is_seen():
    out = limits(crash(600.0), 500.0)
    assert out.beyond.tolist() == [True, False, False]


def test_a_fast_rise_that_meets_a_slow_fall_is_no_end():
    # A car that is turned by a blow and slowed by its tires: coarse steps hold the top for a few
    # samples, of which one side is far below.
    rate = np.where(TIME < 0.5, 0.0, np.maximum(1.695 - 0.3 * (TIME - 0.5), 0.0))
    y = np.zeros((TIME.size, 3))
    y[:, 2] = np.round(rate / 0.0085) * 0.0085
    assert (y[:, 2] == y[:, 2].max()).sum() >= 3
    assert not limits(y, full=8.7, q=0.0085).found.any()
    # Held from above for as long as a clipped pulse is, it is one, whatever the other side does.
    y[:, 2] = np.minimum(y[:, 2], 1.615)
    assert limits(y, full=8.7, q=0.0085).found[2]


def test_a_small_extreme_beside_a_large_one_is_no_end():
    # A perfect sensor that rests at a value below zero after a blow above it.
    y = np.zeros((TIME.size, 3))
    y[:, 0] = np.where(TIME < 0.6, 2.0 * np.sin(10.0 * TIME) ** 2, 0.0)
    y[-60:, 0] = -1e-5
    assert not limits(y, full=np.inf, q=0.0).found.any()


def test_any_number_of_axes():
    y = np.zeros((TIME.size, 1))
    y[300:320] = 5.0
    found = find_limits(TIME, y, np.array([50.0]), np.array([0.1]))
    assert found.found.shape == found.upper.shape == (1,)


def test_noise_in_steps_that_repeats_its_extreme_is_no_end_of_a_range():
    # The slow top of a slide, 3.4 m/s² of ±19.6, in noise of three steps: three equal numbers on
    # it, four steps above all others.
    step, rng = 0.01, np.random.default_rng(5)
    top = 3.4 * np.sin(np.pi * TIME / TIME[-1]) ** 2
    y = np.rint((top + 0.03 * rng.normal(size=TIME.size)) / step) * step
    y[200:203] = y.max() + 4.0 * step
    assert not limits(y[:, None], 19.6, step).found.any()
    # Far above the noise it is one.
    y[200:203] += 0.5
    assert limits(y[:, None], 19.6, step).found.all()


@pytest.mark.parametrize("q", [0.0, 0.5])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_an_end_far_below_the_stated_range_is_found(q, sign):
    # An amplifier that ends at 40 of a stated 980 m/s²: a run of 10 ms and more on one value.
    y = sign * crash(300.0, full=40.0, q=q)
    out = limits(y, 980.0, q)
    assert out.found[0]
    assert np.array_equal(out.clipped[:, 0], y[:, 0] == -sign * 40.0)
    assert out.clipped[:, 0].sum() >= 10
    assert not out.clipped[:, 2].any()


def test_a_short_run_far_below_the_range_is_none():
    y = crash(45.0, sd=0.0, full=42.0)
    assert 3 <= (y[:, 0] == -42.0).sum() < 10
    assert not limits(y, 980.0).found.any()


def test_a_rest_between_two_pulses_is_no_end():
    # Steps of 0.5 g and no noise: the rest of 80 ms is the largest value, and flat.
    y = np.zeros((TIME.size, 3))
    for at in (1.0, 1.15):
        y[:, 0] -= 300.0 * np.sin(np.pi * np.clip((TIME - at) / 0.07, 0, 1)) ** 2
    y = np.rint((y + 6.0) / 4.9) * 4.9
    y[:150, 0] -= 4.9
    y[300:, 0] -= 4.9
    assert not limits(y, 980.0, 4.9).found.any()

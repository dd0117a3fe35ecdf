"""Ranges merged: no step, the right variance, and who spoke."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.coded import coded

from strapdown.errors import ConfigError, DataError
from strapdown.sensors.range_merge import Range, merge_ranges
from strapdown.sensors.saturation import find_limits

RATE = 1000.0
LOW, HIGH = 20.0, 1000.0


def limits_of(time, values, full):
    return find_limits(time, values, np.full(3, full), np.zeros(3))


def two_ranges(time, truth, *, sd=(0.0, 0.0), bias=(0.0, 0.0), seed=0):
    rng = np.random.default_rng(seed)
    low = np.clip(truth + bias[0] + sd[0] * rng.normal(size=truth.shape), -LOW, LOW)
    high = np.clip(truth + bias[1] + sd[1] * rng.normal(size=truth.shape), -HIGH, HIGH)
    return (low, high), (limits_of(time, low, LOW), limits_of(time, high, HIGH))


def merged(time, truth, *, sd=(0.0, 0.0), bias=(0.0, 0.0), seed=0, bandwidth=np.inf, **options):
    values, limits = two_ranges(time, truth, sd=sd, bias=bias, seed=seed)
    ranges = [
        Range(y, limit, np.full(truth.shape, s), bandwidth, np.full(3, b))
        for y, limit, s, b in zip(values, limits, sd, bias, strict=True)
    ]
    return merge_ranges(time, ranges, **options)


def pulse(peak, n=1000):
    time = np.arange(n) / RATE
    x = np.clip((time - 0.3) / 0.2, 0, 1)
    return time, np.outer(np.sin(np.pi * x) ** 2, [peak, -0.5 * peak, 0.01 * peak])


@given(
    st.floats(5.0, 900.0),
    st.floats(-12.0, 12.0),
    st.floats(0.0, 0.4),
    st.floats(0.0, 0.4),
    st.sampled_from([0.0, 0.003, 0.02]),
    st.sampled_from([np.inf, 50.0, 400.0]),
)
@settings(max_examples=60, deadline=None)
def test_two_perfect_ranges_give_back_the_truth(peak, bias, margin, hysteresis, fade, bandwidth):
    time, truth = pulse(peak)
    out = merged(
        time,
        truth,
        bias=(0.0, bias),
        margin=margin,
        hysteresis=hysteresis,
        fade=fade,
        bandwidth=bandwidth,
    )
    # A bias put on and taken off again, and a weighted sum: four roundings of 1000.
    assert np.abs(out.values - truth).max() <= 4 * np.spacing(1000.0)
    assert not out.clipped.any()
    # Who spoke was clear of its end.
    assert (np.abs(truth)[out.spoken == 0] <= (1.0 - margin) * LOW).all()


def test_the_variance_is_right_in_each_region():
    rng = np.random.default_rng(5)
    n, sd = 200_000, (0.05, 0.9)
    time = np.arange(n) / RATE
    # Blocks far on either side of the threshold: a choice by a noisy value then selects nothing.
    truth = np.repeat(np.where(rng.random(n // 50) < 0.5, 5.0, 200.0), 50)[:, None] * np.ones(3)
    out = merged(time, truth, sd=sd, seed=6, fade=0.005)
    z = (out.values - truth) / out.noise
    faded = ~(np.isclose(out.noise, sd[0]) | np.isclose(out.noise, sd[1]))
    for region in (out.noise == sd[0], out.noise == sd[1], faded):
        samples = int(region.sum())
        assert samples > 5000
        # The variance of n normal deviates scatters by sqrt(2/n): five of these.
        assert z[region].var() == pytest.approx(1.0, abs=5 * np.sqrt(2 / samples))
        assert abs(z[region].mean()) < 5 / np.sqrt(samples)


def test_a_step_between_the_ranges_is_measured():
    time, truth = pulse(300.0)
    values, limits = two_ranges(time, truth, sd=(0.01, 0.2), bias=(0.0, 3.0))
    noise = [np.full(truth.shape, s) for s in (0.01, 0.2)]
    out = merge_ranges(time, [Range(*one) for one in zip(values, limits, noise, strict=True)])
    assert out.switches[0].tolist() == [2, 2, 0]
    # Two switch-overs: the sd of the mean is that of the difference over root two.
    assert out.step_sd[0, 0] == pytest.approx(np.hypot(0.01, 0.2) / np.sqrt(2))
    assert out.step[0, 0] == pytest.approx(3.0, abs=5 * out.step_sd[0, 0])


def test_noise_about_the_threshold_does_not_chatter():
    time = np.arange(4000) / RATE
    truth = np.full((4000, 3), 0.9 * LOW)
    plain = merged(time, truth, sd=(0.3, 0.3), hysteresis=0.0)
    damped = merged(time, truth, sd=(0.3, 0.3), hysteresis=0.1)
    assert plain.switches[0, 0] > 500
    # To fall silent and speak again takes a deviation of 2 m/s², 6.7 standard deviations.
    assert damped.switches[0, 0] <= 2


def test_the_memory_of_the_filter_keeps_the_low_range_silent():
    time, truth = pulse(300.0)
    out = merged(time, truth, bandwidth=50.0, hysteresis=0.0)
    end = time[np.flatnonzero(truth[:, 0] > 0.9 * LOW)[-1]]
    back = time[np.flatnonzero(out.spoken[:, 0] == 1)[-1]]
    # Five time constants of 1/(2 pi 50 Hz), to a sample.
    assert back - end == pytest.approx(5 / (2 * np.pi * 50.0), abs=1.01 / RATE)
    first = np.flatnonzero(out.spoken[:, 0] == 1)[0]
    assert first == np.flatnonzero(truth[:, 0] > 0.9 * LOW)[0] - 1


def test_three_ranges_each_speak_where_they_should():
    time, truth = pulse(800.0)
    full = (20.0, 200.0, 1000.0)
    values = [np.clip(truth, -f, f) for f in full]
    noise = [np.full(truth.shape, s) for s in (0.01, 0.1, 1.0)]
    out = merge_ranges(
        time,
        [Range(v, limits_of(time, v, f), s) for v, f, s in zip(values, full, noise, strict=True)],
    )
    assert np.array_equal(out.values, truth)
    assert set(np.unique(out.spoken[:, 0])) == {0, 1, 2}
    assert set(np.unique(out.spoken[:, 2])) == {0}
    assert np.array_equal(out.noise, np.choose(out.spoken, [0.01, 0.1, 1.0]))


def test_clipping_of_the_last_range_is_flagged_and_that_of_the_first_is_not():
    time, truth = pulse(1500.0)
    out = merged(time, truth)
    assert np.array_equal(out.clipped[:, 0], truth[:, 0] >= HIGH)
    assert not out.clipped[:, 1].any()


def test_one_range_alone_is_passed_through():
    time, truth = pulse(30.0)
    low = np.clip(truth, -LOW, LOW)
    out = merge_ranges(time, [Range(low, limits_of(time, low, LOW), np.full(truth.shape, 0.1))])
    assert np.array_equal(out.values, low)
    assert np.array_equal(out.clipped, np.abs(truth) >= LOW)


def test_what_is_no_number_is_refused_with_its_row():
    time, truth = pulse(30.0)
    values, limits = two_ranges(time, truth)
    values[1][7, 1] = np.nan
    with pytest.raises(
        DataError, check=coded("tables.not-finite-number", row=8, quantity="range 1 y")
    ):
        merge_ranges(time, [Range(v, end, truth) for v, end in zip(values, limits, strict=True)])
    one = [Range(truth, limits[0], truth)]
    with pytest.raises(DataError, check=coded("tables.time-does-not-advance-followed")):
        merge_ranges(time[::-1].copy(), one)
    with pytest.raises(ConfigError, check=coded("sensors.margin-hysteresis-leave-no-range")):
        merge_ranges(time, one, margin=0.6, hysteresis=0.5)
    with pytest.raises(ConfigError, check=coded("sensors.no-length-cross-fade", quantity="fade")):
        merge_ranges(time, one, fade=-1.0)

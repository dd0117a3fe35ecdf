"""Thresholds that find themselves: by hand, on made-up stances and swings, and cut anywhere."""

from __future__ import annotations

import math

import numpy as np
import pytest

from strapdown.errors import ConfigError
from strapdown.navigation.measurements.measurement import longer_by
from strapdown.navigation.measurements.standstill import (
    STANDSTILL_THRESHOLDS,
    WIDTH,
    ZeroVelocity,
    otsu,
)

STEP = 0.005


def told(rule, statistics, stated=10.0, scale=10.0):
    memory, out = rule.begin(stated, scale), []
    for k, one in enumerate(statistics):
        memory, now = rule.next(memory, STEP * (k + 1), one)
        out.append(now)
    return np.array(out)


def gait(seed=0, strides=20, stance=5.0, swing=130.0):
    """Statistics of strides of 1.1 s: half a second of stance, and what is beyond."""
    rng = np.random.default_rng(seed)
    one = np.concatenate([np.full(100, math.log(stance)), np.full(120, math.log(swing))])
    return np.exp(np.tile(one, strides) + 0.4 * rng.standard_normal(220 * strides))


@pytest.mark.parametrize("name", list(STANDSTILL_THRESHOLDS))
def test_each_says_what_it_is(name):
    assert STANDSTILL_THRESHOLDS[name].summary and STANDSTILL_THRESHOLDS[name].source


def test_otsu_is_the_edge_of_most_variance_between():
    """By the definition, over every edge, of a histogram of two lumps."""
    rng = np.random.default_rng(1)
    counts = np.zeros(200)
    counts[60:80] = rng.uniform(1.0, 3.0, 20)
    counts[100:115] = rng.uniform(1.0, 3.0, 15)
    bins = np.arange(200) + 0.5
    best, most = None, -1.0
    for k in range(1, 200):
        low, high = counts[:k].sum(), counts[k:].sum()
        if low and high:
            apart = (counts[:k] @ bins[:k]) / low - (counts[k:] @ bins[k:]) / high
            if low * high * apart**2 > most * (1.0 + 1e-12):
                best, most = k, low * high * apart**2
    found = otsu(counts)
    # Between the lumps all edges are as good; the middle one is taken.
    assert best == 80
    assert found is not None and 80 < found < 100 and otsu(counts[::-1].copy()) is not None


@pytest.mark.parametrize("width", [2, 5, 10])
def test_one_class_is_not_parted(width):
    """A normal class, 0.64 of whose variance is between its halves; and one of a twentieth."""
    bins = np.arange(200)
    assert otsu(np.exp(-0.5 * ((bins - 100) / width) ** 2)) is None
    few = np.exp(-0.5 * ((bins - 100) / 3.0) ** 2)
    few[150] = 0.05 * few.sum()
    assert otsu(few) is None


def test_classes_nearer_than_a_factor_of_five_are_one():
    counts = np.zeros(200)
    counts[[100, 100 + round(math.log(4.5) / WIDTH)]] = 1.0
    assert otsu(counts) is None
    counts = np.zeros(200)
    counts[[100, 100 + round(math.log(6.0) / WIDTH)]] = 1.0
    assert otsu(counts) is not None


@pytest.mark.parametrize("scale", [0.01, 1.0, 100.0])
def test_otsu_goes_to_where_stances_and_swings_part(scale):
    """Whatever the unit: the geometric mean of classes of nearly one size, within their noise."""
    found = told(STANDSTILL_THRESHOLDS["otsu"], scale * gait())
    assert found[0] == 10.0
    assert scale * 5.0 * 2.0 < found[-1] < scale * 130.0 / 2.0
    rest = scale * gait()[-2200:].reshape(10, 220)
    # 0.4 is the noise of the logarithm: the classes are eight of it apart.
    assert (rest[:, :100] < found[-1]).mean() > 0.99
    assert (rest[:, 100:] < found[-1]).mean() < 0.01


def test_otsu_keeps_what_is_stated_while_there_is_one_class():
    rng = np.random.default_rng(2)
    quiet = np.exp(0.3 * rng.standard_normal(2000))
    assert (told(STANDSTILL_THRESHOLDS["otsu"], quiet) == 10.0).all()


def test_patience_is_bayes_rule_with_an_exponential_cost():
    """Log of the likelihood ratio against the log of the bound, by the definition."""
    stated, scale, n, w = 3.0, 0.5, 6, 5
    theta = n * w * stated**2 / (2.0 * scale)
    found = told(STANDSTILL_THRESHOLDS["patience"], np.full(100, 1e6), stated, scale)
    waited = STEP * np.arange(100)
    ratio = -0.5 * n * w * found**2
    np.testing.assert_allclose(ratio, -0.5 * n * w * stated**2 - theta * waited, rtol=1e-12)
    # After a rest it is as stated again.
    again = told(STANDSTILL_THRESHOLDS["patience"], [1e6] * 50 + [0.1, 1e6], stated, scale)
    assert again[-1] == pytest.approx(stated * math.sqrt(1.0 + STEP / scale), rel=1e-12)


@pytest.mark.parametrize("rule", list(STANDSTILL_THRESHOLDS))
@pytest.mark.parametrize("interval", [0.0, 0.02])
def test_pieces_of_any_length_give_the_epochs_of_the_whole(rule, interval):
    """To the last bit, by sample and in random pieces."""
    rng = np.random.default_rng(5)
    shake = np.repeat(gait(7, strides=6), 1) * math.radians(1.0)
    rows = np.zeros((len(shake), 10))
    rows[:, 0] = STEP
    rows[:, 1:4] = STEP * shake[:, None] * rng.standard_normal((len(shake), 3))
    rows[:, 4:7] = STEP * (np.array([0.0, 0.0, -9.81]) + shake[:, None] * rng.standard_normal(3))
    time = STEP * np.arange(1, len(shake) + 1)
    aid = ZeroVelocity(
        name="stance",
        detector="shoe",
        window=0.025,
        threshold=10.0,
        threshold_rule=rule,
        threshold_time=2.0,
        interval=interval,
        rate_sd_deg_per_s=1.0,
    )
    whole = aid.watch(aid.begin(), time, rows)[1]
    assert 0 < len(whole.time) < len(time)
    cuts = np.sort(rng.choice(len(time), 40, replace=False))
    for edges in (np.arange(1, len(time)), cuts):
        memory, parts = aid.begin(), []
        for t, r in zip(np.split(time, edges), np.split(rows, edges), strict=True):
            memory, epochs = aid.watch(memory, t, r)
            parts.append(epochs)
        np.testing.assert_array_equal(np.concatenate([p.time for p in parts]), whole.time)
        np.testing.assert_array_equal(np.concatenate([p.values for p in parts]), whole.values)


def test_errors_that_last_are_weighed_as_their_mean_is():
    """Variance of a mean of n Gauss-Markov errors, summed over all pairs, times n."""
    interval, tau, n = 0.02, 0.1, 4000
    lags = np.arange(n)
    rho = np.exp(-interval * lags / tau)
    of_mean = (rho[0] + 2.0 * ((n - lags[1:]) / n * rho[1:]).sum()) / n
    # What is at the ends of so many is a part of tau / (n interval).
    assert longer_by(interval, tau) == pytest.approx(n * of_mean, rel=2.0 * tau / (n * interval))
    assert longer_by(interval, 0.0) == 1.0


@pytest.mark.parametrize(
    ("options", "quantity"),
    [
        ({"threshold_rule": "otso"}, "threshold_rule"),
        ({"threshold_time": 0.0}, "threshold_time"),
        ({"pivot": -0.1}, "pivot"),
        ({"correlation_time": math.nan}, "correlation_time"),
    ],
)
def test_options_that_mean_nothing_are_refused(options, quantity):
    with pytest.raises(ConfigError) as refused:
        ZeroVelocity(name="stance", **options)
    assert refused.value.finding.quantity == quantity
    assert refused.value.finding.remedy

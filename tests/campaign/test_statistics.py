"""Statistics of campaigns against numpy, scipy.stats, exact values and their own promise."""

from __future__ import annotations

import math
import tracemalloc
from collections.abc import Iterator
from itertools import pairwise

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats
from tests.campaign_cases import ISHIGAMI_FIRST, ISHIGAMI_TOTAL, ishigami

from strapdown.campaign import statistics
from strapdown.campaign.statistics import (
    Extremes,
    Moments,
    Sobol,
    Stream,
    Values,
    blocks,
    consistency,
    count_between,
    order_statistics,
    poisson_weights,
    quantile_ranks,
    quantiles,
    share_of,
    student_interval,
)
from strapdown.dsp.chi_square import binomial_quantile, clopper_pearson

LEVELS = (0.025, 0.05, 0.25, 0.5, 0.75, 0.95, 0.975)


def stream_of(group: np.ndarray, value: np.ndarray, rows: int) -> Stream:
    def stream() -> Iterator[Values]:
        case = np.arange(value.size)
        for k in range(0, value.size, rows):
            part = slice(k, k + rows)
            yield Values(group[part], value[part], case[part])

    return stream


def moments_of(stream: Stream, groups: int) -> Moments:
    moments = Moments(groups)
    for block in stream():
        moments.add(block)
    return moments


def hard(n: int, groups: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Values of many sizes and both signs, with ties, zeros of both signs and holes."""
    rng = np.random.default_rng(seed)
    value = rng.standard_t(1.5, n) * 10.0 ** rng.integers(-200, 200, n)
    some = rng.random(n)
    value = np.where(some < 0.1, 0.0, np.where(some < 0.2, -0.0, value))
    value = np.where((some > 0.2) & (some < 0.25), 3.25, value)
    return rng.integers(0, groups, n), np.where(some > 0.95, np.nan, value)


# Moments.


@pytest.mark.parametrize("rows", [70, 1000, 50_000])
def test_moments_are_those_of_numpy_also_far_from_zero(rows: int) -> None:
    rng = np.random.default_rng(3)
    group, value = rng.integers(0, 4, 20_000), 1e9 + rng.normal(0.0, 1e-3, 20_000)
    value[group == 3] = np.nan
    found = moments_of(stream_of(group, value, rows), 4)
    for k in range(3):
        own = value[group == k]
        # Numbers about 1e9 are 1.2e-7 apart; the differences from the first one are exact.
        exact = own - own[0]
        assert found.mean[k] - own[0] == pytest.approx(exact.mean(), abs=1.2e-7)
        assert found.sd[k] == pytest.approx(exact.std(ddof=1), rel=1e-12)
    assert found.count[3] == 0
    assert found.missing[3] == np.sum(group == 3)
    assert math.isnan(found.sd[3])


def test_extremes_have_the_number_of_their_first_case() -> None:
    value = np.array([2.0, -1.0, 5.0, -1.0, 5.0, np.nan])
    found = moments_of(stream_of(np.zeros(6, int), value, 4), 1)
    assert (found.low[0], found.low_case[0], found.high[0], found.high_case[0]) == (-1.0, 1, 5.0, 2)


def test_an_infinite_value_is_the_extreme_and_leaves_the_other_groups_alone() -> None:
    value = np.array([1.0, np.inf, 2.0, 4.0])
    found = moments_of(stream_of(np.array([0, 0, 1, 1]), value, 3), 2)
    assert found.high[0] == np.inf
    assert found.mean[1] == 3.0
    assert found.sd[1] == pytest.approx(math.sqrt(2.0))


# Order statistics and quantiles.


@pytest.mark.parametrize(("counters", "candidates"), [(2**22, 2**18), (2**10, 50), (2**6, 0)])
def test_order_statistics_are_those_of_sorting(
    monkeypatch: pytest.MonkeyPatch, counters: int, candidates: int
) -> None:
    monkeypatch.setattr(statistics, "COUNTERS", counters)
    monkeypatch.setattr(statistics, "CANDIDATES", candidates)
    group, value = hard(6000, 3, 1)
    stream = stream_of(group, value, 999)
    of = moments_of(stream, 3)
    ranks = np.stack([[0, 1, n // 3, n // 2, n - 1, n, -1] for n in of.count.tolist()])
    found = order_statistics(stream, of, ranks)
    for k in range(3):
        own = np.sort(value[(group == k) & ~np.isnan(value)])
        assert np.array_equal(found[k, :5], own[ranks[k, :5]])
        assert np.isnan(found[k, 5:]).all()


@settings(max_examples=60, deadline=None)
@given(
    st.lists(st.floats(allow_nan=True, allow_infinity=True, width=64), min_size=1, max_size=60),
    st.integers(1, 60),
    st.integers(1, 60),
)
def test_batches_do_not_change_a_bit_of_order_statistics(
    values: list[float], one: int, other: int
) -> None:
    value = np.array(values)
    group = np.arange(value.size) % 2
    made = []
    for rows in (one, other):
        stream = stream_of(group, value, rows)
        of = moments_of(stream, 2)
        with np.errstate(over="ignore"):
            made.append((of, quantiles(stream, of, LEVELS)))
    (a, p), (b, q) = made
    for x, y in zip(p, q, strict=True):
        assert x.tobytes() == y.tobytes()
    for key in ("count", "missing", "low", "high", "low_case", "high_case"):
        assert np.array_equal(getattr(a, key), getattr(b, key))
    for k in range(2):
        own = value[(group == k) & ~np.isnan(value)]
        if own.size and np.isfinite(own).all() and np.abs(own).max() < 1e100:
            close = own.size * np.spacing(np.abs(own).max())
            assert abs(a.mean[k] - b.mean[k]) <= 4.0 * close


def test_blocks_do_not_depend_on_batches() -> None:
    table = pd.DataFrame({"case": np.arange(100), "y": np.linspace(0.0, 1.0, 100)})
    for sizes in ([100], [1] * 100, [0, 33, 0, 60, 7]):
        ends = np.cumsum([0, *sizes])
        parts = [table.iloc[a:b] for a, b in pairwise(ends)]
        made = list(blocks(parts, 30))
        assert [len(one) for one in made] == [30, 30, 30, 10]
        pd.testing.assert_frame_equal(pd.concat(made, ignore_index=True), table)


def test_quantiles_are_those_of_numpy() -> None:
    rng = np.random.default_rng(5)
    group, value = rng.integers(0, 5, 3000), rng.lognormal(0.0, 2.0, 3000)
    stream = stream_of(group, value, 500)
    found, _, _ = quantiles(stream, moments_of(stream, 5), LEVELS)
    for k in range(5):
        np.testing.assert_allclose(found[k], np.quantile(value[group == k], LEVELS), rtol=4e-16 * 8)


@pytest.mark.parametrize("n", [1, 5, 20, 100, 1001])
def test_ends_of_quantiles_hold_their_confidence_exactly_and_are_the_narrowest(n: int) -> None:
    ranks = quantile_ranks(np.array([n]), LEVELS)[0]
    for p, (_, _, low, high) in zip(LEVELS, ranks.tolist(), strict=True):
        below = stats.binom(n, p)
        # The value of rank k (from 0) is above the quantile where k or fewer values are below it.
        assert low < 0 or below.cdf(low) <= 0.025 + 1e-12  # one value below its 97.5 % quantile
        assert below.cdf(low + 1) > 0.025
        assert high < 0 or below.cdf(high) >= 0.975 > below.cdf(high - 1)
        assert (high < 0) == bool(below.cdf(n - 1) < 0.975)


def test_quantile_of_the_binomial_is_scipys() -> None:
    rng = np.random.default_rng(7)
    n, p, q = rng.integers(1, 100_000, 500), rng.random(500), rng.random(500)
    assert np.array_equal(binomial_quantile(q, n, p), stats.binom.ppf(q, n, p).astype(int))


# Shares.


@pytest.mark.parametrize(("hits", "of"), [(0, 1), (0, 300), (7, 7), (3, 10), (950, 1000)])
@pytest.mark.parametrize("confidence", [0.95, 0.99])
def test_clopper_pearson_is_scipys(hits: int, of: int, confidence: float) -> None:
    exact = stats.binomtest(hits, of).proportion_ci(confidence)
    assert clopper_pearson(hits, of, confidence) == pytest.approx(
        (exact.low, exact.high), abs=1e-12
    )


def test_a_share_of_nothing_can_be_anything() -> None:
    share = share_of(0, 0)
    assert (share.low, share.high) == (0.0, 1.0)
    assert math.isnan(share.share)
    assert share.differs(0.95) == 0


@pytest.mark.parametrize(("hits", "sign"), [(900, -1), (935, 0), (948, 0), (965, 0), (990, 1)])
def test_a_share_differs_by_its_99_percent_interval(hits: int, sign: int) -> None:
    assert share_of(hits, 1000).differs(0.95) == sign


# Intervals hold what they promise.


def within_chance(hits: int, of: int, promised: float) -> bool:
    """Whether hits of a promise of at least so much are not too few by one in a million."""
    return bool(stats.binom.cdf(hits, of, promised) > 1e-6)


def test_intervals_contain_the_truth_as_often_as_they_promise() -> None:
    rng = np.random.default_rng(11)
    repeats, n, p = 2000, 60, 0.9
    value = rng.exponential(1.0, (repeats, n))
    normal = rng.normal(5.0, 2.0, (repeats, n))
    group = np.repeat(np.arange(repeats), n)
    stream = stream_of(group, value.ravel(), 10_000)
    _, low, high = quantiles(stream, moments_of(stream, repeats), (0.25, 0.5, 0.9))
    for k, truth in enumerate(-np.log1p(-np.array([0.25, 0.5, 0.9]))):
        inside = np.sum(
            (np.nan_to_num(low[:, k], nan=-np.inf) <= truth)
            & (truth <= np.nan_to_num(high[:, k], nan=np.inf))
        )
        assert within_chance(int(inside), repeats, 0.95)
        # And not by being endless: the exact confidence is at most 99 %.
        assert inside < 0.995 * repeats
    ends = [student_interval(n, row.mean(), row.std(ddof=1)) for row in normal]
    inside = sum(a <= 5.0 <= b for a, b in ends)
    assert within_chance(inside, repeats, 0.95)
    assert stats.binom.sf(inside, repeats, 0.95) > 1e-6
    hits = rng.binomial(n, p, repeats)
    shares = [share_of(int(k), n) for k in hits]
    assert within_chance(sum(s.low <= p <= s.high for s in shares), repeats, 0.95)
    assert within_chance(sum(s.differs(p) == 0 for s in shares), repeats, 0.99)


def test_consistency_is_chi_square_of_the_sum() -> None:
    found = consistency(50, 3.3, 45, 3)
    for share, end in ((0.025, found.low), (0.975, found.high), (0.005, found.low_99)):
        assert end == pytest.approx(stats.chi2.ppf(share, 150) / 50, rel=1e-12)
    assert found.differs == 0
    assert consistency(50, 1.02 * found.high_99, 45, 3).differs == 1
    assert consistency(50, 0.98 * found.low_99, 50, 3).differs == -1
    assert consistency(0, 0.0, 0, 3).differs == 0


def test_consistency_of_right_variances_differs_in_one_of_a_hundred() -> None:
    rng = np.random.default_rng(13)
    means = rng.chisquare(3, (2000, 40)).mean(axis=1)
    off = sum(consistency(40, mean, 38, 3).differs != 0 for mean in means.tolist())
    assert stats.binom.cdf(off, 2000, 0.01) > 1e-6
    assert stats.binom.sf(off - 1, 2000, 0.01) > 1e-6


# Histogram and extremes.


@settings(max_examples=60, deadline=None)
@given(st.lists(st.floats(-3.0, 3.0) | st.just(math.nan), max_size=50))
def test_counts_between_edges_are_numpys(values: list[float]) -> None:
    edges, value = np.linspace(-2.0, 2.0, 9), np.array(values)
    below, *inside, above = count_between(edges, value).tolist()
    assert inside == np.histogram(value[~np.isnan(value)], edges)[0].tolist()
    assert (below, above) == (np.sum(value < -2.0), np.sum(value > 2.0))


def test_the_farthest_values_are_kept_over_blocks() -> None:
    rng = np.random.default_rng(17)
    group, value = rng.integers(0, 2, 4000), rng.normal(0.0, 1.0, 4000)
    value[rng.integers(0, 4000, 30)] = np.nan
    far = Extremes(np.array([-2.0, -1.0]), np.array([2.0, 1.5]), np.ones(2), keep=6)
    for block in stream_of(group, value, 300)():
        far.add(block)
    for k, (low, high) in enumerate(((-2.0, 2.0), (-1.0, 1.5))):
        beyond = np.where(group == k, np.maximum(low - value, value - high), -1.0)
        beyond = np.nan_to_num(beyond, nan=-1.0)
        order = np.argsort(-beyond, kind="stable")[:6].tolist()
        assert far.worst(k) == [(case, float(value[case])) for case in order]
        assert far.below[k] + far.above[k] == np.sum(beyond > 0.0)


# Sensitivity.


def sobol_of(samples: int, seed: int, rows: int = 1000) -> Sobol:
    _, table = ishigami(samples, seed)
    sobol = Sobol(3, np.array([[table["y"].mean()]]), seed)
    for k in range(0, len(table), rows):
        part = table.iloc[k : k + rows]
        draw = part["draw"].to_numpy()
        sobol.add(np.zeros(draw.size, int), draw, part[["y"]].to_numpy())
    sobol.finish()
    return sobol


def test_indices_of_ishigami_are_inside_their_intervals_as_often_as_promised() -> None:
    hits = 0
    for seed in range(25):
        found = sobol_of(400, seed, 10_000).indices(0, 0)
        for one, truth in ((found.first, ISHIGAMI_FIRST), (found.total, ISHIGAMI_TOTAL)):
            hits += int(np.sum((one[:, 1] <= truth) & (truth <= one[:, 2])))
            assert (one[:, 2] - one[:, 1] < 0.5).all()
    # The six of a seed share their samples: as independent as one of them at worst.
    assert stats.binom.cdf(hits // 6, 25, 0.95) > 1e-3


def test_indices_do_not_depend_on_batches_but_for_rounding() -> None:
    one, other = (sobol_of(200, 4, rows).indices(0, 0) for rows in (70, 777))
    np.testing.assert_allclose(one.first, other.first, rtol=1e-9)
    np.testing.assert_allclose(one.total, other.total, rtol=1e-9)
    assert one.samples == other.samples == 200


def test_a_base_sample_with_a_case_without_a_value_is_left_out() -> None:
    _, table = ishigami(100, 9)
    y = table["y"].to_numpy(copy=True)
    y[[12, 13, 77]] = np.nan  # of samples 2 and 15
    table = table.assign(y=y).drop(index=[40])  # and one case of sample 8 is not there
    sobol = Sobol(3, np.zeros((1, 1)))
    sobol.add(np.zeros(len(table), int), table["draw"].to_numpy(), table[["y"]].to_numpy())
    sobol.finish()
    found = sobol.indices(0, 0)
    assert (found.samples, found.left_out) == (97, 3)


def test_the_mean_of_the_values_is_subtracted_first() -> None:
    """An offset of 1e6 would drown the first order in noise: S's error grows with f's mean."""
    _, table = ishigami(500, 2)
    y = table["y"].to_numpy()
    made = []
    for offset in (0.0, 1e6):
        sobol = Sobol(3, np.array([[y.mean() + offset]]))
        sobol.add(np.zeros(y.size, int), table["draw"].to_numpy(), (y + offset)[:, None])
        sobol.finish()
        made.append(sobol.indices(0, 0).first)
    np.testing.assert_allclose(made[0], made[1], atol=1e-7)


def test_a_constant_has_no_indices() -> None:
    sobol = Sobol(2, np.array([[4.0]]))
    sobol.add(np.zeros(8, int), np.arange(8), np.full((8, 1), 4.0))
    sobol.finish()
    assert np.isnan(sobol.indices(0, 0).total).all()


def test_weights_of_the_bootstrap_are_poisson_and_belong_to_their_sample() -> None:
    weights = poisson_weights(np.arange(2000), 5)
    assert (weights[0] == 1.0).all()
    drawn = weights[1:].ravel()
    counts = np.bincount(drawn.astype(int), minlength=8)
    expected = stats.poisson.pmf(np.arange(8), 1.0) * drawn.size
    expected[7] += drawn.size - expected.sum()
    counts = np.append(counts[:7], counts[7:].sum())
    assert stats.chisquare(counts, expected).pvalue > 1e-3
    assert np.array_equal(poisson_weights(np.array([1234]), 5)[:, 0], weights[:, 1234])
    assert not np.array_equal(poisson_weights(np.array([1234]), 6)[:, 0], weights[:, 1234])
    # Of different samples they are independent.
    pairs = np.corrcoef(weights[1:, :50].T)[np.triu_indices(50, 1)]
    assert np.abs(pairs).max() < 5.0 / math.sqrt(statistics.REPLICATIONS)


# Memory.


def peak_of(cases: int) -> int:
    def stream() -> Iterator[Values]:
        for k in range(0, cases, 4096):
            n = min(4096, cases - k)
            value = np.random.default_rng(k).normal(0.0, 1.0, 2 * n)
            yield Values(np.tile([0, 1], n), value, np.repeat(np.arange(k, k + n), 2))

    tracemalloc.start()
    quantiles(stream, moments_of(stream, 2), LEVELS)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return peak


def test_memory_does_not_grow_with_the_cases(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(statistics, "CANDIDATES", 2**12)
    peak_of(1000)
    few, many = peak_of(30_000), peak_of(300_000)
    assert many < 1.1 * few + 1e5

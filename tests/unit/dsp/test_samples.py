"""Grids beside pauses, runs of flags, white noise and steps: against what defines them."""

import math
from itertools import pairwise

import numpy as np
import pytest

from strapdown.dsp.samples import (
    check_segment,
    constant_beside_noise,
    even_step,
    noise_free,
    occupied_grid,
    positive_step,
    true_runs,
    white_sd,
)
from strapdown.errors import ConfigError, DataError


@pytest.mark.parametrize("reach", [0.5, 1.3])
def test_a_grid_beside_long_pauses_is_that_of_the_whole_where_samples_follow(reach):
    rng, step = np.random.default_rng(3), 0.5
    time = np.sort(np.concatenate([rng.uniform(at, at + 7.0, 9) for at in (2.0, 400.0, 9000.0)]))
    end = time[-1] + 1.0
    whole, grid = np.arange(time[0], end, step), occupied_grid(time, end, step, reach)
    at = np.round((grid - time[0]) / step).astype(int)
    # The numbers are of thousands: a few roundings of each.
    np.testing.assert_allclose(grid, whole[at], atol=1e-11)
    next_in = time[np.minimum(time.searchsorted(whole), len(time) - 1)] - whole
    follows = (next_in >= 0.0) & (next_in <= reach)
    assert set(np.flatnonzero(follows)) <= set(at)
    # None that is farther from its sample than by the step that rounding up adds, and the cell.
    assert (next_in[at][next_in[at] >= 0.0] < reach + 2.0 * step).all()
    far = np.array([0.0, 1e3, 2e3, 3e3])
    assert len(occupied_grid(far, 4e3, step, reach)) <= 4 * (reach / step + 2.0)


def test_a_grid_without_long_pauses_is_whole():
    time = np.arange(0.0, 10.0, 0.3)
    np.testing.assert_array_equal(occupied_grid(time, 10.0, 0.2, 0.4), np.arange(0.0, 10.0, 0.2))


@pytest.mark.parametrize("seed", range(4))
def test_runs_are_the_true_flags_and_do_not_touch(seed):
    flags = np.random.default_rng(seed).random(50) < 0.5
    runs = true_runs(flags)
    rebuilt = np.zeros(50, dtype=bool)
    for run in runs:
        rebuilt[run] = True
    np.testing.assert_array_equal(rebuilt, flags)
    assert all(a.stop < b.start for a, b in pairwise(runs))
    assert true_runs(np.zeros(5, dtype=bool)) == []
    assert true_runs(np.ones(5, dtype=bool)) == [slice(0, 5)]


def test_white_noise_is_measured_beside_a_trend():
    count, sd = 20_000, np.array([0.3, 2.0])
    noise = np.random.default_rng(0).normal(0.0, sd, (count, 2))
    trend = np.outer(np.arange(count), [5.0, -0.1])
    # Second differences are correlated by -2/3 and 1/6: their squares have a mean whose relative
    # variance is 2 (1 + 2 (4/9 + 1/36)) / n, the root half of its deviation; five of these.
    bound = 5.0 * 0.5 * math.sqrt(2.0 * (1.0 + 2.0 * (4.0 / 9.0 + 1.0 / 36.0)) / count)
    np.testing.assert_allclose(white_sd(noise + trend), sd, rtol=bound)
    assert not noise_free(noise)
    assert noise_free(np.sin(np.arange(500)[:, None] * 0.1))


def test_a_channel_that_changes_later_is_not_constant():
    late, noise = np.zeros(200), np.random.default_rng(1).normal(size=200)
    assert constant_beside_noise([late, noise], 100, 50) == [True, False]
    late[150] = 1.0
    assert constant_beside_noise([late, noise], 100, 50) == [False, False]


@pytest.mark.parametrize("step", [0.0, -1.0, math.inf, math.nan])
def test_a_step_is_positive_and_finite(step):
    with pytest.raises(ConfigError) as refused:
        positive_step(step)
    assert refused.value.finding.code == "dsp.no-distance-samples"
    assert positive_step(0.25) == 0.25


def test_a_stamp_may_be_off_the_grid_by_a_tenth_of_a_step():
    stamps = np.arange(50.0)
    stamps[20] += 0.09
    assert even_step(stamps) == 1.0
    stamps[20] += 0.02
    with pytest.raises(DataError) as refused:
        even_step(stamps)
    assert refused.value.finding.code == "dsp.samples-not-evenly-spaced-usual"


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_the_row_of_a_value_that_is_not_finite_is_that_of_the_record(bad):
    values = np.full((4, 3), 1e308)
    check_segment(values, 100)  # a sum that overflows is of finite values
    values[2, 1] = bad
    with pytest.raises(DataError) as refused:
        check_segment(values, 100)
    finding = refused.value.finding
    assert (finding.code, finding.row, finding.data["channel"]) == ("dsp.channel", 103, 1)

"""The random errors have the statistics that are stated, and each its own stream.

Every statistical bound has a false-alarm probability of 1e-6 for a code that is right; the seeds
are fixed, so that a test that passes goes on passing.
"""

from __future__ import annotations

import mpmath
import numpy as np
import pytest
from scipy.stats import chi2, norm

from strapdown.sensors import error_chain as draws

ALARM = 1e-6
ONE = (1.0, 1.0, 1.0)


def check_variance(found, expected, freedom):
    """A sum of squares of `freedom` independent normal numbers, over their number."""
    low, high = chi2.ppf([ALARM / 2, 1 - ALARM / 2], freedom) / freedom
    assert low * expected < found < high * expected


def allan_variance(values, size):
    """Non-overlapping, with the number of independent differences (every second one)."""
    means = values[: len(values) // size * size].reshape(-1, size, values.shape[1]).mean(axis=1)
    apart = means[1::2] - means[: len(means) // 2 * 2 : 2]
    return 0.5 * (apart**2).mean(), apart.size


@pytest.mark.parametrize("rate", [1.0, 200.0])
@pytest.mark.parametrize("size", [1, 10, 100])
def test_white_noise_has_the_allan_deviation_of_its_density(rate, size):
    steps = np.full(100_000, 1.0 / rate)
    noise = draws.white_noise(3, steps, (0.02, 0.02, 0.02))
    found, freedom = allan_variance(noise, size)
    # IEEE Std 952-1997, C.1: N²/τ.
    check_variance(found, 0.02**2 / (size / rate), freedom)


@pytest.mark.parametrize("size", [1, 4, 32, 256])
@pytest.mark.parametrize("mean", [False, True])
def test_a_random_walk_has_the_allan_deviation_of_its_density(size, mean):
    steps = np.full(200_000, 0.1)
    walk = draws.random_walk(4, steps, (0.5, 0.5, 0.5), mean)
    found, freedom = allan_variance(walk, size)
    tau = 0.1 * size
    # Means of the walk itself: K² τ/3 (IEEE Std 952-1997, C.1.1.4). Means of m samples of it:
    # K² τ/3 (1 + 1/(2 m²)), by the sums of squares that replace the integrals.
    expected = 0.5**2 * tau / 3.0 * (1.0 if mean else 1.0 + 0.5 / size**2)
    check_variance(found, expected, freedom)


def gauss_markov_allan(x):
    """Allan variance of a unit Gauss-Markov process at x = τ/correlation time, IEEE 952 C.1.1.5."""
    return 2.0 / x * (1.0 - (3.0 - 4.0 * np.exp(-x) + np.exp(-2.0 * x)) / (2.0 * x))


# Single steps tell what is drawn within a step, many what goes on from step to step.
@pytest.mark.parametrize(("step", "size"), [(0.5, 1), (2.0, 1), (0.1, 5), (0.1, 20), (0.1, 100)])
def test_the_mean_of_a_gauss_markov_process_has_its_allan_deviation(step, size):
    steps = np.full(200_000, step)
    found, freedom = allan_variance(draws.gauss_markov(5, steps, ONE, 1.0, True), size)
    # Neighbouring differences are correlated by what is left after a window; at least a half
    # of them count as independent (windows of half a correlation time and more).
    check_variance(found, gauss_markov_allan(step * size), freedom // 2)


def test_the_factor_from_bias_instability_is_the_peak_of_that_curve():
    from strapdown.sensors.catalogue import ALLAN_OF_GAUSS_MARKOV

    x = np.linspace(0.5, 5.0, 450_001)
    peak = np.sqrt(gauss_markov_allan(x).max())
    # The peak is flat: a grid of 1e-5 finds it to 1e-10; the factor has five digits.
    assert peak == pytest.approx(ALLAN_OF_GAUSS_MARKOV, abs=1e-5)


@pytest.mark.parametrize("mean", [False, True])
def test_a_gauss_markov_process_is_stationary_on_irregular_stamps(mean):
    """The variance at a fixed sample, over many seeds, and the covariance with a later one."""
    steps = np.array([0.3, 0.3, 1.7, 0.01, 0.6])
    generator = np.random.SeedSequence(6)
    runs = np.array(
        [draws.gauss_markov(draws.child(generator, k), steps, ONE, 2.0, mean) for k in range(700)]
    )
    runs = runs.transpose(0, 2, 1).reshape(-1, steps.size)
    ends = np.cumsum(steps)
    starts = ends - steps
    for j in range(steps.size):
        for k in range(j, steps.size):
            if mean:
                expected = mean_covariance(starts[j], ends[j], starts[k], ends[k], 2.0)
                own = [mean_covariance(starts[i], ends[i], starts[i], ends[i], 2.0) for i in (j, k)]
            else:
                expected, own = np.exp(-(ends[k] - ends[j]) / 2.0), [1.0, 1.0]
            # The mean of n products of normals has the variance (s11 s22 + s12²)/n; its
            # distribution is normal to far better than the bound for n = 2100.
            sd = np.sqrt((own[0] * own[1] + expected**2) / len(runs))
            assert abs((runs[:, j] * runs[:, k]).mean() - expected) < norm.isf(ALARM / 2) * sd


def mean_covariance(a, b, c, d, tau):
    """Of the means over [a, b] and [c, d] of a unit process, by integrating exp(-|s-t|/τ)."""
    h = (b - a) / tau
    if a == c:
        return float(2.0 / h - 2.0 / h**2 * (1.0 - np.exp(-h)))
    k = (d - c) / tau
    gap = np.exp(-(c - b) / tau)
    return float(gap * (1.0 - np.exp(-h)) * (1.0 - np.exp(-k)) / (h * k))


@pytest.mark.parametrize("h", [1e-9, 1e-5, 0.05, 0.0999999, 0.1, 0.3, 3.0, 50.0])
def test_the_variance_of_the_integral_is_right_on_both_sides_of_the_switch(h):
    with mpmath.workdps(60):
        x = mpmath.mpf(h)
        exact = 2 * x - 3 + 4 * mpmath.exp(-x) - mpmath.exp(-2 * x)
        found = mpmath.mpf(float(draws.integral_variance(np.array([h]))[0]))
        error = abs(found / exact - 1)
    # Closed form at h = 0.1: terms of 4 cancel to 6e-4, so that 2^-52 of each is 2e-12 of it.
    assert error < 3e-12


def test_streams_are_those_of_successive_spawns_and_leave_the_seed_alone():
    root = np.random.SeedSequence(9)
    spawned = np.random.SeedSequence(9).spawn(3)[2].spawn(2)[1]
    assert (draws.child(root, 2, 1).generate_state(4) == spawned.generate_state(4)).all()
    assert root.n_children_spawned == 0
    assert (draws.child(9, 2, 1).generate_state(4) == spawned.generate_state(4)).all()


def test_no_two_streams_are_alike():
    first = {
        tuple(draws.normal(0, kind, 4)[:, axis])
        for kind in range(draws.JITTER + 1)
        for axis in range(3)
    }
    assert len(first) == 3 * (draws.JITTER + 1)


def test_a_longer_record_begins_with_the_draws_of_a_shorter_one():
    short, long = np.full(10, 0.1), np.full(30, 0.1)
    for mean in (False, True):
        for make in (
            lambda s, m: draws.gauss_markov(1, s, ONE, 3.0, m),
            lambda s, m: draws.random_walk(1, s, ONE, m),
        ):
            assert np.array_equal(make(short, mean), make(long, mean)[:10])


def test_an_endless_correlation_is_a_constant_of_the_stated_size():
    steps = np.full(50, 0.1)
    for mean in (False, True):
        x = draws.gauss_markov(2, steps, ONE, np.inf, mean)
        assert (x == x[0]).all()
        assert len(set(x[0])) == 3

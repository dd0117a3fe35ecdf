"""Deviations against allantools, and noise terms against what was simulated."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import quad

from strapdown._kernels.allan import CHUNK, overlapping_variances
from strapdown._kernels.compilation import interpreted
from strapdown.errors import DataError
from strapdown.sensors.error_chain import apply
from strapdown.sensors.noise_terms import (
    allan_model,
    block_covariance,
    deviations,
    levels_of,
    noise_terms,
    pooled_terms,
)
from strapdown.sensors.triad_errors import TriadErrors

# allantools 2024.06: oadev, mdev and ohdev of `series()` with rate=100.0, data_type="freq" and
# taus=[0.01, 0.02, 0.05, 0.1, 0.4, 1.0].
REFERENCE = {
    "allan": (
        *(1.0237362104168612, 0.7407001987334096, 0.48147611674763774),
        *(0.34183495950658993, 0.20110278623636343, 0.16198061432621047),
    ),
    "modified": (
        *(1.0237362104168608, 0.5935614439153006, 0.342513141342766),
        *(0.23672104952081718, 0.1658029198587633, 0.04583312249554354),
    ),
    "hadamard": (
        *(1.0223172472028534, 0.7269571754392434, 0.4790904515925729),
        *(0.3348902610990835, 0.18418109303282806, 0.16529394660023886),
    ),
}


def series():
    draws = [np.random.Generator(np.random.PCG64(seed)).standard_normal(400) for seed in (27, 28)]
    return draws[0] + 0.05 * np.cumsum(draws[1])


@pytest.mark.parametrize("kind", REFERENCE)
def test_deviations_are_those_of_allantools(kind):
    found = deviations(series(), 0.01, [1, 2, 5, 10, 40, 100])
    # Sums of 400 numbers of order one in another order: some hundred roundings.
    np.testing.assert_allclose(found[kind], REFERENCE[kind], rtol=1e-12)
    np.testing.assert_allclose(found.index, [0.01, 0.02, 0.05, 0.1, 0.4, 1.0], rtol=1e-15)


def test_deviations_of_a_record_of_several_parts_are_those_of_their_definition():
    """The kernel takes a part of the record at a time, and carries running sums over its end."""
    rate = np.tile(series(), 13)
    rate += 0.1 * np.arange(rate.size) % 7.0
    x = np.append(0.0, np.cumsum(rate - rate.mean()))
    factors = [1, 3, 40, 700, 1700]
    assert rate.size > 2 * CHUNK
    found = deviations(rate, 0.01, factors)
    for m, row in zip(factors, found.to_dict("records"), strict=True):
        second = x[2 * m :] - 2.0 * x[m:-m] + x[: -2 * m]
        third = second[m:] - second[:-m]
        means = np.convolve(second, np.full(m, 1.0 / m), "valid")
        squares = [np.mean(one**2) / m**2 for one in (second, means, third)]
        wanted = np.sqrt(np.array(squares) / [2.0, 2.0, 6.0])
        # Sums of 5200 numbers that a running sum passes on: some thousand roundings.
        np.testing.assert_allclose(list(row.values())[:3], wanted, rtol=1e-11)


def test_averaging_times_are_even_on_a_logarithm_and_the_mean_does_not_matter():
    values = series()
    found, shifted = deviations(values, 0.01), deviations(values + 1e3, 0.01)
    assert found.index[0] == 0.01
    assert found.index[-1] == pytest.approx(0.01 * (400 // 9))
    # A sample near 1000 is rounded to 1e-13.
    np.testing.assert_allclose(found["allan"], shifted["allan"], rtol=1e-11)
    with pytest.raises(DataError, match="too few"):
        deviations([1.0, 2.0], 0.01)


# Two-sided spectra of a rate with coefficient one, without aliasing.
SPECTRA = {
    "N": lambda f: 1.0,
    "B": lambda f: 1.0 / (2.0 * math.pi * f),
    "K": lambda f: 1.0 / (2.0 * math.pi * f) ** 2,
    "GM": lambda f: 2.0 * 5.0 / (1.0 + (2.0 * math.pi * f * 5.0) ** 2),
}


@pytest.mark.parametrize("term", SPECTRA)
def test_a_shape_has_the_allan_variance_of_its_spectrum(term):
    """IEEE Std 952, C.1: variance is four times the integral of S sin^4(x)/x^2, x = pi f tau."""
    tau = 2.0
    # The tail beyond f = 200 is below sin^4/(x^2): 1/(pi tau)^2/200 of that of white noise.
    parts = [
        quad(
            lambda f: (
                SPECTRA[term](f) * math.sin(math.pi * f * tau) ** 4 / (math.pi * f * tau) ** 2
            ),
            0.5 * k + 1e-12,
            0.5 * (k + 1),
        )[0]
        for k in range(400)
    ]
    variance = 4.0 * sum(parts)
    assert allan_model({term: 1.0}, tau, 5.0) ** 2 == pytest.approx(variance, rel=1e-3)


def test_characteristic_points_are_those_of_the_standard():
    assert allan_model({"Q": 2.0}, 4.0) == pytest.approx(math.sqrt(3.0) * 2.0 / 4.0)
    assert allan_model({"N": 2.0}, 1.0) == pytest.approx(2.0)
    assert allan_model({"B": 2.0}, 7.0) == pytest.approx(2.0 * 0.664, rel=1e-3)
    assert allan_model({"K": 2.0}, 3.0) == pytest.approx(2.0)
    assert allan_model({"R": 2.0}, math.sqrt(2.0)) == pytest.approx(2.0)
    # Maximum of a Gauss-Markov process: 0.61736 at 1.893 correlation times (docstring of sensors).
    assert allan_model({"GM": 1.0}, 1.893 * 30.0, 30.0) == pytest.approx(0.61736, abs=1e-4)


def test_covariance_of_blocks_is_that_of_the_process():
    white = block_covariance("N", 4, 0.5)
    np.testing.assert_allclose(white, np.eye(4) / 0.5, atol=1e-14)
    # Means of a random walk from zero over blocks: K² h (j - 1/2 - ...); differences have 2/3 K² h.
    walk = block_covariance("K", 3, 2.0)
    difference = np.array([-1.0, 1.0, 0.0])
    assert difference @ walk @ difference == pytest.approx(2.0 / 3.0 * 2.0)
    slow = block_covariance("GM", 3, 1.0, 1e4)
    # A slow Gauss-Markov process is a random walk with K² = 2/T.
    assert difference @ slow @ difference == pytest.approx(2.0e-4 * 2.0 / 3.0, rel=1e-3)


def test_levels_keep_all_that_white_noise_has():
    values = np.random.default_rng(3).standard_normal(64_000)
    levels, means, _, block = levels_of(values, 0.01)
    used = sum(one.basis.shape[1] * one.runs for one in levels)
    # All but the mean, the ramp, and what is left of the last runs.
    assert values.size - used <= 2 + levels[0].count * (1 + len(levels))
    assert means.size <= 96
    assert block * means.size <= 640.0


def simulated(seed, n=200_000, dt=0.02, **errors):
    time = dt * np.arange(1, n + 1)
    made = TriadErrors(**errors)
    return apply(made, time, np.zeros((n, 3)), seed=seed, sampling="mean")[:, 0], dt


def test_white_noise_alone_has_bounds_on_the_rest():
    found = noise_terms(*simulated(1, noise_density=1e-3))
    assert [one.name for one in found.terms if one.observable] == ["N"]
    n = found.term("N")
    # Standard deviation of a variance from n numbers is √(2/n) of it; five of them.
    assert n.value == pytest.approx(1e-3, rel=5.0 * math.sqrt(0.5 / 200_000))
    assert n.low < 1e-3 < n.high
    for name in "QBK":
        assert math.isnan(found.term(name).value)
        assert found.term(name).high > 0.0
    # White noise over 4000 s hides a flicker of at most a few times N/√4000.
    assert found.term("B").high < 10.0 * 1e-3 / math.sqrt(4000.0)


def test_random_walk_and_ramp_are_found_with_their_intervals():
    found = noise_terms(*simulated(2, noise_density=1e-4, random_walk=1e-5))
    assert {one.name for one in found.terms if one.observable} == {"N", "K"}
    assert found.term("K").low < 1e-5 < found.term("K").high
    found = noise_terms(*simulated(2, noise_density=1e-4, trend=3e-8))
    assert {one.name for one in found.terms if one.observable} == {"N", "R"}
    assert found.term("R").low < 3e-8 < found.term("R").high


def test_records_of_one_sensor_are_fitted_together():
    truth = {"N": 1e-4, "K": 1e-5}
    records = [
        simulated(seed, n, noise_density=truth["N"], random_walk=truth["K"])[0]
        for seed, n in ((21, 60_000), (22, 60_000), (23, 60_000), (24, 45_000))
    ]
    alone = noise_terms(records[0], 0.02)
    both = pooled_terms([records[0]], [0.02], [None])
    assert [(t.name, t.high) for t in both.terms] == [(t.name, t.high) for t in alone.terms]
    found = pooled_terms(records, [0.02] * 4, [None] * 4)
    for name, value in truth.items():
        term, single = found.term(name), alone.term(name)
        assert term.observable
        assert term.low < value < term.high
        # Four records have 3.75 times the samples: intervals are 1.94 times as narrow in the
        # logarithm, that of K known to 15 % itself, from one record.
        part = math.log(single.high / single.low) / math.log(term.high / term.low)
        assert 1.94 * 0.7 < part < 1.94 * 1.4
    # Terms are those of two records with their moments: a second copy of one changes no estimate.
    twice = pooled_terms(records[:1] * 2, [0.02] * 2, [None] * 2)
    for name in truth:
        assert twice.term(name).value == pytest.approx(alone.term(name).value, rel=1e-3)


def test_deviations_of_several_records_are_means_over_all_differences():
    first, second = series()[:250], series()[250:]
    found = deviations([first, second], 0.01, [1, 5, 100])
    for m in (1, 5):
        squares = []
        for record in (first, second):
            y = np.convolve(record, np.ones(m) / m, mode="valid")
            squares.append(np.square(y[m:] - y[:-m]))
        allan = math.sqrt(0.5 * np.concatenate(squares).mean())
        assert found.loc[0.01 * m, "allan"] == pytest.approx(allan, rel=1e-12)
        parts = len(first) / m + len(second) / m - 2.0
        assert found.loc[0.01 * m, "relative_sd"] == pytest.approx(1.0 / math.sqrt(2.0 * parts))
    # The second is too short for a mean of 100.
    alone = deviations(first, 0.01, [100])
    assert found.loc[1.0, "allan"] == alone.loc[1.0, "allan"]


def test_the_effect_of_temperature_is_not_taken_for_noise():
    rate, dt = simulated(5, noise_density=1e-4)
    warm = 20.0 + 10.0 * (1.0 - np.exp(-np.arange(rate.size) * dt / 600.0))
    found = noise_terms(rate + 2e-5 * warm, dt, warm)
    assert {one.name for one in found.terms if one.observable} == {"N", "C"}
    assert found.term("C").low < 2e-5 < found.term("C").high
    assert {o.name for o in noise_terms(rate + 2e-5 * warm, dt).terms if o.observable} != {"N"}


def test_units_do_not_change_what_is_observable():
    rate, dt = simulated(2, noise_density=1e-4, random_walk=1e-5)
    one, other = noise_terms(rate, dt), noise_terms(1e5 * rate + 9.8, dt)
    for a, b in zip(one.terms, other.terms, strict=True):
        assert (a.name, a.observable) == (b.name, b.observable)
        # The scoring ends within 1e-5 of the log-likelihood; a bound within 0.02 of a logarithm.
        np.testing.assert_allclose(b.high, 1e5 * a.high, rtol=0.03)


def test_noise_colored_by_a_filter_is_left_out():
    rate, dt = simulated(4, noise_density=1e-3)
    kernel = np.array([0.25, 0.5, 0.25])
    found = noise_terms(np.convolve(rate, kernel, mode="same"), dt)
    assert found.up_to_hz < 0.5 / dt / 2.0
    # The filter's gain is 1 - (2 pi f dt)²/4: within 4 % below a twelfth of the rate.
    assert found.term("N").value == pytest.approx(1e-3, rel=0.05)


def test_channels_that_share_the_covariances_have_their_own_noise_to_the_bit():
    known = {}
    for seed in (4, 5):
        rate, dt = simulated(seed, noise_density=1e-3, random_walk=1e-4)
        alone, shared = noise_terms(rate, dt), pooled_terms([rate], [dt], [None], known)
        assert repr(shared.terms) == repr(alone.terms)
    assert len(known) == 1
    longer = np.append(rate, rate)
    assert repr(pooled_terms([longer], [dt], [None], known).terms) == repr(
        noise_terms(longer, dt).terms
    )
    assert len(known) == 2


@pytest.mark.parametrize("count", [100, 2 * CHUNK + 77])
def test_the_compiled_kernel_has_the_bits_of_its_source(count):
    phase = np.append(0.0, np.cumsum(np.random.default_rng(3).standard_normal(count)))
    factors = np.array([1, 3, 8, 33, 49])
    compiled, source = np.empty((5, 6)), np.empty((5, 6))
    overlapping_variances(phase, factors, compiled)
    interpreted(overlapping_variances)(phase, factors, source)
    assert (compiled == source).all()


def test_a_record_that_is_too_short_or_constant_is_refused():
    with pytest.raises(DataError) as refused:
        noise_terms(np.zeros(100), 0.01)
    assert refused.value.finding.code == "allan.too-short"
    # A tenth is no binary fraction: the mean of many differs from each by rounding.
    for value in (1.0, 0.1):
        with pytest.raises(DataError) as refused:
            noise_terms(np.full(2003, value), 0.01)
        assert refused.value.finding.code == "allan.constant"


@pytest.mark.parametrize("count", [900, 4001, 60_000])
def test_symmetric_and_antisymmetric_coefficients_are_not_correlated(count):
    """So that a level's likelihood is that of its halves; the whole basis stays orthonormal."""
    from strapdown.sensors.noise_terms import levels_of

    rate = np.random.default_rng(1).standard_normal(count)
    for level in levels_of(rate, 0.01)[0]:
        basis = level.basis
        assert basis.T @ basis == pytest.approx(np.eye(basis.shape[1]), abs=1e-12)
        halves = level.halves
        assert len(halves) == 2
        assert sorted(np.concatenate(halves)) == list(range(basis.shape[1]))
        for term in ("Q", "N", "B", "K", "GM"):
            whole = level.covariance(term, 0.5)
            # Rounding of sums of terms as large as the covariance before projection.
            size = np.abs(block_covariance(term, level.count, level.block, 0.5)).max()
            assert np.abs(whole[np.ix_(*halves)]).max() < 1e-10 * size

"""Decimation by a whole number: bands, delay, integrals, and pieces."""

import numpy as np
import pytest

from strapdown.dsp.decimation import decimate, fir_decimation
from strapdown.errors import ConfigError

STEP = 1e-3


def outputs(low_pass, values):
    state = low_pass.begin(values.shape[1])
    state, out = low_pass.advance(state, values)
    number = low_pass.centre + low_pass.factor * np.arange(len(out))
    return number, out


@pytest.mark.parametrize("means", [False, True])
@pytest.mark.parametrize("attenuation", [40.0, 60.0, 80.0, 100.0])
@pytest.mark.parametrize("factor", [2, 5, 10, 100])
def test_bands_keep_what_is_stated(factor, attenuation, means):
    low_pass = fir_decimation(STEP, factor, means=means, attenuation=attenuation)
    design = low_pass.design
    stop = low_pass.response(np.linspace(design.stopband, 0.5 / STEP, 4000))
    assert 20.0 * np.log10(np.abs(stop).max()) <= -attenuation
    f = np.linspace(0.0, design.passband, 300)
    expected = np.sinc(f * STEP) if means else 1.0
    assert np.abs(low_pass.response(f) - expected).max() <= design.ripple


@pytest.mark.parametrize("means", [False, True])
@pytest.mark.parametrize("factor", [2, 10, 25])
def test_every_sample_counts_the_same(factor, means):
    """Weights a factor apart sum to 1/factor: rounding of as many, and symmetric to the bit."""
    weights = fir_decimation(STEP, factor, means=means).weights
    sums = np.bincount(np.arange(len(weights)) % factor, weights)
    np.testing.assert_allclose(sums, 1.0 / factor, rtol=1e-14)
    np.testing.assert_allclose(weights, weights[::-1], rtol=1e-13, atol=1e-19)
    assert weights.sum() == pytest.approx(1.0, abs=1e-15)


@pytest.mark.parametrize("means", [False, True])
def test_integral_of_the_outputs_is_that_of_the_samples(means):
    """A turn within the record, of white frequencies: outputs sum to the same angle."""
    low_pass = fir_decimation(STEP, 10, means=means)
    rng = np.random.default_rng(1)
    x = np.zeros((5000, 3))
    x[1000:4000] = rng.standard_normal((3000, 3))
    _, out = outputs(low_pass, x)
    # 3000 numbers of one: rounding of 1e-16 times their sum of sizes.
    np.testing.assert_allclose(10.0 * out.sum(axis=0), x.sum(axis=0), atol=3000 * 3e-16)


def test_agrees_with_the_decimation_at_any_stamps():
    """Same kernel, read elsewhere; weights differ by the share that keeps integrals, the ripple."""
    low_pass = fir_decimation(STEP, 10)
    x = np.random.default_rng(2).standard_normal((4000, 2))
    number, out = outputs(low_pass, x)
    other = decimate(x, 0.0, STEP, STEP * number, low_pass.design)
    assert np.abs(out - other.values).max() <= 5.0 * low_pass.design.ripple
    assert low_pass.noise_factor == pytest.approx(other.noise_factor[10], rel=1e-3)


@pytest.mark.parametrize("frequency", [1.0, 10.0, 24.0])
def test_means_and_values_stand_at_the_same_instants(frequency):
    """Tones of values and of means over steps, which are late by half a step: no shift is left."""
    t = STEP * np.arange(6000)
    w = 2.0 * np.pi * frequency
    values = np.sin(w * t)[:, None]
    means = ((np.cos(w * (t - STEP)) - np.cos(w * t)) / (w * STEP))[:, None]
    for x, kind in ((values, False), (means, True)):
        low_pass = fir_decimation(STEP, 10, means=kind)
        number, out = outputs(low_pass, x)
        # Means lose what the sinc says, and both are off by the ripple.
        gain = np.sinc(frequency * STEP) if kind else 1.0
        np.testing.assert_allclose(
            out[:, 0], gain * np.sin(w * t[number]), atol=1.01 * low_pass.design.ripple
        )


@pytest.mark.parametrize("cut", [1, 13, 999])
def test_any_cut_gives_the_same_bits(cut):
    low_pass = fir_decimation(STEP, 10, means=True)
    x = np.random.default_rng(3).standard_normal((2500, 6))
    _, whole = outputs(low_pass, x)
    state, parts = low_pass.begin(6), []
    for k in range(0, len(x), cut):
        state, out = low_pass.advance(state, x[k : k + cut])
        parts.append(out)
    np.testing.assert_array_equal(np.vstack(parts), whole)


@pytest.mark.parametrize("factor", [1, 0, -3, 2.5])
def test_factor_that_is_none(factor):
    with pytest.raises(ConfigError):
        fir_decimation(STEP, factor)

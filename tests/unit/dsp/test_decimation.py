"""Decimation and means: what passes, what does not, where, and with how much noise."""

import numpy as np
import pytest
from scipy.signal import kaiser_beta
from tests.coded import coded

from strapdown.dsp.decimation import decimate, low_pass_design, mean_samples
from strapdown.errors import ConfigError, DataError

STEP = 1e-4
RATE = 200.0


def stamps_of(begin, end, rate=RATE):
    return np.arange(round(begin * rate), round(end * rate) + 1) / rate


@pytest.mark.parametrize("attenuation", [40.0, 45.0, 45.1, 80.0, 150.0])
def test_the_window_is_kaisers_to_the_last_bit(attenuation):
    # Five decibels in reserve; the formula changes at 50 dB.
    design = low_pass_design(STEP, RATE, attenuation=attenuation)
    assert design.beta == kaiser_beta(attenuation + 5.0)


@pytest.mark.slow
@pytest.mark.parametrize("attenuation", [40.0, 60.0, 80.0, 100.0, 120.0])
@pytest.mark.parametrize("passband", [0.5, 0.8])
def test_bands_keep_what_the_design_states(attenuation, passband):
    design = low_pass_design(STEP, RATE, passband=passband, attenuation=attenuation)
    stop = design.response(np.linspace(design.stopband, 0.5 / STEP, 5000), STEP)
    assert 20.0 * np.log10(np.abs(stop).max()) <= -attenuation
    inside = design.response(np.linspace(0.0, design.passband, 500), STEP)
    assert np.abs(inside - 1.0).max() <= design.ripple
    assert design.stopband == 100.0
    assert design.passband == passband * 100.0


@pytest.mark.parametrize("frequency", [100.0, 137.0, 195.0, 200.0, 1000.0, 4900.0])
def test_tone_above_nyquist_is_suppressed(frequency):
    t = STEP * np.arange(20001)
    design = low_pass_design(STEP, RATE)
    tones = np.column_stack([np.sin(2 * np.pi * frequency * t), np.cos(2 * np.pi * frequency * t)])
    out = decimate(tones, 0.0, STEP, stamps_of(0.2, 1.8), design)
    assert out.whole.all()
    assert np.abs(out.values).max() <= 1e-4


@pytest.mark.parametrize("frequency", [0.5, 10.0, 30.0, 50.0])
@pytest.mark.parametrize("shift", [0.0, 0.3e-4])
def test_tone_in_the_passband_stays_in_place(frequency, shift):
    """Zero delay, on stamps of samples and between them, for several channels at once."""
    t = 3.0 + STEP * np.arange(20001)
    design = low_pass_design(STEP, RATE)
    at = stamps_of(3.2, 4.8) + shift
    values = np.column_stack([np.sin(2 * np.pi * frequency * t), np.full(len(t), 7.0)])
    out = decimate(values, 3.0, STEP, at, design)
    # Between samples each of the two images passes by the stopband's 1e-4, too.
    np.testing.assert_allclose(
        out.values[:, 0], np.sin(2 * np.pi * frequency * at), atol=3.0 * design.ripple
    )
    # Weights sum to 1: rounding of a thousand.
    np.testing.assert_allclose(out.values[:, 1], 7.0, rtol=1e-13)


def test_any_ratio_and_any_stamps():
    t = STEP * np.arange(20001)
    at = np.sort(np.random.default_rng(1).uniform(0.3, 1.7, 50))
    design = low_pass_design(STEP, 173.3)
    out = decimate(np.sin(2 * np.pi * 20.0 * t), 0.0, STEP, at, design)
    np.testing.assert_allclose(
        out.values[:, 0], np.sin(2 * np.pi * 20.0 * at), atol=3.0 * design.ripple
    )


def test_ends_invent_no_transient():
    """Constants and lines pass up to the first and last sample."""
    t = STEP * np.arange(5001)
    values = np.column_stack([np.full(5001, -9.8), 5.0 - 300.0 * t])
    out = decimate(values, 0.0, STEP, stamps_of(0.0, 0.5), low_pass_design(STEP, RATE))
    np.testing.assert_allclose(out.values[:, 0], -9.8, rtol=1e-12)
    at = stamps_of(0.0, 0.5)
    np.testing.assert_allclose(out.values[:, 1], 5.0 - 300.0 * at, atol=1e-10)
    reach = low_pass_design(STEP, RATE).reach
    np.testing.assert_array_equal(out.whole, (at >= reach) & (at <= 0.5 - reach))


def test_area_is_kept():
    # The sum of samples at a rate is the spectrum at zero and at multiples of the rate. The kernel
    # lets 1e-4 of those by, each no larger than ∫|x|; 50 lie below the samples' own rate.
    t = STEP * np.arange(10001)
    pulse = np.where((t > 0.4) & (t < 0.5), np.sin(np.pi * (t - 0.4) / 0.1) ** 2, 0.0)
    pulse += np.where(t > 0.42, 0.3 * np.exp(-(t - 0.42) / 0.03) * np.sin(2 * np.pi * 195 * t), 0.0)
    out = decimate(pulse, 0.0, STEP, stamps_of(0.0, 1.0), low_pass_design(STEP, RATE))
    assert (
        abs(out.values.sum() / RATE - pulse.sum() * STEP) < 50 * 1e-4 * np.abs(pulse).sum() * STEP
    )
    means = mean_samples(pulse, 0.0, STEP, stamps_of(0.005, 1.0), 0.005)
    assert means.values.sum() / RATE == pytest.approx(np.trapezoid(pulse, dx=STEP), rel=1e-12)


def test_noise_factor_is_exact():
    """By the response to a unit sample, which is what the weights are."""
    n = 3001
    at = stamps_of(0.0, 0.3)
    design = low_pass_design(STEP, RATE)
    unit = np.eye(n)
    for out in (
        decimate(unit, 0.0, STEP, at, design),
        mean_samples(unit, 0.0, STEP, at[1:], 0.005),
        mean_samples(unit, 0.0, STEP, at[1:] - 2e-5, 0.0049, sampling="mean"),
    ):
        np.testing.assert_allclose(out.noise_factor, np.linalg.norm(out.values, axis=1), rtol=1e-12)
    # In the middle: the share of the band that passes, 75 of 5000 Hz, less the flanks' loss,
    # which lies between the passband's 50 Hz and the 75 Hz of the middle of the flank.
    middle = decimate(unit, 0.0, STEP, [0.15], design).noise_factor[0]
    assert np.sqrt(50.0 / 5000.0) < middle < np.sqrt(75.0 / 5000.0)


def test_means_of_means_are_means():
    """Samples that are means add up exactly, also over parts of a step."""
    t = STEP * np.arange(1, 1001)
    exact = np.diff(-np.cos(40.0 * np.r_[0.0, t]) / 40.0) / STEP
    at = stamps_of(0.005, 0.1)
    out = mean_samples(exact, t[0], STEP, at, 0.005, sampling="mean")
    truth = (np.cos(40.0 * (at - 0.005)) - np.cos(40.0 * at)) / 40.0 / 0.005
    np.testing.assert_allclose(out.values[:, 0], truth, atol=1e-13)
    np.testing.assert_allclose(out.noise_factor, np.sqrt(1.0 / 50.0), rtol=1e-9)


def test_means_of_values_are_trapezoids():
    t = STEP * np.arange(1001)
    at = np.array([0.0123456, 0.05, 0.1])
    out = mean_samples(np.column_stack([t**2, 1.0 + 3.0 * t]), 0.0, STEP, at, 0.005)
    # Straight lines exactly; the parabola by h²/6 and no more than as much again for part steps.
    np.testing.assert_allclose(out.values[:, 1], 1.0 + 3.0 * (at - 0.0025), rtol=1e-12)
    truth = (at**3 - (at - 0.005) ** 3) / 0.015
    np.testing.assert_allclose(out.values[:, 0], truth, atol=STEP**2 / 3.0)


def test_marked_samples_are_told_where_they_count():
    marked = np.zeros((10001, 2), dtype=bool)
    marked[5000, 1] = True
    at = stamps_of(0.0, 1.0)
    out = mean_samples(np.zeros((10001, 2)), 0.0, STEP, at[1:], 0.005, marked=marked)
    assert not out.touched[:, 0].any()
    # The sample at 0.5 s ends one interval and begins the next.
    np.testing.assert_array_equal(at[1:][out.touched[:, 1]], [0.5, 0.505])


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: low_pass_design(5e-3, 400.0), ["to 400 Hz is not possible", "interpolate"]),
        (lambda: low_pass_design(STEP, RATE, passband=1.0), ["passband"]),
        (lambda: low_pass_design(STEP, RATE, attenuation=200.0), ["40 to 150 dB"]),
        (lambda: mean_samples(np.zeros(9), 0.0, STEP, [STEP], STEP / 2), ["add no information"]),
        (lambda: mean_samples(np.zeros(9), 0, STEP, [0], STEP, sampling="x"), ["unknown kind"]),
    ],
)
def test_options_out_of_range_are_refused(call, words):
    with pytest.raises(ConfigError) as error:
        call()
    for word in words:
        assert word in str(error.value)


def test_bad_records_are_refused():
    design = low_pass_design(STEP, RATE)
    with pytest.raises(DataError, match=r"reaches 0\.05"):
        decimate(np.zeros(500), 0.0, STEP, [0.02], design)
    with pytest.raises(
        DataError, check=lambda refused: refused.finding.code == "dsp.lies-outside-record-goes"
    ):
        decimate(np.zeros(10001), 0.0, STEP, [0.5, 1.1], design)
    with pytest.raises(DataError, check=coded("dsp.channel-sample-such-all-would", at_row=3)):
        decimate(np.where(np.arange(10001) == 3, np.nan, 0.0), 0.0, STEP, [0.5], design)
    with pytest.raises(
        DataError, check=lambda refused: refused.finding.code == "dsp.lies-outside-record-goes"
    ):
        mean_samples(np.zeros(101), 0.0, STEP, [0.004], 0.005)

"""Channel frequency classes: printed coefficients, the corridor of the standards, the ends."""

import math

import numpy as np
import pytest

from strapdown.dsp.channel_class import (
    CHANNEL_CLASSES,
    DESIGN_FREQUENCY,
    cfc_coefficients,
    cfc_filter,
)
from strapdown.errors import ConfigError, DataError

# Corridor of SAE J211-1 and ISO 6487:2015 for a channel of each class: frequency in Hz, upper and
# lower limit in dB, straight in the logarithm of the frequency between; no lower limit beyond -30
# dB for 600 and 1000.
NONE = -math.inf
SLOW = [(0.5, -0.5), (0.5, -1.0), (-0.3, -1.8), (-1.8, -3.8), (-5.2, -8.2), (-9.2, -13.2)]
CORRIDOR = {
    60: list(zip([0.1, 60, 75, 100, 130, 160, 452], [*SLOW, (-40.0, -48.3)], strict=True)),
    180: list(zip([0.1, 180, 225, 300, 390, 480, 1310], [*SLOW, (-40.0, -48.3)], strict=True)),
    600: list(
        zip(
            [0.1, 600, 1000, 1200, 2119, 3865],
            [(0.5, -0.5), (0.5, -1.0), (0.5, -4.0), (0.5, -10.4), (-19.2, -30.0), (-40.0, NONE)],
            strict=True,
        )
    ),
    1000: list(
        zip(
            [0.1, 1000, 1650, 2000, 3496, 6442],
            [(0.5, -0.5), (0.5, -1.0), (0.5, -4.0), (0.5, -10.7), (-18.9, -30.0), (-40.0, NONE)],
            strict=True,
        )
    ),
}


def outside(cfc, frequency, level):
    """How far a level lies outside the corridor, dB."""
    at, limits = zip(*CORRIDOR[cfc], strict=True)
    upper, lower = np.array(limits).T
    over = level - np.interp(np.log(frequency), np.log(at), upper)
    known = np.isfinite(lower)
    under = np.interp(np.log(frequency), np.log(np.array(at)[known]), lower[known]) - level
    under[frequency > np.array(at)[known][-1]] = -np.inf
    return np.maximum(over, under)


def measured_gain(frequency, cfc, step, standard):
    """Of a tone that passed, by least squares over whole periods far from the ends."""
    n = round(1.0 / step)  # one second: whole periods of every whole frequency
    t = step * np.arange(n + 2 * n // 10)
    out = cfc_filter(np.sin(2 * np.pi * frequency * t), step, cfc, standard)[n // 10 :][:n]
    t = t[n // 10 :][:n]
    sine = 2.0 / n * (out @ np.sin(2 * np.pi * frequency * t))
    cosine = 2.0 / n * (out @ np.cos(2 * np.pi * frequency * t))
    return sine, cosine


@pytest.mark.parametrize(
    ("cfc", "a0", "b1", "b2"),
    [
        (60, 0.00146031630553, 1.88903307939, -0.894874344617),
        (180, 0.0118576826432, 1.66920314293, -0.716633873504),
    ],
)
def test_coefficients_of_iso_at_10_khz(cfc, a0, b1, b2):
    c = cfc_coefficients(cfc, 1e-4)
    # Half of the last of 12 printed digits.
    assert c.a0 == pytest.approx(a0, rel=5e-12)
    assert (c.a1, c.a2) == (2.0 * c.a0, c.a0)
    assert c.b1 == pytest.approx(b1, rel=5e-12)
    assert c.b2 == pytest.approx(b2, rel=5e-12)


@pytest.mark.parametrize("standard", ["iso", "sae"])
@pytest.mark.parametrize("cfc", CHANNEL_CLASSES)
def test_coefficients_are_a_butterworth_of_scipy(cfc, standard):
    from scipy.signal import butter

    constant = {"iso": 25.0 / 12.0, "sae": 2.0775}[standard]
    b, a = butter(2, constant * cfc, fs=20e3)
    c = cfc_coefficients(cfc, 5e-5, standard)
    # scipy goes through poles and gains: some ten roundings, magnified by a0 ~ 1e-4.
    np.testing.assert_allclose([c.a0, c.a1, c.a2], b, rtol=1e-9)
    np.testing.assert_allclose([1.0, -c.b1, -c.b2], a, rtol=1e-12)


def response(frequency, cfc, step, standard="iso"):
    """The gain of both passes, 1/(1 + (tan(π f step)/wa)⁴): a two-pole Butterworth filter, twice.

    At 10 kHz the classes 60, 180 and 600 lie in the corridor of the standards throughout; class
    1000 does from 12.5 kHz on.
    """
    wa = math.tan(math.pi * cfc * DESIGN_FREQUENCY[standard] * step)
    return 1.0 / (1.0 + (np.tan(np.pi * np.asarray(frequency) * step) / wa) ** 4)


@pytest.mark.parametrize("standard", ["iso", "sae"])
@pytest.mark.parametrize(("cfc", "rate"), [(60, 1e4), (180, 1e4), (600, 1e4), (1000, 12.5e3)])
def test_measured_response_lies_in_the_corridor(cfc, rate, standard):
    highest = min(CORRIDOR[cfc][-1][0], 0.45 * rate)
    frequency = np.unique(np.round(np.geomspace(1.0, highest, 60)))
    gains = np.array([measured_gain(f, cfc, 1.0 / rate, standard) for f in frequency])
    level = 20.0 * np.log10(np.hypot(*gains.T))
    assert outside(cfc, frequency, level).max() < 0.0
    # No phase: what leaks from one period into the next is rounding of 1e4 sums.
    assert np.abs(gains[:, 1]).max() < 1e-10
    np.testing.assert_allclose(
        gains[:, 0], response(frequency, cfc, 1.0 / rate, standard), atol=1e-10
    )


def test_class_1000_at_10_khz_leaves_the_corridor_only_where_little_passes():
    frequency = np.geomspace(1.0, 4999.0, 20000)
    gain = np.asarray(response(frequency, 1000, 1e-4))
    off = outside(1000, frequency, 20.0 * np.log10(gain)) > 0.0
    assert off.any()
    assert frequency[off].min() > 2900.0
    assert gain[off].max() < 0.05
    assert outside(1000, frequency, 20.0 * np.log10(gain)).max() < 3.0


@pytest.mark.parametrize("cfc", CHANNEL_CLASSES)
def test_three_decibels_at_five_thirds_of_the_class(cfc):
    # 25/12 of the class lies at 6 dB; (5/3)/(25/12) = 0.8, and 1/(1 + 0.8^4) is -2.98 dB. Warping
    # moves it by (π f T)²/3 relative, 1e-5 at 1 MHz: 1e-4 dB.
    level = 20.0 * math.log10(response(5.0 / 3.0 * cfc, cfc, 1e-6))
    assert level == pytest.approx(-20.0 * math.log10(1.0 + 0.8**4), abs=2e-4)


@pytest.mark.parametrize("cfc", CHANNEL_CLASSES)
def test_constants_and_lines_pass_without_a_transient(cfc):
    t = 1e-4 * np.arange(1500)
    line = np.column_stack([np.full(1500, 5.0), 3.0 - 40.0 * t])
    out = cfc_filter(line, 1e-4, cfc)
    # A ramp of slope m passes a pass with the lag m/wd at rest, 0.13 ms for class 60: the starts
    # of both passes are off by 40 * 1.3e-3 / 2 at most, and 1e-8 of that is left. Rounding of the
    # recursion is magnified by 1/a0 ~ 700.
    np.testing.assert_allclose(out[:, 0], 5.0, rtol=700 * 2.2e-16 * 10)
    np.testing.assert_allclose(out[:, 1], line[:, 1], atol=2e-9)


def test_pulse_that_begins_with_the_record_keeps_its_start():
    # A haversine of 100 ms from the very first sample. Its point mirror is continuous to the
    # second derivative, which changes sign: a'' = 2 (π/T)² A. What the symmetric kernel sees of
    # that is A (π/T)² σ|σ|, odd about the start, so that the start itself stays.
    t = 1e-4 * np.arange(2000)
    pulse = np.where(t < 0.1, 100.0 * np.sin(np.pi * t / 0.1) ** 2, 0.0)
    out = cfc_filter(pulse, 1e-4, 60)
    assert abs(out[0]) < 1e-6
    longer = cfc_filter(np.r_[np.zeros(2000), pulse], 1e-4, 60)[2000:]
    # Variance of the kernel, by the second derivative of its gain at zero, is that of a fourth
    # power: none; so its absolute second moment counts, some 1/wd² = (1.3 ms)².
    assert np.abs(out - longer).max() < 2.0 * 100.0 * (np.pi / 0.1) ** 2 * 1.3e-3**2


def test_real_crash_keeps_its_velocity_change(recordings):
    channel = np.loadtxt(recordings("crash_nhtsa_10146") / "v10146.093", delimiter="\t")
    step = float(np.diff(channel[:, 0]).mean())
    out = cfc_filter(channel[:, 1], step, 60)
    # Gain 1 at zero frequency: the integrals differ by what the kernel (1.3 ms) carries over the
    # ends, where the record stays below some 2 g.
    assert abs((out - channel[:, 1]).sum() * step) < 2 * 2.0 * 1.3e-3
    assert np.abs(out).max() < np.abs(channel[:, 1]).max()


@pytest.mark.parametrize(
    ("cfc", "step", "standard", "words"),
    [
        (60, 5e-3, "iso", ["CFC 60", "600 samples per second", "not 200"]),
        (1000, 1.01e-4, "iso", ["CFC 1000", "use CFC 600"]),
        (100, 1e-4, "iso", ["unknown channel frequency class", "Known: 60, 180"]),
        (60, 1e-4, "din", ["unknown standard", "iso"]),
        (60, 0.0, "iso", ["a sampling interval of"]),
    ],
)
def test_what_cannot_be_done_is_refused(cfc, step, standard, words):
    with pytest.raises(ConfigError) as error:
        cfc_coefficients(cfc, step, standard)
    for word in words:
        assert word in str(error.value)


def test_bad_samples_are_refused():
    with pytest.raises(DataError, match=r"row 8.*(?s:.*)channel 1 has nan at sample 7"):
        cfc_filter(np.where(np.arange(600).reshape(300, 2) == 15, np.nan, 0.0), 1e-4, 60)
    with pytest.raises(
        DataError, check=lambda refused: refused.finding.code == "dsp.samples-too-few-cfc-more"
    ):
        cfc_filter(np.zeros(100), 1e-4, 60)
    assert cfc_filter(np.ones(101), 1e-4, 60) == pytest.approx(1.0)
    with pytest.raises(
        DataError, check=lambda refused: refused.finding.code == "dsp.these-no-samples-shape-n"
    ):
        cfc_filter(np.zeros((3, 3, 3)), 1e-4, 60)

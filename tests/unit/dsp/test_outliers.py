"""Outliers: found in noise with the stated odds; steps, tones and pulses are left alone."""

from math import erfc

import numpy as np
import pytest

from strapdown.dsp.outliers import KEPT, REPLACED, OutlierDesign
from strapdown.errors import ConfigError

N = 100_000
APART = 400


def screened(values, design=None, steps=None):
    design = design or OutlierDesign()
    _, part = design.advance(design.begin(values.shape[1], steps), values, last=True)
    return part


def noise(seed, n=N, channels=6):
    return np.random.default_rng(seed).standard_normal((n, channels))


def test_weights_are_of_a_polynomial_of_degree_five():
    """What is interpolated of such a polynomial is the polynomial, at each place of each run."""
    x = np.arange(40.0)
    poly = np.polynomial.Polynomial([1.0, -2.0, 0.3, 0.02, -1e-3, 2e-5])(x / 4.0)
    design = OutlierDesign(longest_run=5)
    for m in range(1, 6):
        nodes = np.r_[poly[17:20], poly[20 + m : 23 + m]]
        for k in range(m):
            assert design.weights[m - 1, k] @ nodes == pytest.approx(poly[20 + k], rel=1e-12)


def test_odds_of_a_false_alarm_are_those_derived():
    """White noise: the residual is independent of both windows, which are a guard away.

    So a sample of noise is flagged with ``E[erfc(threshold m / sqrt 2)]`` at most, m the larger
    of two independent measures of the scale; the confirmation by the lines only
    lowers it. Here m is drawn 4e5 times.
    """
    design = OutlierDesign()
    x = noise(1, 129 * 8000, 1)[:, 0]
    row = np.array([1.0, -6.0, 15.0, -20.0, 15.0, -6.0, 1.0]) / 20.0
    residual = np.abs(np.convolve(x, row, "same"))[: 128 * 8000].reshape(-1, 128)[:, ::3]
    # As it is counted: a quarter or fewer reach a value that is above it; of normal numbers a
    # quarter reaches 1.1503.
    usual = np.sort(residual, axis=1)[:, -(residual.shape[1] // 4) - 1]
    m = usual / 1.1503494 / np.sqrt(row @ row)
    larger = np.maximum(*np.random.default_rng(2).choice(m, (2, 400_000)))
    odds = np.mean([erfc(design.threshold * v / np.sqrt(2.0)) for v in larger[::20]])
    assert odds < 1e-7
    # Runs of two and three add to it: three times as much at most. Of 3e6 samples then 0.9 on
    # average: more than 7 has odds below 1e-5 (Poisson).
    part = screened(noise(3, 500_000))
    assert (part.flags == REPLACED).sum() <= 7


@pytest.mark.parametrize(
    ("size", "least"),
    # Measured on 6000 each: 0.45, 0.99, 1.00; less four standard deviations of the binomial.
    [(10.0, 0.41), (15.0, 0.97), (20.0, 0.999)],
)
def test_power(size, least):
    x = noise(4)
    at = np.arange(APART // 2, N - APART // 2, APART)
    x[at] += size * np.random.default_rng(5).choice([-1.0, 1.0], (len(at), 6))
    flags = screened(x).flags == REPLACED
    assert flags[at].mean() >= least
    # What is not an outlier but beside one: fewer than one in a hundred outliers.
    assert flags.sum() - flags[at].sum() <= 0.01 * at.size * 6


@pytest.mark.parametrize("run", [1, 2, 3])
def test_what_replaces_a_run_is_interpolated(run):
    """The replaced value is off by noise of the six samples alone: at most 2.16 times theirs."""
    t = np.arange(N) / 1000.0
    x = noise(6) + 30.0 * np.sin(2.0 * np.pi * 10.0 * t)[:, None]
    clean = x.copy()
    at = np.arange(APART // 2, N - APART // 2, APART)
    sign = np.random.default_rng(7).choice([-1.0, 1.0], (len(at), 6))
    for k in range(run):
        x[at + k] += 100.0 * sign
    part = screened(x)
    whole = np.array([part.flags[at + k] == REPLACED for k in range(run)])
    assert whole.all()
    assert (part.flags == REPLACED).sum() == whole.size
    smooth = 30.0 * np.sin(2.0 * np.pi * 10.0 * t)[:, None]
    design = OutlierDesign()
    for k in range(run):
        sd = np.linalg.norm(design.weights[run - 1, k])
        off = (part.values - smooth)[at + k]
        # 1500 numbers: four standard deviations of their spread are 0.073 of it.
        assert off.std() == pytest.approx(sd, rel=0.08)
    untouched = part.flags == 0
    np.testing.assert_array_equal(part.values[untouched], clean[untouched])


@pytest.mark.parametrize("amplitude", [30.0, 1e3, 1e6])
@pytest.mark.parametrize("frequency", [0.001, 0.01, 0.1, 0.237, 0.331, 0.4999])
def test_no_steady_tone_is_touched(amplitude, frequency):
    """Of any frequency up to half the rate: a quarter of its residuals reach 0.92 of the largest,
    which is 0.8 by the normal law: far from six."""
    t = np.arange(20_000)
    phase = np.linspace(0.0, 2.0, 6)
    x = amplitude * np.sin(2.0 * np.pi * (frequency * t[:, None] + phase)) + noise(8, 20_000)
    assert not screened(x).flags.any()


@pytest.mark.parametrize("size", [100.0, 1e4, 1e7])
def test_no_step_and_no_kink_is_touched(size):
    t = np.arange(N)
    step = size * ((t // APART) % 2)
    ramp = size * np.abs((t % APART) - APART / 2) / 20.0
    x = np.column_stack([step, -step, ramp, -ramp, step + ramp, step - ramp]) + noise(9)
    part = screened(x)
    assert not (part.flags == REPLACED).any()
    np.testing.assert_array_equal(part.values, x)
    # But a step stands out, and is told.
    assert (part.flags[:, 0] == KEPT).any()


@pytest.mark.parametrize("amplitude", [30.0, 1e3, 1e6])
@pytest.mark.parametrize("base", [8, 9, 10, 15, 20, 30, 50])
def test_no_pulse_of_eight_samples_or_more_is_touched(base, amplitude):
    """Blows, bumps and rings that begin in quiet, at any phase between the samples."""
    t = np.arange(1500)
    shapes = []
    for phase in np.arange(0.0, 1.0, 0.1):
        u = (t - 700 - phase) / base
        inside = (u > 0.0) & (u < 1.0)
        shapes += [
            np.where(inside, np.sin(np.pi * u), 0.0),
            np.where(inside, np.sin(np.pi * u) ** 2, 0.0),
            np.where(inside, 1.0 - np.abs(2.0 * u - 1.0), 0.0),
            np.where(inside, u, 0.0),
            np.where(inside, 1.0, 0.0),
            np.where(u > 0.0, np.exp(-np.clip(u, 0.0, None) / 3.0) * np.sin(2 * np.pi * u), 0.0),
        ]
    x = amplitude * np.column_stack(shapes)
    flags = screened(x + noise(10, 1500, x.shape[1])).flags
    # Of some ten times the noise a kink is decided by it: of 10 000 such pulses one loses a run.
    assert (flags == REPLACED).sum() <= (3 if amplitude == 30.0 else 0)


@pytest.mark.parametrize("cutoff", [0.02, 0.1, 0.2, 0.3, 0.45])
def test_coloured_noise_is_its_own_measure(cutoff):
    """Noise that a sensor's low-pass has coloured, and noise that begins at once."""
    from scipy.signal import butter, lfilter

    x = lfilter(*butter(2, 2.0 * cutoff), noise(11, 150_000), axis=0)
    # An engine starts at half time, a hundred times louder.
    x[75_000:] *= 100.0
    # 9e5 samples: 0.45 on average at the odds of white noise; more than 6 has odds of 1e-6.
    assert (screened(x).flags == REPLACED).sum() <= 6


def test_steps_of_a_converter_are_no_outliers():
    """A channel at rest that toggles now and then holds its mean in the toggles."""
    rng = np.random.default_rng(12)
    x = np.where(rng.random((N, 6)) < 0.003, 0.01, 0.0)
    part = screened(x)
    assert not part.flags.any()
    given = screened(x, steps=np.full(6, 0.01))
    assert not given.flags.any()
    # Nor is what comes in several steps: a gyro that adds up before it speaks.
    x = np.where(rng.random((N, 6)) < 0.01, rng.integers(-9, 10, (N, 6)) * 0.01, 0.0)
    assert not screened(x).flags[200:].any()
    # And what is far beyond a step is found there, too.
    x[500, 0] = 5.0
    flags = screened(x, steps=np.full(6, 0.01)).flags
    assert flags[500, 0] == REPLACED
    assert (flags != 0).sum() == 1


def test_what_is_more_than_a_run_is_left_and_told():
    x = noise(13, 2000, 1)
    x[1000:1010] += 100.0
    part = screened(x)
    assert not (part.flags == REPLACED).any()
    np.testing.assert_array_equal(part.values, x)
    assert (part.flags[995:1015] == KEPT).sum() >= 2


def test_first_and_last_three_samples_cannot_be_judged():
    x = noise(14, 1000, 1)
    x[[0, 2, 997, 999]] += 1000.0
    x[[3, 996]] += 1000.0
    flags = screened(x).flags[:, 0]
    assert not flags[[0, 1, 2, 997, 998, 999]].any()


@pytest.mark.parametrize("cut", [1, 7, 150, 1001])
def test_any_cut_gives_the_same_bits(cut):
    x = noise(15, 3000, 3)
    x[np.random.default_rng(16).choice(2900, 40)] += 25.0
    x[1500:1520] += 60.0
    design = OutlierDesign()
    whole = screened(x, design)
    state, parts = design.begin(3), []
    for k in range(0, len(x), cut):
        state, part = design.advance(state, x[k : k + cut], last=k + cut >= len(x))
        parts.append(part)
    np.testing.assert_array_equal(np.vstack([p.values for p in parts]), whole.values)
    np.testing.assert_array_equal(np.vstack([p.flags for p in parts]), whole.flags)
    np.testing.assert_array_equal(np.vstack([p.raw for p in parts]), x)


def test_latency_is_what_is_stated():
    design = OutlierDesign()
    _, part = design.advance(design.begin(2), noise(17, 1000, 2))
    assert len(part.values) == 1000 - design.latency


@pytest.mark.parametrize(
    ("option", "value"),
    [("threshold", 1.0), ("window", 4), ("longest_run", 0), ("longest_run", 9), ("bandwidth", 0.4)],
)
def test_options_out_of_range(option, value):
    with pytest.raises(ConfigError) as error:
        OutlierDesign(**{option: value})
    assert error.value.finding.quantity == option


def test_steps_of_a_converter_are_seen_through_rounding():
    """Counts that were scaled and turned differ in their last bits, and are the same counts."""
    rng = np.random.default_rng(5)
    counts = np.round(80.0 + 0.8 * rng.standard_normal(60_000) + 0.5 * np.sin(np.arange(60_000)))
    scaled = counts * 125e-6 * 9.780327 / 0.01
    scaled *= 1.0 + 3e-16 * rng.integers(-2, 3, counts.size)
    for values in (counts, scaled):
        assert not np.any(screened(values[:, None]).flags == REPLACED)


def test_what_is_nearer_to_its_neighbours_than_its_prediction_stays():
    """A channel of few counts: five of them would be extrapolated far beyond all."""
    rng = np.random.default_rng(6)
    counts = np.round(80.0 + 0.7 * rng.standard_normal(200_000))[:, None]
    # Before this was seen to, one reading in 2e4 was put up to 13 counts away.
    assert not np.any(screened(counts).flags == REPLACED)

"""Delay by correlation: to a part of a sample, with the scatter that it states."""

import numpy as np
import pytest
from tests.coded import coded

from strapdown.dsp.delay import EvenSignal, find_delay, lag_correlation
from strapdown.errors import DataError


def crash(t):
    """Two overlapping haversines, smooth to the first derivative."""

    def pulse(begin, length):
        return np.sin(np.pi * np.clip((t - begin) / length, 0.0, 1.0)) ** 2

    return 100.0 * pulse(0.0, 0.1) + 30.0 * pulse(0.03, 0.06)


def signal(function, begin, end, step, shift=0.0, noise=0.0, rng=None):
    time = np.arange(begin, end, step)
    values = function(time)
    if noise:
        values = values + noise * rng.normal(size=len(time))
    return EvenSignal(begin + shift, step, values[:, None])


@pytest.mark.parametrize("shift", [0.0, 0.3, 0.30127, -1.2345])
@pytest.mark.parametrize(("one", "two"), [(5e-3, 5e-3), (1e-4, 5e-3), (5e-3, 1e-4), (1e-3, 7e-3)])
def test_noiseless_records_of_different_rates(shift, one, two):
    a = signal(crash, -0.5, 0.7, one)
    b = signal(lambda t: 4.0 - 1.3 * -crash(t), -0.3, 0.6, two, shift)
    found = find_delay(a, b)
    # A step is a few per cent of the pulses; splines over the smoothed ones are off by its fourth
    # power, and the low-pass of the faster is not the slower's: less than a hundredth of a step.
    assert found.delay == pytest.approx(shift, abs=0.01 * max(one, two))
    assert found.gain == pytest.approx(1.3, rel=0.01)
    assert found.correlation > 0.999


@pytest.mark.slow
@pytest.mark.parametrize(
    ("step", "noise"), [((5e-3, 5e-3), (1.0, 1.0)), ((5e-3, 1e-4), (1.0, 3.0))]
)
def test_scatter_is_what_is_stated(step, noise):
    """And no more than a third above the bound of Cramér and Rao."""
    rng = np.random.default_rng(7)
    errors, stated = [], []
    for _ in range(60):
        shift = rng.uniform(0.3, 0.31)
        a = signal(crash, -0.5, 0.7, step[0], 0.0, noise[0], rng)
        b = signal(crash, -0.4, 0.6, step[1], shift, noise[1], rng)
        found = find_delay(a, b)
        errors.append(found.delay - shift)
        stated.append(found.sd)
    scatter, said = np.std(errors), np.sqrt(np.mean(np.square(stated)))
    # 60 draws know a standard deviation to 9 %, and the smoothed residuals theirs to some 10 %;
    # three standard deviations of both together.
    assert scatter / said == pytest.approx(1.0, abs=3.0 * np.hypot(0.09, 0.03))
    assert abs(np.mean(errors)) < 4.0 * scatter / np.sqrt(60)
    t = np.arange(-0.4, 0.6, 1e-5)
    power = (np.gradient(crash(t), t) ** 2).sum() * 1e-5
    bound = np.sqrt(sum(n**2 * s for n, s in zip(noise, step, strict=True)) / power)
    assert bound * 0.8 < scatter < bound * 1.33


def test_what_repeats_is_ambiguous():
    def beat(t):
        return np.sin(2 * np.pi * 5.0 * t)

    a, b = signal(beat, 0.0, 2.0, 5e-3), signal(beat, 0.0, 2.0, 5e-3)
    with pytest.raises(
        DataError, check=lambda refused: refused.finding.code == "dsp.delays-do-about-well-motion"
    ) as refused:
        find_delay(a, b)
    data = refused.value.finding.data
    beats = (data["runner_up_delay"] - data["delay"]) / 0.2
    assert round(beats) != 0
    assert beats == pytest.approx(round(beats), abs=0.05)


def test_what_has_nothing_in_common_is_refused():
    rng = np.random.default_rng(1)
    a = signal(crash, -0.5, 0.7, 5e-3)
    noise = EvenSignal(0.0, 5e-3, rng.normal(size=(240, 1)))
    with pytest.raises(
        DataError,
        check=lambda refused: refused.finding.code == "dsp.records-little-common-best-needed",
    ):
        find_delay(a, noise)
    with pytest.raises(
        DataError,
        check=lambda refused: refused.finding.code == "dsp.record-does-not-vary-constants",
    ):
        find_delay(a, EvenSignal(0.0, 5e-3, np.ones((240, 1))))
    with pytest.raises(DataError, check=coded("dsp.records-channels", widths=1, widths_2=2)):
        find_delay(a, EvenSignal(0.0, 5e-3, np.ones((240, 2))))
    with pytest.raises(DataError, check=coded("dsp.no-delay-leaves-common-both")):
        find_delay(a, EvenSignal(0.0, 5e-3, crash(np.arange(9) * 0.01)[:, None]))


def test_correlation_is_numpy_s_at_every_lag_also_with_gaps():
    rng = np.random.default_rng(2)
    x, y = rng.normal(size=(30, 2)), rng.normal(size=(20, 2))
    known_x, known_y = rng.random(30) > 0.2, rng.random(20) > 0.2
    lags, score = lag_correlation(x, y, known_x, known_y, 8.0)
    assert len(lags) > 10
    for lag, got in zip(lags.astype(int), score, strict=True):
        pairs = [
            (k + lag, k) for k in range(20) if 0 <= k + lag < 30 and known_x[k + lag] and known_y[k]
        ]
        i, j = np.array(pairs).T
        p, q = x[i] - x[i].mean(axis=0), y[j] - y[j].mean(axis=0)
        expected = (p * q).sum() / np.sqrt((p * p).sum() * (q * q).sum())
        # Differences of sums that a Fourier transform made.
        assert got == pytest.approx(expected, abs=1e-10)


def test_redundant_sensors_of_a_real_crash_have_one_clock(recordings):
    """Primary and redundant accelerometer on one crossmember, in one 10 kHz recorder."""
    folder = recordings("crash_nhtsa_10146")
    records = []
    for name in ("v10146.093", "v10146.099"):
        table = np.loadtxt(folder / name, delimiter="\t")
        step = (table[-1, 0] - table[0, 0]) / (len(table) - 1)
        records.append(EvenSignal(table[0, 0], step, table[:, 1:]))
    found = find_delay(*records)
    # Sampled together; both were low-passed alike, to a part of a sample.
    assert abs(found.delay) < 1e-4
    assert found.sd < 1e-4
    assert found.correlation > 0.95
    moved = EvenSignal(records[1].start + 0.1234, records[1].step, records[1].values)
    assert find_delay(records[0], moved).delay == pytest.approx(found.delay + 0.1234, abs=1e-9)

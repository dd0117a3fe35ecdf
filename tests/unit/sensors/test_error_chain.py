"""What the chain does to true values, link by link, and that it is undone."""

from __future__ import annotations

import math

import numpy as np
import pytest
from tests.coded import coded

from strapdown.errors import ConfigError, DataError
from strapdown.sensors.error_chain import apply, compensate, input_of, transfer
from strapdown.sensors.triad_errors import TriadErrors

U = 2.0**-53
MISALIGNED = ((0.0, 0.02, -0.01), (0.015, 0.0, 0.03), (-0.02, 0.01, 0.0))
FELT = ((1e-3, 2e-4, 0.0), (-3e-4, 5e-4, 1e-4), (2e-4, 0.0, -1e-3))
KNOWN = TriadErrors(
    bias=(0.1, -0.2, 0.05),
    trend=(1e-3, 0.0, -2e-3),
    scale=(0.02, -0.03, 0.01),
    misalignment=MISALIGNED,
    g_sensitivity=FELT,
    nonlinearity_2=(0.01, -0.02, 0.0),
    nonlinearity_3=(0.02, 0.01, -0.03),
    full_scale=20.0,
)


def stamps(count=400, irregular=False):
    rng = np.random.default_rng(1)
    return np.cumsum(rng.uniform(0.002, 0.03, count)) if irregular else np.arange(count) * 0.01


def truth(count=400, size=4.0):
    return np.random.default_rng(2).uniform(-size, size, (count, 3))


def force(count=400):
    return np.random.default_rng(3).uniform(-20.0, 20.0, (count, 3))


@pytest.mark.parametrize("sampling", ["instantaneous", "mean"])
@pytest.mark.parametrize("irregular", [False, True])
def test_compensation_undoes_the_known_errors_to_rounding(sampling, irregular):
    t, u, f = stamps(irregular=irregular), truth(), force()
    read = apply(KNOWN, t, u, sampling=sampling, specific_force=f)
    back = compensate(KNOWN, t, read, sampling=sampling, specific_force=f)
    assert np.abs(read - u).max() > 0.1
    # No intermediate value exceeds 5; some forty roundings of at most U of it each, and none is
    # magnified by more than 1.2 (slope, scale, directions).
    assert np.abs(back - u).max() < 40 * 1.2 * 5 * U


def test_an_ideal_triad_changes_no_bit():
    t, u = stamps(), truth()
    assert np.array_equal(apply(TriadErrors(), t, u), u)


def test_a_cross_axis_term_is_what_one_axis_feels_of_another():
    t, u = stamps(2), np.array([[0.0, 1.0, 0.0]] * 2)
    read = apply(TriadErrors(misalignment=MISALIGNED), t, u)
    assert read[0].tolist() == [0.02, 1.0, 0.01]


def test_a_gyro_feels_the_specific_force():
    t, f = stamps(2), np.array([[0.0, 0.0, -10.0]] * 2)
    read = apply(TriadErrors(g_sensitivity=FELT), t, np.zeros((2, 3)), specific_force=f)
    assert read[1] == pytest.approx([0.0, -1e-3, 1e-2], abs=1e-18)


def test_means_hold_the_mean_of_the_trend():
    t = np.array([0.0, 0.1, 0.4])
    read = apply(TriadErrors(trend=1.0), t, np.zeros((3, 3)), sampling="mean")
    # Interval by interval the middle; the first is as long as the second.
    assert read[:, 0] == pytest.approx([-0.05, 0.05, 0.25], abs=1e-16)


def test_saturation_and_quantization_are_exact():
    t = stamps(5)
    u = np.array([-9.0, -0.3, 0.2, 0.26, 9.0])[:, None] * np.ones(3)
    read = apply(TriadErrors(full_scale=2.0, quantization=(0.5, 0.25, 0.0)), t, u)
    assert read[:, 0].tolist() == [-2.0, -0.5, 0.0, 0.5, 2.0]
    assert read[:, 1].tolist() == [-2.0, -0.25, 0.25, 0.25, 2.0]
    assert read[:, 2].tolist() == [-2.0, -0.3, 0.2, 0.26, 2.0]


def test_noise_can_saturate_and_is_quantized():
    read = apply(
        TriadErrors(noise_density=1.0, full_scale=10.0, quantization=0.5),
        stamps(4000),
        np.zeros((4000, 3)),
    )
    # sd 10: a third of the samples lie beyond.
    assert read.min() == -10.0
    assert read.max() == 10.0
    assert (np.rint(read * 2.0) == read * 2.0).all()


@pytest.mark.parametrize("third", [-0.2, 0.0, 0.3])
@pytest.mark.parametrize("second", [-0.15, 0.0, 0.15])
def test_the_curve_is_monotone_and_its_inverse_is_exact_everywhere(second, third):
    x = np.concatenate([np.linspace(-3.0, 3.0, 6001), [-2.0, 2.0, 0.0]])
    y = transfer(x, 0.05, second, third, 2.0)
    assert (np.diff(y[:6001]) > 0.0).all()
    # Slope at least 1.05 - 0.3 - 0.6 = 0.15: an error of 6 U in y is one of 40 U of 3 in x.
    assert np.abs(input_of(y, 0.05, second, third, 2.0) - x).max() < 40 * 3 * 2 * U
    # At full scale the errors have the size that is stated.
    ends = transfer(np.array([-2.0, 2.0]), 0.0, second, third, 2.0)
    assert ends == pytest.approx([-2.0 + 2.0 * (second - third), 2.0 + 2.0 * (second + third)])


def kinds():
    return {
        "noise_density": 0.1,
        "bias_instability": 0.2,
        "random_walk": 0.3,
    }


@pytest.mark.parametrize("sampling", ["instantaneous", "mean"])
@pytest.mark.parametrize("left", kinds())
def test_switching_one_error_off_leaves_the_draws_of_the_others(sampling, left):
    t, u = stamps(), np.zeros((400, 3))
    alone = {
        k: apply(TriadErrors(**{k: v}, correlation_time=5.0), t, u, sampling=sampling, seed=7)
        for k, v in kinds().items()
    }
    others = {k: v for k, v in kinds().items() if k != left}
    both = apply(TriadErrors(**others, correlation_time=5.0), t, u, sampling=sampling, seed=7)
    assert both == pytest.approx(sum(alone[k] for k in others), abs=1e-13)


def test_an_axis_has_its_own_draws():
    t, u = stamps(), np.zeros((400, 3))
    three = apply(TriadErrors(noise_density=1.0), t, u, seed=1)
    one = apply(TriadErrors(noise_density=(0.0, 0.0, 1.0)), t, u, seed=1)
    assert np.array_equal(three[:, 2], one[:, 2])
    assert not one[:, :2].any()


def test_the_same_seed_gives_the_same_bits():
    errors = TriadErrors(
        noise_density=1.0, bias_instability=1.0, correlation_time=2.0, random_walk=1.0, jitter=1e-4
    )
    t, u = stamps(), truth()
    first, again, other = (apply(errors, t, u, seed=s) for s in (3, 3, 4))
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)


def test_noise_follows_irregular_steps():
    t = np.arange(60_000) * 0.01
    t[30_000:] = t[30_000] + np.arange(30_000) * 0.04
    noise = apply(TriadErrors(noise_density=0.1), t, np.zeros((60_000, 3)), seed=1)
    # 90 000 numbers: 5 sigma of the standard deviation is 5/sqrt(180 000).
    assert noise[:30_000].std() == pytest.approx(1.0, rel=0.012)
    assert noise[30_001:].std() == pytest.approx(0.5, rel=0.012)


@pytest.mark.parametrize("frequency", [2.0, 10.0, 30.0])
@pytest.mark.parametrize("sampling", ["instantaneous", "mean"])
def test_the_low_pass_has_the_response_of_one_pole(frequency, sampling):
    """Amplitude and phase of a sine, fitted after the start has died away."""
    rate, corner = 20_000.0, 10.0
    t = np.arange(int(rate)) / rate
    w = 2.0 * math.pi * frequency
    if sampling == "mean":
        sine = (np.cos(w * (t - 1.0 / rate)) - np.cos(w * t)) * rate / w
    else:
        sine = np.sin(w * t)
    out = apply(TriadErrors(bandwidth=corner), t, np.column_stack([sine] * 3), sampling=sampling)[
        :, 0
    ]
    late = t > 0.7
    basis = np.column_stack([np.sin(w * t[late]), np.cos(w * t[late])])
    a, b = np.linalg.lstsq(basis, out[late], rcond=None)[0]
    response = 1.0 / (1.0 + 1j * frequency / corner)
    delay = 0.5 / rate if sampling == "mean" else 0.0
    expected = response * np.exp(-1j * w * delay)
    # Linear between samples: relative error (w dt)²/12 <= 8e-6; the means' held input and their
    # own average add as much each. exp(-0.7 s * 2 pi 10) is 1e-19.
    assert abs(complex(a, b) - expected) < 3e-5


def test_the_low_pass_is_exact_for_a_ramp_on_irregular_stamps():
    t = np.concatenate([[0.0], stamps(50, irregular=True)])
    tau = 1.0 / (2.0 * math.pi * 3.0)
    out = apply(TriadErrors(bandwidth=3.0), t, np.column_stack([t] * 3))[:, 1]
    assert out == pytest.approx(t - tau * (1.0 - np.exp(-t / tau)), abs=1e-15)


def test_a_jittered_clock_reads_a_ramp_early_and_late():
    t = stamps(20_000)
    read = apply(TriadErrors(jitter=5e-4), t, np.column_stack([2.0 * t] * 3), seed=1)
    off = read[1:-1] - 2.0 * t[1:-1, None]
    # One clock for the triad, of the stated size (20 000 numbers, 5 sigma).
    assert (off[:, 0] == off[:, 1]).all()
    assert off[:, 0].std() == pytest.approx(1e-3, rel=5 / math.sqrt(2 * len(off)))


@pytest.mark.parametrize(
    ("values", "quantity"),
    [
        ({"noise_density": -1.0}, "noise_density"),
        ({"bias": (1.0, 2.0)}, "bias"),
        ({"bias": math.nan}, "bias"),
        ({"trend": math.inf}, "trend"),
        ({"scale": -1.0}, "scale"),
        ({"full_scale": 0.0}, "full_scale"),
        ({"bandwidth": -3.0}, "bandwidth"),
        ({"misalignment": ((0.1, 0, 0), (0, 0, 0), (0, 0, 0))}, "misalignment"),
        ({"misalignment": ((0, 0.6, 0.5), (0, 0, 0), (0, 0, 0))}, "misalignment"),
        ({"misalignment": 0.1}, "misalignment"),
        ({"nonlinearity_2": 0.1}, "full_scale"),
        ({"nonlinearity_3": -0.4, "full_scale": 1.0}, "nonlinearity"),
        ({"jitter": "much"}, "jitter"),
    ],
)
def test_what_makes_no_sensor_is_refused_by_name(values, quantity):
    with pytest.raises(ConfigError) as caught:
        TriadErrors(**values)
    assert caught.value.finding.quantity == quantity
    assert caught.value.finding.remedy


def test_what_cannot_be_applied_is_refused():
    t, u = stamps(), truth()
    with pytest.raises(ConfigError, check=coded("tables.no-kind-sampling", quantity="sampling")):
        apply(TriadErrors(), t, u, sampling="average")
    with pytest.raises(ConfigError, check=coded("sensors.triad-feels-specific-force-none")):
        apply(KNOWN, t, u)
    with pytest.raises(DataError, match="shape"):
        apply(KNOWN, t, u, specific_force=force(3))
    with pytest.raises(DataError, check=coded("sensors.times-do-not-advance")):
        apply(KNOWN, t[::-1], u, specific_force=force())
    with pytest.raises(DataError, check=coded("sensors.time-shape-values")):
        compensate(KNOWN, t, u[:3], specific_force=force())
    with pytest.raises(ConfigError, check=coded("sensors.jitter-more-than-tenth-interval")):
        apply(TriadErrors(jitter=0.01), t, u)


def test_warm_up_dies_away_and_its_means_are_exact():
    errors = TriadErrors(warm_up=(0.5, -0.2, 0.0), warm_up_time=2.0)
    time, rest = np.arange(1, 9) * 0.5, np.zeros((8, 3))
    at = apply(errors, time, rest)
    np.testing.assert_allclose(at[:, 0], 0.5 * np.exp(-time / 2.0), rtol=1e-15)
    mean = apply(errors, time, rest, sampling="mean")
    integral = -2.0 * np.exp(-np.append(0.0, time) / 2.0)
    np.testing.assert_allclose(mean[:, 1], -0.2 * np.diff(integral) / 0.5, rtol=1e-14)
    np.testing.assert_allclose(compensate(errors, time, mean, sampling="mean"), 0.0, atol=1e-16)
    lasting = TriadErrors(warm_up=0.5)
    np.testing.assert_array_equal(apply(lasting, time, rest, sampling="mean"), 0.5)


def test_vibration_shifts_the_output_and_is_taken_off():
    errors = TriadErrors(vibration_rectification=(1e-3, 0.0, -2e-3), scale=0.01)
    time, true = np.arange(5) * 0.01, np.ones((5, 3))
    shaken = np.full((5, 3), 400.0)
    read = apply(errors, time, true, vibration=shaken)
    np.testing.assert_allclose(read[2], 1.01 + np.array([0.4, 0.0, -0.8]), rtol=1e-14)
    np.testing.assert_allclose(compensate(errors, time, read, vibration=shaken), true, rtol=1e-14)
    np.testing.assert_allclose(apply(errors, time, true), 1.01, rtol=1e-15)
    with pytest.raises(DataError, match="vibration"):
        apply(errors, time, true, vibration=shaken[:3])

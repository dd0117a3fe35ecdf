"""Interpolation by six points: exact for degree 5, with its gain and noise."""

import numpy as np
import pytest
from tests.coded import coded

from strapdown.dsp.decimation import interpolate, interpolated_means
from strapdown.dsp.samples import even_step
from strapdown.errors import DataError


def test_polynomials_of_degree_5_are_exact_on_uneven_stamps():
    rng = np.random.default_rng(1)
    t = np.cumsum(rng.uniform(0.5, 1.5, 40)) / 20.0
    power = np.poly1d([3.0, -2.0, 1.0, 4.0, -1.0, 2.0])
    at = np.linspace(t[0], t[-1], 300)
    out = interpolate(t, power(t), at)
    np.testing.assert_allclose(out.values[:, 0], power(at), rtol=1e-11, atol=1e-9)
    length = 0.05
    at = np.linspace(t[0] + length, t[-1], 300)
    means = interpolated_means(t, power(t), at, length)
    whole = power.integ()
    np.testing.assert_allclose(
        means.values[:, 0], (whole(at) - whole(at - length)) / length, rtol=1e-11, atol=1e-9
    )


def test_gain_and_noise_midway():
    t = np.arange(200.0)
    at = np.arange(20.0, 180.0) + 0.5
    for f in (0.05, 0.125, 0.25):
        x = np.pi * f
        gain = (150 * np.cos(x) - 25 * np.cos(3 * x) + 3 * np.cos(5 * x)) / 128
        out = interpolate(t, np.cos(2 * np.pi * f * t), at)
        np.testing.assert_allclose(out.values[:, 0], gain * np.cos(2 * np.pi * f * at), atol=1e-12)
    # Lagrange's weights at the middle of six: 3, -25, 150, 150, -25, 3 over 256.
    np.testing.assert_allclose(out.noise_factor, np.sqrt(2 * (9 + 625 + 22500)) / 256, rtol=1e-12)


def test_noise_factor_is_exact_everywhere():
    t = np.arange(12.0)
    at = np.linspace(1.0, 11.0, 101)
    for out in (interpolate(t, np.eye(12), at), interpolated_means(t, np.eye(12), at, 1.0)):
        np.testing.assert_allclose(out.noise_factor, np.linalg.norm(out.values, axis=1), rtol=1e-12)


def test_bad_records_are_refused():
    with pytest.raises(DataError, check=coded("dsp.stamps-samples-cannot-interpolated", points=6)):
        interpolate(np.arange(5.0), np.zeros(5), [2.0])
    with pytest.raises(
        DataError, check=lambda refused: refused.finding.code == "dsp.lies-outside-record-goes-2"
    ):
        interpolate(np.arange(7.0), np.zeros(7), [7.0])
    with pytest.raises(
        DataError,
        check=lambda refused: refused.finding.code == "dsp.time-does-not-advance-followed",
    ):
        interpolate([0.0, 1.0, 2.0, 3.0, 3.0, 4.0], np.zeros(6), [2.0])


def test_even_steps():
    assert even_step(np.round(np.arange(100) / 300.0, 4)) == pytest.approx(1 / 300, rel=1e-3)
    with pytest.raises(DataError, check=coded("dsp.samples-not-evenly-spaced-usual", row=51)):
        even_step(np.r_[np.arange(50.0), np.arange(51.0, 80.0)])
    with pytest.raises(
        DataError,
        check=lambda refused: refused.finding.code == "dsp.time-does-not-advance-followed-2",
    ):
        even_step([0.0, 1.0, 1.0])
    with pytest.raises(
        DataError, check=lambda refused: refused.finding.code == "dsp.stamp-no-step"
    ):
        even_step([0.0])

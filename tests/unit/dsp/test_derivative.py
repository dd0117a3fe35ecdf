"""The derivative by sliding polynomials: exact where it should be, and its stated faults."""

import numpy as np
import pytest

from strapdown.dsp.derivative import SlidingFit, derivative
from strapdown.errors import ConfigError, DataError

STEP = 5e-3


@pytest.mark.parametrize("degree", [1, 2, 3, 4])
def test_polynomials_up_to_the_degree_are_exact_also_at_the_ends(degree):
    t = STEP * np.arange(60)
    power = np.poly1d(np.arange(1.0, degree + 2.0))
    fit = SlidingFit(STEP, 4, degree)
    out = derivative(np.column_stack([power(t), 5.0 - t]), fit)
    # Rounding of a sum of 9 over the step.
    np.testing.assert_allclose(out.values[:, 0], power.deriv()(t), rtol=1e-9)
    np.testing.assert_allclose(out.values[:, 1], -1.0, rtol=1e-9)
    assert out.delay == 0.0
    assert out.valid.all()


@pytest.mark.parametrize(("half", "degree"), [(1, 2), (3, 2), (5, 4), (8, 3)])
def test_weights_are_scipy_s(half, degree):
    from scipy.signal import savgol_coeffs

    fit = SlidingFit(STEP, half, degree)
    for at in (-half, 0, half - 1):
        expected = savgol_coeffs(
            2 * half + 1, degree, deriv=1, delta=STEP, pos=half + at, use="dot"
        )
        np.testing.assert_allclose(
            fit.weights(at), expected, rtol=1e-9, atol=1e-11 * np.abs(expected).max()
        )


def test_noise_gain_is_exact_also_at_the_ends():
    fit = SlidingFit(STEP, 3, 2)
    out = derivative(np.eye(30), fit)
    np.testing.assert_allclose(out.noise_gain, np.linalg.norm(out.values, axis=1), rtol=1e-12)
    # A straight line through 2m + 1 samples: 1/(h sqrt(m (m+1) (2m+1) / 3)).
    assert out.noise_gain[15] == pytest.approx(1.0 / (STEP * np.sqrt(3 * 4 * 7 / 3)), rel=1e-12)
    assert out.noise_gain[0] > 3.0 * out.noise_gain[15]


def test_response_is_what_sines_show():
    fit = SlidingFit(STEP, 3, 2)
    t = STEP * np.arange(400)
    for f in (2.0, 10.0, 25.0, 60.0):
        out = derivative(np.sin(2 * np.pi * f * t), fit).values[10:-10, 0]
        truth = 2 * np.pi * f * np.cos(2 * np.pi * f * t)[10:-10]
        np.testing.assert_allclose(out, fit.response(f)[0] * truth, atol=1e-9 * 2 * np.pi * f)
    at = fit.bandwidth(0.01)
    assert fit.response(at)[0] == pytest.approx(0.99, abs=1e-9)
    # Below, the first term: 1 - H = (2π f h)²/6 Σu⁴/Σu² = (2π f h)² 7/6 at m = 3 (196/28 = 7);
    # its square, 1e-4, is what the next leaves out.
    assert at == pytest.approx(np.sqrt(0.01 * 6 / 7) / (2 * np.pi * STEP), rel=0.01)


@pytest.mark.parametrize("duration", [0.05, 0.1, 0.3])
def test_pulse_loss_is_what_a_pulse_loses(duration):
    fit = SlidingFit(STEP, 3, 2)
    t = STEP * np.arange(-100, 101)
    u = np.clip(t, -duration / 2, duration / 2)
    rate = u / 2 + duration / (4 * np.pi) * np.sin(2 * np.pi * u / duration)
    peak = derivative(rate, fit).values[100, 0]
    assert 1.0 - peak == pytest.approx(fit.pulse_loss(duration), abs=1e-12)
    # Taylor: the pulse's second derivative at its peak is -2 (π/T)²; the fit feels a/10 h² 7/6 ...
    first = 2.0 * (np.pi / duration) ** 2 * 7 * STEP**2 / 6
    assert fit.pulse_loss(duration) == pytest.approx(first, rel=2.0 * first + 0.01)


def test_causal_is_the_centred_late_by_half_a_window():
    values = np.random.default_rng(1).normal(size=(50, 2))
    fit = SlidingFit(STEP, 3, 2)
    centred, causal = derivative(values, fit), derivative(values, fit, causal=True)
    assert causal.delay == pytest.approx(3 * STEP)
    np.testing.assert_array_equal(causal.valid, np.arange(50) >= 6)
    np.testing.assert_allclose(causal.values[6:], centred.values[3:-3], rtol=1e-12, atol=1e-9)
    np.testing.assert_allclose(causal.noise_gain[6:], centred.noise_gain[3:-3], rtol=1e-12)
    # It looks at nothing that comes later.
    changed = values.copy()
    changed[30:] = 0.0
    np.testing.assert_array_equal(
        derivative(changed, fit, causal=True).values[:30], causal.values[:30]
    )


def test_what_cannot_be_done_is_refused():
    with pytest.raises(
        ConfigError,
        check=lambda refused: refused.finding.code == "dsp.samples-do-not-fix-polynomial",
    ):
        SlidingFit(STEP, 1, 3)
    with pytest.raises(DataError, match="5 samples are fewer than the 7"):
        derivative(np.zeros(5), SlidingFit(STEP, 3))
    with pytest.raises(DataError, match="nan"):
        derivative(np.full(9, np.nan), SlidingFit(STEP, 3))

"""The slope by sliding polynomials: that of Savitzky and Golay, and exact for polynomials."""

import numpy as np
import pytest
from scipy.signal import savgol_coeffs

from strapdown.dsp.derivative import fitted_weights, local_slope

STEP = 5e-3


@pytest.mark.parametrize("degree", [1, 2, 3, 4])
def test_polynomials_up_to_the_degree_are_exact_also_at_the_ends(degree):
    t = STEP * np.arange(60)
    power = np.poly1d(np.arange(1.0, degree + 2.0))
    slope = local_slope(t)
    # Rounding of a sum of 7 over the step.
    out = slope.slope_of(np.column_stack([power(t), 5.0 - t]))
    np.testing.assert_allclose(out[:, 0], power.deriv()(t), rtol=1e-9)
    np.testing.assert_allclose(out[:, 1], -1.0, rtol=1e-9)


@pytest.mark.parametrize(("half", "degree"), [(1, 2), (3, 2), (5, 4), (8, 3)])
def test_weights_are_scipy_s(half, degree):
    window = STEP * np.arange(-half, half + 1)
    for at in (-half, 0, half - 1):
        weights = fitted_weights(window[None], np.array([at * STEP]), degree)[1][0]
        expected = savgol_coeffs(
            2 * half + 1, degree, deriv=1, delta=STEP, pos=half + at, use="dot"
        )
        np.testing.assert_allclose(
            weights, expected, rtol=1e-9, atol=1e-11 * np.abs(expected).max()
        )


def test_a_sine_loses_what_the_bandwidth_says():
    t = STEP * np.arange(400)
    slope = local_slope(t)
    f = slope.bandwidth
    out = slope.slope_of(np.sin(2 * np.pi * f * t)[:, None])[10:-10, 0]
    truth = 2 * np.pi * f * np.cos(2 * np.pi * f * t)[10:-10]
    np.testing.assert_allclose(out, np.sqrt(0.5) * truth, atol=1e-8 * 2 * np.pi * f)

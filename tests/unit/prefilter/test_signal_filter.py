"""Level and slope of a signal: against dense least squares, and the gains in closed form."""

import numpy as np
import pytest

from strapdown.errors import ConfigError
from strapdown.estimation.covariance import COVARIANCES
from strapdown.prefilter.w_d import SignalFilter

STEP = 1e-3


def dense(samples, ages, noise, bandwidth, P0, x0):
    """Level at each epoch by weighted least squares over all states at once."""
    count, size = samples.shape
    T = size * STEP
    q = (2.0 * np.pi * bandwidth) ** 4 * noise**2 * STEP
    Q = q * np.array([[T**3 / 3, T**2 / 2], [T**2 / 2, T]])
    Phi = np.array([[1.0, T], [0.0, 1.0]])
    R = noise**2 + q * ages**3 / 3.0
    # The first state is predicted from the prior by one epoch, as every other.
    rows, right = [], []
    root = np.linalg.inv(np.linalg.cholesky(Phi @ P0 @ Phi.T + Q))
    rows.append(np.hstack([root, np.zeros((2, 2 * count - 2))]))
    right.append(root @ Phi @ x0)
    root = np.linalg.inv(np.linalg.cholesky(Q))
    for k in range(count):
        H = np.zeros((size, 2 * count))
        H[:, 2 * k], H[:, 2 * k + 1] = 1.0, -ages
        rows.append(H / np.sqrt(R)[:, None])
        right.append(samples[k] / np.sqrt(R))
        if k:
            F = np.zeros((2, 2 * count))
            F[:, 2 * k - 2 : 2 * k], F[:, 2 * k : 2 * k + 2] = -root @ Phi, root
            rows.append(F)
            right.append(np.zeros(2))
    return np.linalg.lstsq(np.vstack(rows), np.concatenate(right), rcond=None)[0][::2]


@pytest.mark.parametrize("form", ["wd", "ud", "joseph"])
def test_is_the_least_squares_solution(form):
    rng = np.random.default_rng(1)
    samples = rng.standard_normal((30, 10)) + 0.1 * np.arange(30)[:, None]
    ages = STEP * np.arange(9, -1, -1.0)
    # So slow that the lag is longer than the record: 30 epochs see each other.
    signal = SignalFilter(5.0, COVARIANCES[form](), rule=None)
    state = signal.begin(samples[0], 1.0, 0.01)
    P0, x0 = signal.form.matrix(state.form), state.x
    assert signal.lag(0.01) >= 30
    _, out = signal.advance(state, samples, ages, 1.0, STEP, last=True)
    # Conditioning: the slope's variance is 1e3 of the level's; rounding of 1e-16 times that.
    np.testing.assert_allclose(
        out.level, dense(samples, ages, 1.0, 5.0, P0, x0), rtol=1e-9, atol=1e-9
    )


def test_the_lag_is_long_enough():
    """What waits no longer than the lag differs from what sees everything by 1e-4 of it."""
    rng = np.random.default_rng(2)
    samples = rng.standard_normal((200, 10))
    ages = STEP * np.arange(9, -1, -1.0)
    signal = SignalFilter(20.0, rule=None)
    start = signal.begin(samples[0], 1.0, 0.01)
    _, out = signal.advance(start, samples, ages, 1.0, STEP, last=True)
    P0 = signal.form.matrix(start.form)
    full = dense(samples, ages, 1.0, 20.0, P0, start.x)
    # Slopes change by some hundred a second where levels scatter by one: a few times 1e-4.
    assert np.abs(out.level - full)[:-20].max() < 1e-3
    assert np.abs(out.level - full)[:-20].max() > 0.0


@pytest.mark.parametrize("smooth", [True, False])
@pytest.mark.parametrize("frequency", [3.0, 10.0, 20.0, 40.0])
def test_gain_is_that_of_the_formula(smooth, frequency):
    """With one sample an epoch; the steps' own part is (pole step)²/12, 1.3e-3, and the lag's."""
    bandwidth = 20.0
    t = STEP * np.arange(1500)
    signal = SignalFilter(bandwidth, rule=None, smooth=smooth)
    wave = np.cos(2.0 * np.pi * frequency * t)[:, None]
    start = signal.begin(wave[:1, 0], 1.0, STEP)
    _, out = signal.advance(start, wave, np.zeros(1), 1.0, STEP, last=True)
    inside = slice(500, 1000)  # whole cycles
    phasor = 2.0 * np.mean(out.level[inside] * np.exp(-2j * np.pi * frequency * t[inside]))
    expected = signal.response(np.array([frequency]))[0]
    # A sampled filter is half a step ahead of the continuous one: up to pole step/2 of phase.
    slack = 3e-3 if smooth else 0.75 * signal.pole * STEP
    assert abs(phasor - expected) < slack
    if smooth:
        # Zero phase but for what is beyond the lag.
        assert abs(np.angle(phasor)) < 2e-3


@pytest.mark.parametrize("bandwidth", [0.0, -1.0, np.nan, np.inf])
def test_a_bandwidth_that_is_none(bandwidth):
    with pytest.raises(ConfigError):
        SignalFilter(bandwidth)

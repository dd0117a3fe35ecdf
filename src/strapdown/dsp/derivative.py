"""First derivative of noisy samples by sliding polynomials, with its noise, delay and losses."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from strapdown.dsp.fitted_weights import bandwidth, fitted_weights, slope_response
from strapdown.dsp.local_weights import LocalWeights
from strapdown.dsp.samples import as_channels, positive_step
from strapdown.errors import ConfigError, DataError

Array = NDArray[np.float64]

__all__ = ["Derivative", "SlidingFit", "derivative", "widest_fit"]


@dataclass(frozen=True, eq=False)
class Derivative:
    """First derivative of channels.

    Attributes
    ----------
    values : ndarray, (n, k), unit of the samples per s
        The derivative at ``stamp - delay``.
    noise_gain : ndarray, (n,), 1/s
        Standard deviation of each output per that of white noise of the samples, exact. Outputs
        whose windows overlap share their noise.
    delay : float, s
    valid : ndarray of bool, (n,)
        False for the first outputs of a causal fit, whose window is not filled yet; they are 0.
    """

    values: Array
    noise_gain: Array
    delay: float
    valid: NDArray[np.bool_]


@dataclass(frozen=True)
class SlidingFit:
    """Savitzky and Golay's differentiator: the slope of a polynomial fitted to a window.

    Attributes
    ----------
    step : float, s
        Of the samples.
    half : int
        The window has ``2 half + 1`` samples.
    degree : int
        1 or 2 give the same slope at the middle, 3 or 4 the same (Savitzky & Golay 1964,
        doi:10.1021/ac60214a047); up to ``2 half``.

    Raises
    ------
    ConfigError
        There is no such fit.
    """

    step: float
    half: int
    degree: int = 2

    def __post_init__(self) -> None:
        positive_step(self.step)
        if not (self.half >= 1 and 1 <= self.degree <= 2 * self.half):
            raise ConfigError(
                "dsp.samples-do-not-fix-polynomial",
                quantity="degree",
                half=2 * self.half + 1,
                degree=self.degree,
            )

    def weights(self, at: int = 0) -> Array:
        """Weights of the slope at sample `at` of the window, -half to half, in 1/s."""
        slope = fitted_weights(self._window[None], np.array([at * self.step]), self.degree)[1]
        return np.asarray(slope[0])

    @property
    def _window(self) -> Array:
        return self.step * np.arange(-self.half, self.half + 1, dtype=np.float64)

    def noise_gain(self, at: int = 0) -> float:
        """Standard deviation of the slope per that of white noise of the samples, in 1/s."""
        return float(np.linalg.norm(self.weights(at)))

    def response(self, frequency: ArrayLike) -> Array:
        """Output of the centred fit per true derivative of a sine, real: there is no delay.

        Parameters
        ----------
        frequency : array_like, Hz
            Above zero.
        """
        given = np.atleast_1d(np.asarray(frequency, dtype=np.float64))
        return np.asarray(self._response(given).real)

    def _response(self, frequency: Array) -> NDArray[np.complex128]:
        return slope_response(self.weights(), self._window, frequency)

    def bandwidth(self, loss: float = 0.01) -> float:
        """Frequency in Hz below which a sine's derivative is off by no more than `loss`."""
        # The response first leaves 1 before the first zero of the window's transform.
        return bandwidth(self._response, 0.5 / self.step, 64 * (2 * self.half + 1), loss)

    def pulse_loss(self, duration: float) -> float:
        """What the peak of a haversine pulse of the derivative loses, relative.

        Parameters
        ----------
        duration : float, s
            T of ``sin²(π t/T)``; the samples are its integral, and one lies at the peak.
        """
        t = np.clip(self._window, -0.5 * duration, 0.5 * duration)
        # About the peak the pulse is cos²(π t/T).
        turned = 0.5 * t + duration / (4.0 * np.pi) * np.sin(2.0 * np.pi * t / duration)
        return 1.0 - float(self.weights() @ turned)


def widest_fit(step: float, duration: float, loss: float = 0.02, degree: int = 2) -> SlidingFit:
    """Choose the widest window, thus the least noise, that keeps a pulse's peak.

    Parameters
    ----------
    step : float, s
    duration : float, s
        Of the shortest haversine pulse of the derivative that matters.
    loss : float
        Most that its peak may lose, relative.
    degree : int

    Raises
    ------
    ConfigError
        Even the narrowest window loses more.
    """
    half = math.ceil(max(1, degree) / 2)
    fit = SlidingFit(step, half, degree)
    if abs(fit.pulse_loss(duration)) > loss:
        raise ConfigError(
            "dsp.pulse-loses-peak-even-over",
            quantity="duration",
            duration=duration,
            pulse_loss=fit.pulse_loss(duration),
            half=2 * half + 1,
            step=step,
        )
    while True:
        wider = SlidingFit(step, half + 1, degree)
        if abs(wider.pulse_loss(duration)) > loss:
            return fit
        half, fit = half + 1, wider


def derivative(values: ArrayLike, fit: SlidingFit, *, causal: bool = False) -> Derivative:
    """First derivative of evenly spaced samples, as an angular acceleration from rates.

    Parameters
    ----------
    values : array_like, (n,) or (n, k)
    fit : SlidingFit
    causal : bool
        Use past samples only: the same slopes, each at the stamp of the last sample of its
        window, thus late by ``half`` steps exactly at every frequency.

    Returns
    -------
    Derivative
        Centred: no delay, and the first and last ``half`` outputs are slopes of the polynomial
        through the first or last window, away from its middle, with the larger noise that
        `noise_gain` tells.

    Raises
    ------
    DataError
        A sample is not finite, or there are fewer than a window.
    """
    channels = as_channels(values)
    n, window = len(channels), 2 * fit.half + 1
    if n < window:
        raise DataError("dsp.samples-fewer-than-window", quantity="values", n=n, window=window)
    at = np.arange(n)
    if causal:
        first = at[window - 1 :] - (window - 1)
        local = LocalWeights(first, np.tile(fit.weights(), (len(first), 1)))
        out, gain = np.zeros(channels.shape), np.zeros(n)
        out[window - 1 :], gain[window - 1 :] = local.apply(channels), local.noise_factor
        return Derivative(out, gain, fit.half * fit.step, at >= window - 1)
    first = np.clip(at - fit.half, 0, n - window)
    table = np.array([fit.weights(k) for k in range(-fit.half, fit.half + 1)])
    local = LocalWeights(first, table[at - first])
    return Derivative(local.apply(channels), local.noise_factor, 0.0, np.ones(n, dtype=bool))

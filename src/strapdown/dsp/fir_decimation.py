"""Decimation by a whole number with fixed weights, in segments, that keeps integrals exactly."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from strapdown.dsp.decimation import LowPassDesign, low_pass_design
from strapdown.errors import ConfigError

Array = NDArray[np.float64]

__all__ = ["FirDecimation", "FirState", "fir_decimation"]


@dataclass(frozen=True, eq=False)
class FirState:
    """What is remembered between segments.

    Attributes
    ----------
    first : int
        Number of the oldest sample that is kept.
    given : int
        Number of outputs so far.
    values : ndarray, (k, c)
    """

    first: int
    given: int
    values: Array


@dataclass(frozen=True, eq=False)
class FirDecimation:
    """A low-pass of fixed length before every `factor`-th sample.

    Output j stands at sample ``centre + j factor``, in its middle: what is late is known and the
    same at all frequencies, and is taken off by that stamp.

    Attributes
    ----------
    design : LowPassDesign
    step : float, s
        Of the samples.
    factor : int
    means : bool
        Whether a sample is a mean over the step that ends at its stamp: the weights then lie
        symmetric about the output's stamp, half a step beside the samples' stamps.
    """

    design: LowPassDesign
    step: float
    factor: int
    means: bool = False

    @cached_property
    def weights(self) -> Array:
        """Weights, oldest sample first.

        Those of the design, and each sample counts the same in the sum of all outputs: the
        weights that are `factor` apart sum to ``1/factor``. So constants pass as they are, the
        gain at all multiples of the output's rate is zero to rounding, and the integral of the
        outputs is that of the samples.
        """
        half = self.half
        count = 2 * half + int(not self.means)
        place: Array = np.arange(count, dtype=np.float64) - 0.5 * (count - 1)
        raw = self.design.kernel(self.step * place)
        phase = np.arange(len(raw)) % self.factor
        shares = np.bincount(phase, raw, self.factor)
        # Weights far from the middle are small: a branch is changed in proportion to its sum.
        return np.asarray(raw / (self.factor * shares[phase]))

    @property
    def half(self) -> int:
        """Samples to either side of the middle."""
        return max(self.factor, math.floor(self.design.reach / self.step + 0.5 * self.means))

    @property
    def centre(self) -> int:
        """Sample at whose stamp the first output stands: a multiple of `factor`."""
        # A mean before the first stamp is one sample earlier.
        return math.ceil((self.half - int(self.means)) / self.factor) * self.factor

    @property
    def delay(self) -> float:
        """From an output's stamp to the last sample that it needs, s: how late it is known."""
        return (self.half - 0.5 * self.means) * self.step

    @property
    def noise_factor(self) -> float:
        """Standard deviation of an output per that of white noise of the samples."""
        return float(np.linalg.norm(self.weights))

    def response(self, frequency: ArrayLike) -> Array:
        """Gain at frequencies in Hz; of means that over the step counts, too."""
        f = np.atleast_1d(np.asarray(frequency, dtype=np.float64))
        place = np.arange(len(self.weights)) - 0.5 * (len(self.weights) - 1)
        gain = np.cos(2.0 * np.pi * self.step * np.outer(f, place)) @ self.weights
        return np.asarray(gain * np.sinc(f * self.step) if self.means else gain)

    def begin(self, channels: int) -> FirState:
        """Return the state before the first sample."""
        return FirState(0, 0, np.empty((0, channels)))

    def advance(self, state: FirState, values: Array) -> tuple[FirState, Array]:
        """Take a further segment; of outputs there are as many as are whole.

        Parameters
        ----------
        state : FirState
        values : ndarray, (k, c)

        Returns
        -------
        state : FirState
        outputs : ndarray, (m, c)
        """
        from strapdown._kernels.fir import fir_decimate

        held = np.ascontiguousarray(np.vstack([state.values, values]))
        start = self.centre + state.given * self.factor - self.half + int(self.means)
        after = state.first + len(held) - (start + len(self.weights))
        count = max(0, after // self.factor + 1)
        out = np.empty((count, held.shape[1]))
        fir_decimate(held, self.weights, start - state.first, self.factor, out)
        drop = max(0, min(start + count * self.factor - state.first, len(held)))
        return FirState(state.first + drop, state.given + count, held[drop:].copy()), out


def fir_decimation(
    step: float,
    factor: int,
    *,
    means: bool = False,
    passband: float = 0.5,
    attenuation: float = 80.0,
) -> FirDecimation:
    """Design the low-pass before every so manyth sample.

    Parameters
    ----------
    step : float, s
    factor : int
        Two or more.
    means : bool
        Whether the samples are means over the step that ends at their stamp.
    passband, attenuation : float
        As `low_pass_design`.

    Raises
    ------
    ConfigError
        An option is out of its range.
    """
    if factor != int(factor) or factor < 2:
        raise ConfigError("dsp.every-th-sample-no-decimation", quantity="factor", factor=factor)
    design = low_pass_design(
        step, 1.0 / (factor * step), passband=passband, attenuation=attenuation
    )
    return FirDecimation(design, step, int(factor), means)

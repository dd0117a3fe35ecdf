"""Robust W-D Kalman filter of each channel, the paper's filter at the primary level."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from strapdown.constants import MAD_TO_SD
from strapdown.dsp.outliers import REPLACED
from strapdown.dsp.samples import check_segment
from strapdown.errors import DataError
from strapdown.estimation.covariance import Chernodarov, CovarianceForm, UpdateRule
from strapdown.estimation.robust import RobustUpdate
from strapdown.estimation.signal_filter import SignalFilter, SignalState
from strapdown.prefilter.prefilter import Changed, Grid, Portion, Prefilter, whole_factor

Array = NDArray[np.float64]

# Samples at the start from which the noise is estimated.
SETTLE = 256
# Samples with less weight count as replaced: residuals beyond 5.4 of Huber's standard deviations.
BELIEVED = 0.25
# Standard deviation of a sixth difference over twenty, for unit white noise.
RESIDUAL = math.sqrt(924.0) / 20.0


@dataclass(frozen=True, eq=False)
class RobustWdState:
    """State between chunks.

    Attributes
    ----------
    noise : ndarray, (c,), or None
        None until enough samples are available to estimate it.
    waiting : ndarray, (k, c)
        Samples after the last whole epoch.
    taken, given : int
        Epochs filtered and epochs returned so far.
    """

    grid: Grid
    channels: int
    noise: Array | None
    waiting: Array
    taken: int
    given: int
    signals: tuple[SignalState, ...]


@dataclass(frozen=True)
class RobustWd(Prefilter):
    """Estimate level and slope of each channel by a smoothed robust Kalman filter in W-D form.

    An epoch is one output interval; its samples are the measurements, processed in one
    orthogonalization. The gains are the same for all channels while no sample is down-weighted. The
    filter assumes motion below `bandwidth` and as small as the noise; faster or larger motion
    appears as outliers. For a stationary vehicle; see `RobustFir`.

    Parameters
    ----------
    rate : float, Hz
        Output rate; must divide the sample rate.
    bandwidth : float, Hz
        Frequency at which the smoother's gain is one half; see `SignalFilter`.
    noise : tuple of float, optional
        Standard deviation of a sample of each channel. Default: estimated from the first 256
        samples (median of the sixth difference).
    smooth : bool
        Whether later samples are used; without them the filter has no delay but has phase.
    """

    name: ClassVar[str] = "w_d"
    summary: ClassVar[str] = "robust W-D Kalman smoother of each channel"
    source: ClassVar[str] = "Chernodarov 2009, Eqs. (6)-(15), 'primary processing'"

    rate: float = 100.0
    bandwidth: float = 20.0
    noise: tuple[float, ...] | None = None
    smooth: bool = True
    form: CovarianceForm = field(default_factory=Chernodarov)
    rule: UpdateRule = field(default_factory=RobustUpdate)

    @property
    def signal(self) -> SignalFilter:
        """The filter of one channel."""
        return SignalFilter(self.bandwidth, self.form, self.rule, self.smooth)

    def begin(self, grid: Grid, channels: int = 6) -> RobustWdState:
        """As `Prefilter.begin`."""
        whole_factor(self.rate, grid, self.name)
        noise = None if self.noise is None else np.asarray(self.noise, dtype=np.float64)
        return RobustWdState(grid, channels, noise, np.empty((0, channels)), 0, 0, ())

    def advance(
        self, state: RobustWdState, values: Array, last: bool = False
    ) -> tuple[RobustWdState, Portion]:
        """As `Prefilter.advance`.

        Raises
        ------
        DataError
            A value is not finite, or the noise of a channel is zero and cannot scale the residuals.
        """
        grid, signal = state.grid, self.signal
        factor = whole_factor(self.rate, grid, self.name)
        seen = state.taken * factor + len(state.waiting) + int(state.taken > 0)
        check_segment(values, seen)
        held = np.vstack([state.waiting, values])
        noise = state.noise
        if noise is None and (len(held) >= SETTLE or last):
            noise = _noise(held[:SETTLE])
        # The first sample lies at the start of the first epoch.
        skip = 0 if state.taken else 1
        count = 0 if noise is None else max(0, (len(held) - skip) // factor)
        ages = grid.step * (np.arange(factor - 1, -1, -1.0) + 0.5 * grid.means)
        signals, levels = list(state.signals), []
        changed = [Changed.none()]
        epochs = held[skip : skip + count * factor].reshape(count, factor, state.channels)
        for c in range(state.channels if noise is not None else 0):
            assert noise is not None
            sd = float(noise[c])
            if not signals and not count:
                break
            if len(signals) <= c:
                signals.append(signal.begin(epochs[0, :, c], sd, factor * grid.step))
            signals[c], out = signal.advance(signals[c], epochs[:, :, c], ages, sd, grid.step, last)
            levels.append(out.level)
            k, j = np.nonzero(out.weight < BELIEVED)
            changed.append(
                Changed(
                    (state.taken + k) * factor + j + 1,
                    np.full(len(k), c),
                    epochs[k, j, c],
                    out.expected[k, j],
                    np.full(len(k), REPLACED, np.int8),
                )
            )
        level = np.column_stack(levels) if levels else np.empty((0, state.channels))
        given = state.given + len(level)
        time = grid.time(factor * np.arange(state.given + 1, given + 1))
        waiting = held[skip + count * factor :] if count else held
        after = RobustWdState(
            grid, state.channels, noise, waiting.copy(), state.taken + count, given, tuple(signals)
        )
        return after, Portion(time, level, np.empty((0, 10)), Changed.joined(changed))

    def figures(self, grid: Grid) -> dict[str, float]:
        """As `Prefilter.figures`; the passband ends where the gain error reaches 0.1 dB."""
        signal = self.signal
        epoch = whole_factor(self.rate, grid, self.name) * grid.step
        stop = 0.5 / epoch
        late = signal.lag(epoch) * epoch
        at_stop = float(np.abs(signal.response(np.array([stop])))[0])
        return {
            "delay": late,
            "latency": late,
            "noise_factor": signal.noise_factor(grid.step),
            "passband": _within(signal),
            "stopband": stop,
            "attenuation": -20.0 * math.log10(at_stop),
        }

    def sampling(self, grid: Grid) -> str:
        """Values at the stamps."""
        return "instantaneous"


def _noise(samples: Array) -> Array:
    """Estimate the standard deviation of each channel from sample to sample."""
    rough = np.abs(np.diff(samples, 6, axis=0)) / 20.0
    sd = MAD_TO_SD * np.median(rough, axis=0) / RESIDUAL if len(rough) else np.zeros(1)
    if not (sd > 0.0).all():
        c = int(np.argmin(sd))
        raise DataError("prefilter.no-noise-to-judge-by", quantity="noise", count=len(samples), c=c)
    return np.asarray(sd)


def _within(signal: SignalFilter) -> float:
    """Frequency up to which the gain is within 0.1 dB of 1."""
    f = signal.bandwidth * np.linspace(1e-3, 1.0, 4000)
    off = np.abs(20.0 * np.log10(np.abs(signal.response(f)))) > 0.1
    return float(f[int(np.argmax(off))])

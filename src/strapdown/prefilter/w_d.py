"""Robust W-D Kalman filter of each channel, the paper's filter at the primary level."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from strapdown.constants import MAD_TO_SD
from strapdown.dsp.outliers import REPLACED
from strapdown.dsp.samples import check_segment
from strapdown.errors import ConfigError, DataError
from strapdown.estimation.covariance import Chernodarov, CovarianceForm, UpdateRule
from strapdown.estimation.robust import RobustUpdate
from strapdown.prefilter.prefilter import Changed, Grid, Portion, Prefilter, whole_factor
from strapdown.tables.checks import Array

# Robust Kalman filter and smoother for a signal modeled as a randomly walking level and slope.

# Remainder of a change after so many time constants of the smoother.
FORGOTTEN = 1e-4
# Integral of 1/(1 + x^4)² from zero to infinity.
MEAN_SQUARE_GAIN = 3.0 * math.pi / (8.0 * math.sqrt(2.0))


@dataclass(frozen=True, eq=False)
class SignalState:
    """State of one channel between epochs.

    Attributes
    ----------
    form : ndarray, (2, 2)
        The covariance, in the form's own way.
    x : ndarray, (2,)
        Level and slope at the last epoch.
    level_slope : ndarray, (k, 2)
        Filtered, of the epochs that wait for later ones.
    P : ndarray, (k, 3)
        Their covariances: (11, 12, 22).
    """

    form: Array
    x: Array
    level_slope: Array
    P: Array


@dataclass(frozen=True, eq=False)
class SignalEpochs:
    """Filtered epochs.

    Attributes
    ----------
    level : ndarray, (m,)
        Of the epochs that are final.
    weight, expected : ndarray, (k, l)
        Of every new sample: weight by the rule, and the predicted value.
    """

    level: Array
    weight: Array
    expected: Array


@dataclass(frozen=True)
class SignalFilter:
    """Level and slope of a channel, from several samples per epoch.

    The slope is a random walk. Its intensity is chosen by `bandwidth`, and so are all gains: they
    are the same for channels of any noise, so that their phases are equal. The
    smoother's gain is ``1/(1 + (f/bandwidth)^4)`` (Wiener's, of a doubly integrated white noise
    in white noise), its phase is zero; that of the filter alone is not.

    Parameters
    ----------
    bandwidth : float, Hz
        Where the smoother's gain is a half.
    form : CovarianceForm
    rule : UpdateRule
    smooth : bool
        Whether to use later samples; else the filter alone.

    Notes
    -----
    Each epoch is Eqs. (6) to (15) of Chernodarov (2009) with its samples as observations: of the
    level minus the slope times their age. The change of the slope within an epoch is added to
    their variance.
    """

    bandwidth: float
    form: CovarianceForm = field(default_factory=Chernodarov)
    rule: UpdateRule = field(default_factory=RobustUpdate)
    smooth: bool = True

    def __post_init__(self) -> None:
        if not (math.isfinite(self.bandwidth) and self.bandwidth > 0.0):
            raise ConfigError(
                "estimation.hz-no-bandwidth", quantity="bandwidth", bandwidth=self.bandwidth
            )

    @property
    def pole(self) -> float:
        """Angular frequency at which the smoother's gain is a half, rad/s."""
        return 2.0 * math.pi * self.bandwidth

    def lag(self, epoch: float) -> int:
        """Delay of the smoother in epochs of so many seconds."""
        if not self.smooth:
            return 0
        return math.ceil(-math.log(FORGOTTEN) * math.sqrt(2.0) / (self.pole * epoch))

    def noise_factor(self, step: float) -> float:
        """Standard deviation of the level relative to that of white samples `step` s apart.

        The root mean square of the gain over the samples' band; the filter's is twice the
        smoother's.
        """
        if self.smooth:
            return math.sqrt(2.0 * step * self.bandwidth * MEAN_SQUARE_GAIN)
        # The filter's transfer function is (sqrt 2 p s + p^2)/(s^2 + sqrt 2 p s + p^2), and the
        # integral of its square over all frequencies 3 p/(2 sqrt 2).
        return math.sqrt(step * 3.0 * self.pole / (2.0 * math.sqrt(2.0)))

    def response(self, frequency: Array) -> Array:
        """Complex gain at frequencies in Hz, of short steps and epochs."""
        s = 1j * np.asarray(frequency, dtype=np.float64) / self.bandwidth
        if self.smooth:
            return np.asarray(1.0 / (1.0 + s**4))
        return np.asarray((math.sqrt(2.0) * s + 1.0) / (s * s + math.sqrt(2.0) * s + 1.0))

    def begin(self, samples: Array, noise: float, epoch: float) -> SignalState:
        """Return the state before the first epoch, from its samples.

        `samples` ((l,)): those of the first epoch. `noise`: standard deviation of a sample. `epoch`
        (s).
        """
        middle = float(np.median(samples))
        spread = float(np.median(np.abs(samples - middle))) * 3.0 + noise
        P = np.diag([spread**2, (2.0 * spread / epoch) ** 2])
        none = np.empty((0, 2))
        return SignalState(self.form.begin(P), np.array([middle, 0.0]), none, np.empty((0, 3)))

    def advance(
        self, state: SignalState, samples: Array, ages: Array, noise: float, step: float, last: bool
    ) -> tuple[SignalState, SignalEpochs]:
        """Process whole epochs.

        `samples` ((k, l)): of k epochs. `ages` ((l,), s): age of each sample at the end of its
        epoch. `noise`: standard deviation of a sample. `step` (s): of the samples; an epoch has l.
        `last`: whether to return the remaining epochs without the later ones.
        """
        from strapdown._kernels.signals import smooth_fixed_lag

        count, size = samples.shape
        T = size * step
        intensity = self.pole**4 * noise**2 * step
        Phi = np.array([[1.0, T], [0.0, 1.0]])
        Q = intensity * np.array([[T**3 / 3.0, T**2 / 2.0], [T**2 / 2.0, T]])
        H = np.column_stack([np.ones(size), -ages])
        R = noise**2 + intensity * ages**3 / 3.0
        form, x = state.form, state.x
        new, P = np.empty((count, 2)), np.empty((count, 3))
        weight, expected = np.empty((count, size)), np.empty((count, size))
        for k in range(count):
            form, x, told = self.form.epoch(form, Phi, Q, Phi @ x, samples[k], H, R, self.rule)
            new[k], weight[k], expected[k] = x, told.weight, samples[k] - told.nu
            full = self.form.matrix(form)
            P[k] = full[0, 0], full[0, 1], full[1, 1]
        all_x, all_P = np.vstack([state.level_slope, new]), np.vstack([state.P, P])
        lag = self.lag(T)
        final = len(all_x) if last else max(0, len(all_x) - lag)
        out = np.empty((final, 2))
        smooth_fixed_lag(all_x, all_P, Phi, Q, lag, final, out)
        after = SignalState(form, x, all_x[final:].copy(), all_P[final:].copy())
        return after, SignalEpochs(out[:, 0].copy(), weight, expected)


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

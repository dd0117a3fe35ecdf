"""Robust Kalman filter and smoother for a signal modeled as a randomly walking level and slope."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from strapdown.errors import ConfigError
from strapdown.estimation.covariance import Chernodarov, CovarianceForm, UpdateRule
from strapdown.estimation.robust import RobustUpdate
from strapdown.tables.checks import Array

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

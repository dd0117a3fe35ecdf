"""Watches innovations as they come, and tells since when they are not as expected."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from strapdown.errors import ConfigError

__all__ = ["Alarm", "InnovationMonitor", "MonitorState"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Alarm:
    """A change of a sequence of innovations.

    Attributes
    ----------
    component : int
        Which component of the observation.
    what : {'larger', 'high', 'low'}
        It scatters more than was expected; it is above zero; it is below.
    since : float, s
        First epoch after which it was not as expected, as far as the innovations tell.
    known : float, s
        Epoch at which there was no doubt of it.
    """

    component: int
    what: str
    since: float
    known: float


@dataclass(frozen=True, eq=False)
class MonitorState:
    """What is remembered of a sequence; never changed in place.

    Attributes
    ----------
    sums : ndarray, (3, k)
        Of the logarithms of likelihood ratios since `since`: of larger, high and low.
    since : ndarray, (3, k), s
        First epoch after the sum was last at zero.
    raised : ndarray of bool, (3, k)
        Whether an alarm has been raised since.
    """

    sums: Array
    since: Array
    raised: NDArray[np.bool_]


@dataclass(frozen=True)
class InnovationMonitor:
    """Cumulative sums of likelihood ratios: constant memory, and a rate of false alarms that holds.

    Of a normalised innovation u the logarithm of the likelihood ratio of a standard deviation c is
    ``(1 - 1/c²) u²/2 - ln c``, and of a mean d ``d u - d²/2``. Their sum is kept from falling below
    zero (Page, Biometrika 41 (1954) 100); an alarm is raised where it comes to `threshold`, and
    where it last was zero the change is thought to have been. If innovations are as expected,
    a ratio that begins at any one epoch is a martingale of mean 1, and ever comes to exp(threshold)
    with a probability of exp(-threshold) at most (Ville's inequality): within n epochs a sum of the
    three raises a false alarm with a probability of ``n exp(-threshold)`` at most, and on average
    not before exp(threshold) epochs (Lorden, Ann. Math. Statist. 42 (1971) 1897, Theorem 2).

    Innovations need not be normal in their tails for that: one counts no more than `clip` standard
    deviations, so that a single gross error raises no alarm. It is an object without state.

    Attributes
    ----------
    threshold : float
    larger : float
        The standard deviation c.
    apart : float
        The mean d, in standard deviations.
    clip : float
        In standard deviations.
    """

    threshold: float = math.log(1e6)
    larger: float = 1.5
    apart: float = 0.5
    clip: float = 4.0

    def __post_init__(self) -> None:
        for name, least in (("threshold", 0.0), ("larger", 1.0), ("apart", 0.0), ("clip", 0.0)):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > least):
                raise ConfigError(
                    "navigation.monitor-option-too-small",
                    quantity=name,
                    name=name,
                    value=value,
                    least=least,
                )

    def begin(self, components: int) -> MonitorState:
        """Return what is remembered before the first epoch."""
        shape = (3, components)
        return MonitorState(np.zeros(shape), np.full(shape, np.nan), np.zeros(shape, dtype=bool))

    def advance(
        self, state: MonitorState, time: ArrayLike, normalised: ArrayLike
    ) -> tuple[MonitorState, tuple[Alarm, ...]]:
        """Go on over epochs; pieces of any length give the same as the whole.

        Parameters
        ----------
        state : MonitorState
        time : array_like, (n,), s
        normalised : array_like, (n, k)
            Innovations over their expected standard deviations. What is NaN says nothing.

        Returns
        -------
        state : MonitorState
        alarms : tuple of Alarm
            Each once, until the sum has been at zero again.
        """
        u = np.clip(np.asarray(normalised, dtype=np.float64), -self.clip, self.clip)
        u = np.where(np.isnan(u), 0.0, u)
        told = ~np.isnan(np.asarray(normalised, dtype=np.float64))
        gain = 0.5 * (1.0 - 1.0 / self.larger**2)
        ratios = np.stack(
            [
                gain * u * u - math.log(self.larger),
                self.apart * u - 0.5 * self.apart**2,
                -self.apart * u - 0.5 * self.apart**2,
            ],
            axis=1,
        )
        ratios *= told[:, None, :]
        sums, since, raised = state.sums.copy(), state.since.copy(), state.raised.copy()
        alarms: list[Alarm] = []
        for now, ratio in zip(np.asarray(time, dtype=np.float64).tolist(), ratios, strict=True):
            fresh = sums <= 0.0
            sums += ratio
            since[fresh] = now
            down = sums <= 0.0
            sums[down] = 0.0
            raised &= ~down
            over = (sums >= self.threshold) & ~raised
            if over.any():
                alarms += [
                    Alarm(int(k), WHAT[kind], float(since[kind, k]), now)
                    for kind, k in np.argwhere(over)
                ]
                raised |= over
        return MonitorState(sums, since, raised), tuple(alarms)


#: What the three sums are of.
WHAT: Sequence[str] = ("larger", "high", "low")

"""The scale of an observation's errors, learnt from its innovations."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

from strapdown.errors import ConfigError
from strapdown.estimation.influence import Influence
from strapdown.estimation.influence_huber import Huber
from strapdown.estimation.robust_update import RobustUpdate

HUBER = Huber()


class ScaleState(NamedTuple):
    """What has been learnt of one kind of observation: numbers to keep with the filter.

    Attributes
    ----------
    log_square : float
        Logarithm of the square of the factor.
    information : float
        Number of observations that it rests on, as far as they told of it.
    rejected : int
        How many of the last observations, one after the other, were given no weight.
    """

    log_square: float
    information: float
    rejected: int

    @property
    def factor(self) -> float:
        """Standard deviation of a good observation over that of its stated variance."""
        return math.exp(0.5 * self.log_square)


@dataclass(frozen=True)
class AdaptiveScale:
    """How the factor of a stated standard deviation follows the innovations.

    An innovation nu has the variance ``s + c^2 r``. The factor c is moved until the clipped
    squares ``min(nu^2 / (s + c^2 r), clip^2)`` have the mean that they have with normal errors
    (Huber's second proposal, as a recursion with fading memory): a gross error counts no
    more than clip standard deviations. Each counts by the share of its variance that is the
    observation's own: after an outage, where ``s >> r``, next to nothing is learnt, or forgotten.

    An estimate that is wrong by more than it says would make a function that comes down to nothing
    reject every observation after it: after an outage in which the error grew to three of its
    standard deviations, Tukey's does, one by one, though together they leave no doubt. After
    `patience` rejections in a row `rule` therefore gives Huber's function, which rejects nothing.

    The object has no state: what is learnt is a `ScaleState` that its user keeps.

    Attributes
    ----------
    memory : float
        Observations over which the factor is a mean, fading.
    prior : float
        Observations that the stated variance is worth at the start.
    lowest, highest : float
        Bounds of the factor. Without the lower one, a receiver that repeats itself would lead
        to a variance with which everything that follows is rejected. At the upper one the
        variance is 10^4 times the stated one, and it is time to look for a failure.
    clip : float
        In standard deviations. With 1 the factor rises by 15 % where a tenth of the observations
        are gross errors.
    patience : int
        Rejections in a row after which one observation is taken by Huber's function.
    """

    memory: float = 100.0
    prior: float = 10.0
    lowest: float = 0.3
    highest: float = 100.0
    clip: float = 1.0
    patience: int = 10

    def __post_init__(self) -> None:
        for name in ("memory", "prior", "lowest", "highest", "clip", "patience"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0.0):
                raise ConfigError(
                    "estimation.adaptive-scale-not-above", quantity=name, name=name, value=value
                )
        for below, above in (("prior", "memory"), ("lowest", "highest")):
            if getattr(self, below) > getattr(self, above):
                raise ConfigError(
                    "estimation.adaptive-scale-above",
                    quantity=below,
                    below=below,
                    value=getattr(self, below),
                    above=above,
                    value_2=getattr(self, above),
                )

    @cached_property
    def _expected(self) -> tuple[float, float]:
        """Mean of the clipped square of a normal number, and the part within the clip."""
        k = self.clip
        inside = math.erf(k / math.sqrt(2.0))
        within = inside - k * math.sqrt(2.0 / math.pi) * math.exp(-0.5 * k * k)
        return within + k * k * (1.0 - inside), within

    def begin(self) -> ScaleState:
        """Return the state in which the stated variance holds."""
        bounded = min(max(1.0, self.lowest), self.highest)
        return ScaleState(2.0 * math.log(bounded), self.prior, 0)

    def rule(self, state: ScaleState, influence: Influence) -> RobustUpdate:
        """Return the rule of the next observation."""
        given = HUBER if state.rejected >= self.patience else influence
        return RobustUpdate(given, state.factor)

    def after(
        self, state: ScaleState, nu: float, s: float, r: float, weight: float = 1.0
    ) -> ScaleState:
        """Return what is known after an observation.

        Parameters
        ----------
        state : ScaleState
            Before it.
        nu : float
            Innovation.
        s : float
            Variance of the prediction, ``h P h'``.
        r : float
            Variance of the observation as stated, without the factor.
        weight : float
            What the rule gave it; 0 is a rejection.

        Returns
        -------
        ScaleState
        """
        rejected = state.rejected + 1 if weight == 0.0 else 0
        own = math.exp(state.log_square) * r
        total = s + own
        if not (math.isfinite(nu) and total > 0.0 and own > 0.0):
            return ScaleState(state.log_square, state.information, rejected)
        share = own / total
        mean, within = self._expected
        excess = min(nu * nu / total, self.clip * self.clip) - mean
        information = state.information
        information += share * share * (1.0 - information / self.memory)
        square = state.log_square + share * excess / (within * information)
        square = min(max(square, 2.0 * math.log(self.lowest)), 2.0 * math.log(self.highest))
        return ScaleState(square, information, rejected)

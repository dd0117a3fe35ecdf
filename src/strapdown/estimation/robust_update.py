"""The robust update: an observation weighs what its residual after the fit deserves."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import ClassVar

from strapdown.errors import ConfigError
from strapdown.estimation.influence import Influence
from strapdown.estimation.influence_huber import Huber
from strapdown.estimation.post_fit import post_fit
from strapdown.estimation.update_rule import Step

#: A weight below it is none: the variance R / w of the observation must stay a number.
NO_WEIGHT = 1e-30


@dataclass(frozen=True)
class RobustUpdate:
    """The minimiser of ``(x - m)' P^-1 (x - m) / 2 + rho(residual)``, and a Kalman step to it.

    With the weight ``w = psi(beta) / beta`` of the residual beta that the minimiser leaves, the
    Kalman update with the variance R / w goes to that minimiser. The covariance is that
    of the update, so that it is never negative, whatever the influence function is.

    Attributes
    ----------
    influence : Influence
    scale : float
        Standard deviation of a good observation over that of its stated variance.
    """

    influence: Influence = field(default_factory=Huber)
    scale: float = 1.0

    name: ClassVar[str] = "robust"
    summary: ClassVar[str] = "the minimiser along P h', by the weight of its residual"
    source: ClassVar[str] = "Huber 1981, Section 7.8 (weights); Masreliez and Martin 1977"

    def __post_init__(self) -> None:
        check_scale(self.scale)

    def step(self, nu: float, s: float, r: float) -> Step:
        """Return the step to the minimiser; see `UpdateRule.step`."""
        r *= self.scale * self.scale
        linear = self.influence.linear
        # Where the loss of least squares is below rho(linear), so is the minimiser's: its residual
        # is in the linear range. Written so that an infinite range has no infinity times zero.
        if abs(nu) <= linear * math.sqrt(s + r) or r == 0.0:
            return Step(nu, 1.0, r, 1.0)
        beta = post_fit(self.influence, abs(nu) / math.sqrt(r), s / r)
        weight = self.influence.weight(beta)
        if weight < NO_WEIGHT:
            return Step(0.0, 1.0, r, 0.0)
        return Step(nu, 1.0, r / weight, weight)


def check_scale(scale: float) -> None:
    """Raise `ConfigError` where a scale is not finite and positive."""
    if not (math.isfinite(scale) and scale > 0.0):
        raise ConfigError("estimation.scale-update", quantity="scale", scale=scale)

"""The robust update as Chernodarov prints it: one Newton step, kept to show what it does."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import ClassVar

from strapdown.estimation.influence import Influence
from strapdown.estimation.influence_huber import Huber
from strapdown.estimation.robust_update import check_scale
from strapdown.estimation.update_rule import Step


@dataclass(frozen=True)
class PaperUpdate:
    """One Newton step on ``(x - m)' P^-1 (x - m) / 2 + rho(nu / alpha)`` from the prediction.

    It looks at the residual before the fit. Where the prediction is much less certain than the
    observation that residual is large although nothing is wrong: Huber's psi' is then 0,
    the step goes far past the minimum and takes nothing off the covariance. Where psi comes
    down, psi' < 0 adds to it, or makes it negative. For comparison only; `RobustUpdate` is safe.

    Attributes
    ----------
    influence : Influence
    scale : float
        alpha over the standard deviation that is stated.
    """

    influence: Influence = field(default_factory=Huber)
    scale: float = 1.0

    name: ClassVar[str] = "paper"
    summary: ClassVar[str] = "one Newton step from the prediction: unsafe, for comparison"
    source: ClassVar[str] = "Chernodarov 2009, Eqs. (9)-(13)"

    def __post_init__(self) -> None:
        check_scale(self.scale)

    def step(self, nu: float, s: float, r: float) -> Step:
        """Return the Newton step; see `UpdateRule.step`."""
        r *= self.scale * self.scale
        if r == 0.0:
            return Step(nu, 1.0, r, 1.0)
        alpha = math.sqrt(r)
        beta = nu / alpha
        psi, slope = self.influence.psi(beta), self.influence.psi_prime(beta)
        return Step(alpha * psi, slope, r, self.influence.weight(beta))

"""A robust rule that learns the scale of each component of an observation."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from strapdown.estimation.adaptive_scale import AdaptiveScale, ScaleState
from strapdown.estimation.covariance import Innovations
from strapdown.estimation.influence import Influence
from strapdown.estimation.influence_huber import Huber
from strapdown.estimation.robust_update import RobustUpdate
from strapdown.estimation.update_rule import Step

__all__ = ["AdaptiveRule", "Scales"]

#: What has been learnt of each component of an observation.
Scales = tuple[ScaleState, ...]


@dataclass(frozen=True)
class AdaptiveRule:
    """`RobustUpdate` with the scale that `AdaptiveScale` learns, component by component.

    It has no state: who observes keeps the `Scales` of each observation, by its name. Where nobody
    does, `step` is that of the stated variances.

    Attributes
    ----------
    influence : Influence
    scale : AdaptiveScale
    """

    influence: Influence = field(default_factory=Huber)
    scale: AdaptiveScale = field(default_factory=AdaptiveScale)

    name: ClassVar[str] = "adaptive"
    summary: ClassVar[str] = "robust, with the scale of the errors learnt from the innovations"
    source: ClassVar[str] = "Huber 1981, Sections 6.4 (second proposal) and 7.8; recursion: here"

    def step(self, nu: float, s: float, r: float) -> Step:
        """Return the step before anything has been learnt; see `UpdateRule.step`."""
        return RobustUpdate(self.influence).step(nu, s, r)

    def begin(self, size: int) -> Scales:
        """Return what is known of so many components at the start."""
        return (self.scale.begin(),) * size

    def rules(self, scales: Scales) -> list[RobustUpdate]:
        """Return the rule of each component of the next observation."""
        return [self.scale.rule(one, self.influence) for one in scales]

    def after(self, scales: Scales, seen: Innovations, R: NDArray[np.float64]) -> Scales:
        """Return what is known after an observation.

        Parameters
        ----------
        scales : tuple of ScaleState
            Before it.
        seen : Innovations
            What came of it.
        R : ndarray, (l,)
            Its stated variances.

        Returns
        -------
        tuple of ScaleState
        """
        return tuple(
            self.scale.after(one, nu, s - r, r, weight)
            for one, nu, s, r, weight in zip(
                scales,
                seen.nu.tolist(),
                seen.s.tolist(),
                R.tolist(),
                seen.weight.tolist(),
                strict=True,
            )
        )

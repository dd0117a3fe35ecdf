"""What a navigator remembers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from strapdown._kernels.steady_motion import STEADY
from strapdown.aiding.aid import Epochs
from strapdown.estimation.adaptive_rule import Scales
from strapdown.navigation.engine import EngineState

__all__ = ["NavigatorState"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class NavigatorState:
    """Everything that a navigator remembers: from here it goes on.

    Attributes
    ----------
    engine : EngineState
        Of mechanization, estimates and covariance.
    queues : mapping of str to Epochs
        Of each aid, the epochs that are still to come.
    memories : mapping of str to object
        Of each aid that watches the sensors.
    marked : float, s
        Time of the last mark.
    observed : float, s
        When something was observed last; the start, before that.
    scales : mapping of str to tuple of ScaleState
        By name of an observation whose rule learns: what it has learnt of each component.
    steady : ndarray, (7,)
        Fading means of rate and force (`_kernels.steady_motion`), where an aid wants them.
    tilted : bool
        Whether the tilt is, since the start, known so badly that its second order counts.
    """

    engine: EngineState
    queues: Mapping[str, Epochs]
    memories: Mapping[str, Any]
    marked: float
    observed: float
    scales: Mapping[str, Scales] = field(default_factory=dict)
    steady: Array = field(default_factory=lambda: np.zeros(STEADY))
    tilted: bool = False

    @property
    def time(self) -> float:
        """Time of the newest sample, s."""
        return self.engine.time

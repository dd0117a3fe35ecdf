"""A body that stands: its velocity is zero."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from strapdown.aiding.checks import check_number
from strapdown.aiding.standstill import StandstillAid
from strapdown.aiding.view import VELOCITY, View
from strapdown.estimation.observation import Observation

__all__ = ["ZeroVelocity"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ZeroVelocity(StandstillAid):
    """Zero velocity relative to the Earth, where a detector says so.

    Attributes
    ----------
    sd : float, m/s
        Of the velocity of what is called a standstill, each component. What sways about a place
        has a velocity whose mean soon is nothing, so that subsequent observations are no worse than
        independent.
    """

    sd: float = field(default=0.02, metadata={"unit": "m_per_s"})

    kind: ClassVar[str] = "zero_velocity"
    summary: ClassVar[str] = "zero velocity at a standstill that is detected"
    source: ClassVar[str] = "Skog et al. (2010)"

    def __post_init__(self) -> None:
        super().__post_init__()
        check_number(self, "sd", low=0.0, above=True)

    def observe(self, view: View, values: Array) -> list[Observation]:
        """Return the velocity, north, east, down, unless it is far from zero."""
        if not self.near_rest(view):
            return []
        C_nl = view.C_ln.T
        H = np.zeros((3, view.columns))
        H[:, VELOCITY] = C_nl
        R = np.full(3, self.sd**2)
        return [Observation(f"{self.name}.velocity", C_nl @ view.velocity, H, R, LABELS)]


LABELS = ("VN, m/s", "VE, m/s", "VD, m/s")

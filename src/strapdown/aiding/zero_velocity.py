"""A body that stands: its velocity is zero."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from strapdown.aiding.checks import check_number
from strapdown.aiding.correlated import longer_by
from strapdown.aiding.standstill import COUNT, MEAN_RATE, StandstillAid
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
    pivot : float, m
        From the sensors to the point about which the body rolls while it is called still, as the
        sole of a shoe does over the ground: the mean rate of the window times this is a velocity,
        and its square adds to that of `sd`.
    correlation_time : float, s
        For so long the velocity of what is called a standstill lasts: its variance is more by
        `correlated.longer_by`. A shoe that rolls over its sole does so all through a stance.
    """

    sd: float = field(default=0.02, metadata={"unit": "m_per_s"})
    pivot: float = field(default=0.0, metadata={"unit": "m"})
    correlation_time: float = field(default=0.0, metadata={"unit": "s"})

    kind: ClassVar[str] = "zero_velocity"
    summary: ClassVar[str] = "zero velocity at a standstill that is detected"
    source: ClassVar[str] = "Skog et al. (2010)"

    def __post_init__(self) -> None:
        super().__post_init__()
        check_number(self, "sd", low=0.0, above=True)
        for name in ("pivot", "correlation_time"):
            check_number(self, name, low=0.0)

    @property
    def lasts(self) -> bool:
        """As `Aid.lasts`: where a correlation time is stated."""
        return self.correlation_time > 0.0

    def observe(self, view: View, values: Array) -> list[Observation]:
        """Return the velocity, north, east, down, unless it is far from zero."""
        if not self.near_rest(view):
            return []
        C_nl = view.C_ln.T
        H = np.zeros((3, view.columns))
        H[:, VELOCITY] = C_nl
        rolls = self.pivot * float(np.linalg.norm(values[MEAN_RATE]))
        interval = self.interval or self.window / float(values[COUNT])
        R = np.full(3, (self.sd**2 + rolls**2) * longer_by(interval, self.correlation_time))
        return [Observation(f"{self.name}.velocity", C_nl @ view.velocity, H, R, LABELS)]


LABELS = ("VN, m/s", "VE, m/s", "VD, m/s")

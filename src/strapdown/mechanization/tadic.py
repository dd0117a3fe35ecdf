"""North-east-down with the simplifications of a paper, to show their cost."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from strapdown._kernels import ned_simplified as kernel
from strapdown.constants import Array
from strapdown.errors import ConfigError
from strapdown.mechanization.mechanization import Mechanization
from strapdown.nav_state import NavState


@dataclass(frozen=True)
class Tadic(Mechanization):
    """The equations of Tadic and Vukajlovic (2016), with options for the terms that they neglect.

    Slowly varying quantities are taken at the start of a step: first order in the step. Use
    `NorthEastDown` to navigate; this one shows the cost of a simplification.

    Attributes
    ----------
    coriolis : bool
        The second term of Eq. (1), which the paper leaves out.
    earth_rate : bool
        Eq. (7), which "can be neglected for short navigation".
    transport_rate : bool
        Eq. (8), the rotation of the local level with position.
    gravity : float, m/s², optional
        One value, downward, everywhere; normal gravity of each position, if not given.
    as_printed : bool
        Take the third component of Eq. (8) with the sign that it has in print, which is wrong.
    ellipsoid, height, height_time_constant, latitude_limit_deg, largest_speed, height_limits
        As `Mechanization`.
    """

    coriolis: bool = False
    earth_rate: bool = True
    transport_rate: bool = True
    gravity: float | None = None
    as_printed: bool = False

    name: ClassVar[str] = "tadic"
    summary: ClassVar[str] = "the same without the terms that the paper leaves out"
    source: ClassVar[str] = "Tadic (2016) (1)-(19)"

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.gravity is not None and not 0.0 < self.gravity < 20.0:
            raise ConfigError(
                "mechanization.no-gravity-earth", quantity="gravity", gravity=self.gravity
            )

    def begin(self, start: NavState) -> Array:
        """Return the state of the kernel at a start, (12,)."""
        down = 0.0 if self.height == "held" else start.v_n[2]
        place = [start.lat, start.lon, start.alt]
        return np.array([*place, start.v_n[0], start.v_n[1], down, *start.q_nb, 0.0, 0.0])

    def advance_rows(
        self, state: Array, increments: Array, heights: Array, earth: Array, history: Array
    ) -> tuple[int, int]:
        """Advance `state` over rows of increments; return the steps made, and why it stopped."""
        switches = (
            float(self.coriolis),
            float(self.earth_rate),
            float(self.transport_rate),
            -1.0 if self.as_printed else 1.0,
            math.nan if self.gravity is None else self.gravity,
        )
        made, why = kernel.simplified_advance(
            state, increments, heights, earth, self.kernel_options(), *switches, history
        )
        return made, why

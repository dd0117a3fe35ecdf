"""North-east-down, with every term."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from strapdown._kernels import ned as kernel
from strapdown.ellipsoids import find_ellipsoid
from strapdown.mechanization.mechanization import Array, Mechanization
from strapdown.nav_state import NavState


@dataclass(frozen=True)
class NorthEastDown(Mechanization):
    """Navigation in local north-east-down on the ellipsoid.

    Velocity and position by Tadic and Vukajlovic (2016), Eqs. (1)-(9), with Earth and transport
    rate and normal gravity with height; attitude by their two-step quaternion, Eqs. (11)-(19).
    The equations are integrated in axes that are fixed in inertial space over a step, so that its
    own error is of the fourth order of the step, or too small to matter (1e-9 m/s² for steps of
    a second at 230 m/s: `_kernels.ned`); what remains is that of the increments.

    Valid up to `latitude_limit_deg`, where it stops.

    Attributes
    ----------
    ellipsoid, height, height_time_constant, latitude_limit_deg, largest_speed, height_limits
        As `Mechanization`.
    """

    name: ClassVar[str] = "ned"
    summary: ClassVar[str] = "north-east-down with every term, to 89.9° of latitude"
    source: ClassVar[str] = "Tadic (2016) (1)-(19)"

    def begin(self, start: NavState) -> Array:
        """Return the state of the kernel at a start.

        Parameters
        ----------
        start : NavState

        Returns
        -------
        ndarray, (15,)
        """
        down = 0.0 if self.height == "held" else start.v_n[2]
        sine = math.sin(start.lat)
        squared = find_ellipsoid(self.ellipsoid).eccentricity_squared
        return np.array(
            [
                start.lat,
                start.lon,
                start.alt,
                start.v_n[0],
                start.v_n[1],
                down,
                *start.q_nb,
                sine,
                math.cos(start.lat),
                1.0 / math.sqrt(1.0 - squared * sine * sine),
                0.0,
                0.0,
            ]
        )

    def advance_rows(
        self, state: Array, increments: Array, heights: Array, earth: Array, history: Array
    ) -> tuple[int, int]:
        """Advance `state` over rows of increments; return the steps made, and why no more."""
        options = self.kernel_options()
        made, why = kernel.ned_advance(state, increments, heights, earth, options, history)
        return made, why

"""North-east-down, with every term."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from strapdown._kernels import ned as kernel
from strapdown._kernels.sample import ned_update
from strapdown.constants import Array
from strapdown.ellipsoids import find_ellipsoid
from strapdown.mechanization.mechanization import Mechanization
from strapdown.nav_state import NavState


@dataclass(frozen=True)
class NorthEastDown(Mechanization):
    """Navigation in local north-east-down on the ellipsoid.

    Velocity and position by Tadic and Vukajlovic (2016), Eqs. (1)-(9), with Earth and transport
    rate and normal gravity with height; attitude by their two-step quaternion, Eqs. (11)-(19).
    The equations are integrated in axes that are fixed in inertial space over a step, so that the
    algorithm error is of the fourth order of the step, or negligible (1e-9 m/s² for steps of
    a second at 230 m/s: `_kernels.ned`); the remaining error is that of the increments.

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
        """Return the state of the kernel at a start; (15,)."""
        down = 0.0 if self.height == "held" else start.v_n[2]
        place = [start.lat, start.lon, start.alt]
        level = self._level(start.lat)
        return np.array([*place, *start.v_n[:2], down, *start.q_nb, *level, 0.0, 0.0])

    def sample_kernel(self) -> Callable[..., int]:
        """Return the compiled function for one sample."""
        return ned_update

    def correct(self, state: Array, error: ArrayLike) -> Array:
        """Subtract an error from a state, as `Mechanization.correct`."""
        after = super().correct(state, error)
        after[kernel.SINE : kernel.PRIME + 1] = self._level(float(after[kernel.LAT]))
        return after

    def _level(self, lat: float) -> tuple[float, float, float]:
        """Sine and cosine of the latitude, and the radius of the prime vertical over a."""
        sine = math.sin(lat)
        squared = find_ellipsoid(self.ellipsoid).eccentricity_squared
        return sine, math.cos(lat), 1.0 / math.sqrt(1.0 - squared * sine * sine)

    def advance_rows(
        self, state: Array, increments: Array, heights: Array, earth: Array, history: Array
    ) -> tuple[int, int]:
        """Advance `state` over rows of increments; return the steps made, and why it stopped."""
        options = self.kernel_options()
        made, why = kernel.ned_advance(state, increments, heights, earth, options, history)
        return made, why

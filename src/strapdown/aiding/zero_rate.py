"""A body that stands does not turn: what the gyros read is the Earth's rate and their errors."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from strapdown._kernels.level import AXIS
from strapdown.aiding.checks import check_number
from strapdown.aiding.point_velocity import rate_columns
from strapdown.aiding.standstill import (
    COUNT,
    MEAN_FORCE,
    MEAN_RATE,
    RATE_VARIANCE,
    StandstillAid,
)
from strapdown.aiding.view import ROTATION, View
from strapdown.estimation.error_model import PHYSICAL
from strapdown.estimation.observation import Observation
from strapdown.rotation import cross_matrix

__all__ = ["ZeroRate"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ZeroRate(StandstillAid):
    """No turn relative to the Earth, where a detector says so: the mean rate over the window.

    Its variance is that of the samples in the window over their number, and `sd_deg_per_s` squared
    beside it; where windows overlap, as much more as each sample is used more than once.

    Attributes
    ----------
    sd_deg_per_s : float, deg/s
        Of the mean rate of what is called a standstill, beyond the noise: a body that sways.
    """

    sd_deg_per_s: float = 0.005

    kind: ClassVar[str] = "zero_rate"
    summary: ClassVar[str] = "no turn at a standstill that is detected: bias of the gyros"
    source: ClassVar[str] = "Groves (2013), sec. 15.2"

    def __post_init__(self) -> None:
        super().__post_init__()
        check_number(self, "sd_deg_per_s", low=0.0, above=True)

    def observe(self, view: View, values: Array) -> list[Observation]:
        """Return the rate less the Earth's, body axes, unless the velocity is far from zero."""
        if not self.near_rest(view):
            return []
        earth = view.ellipsoid.rotation_rate * view.level[AXIS : AXIS + 3]
        C_bl = view.C_lb.T
        # A scale factor is of the true rate, which at a rest is the Earth's: of what is read, that
        # of an axis would be found to go with its bias.
        readings = np.concatenate([values[MEAN_RATE], values[MEAN_FORCE]])
        H = rate_columns(view, C_bl @ earth, view.without_errors(readings)[3:])
        z = values[MEAN_RATE] - H[:, PHYSICAL:] @ view.sensors - C_bl @ earth
        H[:, ROTATION] = -C_bl @ cross_matrix(earth)
        count = float(values[COUNT])
        used = max(self.window / self.interval, 1.0) if self.interval else count
        R = used * (values[RATE_VARIANCE] / count + math.radians(self.sd_deg_per_s) ** 2)
        return [Observation(f"{self.name}.rate", z, H, R, LABELS)]


LABELS = ("x, rad/s", "y, rad/s", "z, rad/s")

"""Alignment in the inertial frame: for a body that rocks and sways about a place."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.alignment.alignment import Alignment
from strapdown.alignment.coarse import CoarseAlignment
from strapdown.alignment.inertial_fit import fit_inertially
from strapdown.alignment.inertial_sums import sum_inertially
from strapdown.alignment.propagated_errors import sensor_covariance, sensor_noise
from strapdown.alignment.site import Site
from strapdown.sensors.imu_uncertainty import ImuUncertainty

Array = NDArray[np.float64]


@dataclass(frozen=True)
class InertialFrame(CoarseAlignment):
    """Gravity turns with the Earth, and is seen to, from axes that the gyros hold still."""

    name: ClassVar[str] = "inertial_frame"
    summary: ClassVar[str] = "Wahba's problem on the second integral of the specific force"
    source: ClassVar[str] = "Markley 1988; Gu, El-Sheimy, Hassan and Syed 2008"

    at: str = "end"

    def align(
        self,
        imu: pd.DataFrame,
        site: Site,
        sensors: ImuUncertainty,
        gnss: pd.DataFrame | None = None,
    ) -> Alignment:
        """As `CoarseAlignment.align`."""
        sums = sum_inertially(imu)
        fit = fit_inertially(sums, site)
        turn, push = fit.response.turn[:, :3], fit.response.push[:, :3]
        C_nb, time = fit.C_nb, sums.start
        if self.at == "end":
            level = rotation.dcm_from_rotation_vector(-site.earth_rate * sums.length)
            # The level turns by the Earth's rate, the body by its own.
            turn = level @ (turn + fit.C_nb)
            push = level @ push
            C_nb = level @ fit.C_nb @ rotation.dcm_from_quaternion(sums.turned[-1])
            time += sums.length
        covariance = sensor_covariance(sums, turn, push, sensors)
        covariance += sensor_noise(sums, turn, push, sensors)
        return Alignment(self.name, time, rotation.quaternion_from_dcm(C_nb), covariance)

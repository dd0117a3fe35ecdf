"""Alignment of a vehicle that drives, from its course and its accelerations by GNSS."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.alignment.alignment import Alignment
from strapdown.alignment.coarse import CoarseAlignment
from strapdown.alignment.course_fit import CourseModel
from strapdown.alignment.course_fixes import Antenna, course_fixes
from strapdown.alignment.course_rests import rest_rates
from strapdown.alignment.course_search import CourseSearch, left_out
from strapdown.alignment.record_checks import check_record
from strapdown.alignment.site import Site
from strapdown.errors import ConfigError, DataError
from strapdown.sensors.imu_uncertainty import ImuUncertainty
from strapdown.tables.checks import is_number

Array = NDArray[np.float64]

__all__ = ["GnssCourse"]

#: What the level may err by, rad: beyond it errors of attitude are no longer small.
LARGEST_TILT_SD = 0.35
#: Part of a sideslip that changes from second to second, beside what stays.
SLIP_SHARE = 0.5


@dataclass(frozen=True)
class GnssCourse(CoarseAlignment):
    """A vehicle points where it goes; its specific force less its acceleration is up.

    Attributes
    ----------
    mounting_yaw_deg : float, deg
        Heading of the unit's forward axis less that of the vehicle's.
    mounting_yaw_sd_deg, sideslip_sd_deg : float, deg
        How well that is known, and by how much the vehicle slips sideways: 1 deg for a car that
        does not turn hard; an aircraft or a ship drifts with wind and current by more.
    least_speed : float, m/s
        Below it no course is taken.
    largest_sd_deg : float, deg
        Of a course by the noise of the receiver; more is refused.
    reverse : bool
        It drives backward.
    axle_sd : float, m
        How far the unit may be ahead of the axle that is not steered, or behind it: what is off it
        goes aside while the vehicle turns.

    Raises
    ------
    ConfigError
        A number is out of range.
    """

    name: ClassVar[str] = "gnss_course"
    summary: ClassVar[str] = "course over ground, and specific force less GNSS acceleration"
    source: ClassVar[str] = "Groves 2013, sec. 5.6.2 and 6.1.1; window and weights: derived here"

    mounting_yaw_deg: float = 0.0
    mounting_yaw_sd_deg: float = 0.0
    sideslip_sd_deg: float = 1.0
    least_speed: float = 2.0
    largest_sd_deg: float = 10.0
    reverse: bool = False
    axle_sd: float = field(default=1.0, metadata={"unit": "m"})

    def __post_init__(self) -> None:
        for name, least in (
            ("mounting_yaw_deg", -math.inf),
            ("mounting_yaw_sd_deg", 0.0),
            ("sideslip_sd_deg", 0.0),
            ("least_speed", 0.0),
            ("largest_sd_deg", 0.0),
            ("axle_sd", 0.0),
        ):
            value = getattr(self, name)
            if not (is_number(value) and math.isfinite(value) and value >= least):
                raise ConfigError(
                    "alignment.not-finite" if least else "alignment.not-finite-or-negative",
                    quantity=name,
                    value=value,
                )

    def align(
        self,
        imu: pd.DataFrame,
        site: Site,
        sensors: ImuUncertainty,
        gnss: pd.DataFrame | None = None,
        antenna: Antenna = Antenna(),  # noqa: B008
    ) -> Alignment:
        """As `CoarseAlignment.align`, with velocity and biases.

        Parameters
        ----------
        imu, site, sensors, gnss
            As there.
        antenna : Antenna
            Where and when the receiver measures.

        Raises
        ------
        DataError
            There is no Gnss table, no two fixes with a velocity within the record, the vehicle
            is too slow, or what is known of the accelerations leaves no level.
        """
        findings = check_record(imu)
        slowest, widest = self.least_speed, math.radians(self.largest_sd_deg)
        fixes = course_fixes(imu, gnss, slowest, widest, antenna.velocity_delay)
        rests = rest_rates(imu, fixes, sensors)
        yaw = math.radians(self.mounting_yaw_deg) + (math.pi if self.reverse else 0.0)
        slip = math.radians(self.sideslip_sd_deg)
        yaw_sd = math.hypot(slip, math.radians(self.mounting_yaw_sd_deg))
        model = CourseModel(self.reverse, yaw, yaw_sd, SLIP_SHARE * slip, self.axle_sd, antenna)
        search = CourseSearch(imu, fixes, rests, site, sensors, model)
        found = search.over()
        sd = np.sqrt(np.linalg.eigvalsh(found.covariance[3:5, 3:5])[-1])
        if not sd < LARGEST_TILT_SD:
            raise DataError(
                "alignment.level-not-known-from-fixes",
                file=fixes.source,
                quantity="VN, VE",
                time=fixes.time[-1] - fixes.time[0],
                sd_deg=np.degrees(sd),
            )
        findings += left_out(fixes, found)
        joint = found.covariance
        return Alignment(
            self.name,
            float(imu.index[-1]),
            rotation.quaternion_from_dcm(found.C),
            joint[3:6, 3:6],
            gyro_bias=found.bias[:3],
            accel_bias=found.bias[3:],
            gyro_bias_sd=np.sqrt(np.diagonal(joint)[6:9]),
            accel_bias_sd=np.sqrt(np.diagonal(joint)[9:12]),
            heading_given=True,
            velocity=found.velocity,
            joint=joint,
            by_input=found.by_input,
            findings=findings,
        )

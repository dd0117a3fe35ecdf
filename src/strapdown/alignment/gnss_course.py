"""Alignment of a vehicle that drives, from its course and its accelerations by GNSS."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.alignment.alignment import Alignment
from strapdown.alignment.coarse import CoarseAlignment
from strapdown.alignment.course_fixes import CourseFixes, course_fixes
from strapdown.alignment.forward_sign import check_forward
from strapdown.alignment.mean_errors import force_covariance
from strapdown.alignment.record_checks import check_record
from strapdown.alignment.site import Site
from strapdown.alignment.tilt_and_heading import error_of_force_and_heading
from strapdown.earth import transport_rate
from strapdown.exceptions import ConfigError, DataError
from strapdown.sensors.imu_uncertainty import ImuUncertainty
from strapdown.tables.checks import is_number, source_of

Array = NDArray[np.float64]

__all__ = ["GnssCourse"]

#: What the horizontal part of a force may err by, as a part of the whole, rad.
LARGEST_TILT_SD = 0.35


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

    def __post_init__(self) -> None:
        for name, least in (
            ("mounting_yaw_deg", -math.inf),
            ("mounting_yaw_sd_deg", 0.0),
            ("sideslip_sd_deg", 0.0),
            ("least_speed", 0.0),
            ("largest_sd_deg", 0.0),
        ):
            value = getattr(self, name)
            if not (is_number(value) and math.isfinite(value) and value >= least):
                raise ConfigError(
                    f"{value!r} is out of range",
                    quantity=name,
                    remedy="give a finite number" + ("" if least else ", zero or more"),
                )

    def align(
        self,
        imu: pd.DataFrame,
        site: Site,
        sensors: ImuUncertainty,
        gnss: pd.DataFrame | None = None,
    ) -> Alignment:
        """As `CoarseAlignment.align`; the gyros carry the attitude from the fixes to the end.

        Raises
        ------
        DataError
            There is no Gnss table, no two fixes with a velocity within the record, the vehicle
            is too slow, or what is known of the accelerations leaves no level.
        """
        findings = check_record(imu)
        source = source_of(imu)
        fixes = course_fixes(imu, gnss, self.least_speed, math.radians(self.largest_sd_deg))
        first = _window(fixes, sensors)
        force_b, force_n, force_sd = _forces(fixes, first, site, sensors)
        if not force_sd / np.linalg.norm(force_n) < LARGEST_TILT_SD:
            raise DataError(
                f"the accelerations are known to {force_sd:.2g} m/s² over "
                f"{fixes.time[-1] - fixes.time[first]:.3g} s, and the level to no better than "
                f"{np.degrees(force_sd / np.linalg.norm(force_n)):.2g} deg",
                file=fixes.source,
                quantity="VN, VE",
                remedy="give more fixes, a receiver that measures velocity, or better gyros",
            )
        yaw = math.radians(self.mounting_yaw_deg) + (math.pi if self.reverse else 0.0)
        # The last course gives an attitude, and that tells how the others turn into the last.
        C_last = _attitude(force_b, force_n, fixes.course[-1] + yaw)
        turned = rotation.dcm_from_quaternion(fixes.turned)
        ago = (fixes.time[-1] - fixes.time)[:, None]
        level = rotation.dcm_from_rotation_vector(_level_rate(fixes, site) * ago)
        back = level @ C_last @ turned[-1].T @ turned
        heading = np.arctan2(back[:, 1, 0], back[:, 0, 0])
        off = np.radians(rotation.within_half_turn(np.degrees(fixes.course + yaw - heading)))
        drift = _gyro_sd(sensors) * (fixes.time[-1] - fixes.time)
        weight = 1.0 / (np.square(fixes.course_sd) + np.square(drift) + 1e-12)
        weight /= weight.sum()
        C_last = _attitude(force_b, force_n, fixes.course[-1] + yaw + float(weight @ off))
        variance = float(np.square(weight * fixes.course_sd).sum() + (weight @ drift) ** 2)
        variance += math.radians(self.sideslip_sd_deg) ** 2
        variance += math.radians(self.mounting_yaw_sd_deg) ** 2
        findings += check_forward(imu, fixes, self.reverse)

        _, pitch, found = rotation.euler_from_dcm(C_last)
        by_force, by_heading = error_of_force_and_heading(force_n, pitch, found, source)
        covariance = force_sd**2 * by_force @ by_force.T
        covariance += variance * np.outer(by_heading, by_heading)
        length = float(imu.index[-1] - fixes.time[-1])
        level = rotation.dcm_from_rotation_vector(-_level_rate(fixes, site) * length)
        C_end = level @ C_last @ turned[-1].T @ rotation.dcm_from_quaternion(fixes.turned_end)
        drifted = _gyro_sd(sensors) * length
        walked = max(sensors.gyro.axis("noise_density")) ** 2 * length
        covariance += (drifted**2 + walked) * np.eye(3)
        return Alignment(
            self.name,
            float(imu.index[-1]),
            rotation.quaternion_from_dcm(C_end),
            covariance,
            heading_given=True,
            findings=findings,
        )


def _gyro_sd(sensors: ImuUncertainty) -> float:
    """Bias of the worst gyro, rad/s."""
    return float(np.hypot(sensors.gyro.axis("bias"), sensors.gyro_drift.triad).max())


def _force_sd(fixes: CourseFixes, first: int, sensors: ImuUncertainty) -> float:
    """Horizontal error of the force over a window that begins at a fix, m/s²."""
    length = float(fixes.time[-1] - fixes.time[first])
    up = np.array([0.0, 0.0, -9.8])
    own = float(np.diagonal(force_covariance(sensors, length, up)).max())
    receiver = (fixes.velocity_sd[-1] ** 2 + fixes.velocity_sd[first] ** 2) / length**2
    # The gyros' bias turns gravity by half of its angle on average.
    turned = 9.8 * 0.5 * _gyro_sd(sensors) * length
    walked = 9.8**2 * max(sensors.gyro.axis("noise_density")) ** 2 * length / 3.0
    return math.sqrt(own + float(receiver) + turned**2 + walked)


def _window(fixes: CourseFixes, sensors: ImuUncertainty) -> int:
    """Fix from which the mean force to the last is known best."""
    return int(np.argmin([_force_sd(fixes, k, sensors) for k in range(len(fixes.time) - 1)]))


def _level_rate(fixes: CourseFixes, site: Site) -> Array:
    """Rate of the local level against inertial space, rad/s."""
    moving = transport_rate(site.lat_deg, site.alt, fixes.velocity[-1], ellipsoid=site.ellipsoid)
    return np.asarray(site.earth_rate + moving)


def _forces(
    fixes: CourseFixes, first: int, site: Site, sensors: ImuUncertainty
) -> tuple[Array, Array, float]:
    """Mean force over the window, in the axes at the last fix: body and local level; its sd.

    In the level at the last fix, which turns by ``w_in``, ``f = (v_1 - C v_0)/T + w_ie x v - g``
    with C and g of the level's turn; to first order in it.
    """
    length = float(fixes.time[-1] - fixes.time[first])
    gained = (fixes.gained[-1] - fixes.gained[first]) / length
    force_b = rotation.dcm_from_quaternion(fixes.turned[-1]).T @ gained
    turn = _level_rate(fixes, site)
    start = fixes.velocity[first] - np.cross(turn, fixes.velocity[first]) * length
    force_n = (fixes.velocity[-1] - start) / length
    weights = np.gradient(fixes.time[first:])
    mean_v = (weights[:, None] * fixes.velocity[first:]).sum(axis=0) / weights.sum()
    force_n = force_n + np.cross(site.earth_rate, mean_v)
    force_n = force_n - (site.gravity - np.cross(turn, site.gravity) * 0.5 * length)
    return force_b, force_n, _force_sd(fixes, first, sensors)


def _attitude(force_b: Array, force_n: Array, heading: float) -> Array:
    """``C_nb`` of a heading (rad) that lays the one force along the other."""
    c, s = math.cos(heading), math.sin(heading)
    size = float(np.linalg.norm(force_b) / np.linalg.norm(force_n))
    x, y, z = size * np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]) @ force_n
    pitch = math.asin(max(-1.0, min(1.0, force_b[0] / math.hypot(x, z)))) - math.atan2(x, -z)
    lifted = math.sin(pitch) * x + math.cos(pitch) * z
    roll = math.atan2(lifted, y) - math.atan2(force_b[2], force_b[1])
    return rotation.dcm_from_euler(np.degrees([roll, pitch, heading]))

"""Motion of a unit mounted on a moving vehicle, with lever arm, mounting angles and ringing."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from strapdown import rotation
from strapdown.sensors.crash_unit import Mounting
from strapdown.simulation.earth_motion import EarthMotion
from strapdown.simulation.ringing import Ringing
from strapdown.simulation.vehicle_points import (
    Arm,
    MovingPoint,
    PointKinematics,
    in_axes_of,
    level_change,
    moving_point,
    places_beside,
    rigid_arm,
)
from strapdown.tables import trajectory_table

Array = NDArray[np.float64]


@dataclass(frozen=True)
class MountedMotion:
    """The motion of one mounted unit, as a `Motion`.

    Attributes
    ----------
    motion : EarthMotion
        Motion of the vehicle's origin; must provide angular acceleration, as `CrashMotion` does.
    mounting : Mounting
        True position and orientation of the sensors; the standard deviations are not used.
    ringing : tuple of Ringing
        Translational oscillations of the sensors about their rigid position.

    Notes
    -----
    Exact to rounding (`vehicle_points.moving_point`): the lever arm is the rigid arm plus the
    ringing displacement, with all terms of the vehicle's rotation. Attitude and trajectory are
    those of the sensor axes, relative to local level at the sensors.
    """

    motion: EarthMotion
    mounting: Mounting = field(default_factory=Mounting)
    ringing: tuple[Ringing, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "ringing", tuple(self.ringing))

    @property
    def duration(self) -> float:
        """Length in s."""
        return self.motion.duration

    @property
    def cuts(self) -> Array:
        """Instants between which the sensed motion is smooth for quadratures of a few nodes, s.

        The edges of the pulses, and for each ringing its start and every quarter period.
        """
        edges = [np.asarray(self.motion.breaks, dtype=np.float64)]
        edges += [r.quarters() for r in self.ringing]
        return np.unique(np.concatenate(edges))

    def rate(self, time: ArrayLike) -> Array:
        """Rate relative to inertial space in sensor axes, (n, 3), rad/s."""
        return rotation.rotate(self._to_sensor, self.motion.rate(time))

    def angle(self, time: ArrayLike) -> Array:
        """Integral of the rate from time zero, (n, 3), rad."""
        return rotation.rotate(self._to_sensor, self.motion.angle(time))

    def angular_acceleration(self, time: ArrayLike) -> Array:
        """Derivative of the rate, in sensor axes, (n, 3), rad/s²."""
        return rotation.rotate(self._to_sensor, self.motion.angular_acceleration(time))

    def specific_force(self, time: ArrayLike) -> Array:
        """Specific force in sensor axes; (n, 3), m/s²."""
        t = _instants(time)
        force = self.motion.specific_force(t)
        if self.ringing or any(self.mounting.position):
            force = force + self._point(t).added_force
        return rotation.rotate(self._to_sensor, force)

    def attitude(self, time: ArrayLike) -> Array:
        """Attitude of the sensor axes, ``q_ns``, relative to local level at the sensors, (n, 4)."""
        point = self._point(_instants(time))
        return self._turned(point, self._places(point))

    def trajectory(self, time: ArrayLike, source: str | None = None) -> pd.DataFrame:
        """Position and velocity of the sensors, and attitude of their axes.

        Returns trajectory table; positions are accurate to 5e-9 m.
        """
        t = _instants(time)
        point = self._point(t)
        places = self._places(point)
        to_level = rotation.compose(level_change(point.origin, places), point.q_nv)
        return trajectory_table(
            t,
            places,
            rotation.rotate(to_level, point.velocity),
            rotation.euler_from_quaternion(self._turned(point, places)),
            source=source,
        )

    def kinematics_from(self, time: ArrayLike, *, epoch: float = 0.0) -> PointKinematics:
        """Position, velocity and acceleration including ringing, as `point_kinematics`.

        `epoch` (s): instant at which the local-level axes are fixed at the vehicle's origin.
        Returns for the sensors; ``q_nv`` is that of the vehicle. ConfigError: the epoch is outside
        the motion.
        """
        return in_axes_of(self.motion, self._point(_instants(time)), epoch)

    @cached_property
    def _to_sensor(self) -> Array:
        return rotation.conjugate(rotation.quaternion_from_euler(self.mounting.angles_deg))

    def _point(self, time: Array) -> MovingPoint:
        arm = rigid_arm(self.mounting.position, time.size)
        for ringing in self.ringing:
            arm = Arm(
                arm.place + ringing.displacement(time),
                arm.velocity + ringing.velocity(time),
                arm.acceleration + ringing.acceleration(time),
            )
        return moving_point(self.motion, arm, time)

    def _places(self, point: MovingPoint) -> Array:
        offset = rotation.rotate(point.q_nv, point.arm)
        return places_beside(self.motion, point.origin, offset)

    def _turned(self, point: MovingPoint, places: Array) -> Array:
        q_nv = rotation.compose(level_change(point.origin, places), point.q_nv)
        return rotation.compose(q_nv, rotation.conjugate(self._to_sensor))


def _instants(time: ArrayLike) -> Array:
    return np.ascontiguousarray(np.asarray(time, dtype=np.float64))

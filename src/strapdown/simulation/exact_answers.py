"""Exact reference results for a crash reconstruction."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from strapdown.sensors.crash_unit import Mounting
from strapdown.simulation.crash_motion import CrashMotion
from strapdown.simulation.imu import mean_between
from strapdown.simulation.mounted_motion import MountedMotion
from strapdown.simulation.vehicle_points import point_kinematics

Array = NDArray[np.float64]
Triple = tuple[float, float, float]

# Panel length for 8-node quadrature: a haversine of 80 ms is a polynomial of its order there.
PANEL = 0.01  # s


@dataclass(frozen=True)
class ExactAnswers:
    """Truth of one vehicle point, with time counted from the impact.

    Attributes
    ----------
    motion : CrashMotion
        Motion of the vehicle's origin.
    impact : float, s
        On the motion's clock; zero of the common time.
    point : tuple of float, m
        Vehicle axes, from the vehicle's origin.
    """

    motion: CrashMotion
    impact: float
    point: Triple = (0.0, 0.0, 0.0)

    def along_body(self, start: float, end: float) -> Array:
        """Integral of the specific force minus its initial value, rotating axes, (3,), m/s.

        An error-free recorder would integrate this between the two instants. The initial value is
        the specific force at the start of the motion.
        """
        first, last = self.impact + start, self.impact + end
        edges = np.linspace(first, last, max(2, int(np.ceil((last - first) / PANEL)) + 1))
        means = mean_between(self._force, edges, self.motion.breaks)
        total = np.diff(edges) @ means
        rest = self._force(np.zeros(1))[0]
        return np.asarray(total - (last - first) * rest)

    def over_ground(self, start: float, end: float) -> Array:
        """Change of the velocity relative to the Earth, north, east, down, (3,), m/s."""
        velocity = self.course([start, end])[1]
        return np.asarray(velocity[1] - velocity[0])

    def course(self, time: ArrayLike) -> tuple[Array, Array]:
        """Position and velocity, (n, 3) each, m and m/s, in local-level axes at the impact.

        Positions are relative to the point's position at the impact.
        """
        at = self.impact + np.r_[0.0, np.asarray(time, dtype=np.float64)]
        found = point_kinematics(self.motion, self.point, at, epoch=self.impact)
        return found.position[1:] - found.position[0], found.velocity[1:]

    def _force(self, time: Array) -> Array:
        return MountedMotion(self.motion, Mounting(self.point)).specific_force(time)

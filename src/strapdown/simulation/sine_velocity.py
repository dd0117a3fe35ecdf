"""A vehicle whose velocity is a mean and a sine in each of north, east and down."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from strapdown.ellipsoids import WGS84, Ellipsoid
from strapdown.errors import ConfigError
from strapdown.simulation.earth_motion import EarthMotion, Kinematics, Origin, check_duration
from strapdown.simulation.euler_motion import euler_attitude, euler_body_rate
from strapdown.simulation.path_attitude import along_velocity
from strapdown.simulation.place_integral import PlaceIntegral, integrate_velocity

Array = NDArray[np.float64]
Triple = tuple[float, float, float]

# Part of the greatest horizontal speed under which the path has no direction.
_LEAST = 1e-3
# Part of the duration: what a few hundred megabytes hold of an integral's panels.
_LEAST_PERIOD = 1e-5


@dataclass(frozen=True)
class SineVelocityMotion(EarthMotion):
    """``v = mean + amplitude sin(2 pi t/period + phase)``, without roll, nose along the velocity.

    The motion of ``pyins.sim.generate_sine_velocity_motion``, in closed form: velocity, attitude
    and their derivatives; the place is their integral to rounding. Pitch is that of the path, nose
    up where it climbs.

    Attributes
    ----------
    duration : float, s
    origin : Origin
    mean_velocity : tuple of float, m/s
        North, east, down.
    amplitude : tuple of float, m/s
    period : float, s
    phase_deg : tuple of float, deg
        The default makes an ellipse of latitude and longitude where the mean is zero.
    ellipsoid : Ellipsoid

    Raises
    ------
    ConfigError
        The duration is not positive, the period is under 1e-5 of it, or the vehicle comes to a
        stop, where its path has no direction.
    """

    duration: float
    origin: Origin
    mean_velocity: Triple
    amplitude: Triple = (0.0, 0.0, 0.0)
    period: float = 60.0
    phase_deg: Triple = (0.0, 90.0, 0.0)
    ellipsoid: Ellipsoid = WGS84

    def __post_init__(self) -> None:
        check_duration(self.duration)
        least = self.duration * _LEAST_PERIOD
        if not least <= self.period < math.inf:
            raise ConfigError(
                "simulation.velocity-change-period",
                quantity="period",
                period=self.period,
                least=least,
                duration=self.duration,
            )
        cycle = np.linspace(0.0, min(self.period, self.duration), 4097)
        speed = np.hypot(*self._velocity(cycle)[:, :2].T)
        if speed.min() <= _LEAST * speed.max():
            raise ConfigError(
                "simulation.horizontal-speed-falls-path-no",
                quantity="mean_velocity, amplitude",
                speed=speed.min(),
            )

    @property
    def breaks(self) -> Sequence[float]:
        """Every half period, s."""
        count = max(1, math.ceil(2.0 * self.duration / self.period))
        return [*(0.5 * self.period * k for k in range(count)), self.duration]

    def kinematics(self, time: Array) -> Kinematics:
        """State at instants; as `EarthMotion.kinematics`."""
        v = self._velocity(time)
        omega = 2.0 * math.pi / self.period
        dv = omega * np.asarray(self.amplitude) * np.cos(self._phase(time))
        turned, turning = along_velocity(v, dv)
        q_nb = euler_attitude(turned, (1.0, 0.0, 0.0, 0.0))
        return Kinematics(self._moved(time), v, dv, q_nb, euler_body_rate(turned, turning), turned)

    def _phase(self, time: Array) -> Array:
        # Whole periods are taken away without rounding, so that late phases are as good as early.
        part = np.fmod(time, self.period) / self.period
        return np.asarray(2.0 * math.pi * part[:, None] + np.radians(self.phase_deg))

    def _velocity(self, time: Array) -> Array:
        return np.asarray(
            self.mean_velocity + np.asarray(self.amplitude) * np.sin(self._phase(time))
        )

    @cached_property
    def _moved(self) -> PlaceIntegral:
        return integrate_velocity(self._velocity, self.breaks, self.origin, self.ellipsoid)

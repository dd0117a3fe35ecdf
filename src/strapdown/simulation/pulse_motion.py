"""A vehicle that is struck: pulses of acceleration and of turning, on the Earth."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from strapdown.ellipsoids import WGS84, Ellipsoid
from strapdown.exceptions import ConfigError
from strapdown.simulation.earth_motion import EarthMotion, Kinematics, Origin, check_duration
from strapdown.simulation.euler_motion import euler_attitude, euler_body_rate
from strapdown.simulation.place_integral import PlaceIntegral, integrate_velocity

Array = NDArray[np.float64]
Triple = tuple[float, float, float]

_ZERO: Triple = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class PulseMotion(EarthMotion):
    """Constant velocity, one haversine pulse, constant velocity; so does each angle's rate.

    With ``x`` from 0 to 1 over the pulse, the acceleration is ``2 D/T sin²(pi x)``, and the
    velocity has changed by ``D (x - sin(2 pi x) / 2 pi)``; D is `velocity_change`, T `length`.
    The rates of roll, pitch and heading change from zero to `rate_change` in the same way.

    Attributes
    ----------
    duration : float, s
    origin : Origin
    velocity : tuple of float, m/s
        North, east, down, before the pulse.
    velocity_change : tuple of float, m/s
        By the pulse, north, east, down.
    rate_change : tuple of float, deg/s
        Of roll, pitch, heading.
    start, length : float, s
        Of the pulse.
    roll_deg, pitch_deg, heading_deg : float, deg
        Before the pulse.
    ellipsoid : Ellipsoid

    Raises
    ------
    ConfigError
        The duration or the length is not positive, or the pulse is not within the motion.
    """

    duration: float
    origin: Origin
    velocity: Triple
    velocity_change: Triple = _ZERO
    rate_change: Triple = _ZERO
    start: float = 0.0
    length: float = 0.1
    roll_deg: float = 0.0
    pitch_deg: float = 0.0
    heading_deg: float = 0.0
    ellipsoid: Ellipsoid = WGS84

    def __post_init__(self) -> None:
        check_duration(self.duration)
        if not (self.start >= 0.0 and 0.0 < self.length <= self.duration - self.start):
            raise ConfigError(
                f"a pulse of {self.length:g} s from {self.start:g} s is not within a motion of "
                f"{self.duration:g} s",
                quantity="start, length",
                remedy="let it begin at zero or later, and end before the motion does",
            )

    @property
    def breaks(self) -> Sequence[float]:
        """Start, beginning and end of the pulse, end, s."""
        return sorted({0.0, self.start, self.start + self.length, self.duration})

    def kinematics(self, time: Array) -> Kinematics:
        """State at instants; as `EarthMotion.kinematics`."""
        x, after = self._phase(time)
        rise = (1.0 - np.cos(2.0 * math.pi * x)) / self.length
        done = x - np.sin(2.0 * math.pi * x) / (2.0 * math.pi)
        turned = self.length * (
            0.5 * x * x - (1.0 - np.cos(2.0 * math.pi * x)) / (4.0 * math.pi**2)
        )
        begin = np.array([self.roll_deg, self.pitch_deg, self.heading_deg])
        angles = begin + np.outer(turned + after, self.rate_change)
        rates = np.outer(done, self.rate_change)
        return Kinematics(
            self._moved(time),
            self._velocity(time),
            np.outer(rise, self.velocity_change),
            euler_attitude(angles, (1.0, 0.0, 0.0, 0.0)),
            euler_body_rate(angles, rates),
        )

    def _phase(self, time: Array) -> tuple[Array, Array]:
        """How much of the pulse is over, 0 to 1, and the time since its end."""
        since = time - self.start
        return np.clip(since / self.length, 0.0, 1.0), np.maximum(since - self.length, 0.0)

    def _velocity(self, time: Array) -> Array:
        x, _ = self._phase(time)
        done = x - np.sin(2.0 * math.pi * x) / (2.0 * math.pi)
        return np.asarray(self.velocity + np.outer(done, self.velocity_change))

    @cached_property
    def _moved(self) -> PlaceIntegral:
        return integrate_velocity(self._velocity, self.breaks, self.origin, self.ellipsoid)

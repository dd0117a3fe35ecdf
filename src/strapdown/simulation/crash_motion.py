"""A vehicle that is struck: pulses of acceleration and of turning, on the Earth."""

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
from strapdown.simulation.euler_motion import (
    euler_attitude,
    euler_body_acceleration,
    euler_body_rate,
)
from strapdown.simulation.place_integral import PlaceIntegral, integrate_velocity

Array = NDArray[np.float64]
Triple = tuple[float, float, float]

_ZERO: Triple = (0.0, 0.0, 0.0)
# A pulse that ends with the motion still does where rounding puts the sum just behind it.
_ROUNDING = 1e-12


@dataclass(frozen=True)
class HaversinePulse:
    """A change of velocity and of the rates of the angles, spread over a time.

    With ``x`` from 0 to 1 over the pulse, the acceleration is ``2 D/T sin²(pi x)``, the velocity
    has changed by ``D (x - sin(2 pi x)/2 pi)`` and the place by
    ``D T (x²/2 + (cos(2 pi x) - 1)/4 pi²)``; D is the change, T the length. The angles take the
    same course.

    Attributes
    ----------
    start, length : float, s
    velocity_change : tuple of float, m/s
        North, east, down.
    rate_change : tuple of float, deg/s
        Of the derivatives of roll, pitch, heading.

    Raises
    ------
    ConfigError
        A number is not finite, it begins before zero, or its length is not positive.
    """

    start: float
    length: float
    velocity_change: Triple = _ZERO
    rate_change: Triple = _ZERO

    def __post_init__(self) -> None:
        for name in ("velocity_change", "rate_change"):
            value = tuple(float(x) for x in getattr(self, name))
            if len(value) != 3 or not all(math.isfinite(x) for x in value):
                raise ConfigError(
                    "simulation.not-three-finite-numbers", quantity=name, value=getattr(self, name)
                )
            object.__setattr__(self, name, value)
        if not (0.0 <= self.start < math.inf and 0.0 < self.length < math.inf):
            raise ConfigError(
                "simulation.pulse", quantity="start, length", length=self.length, start=self.start
            )

    @property
    def end(self) -> float:
        """When it is over, s."""
        return self.start + self.length

    def over(self, time: Array) -> Array:
        """How much of it is over, from 0 to 1, (n,)."""
        return np.asarray(np.clip((time - self.start) / self.length, 0.0, 1.0))

    def slope(self, time: Array) -> Array:
        """Derivative of `done`, (n,), 1/s."""
        s = np.sin(math.pi * self.over(time))
        return np.asarray(2.0 / self.length * s * s)

    def done(self, time: Array) -> Array:
        """Part of the change that has come, from 0 to 1, (n,)."""
        x = self.over(time)
        return np.asarray(x - np.sin(2.0 * math.pi * x) / (2.0 * math.pi))

    def gathered(self, time: Array) -> Array:
        """Integral of `done` from the beginning, (n,), s."""
        x = self.over(time)
        within = 0.5 * x * x - np.sin(math.pi * x) ** 2 / (2.0 * math.pi**2)
        return np.asarray(self.length * within + np.maximum(time - self.start - self.length, 0.0))


@dataclass(frozen=True)
class CrashMotion(EarthMotion):
    """Constant velocity and constant rates of the angles, but for any number of pulses.

    Pulses may overlap: their accelerations add up, and so do the second derivatives of roll,
    pitch and heading.

    Attributes
    ----------
    duration : float, s
    origin : Origin
    velocity : tuple of float, m/s
        North, east, down, before the first pulse.
    pulses : tuple of HaversinePulse
    roll_deg, pitch_deg, heading_deg : float, deg
        Before the first pulse.
    ellipsoid : Ellipsoid

    Raises
    ------
    ConfigError
        The duration is not positive, or a pulse is not within the motion.

    Notes
    -----
    Velocity, angles and their derivatives are closed forms; the place is their integral over the
    ellipsoid within 1e-10 m a panel (`place_integral.integrate_velocity`).
    """

    duration: float
    origin: Origin
    velocity: Triple = _ZERO
    pulses: tuple[HaversinePulse, ...] = ()
    roll_deg: float = 0.0
    pitch_deg: float = 0.0
    heading_deg: float = 0.0
    ellipsoid: Ellipsoid = WGS84

    def __post_init__(self) -> None:
        check_duration(self.duration)
        object.__setattr__(self, "pulses", tuple(self.pulses))
        for k, pulse in enumerate(self.pulses):
            if pulse.end > self.duration * (1.0 + _ROUNDING):
                raise ConfigError(
                    "simulation.pulse-not-within-motion",
                    quantity=f"pulse {k + 1}, start, length",
                    length=pulse.length,
                    start=pulse.start,
                    duration=self.duration,
                )

    @property
    def breaks(self) -> Sequence[float]:
        """Start, the edges of the pulses, end, s."""
        edges = {e for p in self.pulses for e in (p.start, p.end) if e < self.duration}
        return sorted({0.0, self.duration} | edges)

    def kinematics(self, time: Array) -> Kinematics:
        """State at instants; as `EarthMotion.kinematics`."""
        acceleration, rates, swing = (np.zeros((time.size, 3)) for _ in range(3))
        angles = np.tile([self.roll_deg, self.pitch_deg, self.heading_deg], (time.size, 1))
        for pulse in self.pulses:
            slope = pulse.slope(time)
            acceleration += np.outer(slope, pulse.velocity_change)
            swing += np.outer(slope, pulse.rate_change)
            rates += np.outer(pulse.done(time), pulse.rate_change)
            angles += np.outer(pulse.gathered(time), pulse.rate_change)
        return Kinematics(
            self._moved(time),
            self._velocity(time),
            acceleration,
            euler_attitude(angles, (1.0, 0.0, 0.0, 0.0)),
            euler_body_rate(angles, rates),
            angles,
            euler_body_acceleration(angles, rates, swing),
        )

    def _velocity(self, time: Array) -> Array:
        out = np.tile(np.asarray(self.velocity, dtype=np.float64), (time.size, 1))
        for pulse in self.pulses:
            out += np.outer(pulse.done(time), pulse.velocity_change)
        return out

    @cached_property
    def _moved(self) -> PlaceIntegral:
        return integrate_velocity(self._velocity, self.breaks, self.origin, self.ellipsoid)

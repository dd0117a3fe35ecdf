"""Motions on a rotating ellipsoidal Earth: sensor truth from a course, and its position."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from strapdown import rotation
from strapdown._kernels.earth import feel, place_rates, swing
from strapdown.ellipsoids import WGS84, Ellipsoid
from strapdown.errors import ConfigError
from strapdown.simulation.motion import RateIntegral, check_numbers, integrate_rate
from strapdown.tables import trajectory_table
from strapdown.tables.checks import Array

# Closer to a pole, heading and longitude turn faster than a vehicle does.
MOST_NORTHERN = 89.0  # deg
# Height limit for normal gravity.
FARTHEST = 1e6  # m


@dataclass(frozen=True)
class Origin:
    """Start position of a motion.

    Attributes
    ----------
    lat_deg, lon_deg : float, deg
        Geodetic coordinates.
    alt : float, m
        Height above the ellipsoid.

    Raises
    ------
    ConfigError
        A number is not finite, or an angle is out of range.
    """

    lat_deg: float
    lon_deg: float
    alt: float = 0.0

    def __post_init__(self) -> None:
        if not all(math.isfinite(x) for x in (self.lat_deg, self.lon_deg, self.alt)):
            raise ConfigError("simulation.coordinate-not-finite", quantity="place")
        if abs(self.lat_deg) > 90.0:
            raise ConfigError(
                "simulation.latitude-beyond-pole"
                if abs(self.lon_deg) <= 90.0
                else "simulation.latitude-beyond-pole-2",
                quantity="lat_deg",
                lat_deg=self.lat_deg,
            )
        if abs(self.lon_deg) > 360.0:
            raise ConfigError(
                "simulation.longitude-more-than-full-turn", quantity="lon_deg", lon_deg=self.lon_deg
            )

    def place(self, moved: Array) -> Array:
        """Latitude and longitude in rad and height in m, (n, 3), after a displacement from here."""
        start = np.array([math.radians(self.lat_deg), math.radians(self.lon_deg), self.alt])
        return np.asarray(moved + start)


@dataclass(frozen=True)
class Kinematics:
    """State of a motion at n instants.

    Attributes
    ----------
    moved : ndarray, (n, 3)
        Latitude and longitude in rad and height in m, relative to the origin, so that small
        displacements keep their precision.
    velocity : ndarray, (n, 3), m/s
        Relative to the Earth: north, east, down.
    acceleration : ndarray, (n, 3), m/s²
        Time derivatives of the three velocity components.
    q_nb : ndarray, (n, 4)
        Body to local north-east-down.
    turning : ndarray, (n, 3), rad/s
        Angular rate of the body relative to local level, in body axes.
    angles : ndarray, (n, 3), deg, optional
        Roll, pitch, heading, for motions defined by them: a truth without the rounding of a
        conversion from `q_nb`.
    swinging : ndarray, (n, 3), rad/s², optional
        Time derivative of `turning`, for motions that provide it.
    """

    moved: Array
    velocity: Array
    acceleration: Array
    q_nb: Array
    turning: Array
    angles: Array | None = None
    swinging: Array | None = None


class EarthMotion(ABC):
    """Base of motions on the Earth; derives sensor inputs from the course.

    `breaks` lists the instants where the course is not smooth.
    """

    duration: float
    origin: Origin
    ellipsoid: Ellipsoid

    @abstractmethod
    def kinematics(self, time: Array) -> Kinematics:
        """State at instants (n,), s."""

    @property
    @abstractmethod
    def breaks(self) -> Sequence[float]:
        """Instants between which the body rate is smooth, from zero to the end, s."""

    def rate(self, time: ArrayLike) -> Array:
        """Body rate relative to inertial space.

        Returns (n, 3), rad/s, ``w_nb + C_nb^T (w_ie + w_en)``.
        """
        return self._feel(time)[0]

    def specific_force(self, time: ArrayLike) -> Array:
        """Specific force in body axes.

        Returns (n, 3), m/s², ``C_nb^T (v' + (2 w_ie + w_en) x v - g_n)`` with the ellipsoid's
        normal gravity.
        """
        return self._feel(time)[1]

    def angular_acceleration(self, time: ArrayLike) -> Array:
        """Time derivative of the body rate relative to inertial space.

        Returns (n, 3), rad/s², derivatives of the components of `rate` in body axes, including the
        rotation and change of the Earth's rate and the transport rate along the course.
        ConfigError: the motion does not provide the second derivative of its attitude.
        """
        k = self.kinematics(_instants(time))
        if k.swinging is None:
            raise ConfigError(
                "simulation.does-not-know-angular-acceleration",
                quantity="angular acceleration",
                name=type(self).__name__,
            )
        out = np.empty((len(k.moved), 3))
        swing(
            self.origin.place(k.moved),
            k.velocity,
            k.acceleration,
            k.q_nb,
            k.turning,
            k.swinging,
            self.ellipsoid.parameters(),
            out,
        )
        return out

    def angle(self, time: ArrayLike) -> Array:
        """Integral of the body rate from time zero.

        Returns (n, 3), rad, within 1e-14 rad per panel, plus rounding
        (`motion.integrate_rate`).
        """
        return self._integral(time)

    def attitude(self, time: ArrayLike) -> Array:
        """Attitude relative to local north-east-down, ``q_nb``; (n, 4)."""
        return self.kinematics(_instants(time)).q_nb

    def trajectory(self, time: ArrayLike, source: str | None = None) -> pd.DataFrame:
        """Position, velocity and attitude.

        Returns trajectory table. Longitude is continuous, not wrapped at 180 deg.
        """
        t = _instants(time)
        k = self.kinematics(t)
        place = k.moved.copy()
        place[:, :2] = np.degrees(place[:, :2])
        place += [self.origin.lat_deg, self.origin.lon_deg, self.origin.alt]
        return trajectory_table(t, place, k.velocity, _euler(k), source=source)

    def _feel(self, time: ArrayLike) -> tuple[Array, Array]:
        k = self.kinematics(_instants(time))
        place = self.origin.place(k.moved)
        far = ~(np.abs(place[:, 2]) <= FARTHEST)
        if far.any():
            raise ConfigError(
                "simulation.motion-comes-height", quantity="alt", place=place[far, 2][0]
            )
        rate, force = np.empty((len(k.moved), 3)), np.empty((len(k.moved), 3))
        feel(
            place,
            k.velocity,
            k.acceleration,
            k.q_nb,
            k.turning,
            self.ellipsoid.parameters(),
            rate,
            force,
        )
        return rate, force

    @cached_property
    def _integral(self) -> RateIntegral:
        return integrate_rate(self.rate, self.breaks)


def _euler(k: Kinematics) -> Array:
    """Roll, pitch and heading in deg, heading from 0 to 360."""
    if k.angles is None or (np.abs(k.angles[:, :2]) >= (180.0, 90.0)).any():
        return rotation.euler_from_quaternion(k.q_nb)
    angles = k.angles.copy()
    heading = np.mod(angles[:, 2], 360.0)
    # A heading just below zero rounds to 360 deg.
    angles[:, 2] = np.where(heading < 360.0, heading, 0.0)
    return angles


def _instants(time: ArrayLike) -> Array:
    return np.ascontiguousarray(np.asarray(time, dtype=np.float64))


@dataclass(frozen=True)
class StationaryMotion(EarthMotion):
    """Stationary: gyros measure the Earth's rate, accelerometers normal gravity.

    Attributes
    ----------
    duration : float, s
    origin : Origin
    roll_deg, pitch_deg, heading_deg : float, deg
    ellipsoid : Ellipsoid

    Raises
    ------
    ConfigError
        The duration is not positive.
    """

    duration: float
    origin: Origin
    roll_deg: float = 0.0
    pitch_deg: float = 0.0
    heading_deg: float = 0.0
    ellipsoid: Ellipsoid = WGS84

    def __post_init__(self) -> None:
        check_numbers(self, positive="duration")

    @property
    def breaks(self) -> Sequence[float]:
        """Start and end, s."""
        return (0.0, self.duration)

    def kinematics(self, time: Array) -> Kinematics:
        """Constant state; as `EarthMotion.kinematics`."""
        still = np.zeros((time.size, 3))
        angles = np.array([self.roll_deg, self.pitch_deg, self.heading_deg])
        q_nb = np.tile(rotation.quaternion_from_euler(angles), (time.size, 1))
        turned = np.tile(angles, (time.size, 1))
        return Kinematics(still, still, still, q_nb, still, turned, still)

    def angle(self, time: ArrayLike) -> Array:
        """Integral of the body rate from time zero, (n, 3), rad: the constant rate times time."""
        t = np.asarray(time, dtype=np.float64)
        return np.asarray(self.rate(np.zeros(1)) * t[:, None])


# `integrate_rate` converges to 1e-14 of its input: with these factors to 1e-17 rad, which is 6e-11
# m on the ground, and to 8e-11 m in height. Scaling by powers of two is free of rounding.
_SCALE = np.array([2.0**10, 2.0**10, 2.0**-13])
# Latitude affects its own rate only through the meridian radius, 1 % per radian at most: each
# iteration reduces the error by a factor of a hundred or more.
_ROUNDS = 16


#: Change of latitude and longitude in rad and height in m since time zero, (n, 3).
PlaceIntegral = Callable[[Array], Array]


def integrate_velocity(
    velocity: Callable[[Array], Array],
    breaks: Sequence[float],
    origin: Origin,
    ellipsoid: Ellipsoid,
) -> PlaceIntegral:
    """Integrate a piecewise smooth velocity over the ellipsoid.

    `velocity`: (n,) instants in s to (n, 3) m/s: north, east, down. `breaks` (s): instants where it
    or a derivative may jump; the first is zero, the last the end. Returns within 1e-10 m per panel,
    plus rounding. ConfigError: the vehicle comes within 1 deg of a pole.

    ``lat' = v_N/(R_M(lat) + h)``, ``lon' = v_E/((R_N(lat) + h) cos lat)``, ``h' = -v_D``, by Picard
    iteration: each iteration integrates the rates at the previous positions, as Legendre series
    over panels, until the change is within rounding.
    """
    parameters = ellipsoid.parameters()
    scaled: RateIntegral | None = None
    ends = np.asarray(breaks, dtype=np.float64)

    def rates(time: ArrayLike) -> Array:
        t = np.asarray(time, dtype=np.float64)
        moved = np.zeros((t.size, 3)) if scaled is None else scaled(t) / _SCALE
        at, out = origin.place(moved), np.empty((t.size, 3))
        _refuse_pole(at)
        place_rates(at, velocity(t), parameters, out)
        return np.asarray(out * _SCALE)

    before = np.zeros((ends.size, 3))
    for _ in range(_ROUNDS):
        scaled = integrate_rate(rates, breaks)
        now = scaled(ends) / _SCALE
        # A hundredth of the double-precision resolution of a latitude.
        if np.all(np.abs(now - before) <= [1e-18, 1e-18, 1e-11] + 1e-16 * np.abs(now)):
            break
        before = now
    found = scaled
    assert found is not None
    # Not a lambda: motions go to other processes.
    return partial(_unscaled, found)


def _unscaled(scaled: RateIntegral, time: Array) -> Array:
    return np.asarray(scaled(time) / _SCALE)


def _refuse_pole(place: Array) -> None:
    highest = float(np.degrees(np.abs(place[:, 0]).max(initial=0.0)))
    if not highest <= MOST_NORTHERN:
        raise ConfigError(
            "simulation.vehicle-comes-latitude",
            quantity="latitude",
            highest=highest,
            most_northern=MOST_NORTHERN,
        )

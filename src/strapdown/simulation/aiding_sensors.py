"""When an aid that rides on a motion measures, and how its point of the body moves then."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from strapdown import rotation
from strapdown.errors import ConfigError
from strapdown.sensors.antenna import antenna_motion
from strapdown.sensors.error_chain import Seed, child, normal, random_walk
from strapdown.sensors.triad_errors import ZERO, Triad
from strapdown.simulation.earth_motion import EarthMotion
from strapdown.tables import (
    GEODETIC,
    VELOCITY,
    barometer_table,
    body_velocity_table,
    heading_table,
    odometer_table,
)

__all__ = ["check_numbers", "instants", "place_of_point", "velocity_of_point"]


Array = NDArray[np.float64]

_MOST = 1_000_000


def instants(motion: EarthMotion, rate: float) -> Array:
    """Return the instants ``k / rate`` within a motion, (n,), s.

    Raises
    ------
    ConfigError
        There is no more than one, or there are too many.
    """
    count = math.floor(rate * motion.duration * (1.0 + 1e-12)) + 1
    if not 2 <= count <= _MOST:
        raise ConfigError(
            "simulation.hz-gives-rows",
            quantity="rate",
            rate=rate,
            count=count,
            duration=motion.duration,
            most=_MOST,
        )
    return np.minimum(np.arange(count) / rate, motion.duration)


def place_of_point(motion: EarthMotion, time: Array, arm: ArrayLike) -> Array:
    """Return where a point of the body is, (n, 3): latitude, longitude in deg, height in m."""
    return _point(motion, time, arm)[0]


def velocity_of_point(motion: EarthMotion, time: Array, arm: ArrayLike) -> Array:
    """Return how a point of the body moves relative to the Earth, body axes, (n, 3), m/s."""
    return rotation.rotate(rotation.conjugate(motion.attitude(time)), _point(motion, time, arm)[1])


def check_numbers(sensor: object, *names: str, above: bool = False) -> None:
    """Refuse attributes that are negative or not finite; or zero, if they must be above it."""
    for name in names:
        value = np.asarray(getattr(sensor, name), dtype=np.float64)
        if not np.isfinite(value).all() or (value < 0.0).any() or (above and (value == 0.0).any()):
            raise ConfigError(
                "simulation.sensor-not-positive" if above else "simulation.sensor-negative",
                quantity=name,
                value=getattr(sensor, name),
            )


def _point(motion: EarthMotion, time: Array, arm: ArrayLike) -> tuple[Array, Array]:
    truth = motion.trajectory(time)
    return antenna_motion(
        truth[GEODETIC].to_numpy(dtype=np.float64),
        truth[VELOCITY].to_numpy(dtype=np.float64),
        motion.attitude(time),
        motion.rate(time),
        arm,
        ellipsoid=motion.ellipsoid,
    )


# A barometer that rides on a motion, in weather that changes.


_NOISE, _WALK = 0, 1
_HOUR = 3600.0


@dataclass(frozen=True)
class PressureHeight:
    """What a barometer does to the truth: ``height + bias + noise``.

    Attributes
    ----------
    rate : float, Hz
    noise : float, m
        Standard deviation, new with each row.
    bias : float, m
        At time zero.
    walk : float, m/√h
        By which the bias walks.
    point : triad, m
        Of the barometer, from the point that the motion describes, in its body axes.

    Raises
    ------
    ConfigError
        A number is out of range.
    """

    rate: float = 10.0
    noise: float = 0.2
    bias: float = 0.0
    walk: float = 5.0
    point: Triad = ZERO

    def __post_init__(self) -> None:
        check_numbers(self, "rate", "noise", above=True)
        check_numbers(self, "walk")


def simulate_barometer(
    motion: EarthMotion, barometer: PressureHeight, *, seed: Seed = 0, source: str | None = None
) -> pd.DataFrame:
    """Heights of a barometer over a motion.

    Parameters
    ----------
    motion : EarthMotion
    barometer : PressureHeight
    seed : int or SeedSequence
        Of noise and walk.
    source : str, optional
        Name for messages.

    Returns
    -------
    DataFrame
        Barometer table at the instants ``k / rate``.
    """
    time = instants(motion, barometer.rate)
    height = place_of_point(motion, time, barometer.point)[:, 2]
    density = barometer.walk / math.sqrt(_HOUR)
    steps = np.diff(time, prepend=time[0] - 1.0 / barometer.rate)
    walk = random_walk(child(seed, _WALK), steps, (density, 0.0, 0.0), mean=False)[:, 0]
    noise = barometer.noise * normal(seed, _NOISE, len(time), axes=1)[:, 0]
    return barometer_table(time, height + barometer.bias + walk + noise, barometer.noise, source)


# A Doppler log, or another instrument that measures its velocity, on a motion.


_BODY_VELOCITY_NOISE = 0


@dataclass(frozen=True)
class VelocityLog:
    """What an instrument does to the truth: ``(1 + scale) C_ib v_b + noise``.

    Attributes
    ----------
    rate : float, Hz
    noise : triad, m/s
        Standard deviation along each of its axes, new with each row.
    scale : float
        Relative error of the scale factor.
    point : triad, m
        Of the instrument, from the point that the motion describes, in its body axes.
    angles_deg : triad, deg
        Roll, pitch, yaw of these body axes in the instrument (`aiding.vehicle_axes`).

    Raises
    ------
    ConfigError
        A number is out of range.
    """

    rate: float = 2.0
    noise: Triad = (0.02, 0.02, 0.02)
    scale: float = 0.0
    point: Triad = ZERO
    angles_deg: Triad = ZERO

    def __post_init__(self) -> None:
        check_numbers(self, "rate", "noise", above=True)


def simulate_body_velocity(
    motion: EarthMotion, log: VelocityLog, *, seed: Seed = 0, source: str | None = None
) -> pd.DataFrame:
    """Velocities of an instrument over a motion.

    Parameters
    ----------
    motion : EarthMotion
        Of the inertial sensors.
    log : VelocityLog
    seed : int or SeedSequence
        Of the noise.
    source : str, optional
        Name for messages.

    Returns
    -------
    DataFrame
        BodyVelocity table at the instants ``k / rate``.
    """
    time = instants(motion, log.rate)
    velocity = velocity_of_point(motion, time, log.point)
    along = (1.0 + log.scale) * velocity @ rotation.dcm_from_euler(log.angles_deg).T
    noise = normal(seed, _BODY_VELOCITY_NOISE, len(time)) * np.asarray(log.noise)
    return body_velocity_table(time, along + noise, log.noise, source)


# A compass, or a baseline of two antennas, on a motion.


_HEADING_NOISE = 0


@dataclass(frozen=True)
class Compass:
    """What a compass does to the truth: ``azimuth of an axis + misalignment + noise``.

    Attributes
    ----------
    rate : float, Hz
    noise_deg : float, deg
        Standard deviation, new with each row.
    misalignment_deg : float, deg
    axis_deg : float, deg
        Of the axis in the body, from forward to the right.

    Raises
    ------
    ConfigError
        A number is out of range.
    """

    rate: float = 5.0
    noise_deg: float = 1.0
    misalignment_deg: float = 0.0
    axis_deg: float = 0.0

    def __post_init__(self) -> None:
        check_numbers(self, "rate", "noise_deg", above=True)


def simulate_heading(
    motion: EarthMotion, compass: Compass, *, seed: Seed = 0, source: str | None = None
) -> pd.DataFrame:
    """Headings of a compass over a motion.

    Parameters
    ----------
    motion : EarthMotion
    compass : Compass
    seed : int or SeedSequence
        Of the noise.
    source : str, optional
        Name for messages.

    Returns
    -------
    DataFrame
        Heading table at the instants ``k / rate``; 0 to 360 deg.
    """
    time = instants(motion, compass.rate)
    angle = math.radians(compass.axis_deg)
    axis = np.array([math.cos(angle), math.sin(angle), 0.0])
    north, east, _ = rotation.rotate(motion.attitude(time), axis).T
    noise = compass.noise_deg * normal(seed, _HEADING_NOISE, len(time), axes=1)[:, 0]
    read = np.degrees(np.arctan2(east, north)) + compass.misalignment_deg + noise
    return heading_table(time, np.mod(read, 360.0), compass.noise_deg, source)


# A wheel that rolls along on a motion.


_ODOMETER_NOISE = 0


@dataclass(frozen=True)
class WheelSpeed:
    """What a wheel does to the truth: ``(1 + scale) v_forward + noise``.

    Attributes
    ----------
    rate : float, Hz
    noise : float, m/s
        Standard deviation, new with each row.
    scale : float
        Relative error of the scale factor.
    point : triad, m
        Of the wheel, from the point that the motion describes, in its body axes.
    angles_deg : triad, deg
        Roll, pitch, yaw of these body axes in the vehicle (`aiding.vehicle_axes`).

    Raises
    ------
    ConfigError
        A number is out of range.
    """

    rate: float = 10.0
    noise: float = 0.05
    scale: float = 0.0
    point: Triad = ZERO
    angles_deg: Triad = ZERO

    def __post_init__(self) -> None:
        check_numbers(self, "rate", "noise", above=True)


def simulate_odometer(
    motion: EarthMotion, wheel: WheelSpeed, *, seed: Seed = 0, source: str | None = None
) -> pd.DataFrame:
    """Speeds of a wheel over a motion.

    Parameters
    ----------
    motion : EarthMotion
        Of the inertial sensors.
    wheel : WheelSpeed
    seed : int or SeedSequence
        Of the noise.
    source : str, optional
        Name for messages.

    Returns
    -------
    DataFrame
        Odometer table at the instants ``k / rate``.
    """
    time = instants(motion, wheel.rate)
    velocity = velocity_of_point(motion, time, wheel.point)
    forward = velocity @ rotation.dcm_from_euler(wheel.angles_deg)[0]
    noise = wheel.noise * normal(seed, _ODOMETER_NOISE, len(time), axes=1)[:, 0]
    return odometer_table(time, (1.0 + wheel.scale) * forward + noise, wheel.noise, source)

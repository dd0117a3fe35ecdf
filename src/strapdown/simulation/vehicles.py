"""Vehicles that do a list of manoeuvres: car, aircraft, ship."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from strapdown.ellipsoids import WGS84, Ellipsoid
from strapdown.simulation.course import Limits, Manoeuvre, lay_course
from strapdown.simulation.earth_motion import Origin
from strapdown.simulation.path_motion import PathMotion
from strapdown.simulation.waves import Wave

#: What each vehicle may do. A car's grip and a sporting aircraft's wing are just above 1 g and
#: 4 g; a large ship does a tenth of a car.
LIMITS: dict[str, Limits] = {
    "car": Limits(acceleration=12.0, lateral=12.0, climb_deg=20.0),
    "aircraft": Limits(acceleration=40.0, lateral=40.0, bank_deg=75.0, climb_deg=60.0),
    "ship": Limits(acceleration=3.0, lateral=3.0, climb_deg=5.0),
}

Steps = Sequence[tuple[str, Manoeuvre]]


def car(
    origin: Origin,
    manoeuvres: Steps,
    *,
    heading_deg: float = 0.0,
    speed: float = 0.0,
    sway_roll: float = 0.0,
    sway_pitch: float = 0.0,
    limits: Limits = LIMITS["car"],
    ellipsoid: Ellipsoid = WGS84,
) -> PathMotion:
    """A car: level, nose along its path; on springs, if it is told so.

    Parameters
    ----------
    origin : Origin
    manoeuvres : sequence of (str, Manoeuvre)
        Each with its name for messages.
    heading_deg : float, deg
    speed : float, m/s
        Both at time zero.
    sway_roll, sway_pitch : float, deg/(m/s²)
        As `PathMotion`.
    limits : Limits
    ellipsoid : Ellipsoid

    Returns
    -------
    PathMotion

    Raises
    ------
    ConfigError
        As `course.lay_course` and `PathMotion`.
    """
    return replace(
        _laid(origin, manoeuvres, heading_deg, speed, limits, ellipsoid),
        sway_roll=sway_roll,
        sway_pitch=sway_pitch,
    )


def aircraft(
    origin: Origin,
    manoeuvres: Steps,
    *,
    heading_deg: float = 0.0,
    speed: float = 0.0,
    attack_deg: float = 0.0,
    limits: Limits = LIMITS["aircraft"],
    ellipsoid: Ellipsoid = WGS84,
) -> PathMotion:
    """An aircraft: banked in every turn, nose over its path by the angle of attack.

    Parameters
    ----------
    origin, manoeuvres, heading_deg, speed, limits, ellipsoid
        As `car`.
    attack_deg : float, deg

    Returns
    -------
    PathMotion

    Raises
    ------
    ConfigError
        As `car`.
    """
    return replace(
        _laid(origin, manoeuvres, heading_deg, speed, limits, ellipsoid),
        coordinated=True,
        attack_deg=attack_deg,
    )


def ship(
    origin: Origin,
    manoeuvres: Steps,
    *,
    heading_deg: float = 0.0,
    speed: float = 0.0,
    roll_waves: Sequence[Wave] = (),
    pitch_waves: Sequence[Wave] = (),
    heading_waves: Sequence[Wave] = (),
    heave_waves: Sequence[Wave] = (),
    limits: Limits = LIMITS["ship"],
    ellipsoid: Ellipsoid = WGS84,
) -> PathMotion:
    """A ship in waves.

    Parameters
    ----------
    origin, manoeuvres, heading_deg, speed, limits, ellipsoid
        As `car`.
    roll_waves, pitch_waves, heading_waves : sequence of Wave, deg
    heave_waves : sequence of Wave, m
        Downward.

    Returns
    -------
    PathMotion

    Raises
    ------
    ConfigError
        As `car`.
    """
    return replace(
        _laid(origin, manoeuvres, heading_deg, speed, limits, ellipsoid),
        roll_waves=tuple(roll_waves),
        pitch_waves=tuple(pitch_waves),
        heading_waves=tuple(heading_waves),
        heave_waves=tuple(heave_waves),
    )


def _laid(
    origin: Origin,
    manoeuvres: Steps,
    heading_deg: float,
    speed: float,
    limits: Limits,
    ellipsoid: Ellipsoid,
) -> PathMotion:
    duration, speeds, turns, climbs = lay_course(manoeuvres, speed, limits)
    return PathMotion(
        duration,
        origin,
        heading_deg=heading_deg,
        speed=speeds,
        turn_rate=turns,
        climb=climbs,
        ellipsoid=ellipsoid,
    )

"""Impacts on the front of a car: a pole, a wall, a corner."""

from __future__ import annotations

import math

from strapdown.errors import ConfigError
from strapdown.simulation.crash_course import CHOSEN, PITCH, CrashCourse, CrashScenario, Setting
from strapdown.simulation.plane_impact import YAW_GYRATION, strike, velocity_change


def pole_impact(
    entry_speed: float = 7.1,
    offset: float = 0.4,
    *,
    restitution: float = 0.10,
    gyration_squared: float = YAW_GYRATION,
    length: float = 0.113,
    pitch_deg: float = -2.0,
    setting: Setting | None = None,
) -> CrashScenario:
    """Front against a pole beside the middle, which turns the car about the pole.

    Parameters
    ----------
    entry_speed : float, m/s
    offset : float, m
        Of the pole to the right of the centre of mass: the car then turns to the right.
    restitution : float
    gyration_squared : float, m²
        In yaw.
    length : float, s
        Of the pulse.
    pitch_deg : float, deg
        The nose goes down in 0.2 s and comes up in 0.4 s.
    setting : Setting, optional

    Returns
    -------
    CrashScenario
    """
    course = CrashCourse(setting or Setting())
    course.approach(entry_speed)
    start = course.time
    change = velocity_change(entry_speed, offset, restitution, gyration_squared)
    course.nod(PITCH, pitch_deg)
    delta_v = strike(course, 0.0, change, offset, length, gyration_squared)
    course.slide(gyration_squared)
    return CrashScenario(
        "pole",
        "front against a pole 0.4 m right of the middle, as in the paper's test",
        "Tadic 2016, section 3, speed and offset; pulse, restitution and inertia chosen here",
        course.motion(),
        start,
        (start,),
        (delta_v,),
        "front",
        {
            "entry_speed": entry_speed,
            "offset": offset,
            "restitution": restitution,
            "gyration_squared": gyration_squared,
            "length": length,
            "pitch_deg": pitch_deg,
        },
    )


def frontal_impact(
    entry_speed: float = 15.65,
    *,
    restitution: float = 0.12,
    length: float = 0.110,
    pitch_deg: float = -3.0,
    setting: Setting | None = None,
) -> CrashScenario:
    """Full width of the front against a rigid wall; parameters as `pole_impact`."""
    course = CrashCourse(setting or Setting())
    course.approach(entry_speed)
    start = course.time
    change = velocity_change(entry_speed, 0.0, restitution, YAW_GYRATION)
    course.nod(PITCH, pitch_deg)
    delta_v = strike(course, 0.0, change, 0.0, length)
    course.slide(YAW_GYRATION)
    return CrashScenario(
        "frontal",
        "full width against a rigid wall at 56 km/h",
        "speed of the US NCAP frontal test, 35 mph; the rest chosen here",
        course.motion(),
        start,
        (start,),
        (delta_v,),
        "front",
        {
            "entry_speed": entry_speed,
            "restitution": restitution,
            "length": length,
            "pitch_deg": pitch_deg,
        },
    )


def oblique_impact(
    entry_speed: float = 14.0,
    direction_deg: float = -30.0,
    *,
    arm: float = 0.4,
    restitution: float = 0.10,
    length: float = 0.120,
    pitch_deg: float = -2.0,
    setting: Setting | None = None,
) -> CrashScenario:
    """Corner of the front against what does not yield.

    Parameters
    ----------
    entry_speed : float, m/s
    direction_deg : float, deg
        Where the force comes from: 0 the front, positive the right; within 80 deg of the front.
    arm : float, m
        Of the force about the centre of mass; positive turns the car to the right.
    restitution, length, pitch_deg, setting
        As `pole_impact`.

    Returns
    -------
    CrashScenario
    """
    if not abs(direction_deg) <= 80.0:
        raise ConfigError(
            "simulation.force-does-not-come-front",
            quantity="direction_deg",
            direction_deg=direction_deg,
        )
    course = CrashCourse(setting or Setting())
    course.approach(entry_speed)
    start = course.time
    closing = entry_speed * math.cos(math.radians(direction_deg))
    change = velocity_change(closing, arm, restitution, YAW_GYRATION)
    course.nod(PITCH, pitch_deg)
    delta_v = strike(course, direction_deg, change, arm, length)
    course.slide(YAW_GYRATION)
    return CrashScenario(
        "oblique",
        "left corner of the front at 50 km/h, force from 30 deg left",
        CHOSEN,
        course.motion(),
        start,
        (start,),
        (delta_v,),
        "front",
        {
            "entry_speed": entry_speed,
            "direction_deg": direction_deg,
            "arm": arm,
            "restitution": restitution,
            "length": length,
            "pitch_deg": pitch_deg,
        },
    )

"""Impacts on a car from the side and from behind, two in sequence, and a rollover."""

from __future__ import annotations

import math

from strapdown.constants import STANDARD_GRAVITY
from strapdown.simulation.crash_course import (
    CHOSEN,
    HEADING,
    PITCH,
    ROLL,
    CrashCourse,
    CrashScenario,
    Setting,
)
from strapdown.simulation.plane_impact import YAW_GYRATION, strike

#: Moment of inertia of a car in roll over its mass, m².
ROLL_GYRATION = 0.40


def side_impact(
    entry_speed: float = 8.0,
    change: float = 7.0,
    direction_deg: float = -90.0,
    *,
    arm: float = 0.3,
    length: float = 0.090,
    roll_deg: float = -3.0,
    setting: Setting | None = None,
) -> CrashScenario:
    """Struck on the side by another car while driving.

    Parameters
    ----------
    entry_speed : float, m/s
    change : float, m/s
        Of velocity, along the force.
    direction_deg : float, deg
        Where the force comes from; -90 is the left.
    arm : float, m
        Of the force about the centre of mass; positive turns the car to the right.
    length : float, s
        Of the pulse.
    roll_deg : float, deg
        Towards what strikes, which hits below the centre of mass; in 0.2 s, and back in 0.4 s.
    setting : Setting, optional

    Returns
    -------
    CrashScenario
    """
    course = CrashCourse(setting or Setting())
    course.approach(entry_speed)
    start = course.time
    course.nod(ROLL, roll_deg)
    delta_v = strike(course, direction_deg, change, arm, length)
    course.slide(YAW_GYRATION)
    return CrashScenario(
        "side",
        "struck on the left, 0.3 m ahead of the middle: 25 km/h sideways",
        CHOSEN,
        course.motion(),
        start,
        (start,),
        (delta_v,),
        "side",
        {
            "entry_speed": entry_speed,
            "change": change,
            "direction_deg": direction_deg,
            "arm": arm,
            "length": length,
            "roll_deg": roll_deg,
        },
    )


def rear_impact(
    entry_speed: float = 3.0,
    change: float = 6.7,
    *,
    offset: float = 0.2,
    length: float = 0.120,
    pitch_deg: float = 1.5,
    setting: Setting | None = None,
) -> CrashScenario:
    """Struck from behind while rolling slowly.

    Parameters
    ----------
    entry_speed, change : float, m/s
        Speed, and by how much it rises.
    offset : float, m
        Of the force to the right of the centre of mass; positive turns the car to the left.
    length : float, s
        Of the pulse.
    pitch_deg : float, deg
        The nose rises in 0.2 s and comes back in 0.4 s.
    setting : Setting, optional

    Returns
    -------
    CrashScenario
    """
    course = CrashCourse(setting or Setting())
    course.approach(entry_speed)
    start = course.time
    course.nod(PITCH, pitch_deg)
    delta_v = strike(course, 180.0, change, -offset, length)
    course.slide(YAW_GYRATION)
    return CrashScenario(
        "rear",
        "struck from behind, 0.2 m right of the middle: 24 km/h forward",
        CHOSEN,
        course.motion(),
        start,
        (start,),
        (delta_v,),
        "rear",
        {
            "entry_speed": entry_speed,
            "change": change,
            "offset": offset,
            "length": length,
            "pitch_deg": pitch_deg,
        },
    )


def two_impacts(
    entry_speed: float = 14.0,
    *,
    first: float = 8.0,
    second: float = 5.0,
    between: float = 0.5,
    setting: Setting | None = None,
) -> CrashScenario:
    """Front left, and while the car turns a blow on the right from behind.

    Parameters
    ----------
    entry_speed : float, m/s
    first, second : float, m/s
        Changes of velocity, from -20 deg in 110 ms with an arm of 0.35 m, and from 130 deg in
        90 ms with one of -0.3 m.
    between : float, s
        From the end of the first pulse to the beginning of the second.
    setting : Setting, optional

    Returns
    -------
    CrashScenario
    """
    course = CrashCourse(setting or Setting())
    course.approach(entry_speed)
    one = course.time
    course.nod(PITCH, -2.0)
    delta_1 = strike(course, -20.0, first, 0.35, 0.110)
    course.time += between
    two = course.time
    delta_2 = strike(course, 130.0, second, -0.3, 0.090)
    course.slide(YAW_GYRATION)
    return CrashScenario(
        "two-impacts",
        "29 km/h from the front left, and 0.5 s later 18 km/h from behind on the right",
        CHOSEN,
        course.motion(),
        one,
        (one, two),
        (delta_1, delta_2),
        "front",
        {"entry_speed": entry_speed, "first": first, "second": second, "between": between},
    )


def rollover(
    entry_speed: float = 12.0,
    change: float = 2.5,
    *,
    skid_deg: float = -80.0,
    height: float = 0.55,
    lift: float = 1.0,
    setting: Setting | None = None,
) -> CrashScenario:
    """Skid sideways into a kerb that trips the car: the first half turn of a rollover.

    Parameters
    ----------
    entry_speed : float, m/s
    change : float, m/s
        What the kerb takes of the speed sideways, in 0.15 s.
    skid_deg : float, deg
        Turn of the heading in 1.2 s before; negative to the left: the right wheels then strike.
        Friction brakes meanwhile.
    height : float, m
        Of the centre of mass over the kerb: the roll rate is ``change height/k²``.
    lift : float, m/s
        Upward, by the blow; gravity, and the wheels that still carry, take it back.
    setting : Setting, optional

    Returns
    -------
    CrashScenario
        It rolls on at the end.
    """
    course = CrashCourse(setting or Setting())
    course.approach(entry_speed)
    lost = min(entry_speed, 1.2 * course.setting.friction * STANDARD_GRAVITY)
    course.push(1.2, (-lost, 0.0, 0.0))
    course.lean(HEADING, skid_deg, 1.2)
    course.time += 1.2
    start = course.time
    side = -math.copysign(1.0, skid_deg)
    roll_rate = math.degrees(side * change * height / ROLL_GYRATION)
    delta_v = (0.0, -side * change, -lift)
    course.push(0.15, delta_v, (roll_rate, 0.0, 0.0))
    # Up and down again in the air; then on the ground.
    course.push(0.4, (0.0, 0.0, 2.0 * lift), delay=0.15)
    course.push(0.08, (0.0, 0.0, -lift), delay=0.55)
    course.time += 0.15
    return CrashScenario(
        "rollover",
        "sideways into a kerb: 9 km/h, and a roll rate of 200 deg/s",
        CHOSEN,
        course.motion(),
        start,
        (start,),
        (delta_v,),
        "rollover",
        {
            "entry_speed": entry_speed,
            "change": change,
            "skid_deg": skid_deg,
            "height": height,
            "lift": lift,
        },
    )

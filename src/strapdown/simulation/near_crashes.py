"""What a car goes through that is no crash, and could be taken for one."""

from __future__ import annotations

import math

from strapdown.errors import ConfigError
from strapdown.simulation.crash_course import (
    CHOSEN,
    PITCH,
    ROLL,
    CrashCourse,
    CrashScenario,
    Setting,
)


def hard_braking(
    entry_speed: float = 20.0,
    deceleration: float = 9.0,
    *,
    pitch_deg: float = -1.5,
    setting: Setting | None = None,
) -> CrashScenario:
    """Brake to a stop as hard as tyres can.

    Parameters
    ----------
    entry_speed : float, m/s
    deceleration : float, m/s²
        Constant but for 0.2 s at both ends.
    pitch_deg : float, deg
        While it brakes; it comes and goes in 0.4 s.
    setting : Setting, optional

    Returns
    -------
    CrashScenario
    """
    if not (entry_speed > 0.0 and 0.0 < deceleration < math.inf):
        raise ConfigError(
            "simulation.braking",
            quantity="entry_speed, deceleration",
            entry_speed=entry_speed,
            deceleration=deceleration,
        )
    course = CrashCourse(setting or Setting())
    course.approach(entry_speed)
    start = course.time
    course.lean(PITCH, pitch_deg, 0.4)
    course.brake(deceleration)
    course.lean(PITCH, -pitch_deg, 0.4, delay=-0.2)
    return CrashScenario(
        "hard-braking",
        "from 72 km/h to a stop at 9 m/s²",
        CHOSEN,
        course.motion(),
        start,
        parameters={
            "entry_speed": entry_speed,
            "deceleration": deceleration,
            "pitch_deg": pitch_deg,
        },
    )


def pothole(
    entry_speed: float = 14.0,
    depth: float = 0.012,
    *,
    roll_deg: float = 1.5,
    setting: Setting | None = None,
) -> CrashScenario:
    """One wheel through a pothole.

    Parameters
    ----------
    entry_speed : float, m/s
    depth : float, m
        By which the centre of mass falls, in 60 ms; the edge throws it back in 70 ms, and takes
        0.15 m/s of the speed in 40 ms.
    roll_deg : float, deg
        Meanwhile; positive for a wheel on the right.
    setting : Setting, optional

    Returns
    -------
    CrashScenario
    """
    course = CrashCourse(setting or Setting())
    course.approach(entry_speed)
    start = course.time
    course.shift((0.0, 0.0, depth), 0.06)
    course.nod(ROLL, roll_deg, 0.06, 0.15)
    course.push(0.04, (-0.15, 0.0, 0.0), delay=0.05)
    course.shift((0.0, 0.0, -depth), 0.07, delay=0.06)
    course.time += 0.21
    return CrashScenario(
        "pothole",
        "a wheel through a pothole at 50 km/h",
        CHOSEN,
        course.motion(),
        start,
        parameters={"entry_speed": entry_speed, "depth": depth, "roll_deg": roll_deg},
    )


def kerb(
    entry_speed: float = 6.0, height: float = 0.10, *, setting: Setting | None = None
) -> CrashScenario:
    """Over a kerb, head on: front wheels, and rear wheels 2.7 m later.

    Parameters
    ----------
    entry_speed : float, m/s
    height : float, m
        Of the kerb; each axle lifts the middle by half of it, in 0.12 s, and takes 0.3 m/s.
    setting : Setting, optional

    Returns
    -------
    CrashScenario
    """
    if not 0.0 < entry_speed < math.inf:
        raise ConfigError(
            "simulation.speed-does-not-lead-over", quantity="entry_speed", entry_speed=entry_speed
        )
    course = CrashCourse(setting or Setting())
    course.approach(entry_speed)
    start, wheelbase = course.time, 2.7
    tilt = math.degrees(math.asin(min(1.0, height / wheelbase)))
    for delay, sign in ((0.0, 1.0), (wheelbase / entry_speed, -1.0)):
        course.push(0.06, (-0.3, 0.0, 0.0), delay=delay)
        course.shift((0.0, 0.0, -0.5 * height), 0.12, delay=delay)
        course.lean(PITCH, sign * tilt, 0.12, delay=delay)
    course.time += wheelbase / entry_speed + 0.12
    return CrashScenario(
        "kerb",
        "head on over a kerb of 10 cm at 22 km/h",
        CHOSEN,
        course.motion(),
        start,
        parameters={"entry_speed": entry_speed, "height": height},
    )


def door_slam(
    speed: float = 0.05, roll_deg: float = -0.05, *, setting: Setting | None = None
) -> CrashScenario:
    """A door of the parked car is slammed.

    Parameters
    ----------
    speed : float, m/s
        To which the body is pulled sideways and thrown back, all within 50 ms.
    roll_deg : float, deg
        Towards the door, in 50 ms, and back in 150 ms.
    setting : Setting, optional

    Returns
    -------
    CrashScenario
    """
    course = CrashCourse(setting or Setting())
    course.approach(0.0)
    start = course.time
    course.push(0.015, (0.0, speed, 0.0))
    course.push(0.020, (0.0, -2.0 * speed, 0.0), delay=0.015)
    course.push(0.015, (0.0, speed, 0.0), delay=0.035)
    course.nod(ROLL, roll_deg, 0.05, 0.15)
    course.time += 0.2
    return CrashScenario(
        "door-slam",
        "a door slammed on the parked car, 1 g for 20 ms",
        CHOSEN,
        course.motion(),
        start,
        parameters={"speed": speed, "roll_deg": roll_deg},
    )

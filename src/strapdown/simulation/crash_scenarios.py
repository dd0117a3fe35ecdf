"""Crashes, and what is none, as motions of a car with exact truth.

The pole impact is that of Tadic and Vukajlovic (2016): its speed and offset are the paper's, its
other numbers are chosen, as are all those of the others; each is a parameter of the function that
makes it. The vehicle's origin is its centre of mass. No scenario has structural ringing: that is a
matter of the mounting (`MountedMotion`).
"""

from __future__ import annotations

import math

from strapdown.constants import STANDARD_GRAVITY
from strapdown.errors import ConfigError
from strapdown.simulation.crash_motion import (
    CHOSEN,
    HEADING,
    PITCH,
    ROLL,
    CrashCourse,
    CrashScenario,
    Setting,
    Triple,
)

# Impacts on a car from the side and from behind, two in sequence, and a rollover.


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


# What a car goes through that is no crash, and could be taken for one.


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


# Plane impact of a rigid vehicle: what a blow beside the centre of mass does.


#: Moment of inertia of a car in yaw over its mass, as for the paper's test, m².
YAW_GYRATION = 1.90


def blow(direction_deg: float, change: float) -> Triple:
    """Change of velocity in vehicle axes by a force that comes from a direction.

    Parameters
    ----------
    direction_deg : float, deg
        Principal direction of force: 0 from the front, positive clockwise.
    change : float, m/s

    Returns
    -------
    tuple of float, m/s
        Forward, right, down.
    """
    angle = math.radians(direction_deg)
    # What is only the rounding of pi is no component.
    parts = (-math.cos(angle), -math.sin(angle))
    ahead, right = (change * x if abs(x) > 1e-15 else 0.0 for x in parts)
    return ahead, right, 0.0


def velocity_change(
    closing_speed: float, arm: float, restitution: float, gyration_squared: float
) -> float:
    """Change of a vehicle's velocity in a plane impact against what does not yield.

    Parameters
    ----------
    closing_speed : float, m/s
        Of the centre of mass, along the force.
    arm : float, m
        Of the force about the centre of mass.
    restitution : float
        Speed of separation over speed of approach, at the contact and along the force.
    gyration_squared : float, m²
        Moment of inertia in yaw over mass.

    Returns
    -------
    float, m/s
        ``V0 (1 + e)/(1 + d²/k²)``.

    Notes
    -----
    An impulse P changes the velocity by P/m and the yaw rate by ``P d/(m k²)``, and so the speed
    of the contact along it by ``P/m (1 + d²/k²)``; restitution says that this is ``(1 + e) V0``.
    """
    return closing_speed * (1.0 + restitution) / (1.0 + arm * arm / gyration_squared)


def yaw_rate_change(change: float, arm: float, gyration_squared: float) -> float:
    """Change of the yaw rate that goes with one of velocity: ``dV d/k²``, in deg/s."""
    return math.degrees(change * arm / gyration_squared)


def strike(
    course: CrashCourse,
    direction_deg: float,
    change: float,
    arm: float,
    length: float,
    gyration_squared: float = YAW_GYRATION,
) -> Triple:
    """Lay down one blow with the yaw rate that its arm gives, and go on to its end.

    Parameters
    ----------
    course : CrashCourse
    direction_deg, change
        As `blow`.
    arm : float, m
        Of the force about the centre of mass; positive turns the vehicle to the right.
    length : float, s
    gyration_squared : float, m²

    Returns
    -------
    tuple of float, m/s
        The change of velocity: forward, right, down.
    """
    delta_v = blow(direction_deg, change)
    course.push(length, delta_v, (0.0, 0.0, yaw_rate_change(change, arm, gyration_squared)))
    course.time += length
    return delta_v


# Impacts on the front of a car: a pole, a wall, a corner.


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


#: Each with its own parameters; the functions make others.
CRASHES: dict[str, CrashScenario] = {
    "pole": pole_impact(),
    "frontal": frontal_impact(),
    "oblique": oblique_impact(),
    "side": side_impact(),
    "rear": rear_impact(),
    "two-impacts": two_impacts(),
    "rollover": rollover(),
    "hard-braking": hard_braking(),
    "pothole": pothole(),
    "kerb": kerb(),
    "door-slam": door_slam(),
}


def find_crash(name: str) -> CrashScenario:
    """Return the crash, or what is none, of that name.

    Parameters
    ----------
    name : str

    Returns
    -------
    CrashScenario

    Raises
    ------
    ConfigError
        There is none; the message names the nearest.
    """
    if name not in CRASHES:
        raise ConfigError(
            "simulation.no-simulated-crash", quantity="crash", name=name, word=name, known=CRASHES
        )
    return CRASHES[name]

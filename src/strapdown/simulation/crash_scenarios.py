"""Crashes, and events that are not crashes, as motions of a car with exact truth.

The pole impact is that of Tadic and Vukajlovic (2016): its speed and offset are the paper's. All
other numbers are chosen; each is a parameter of its function. The vehicle's origin is its center of
mass. Structural ringing is not part of a scenario but of the mounting (`MountedMotion`).
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

# Side and rear impacts on a car, two impacts in sequence, and a rollover.


#: Roll moment of inertia of a car over its mass, m².
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
    """Side impact by another car while driving.

    `entry_speed` (m/s). `change` (m/s): velocity change along the force. `direction_deg` (deg):
    direction the force comes from; -90 is the left. `arm` (m): arm of the force about the center of
    mass; positive yaws the car to the right. `length` (s): length of the pulse. `roll_deg` (deg):
    toward the striking car, which hits below the center of mass; in 0.2 s, and back in 0.4 s.
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
    """Rear impact while rolling slowly.

    `entry_speed`, `change` (m/s): speed, and its increase. `offset` (m): offset of the force to the
    right of the center of mass; positive yaws the car to the left. `length` (s): length of the
    pulse. `pitch_deg` (deg): the nose rises in 0.2 s and comes back in 0.4 s.
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
    """Front-left impact, then a right-rear impact while the car yaws.

    `entry_speed` (m/s). `first`, `second` (m/s): velocity changes: from -20 deg in 110 ms with an
    arm of 0.35 m, and from 130 deg in 90 ms with an arm of -0.3 m. `between` (s): from the end of
    the first pulse to the start of the second.
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
    """Skid sideways into a curb that trips the car: the first half turn of a rollover.

    `entry_speed` (m/s). `change` (m/s): lateral speed removed by the curb in 0.15 s. `skid_deg`
    (deg): heading change in the preceding 1.2 s; negative is to the left, so that the right wheels
    strike. Friction brakes meanwhile. `height` (m): height of the center of mass over the curb: the
    roll rate is ``change height/k²``. `lift` (m/s): upward velocity from the blow, removed by
    gravity and by the wheels still in contact. Returns still rolling at the end.
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
    # Up and down in the air, then on the ground.
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


# Events that are not crashes but could be mistaken for one.


def hard_braking(
    entry_speed: float = 20.0,
    deceleration: float = 9.0,
    *,
    pitch_deg: float = -1.5,
    setting: Setting | None = None,
) -> CrashScenario:
    """Brake to a stop as hard as tires can.

    `entry_speed` (m/s). `deceleration` (m/s²): constant except for 0.2 s at both ends. `pitch_deg`
    (deg): while braking; it builds up and decays in 0.4 s.
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
    """Drive one wheel through a pothole.

    `entry_speed` (m/s). `depth` (m): drop of the center of mass in 60 ms. The edge throws it back
    in 70 ms and removes 0.15 m/s of speed in 40 ms. `roll_deg` (deg): meanwhile; positive for a
    wheel on the right.
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
    """Drive over a curb, head on: front wheels, then rear wheels 2.7 m later.

    `entry_speed` (m/s). `height` (m): height of the curb. Each axle lifts the middle by half that
    in 0.12 s and removes 0.3 m/s.
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
    """Slam a door of the parked car.

    `speed` (m/s): lateral speed of the body out and back, all within 50 ms. `roll_deg` (deg):
    toward the door in 50 ms, and back in 150 ms.
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


# Plane impact of a rigid vehicle: effect of an eccentric blow.


#: Yaw moment of inertia of a car over its mass, as for the paper's test, m².
YAW_GYRATION = 1.90


def blow(direction_deg: float, change: float) -> Triple:
    """Velocity change in vehicle axes for a given principal direction of force.

    `direction_deg` (deg): principal direction of force: 0 from the front, positive clockwise.
    `change` (m/s). Returns m/s, forward, right, down.
    """
    angle = math.radians(direction_deg)
    # A component at the rounding level of pi is set to zero.
    parts = (-math.cos(angle), -math.sin(angle))
    ahead, right = (change * x if abs(x) > 1e-15 else 0.0 for x in parts)
    return ahead, right, 0.0


def velocity_change(
    closing_speed: float, arm: float, restitution: float, gyration_squared: float
) -> float:
    """Velocity change of a vehicle in a plane impact against a rigid object.

    `closing_speed` (m/s): speed of the center of mass along the force. `arm` (m): arm of the force
    about the center of mass. `restitution`: separation speed over approach speed, at the contact
    and along the force. `gyration_squared` (m²): yaw moment of inertia over mass. Returns m/s, ``V0
    (1 + e)/(1 + d²/k²)``.

    An impulse P changes the velocity by P/m and the yaw rate by ``P d/(m k²)``, hence the contact
    speed along it by ``P/m (1 + d²/k²)``; the restitution sets this to ``(1 + e) V0``.
    """
    return closing_speed * (1.0 + restitution) / (1.0 + arm * arm / gyration_squared)


def yaw_rate_change(change: float, arm: float, gyration_squared: float) -> float:
    """Yaw rate change that belongs to a velocity change: ``dV d/k²``, in deg/s."""
    return math.degrees(change * arm / gyration_squared)


def strike(
    course: CrashCourse,
    direction_deg: float,
    change: float,
    arm: float,
    length: float,
    gyration_squared: float = YAW_GYRATION,
) -> Triple:
    """Add one blow, with the yaw rate that its arm gives, and advance to its end.

    `direction_deg`, `change`: as `blow`. `arm` (m): arm of the force about the center of mass;
    positive yaws the vehicle to the right. `length` (s). `gyration_squared` (m²). Returns m/s,
    velocity change: forward, right, down.
    """
    delta_v = blow(direction_deg, change)
    course.push(length, delta_v, (0.0, 0.0, yaw_rate_change(change, arm, gyration_squared)))
    course.time += length
    return delta_v


# Frontal impacts of a car: pole, wall, corner.


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
    """Off-center frontal pole impact, which yaws the car about the pole.

    `entry_speed` (m/s). `offset` (m): offset of the pole to the right of the center of mass: the
    car then yaws to the right. `gyration_squared` (m²): in yaw. `length` (s): length of the pulse.
    `pitch_deg` (deg): Nose-down pitch, reached in 0.2 s and reversed in 0.4 s.
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
    """Full-width frontal impact on a rigid wall; parameters as `pole_impact`."""
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
    """Impact of a front corner on a rigid object.

    `entry_speed` (m/s). `direction_deg` (deg): direction the force comes from: 0 front, positive
    right; within 80 deg of the front. `arm` (m): arm of the force about the center of mass;
    positive yaws the car to the right. `restitution`, `length`, `pitch_deg`, `setting`: as
    `pole_impact`.
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


#: Scenarios with default parameters; the functions make others.
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
    """Return the crash or non-crash scenario with that name.

    Parameters
    ----------
    name : str

    Returns
    -------
    CrashScenario

    Raises
    ------
    ConfigError
        The name is unknown; the message gives the nearest.
    """
    if name not in CRASHES:
        raise ConfigError(
            "simulation.no-simulated-crash", quantity="crash", name=name, word=name, known=CRASHES
        )
    return CRASHES[name]

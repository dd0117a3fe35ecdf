"""Crashes and similar events of a car: pulses of linear and angular acceleration."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

import numpy as np

from strapdown.constants import STANDARD_GRAVITY, Triple
from strapdown.ellipsoids import WGS84, Ellipsoid
from strapdown.errors import ConfigError, check_choice
from strapdown.simulation.earth_motion import (
    EarthMotion,
    Kinematics,
    Origin,
    PlaceIntegral,
    integrate_velocity,
)
from strapdown.simulation.motion import (
    check_numbers,
    euler_attitude,
    euler_body_acceleration,
    euler_body_rate,
)
from strapdown.tables.checks import Array

_ZERO: Triple = (0.0, 0.0, 0.0)
# Tolerance for a pulse that ends with the motion, whose sum of times may round past the end.
_ROUNDING = 1e-12


@dataclass(frozen=True)
class HaversinePulse:
    """A haversine pulse that changes velocity and Euler-angle rates.

    With ``x`` from 0 to 1 over the pulse, the acceleration is ``2 D/T sin²(pi x)``, the velocity
    changes by ``D (x - sin(2 pi x)/2 pi)`` and the position by ``D T (x²/2 + (cos(2 pi x) - 1)/4
    pi²)``; D is the total change, T the length. The Euler angles follow the same profile.

    Attributes
    ----------
    start, length : float, s
    velocity_change : tuple of float, m/s
        North, east, down.
    rate_change : tuple of float, deg/s
        Change of the derivatives of roll, pitch, heading.
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
        """End of the pulse, s."""
        return self.start + self.length

    def over(self, time: Array) -> Array:
        """Elapsed fraction of the pulse, 0 to 1, (n,)."""
        return np.asarray(np.clip((time - self.start) / self.length, 0.0, 1.0))

    def slope(self, time: Array) -> Array:
        """Derivative of `done`, (n,), 1/s."""
        s = np.sin(math.pi * self.over(time))
        return np.asarray(2.0 / self.length * s * s)

    def done(self, time: Array) -> Array:
        """Fraction of the change reached, 0 to 1, (n,)."""
        x = self.over(time)
        return np.asarray(x - np.sin(2.0 * math.pi * x) / (2.0 * math.pi))

    def gathered(self, time: Array) -> Array:
        """Integral of `done` from the start, (n,), s."""
        x = self.over(time)
        within = 0.5 * x * x - np.sin(math.pi * x) ** 2 / (2.0 * math.pi**2)
        return np.asarray(self.length * within + np.maximum(time - self.start - self.length, 0.0))


@dataclass(frozen=True)
class CrashMotion(EarthMotion):
    """Constant velocity and constant Euler-angle rates, changed by any number of pulses.

    Overlapping pulses add in acceleration and in the second derivatives of roll, pitch and heading.

    Attributes
    ----------
    duration : float, s
    velocity : tuple of float, m/s
        North, east, down, before the first pulse.
    roll_deg, pitch_deg, heading_deg : float, deg
        Before the first pulse.

    Notes
    -----
    Velocity, angles and their derivatives are closed forms; the position is their integral over the
    ellipsoid, within 1e-10 m per panel (`earth_motion.integrate_velocity`).
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
        check_numbers(self, positive="duration")
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
        """Start, edges of the pulses, end, s."""
        edges = {e for p in self.pulses for e in (p.start, p.end) if e < self.duration}
        return sorted({0.0, self.duration} | edges)

    def kinematics(self, time: Array) -> Kinematics:
        """State at given instants; as `EarthMotion.kinematics`."""
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


# Course of a vehicle before, during and after an impact, built pulse by pulse.


Kind = Literal["front", "side", "rear", "rollover"]

#: Default source of a scenario's numbers.
CHOSEN = "chosen here"
ROLL, PITCH, HEADING = 0, 1, 2
# Approximate rise time of the brakes.
_RAMP = 0.2  # s


@dataclass(frozen=True)
class Setting:
    """Approach to an event and the motion after it.

    Attributes
    ----------
    origin : Origin
        Center of mass of the vehicle at time zero.
    heading_deg : float, deg
    stand : float, s
        Stationary stretch at the start, level.
    towing : float, m/s²
        Mean acceleration up to the entry speed; the peak is twice that.
    coast : float, s
        Time at that speed before the event.
    friction : float
        Mean tire friction coefficient over the slide afterwards; the peak is twice that. Times g it
        removes the speed; acting at half a wheelbase, 1.3 m from the center of mass, it stops the
        yaw. Zero for none.
    after : float, s
        Minimum duration of the motion after the end of the last impact.
    """

    origin: Origin = field(default_factory=lambda: Origin(45.0, 20.0, 100.0))
    heading_deg: float = 0.0
    stand: float = 3.0
    towing: float = 2.0
    coast: float = 0.5
    friction: float = 0.4
    after: float = 1.0
    ellipsoid: Ellipsoid = WGS84

    def __post_init__(self) -> None:
        check_numbers(self, positive="towing", not_negative="stand coast friction after")


class CrashCourse:
    """Builder of a pulse sequence; `time` is the start of the next pulse.

    Vectors are in level vehicle axes at the heading where the pulse starts: forward, right, down.
    """

    def __init__(self, setting: Setting) -> None:
        self.setting = setting
        self.time = setting.stand
        self.pulses: list[HaversinePulse] = []

    def approach(self, speed: float) -> None:
        """Accelerate from rest to a speed, and coast."""
        if not 0.0 <= speed < math.inf:
            raise ConfigError("simulation.speed", quantity="entry_speed", speed=speed)
        if speed > 0.0:
            length = speed / self.setting.towing
            self.push(length, (speed, 0.0, 0.0))
            self.time += length
        self.time += self.setting.coast

    def push(
        self, length: float, change: Triple = _ZERO, rates: Triple = _ZERO, *, delay: float = 0.0
    ) -> None:
        """Change velocity (vehicle axes, m/s) and Euler-angle rates (deg/s) in one pulse.

        Time does not advance: the next pulse overlaps.
        """
        start = self.time + delay
        heading = math.radians(self.heading(start))
        sin, cos = math.sin(heading), math.cos(heading)
        ahead, right, down = change
        north, east = cos * ahead - sin * right, sin * ahead + cos * right
        self.pulses.append(HaversinePulse(start, length, (north, east, down), rates))

    def lean(self, axis: int, angle_deg: float, length: float, *, delay: float = 0.0) -> None:
        """Rotate by an angle, from rest to rest, in two pulses."""
        half, rates = 0.5 * length, [0.0, 0.0, 0.0]
        for k, sign in enumerate((1.0, -1.0)):
            rates[axis] = sign * angle_deg / half
            self.push(half, rates=(rates[0], rates[1], rates[2]), delay=delay + k * half)

    def nod(self, axis: int, angle_deg: float, there: float = 0.2, back: float = 0.4) -> None:
        """Rotate by an angle in one time, and back in another."""
        if angle_deg != 0.0:
            self.lean(axis, angle_deg, there)
            self.lean(axis, -angle_deg, back, delay=there)

    def shift(self, way: Triple, length: float, *, delay: float = 0.0) -> None:
        """Add a displacement in m to the motion, from rest to rest, in two pulses."""
        half = 0.5 * length
        for k, sign in enumerate((1.0, -1.0)):
            x, y, z = (sign * w / half for w in way)
            self.push(half, (x, y, z), delay=delay + k * half)

    def brake(self, deceleration: float) -> None:
        """Brake to a stop at a constant deceleration with ramps of about 0.2 s.

        Pulses that each start in the middle of the previous one add up to a constant in between.
        """
        speed = float(np.hypot(*self.velocity()[:2]))
        count = max(1, round(speed / (deceleration * _RAMP)))
        ramp = speed / (deceleration * count)
        for k in range(count):
            self.push(2.0 * ramp, (-speed / count, 0.0, 0.0), delay=k * ramp)
        self.time += (count + 1) * ramp

    def slide(self, gyration_squared: float) -> None:
        """Remove all speed over ground and all yaw rate by friction, in one pulse."""
        grip = self.setting.friction * STANDARD_GRAVITY
        north, east, _ = self.velocity()
        yaw = sum(p.rate_change[HEADING] for p in self.pulses)
        lasting = max(math.hypot(north, east), abs(math.radians(yaw)) * gyration_squared / 1.3)
        if grip == 0.0 or lasting == 0.0:
            return
        length = lasting / grip
        self.pulses.append(
            HaversinePulse(self.time, length, (-north, -east, 0.0), (0.0, 0.0, -yaw))
        )

    def heading(self, time: float) -> float:
        """Heading at an instant, deg."""
        at = np.array([time])
        turned = (p.rate_change[HEADING] * float(p.gathered(at)[0]) for p in self.pulses)
        return self.setting.heading_deg + math.fsum(turned)

    def velocity(self) -> Triple:
        """Velocity north, east, down after all pulses so far, m/s."""
        north, east, down = (math.fsum(p.velocity_change[k] for p in self.pulses) for k in range(3))
        return north, east, down

    def motion(self) -> CrashMotion:
        """Motion from time zero until `after` from now or the last pulse's end, the later."""
        end = max([self.time + self.setting.after, *(p.end for p in self.pulses)])
        return CrashMotion(
            end,
            self.setting.origin,
            _ZERO,
            tuple(self.pulses),
            heading_deg=self.setting.heading_deg,
            ellipsoid=self.setting.ellipsoid,
        )


@dataclass(frozen=True)
class CrashScenario:
    """A motion with an impact, or with an event that could be mistaken for one.

    Attributes
    ----------
    name, summary : str
    source : str
        Source of its numbers.
    motion : CrashMotion
        Motion of the vehicle's center of mass.
    start : float, s
        Start of the event on the motion's clock.
    impacts : tuple of float, s
        Start of each impact; empty without a crash.
    ends : tuple of float, s
        End of each: the force of the impact is zero from there on, that of tires is not.
    delta_v : tuple of triples, m/s
        Velocity change of the center of mass in each impact: forward, right, down at the vehicle's
        heading when it starts.
    kind : {'front', 'side', 'rear', 'rollover'}, optional
        Kind of the first impact.
    parameters : mapping
        Parameters of the scenario, SI and deg.
    """

    name: str
    summary: str
    source: str
    motion: CrashMotion
    start: float
    impacts: tuple[float, ...] = ()
    ends: tuple[float, ...] = ()
    delta_v: tuple[Triple, ...] = ()
    kind: Kind | None = None
    parameters: Mapping[str, float] = field(default_factory=dict)


# Scenarios: their numbers are in crashes.toml.

#: The tables of crashes and of cases.
TABLES: dict[str, Any] = tomllib.loads(
    Path(__file__).with_name("crashes.toml").read_text(encoding="utf-8")
)
#: Moments of inertia of a car over its mass, in yaw (as for the paper's test) and in roll, m².
YAW_GYRATION, ROLL_GYRATION = 1.90, 0.40


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


def strike(
    course: CrashCourse,
    direction_deg: float,
    change: float,
    arm: float,
    length: float,
    gyration_squared: float = YAW_GYRATION,
) -> Triple:
    """Add one blow, with the yaw rate ``dV d/k²`` of its arm; return its velocity change (`blow`).

    Time advances to its end. `arm` in m is positive where it yaws the vehicle to the right.
    """
    delta_v = blow(direction_deg, change)
    yaw_rate = math.degrees(change * arm / gyration_squared)
    course.push(length, delta_v, (0.0, 0.0, yaw_rate))
    course.time += length
    return delta_v


# A course lays its pulses and returns the start of the event, and starts, ends and velocity changes
# of the impacts.
Parameters = Mapping[str, float]
Events = tuple[float, tuple[float, ...], tuple[float, ...], tuple[Triple, ...]]


def _impact(course: CrashCourse, p: Parameters) -> Events:
    """One blow of given velocity change or restitution, then a slide to rest."""
    start, direction = course.time, p["direction_deg"]
    yaw_gyration = p.get("gyration_squared", YAW_GYRATION)
    along = math.cos(math.radians(direction))
    arm = p["arm"] if "arm" in p else p.get("offset", 0.0) * along
    if "change" in p:
        change = p["change"]
    else:
        if not abs(direction) <= 80.0:
            raise ConfigError(
                "simulation.force-does-not-come-front",
                quantity="direction_deg",
                direction_deg=direction,
            )
        change = velocity_change(p["entry_speed"] * along, arm, p["restitution"], yaw_gyration)
    if "roll_deg" in p:
        course.nod(ROLL, p["roll_deg"])
    else:
        course.nod(PITCH, p["pitch_deg"])
    delta_v = strike(course, direction, change, arm, p["length"], yaw_gyration)
    end = course.time
    course.slide(yaw_gyration)
    return start, (start,), (end,), (delta_v,)


def _two_impacts(course: CrashCourse, p: Parameters) -> Events:
    """A front-left impact, then a right-rear impact while the car yaws."""
    one = course.time
    course.nod(PITCH, -2.0)
    delta_1 = strike(course, -20.0, p["first"], 0.35, 0.110)
    end_1 = course.time
    course.time += p["between"]
    two = course.time
    delta_2 = strike(course, 130.0, p["second"], -0.3, 0.090)
    end_2 = course.time
    course.slide(YAW_GYRATION)
    return one, (one, two), (end_1, end_2), (delta_1, delta_2)


def _rollover(course: CrashCourse, p: Parameters) -> Events:
    """A skid sideways, braked by friction, into a curb: the first half turn, still rolling."""
    lost = min(p["entry_speed"], 1.2 * course.setting.friction * STANDARD_GRAVITY)
    course.push(1.2, (-lost, 0.0, 0.0))
    course.lean(HEADING, p["skid_deg"], 1.2)
    course.time += 1.2
    start = course.time
    side = -math.copysign(1.0, p["skid_deg"])
    roll_rate = math.degrees(side * p["change"] * p["height"] / ROLL_GYRATION)
    delta_v = (0.0, -side * p["change"], -p["lift"])
    course.push(0.15, delta_v, (roll_rate, 0.0, 0.0))
    # Up and down in the air, then on the ground.
    course.push(0.4, (0.0, 0.0, 2.0 * p["lift"]), delay=0.15)
    course.push(0.08, (0.0, 0.0, -p["lift"]), delay=0.55)
    course.time += 0.15
    return start, (start,), (course.time,), (delta_v,)


def _hard_braking(course: CrashCourse, p: Parameters) -> Events:
    if not (p["entry_speed"] > 0.0 and 0.0 < p["deceleration"] < math.inf):
        raise ConfigError(
            "simulation.braking",
            quantity="entry_speed, deceleration",
            entry_speed=p["entry_speed"],
            deceleration=p["deceleration"],
        )
    start = course.time
    course.lean(PITCH, p["pitch_deg"], 0.4)
    course.brake(p["deceleration"])
    course.lean(PITCH, -p["pitch_deg"], 0.4, delay=-0.2)
    return start, (), (), ()


def _pothole(course: CrashCourse, p: Parameters) -> Events:
    start = course.time
    course.shift((0.0, 0.0, p["depth"]), 0.06)
    course.nod(ROLL, p["roll_deg"], 0.06, 0.15)
    course.push(0.04, (-0.15, 0.0, 0.0), delay=0.05)
    course.shift((0.0, 0.0, -p["depth"]), 0.07, delay=0.06)
    course.time += 0.21
    return start, (), (), ()


def _kerb(course: CrashCourse, p: Parameters) -> Events:
    """Over a curb, head on: front wheels, then rear wheels 2.7 m later."""
    speed = p["entry_speed"]
    if not 0.0 < speed < math.inf:
        raise ConfigError(
            "simulation.speed-does-not-lead-over", quantity="entry_speed", entry_speed=speed
        )
    start, wheelbase = course.time, 2.7
    tilt = math.degrees(math.asin(min(1.0, p["height"] / wheelbase)))
    for delay, sign in ((0.0, 1.0), (wheelbase / speed, -1.0)):
        course.push(0.06, (-0.3, 0.0, 0.0), delay=delay)
        course.shift((0.0, 0.0, -0.5 * p["height"]), 0.12, delay=delay)
        course.lean(PITCH, sign * tilt, 0.12, delay=delay)
    course.time += wheelbase / speed + 0.12
    return start, (), (), ()


def _door_slam(course: CrashCourse, p: Parameters) -> Events:
    start = course.time
    course.push(0.015, (0.0, p["speed"], 0.0))
    course.push(0.020, (0.0, -2.0 * p["speed"], 0.0), delay=0.015)
    course.push(0.015, (0.0, p["speed"], 0.0), delay=0.035)
    course.nod(ROLL, p["roll_deg"], 0.05, 0.15)
    course.time += 0.2
    return start, (), (), ()


_COURSES: dict[str, Callable[[CrashCourse, Parameters], Events]] = {
    "impact": _impact,
    "two-impacts": _two_impacts,
    "rollover": _rollover,
    "hard-braking": _hard_braking,
    "pothole": _pothole,
    "kerb": _kerb,
    "door-slam": _door_slam,
}


def crash_scenario(
    name: str, *, setting: Setting | None = None, **parameters: float
) -> CrashScenario:
    """Make a crash, or another event, with parameters of its own.

    Parameters
    ----------
    name : str
        A name of `CRASHES`.
    setting : Setting, optional
        The approach, and the motion after the event.
    **parameters : float
        Replace those of ``crashes.toml``, which has their units and meaning.

    Returns
    -------
    CrashScenario

    Raises
    ------
    ConfigError
        The name is unknown, or a number is out of range.
    """
    if name not in TABLES["crashes"]:
        raise ConfigError(
            "simulation.no-simulated-crash", quantity="crash", name=name, word=name, known=CRASHES
        )
    table = TABLES["crashes"][name]
    if unknown := parameters.keys() - table["parameters"].keys():
        raise TypeError(f"{name} has no parameter {', '.join(sorted(unknown))}")
    own = {**table["parameters"], **parameters}
    course = CrashCourse(setting or Setting())
    course.approach(own.get("entry_speed", 0.0))
    start, impacts, ends, delta_v = _COURSES[table.get("course", "impact")](
        course, {**table, **own}
    )
    return CrashScenario(
        name,
        table["summary"],
        table.get("source", CHOSEN),
        course.motion(),
        start,
        impacts,
        ends,
        delta_v,
        table.get("kind"),
        own,
    )


#: Crashes and other events with the parameters of their table.
CRASHES: dict[str, CrashScenario] = {name: crash_scenario(name) for name in TABLES["crashes"]}


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
    check_choice("simulation.no-simulated-crash", CRASHES, quantity="crash", name=name)
    return CRASHES[name]

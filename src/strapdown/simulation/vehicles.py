"""Vehicles that follow a list of maneuvers: car, aircraft, ship."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from strapdown.constants import STANDARD_GRAVITY
from strapdown.errors import ConfigError
from strapdown.simulation.earth_motion import Origin
from strapdown.simulation.motion import Track, check_numbers, minimum_jerk
from strapdown.simulation.path_motion import (
    Course,
    Limits,
    Manoeuvre,
    PathMotion,
    integrate_track,
    lay_course,
)

#: Performance limits of each vehicle. A car's grip and an aerobatic aircraft's wing give just above
#: 1 g and 4 g; a large ship reaches a tenth of a car.
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
    speed: float = 0.0,
    limits: Limits = LIMITS["car"],
    **path: Any,
) -> PathMotion:
    """A car: level, nose along its path; on springs with `sway_roll` and `sway_pitch`.

    Parameters
    ----------
    origin : Origin
    manoeuvres : sequence of (str, Manoeuvre)
        Each with its name for messages.
    speed : float, m/s
        At time zero.
    limits : Limits
    **path
        Other fields of `PathMotion`: ``heading_deg`` at time zero, ``ellipsoid`` …

    Raises
    ------
    ConfigError
        As `lay_course` and `PathMotion`.
    """
    duration, speeds, turns, climbs = lay_course(manoeuvres, speed, limits)
    return PathMotion(duration, origin, speed=speeds, turn_rate=turns, climb=climbs, **path)


def aircraft(
    origin: Origin, manoeuvres: Steps, *, limits: Limits = LIMITS["aircraft"], **path: Any
) -> PathMotion:
    """An aircraft, as `car`: banked in every turn, pitched above its path by `attack_deg`."""
    return car(origin, manoeuvres, limits=limits, coordinated=True, **path)


def ship(
    origin: Origin, manoeuvres: Steps, *, limits: Limits = LIMITS["ship"], **path: Any
) -> PathMotion:
    """A ship, as `car`, with `roll_waves`, `pitch_waves`, `heading_waves`, `heave_waves`."""
    return car(origin, manoeuvres, limits=limits, **path)


# Ratio of largest to mean slope of a minimum-jerk move.
_PEAK = 15.0 / 8.0
# Nodes for the integral over a ramp.
_NODES = 32


@dataclass(frozen=True)
class Accelerate:
    """Change to another speed, higher or lower, with minimum jerk.

    Attributes
    ----------
    to : float, m/s
    duration : float, s
        The largest acceleration is 15/8 of the mean.
    """

    to: float
    duration: float

    def lay(self, course: Course) -> None:
        """Append it to a course."""
        check_numbers(self, positive="duration", not_negative="to")
        greatest = _PEAK * abs(self.to - course.speed_now) / self.duration
        if greatest > course.limits.acceleration:
            least = self.duration * greatest / course.limits.acceleration
            raise ConfigError(
                "simulation.acceleration-too-large",
                quantity="duration",
                speed=course.speed_now,
                to=self.to,
                duration=self.duration,
                greatest=greatest,
                limit=course.limits.acceleration,
                least=least,
            )
        course.move(course.speed, course.time, self.duration, self.to)
        course.time += self.duration


@dataclass(frozen=True)
class Brake(Accelerate):
    """Decrease to another speed; as `Accelerate`, but it must be lower."""

    def lay(self, course: Course) -> None:
        """Append it to a course."""
        if self.to >= course.speed_now:
            raise ConfigError(
                "simulation.braking-not-slower",
                quantity="to",
                speed=course.speed_now,
                to=self.to,
            )
        super().lay(course)


@dataclass(frozen=True)
class Stop:
    """Brake to a stop, and remain stationary.

    Attributes
    ----------
    braking, stay : float, s
    """

    braking: float
    stay: float = 0.0

    def lay(self, course: Course) -> None:
        """Append it to a course."""
        Brake(0.0, self.braking).lay(course)
        check_numbers(self, not_negative="stay")
        course.time += self.stay


@dataclass(frozen=True)
class Straight:
    """Continue unchanged, or remain stationary, for a time.

    Attributes
    ----------
    duration : float, s
    """

    duration: float

    def lay(self, course: Course) -> None:
        """Append it to a course."""
        check_numbers(self, positive="duration")
        course.time += self.duration


@dataclass(frozen=True)
class Along:
    """Continue straight for a distance.

    Attributes
    ----------
    distance : float, m
        Along the path.
    """

    distance: float

    def lay(self, course: Course) -> None:
        """Append it to a course."""
        check_numbers(self, positive="distance")
        course.time += self.distance / course.moving_speed("simulation.distance-at-rest")


@dataclass(frozen=True)
class Turn:
    """Turn with a given radius.

    Attributes
    ----------
    angle_deg : float, deg
        Total heading change including the ramps, positive to the right.
    radius : float, m
        Horizontal radius between the ramps.
    ramp : float, s
        Time in which the turn rate builds up and decays with minimum jerk; shorter where the angle
        is too small for two full ramps.
    """

    angle_deg: float
    radius: float
    ramp: float = 1.0

    def lay(self, course: Course) -> None:
        """Append it to a course."""
        check_numbers(self, positive="radius ramp")
        speed, most = course.level_speed("simulation.turn-at-rest"), course.limits.lateral
        lateral = speed * speed / self.radius
        if lateral > most:
            raise ConfigError(
                "simulation.radius-too-small",
                quantity="radius",
                speed=speed,
                radius=self.radius,
                lateral=lateral,
                limit=most,
                least=speed * speed / most,
                slowest=math.sqrt(most * self.radius),
            )
        _turn(course, self.angle_deg, math.degrees(speed / self.radius), self.ramp)


@dataclass(frozen=True)
class BankedTurn:
    """Coordinated turn at a given bank angle.

    Attributes
    ----------
    angle_deg : float, deg
        Total heading change including the ramps, positive to the right.
    bank_deg : float, deg
        Between the ramps; the turn rate is ``g tan(bank)/(v cos climb)``.
    ramp : float, s
        As in `Turn`.
    """

    angle_deg: float
    bank_deg: float
    ramp: float = 3.0

    def lay(self, course: Course) -> None:
        """Append it to a course."""
        check_numbers(self, positive="ramp")
        most = course.limits.bank_deg
        if not 0.0 < self.bank_deg <= most:
            raise ConfigError(
                "simulation.bank-out-of-range",
                quantity="bank",
                bank=self.bank_deg,
                most=most,
            )
        lateral = STANDARD_GRAVITY * math.tan(math.radians(self.bank_deg))
        rate = math.degrees(lateral / course.level_speed("simulation.turn-at-rest"))
        _turn(course, self.angle_deg, rate, self.ramp)


@dataclass(frozen=True)
class Climb:
    """Climb or descend.

    Attributes
    ----------
    angle_deg : float, deg
        Climb angle above the horizon, negative in a descent.
    height : float, m, optional
        Height change until the path is level again; if not given, the climb continues until
        `Level`.
    ramp : float, s
        Time in which the angle builds up and decays.
    """

    angle_deg: float
    height: float | None = None
    ramp: float = 3.0

    def lay(self, course: Course) -> None:
        """Append it to a course."""
        most = course.limits.climb_deg
        if not 0.0 < abs(self.angle_deg) <= most:
            raise ConfigError(
                "simulation.climb-out-of-range",
                quantity="angle",
                angle=self.angle_deg,
                most=most,
            )
        speed = course.moving_speed("simulation.climb-at-rest")
        check_numbers(self, positive="ramp")
        if self.height is None:
            course.move(course.climb, course.time, self.ramp, self.angle_deg)
            course.time += self.ramp
            return
        check_numbers(self, positive="height")
        if course.climb_now != 0.0:
            raise ConfigError(
                "simulation.climb-not-from-level",
                quantity="height",
            )
        steep = abs(self.angle_deg)
        x, w = np.polynomial.legendre.leggauss(_NODES)
        rising = np.sin(np.radians(steep * minimum_jerk(0.5 * (1.0 + x))[0]))
        ramps = speed * self.ramp * float(w @ rising)
        hold = (self.height - ramps) / (speed * math.sin(math.radians(steep)))
        if hold < 0.0:
            raise ConfigError(
                "simulation.climb-ramps-too-high",
                quantity="height",
                ramp=self.ramp,
                gain=ramps,
                height=self.height,
            )
        course.move(course.climb, course.time, self.ramp, self.angle_deg)
        course.move(course.climb, course.time + self.ramp + hold, self.ramp, 0.0)
        course.time += 2.0 * self.ramp + hold


@dataclass(frozen=True)
class Level:
    """Level off from a climb.

    Attributes
    ----------
    ramp : float, s
    """

    ramp: float = 3.0

    def lay(self, course: Course) -> None:
        """Append it to a course."""
        check_numbers(self, positive="ramp")
        course.move(course.climb, course.time, self.ramp, 0.0)
        course.time += self.ramp


@dataclass(frozen=True)
class LaneChange:
    """Change to a parallel lane.

    Attributes
    ----------
    offset : float, m
        To the right.
    duration : float, s
        Total time; the course leaves and returns by two ramps of a quarter each.
    """

    offset: float
    duration: float

    def lay(self, course: Course) -> None:
        """Append it to a course."""
        check_numbers(self, positive="duration")
        speed, most = course.level_speed("simulation.lane-change-at-rest"), course.limits.lateral
        quarter = 0.25 * self.duration
        times = tuple(quarter * k for k in range(5))
        shape = Track(times, (0.0, 1.0, 0.0, -1.0, 0.0))
        x, w = np.polynomial.legendre.leggauss(_NODES)
        inner = (np.asarray(times[:-1])[:, None] + 0.5 * quarter * (1.0 + x)).ravel()
        turned = np.radians(integrate_track(shape, inner))
        weight = 0.5 * quarter * np.tile(w, 4)

        def reached(rate: float) -> float:
            return float(speed * (weight @ np.sin(rate * turned)))

        # The course changes by at most 60 deg, for which the offset increases with the rate.
        steepest = math.radians(60.0) / float(turned.max())
        rate = _solve(reached, abs(self.offset), steepest)
        if rate is None or speed * math.radians(rate) > most:
            raise ConfigError(
                "simulation.lane-change-too-fast",
                quantity="duration",
                offset=self.offset,
                duration=self.duration,
                speed=speed,
                limit=most,
            )
        side = math.copysign(rate, self.offset)
        for k, value in enumerate((side, 0.0, -side, 0.0)):
            course.move(course.turn_rate, course.time + quarter * k, quarter, value)
        course.time += self.duration


def _turn(course: Course, angle: float, rate: float, ramp: float) -> None:
    if not (math.isfinite(angle) and angle != 0.0):
        raise ConfigError(
            "simulation.turn-by-no-angle",
            quantity="angle",
            angle=angle,
        )
    whole = abs(angle) / rate
    ramp = min(ramp, whole)
    side = math.copysign(rate, angle)
    course.move(course.turn_rate, course.time, ramp, side)
    course.move(course.turn_rate, course.time + whole, ramp, 0.0)
    course.time += whole + ramp


def _solve(reached: Callable[[float], float], wanted: float, highest: float) -> float | None:
    from scipy.optimize import brentq

    if wanted == 0.0:
        return 0.0
    if reached(highest) < wanted:
        return None
    return float(brentq(lambda r: reached(r) - wanted, 0.0, highest, xtol=1e-14))

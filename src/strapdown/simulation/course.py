"""A course as tracks of speed, turn rate and climb, laid by one manoeuvre after another."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Protocol

from strapdown.errors import ConfigError
from strapdown.simulation.minimum_jerk import Track


@dataclass(frozen=True)
class Limits:
    """What a vehicle can do.

    Attributes
    ----------
    acceleration : float, m/s²
        Of its speed.
    lateral : float, m/s²
        In a turn.
    bank_deg : float, deg
    climb_deg : float, deg
        Up or down.
    """

    acceleration: float = 12.0
    lateral: float = 12.0
    bank_deg: float = 75.0
    climb_deg: float = 75.0


@dataclass
class Course:
    """Tracks that grow by one manoeuvre after another.

    Attributes
    ----------
    time : float, s
        Up to here it is laid.
    limits : Limits
    speed, turn_rate, climb : list of (time, value)
        m/s, deg/s, deg.
    """

    limits: Limits
    speed: list[tuple[float, float]]
    turn_rate: list[tuple[float, float]] = field(default_factory=lambda: [(0.0, 0.0)])
    climb: list[tuple[float, float]] = field(default_factory=lambda: [(0.0, 0.0)])
    time: float = 0.0

    def move(
        self, points: list[tuple[float, float]], start: float, length: float, to: float
    ) -> None:
        """Let a coordinate hold until `start`, and come to a value with least jerk."""
        if start > points[-1][0]:
            points.append((start, points[-1][1]))
        if length > 0.0:
            points.append((start + length, to))

    @property
    def speed_now(self) -> float:
        """Speed at the end of what is laid, m/s."""
        return self.speed[-1][1]

    @property
    def climb_now(self) -> float:
        """Angle of climb there, deg."""
        return self.climb[-1][1]

    def moving_speed(self, code: str) -> float:
        """Speed there; an error of this code where it is zero."""
        if self.speed_now <= 0.0:
            raise ConfigError(code, quantity="speed")
        return self.speed_now

    def level_speed(self, code: str) -> float:
        """Horizontal part of it, m/s."""
        return self.moving_speed(code) * math.cos(math.radians(self.climb_now))


class Manoeuvre(Protocol):
    """What a vehicle is told to do."""

    def lay(self, course: Course) -> None:
        """Add it to a course."""
        ...


def lay_course(
    manoeuvres: Sequence[tuple[str, Manoeuvre]], speed: float, limits: Limits
) -> tuple[float, Track, Track, Track]:
    """Lay manoeuvres one after another.

    Parameters
    ----------
    manoeuvres : sequence of (str, Manoeuvre)
        Each with its name for messages.
    speed : float, m/s
        At time zero, along the path.
    limits : Limits

    Returns
    -------
    duration : float, s
    speed, turn_rate, climb : Track
        m/s, deg/s, deg; from time zero.

    Raises
    ------
    ConfigError
        There is none, or one cannot be done; the message says which, counted from 1.
    """
    if not 0.0 <= speed < math.inf:
        raise ConfigError("simulation.vehicle-cannot-begin", quantity="speed", speed=speed)
    if not manoeuvres:
        raise ConfigError("simulation.none", quantity="manoeuvres")
    course = Course(limits, [(0.0, speed)])
    for number, (name, manoeuvre) in enumerate(manoeuvres, start=1):
        try:
            manoeuvre.lay(course)
        except ConfigError as error:
            f = error.finding
            raise ConfigError(f, quantity=f"manoeuvre {number}, {name}, {f.quantity}") from None
    return course.time, _track(course.speed), _track(course.turn_rate), _track(course.climb)


def _track(points: list[tuple[float, float]]) -> Track:
    times, values = zip(*points, strict=True)
    return Track(times, values)


def check_length(value: float, name: str = "duration") -> None:
    """Refuse what is no length of a manoeuvre."""
    if not 0.0 < value < math.inf:
        raise ConfigError("simulation.not-above-zero", quantity=name, value=value)

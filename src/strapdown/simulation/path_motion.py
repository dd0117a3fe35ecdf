"""Motions along a path of given speed, climb and turn rate, with the attitude of the body."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Protocol

import numpy as np

from strapdown.constants import STANDARD_GRAVITY
from strapdown.ellipsoids import WGS84, Ellipsoid
from strapdown.errors import ConfigError
from strapdown.simulation.earth_motion import (
    EarthMotion,
    Kinematics,
    Origin,
    PlaceIntegral,
    integrate_velocity,
)
from strapdown.simulation.motion import (
    STILL,
    Track,
    check_numbers,
    euler_attitude,
    euler_body_rate,
)
from strapdown.tables.checks import Array

# At larger pitch, heading and roll axes nearly coincide and the angles lose their meaning.
MOST_PITCH = 80.0  # deg
# Limit on the panels of an integral, one per wave period: a few hundred megabytes.
_MOST_WAVES = 100_000


@dataclass(frozen=True)
class PathMotion(EarthMotion):
    """Motion from tracks of speed, climb and course; position is integrated to rounding.

    All other quantities are in closed form. Where the speed is zero the vehicle is stationary to
    the last bit.

    Attributes
    ----------
    duration : float, s
    origin : Origin
    heading_deg : float, deg
        At time zero.
    speed : Track, m/s
        Along the path.
    turn_rate : Track, deg/s
        Derivative of the course, positive to the right; its first time is zero.
    climb : Track, deg
        Climb angle of the path above the horizon.
    coordinated : bool
        Bank for a coordinated turn: ``tan roll = v cos(climb) turn_rate/g`` with standard gravity.
    sway_roll, sway_pitch : float, deg/(m/s²)
        Lean of a sprung body: outward roll per lateral acceleration, and nose-up pitch per
        longitudinal acceleration.
    roll_deg : float, deg
        Constant added to roll.
    attack_deg : float, deg
        Angle of attack: pitch minus climb angle.
    roll_waves, pitch_waves, heading_waves : tuple of Wave, deg
        Added to the angles.
    heave_waves : tuple of Wave, m
        Added to the position, downward.
    ellipsoid : Ellipsoid

    Raises
    ------
    ConfigError
        The duration is not positive, the pitch exceeds 80 deg, or a wave is too short for the
        duration.
    """

    duration: float
    origin: Origin
    heading_deg: float = 0.0
    speed: Track = STILL
    turn_rate: Track = STILL
    climb: Track = STILL
    coordinated: bool = False
    sway_roll: float = 0.0
    sway_pitch: float = 0.0
    roll_deg: float = 0.0
    attack_deg: float = 0.0
    roll_waves: tuple[Wave, ...] = ()
    pitch_waves: tuple[Wave, ...] = ()
    heading_waves: tuple[Wave, ...] = ()
    heave_waves: tuple[Wave, ...] = ()
    ellipsoid: Ellipsoid = WGS84

    def __post_init__(self) -> None:
        check_numbers(self, positive="duration")
        steepest = max(abs(x) for x in self.climb.values) + abs(self.attack_deg)
        steepest += sum(abs(w.amplitude) for w in self.pitch_waves)
        if not steepest <= MOST_PITCH:
            raise ConfigError(
                "simulation.pitch-goes-up",
                quantity="pitch",
                steepest=steepest,
                most_pitch=MOST_PITCH,
            )

        shortest = min([math.inf, *(w.period for w in self._waves)])
        if self.duration / shortest > _MOST_WAVES:
            raise ConfigError(
                "simulation.wave-comes-times",
                quantity="period",
                shortest=shortest,
                duration=self.duration / shortest,
                duration_2=self.duration / _MOST_WAVES,
            )

    @property
    def _waves(self) -> tuple[Wave, ...]:
        return (*self.roll_waves, *self.pitch_waves, *self.heading_waves, *self.heave_waves)

    @property
    def breaks(self) -> Sequence[float]:
        """Starts of the moves of all tracks, and instants dense enough to resolve every wave, s."""
        step = min([self.duration, *(w.period for w in self._waves)])
        inner = {*self.speed.times, *self.turn_rate.times, *self.climb.times}
        inner |= {step * k for k in range(math.ceil(self.duration / step))}
        return [0.0, *sorted(t for t in inner if 0.0 < t < self.duration), self.duration]

    def kinematics(self, time: Array) -> Kinematics:
        """State at given instants; as `EarthMotion.kinematics`."""
        path = self._path(time)
        # Lateral acceleration and its derivative.
        lateral = path.level * path.swing
        d_lateral = path.d_level * path.swing + path.level * path.d_swing
        roll, d_roll = self.roll_deg - self.sway_roll * lateral, -self.sway_roll * d_lateral
        if self.coordinated:
            part, d_part = lateral / STANDARD_GRAVITY, d_lateral / STANDARD_GRAVITY
            roll += np.degrees(np.arctan(part))
            d_roll += np.degrees(d_part / (1.0 + part * part))
        rolling, pitching = sum_waves(self.roll_waves, time), sum_waves(self.pitch_waves, time)
        yawing = sum_waves(self.heading_waves, time)
        angles = [
            roll + rolling[0],
            path.climb + self.attack_deg + self.sway_pitch * path.d_speed + pitching[0],
            path.course + yawing[0],
        ]
        rates = [
            d_roll + rolling[1],
            path.d_climb + self.sway_pitch * path.dd_speed + pitching[1],
            path.turn + yawing[1],
        ]
        turned, turning = np.column_stack(angles), np.column_stack(rates)
        return Kinematics(
            self._moved(time),
            path.velocity,
            path.acceleration,
            euler_attitude(turned, (1.0, 0.0, 0.0, 0.0)),
            euler_body_rate(turned, turning),
            turned,
        )

    def _path(self, time: Array) -> _Path:
        speed, d_speed, dd_speed = self.speed.evaluate(time)
        climb, d_climb, _ = self.climb.evaluate(time)
        turn, d_turn, _ = self.turn_rate.evaluate(time)
        course = self.heading_deg + integrate_track(self.turn_rate, time)
        _, heave, d_heave = sum_waves(self.heave_waves, time)
        slope, d_slope, swing = np.radians(climb), np.radians(d_climb), np.radians(turn)
        # Whole turns are removed in degrees, where this is exact.
        angle = np.radians(course - 360.0 * np.rint(course / 360.0))
        north, east, flat, steep = np.cos(angle), np.sin(angle), np.cos(slope), np.sin(slope)
        level, up = speed * flat, speed * steep
        d_level, d_up = d_speed * flat - up * d_slope, d_speed * steep + level * d_slope
        velocity = [level * north, level * east, heave - up]
        acceleration = [
            d_level * north - level * east * swing,
            d_level * east + level * north * swing,
            d_heave - d_up,
        ]
        return _Path(
            d_speed,
            dd_speed,
            climb,
            d_climb,
            turn,
            course,
            level,
            d_level,
            swing,
            np.radians(d_turn),
            np.column_stack(velocity),
            np.column_stack(acceleration),
        )

    @cached_property
    def _moved(self) -> PlaceIntegral:
        def velocity(time: Array) -> Array:
            return self._path(time).velocity

        return integrate_velocity(velocity, self.breaks, self.origin, self.ellipsoid)


@dataclass(frozen=True)
class _Path:
    """Values of the tracks: deg for climb, turn and course, rad/s for swing; level is a speed."""

    d_speed: Array
    dd_speed: Array
    climb: Array
    d_climb: Array
    turn: Array
    course: Array
    level: Array
    d_level: Array
    swing: Array
    d_swing: Array
    velocity: Array
    acceleration: Array


# A course as tracks of speed, turn rate and climb, built from a list of maneuvers.


@dataclass(frozen=True)
class Limits:
    """Performance limits of a vehicle.

    Attributes
    ----------
    acceleration : float, m/s²
        Longitudinal.
    lateral : float, m/s²
        Centripetal, in a turn.
    bank_deg : float, deg
    climb_deg : float, deg
        Largest climb or descent angle.
    """

    acceleration: float = 12.0
    lateral: float = 12.0
    bank_deg: float = 75.0
    climb_deg: float = 75.0


@dataclass
class Course:
    """Tracks extended by one maneuver after another.

    Attributes
    ----------
    time : float, s
        End of the tracks so far.
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
        """Hold a coordinate until `start`, then move it to a value with minimum jerk."""
        if start > points[-1][0]:
            points.append((start, points[-1][1]))
        if length > 0.0:
            points.append((start + length, to))

    @property
    def speed_now(self) -> float:
        """Speed at the end of the tracks, m/s."""
        return self.speed[-1][1]

    @property
    def climb_now(self) -> float:
        """Climb angle at the end of the tracks, deg."""
        return self.climb[-1][1]

    def moving_speed(self, code: str) -> float:
        """Speed at the end of the tracks; raises `code` if it is zero."""
        if self.speed_now <= 0.0:
            raise ConfigError(code, quantity="speed")
        return self.speed_now

    def level_speed(self, code: str) -> float:
        """Horizontal component of that speed, m/s."""
        return self.moving_speed(code) * math.cos(math.radians(self.climb_now))


class Manoeuvre(Protocol):
    """Interface of a maneuver."""

    def lay(self, course: Course) -> None:
        """Append it to a course."""
        ...


def lay_course(
    manoeuvres: Sequence[tuple[str, Manoeuvre]], speed: float, limits: Limits
) -> tuple[float, Track, Track, Track]:
    """Build tracks from a list of maneuvers.

    `manoeuvres`: each with its name for messages. `speed` (m/s): at time zero, along the path.
    Returns `duration` (s); `speed`, `turn_rate`, `climb`: m/s, deg/s, deg; from time zero.
    ConfigError: the list is empty, or a maneuver is infeasible; the message gives its number, from
    1.
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


@dataclass(frozen=True)
class Wave:
    """``amplitude sin(2 pi t/period + phase)``.

    Attributes
    ----------
    amplitude : float
        Unit of the coordinate.
    period : float, s
    phase_deg : float, deg

    Raises
    ------
    ConfigError
        A number is not finite, or the period is not positive.
    """

    amplitude: float
    period: float
    phase_deg: float = 0.0

    def __post_init__(self) -> None:
        check_numbers(self, positive="period", finite="amplitude phase_deg")


def sum_waves(waves: Sequence[Wave], time: Array) -> tuple[Array, Array, Array]:
    """Sum of waves and its first two time derivatives.

    `time` ((n,), s). Returns `value`, `first`, `second` ((n,)): zero without waves.
    """
    value, first, second = np.zeros(time.size), np.zeros(time.size), np.zeros(time.size)
    for wave in waves:
        omega = 2.0 * math.pi / wave.period
        # Whole periods are removed without rounding, so that late phases are as precise as early
        # ones.
        phase = 2.0 * math.pi * (np.fmod(time, wave.period) / wave.period)
        phase += math.radians(wave.phase_deg)
        high, level = wave.amplitude * np.sin(phase), wave.amplitude * np.cos(phase)
        value += high
        first += omega * level
        second -= omega * omega * high
    return value, first, second


def integrate_track(track: Track, time: Array) -> Array:
    """Integral of a track from its first time; (n,), unit of the track times s.

    `time` ((n,), s): not before the track's first time.

    The integral of the minimum-jerk quintic is ``5/2 x^4 - 3 x^5 + x^6``, one half over the whole.
    """
    times, values = np.asarray(track.times), np.asarray(track.values)
    if len(times) == 1:
        return np.asarray(values[0] * (time - times[0]))
    lengths, changes = np.diff(times), np.diff(values)
    before = np.r_[0.0, np.cumsum(lengths * (values[:-1] + 0.5 * changes))]
    k = np.searchsorted(times, time, side="right") - 1
    inner = np.clip(k, 0, len(lengths) - 1)
    since = time - times[inner]
    x = np.clip(since / lengths[inner], 0.0, 1.0)
    moved = x * x * x * x * (2.5 - x * (3.0 - x))
    within = values[inner] * since + changes[inner] * lengths[inner] * moved
    after = before[-1] + values[-1] * (time - times[-1])
    return np.asarray(np.where(k >= len(lengths), after, before[inner] + within))

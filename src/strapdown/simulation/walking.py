"""Foot-mounted pedestrian motion: stance phases at exact rest, and swing phases between them.

Each stride lifts the shoe heel first, carries it forward and sets it down heel first, with a blow.
All moves are minimum-jerk, so velocity, acceleration and rate are exact, and exactly zero in
stance. Simplifications: the unit stays in the plane of the stride, and the shoe does not roll over
its sole in stance.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from strapdown.ellipsoids import WGS84, Ellipsoid
from strapdown.errors import ConfigError
from strapdown.simulation.earth_motion import (
    EarthMotion,
    Kinematics,
    Origin,
    PlaceIntegral,
    integrate_velocity,
)
from strapdown.simulation.motion import Track, check_numbers, euler_attitude, euler_body_rate
from strapdown.simulation.path_motion import MOST_PITCH

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Gait:
    """Parameters of a gait; peaks of minimum-jerk moves are 15/8 of the mean rate.

    Attributes
    ----------
    stride : float, m
        Distance between successive stances of the same foot.
    swing, stance : float, s
    lift : float, m
        Height of the unit above the ground in the swing.
    heel_off_deg, toe_up_deg : float, deg
        Nose-down pitch at heel-off, and nose-up pitch before heel strike.
    strike : float, m
        Height from which the shoe falls onto its heel at the end of the swing.
    strike_time : float, s
        Duration of that fall, with an acceleration of about ``5.8 strike / strike_time²``.
    """

    stride: float
    swing: float
    stance: float
    lift: float
    heel_off_deg: float
    toe_up_deg: float
    strike: float
    strike_time: float

    def __post_init__(self) -> None:
        check_numbers(self, positive="swing stance strike_time")
        if not self.strike_time < 0.2 * self.swing:
            raise ConfigError("simulation.blow-lasts-more-than-fifth", quantity="strike_time")
        if not max(abs(self.heel_off_deg), abs(self.toe_up_deg)) < MOST_PITCH:
            raise ConfigError(
                "simulation.shoe-pitches-or-more", quantity="pitch", most_pitch=MOST_PITCH
            )


#: Peaks: walking 460 deg/s and 7 g, from the blow; running 970 deg/s and 11 g.
GAITS: dict[str, Gait] = {
    "walk": Gait(1.35, 0.55, 0.57, 0.08, 45.0, 22.0, 0.004, 0.020),
    "run": Gait(2.20, 0.45, 0.22, 0.20, 70.0, 25.0, 0.007, 0.020),
    "shuffle": Gait(0.50, 0.45, 0.75, 0.02, 15.0, 8.0, 0.001, 0.020),
}


@dataclass(frozen=True)
class Stride:
    """One stride.

    Attributes
    ----------
    gait : Gait
    turn_deg : float, deg
        Heading change of the foot in the swing, positive to the right; it moves in the new
        direction.
    climb : float, m
        Height gained on a stair.
    size : float
        Fraction of the gait's stride length; zero is a turn on the spot.
    """

    gait: Gait
    turn_deg: float = 0.0
    climb: float = 0.0
    size: float = 1.0


@dataclass(frozen=True)
class WalkingMotion(EarthMotion):
    """Successive strides, from stance to stance.

    Attributes
    ----------
    strides : tuple of Stride
    origin : Origin
    heading_deg : float, deg
    stand : float, s
        Stationary time at the start, and at the end.
    roll_deg, pitch_deg : float, deg
        Attitude of the unit with the shoe flat on the ground.
    ellipsoid : Ellipsoid

    Raises
    ------
    ConfigError
        No stride is given, or the unit would pitch by 80 deg or more.
    """

    strides: tuple[Stride, ...]
    origin: Origin
    heading_deg: float = 0.0
    stand: float = 5.0
    roll_deg: float = 0.0
    pitch_deg: float = 0.0
    ellipsoid: Ellipsoid = WGS84

    def __post_init__(self) -> None:
        if not self.strides or not 0.0 < self.stand < math.inf:
            raise ConfigError("simulation.walk-stride-stand", quantity="strides")
        steep = max(max(s.gait.heel_off_deg, s.gait.toe_up_deg) for s in self.strides)
        if not steep + abs(self.pitch_deg) < MOST_PITCH + 8.0:
            raise ConfigError(
                "simulation.unit-pitches", quantity="pitch_deg", steep=steep + abs(self.pitch_deg)
            )

    @property
    def duration(self) -> float:  # type: ignore[override]
        """Length in s."""
        return self.swings[-1][1] + self.stand

    @cached_property
    def swings(self) -> tuple[tuple[float, float], ...]:
        """Start and end of each swing, s; outside them the unit is stationary."""
        out, at = [], self.stand
        for stride in self.strides:
            out.append((at, at + stride.gait.swing))
            at += stride.gait.swing + stride.gait.stance
        return tuple(out)

    @property
    def breaks(self) -> Sequence[float]:
        """Starts and ends of the moves, s."""
        inner = {t for track in self._tracks for t in track.times if 0.0 < t < self.duration}
        return [0.0, *sorted(inner), self.duration]

    def stances(self, time: Array) -> NDArray[np.bool_]:
        """Whether the unit is stationary at instants (n,), s."""
        begins, ends = np.array(self.swings).T
        k = np.searchsorted(begins, time, side="left") - 1
        return np.asarray((k < 0) | (time >= ends[k]))

    @property
    def footfalls(self) -> Array:
        """Mid-times of the stances, (n + 1,), s."""
        begins, ends = np.array(self.swings).T
        middles: Array = 0.5 * (np.append(0.0, ends) + np.append(begins, self.duration))
        return middles

    def kinematics(self, time: Array) -> Kinematics:
        """State at given instants; as `EarthMotion.kinematics`."""
        parts = [track.evaluate(time) for track in self._tracks[4:]]
        still = np.zeros(len(time))
        angles = np.column_stack([still + self.roll_deg, parts[0][0], parts[1][0]])
        rates = np.column_stack([still, parts[0][1], parts[1][1]])
        moved = self._moving(time)
        return Kinematics(
            self._moved(time),
            moved[0],
            moved[1],
            euler_attitude(angles, (1.0, 0.0, 0.0, 0.0)),
            euler_body_rate(angles, rates),
            angles,
        )

    def _moving(self, time: Array) -> tuple[Array, Array]:
        """Velocity and acceleration."""
        north, east, down, lift = (track.evaluate(time) for track in self._tracks[:4])
        velocity, acceleration = (
            np.column_stack([north[k], east[k], down[k] + (0.0 + lift[k])]) for k in (1, 2)
        )
        return velocity, acceleration

    @cached_property
    def _moved(self) -> PlaceIntegral:
        return integrate_velocity(
            lambda time: self._moving(time)[0], self.breaks, self.origin, self.ellipsoid
        )

    @cached_property
    def _steps(self) -> list[tuple[float, float, float, float]]:
        """North, east, down, heading of each stance."""
        out = [(0.0, 0.0, 0.0, self.heading_deg)]
        for stride in self.strides:
            n, e, d, heading = out[-1]
            heading += stride.turn_deg
            way = stride.size * stride.gait.stride
            turned = math.radians(heading)
            out.append(
                (
                    n + way * math.cos(turned),
                    e + way * math.sin(turned),
                    d - stride.climb,
                    heading,
                )
            )
        return out

    @cached_property
    def _tracks(self) -> tuple[Track, ...]:
        """North, east, down, lift, pitch, heading."""
        times: list[float] = [0.0]
        places: list[tuple[float, float, float, float]] = [self._steps[0]]
        lifted: list[tuple[float, float]] = [(0.0, 0.0)]
        pitched: list[tuple[float, float]] = [(0.0, self.pitch_deg)]
        for (begin, end), stride, before, after in zip(
            self.swings, self.strides, self._steps[:-1], self._steps[1:], strict=True
        ):
            gait = stride.gait
            length, blow = end - begin, end - gait.strike_time
            times += [begin, blow]
            places += [before, after]
            lifted += [
                (begin, 0.0),
                (begin + 0.45 * length, -gait.lift),
                (blow, -gait.strike),
                (end, 0.0),
            ]
            pitched += [
                (begin, self.pitch_deg),
                (begin + 0.3 * length, self.pitch_deg - gait.heel_off_deg),
                (begin + 0.8 * length, self.pitch_deg + gait.toe_up_deg),
                (end, self.pitch_deg),
            ]
        north, east, down, heading = (
            Track(tuple(times), column) for column in zip(*places, strict=True)
        )
        lift = Track(*(tuple(column) for column in zip(*lifted, strict=True)))
        pitch = Track(*(tuple(column) for column in zip(*pitched, strict=True)))
        return north, east, down, lift, pitch, heading


def walk(
    gait: Gait,
    strides: int,
    *,
    corner_each: int = 10,
    corner_deg: float = 90.0,
    stairs: Sequence[int] = (),
    climb: float = 0.17,
) -> tuple[Stride, ...]:
    """Strides of a walk around blocks.

    Parameters
    ----------
    gait : Gait
    strides : int
    corner_each : int
        Number of strides between corners; zero for none. A corner takes two strides.
    corner_deg : float, deg
        Heading change at a corner, to the right.
    stairs : sequence of int
        Strides that climb two stairs, counted from zero, and advance 0.6 m.
    climb : float, m
        Height of a stair.
    """
    listed = []
    for k in range(strides):
        turn = corner_each > 0 and k >= corner_each and k % corner_each in (0, 1)
        up = k in stairs
        size = 0.6 / gait.stride if up else (0.6 if turn else 1.0)
        listed.append(
            Stride(gait, 0.5 * corner_deg if turn else 0.0, 2.0 * climb if up else 0.0, size)
        )
    return tuple(listed)

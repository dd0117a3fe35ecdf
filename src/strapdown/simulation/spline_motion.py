"""Motions through given places: a spline is the truth."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.ellipsoids import WGS84, Ellipsoid
from strapdown.errors import ConfigError
from strapdown.simulation.earth_motion import MOST_NORTHERN, EarthMotion, Kinematics, Origin
from strapdown.simulation.euler_motion import euler_attitude, euler_body_rate
from strapdown.simulation.path_attitude import along_velocity
from strapdown.simulation.path_motion import MOST_PITCH
from strapdown.simulation.quintic_spline import Spline, quintic
from strapdown.tables import EULER, check_trajectory, places_of

Array = NDArray[np.float64]

# Looks between two knots for what a spline does there.
_LOOKS = 16
# Part of the greatest horizontal speed under which a path has no direction.
_LEAST = 1e-3
# Cosine of the turn from one look to the next over which a path turns back.
_BEND = 0.5


@dataclass(frozen=True, eq=False)
class SplineMotion(EarthMotion):
    """Places at instants, joined by a quintic spline; attitudes likewise, or along the path.

    The spline is the truth: velocity, acceleration and rates are its derivatives, not those of
    what the places were taken from.

    Attributes
    ----------
    time : ndarray, (n,), s
        From zero, rising; two or more.
    place : ndarray, (n, 3)
        Latitude and longitude in deg, height in m.
    euler : ndarray, (n, 3), deg, optional
        Roll, pitch, heading, splined likewise, headings along the shorter way. Without it the nose
        points along the velocity and the roll is zero.
    ellipsoid : Ellipsoid
    most_acceleration : float, m/s²
        The spline may not take more than this.

    Raises
    ------
    ConfigError
        A number is not finite, time does not begin at zero or advance, a latitude is out of range
        or near a pole, a place is repeated, the pitch goes beyond 80 deg, the path stops or turns
        back where the nose is to follow it, or the acceleration is too large.
    """

    time: Array
    place: Array
    euler: Array | None = None
    ellipsoid: Ellipsoid = WGS84
    most_acceleration: float = math.inf

    def __post_init__(self) -> None:
        for name in ("time", "place", "euler"):
            value = getattr(self, name)
            if value is not None:
                copy = np.array(value, dtype=np.float64)
                copy.flags.writeable = False
                object.__setattr__(self, name, copy)
        _check_points(self.time, self.place)
        if self.euler is not None:
            _check_euler(self.euler, len(self.time))
        self._look()

    @classmethod
    def from_trajectory(
        cls, trajectory: pd.DataFrame, ellipsoid: Ellipsoid = WGS84
    ) -> SplineMotion:
        """Make a motion through the places and attitudes of a Trajectory table.

        Parameters
        ----------
        trajectory : DataFrame
            Its velocities are not used. Time is counted from its first row.
        ellipsoid : Ellipsoid

        Returns
        -------
        SplineMotion

        Raises
        ------
        DataError, ConfigError
            As `tables.check_trajectory`, and as the class.
        """
        check_trajectory(trajectory)
        stamps = np.asarray(trajectory.index, dtype=np.float64)
        return cls(
            stamps - stamps[0],
            places_of(trajectory),
            trajectory[EULER].to_numpy(dtype=np.float64),
            ellipsoid,
        )

    @property
    def duration(self) -> float:  # type: ignore[override]
        """Length in s."""
        return float(self.time[-1])

    @property
    def origin(self) -> Origin:  # type: ignore[override]
        """The first place."""
        lat, lon, alt = (float(x) for x in self.place[0])
        return Origin(lat, lon, alt)

    @property
    def breaks(self) -> Sequence[float]:
        """The knots, s."""
        return [float(t) for t in self._course.knots]

    def kinematics(self, time: Array) -> Kinematics:
        """State at instants; as `EarthMotion.kinematics`."""
        from strapdown._kernels.earth_motion import velocities

        moved, first, second = self._course(time)
        velocity, acceleration = np.empty(moved.shape), np.empty(moved.shape)
        parameters = self.ellipsoid.parameters()
        velocities(self.origin.place(moved), first, second, parameters, velocity, acceleration)
        if self._turn is None:
            angles, rates = along_velocity(velocity, acceleration)
        else:
            angles, rates, _ = self._turn(time)
        q_nb = euler_attitude(angles, (1.0, 0.0, 0.0, 0.0))
        turning = euler_body_rate(angles, rates)
        return Kinematics(moved, velocity, acceleration, q_nb, turning, angles)

    @cached_property
    def _course(self) -> Spline:
        moved = self.place - self.place[0]
        moved[:, 1] = _unwrapped(self.place[:, 1]) - self.place[0, 1]
        moved[:, :2] = np.radians(moved[:, :2])
        return quintic(self.time, moved)

    @cached_property
    def _turn(self) -> Spline | None:
        if self.euler is None:
            return None
        angles = self.euler.copy()
        for column in (0, 2):
            angles[:, column] = _unwrapped(angles[:, column])
        return quintic(self.time, angles)

    def _look(self) -> None:
        """See that what the spline does between the places can be followed."""
        from strapdown._kernels.earth_motion import velocities

        part = np.linspace(0.0, 1.0, _LOOKS, endpoint=False)
        looks = (self.time[:-1, None] + np.diff(self.time)[:, None] * part).ravel()
        looks = np.append(looks, self.time[-1])
        moved, first, second = self._course(looks)
        at = self.origin.place(moved)
        highest = float(np.degrees(np.abs(at[:, 0]).max()))
        if highest > MOST_NORTHERN:
            raise ConfigError(
                "simulation.path-comes-latitude",
                quantity="lat_deg",
                highest=highest,
                most_northern=MOST_NORTHERN,
            )
        velocity, acceleration = np.empty(moved.shape), np.empty(moved.shape)
        velocities(at, first, second, self.ellipsoid.parameters(), velocity, acceleration)
        size = np.linalg.norm(acceleration, axis=1)
        worst = int(np.argmax(size))
        if size[worst] > self.most_acceleration:
            raise ConfigError(
                "simulation.path-takes-more-than-allowed",
                quantity="acceleration",
                size=size[worst],
                looks=looks[worst],
                most_acceleration=self.most_acceleration,
            )
        level = np.hypot(velocity[:, 0], velocity[:, 1])
        if self.euler is None:
            along = np.sum(velocity[:-1, :2] * velocity[1:, :2], axis=1)
            lost = level <= _LEAST * level.max()
            lost[:-1] |= along < _BEND * level[:-1] * level[1:]
            if lost.any():
                raise ConfigError(
                    "simulation.path-stops-or-turns-back",
                    quantity="place",
                    looks=looks[np.argmax(lost)],
                )
        if self.euler is None:
            pitch = np.degrees(np.arctan2(np.abs(velocity[:, 2]), level))
            _check_pitch(pitch, looks)
        elif self._turn is not None:
            _check_pitch(np.abs(self._turn(looks)[0][:, 1]), looks)


def _check_points(time: Array, place: Array) -> None:
    if time.ndim != 1 or len(time) < 2 or place.shape != (len(time), 3):
        raise ConfigError(
            "simulation.times-shape-places-shape",
            quantity="place",
            shape=time.shape,
            shape_2=place.shape,
        )
    if not (np.isfinite(time).all() and np.isfinite(place).all()):
        raise ConfigError("simulation.time-or-coordinate-not-finite", quantity="place")
    falls = np.flatnonzero(np.diff(time) <= 0.0)
    if falls.size:
        k = int(falls[0])
        raise ConfigError(
            "simulation.does-not-come-after-2",
            quantity=f"place {k + 2}, time",
            time=time[k + 1],
            time_2=time[k],
        )
    if time[0] != 0.0:
        raise ConfigError("simulation.time", quantity="place 1, time", time=time[0])
    for k, (lat, lon, alt) in enumerate(place.tolist()):
        try:
            Origin(lat, lon, alt)
        except ConfigError as error:
            f = error.finding
            raise ConfigError(f, quantity=f"place {k + 1}, {f.quantity}") from None


def _check_euler(euler: Array, count: int) -> None:
    if euler.shape != (count, 3) or not np.isfinite(euler).all():
        raise ConfigError(
            "simulation.angles-shape-or-not-finite", quantity="euler", shape=euler.shape
        )


def _check_pitch(pitch: Array, time: Array) -> None:
    worst = int(np.argmax(pitch))
    if pitch[worst] > MOST_PITCH:
        raise ConfigError(
            "simulation.pitch-comes",
            quantity="pitch",
            pitch=pitch[worst],
            time=time[worst],
            most_pitch=MOST_PITCH,
        )


def _unwrapped(angles: Array) -> Array:
    """Angles in deg, each next to the one before it; what needs no turn is left to the last bit."""
    steps = np.diff(angles)
    turns = np.cumsum(np.rint(steps / 360.0))
    return np.asarray(np.r_[angles[:1], angles[1:] - 360.0 * turns])

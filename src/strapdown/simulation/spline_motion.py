"""Motions through waypoints: a quintic spline defines the truth."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from strapdown._kernels.earth import radii, velocities
from strapdown._kernels.piecewise import polynomials
from strapdown.constants import Triple
from strapdown.ellipsoids import WGS84, Ellipsoid
from strapdown.errors import ConfigError
from strapdown.simulation.earth_motion import (
    MOST_NORTHERN,
    EarthMotion,
    Kinematics,
    Origin,
    PlaceIntegral,
    integrate_velocity,
)
from strapdown.simulation.motion import check_numbers, euler_attitude, euler_body_rate
from strapdown.simulation.path_motion import MOST_PITCH
from strapdown.tables import EULER, check_trajectory, places_of
from strapdown.tables.checks import Array

# Checks of the spline between two knots.
_LOOKS = 16
# Fraction of the largest horizontal speed below which a path has no direction.
_LEAST = 1e-3
# Cosine of the turn between two checks below which the path counts as reversing.
_BEND = 0.5


@dataclass(frozen=True, eq=False)
class SplineMotion(EarthMotion):
    """Positions joined by a quintic spline, with attitudes splined likewise or along the path.

    The spline is the truth: velocity, acceleration and rates are its derivatives, which may differ
    from those of the source of the positions.

    Attributes
    ----------
    time : ndarray, (n,), s
        From zero, increasing; two or more.
    place : ndarray, (n, 3)
        Positions: latitude and longitude in deg, height in m.
    euler : ndarray, (n, 3), deg, optional
        Roll, pitch, heading, splined likewise, headings along the shorter way. Default: the nose
        points along the velocity and the roll is zero.
    ellipsoid : Ellipsoid
    most_acceleration : float, m/s²
        Largest acceleration allowed on the spline.

    Raises
    ------
    ConfigError
        A number is not finite, time does not start at zero or increase, a latitude is out of range
        or near a pole, a position is repeated, the pitch exceeds 80 deg, the path stops or reverses
        where the nose must follow it, or the acceleration is too large.
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
        """Make a motion through the positions and attitudes of a Trajectory table.

        `trajectory`: its velocities are not used. Time is counted from its first row.
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
        """The first position."""
        lat, lon, alt = (float(x) for x in self.place[0])
        return Origin(lat, lon, alt)

    @property
    def breaks(self) -> Sequence[float]:
        """The knots, s."""
        return [float(t) for t in self._course.knots]

    def kinematics(self, time: Array) -> Kinematics:
        """State at given instants; as `EarthMotion.kinematics`."""
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
        """Check that the spline between the positions is a feasible motion."""
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
    """Unwrap angles in deg; angles that need no turn are bit-identical."""
    steps = np.diff(angles)
    turns = np.cumsum(np.rint(steps / 360.0))
    return np.asarray(np.r_[angles[:1], angles[1:] - 360.0 * turns])


_DEGREE = 5  # continuous to the fourth derivative


@dataclass(frozen=True, eq=False)
class Spline:
    """Quintic spline of m coordinates: knots (p + 1,), coefficients (p, 6, m)."""

    knots: Array
    coefficients: Array

    def __call__(self, time: Array) -> tuple[Array, Array, Array]:
        """Value and first two derivatives, (n, m) each."""
        shape = (time.size, self.coefficients.shape[2])
        value, first, second = np.empty(shape), np.empty(shape), np.empty(shape)
        polynomials(self.knots, self.coefficients, time, value, first, second)
        return value, first, second


def quintic(time: ArrayLike, values: ArrayLike) -> Spline:
    """Quintic spline through values, with zero third and fourth derivatives at the ends.

    `time` ((n,), s): two or more, increasing. `values` ((n, m)). Returns with continuous fourth
    derivative: the curve through the values with the least mean square third derivative. Two values
    give a straight line.
    """
    from scipy.interpolate import make_interp_spline

    t, rows = np.asarray(time, dtype=np.float64), np.asarray(values, dtype=np.float64)
    zero = np.zeros(rows.shape[1])
    if len(t) == 2:
        slope = (rows[1] - rows[0]) / (t[1] - t[0])
        coefficients = np.zeros((1, _DEGREE + 1, rows.shape[1]))
        coefficients[0, -2], coefficients[0, -1] = slope, rows[0]
        return Spline(t, coefficients)
    ends = [(3, zero), (4, zero)]
    spline = make_interp_spline(t, rows, k=_DEGREE, bc_type=(ends, ends))  # type: ignore[arg-type]
    knots = np.unique(spline.t)
    # Taylor coefficients at the left end of each segment, highest power first.
    powers = [spline(knots[:-1], nu=k) / math.factorial(k) for k in range(_DEGREE, -1, -1)]
    return Spline(knots, np.ascontiguousarray(np.stack(powers, axis=1)))


def through_waypoints(
    places: Sequence[tuple[float, float, float]],
    *,
    times: Sequence[float] | None = None,
    speeds: Sequence[float] | None = None,
    most_acceleration: float = 30.0,
    ellipsoid: Ellipsoid = WGS84,
) -> SplineMotion:
    """Motion through waypoints without roll, nose along the path.

    Parameters
    ----------
    places : sequence of (lat_deg, lon_deg, alt)
        Waypoints in deg, deg, m; two or more.
    times : sequence of float, s
        From zero, one per waypoint.
    speeds : sequence of float, m/s
        Alternative to times: mean speed along the straight line from each waypoint to the next.
    most_acceleration : float, m/s²
        Largest acceleration allowed on the spline.

    Raises
    ------
    ConfigError
        Neither or both of times and speeds are given, their number does not match the waypoints or
        legs, a waypoint is repeated, or as `SplineMotion`.
    """
    rows = np.array(places, dtype=np.float64).reshape(-1, 3)
    if (times is None) == (speeds is None):
        raise ConfigError("simulation.neither-times-nor-speeds-or", quantity="places")
    same = np.flatnonzero(np.all(np.diff(rows, axis=0) == 0.0, axis=1))
    if same.size:
        k = int(same[0])
        raise ConfigError("simulation.before", quantity=f"place {k + 2}")
    stamps = _times(rows, speeds, ellipsoid) if speeds is not None else np.array(times, dtype=float)
    return SplineMotion(
        stamps,
        rows,
        None,
        ellipsoid,
        most_acceleration,
    )


def _times(places: Array, speeds: Sequence[float], ellipsoid: Ellipsoid) -> Array:
    if len(speeds) != len(places) - 1:
        raise ConfigError(
            "simulation.speeds-legs", quantity="speed", count=len(speeds), count_2=len(places) - 1
        )
    for k, speed in enumerate(speeds):
        if not 0.0 < speed < math.inf:
            raise ConfigError("simulation.speed-2", quantity=f"place {k + 2}, speed", speed=speed)

    times = [0.0]
    for (lat, lon, alt), (to_lat, to_lon, to_alt), speed in zip(
        places[:-1], places[1:], speeds, strict=True
    ):
        # The straight line on the ground at mid-leg; it only determines the times.
        middle = math.radians(0.5 * (lat + to_lat))
        meridian, transverse = radii(
            math.sin(middle), ellipsoid.semi_major_axis, ellipsoid.eccentricity_squared
        )
        height = 0.5 * (alt + to_alt)
        north = (meridian + height) * math.radians(to_lat - lat)
        across = math.remainder(to_lon - lon, 360.0)
        east = (transverse + height) * math.cos(middle) * math.radians(across)
        times.append(times[-1] + math.hypot(north, east, to_alt - alt) / speed)
    return np.array(times)


def along_velocity(velocity: Array, acceleration: Array) -> tuple[Array, Array]:
    """3-2-1 angles, and their rates, of a body without roll and with its nose along the velocity.

    `velocity` ((n, 3), m/s): north, east, down; the horizontal component must not be zero.
    `acceleration` ((n, 3), m/s²): derivatives of the velocity components. Returns `angles`, `rates`
    ((n, 3), deg and deg/s): roll, pitch (positive in a climb), heading within ±180.
    """
    north, east, down = velocity.T
    d_north, d_east, d_down = acceleration.T
    level2 = north * north + east * east
    level = np.sqrt(level2)
    d_level = (north * d_north + east * d_east) / level
    still = np.zeros(len(velocity))
    angles = [still, np.arctan2(-down, level), np.arctan2(east, north)]
    rates = [
        still,
        (down * d_level - d_down * level) / (level2 + down * down),
        (north * d_east - east * d_north) / level2,
    ]
    return np.degrees(angles).T, np.degrees(rates).T


# Shortest period as a fraction of the duration: limits the integral to a few hundred megabytes.
_LEAST_PERIOD = 1e-5


@dataclass(frozen=True)
class SineVelocityMotion(EarthMotion):
    """``v = mean + amplitude sin(2 pi t/period + phase)``, without roll, nose along the velocity.

    The motion of ``pyins.sim.generate_sine_velocity_motion``: velocity, attitude and their
    derivatives are in closed form; position is integrated to rounding. Pitch equals the climb angle
    of the path.

    Attributes
    ----------
    duration : float, s
    origin : Origin
    mean_velocity : tuple of float, m/s
        North, east, down.
    amplitude : tuple of float, m/s
    period : float, s
    phase_deg : tuple of float, deg
        The default gives an ellipse of latitude and longitude where the mean is zero.
    ellipsoid : Ellipsoid

    Raises
    ------
    ConfigError
        The duration is not positive, the period is below 1e-5 of the duration, or the vehicle
        stops, where its path has no direction.
    """

    duration: float
    origin: Origin
    mean_velocity: Triple
    amplitude: Triple = (0.0, 0.0, 0.0)
    period: float = 60.0
    phase_deg: Triple = (0.0, 90.0, 0.0)
    ellipsoid: Ellipsoid = WGS84

    def __post_init__(self) -> None:
        check_numbers(self, positive="duration")
        least = self.duration * _LEAST_PERIOD
        if not least <= self.period < math.inf:
            raise ConfigError(
                "simulation.velocity-change-period",
                quantity="period",
                period=self.period,
                least=least,
                duration=self.duration,
            )
        cycle = np.linspace(0.0, min(self.period, self.duration), 4097)
        speed = np.hypot(*self._velocity(cycle)[:, :2].T)
        if speed.min() <= _LEAST * speed.max():
            raise ConfigError(
                "simulation.horizontal-speed-falls-path-no",
                quantity="mean_velocity, amplitude",
                speed=speed.min(),
            )

    @property
    def breaks(self) -> Sequence[float]:
        """Every half period, s."""
        count = max(1, math.ceil(2.0 * self.duration / self.period))
        return [*(0.5 * self.period * k for k in range(count)), self.duration]

    def kinematics(self, time: Array) -> Kinematics:
        """State at given instants; as `EarthMotion.kinematics`."""
        v = self._velocity(time)
        omega = 2.0 * math.pi / self.period
        dv = omega * np.asarray(self.amplitude) * np.cos(self._phase(time))
        turned, turning = along_velocity(v, dv)
        q_nb = euler_attitude(turned, (1.0, 0.0, 0.0, 0.0))
        return Kinematics(self._moved(time), v, dv, q_nb, euler_body_rate(turned, turning), turned)

    def _phase(self, time: Array) -> Array:
        # Whole periods are removed without rounding, so that late phases are as precise as early
        # ones.
        part = np.fmod(time, self.period) / self.period
        return np.asarray(2.0 * math.pi * part[:, None] + np.radians(self.phase_deg))

    def _velocity(self, time: Array) -> Array:
        return np.asarray(
            self.mean_velocity + np.asarray(self.amplitude) * np.sin(self._phase(time))
        )

    @cached_property
    def _moved(self) -> PlaceIntegral:
        return integrate_velocity(self._velocity, self.breaks, self.origin, self.ellipsoid)

"""Motion at points of a vehicle: lever arm, mounting angles, structural ringing."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from strapdown import earth, frames, rotation
from strapdown.constants import Triple
from strapdown.errors import ConfigError
from strapdown.sensors.crash_unit import Mounting
from strapdown.simulation.crash_motion import CrashMotion
from strapdown.simulation.earth_motion import EarthMotion
from strapdown.simulation.imu import mean_between
from strapdown.simulation.motion import check_numbers
from strapdown.tables import EULER, NED, VELOCITY, trajectory_table
from strapdown.tables.checks import Array


@dataclass(frozen=True)
class MountedMotion:
    """The motion of one mounted unit, as a `Motion`.

    Attributes
    ----------
    motion : EarthMotion
        Motion of the vehicle's origin; must provide angular acceleration, as `CrashMotion` does.
    mounting : Mounting
        True position and orientation of the sensors; the standard deviations are not used.
    ringing : tuple of Ringing
        Translational oscillations of the sensors about their rigid position.

    Notes
    -----
    Exact to rounding (`moving_point`): the lever arm is the rigid arm plus the
    ringing displacement, with all terms of the vehicle's rotation. Attitude and trajectory are
    those of the sensor axes, relative to local level at the sensors.
    """

    motion: EarthMotion
    mounting: Mounting = field(default_factory=Mounting)
    ringing: tuple[Ringing, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "ringing", tuple(self.ringing))

    @property
    def duration(self) -> float:
        """Length in s."""
        return self.motion.duration

    @property
    def cuts(self) -> Array:
        """Instants between which the sensed motion is smooth for quadratures of a few nodes, s.

        The edges of the pulses, and for each ringing its start and every quarter period.
        """
        edges = [np.asarray(self.motion.breaks, dtype=np.float64)]
        edges += [r.quarters() for r in self.ringing]
        return np.unique(np.concatenate(edges))

    def rate(self, time: ArrayLike) -> Array:
        """Rate relative to inertial space in sensor axes, (n, 3), rad/s."""
        return rotation.rotate(self._to_sensor, self.motion.rate(time))

    def angle(self, time: ArrayLike) -> Array:
        """Integral of the rate from time zero, (n, 3), rad."""
        return rotation.rotate(self._to_sensor, self.motion.angle(time))

    def angular_acceleration(self, time: ArrayLike) -> Array:
        """Derivative of the rate, in sensor axes, (n, 3), rad/s²."""
        return rotation.rotate(self._to_sensor, self.motion.angular_acceleration(time))

    def specific_force(self, time: ArrayLike) -> Array:
        """Specific force in sensor axes; (n, 3), m/s²."""
        t = _instants(time)
        force = self.motion.specific_force(t)
        if self.ringing or any(self.mounting.position):
            force = force + self._point(t).added_force
        return rotation.rotate(self._to_sensor, force)

    def attitude(self, time: ArrayLike) -> Array:
        """Attitude of the sensor axes, ``q_ns``, relative to local level at the sensors, (n, 4)."""
        point = self._point(_instants(time))
        return self._turned(point, self._places(point))

    def trajectory(self, time: ArrayLike, source: str | None = None) -> pd.DataFrame:
        """Position and velocity of the sensors, and attitude of their axes.

        Returns trajectory table; positions are accurate to 5e-9 m.
        """
        t = _instants(time)
        point = self._point(t)
        places = self._places(point)
        to_level = rotation.compose(level_change(point.origin, places), point.q_nv)
        return trajectory_table(
            t,
            places,
            rotation.rotate(to_level, point.velocity),
            rotation.euler_from_quaternion(self._turned(point, places)),
            source=source,
        )

    def kinematics_from(self, time: ArrayLike, *, epoch: float = 0.0) -> MountedKinematics:
        """Position, velocity and acceleration including ringing, as `point_kinematics`.

        `epoch` (s): instant at which the local-level axes are fixed at the vehicle's origin.
        Returns for the sensors; ``q_nv`` is that of the vehicle. ConfigError: the epoch is outside
        the motion.
        """
        return in_axes_of(self.motion, self._point(_instants(time)), epoch)

    @cached_property
    def _to_sensor(self) -> Array:
        return rotation.conjugate(rotation.quaternion_from_euler(self.mounting.angles_deg))

    def _point(self, time: Array) -> MovingPoint:
        arm = rigid_arm(self.mounting.position, time.size)
        for ringing in self.ringing:
            arm = (
                arm[0] + ringing.displacement(time),
                arm[1] + ringing.velocity(time),
                arm[2] + ringing.acceleration(time),
            )
        return moving_point(self.motion, arm, time)

    def _places(self, point: MovingPoint) -> Array:
        offset = rotation.rotate(point.q_nv, point.arm)
        return places_beside(self.motion, point.origin, offset)

    def _turned(self, point: MovingPoint, places: Array) -> Array:
        q_nv = rotation.compose(level_change(point.origin, places), point.q_nv)
        return rotation.compose(q_nv, rotation.conjugate(self._to_sensor))


def _instants(time: ArrayLike) -> Array:
    return np.ascontiguousarray(np.asarray(time, dtype=np.float64))


# Kinematics and specific force at points of a moving vehicle.


@dataclass(frozen=True)
class MountedKinematics:
    """A vehicle point at n instants, in fixed local-level axes.

    The axes are north, east, down at the vehicle's origin at the epoch, fixed to the Earth.

    Attributes
    ----------
    position : ndarray, (n, 3), m
        Relative to the vehicle's origin at the epoch.
    velocity : ndarray, (n, 3), m/s
        Relative to the Earth: the derivative of `position`.
    acceleration : ndarray, (n, 3), m/s²
        The derivative of `velocity`.
    q_nv : ndarray, (n, 4)
        Rotates vectors from vehicle axes into these axes.
    """

    position: Array
    velocity: Array
    acceleration: Array
    q_nv: Array


#: Lever arm from the vehicle's origin to a point, m, and its derivatives in m/s and m/s², of its
#: components in vehicle axes, (n, 3) each; zero for a point of the rigid vehicle.
Arm = tuple[Array, Array, Array]


@dataclass(frozen=True)
class MovingPoint:
    """Point at the end of a lever arm at n instants; vectors in vehicle axes, except `origin`.

    Attributes
    ----------
    origin : ndarray, (n, 3)
        Latitude and longitude in deg and height in m of the vehicle's origin.
    q_nv : ndarray, (n, 4)
        From vehicle axes to local level at the origin.
    arm : ndarray, (n, 3), m
    velocity, acceleration : ndarray, (n, 3), m/s and m/s²
        Velocity relative to the Earth, and its derivative in Earth axes.
    added_force : ndarray, (n, 3), m/s²
        Specific force at the point minus that at the origin.
    """

    origin: Array
    q_nv: Array
    arm: Array
    velocity: Array
    acceleration: Array
    added_force: Array


def moving_point(motion: EarthMotion, arm: Arm, time: Array) -> MovingPoint:
    """Kinematics of a point at the end of a lever arm.

    `motion`: motion of the vehicle's origin; must provide angular acceleration. `time` ((n,), s).

    With the arm r, the body rate w and its derivative relative to inertial space, and primes for
    derivatives of components in vehicle axes, the specific force increases by ``r'' + 2 w x r' + w'
    x r + w x (w x r) + G(O) - G(S)``, exactly. G is gravitation, gravity minus the centrifugal
    acceleration: ``G(O) - G(S) = g(O) - g(S) - w_ie x (w_ie x r)``. That difference is up to 3e-6
    m/s² per meter.
    """
    k = motion.kinematics(time)
    place = motion.origin.place(k.moved)
    place[:, :2] = np.degrees(place[:, :2])
    to_vehicle = rotation.conjugate(k.q_nb)
    r, d_r, _ = arm
    level_turn = earth.transport_rate(
        place[:, 0], place[:, 2], k.velocity, ellipsoid=motion.ellipsoid
    )
    spin = rotation.rotate(to_vehicle, earth.earth_rate(place[:, 0], ellipsoid=motion.ellipsoid))
    rate, swing = motion.rate(time), motion.angular_acceleration(time)
    relative = rate - spin
    # The Earth's rate is constant in inertial space, so in vehicle axes it rotates backward.
    relative_swing = swing + np.cross(rate, spin)
    fall = _gravity_change(motion, place, rotation.rotate(k.q_nb, r))
    whole = k.acceleration + np.cross(level_turn, k.velocity)
    return MovingPoint(
        place,
        k.q_nb,
        r,
        rotation.rotate(to_vehicle, k.velocity) + d_r + np.cross(relative, r),
        rotation.rotate(to_vehicle, whole) + _lever(arm, relative, relative_swing),
        _lever(arm, rate, swing) - rotation.rotate(to_vehicle, fall) - _turned_twice(spin, r),
    )


def point_kinematics(
    motion: EarthMotion, position: ArrayLike, time: ArrayLike, *, epoch: float = 0.0
) -> MountedKinematics:
    """Exact position, velocity and acceleration of a point of a rigid vehicle.

    The gravity-free velocity change between two instants is the difference of two rows of
    `velocity`.

    `motion`: motion of the vehicle's origin. `position` ((3,), m): position of the point in vehicle
    axes (forward, right, down), from the vehicle's origin. `time` ((n,), s). `epoch` (s): instant
    at which the local-level axes are fixed at the vehicle's origin. Returns positions accurate to
    5e-9 m, two conversions of Earth-centered coordinates; the rest to rounding. ConfigError: the
    position is not three finite numbers, the epoch is outside the motion, or as
    `EarthMotion.angular_acceleration`.
    """
    t = np.ascontiguousarray(np.asarray(time, dtype=np.float64))
    return in_axes_of(motion, moving_point(motion, rigid_arm(position, t.size), t), epoch)


def point_path(
    motion: EarthMotion, position: ArrayLike, time: ArrayLike, *, epoch: float = 0.0
) -> pd.DataFrame:
    """Exact path of a point of a rigid vehicle.

    `motion`, `position`, `time`, `epoch`: as `point_kinematics`. Returns index ``time``, s; columns
    ``north east down``, m, ``VN VE VD``, m/s, and ``roll pitch heading``, deg, of the vehicle, all
    in local-level axes at the vehicle's origin at the epoch. Local level 100 m away is rotated by
    16 µrad.
    """
    k = point_kinematics(motion, position, time, epoch=epoch)
    values = np.hstack([k.position, k.velocity, rotation.euler_from_quaternion(k.q_nv)])
    index = pd.Index(np.asarray(time, dtype=np.float64), name="time")
    return pd.DataFrame(values, index=index, columns=[*NED, *VELOCITY, *EULER])


def rigid_arm(position: ArrayLike, count: int) -> Arm:
    """Arm to a point of a rigid vehicle at `count` instants; as `point_kinematics`."""
    r = np.asarray(position, dtype=np.float64)
    if r.shape != (3,) or not np.isfinite(r).all():
        raise ConfigError(
            "simulation.not-three-finite-numbers-2", quantity="position", position=position
        )
    still = np.zeros((count, 3))
    return np.tile(r, (count, 1)), still, still


def in_axes_of(motion: EarthMotion, point: MovingPoint, epoch: float) -> MountedKinematics:
    """Transform a point from vehicle axes to local-level axes at the origin at an epoch."""
    if not 0.0 <= epoch <= motion.duration:
        raise ConfigError(
            "simulation.outside-motion", quantity="epoch", epoch=epoch, duration=motion.duration
        )
    start = _degrees(motion, np.array([epoch]))[0]
    level = rotation.compose(
        frames.q_ne(start[0], start[1]),
        rotation.conjugate(frames.q_ne(point.origin[:, 0], point.origin[:, 1])),
    )
    q_nv = rotation.compose(level, point.q_nv)
    base = frames.ned_from_geodetic(point.origin, start, ellipsoid=motion.ellipsoid)
    return MountedKinematics(
        base + rotation.rotate(q_nv, point.arm),
        rotation.rotate(q_nv, point.velocity),
        rotation.rotate(q_nv, point.acceleration),
        q_nv,
    )


def _degrees(motion: EarthMotion, time: Array) -> Array:
    place = motion.origin.place(motion.kinematics(time).moved)
    place[:, :2] = np.degrees(place[:, :2])
    return place


def places_beside(motion: EarthMotion, place: Array, offset: Array) -> Array:
    """Geodetic positions (deg, deg, m) at offsets north, east, down in m from others, (n, 3)."""
    to_earth = rotation.conjugate(frames.q_ne(place[:, 0], place[:, 1]))
    at = frames.ecef_from_geodetic(place, ellipsoid=motion.ellipsoid)
    return frames.geodetic_from_ecef(
        at + rotation.rotate(to_earth, offset), ellipsoid=motion.ellipsoid
    )


def level_change(here: Array, there: Array) -> Array:
    """Quaternion from local level at some positions to local level at others, (n, 4)."""
    return rotation.compose(
        frames.q_ne(there[:, 0], there[:, 1]),
        rotation.conjugate(frames.q_ne(here[:, 0], here[:, 1])),
    )


def _gravity_change(motion: EarthMotion, place: Array, offset: Array) -> Array:
    """Gravity at an offset minus gravity at a position, in local-level axes there."""
    beside = places_beside(motion, place, offset)
    here = earth.gravity(place[:, 0], place[:, 2], ellipsoid=motion.ellipsoid)
    there = earth.gravity(beside[:, 0], beside[:, 2], ellipsoid=motion.ellipsoid)
    return rotation.rotate(level_change(beside, place), there) - here


def _lever(arm: Arm, rate: Array, swing: Array) -> Array:
    r, d_r, dd_r = arm
    return dd_r + 2.0 * np.cross(rate, d_r) + np.cross(swing, r) + _turned_twice(rate, r)


def _turned_twice(rate: Array, r: Array) -> Array:
    return np.asarray(np.cross(rate, np.cross(rate, r)))


# (1 - e)^2 of the onset, expanded in powers.
_BINOMIAL = (1.0, -2.0, 1.0)
# exp(-25) is 1.4e-11.
_LEFT = 25.0


@dataclass(frozen=True)
class Ringing:
    """A damped oscillation of a mounting point about its position on the rigid vehicle.

    The displacement starts at rest, is bounded and decays, so that it leaves no permanent change:
    ``X (1 - exp(-w t))² exp(-t/decay) sin(w t)`` with ``w = 2 pi frequency``. The factor in
    parentheses starts displacement, velocity and acceleration at zero without a jump; after one
    period it is 0.996. A bare acceleration ``amplitude exp(-t/decay) sin(w t)`` would leave the
    unit with a permanent velocity of ``amplitude w/(w² + 1/decay²)``.

    Attributes
    ----------
    start : float, s
        On the motion's clock.
    amplitude : float, m/s²
        Acceleration amplitude: after the first period the envelope is ``amplitude exp(-t/decay)``,
        with ``amplitude = X (w² + 1/decay²)``. The maximum falls in the onset and is within 6 % of
        the amplitude for long ringing (``w decay`` above 20).
    frequency : float, Hz
        Frequency of the damped oscillation.
    decay : float, s
        Time in which the envelope falls to 1/e.
    direction : tuple of float
        Forward, right, down, in vehicle axes; any length.

    Raises
    ------
    ConfigError
        A number is not finite, frequency or decay is not positive, or the direction is zero.
    """

    start: float
    amplitude: float
    frequency: float
    decay: float
    direction: Triple = (1.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        direction = tuple(float(x) for x in self.direction)
        length = math.hypot(*direction)
        if len(direction) != 3 or not 0.0 < length < math.inf:
            raise ConfigError(
                "simulation.no-direction-2", quantity="direction", direction=self.direction
            )
        object.__setattr__(self, "direction", tuple(x / length for x in direction))
        check_numbers(self, positive="frequency decay", finite="start amplitude")

    def displacement(self, time: ArrayLike) -> Array:
        """Displacement from the rigid position, in vehicle axes, (n, 3), m."""
        return self._derivative(time, 0)

    def velocity(self, time: ArrayLike) -> Array:
        """Derivative of the displacement, in vehicle axes, (n, 3), m/s."""
        return self._derivative(time, 1)

    def acceleration(self, time: ArrayLike) -> Array:
        """Second derivative of the displacement, in vehicle axes, (n, 3), m/s²."""
        return self._derivative(time, 2)

    def quarters(self) -> Array:
        """Instants from the start in steps of a quarter period, until the envelope is 1e-11; s."""
        last = math.ceil(_LEFT * self.decay * 4.0 * self.frequency)
        return np.asarray(self.start + np.arange(last + 1) / (4.0 * self.frequency))

    def _derivative(self, time: ArrayLike, order: int) -> Array:
        """Sum of three damped oscillations, each an exponential with a complex rate."""
        t = np.maximum(np.asarray(time, dtype=np.float64) - self.start, 0.0)
        w = 2.0 * math.pi * self.frequency
        out = np.zeros(t.shape)
        for k, part in enumerate(_BINOMIAL):
            s = complex(-1.0 / self.decay - k * w, w)
            out += part * np.imag(s**order * np.exp(s * t))
        scale = self.amplitude / (w * w + 1.0 / (self.decay * self.decay))
        return np.outer(scale * out, self.direction)


# Panel length for 8-node quadrature: a haversine of 80 ms is a polynomial of its order there.
PANEL = 0.01  # s


@dataclass(frozen=True)
class ExactAnswers:
    """Truth of one vehicle point, with time counted from the impact.

    Attributes
    ----------
    motion : CrashMotion
        Motion of the vehicle's origin.
    impact : float, s
        On the motion's clock; zero of the common time.
    point : tuple of float, m
        Vehicle axes, from the vehicle's origin.
    """

    motion: CrashMotion
    impact: float
    point: Triple = (0.0, 0.0, 0.0)

    def along_body(self, start: float, end: float) -> Array:
        """Integral of the specific force minus its initial value, rotating axes, (3,), m/s.

        An error-free recorder would integrate this between the two instants. The initial value is
        the specific force at the start of the motion.
        """
        first, last = self.impact + start, self.impact + end
        edges = np.linspace(first, last, max(2, int(np.ceil((last - first) / PANEL)) + 1))
        means = mean_between(self._force, edges, self.motion.breaks)
        total = np.diff(edges) @ means
        rest = self._force(np.zeros(1))[0]
        return np.asarray(total - (last - first) * rest)

    def over_ground(self, start: float, end: float) -> Array:
        """Change of the velocity relative to the Earth, north, east, down, (3,), m/s."""
        velocity = self.course([start, end])[1]
        return np.asarray(velocity[1] - velocity[0])

    def course(self, time: ArrayLike) -> tuple[Array, Array]:
        """Position and velocity, (n, 3) each, m and m/s, in local-level axes at the impact.

        Positions are relative to the point's position at the impact.
        """
        at = self.impact + np.r_[0.0, np.asarray(time, dtype=np.float64)]
        found = point_kinematics(self.motion, self.point, at, epoch=self.impact)
        return found.position[1:] - found.position[0], found.velocity[1:]

    def _force(self, time: Array) -> Array:
        return MountedMotion(self.motion, Mounting(self.point)).specific_force(time)

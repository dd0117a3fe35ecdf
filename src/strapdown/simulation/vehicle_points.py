"""Kinematics and specific force at points of a moving vehicle."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from strapdown import earth, frames, rotation
from strapdown.errors import ConfigError
from strapdown.simulation.earth_motion import EarthMotion
from strapdown.tables import EULER, NED, VELOCITY

Array = NDArray[np.float64]


@dataclass(frozen=True)
class PointKinematics:
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


@dataclass(frozen=True)
class Arm:
    """Lever arm from the vehicle's origin to a point, in vehicle axes, (n, 3) each.

    Attributes
    ----------
    place : ndarray, m
    velocity, acceleration : ndarray, m/s and m/s²
        Time derivatives of its components; zero for a point of the rigid vehicle.
    """

    place: Array
    velocity: Array
    acceleration: Array


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
    r = arm.place
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
        rotation.rotate(to_vehicle, k.velocity) + arm.velocity + np.cross(relative, r),
        rotation.rotate(to_vehicle, whole) + _lever(arm, relative, relative_swing),
        _lever(arm, rate, swing) - rotation.rotate(to_vehicle, fall) - _turned_twice(spin, r),
    )


def point_kinematics(
    motion: EarthMotion, position: ArrayLike, time: ArrayLike, *, epoch: float = 0.0
) -> PointKinematics:
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
    return Arm(np.tile(r, (count, 1)), still, still)


def in_axes_of(motion: EarthMotion, point: MovingPoint, epoch: float) -> PointKinematics:
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
    return PointKinematics(
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
    coriolis = 2.0 * np.cross(rate, arm.velocity)
    return arm.acceleration + coriolis + np.cross(swing, arm.place) + _turned_twice(rate, arm.place)


def _turned_twice(rate: Array, r: Array) -> Array:
    return np.asarray(np.cross(rate, np.cross(rate, r)))

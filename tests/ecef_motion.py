"""Motions that are given in the Earth's axes, so that a pole is a place as any other."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from exact_increments import exact_increments
from strapdown import earth, frames, rotation
from strapdown.ellipsoids import WGS84, Ellipsoid
from strapdown.nav_state import NavState


def about_axis(angle):
    """Quaternions of turns about the Earth's axis, (n, 4)."""
    half = 0.5 * np.atleast_1d(angle)
    zero = np.zeros(half.size)
    return np.column_stack([np.cos(half), zero, zero, np.sin(half)])


@dataclass(frozen=True)
class OverThePole:
    """Along a circle over a pole, past it by a distance, with waves on height, side and attitude.

    Begins `speed * half` before the pole, in s; the axes of the motion are turned from those of
    the Earth by `lon_deg` about its axis, and for the south pole by half a turn about x.
    """

    speed: float = 250.0
    half: float = 200.0
    miss: float = 0.0
    alt: float = 9000.0
    wave: float = 5.0
    period: float = 25.0
    lon_deg: float = 30.0
    south: bool = False
    ellipsoid: Ellipsoid = WGS84

    def turned(self, vectors):
        out = np.asarray(rotation.rotate(about_axis(np.radians(self.lon_deg)), vectors))
        return out * [1.0, -1.0, -1.0] if self.south else out

    def course(self, time):
        """Position, velocity and acceleration in ECEF, (n, 3) each."""
        t = np.asarray(time, dtype=np.float64)
        radius = self.ellipsoid.semi_major_axis**2 / self.ellipsoid.semi_minor_axis + self.alt
        w, k = self.speed / radius, 2.0 * np.pi / self.period
        angle = w * (t - self.half)
        s, c = np.sin(angle), np.cos(angle)
        zero = np.zeros(t.size)
        wave = self.wave * np.column_stack([zero, np.sin(k * t), np.cos(k * t)])
        drift = self.wave * k * np.column_stack([zero, np.cos(k * t), -np.sin(k * t)])
        # At the middle the wave is at nought, so that a miss of nought goes through the pole.
        at_middle = self.wave * np.array([0.0, np.sin(k * self.half), 0.0])
        top = self.ellipsoid.semi_minor_axis + self.alt
        position = np.column_stack(
            [radius * s, zero + self.miss, zero + top - radius * (2.0 * np.sin(0.5 * angle) ** 2)]
        )
        velocity = self.speed * np.column_stack([c, zero, -s])
        acceleration = self.speed * w * np.column_stack([-s, zero, -c])
        return (
            self.turned(position + wave - at_middle),
            self.turned(velocity + drift),
            self.turned(acceleration - k * k * wave),
        )

    def earth_attitude(self, time):
        """Body to ECEF, (n, 4)."""
        t = np.asarray(time, dtype=np.float64)
        k = 2.0 * np.pi / self.period
        vector = np.column_stack(
            [0.3 * np.sin(0.7 * k * t), 2.0 + 0.2 * np.cos(k * t), 0.1 * np.sin(1.3 * k * t)]
        )
        return rotation.quaternion_from_rotation_vector(vector)

    def specific_force(self, time):
        """In body axes, (n, 3): ``C_be (a + 2 W x v - g)``, g normal gravity."""
        position, velocity, acceleration = self.course(time)
        place = frames.geodetic_from_ecef(position, ellipsoid=self.ellipsoid)
        down = earth.gravity(place[:, 0], place[:, 2], ellipsoid=self.ellipsoid)
        to_earth = rotation.conjugate(frames.q_ne(place[:, 0], place[:, 1]))
        turn = np.array([0.0, 0.0, self.ellipsoid.rotation_rate])
        force = acceleration + 2.0 * np.cross(turn, velocity) - rotation.rotate(to_earth, down)
        return rotation.rotate(rotation.conjugate(self.earth_attitude(time)), force)

    def inertial_attitude(self, time):
        turn = about_axis(self.ellipsoid.rotation_rate * np.asarray(time, dtype=np.float64))
        return rotation.compose(turn, self.earth_attitude(time))

    def increments(self, time):
        return exact_increments(self, time, attitude=type(self).inertial_attitude)

    def state(self, time):
        position, velocity, _ = (x[0] for x in self.course(np.array([time])))
        lat, lon, alt = frames.geodetic_from_ecef(position, ellipsoid=self.ellipsoid)
        level = frames.q_ne(lat, lon)
        return NavState(
            time=float(time),
            lat=np.radians(lat),
            lon=np.radians(lon),
            alt=alt,
            v_n=rotation.rotate(level, velocity),
            q_nb=rotation.compose(level, self.earth_attitude(np.array([time]))[0]),
        )


def in_earth_axes(rows, ellipsoid):
    """Position, velocity and attitude in ECEF of rows of a wander azimuth: no angle in between."""
    to_earth = rows[:, :4]
    up = rotation.rotate(to_earth, np.array([0.0, 0.0, 1.0]))
    e2 = ellipsoid.eccentricity_squared
    prime = ellipsoid.semi_major_axis / np.sqrt(1.0 - e2 * up[:, 2] ** 2)
    position = (prime + rows[:, 4])[:, None] * up
    position[:, 2] -= e2 * prime * up[:, 2]
    return (
        position,
        rotation.rotate(to_earth, rows[:, 5:8]),
        rotation.compose(to_earth, rows[:, 8:12]),
    )


def errors_in_earth_axes(run, motion):
    """Largest errors of a run in position, velocity (m, m/s) and attitude (rad), by state."""
    position, velocity, attitude = in_earth_axes(run.history, motion.ellipsoid)
    there, moving, _ = motion.course(run.time)
    turn = rotation.compose(attitude, rotation.conjugate(motion.earth_attitude(run.time)))
    return np.column_stack(
        [
            np.linalg.norm(position - there, axis=1),
            np.linalg.norm(velocity - moving, axis=1),
            np.linalg.norm(rotation.rotation_vector_from_quaternion(turn), axis=1),
        ]
    )

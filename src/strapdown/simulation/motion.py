"""Rotations with the attitude in closed form at every instant."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from strapdown import rotation
from strapdown.constants import STANDARD_GRAVITY

# Attitude, body rate and angular acceleration from 3-2-1 Euler angles.

Quaternion = tuple[float, float, float, float]


def euler_attitude(angles: Array, q_nb: Quaternion) -> Array:
    """Attitude of a body rotated by 3-2-1 angles from an initial attitude.

    `angles` ((n, 3), deg): roll, pitch, heading, relative to the initial attitude; any number of
    turns, and no singularity at pitch ±90 deg. `q_nb`: initial attitude, scalar first. Returns (n,
    4), ``q_nb Rz(heading) Ry(pitch) Rx(roll)``, continuous in sign. Whole turns reproduce the
    attitude to the last bit, except for that sign.
    """
    # 360 deg is not a binary fraction of pi, but whole turns can be removed without rounding.
    turns = np.rint(angles / 360.0)
    q = rotation.compose(
        np.asarray(q_nb, dtype=np.float64), rotation.quaternion_from_euler(angles - 360.0 * turns)
    )
    odd = turns.sum(axis=1) % 2.0 == 1.0
    return np.where(odd[:, None], -q, q)


def euler_body_rate(angles: Array, rates: Array) -> Array:
    """Body rate from the rates of the 3-2-1 angles.

    `angles` ((n, 3), deg): roll, pitch, heading. `rates` ((n, 3), deg/s): their derivatives.
    Returns (n, 3), rad/s, exactly zero where all three rates are zero.

    ``ω = [φ' - ψ' sin θ, θ' cos φ + ψ' sin φ cos θ, ψ' cos φ cos θ - θ' sin φ]``, the inverse of
    Alexiev (2021), Eqs. (8)-(10). Valid at every pitch.
    """
    roll, pitch = np.radians(angles[:, 0]), np.radians(angles[:, 1])
    d_roll, d_pitch, d_heading = np.radians(rates).T
    across = d_heading * np.cos(pitch)
    return np.column_stack(
        [
            d_roll - d_heading * np.sin(pitch),
            d_pitch * np.cos(roll) + across * np.sin(roll),
            across * np.cos(roll) - d_pitch * np.sin(roll),
        ]
    )


def euler_body_acceleration(angles: Array, rates: Array, accelerations: Array) -> Array:
    """Time derivative of the body rate from 3-2-1 angles and their derivatives.

    `angles` ((n, 3), deg): roll, pitch, heading. `rates`, `accelerations` ((n, 3), deg/s and
    deg/s²): their first and second derivatives. Returns (n, 3), rad/s², derivative of the
    components of `euler_body_rate` in body axes, at every pitch; exactly zero where all derivatives
    are zero.
    """
    roll, pitch = np.radians(angles[:, 0]), np.radians(angles[:, 1])
    d_roll, d_pitch, d_heading = np.radians(rates).T
    dd_roll, dd_pitch, dd_heading = np.radians(accelerations).T
    sin, cos, steep, flat = np.sin(roll), np.cos(roll), np.sin(pitch), np.cos(pitch)
    across = dd_heading * flat - d_heading * d_pitch * steep
    # The y and z axes roll within the plane that these two span.
    along_y, along_z = dd_pitch + d_roll * d_heading * flat, across - d_roll * d_pitch
    return np.column_stack(
        [
            dd_roll - dd_heading * steep - d_heading * d_pitch * flat,
            along_y * cos + along_z * sin,
            along_z * cos - along_y * sin,
        ]
    )


# Base of motions near the ground: a flat, non-rotating Earth.


class _Accelerated(Protocol):
    def attitude(self, time: ArrayLike) -> Array: ...

    def acceleration(self, time: ArrayLike) -> Array: ...


class FlatMotion:
    """Base of motions with position, velocity and acceleration in fixed north-east-down."""

    def specific_force(self: _Accelerated, time: ArrayLike) -> Array:
        """Specific force in body axes.

        Returns (n, 3), m/s², ``C_nb^T (a_n - g_n)`` with standard gravity straight down.
        """
        upward = self.acceleration(time) - np.array([0.0, 0.0, STANDARD_GRAVITY])
        return rotation.rotate(rotation.conjugate(self.attitude(time)), upward)


Array = NDArray[np.float64]


class Motion(Protocol):
    """Interface of a motion: the exact truth at any instant from 0 to `duration`.

    Each method takes instants, (n,) in s, and returns one row for each. The motion decides whether
    the Earth is flat and fixed (`flat_motion.FlatMotion`) or rotates (`earth_motion.EarthMotion`);
    sensors use only rate and specific force.
    """

    @property
    def duration(self) -> float:
        """Length in s."""
        ...

    def rate(self, time: ArrayLike) -> Array:
        """Body rate relative to inertial space, (n, 3), rad/s."""
        ...

    def angle(self, time: ArrayLike) -> Array:
        """Integral of the body rate from time zero, (n, 3), rad."""
        ...

    def attitude(self, time: ArrayLike) -> Array:
        """Attitude ``q_nb``, (n, 4)."""
        ...

    def specific_force(self, time: ArrayLike) -> Array:
        """Specific force in body axes, (n, 3), m/s²."""
        ...


@dataclass(frozen=True)
class Pulse:
    """A constant rate about one body axis over an interval.

    Attributes
    ----------
    axis : int
        0, 1, 2: forward, right, down.
    start, end : float, s
        The pulse acts on the half-open interval [start, end).
    rate : float, rad/s
    closed : bool
        Let a sample on `end` still read the rate. The motion is unchanged, but the samples then
        contain one pulse value too many: a test of the sampling error at an edge.
    """

    axis: int
    start: float
    end: float
    rate: float
    closed: bool = False


@dataclass(frozen=True)
class PulseMotion(FlatMotion):
    """Any number of pulses, overlapping or not, from an initial attitude.

    Between edges the rate vector is constant in body axes, so the attitude is an exact product of
    exponentials.

    Attributes
    ----------
    pulses : tuple of Pulse
    duration : float, s
    q_nb : tuple of float
        Attitude at time zero, scalar first.
    """

    pulses: tuple[Pulse, ...]
    duration: float
    q_nb: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)

    def rate(self, time: ArrayLike) -> Array:
        """Body rate at each instant; (n, 3), rad/s."""
        t = np.asarray(time, dtype=np.float64)
        out = np.zeros((t.size, 3))
        for p in self.pulses:
            acts = (t >= p.start) & ((t <= p.end) if p.closed else (t < p.end))
            out[acts, p.axis] += p.rate
        return out

    def angle(self, time: ArrayLike) -> Array:
        """Integral of the body rate from time zero; (n, 3), rad."""
        t = np.asarray(time, dtype=np.float64)
        out = np.zeros((t.size, 3))
        for p in self.pulses:
            out[:, p.axis] += p.rate * np.clip(t - p.start, 0.0, p.end - p.start)
        return out

    def attitude(self, time: ArrayLike) -> Array:
        """Exact attitude.

        Parameters
        ----------
        time : array_like, (n,), s
            Not negative.

        Returns
        -------
        ndarray, (n, 4)
            ``q_nb``, exact to the rounding of one product per edge passed.
        """
        t = np.asarray(time, dtype=np.float64)
        edges = np.unique([0.0, *(e for p in self.pulses for e in (p.start, p.end))])
        # Evaluated at mid-interval, away from the edges.
        middle = np.append(0.5 * (edges[:-1] + edges[1:]), edges[-1] + 1.0)
        rates = PulseMotion(tuple(_half_open(p) for p in self.pulses), 0.0).rate(middle)
        at_edge = [np.asarray(self.q_nb, dtype=np.float64)]
        for k, length in enumerate(np.diff(edges)):
            turn = rotation.quaternion_from_rotation_vector(rates[k] * length)
            at_edge.append(rotation.compose(at_edge[-1], turn))
        last = np.searchsorted(edges, t, side="right") - 1
        since = rates[last] * (t - edges[last])[:, None]
        return rotation.compose(
            np.array(at_edge)[last], rotation.quaternion_from_rotation_vector(since)
        )

    def acceleration(self, time: ArrayLike) -> Array:
        """Zero, (n, 3), m/s²: the body rotates about the sensor."""
        return np.zeros((np.size(time), 3))

    def velocity(self, time: ArrayLike) -> Array:
        """Zero, (n, 3), m/s."""
        return np.zeros((np.size(time), 3))

    def position(self, time: ArrayLike) -> Array:
        """Zero, (n, 3), m."""
        return np.zeros((np.size(time), 3))


def _half_open(pulse: Pulse) -> Pulse:
    return Pulse(pulse.axis, pulse.start, pulse.end, pulse.rate)

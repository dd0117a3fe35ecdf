"""A smooth motion that turns and pushes in every axis, with truth by an integrator of order 8."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

from strapdown import rotation
from strapdown.tables import DR, DV, PHI, imu_table

# Amplitudes, frequencies and phases of two sines an axis, for rate (rad/s) and force (m/s2).
RATE = np.array([[1.1, 1.7, 0.3], [-0.8, 2.3, 1.1], [0.9, 1.3, 2.0]])
RATE_TOO = np.array([[0.5, 3.1, 1.9], [0.6, 2.9, 0.2], [-0.7, 3.3, 0.7]])
FORCE = np.array([[4.0, 1.9, 0.9], [-3.0, 2.1, 0.4], [5.0, 1.5, 1.4]])
FORCE_TOO = np.array([[2.0, 3.4, 0.1], [1.5, 2.7, 2.2], [-2.5, 3.0, 1.0]])
STEADY = np.array([0.2, -0.1, 0.3, 0.5, 0.4, -9.8])


def _waves(time, derivative):
    t = np.asarray(time, dtype=np.float64)[:, None]
    out = []
    for waves in ((RATE, RATE_TOO), (FORCE, FORCE_TOO)):
        total = 0.0
        for a, w, p in (wave.T for wave in waves):
            total = total + (a * np.sin(w * t + p) if derivative else -a / w * np.cos(w * t + p))
        out.append(total)
    return np.hstack(out)


def values(time):
    """Rate and force, (n, 6)."""
    return _waves(time, True) + STEADY


def integrals(time):
    """Their integrals, (n, 6), up to a constant."""
    return _waves(time, False) + STEADY * np.asarray(time)[:, None]


@dataclass(frozen=True)
class State:
    """Rotation from the body to its start, velocity and position there."""

    q: np.ndarray
    velocity: np.ndarray
    position: np.ndarray


def truth(start, end):
    """State at the end of a stretch that begins at rest, good to about 1e-12."""

    def slope(t, y):
        x, y_, z, *force = values([t])[0]
        c = y[:9].reshape(3, 3)
        skew = np.array([[0.0, -z, y_], [z, 0.0, -x], [-y_, x, 0.0]])
        return np.concatenate([(c @ skew).ravel(), c @ force, y[9:12]])

    begin = np.concatenate([np.eye(3).ravel(), np.zeros(6)])
    run = solve_ivp(slope, (start, end), begin, method="DOP853", rtol=2.3e-14, atol=1e-14)
    y = run.y[:, -1]
    return State(rotation.quaternion_from_dcm(y[:9].reshape(3, 3)), y[9:12], y[12:])


def imu_at(time, sampling, table=values, sums=integrals):
    """An Imu table of exact samples or means at these stamps; the first mean is over one step."""
    time = np.asarray(time, dtype=np.float64)
    if sampling == "instantaneous":
        rows = table(time)
    else:
        edges = np.concatenate([[2.0 * time[0] - time[1]], time])
        rows = np.diff(sums(edges), axis=0) / np.diff(edges)[:, None]
    return imu_table(time, rows[:, :3], rows[:, 3:], sampling=sampling)


def compose(increments):
    """Where the rows of a MotionIncrements table lead, one after the other."""
    q, v, r = np.array([1.0, 0.0, 0.0, 0.0]), np.zeros(3), np.zeros(3)
    for dt, phi, dv, dr in zip(
        increments["dt"],
        increments[PHI].to_numpy(),
        increments[DV].to_numpy(),
        increments[DR].to_numpy(),
        strict=True,
    ):
        r = r + v * dt + rotation.rotate(q, dr)
        v = v + rotation.rotate(q, dv)
        q = rotation.compose(q, rotation.quaternion_from_rotation_vector(phi))
    return State(q, v, r)


def distance(one, other):
    """Angle in rad, and lengths in m/s and m, between two states."""
    angle = np.radians(rotation.rotation_angle(one.q, other.q))
    return np.array(
        [
            float(angle),
            np.linalg.norm(one.velocity - other.velocity),
            np.linalg.norm(one.position - other.position),
        ]
    )

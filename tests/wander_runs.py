"""Runs of a wander azimuth over made-up motions, and how far one row of it is from another."""

from __future__ import annotations

import numpy as np

from strapdown import rotation
from strapdown.ellipsoids import find_ellipsoid
from strapdown.estimation.error_model import Segment
from strapdown.nav_state import NavState


def dcm(q):
    return rotation.dcm_from_quaternion(q)


def rocking(t):
    return 0.3 * np.array([np.sin(t), np.cos(0.7 * t), 0.5 * np.sin(1.3 * t + 1.0)])


def weaving(t):
    return np.array([2.0 * np.sin(0.4 * t), 1.5 * np.cos(0.3 * t), 0.0])


def still(t):
    return np.zeros(3)


def made_up(q_wb, duration, dt, rate=rocking, acceleration=weaving, gravity=9.8):
    """Rows of increments of rates and forces that are constant over each step, (n, 10).

    The force holds the body up, more or less: no truth is needed, only some motion.
    """
    rows = np.zeros((round(duration / dt), 10))
    q = q_wb
    for i, row in enumerate(rows):
        t = (i + 0.5) * dt
        phi = rate(t) * dt
        turn = rotation.quaternion_from_rotation_vector(phi)
        half = rotation.quaternion_from_rotation_vector(0.5 * phi)
        lift = acceleration(t) + np.array([0.0, 0.0, gravity])
        dv = dcm(half) @ dcm(rotation.compose(q, half)).T @ lift * dt
        row[:] = [dt, *phi, *dv, *(0.5 * dt * dv)]
        q = rotation.compose(q, turn)
    return rows


def start(lat=52.0, alt=200.0, v_n=(60.0, -150.0, 0.0)):
    return NavState.from_degrees(
        lat, 30.0, alt, v_n=list(v_n), roll_deg=5.0, pitch_deg=-3.0, heading_deg=40.0
    )


def history_of(mechanization, state, rows):
    """Row of the start and of every step."""
    out = np.empty((len(rows) + 1, mechanization.row))
    out[0] = mechanization.history_row(state)
    earth = find_ellipsoid(mechanization.ellipsoid).parameters()
    _, why = mechanization.advance_rows(state.copy(), rows, np.empty(0), earth, out[1:])
    assert not why
    return out


def segment_of(mechanization, history, rows, since=7000.0):
    time = since + np.concatenate([[0.0], np.cumsum(rows[:, 0])])
    return Segment(mechanization, time, history, rows)


def point(row, ellipsoid):
    """ECEF of a row, regular at the poles: ``(N + h) n - e² N s p``."""
    n = dcm(row[:4]) @ [0.0, 0.0, 1.0]
    e2 = ellipsoid.eccentricity_squared
    prime = ellipsoid.semi_major_axis / np.sqrt(1.0 - e2 * n[2] ** 2)
    return (prime + row[4]) * n - [0.0, 0.0, e2 * prime * n[2]]


def physical_error(row, true, ellipsoid):
    """Errors of `state_error`, in level axes of the row, from rows of histories."""
    to_level = dcm(row[:4]).T
    between = rotation.compose(
        rotation.compose(row[:4], row[8:12]),
        rotation.conjugate(rotation.compose(true[:4], true[8:12])),
    )
    return np.concatenate(
        [
            to_level @ (point(row, ellipsoid) - point(true, ellipsoid)),
            row[5:8] - to_level @ dcm(true[:4]) @ true[5:8],
            to_level @ rotation.rotation_vector_from_quaternion(between),
        ]
    )

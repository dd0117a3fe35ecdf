"""Motion increments of a motion on the Earth, exact to rounding, and how far a result is off."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd

from strapdown import rotation
from strapdown.evaluation.trajectory_differences import trajectory_differences
from strapdown.nav_state import NavState
from strapdown.tables import TRAJECTORY_ERROR, motion_increments_table


def inertial_attitude(motion, time):
    """Body to axes that do not turn, and are those of the Earth at time zero; (n, 4)."""
    k = motion.kinematics(np.ascontiguousarray(time))
    lat, lon, _ = motion.origin.place(k.moved).T
    about_axis = 0.5 * (lon + motion.ellipsoid.rotation_rate * np.asarray(time))
    tilt = -0.5 * (0.5 * np.pi + lat)
    zero = np.zeros(len(lat))
    turned = np.column_stack([np.cos(about_axis), zero, zero, np.sin(about_axis)])
    level = np.column_stack([np.cos(tilt), zero, np.sin(tilt), zero])
    return rotation.compose(rotation.compose(turned, level), k.q_nb)


def exact_increments(motion, time, nodes=20, attitude=inertial_attitude):
    """MotionIncrements table between the instants `time`; `attitude` gives that of a motion.

    The turn is that of the exact attitudes; velocity and distance are ``int C f dt`` and
    ``int (end - t) C f dt``, by Gauss and Legendre, which is exact here: what is integrated
    changes little within a step, and the error falls as the power 2 * nodes of that.
    """
    time = np.asarray(time, dtype=np.float64)
    dt = np.diff(time)
    at_stamps = attitude(motion, time)
    back = rotation.conjugate(at_stamps[:-1])
    phi = rotation.rotation_vector_from_quaternion(rotation.compose(back, at_stamps[1:]))
    dv, dr = np.zeros((2, len(dt), 3))
    for x, w in zip(*np.polynomial.legendre.leggauss(nodes), strict=True):
        at = time[:-1] + 0.5 * (1.0 + x) * dt
        turn = rotation.compose(back, attitude(motion, at))
        force = rotation.rotate(turn, motion.specific_force(at))
        dv += (0.5 * w * dt)[:, None] * force
        dr += (0.5 * w * dt * (time[1:] - at))[:, None] * force
    return motion_increments_table(time[1:], dt, phi, dv, dr)


def start_of(motion):
    """State of a motion at time zero."""
    return NavState.from_trajectory(motion.trajectory(np.zeros(1)))


def errors(run, motion) -> pd.DataFrame:
    """Estimate minus truth at every state of a run: m, m/s, deg."""
    truth = motion.trajectory(run.time)
    return trajectory_differences(run.trajectory, truth, motion.ellipsoid)[TRAJECTORY_ERROR]


def rounding(steps, duration):
    """What rounding alone may leave of a run, if it is always to the same side.

    Attitude and place are rounded to half a unit in the last place of a number under one,
    1.1e-16: the place by as much of the Earth's radius, 6.4e6 m, the tilt so, which gravity turns
    into velocity with sqrt(R/g) = 806 s; heading is made of four such numbers. The vertical
    channel multiplies what it gets: thirty roundings of a gravity of 9.8, 1.1e-16 of it each, in
    gravity and in the force that meets it, by (cosh kT - 1)/k² with k² = 2g/R.
    """
    turn = steps * 1.1e-16
    k = math.sqrt(2.0 * 9.8 / 6.378e6)
    rise = 30.0 * 1.1e-16 * 9.8 * (math.cosh(k * duration) - 1.0) / k**2
    # The height itself, up to 30 km, is rounded to 1.8e-12 m at most in every step.
    rise += steps * 1.8e-12 * math.cosh(k * duration)
    place, velocity = turn * 6.4e6, turn * 9.8 * 806.0
    tilt, heading = math.degrees(turn), math.degrees(4.0 * turn)
    bounds = [place, place, rise, velocity, velocity, rise * k, tilt, tilt, heading]
    return pd.Series(bounds, TRAJECTORY_ERROR)

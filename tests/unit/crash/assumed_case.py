"""A vehicle that turns and slides a little in an impact, and units that do not measure all of it.

Its motion is integrated here in steps of 0.25 ms, for many vehicles at once, from rates and
accelerations along its own axes, by the turn in the middle of each step: nothing of the package
but rotations.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

from strapdown import rotation
from strapdown.crash.entry import Entry
from strapdown.crash.measuring_point import at_point
from strapdown.crash.path import reconstruct_path
from strapdown.crash.preparation import Preparation, prepare_unit
from strapdown.sensors.crash_unit import (
    Assumed,
    CrashUnit,
    RecordedTriad,
    assumed_shapes,
    turning_shapes,
)
from strapdown.sensors.uncertainty import TriadUncertainty

G = 9.80665
SPEED, CHANGE, OVER = 15.0, 16.0, (0.0, 0.15)
BEGIN, END, FINE, RATE = -0.05, 0.3, 4000, 200
PULSE = 0.1
# Of a sensor that is all but perfect: what is assumed is the whole uncertainty.
PERFECT = TriadUncertainty()
LEVEL = (0.0, 0.0, 1e-6)


@dataclass(frozen=True)
class Truth:
    """Means over the steps of 1/RATE: stamps at their ends; and the motion at the stamps."""

    time: np.ndarray
    force: np.ndarray
    place: np.ndarray
    velocity: np.ndarray
    angles: np.ndarray
    gained: np.ndarray


def move(rates, sideways):
    """Move vehicles.

    Parameters
    ----------
    rates : function of (m,) -> (k, m, 3)
        rad/s, vehicle axes.
    sideways : function of (m,) -> (k, m)
        Acceleration along the vehicle's right, m/s².
    """
    m = round((END - BEGIN) * FINE)
    middle = BEGIN + (np.arange(m) + 0.5) / FINE
    ahead = -pushed(middle)
    turning, right = rates(middle), sideways(middle)
    count = len(right)
    own = np.zeros((count, m, 3))
    own[..., 0], own[..., 1] = ahead, right
    half = rotation.quaternion_from_rotation_vector(0.5 * turning / FINE)
    q = np.tile([1.0, 0.0, 0.0, 0.0], (count, 1))
    velocity, place = np.tile([SPEED, 0.0, 0.0], (count, 1)), np.zeros((count, 3))
    place[:, 0] = SPEED * BEGIN
    force, path = np.empty((count, m, 3)), np.empty((count, m, 3))
    speeds, attitudes = np.empty((count, m, 3)), np.empty((count, m, 4))
    up = np.array([0.0, 0.0, -G])
    for j in range(m):
        q = rotation.compose(q, half[:, j])
        force[:, j] = own[:, j] + rotation.rotate(rotation.conjugate(q), up)
        step = rotation.rotate(q, own[:, j]) / FINE
        place = place + (velocity + 0.5 * step) / FINE
        velocity = velocity + step
        q = rotation.compose(q, half[:, j])
        path[:, j], speeds[:, j], attitudes[:, j] = place, velocity, q
    each = FINE // RATE
    means = force.reshape(count, -1, each, 3).mean(axis=2)
    last = slice(each - 1, None, each)
    time = BEGIN + np.arange(1, means.shape[1] + 1) / RATE
    zero = int(np.searchsorted(time, -1e-9))
    path = path[:, last] - path[:, last][:, zero : zero + 1]
    gained = np.cumsum(own, axis=1)[:, last] / FINE
    angles = np.array([rotation.euler_from_quaternion(q) for q in attitudes[:, last]])
    return Truth(time, means, path, speeds[:, last], angles, gained)


def pushed(time):
    """Size of the acceleration of the pulse of `move`, (m,), m/s²."""
    return CHANGE * 2.0 * np.sin(np.pi * np.clip(time / PULSE, 0.0, 1.0)) ** 2 / PULSE


def unit_of(truth, k, axes, assumed, name="EDR", uncertainty=PERFECT):
    """A unit with accelerometers along some axes and no gyro, on vehicle number `k`."""
    columns = ["accel_" + a for a in axes]
    index = pd.Index(truth.time, name="time")
    table = pd.DataFrame(truth.force[k][:, ["xyz".index(a) for a in axes]], index, columns)
    table.attrs = {"sampling": "mean"}
    triad = RecordedTriad(table, uncertainty, "accelerometers")
    return CrashUnit(name, (triad,), trigger=0.0, assumed=assumed)


def path_of(unit):
    """Its path, and what it says at the point."""
    at = at_point(prepare_unit(unit, Preparation(levelling=LEVEL)), (0.0, 0.0, 0.0))
    entry = Entry(time=0.0, velocity=(SPEED, 0.0, 0.0), heading_deg=0.0)
    path = reconstruct_path(at.imu, at.effects, at.levelling, None, entry, window=(-0.02, END))
    return at, path


TURN_SD = (4.0, 4.0, 4.0)
ASSUMED = Assumed(turn_sd_deg=TURN_SD, delta_v_sd=0.8, over=OVER)


def drawn_motion(count, seed, *, turn=TURN_SD, slide=0.8, spun=False):
    """Vehicles whose turning and sideways velocity are drawn from what is assumed.

    With `spun`, each turns as an eccentric impact makes it: at a rate that grows with the velocity
    that is lost, and stays to the end of `OVER`; the turn by then is as assumed.
    """
    rng = np.random.default_rng(seed)
    turns = np.radians(turn)[:, None] * rng.normal(size=(count, 3, 2))
    slides = slide * rng.normal(size=(count, 2))

    def shapes(time):
        return assumed_shapes(time, OVER, "instantaneous")

    def spinning(time):
        u = np.clip((time - OVER[0]) / PULSE, 0.0, 1.0)
        lost = (u - np.sin(2.0 * np.pi * u) / (2.0 * np.pi)) * (time < OVER[1])
        # Half of the pulse, and what follows it.
        return lost / (OVER[1] - OVER[0] - 0.5 * PULSE)

    def rates(time):
        if spun:
            return turns[:, None, :, 0] * spinning(time)[:, None]
        profiles = turning_shapes(time, OVER, "instantaneous", pushed(time))
        return np.einsum("kas,sm->kma", turns, profiles)

    return move(rates, lambda time: slides @ shapes(time))

"""What is felt, integrated by another integrator in another frame, comes to the trajectory."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pymap3d
import pytest
from scipy.integrate import solve_ivp

from strapdown import rotation
from strapdown._kernels import earth
from strapdown.simulation import Origin, SineVelocityMotion, car, through_waypoints
from strapdown.simulation.vehicles import Accelerate, LaneChange, Turn

PLACE = Origin(55.75, 37.62, 150.0)
MOTIONS = {
    "sine": SineVelocityMotion(12.0, PLACE, (50.0, 90.0, -9.0), (3.0, 4.0, 2.0), 10.0),
    "car": car(
        PLACE,
        [("a", Accelerate(15.0, 4.0)), ("t", Turn(-90.0, 25.0)), ("l", LaneChange(3.0, 3.0))],
        heading_deg=200.0,
        sway_roll=0.4,
        sway_pitch=0.5,
    ),
    "waypoints": through_waypoints(
        [(43.585, 39.7203, 80.0), (43.5855, 39.7210, 85.0), (43.5856, 39.7220, 90.0)],
        speeds=[15.0, 15.0],
    ),
}


def axes(lat, lon):
    """North, east, down as columns, in axes of the Earth."""
    s, c, so, co = math.sin(lat), math.cos(lat), math.sin(lon), math.cos(lon)
    return np.array([[-s * co, -so, -c * co], [-s * so, co, -c * so], [c, 0.0, -s]])


def state(motion, time):
    """Place, velocity and attitude in axes of the Earth."""
    row = motion.trajectory([time]).iloc[0]
    lat, lon = math.radians(row["lat"]), math.radians(row["lon"])
    place = pymap3d.geodetic2ecef(lat, lon, row["alt"], deg=False)
    c = axes(lat, lon)
    velocity = c @ row[["VN", "VE", "VD"]].to_numpy(dtype=float)
    q = rotation.compose(rotation.quaternion_from_dcm(c), motion.attitude([time])[0])
    return np.concatenate([place, velocity, q])


@pytest.mark.parametrize("name", MOTIONS)
def test_another_integrator_comes_to_the_same_place(name):
    motion = MOTIONS[name]
    p = motion.ellipsoid.parameters()
    spin = np.array([0.0, 0.0, motion.ellipsoid.rotation_rate])

    def slope(time, x):
        lat, lon, alt = pymap3d.ecef2geodetic(*x[:3], deg=False)
        s, c = math.sin(lat), math.cos(lat)
        constants = (p[k] for k in (earth.A, earth.E2, earth.GAMMA, earth.K, earth.F, earth.M))
        north, down = earth.gravity(s, c, float(alt), *constants)
        q = x[6:] / np.linalg.norm(x[6:])
        body = rotation.dcm_from_quaternion(q)
        force = body @ motion.specific_force([time])[0]
        gravity = axes(lat, lon) @ [north, 0.0, down]
        turn = motion.rate([time])[0] - body.T @ spin
        w, v = x[6], x[7:]
        return np.concatenate(
            [
                x[3:6],
                force + gravity - 2.0 * np.cross(spin, x[3:6]),
                [-0.5 * v @ turn],
                0.5 * (w * turn + np.cross(v, turn)),
            ]
        )

    x = state(motion, 0.0)
    edges = motion.breaks
    for start, end in pairwise(edges):
        done = solve_ivp(
            slope, (start, end), x, method="DOP853", rtol=1e-12, atol=1e-12, max_step=0.5
        )
        x = done.y[:, -1]
    truth = state(motion, motion.duration)
    # A place of 6e6 m is rounded to 1e-9 m in each of some hundred steps, and the closed forms of
    # pymap3d to several of those; a step errs by 1e-12 of the state.
    assert np.abs(x[:3] - truth[:3]).max() < 1e-6
    assert np.abs(x[3:6] - truth[3:6]).max() < 1e-8
    turned = rotation.rotation_angle(x[6:] / np.linalg.norm(x[6:]), truth[6:])
    assert turned < 1e-10

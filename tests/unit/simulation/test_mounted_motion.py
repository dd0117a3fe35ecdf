"""Sensors away from the vehicle's origin: the rigid body, held against inertial axes."""

from __future__ import annotations

import math
import sys
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import mpmath
import numpy as np
import pytest
from mpmath import mpf
from tests.coded import coded

sys.path.insert(0, str(Path(__file__).parent))

from earth_truth import DIGITS, course, gravitation, turns
from test_crash_motion import CRASH, MANY, exact_angles, exact_velocity

from strapdown import earth, frames, rotation
from strapdown.errors import ConfigError
from strapdown.sensors.crash_unit import Mounting
from strapdown.simulation import (
    MountedMotion,
    Origin,
    Ringing,
    SineVelocityMotion,
    StationaryMotion,
    point_kinematics,
    point_path,
)

ARM = (-0.6, 0.5, -0.2)
MOUNTING = Mounting(ARM, (4.0, -7.0, 95.0))
RINGING = (
    Ringing(0.15, 98.0665, 195.0, 0.03, (1.0, 0.0, 0.0)),
    Ringing(0.2, 30.0, 80.0, 0.05, (0.3, -0.5, 1.0)),
)
PARTS = (slice(None), ["north", "east", "down"], ["VN", "VE", "VD"])


def exact_displacement(ringing, at):
    """The definition in words, in many digits: an envelope, an onset and a sine."""

    def displacement(t):
        t = mpf(at) + t - mpf(ringing.start)
        if t <= 0:
            return [mpf(0)] * 3
        w, decay = 2 * mpmath.pi * mpf(ringing.frequency), mpf(ringing.decay)
        size = mpf(ringing.amplitude) / (w**2 + 1 / decay**2)
        swing = size * (1 - mpmath.exp(-w * t)) ** 2 * mpmath.exp(-t / decay) * mpmath.sin(w * t)
        return [swing * mpf(x) for x in ringing.direction]

    return displacement


def exact_force(motion, mounting, ringing, at):
    """Specific force from the second derivative of the sensors' place in inertial axes."""
    start = motion.origin.place(motion.kinematics(np.array([at])).moved)[0].tolist()
    place = course(motion.ellipsoid, start, exact_velocity(motion, at))
    angles = exact_angles(motion, at)
    swings = [exact_displacement(r, at) for r in ringing]
    shape = motion.ellipsoid
    flat = 1 / mpf(shape.inverse_flattening)
    a, e2 = mpf(shape.semi_major_axis), flat * (2 - flat)
    omega = mpf(shape.rotation_rate)

    def sensors(t):
        lat, lon, alt = place(t)
        lon = lon + omega * t
        sl, cl, so, co = mpmath.sin(lat), mpmath.cos(lat), mpmath.sin(lon), mpmath.cos(lon)
        n = a / mpmath.sqrt(1 - e2 * sl**2)
        centre = mpmath.matrix(
            [(n + alt) * cl * co, (n + alt) * cl * so, (n * (1 - e2) + alt) * sl]
        )
        level = mpmath.matrix([[-sl * co, -so, -cl * co], [-sl * so, co, -cl * so], [cl, 0, -sl]])
        arm = [mpf(x) for x in mounting.position]
        for swing in swings:
            arm = [x + y for x, y in zip(arm, swing(t), strict=True)]
        return centre + level * turns(angles(t)) * mpmath.matrix(arm), level

    with mpmath.workdps(DIGITS):
        acceleration = mpmath.matrix(
            [mpmath.diff(lambda t, k=k: sensors(t)[0][k], 0, 2) for k in range(3)]
        )
        at_sensors, level = sensors(mpf(0))
        fall = gravitation(shape, at_sensors)
        c = level * turns(angles(mpf(0)))
        c *= turns([mpmath.radians(mpf(x)) for x in mounting.angles_deg])
        force = c.T * (acceleration - fall)
    return np.array([float(x) for x in force])


@pytest.mark.parametrize("at", [0.12, 0.151, 0.33, 0.6])
@pytest.mark.parametrize("ringing", [(), RINGING], ids=["rigid", "ringing"])
@pytest.mark.parametrize("motion", [CRASH, MANY], ids=["one", "many"])
def test_what_is_felt_is_what_inertial_axes_have(motion, ringing, at):
    mounted = MountedMotion(motion, MOUNTING, ringing)
    found = mounted.specific_force([at])[0]
    # As of the origin, 3e-13; the place at which gravity is taken is right to 5e-9 m of 3e-6 1/s²,
    # and what is turned into Earth-centered axes and back has a dozen roundings of 10 m/s².
    np.testing.assert_allclose(found, exact_force(motion, MOUNTING, ringing, at), atol=4e-13)


def test_without_an_arm_it_is_the_origin():
    t = np.linspace(0.0, 0.75, 16)
    mounted = MountedMotion(CRASH)
    np.testing.assert_array_equal(mounted.specific_force(t), CRASH.specific_force(t))
    np.testing.assert_array_equal(mounted.rate(t), CRASH.rate(t))
    # Through Earth-centered axes and back: five products of unit quaternions, 1e-15 rad.
    angle = rotation.rotation_angle(mounted.attitude(t), CRASH.attitude(t))
    assert np.all(np.abs(angle) < 6e-14)
    ours, theirs = mounted.trajectory(t), CRASH.trajectory(t)
    np.testing.assert_allclose(ours[PARTS[2]], theirs[PARTS[2]], atol=1e-14)
    apart = frames.place_difference(ours[["lat", "lon", "alt"]], theirs[["lat", "lon", "alt"]])
    assert np.abs(apart).max() < 5e-9


def test_a_turned_unit_at_rest_feels_gravity_on_its_own_axes():
    rest = StationaryMotion(10.0, Origin(45.0, 20.0, 100.0), heading_deg=50.0)
    mounted = MountedMotion(rest, Mounting(ARM, (90.0, 0.0, 0.0)))
    # Rolled by 90 deg the y axis points down; 0.2 m higher gravity is less by 6e-7 m/s².
    g = np.linalg.norm(rest.specific_force([0.0])[0])
    force = mounted.specific_force([0.0])[0]
    assert force[1] == pytest.approx(-g, abs=1e-6)
    assert g - np.linalg.norm(force) == pytest.approx(0.2 * 3.086e-6, rel=0.02)
    np.testing.assert_allclose(
        rotation.euler_from_quaternion(mounted.attitude([0.0]))[0], [90.0, 0.0, 50.0], atol=1e-5
    )


@pytest.mark.parametrize("ringing", [(), RINGING], ids=["rigid", "ringing"])
def test_velocity_and_acceleration_are_derivatives(ringing):
    mounted = MountedMotion(MANY, MOUNTING, ringing)
    h, t = 1e-5, np.array([0.14, 0.22, 0.33, 0.47, 0.9])
    low, mid, high = (mounted.kinematics_from(t + d) for d in (-h, 0.0, h))
    # Positions are rounded to 5e-9 m in the differences: 5e-4 m/s; but steady rounding cancels.
    # Third derivatives: 98 m/s² w = 1.2e5 m/s³ of the ringing, 1e4 of the pulses; h²/6 of them.
    np.testing.assert_allclose((high.position - low.position) / (2 * h), mid.velocity, atol=5e-4)
    # And fourth ones, 1.5e8 m/s⁴ and 1e6, with rounding of 10 m/s over 2 h.
    slope = (high.velocity - low.velocity) / (2 * h)
    np.testing.assert_allclose(slope, mid.acceleration, atol=4e-3 if ringing else 2e-5)


@pytest.mark.parametrize("ringing", [(), RINGING], ids=["rigid", "ringing"])
@pytest.mark.parametrize("motion", [CRASH, MANY], ids=["one", "many"])
def test_what_is_felt_integrates_to_velocity_and_path(motion, ringing):
    # In axes that stand still on the Earth: v' = C f + g - 2 w x v, with gravity where the
    # sensors are. Gauss-Legendre with 20 nodes in stretches of 2 ms, half a period at the most.
    mounted = MountedMotion(motion, MOUNTING, ringing)
    edges = np.unique([*motion.breaks, *(r.start for r in ringing)])
    edges = np.unique(
        np.concatenate([np.linspace(a, b, 2 + int((b - a) / 2e-3)) for a, b in pairwise(edges)])
    )
    x, w = np.polynomial.legendre.leggauss(20)
    half = 0.5 * np.diff(edges)[:, None]
    at = (edges[:-1, None] + half * (1.0 + x)).ravel()
    k = mounted.kinematics_from(at)
    start = motion.trajectory([0.0])[["lat", "lon", "alt"]].to_numpy()[0]
    table = mounted.trajectory(at)
    force = rotation.rotate(mounted.attitude(at), mounted.specific_force(at))
    g = earth.gravity(table["lat"].to_numpy(), table["alt"].to_numpy())
    lat, lon = table["lat"].to_numpy(), table["lon"].to_numpy()
    to_fixed = rotation.compose(frames.q_ne(*start[:2]), rotation.conjugate(frames.q_ne(lat, lon)))
    spin = earth.earth_rate(start[:1])[0]
    slope = rotation.rotate(to_fixed, force + g) - 2.0 * np.cross(spin, k.velocity)
    # The acceleration that is told is what is felt. Rounding of 130 m/s².
    np.testing.assert_allclose(slope, k.acceleration, atol=5e-13)
    weight = (half * w).ravel()[:, None]
    ends = mounted.kinematics_from(np.array([0.0, motion.duration]))
    left = motion.duration - at[:, None]
    moved = ends.velocity[0] * motion.duration + (weight * left * slope).sum(axis=0)
    np.testing.assert_allclose(
        (weight * slope).sum(axis=0), ends.velocity[1] - ends.velocity[0], atol=1e-13
    )
    # Two conversions of Earth-centered coordinates, at both ends.
    np.testing.assert_allclose(moved, ends.position[1] - ends.position[0], atol=1e-8)


def test_the_path_of_a_point_is_that_of_its_kinematics():
    t = np.array([0.1, 0.2, 0.5])
    path = point_path(MANY, ARM, t, epoch=0.2)
    k = point_kinematics(MANY, ARM, t, epoch=0.2)
    np.testing.assert_array_equal(path[PARTS[1]], k.position)
    np.testing.assert_array_equal(path[PARTS[2]], k.velocity)
    np.testing.assert_array_equal(path.index, t)
    # At the epoch the axes are those of the origin, and the arm is where the attitude turns it.
    arm = rotation.rotate(MANY.attitude([0.2]), [ARM])[0]
    np.testing.assert_allclose(k.position[1], arm, atol=5e-9)
    angles = MANY.trajectory([0.2])[["roll", "pitch", "heading"]].to_numpy()[0]
    np.testing.assert_allclose(path.loc[0.2, ["roll", "pitch", "heading"]], angles, atol=1e-12)


def test_points_of_a_rigid_vehicle_keep_their_distance():
    t = np.linspace(0.0, 1.0, 41)
    one, two = (point_path(MANY, p, t)[PARTS[1]].to_numpy() for p in (ARM, (1.9, -0.4, 0.3)))
    apart = math.dist(ARM, (1.9, -0.4, 0.3))
    np.testing.assert_allclose(np.linalg.norm(one - two, axis=1), apart, rtol=0.0, atol=1e-14)


def test_a_unit_on_a_motion_without_angular_acceleration_is_refused():
    sine = SineVelocityMotion(10.0, Origin(45.0, 20.0), (5.0, 1.0, 0.0), (1.0, 0.0, 0.0), 5.0)
    with pytest.raises(
        ConfigError,
        check=coded(
            "simulation.does-not-know-angular-acceleration", quantity="angular acceleration"
        ),
    ):
        MountedMotion(sine, MOUNTING).specific_force([1.0])


@pytest.mark.parametrize("epoch", [-0.1, 2.0, math.nan])
def test_an_epoch_outside_of_the_motion_is_refused(epoch):
    with pytest.raises(ConfigError, match="epoch"):
        point_path(MANY, ARM, [0.0], epoch=epoch)


@pytest.mark.parametrize("position", [(1.0, 2.0), (1.0, 2.0, math.nan), 3.0])
def test_a_position_is_three_numbers(position):
    with pytest.raises(ConfigError, match="position"):
        point_kinematics(MANY, position, [0.0])


def test_ringing_does_not_change_where_the_vehicle_turns():
    rigid, loose = MountedMotion(MANY, MOUNTING), MountedMotion(MANY, MOUNTING, RINGING)
    t = np.linspace(0.0, 1.0, 21)
    np.testing.assert_array_equal(rigid.rate(t), loose.rate(t))
    # Twenty time constants after, nothing is left: 98 m/s² e^-20/w² is 1e-13 m.
    late = MountedMotion(replace(MANY, duration=2.0), MOUNTING, RINGING)
    still = MountedMotion(replace(MANY, duration=2.0), MOUNTING)
    np.testing.assert_allclose(late.specific_force([1.9]), still.specific_force([1.9]), atol=1e-12)

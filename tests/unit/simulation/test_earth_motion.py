"""Motions on the Earth against an inertial-frame derivation, and against python-ins."""

from __future__ import annotations

import math
import sys
from pathlib import Path

import mpmath
import numpy as np
import pyins.sim
import pytest
from mpmath import mpf

sys.path.insert(0, str(Path(__file__).parent))

from earth_truth import course, felt

from strapdown.ellipsoids import ELLIPSOIDS, WGS84
from strapdown.errors import ConfigError
from strapdown.simulation import (
    ImuErrors,
    Origin,
    SineVelocityMotion,
    StationaryMotion,
    simulate_imu,
)
from strapdown.tables import ACCEL, GYRO

# Products of a dozen factors of order one, times 10 m/s²: a few last places of that.
FORCE_ROUNDING = 2e-14
# The same, of rates of the order of 0.1 rad/s.
RATE_ROUNDING = 1e-16


def sine(**changes):
    values = {
        "duration": 600.0,
        "origin": Origin(55.0, 37.0, 150.0),
        "mean_velocity": (5.0, 10.0, -1.0),
        "amplitude": (3.0, 4.0, 2.0),
        "period": 60.0,
        "phase_deg": (0.0, 90.0, 20.0),
    }
    return SineVelocityMotion(**(values | changes))


@pytest.mark.parametrize("ellipsoid", ["wgs84", "krassovsky1940"])
@pytest.mark.parametrize("lat", [-62.0, 0.0, 85.0])
def test_a_sine_velocity_is_felt_as_in_inertial_axes(lat, ellipsoid):
    shape = ELLIPSOIDS[ellipsoid]
    motion = sine(origin=Origin(lat, 170.0, 900.0), ellipsoid=shape)
    for instant in (0.0, 71.3, 555.5):
        row = motion.trajectory([instant]).iloc[0]

        def velocity(t, at=instant):
            w = 2 * mpmath.pi / mpf(60)
            return [
                mpf(m) + mpf(a) * mpmath.sin(w * (mpf(at) + t) + mpmath.radians(mpf(p)))
                for m, a, p in zip(
                    motion.mean_velocity, motion.amplitude, motion.phase_deg, strict=True
                )
            ]

        def angles(t, velocity=velocity):
            n, e, d = velocity(t)
            return [mpf(0), mpmath.atan2(-d, mpmath.sqrt(n * n + e * e)), mpmath.atan2(e, n)]

        moved = motion.kinematics(np.array([instant])).moved
        place = course(shape, motion.origin.place(moved)[0].tolist(), velocity)
        rate, force = felt(shape, place, angles)
        np.testing.assert_allclose(
            motion.specific_force([instant])[0], force, rtol=0.0, atol=FORCE_ROUNDING
        )
        np.testing.assert_allclose(motion.rate([instant])[0], rate, rtol=0.0, atol=RATE_ROUNDING)
        with mpmath.workdps(30):
            v, euler = velocity(mpf(0)), [mpmath.degrees(x) for x in angles(mpf(0))]
        np.testing.assert_allclose(row[["VN", "VE", "VD"]], [float(x) for x in v], atol=5e-15)
        np.testing.assert_allclose(row["pitch"], float(euler[1]), atol=3e-14)
        np.testing.assert_allclose(row["heading"], float(euler[2]) % 360.0, atol=1e-13)


def test_the_place_is_the_integral_of_the_velocity():
    # Solved again by Taylor series in 25 digits; 1e-9 m is 1.6e-16 rad.
    motion = sine(duration=3.0, mean_velocity=(50.0, 90.0, -9.0))
    w, e2, a = 2 * mpmath.pi / 60, mpf(WGS84.eccentricity_squared), mpf(WGS84.semi_major_axis)

    def slope(t, y):
        w2 = 1 - e2 * mpmath.sin(y[0]) ** 2
        n = a / mpmath.sqrt(w2)
        north, east, down = (
            m + k * mpmath.sin(w * t + mpmath.radians(p))
            for m, k, p in zip(
                motion.mean_velocity, motion.amplitude, motion.phase_deg, strict=True
            )
        )
        across = (n + y[2]) * mpmath.cos(y[0])
        return [north / (n * (1 - e2) / w2 + y[2]), east / across, -down]

    with mpmath.workdps(25):
        start = [mpf(math.radians(55.0)), mpf(0), mpf(150)]
        end = mpmath.odefun(slope, 0, start)(3)
        truth = [float(end[0] - start[0]), float(end[1]), float(end[2] - 150)]
    moved = motion.kinematics(np.array([3.0])).moved[0]
    assert np.all(np.abs(moved - truth) < [2e-17, 2e-17, 1e-10])


def test_another_library_makes_the_same_of_a_sine_velocity():
    # python-ins takes accelerations as second derivatives of a Hermite spline through Cartesian
    # places, which are rounded to 1e-9 m: 6 * 2 * 1e-9 m / (0.01 s)^2 = 1.2e-4 m/s^2, and as much
    # from the velocities' 1e-13 m/s and the axes. Rates are splined from rounded attitudes.
    motion = sine(duration=60.0, mean_velocity=(5.0, 10.0, 0.0), amplitude=(3.0, 4.0, 0.0))
    theirs, samples = pyins.sim.generate_sine_velocity_motion(
        0.01, 60.0, [55.0, 37.0, 150.0], [5.0, 10.0, 0.0], [3.0, 4.0, 0.0], 60.0, [0.0, 90.0, 20.0]
    )
    ours = motion.trajectory(theirs.index)
    np.testing.assert_allclose(ours, theirs[ours.columns], rtol=0.0, atol=1e-12)
    imu, _ = simulate_imu(motion, ImuErrors(), rate=100.0)
    inner = slice(20, -20)
    assert np.abs(imu[GYRO].to_numpy()[:-1] - samples[GYRO].to_numpy())[inner].max() < 1e-8
    assert np.abs(imu[ACCEL].to_numpy()[:-1] - samples[ACCEL].to_numpy())[inner].max() < 3e-4


def test_means_of_a_sine_velocity_are_those_of_another_library():
    # In the integrals that rounding cancels from step to step: 1e-9 m/s of 0.01 s, 1e-7 m/s^2, and
    # the spline's own model of gravity, which is linear in a step.
    motion = sine(duration=60.0, mean_velocity=(5.0, 10.0, 0.0), amplitude=(3.0, 4.0, 0.0))
    _, increments = pyins.sim.generate_sine_velocity_motion(
        0.01,
        60.0,
        [55.0, 37.0, 150.0],
        [5.0, 10.0, 0.0],
        [3.0, 4.0, 0.0],
        60.0,
        [0.0, 90.0, 20.0],
        sensor_type="increment",
    )
    imu, _ = simulate_imu(motion, ImuErrors(), rate=100.0, sampling="mean")
    mean = increments.to_numpy() / 0.01
    inner = slice(20, -20)
    assert np.abs(imu[GYRO].to_numpy()[:-1] - mean[:, :3])[inner].max() < 1e-9
    assert np.abs(imu[ACCEL].to_numpy()[:-1] - mean[:, 3:])[inner].max() < 1e-5


@pytest.mark.parametrize("ellipsoid", ELLIPSOIDS)
@pytest.mark.parametrize("lat", [-90.0, -33.0, 0.0, 90.0])
def test_rest_reads_the_earth(lat, ellipsoid):
    shape = ELLIPSOIDS[ellipsoid]
    motion = StationaryMotion(100.0, Origin(lat, 151.0, 20.0), 10.0, -20.0, 30.0, shape)
    place = [mpmath.radians(mpf(lat)), mpmath.radians(mpf(151)), mpf(20)]
    pose = [mpmath.radians(mpf(x)) for x in (10, -20, 30)]
    rate, force = felt(shape, lambda t: place, lambda t: pose)
    np.testing.assert_allclose(motion.rate([0.0, 7.0]), [rate, rate], rtol=0.0, atol=1e-19)
    np.testing.assert_allclose(motion.specific_force([3.0])[0], force, atol=FORCE_ROUNDING)
    np.testing.assert_allclose(motion.angle([0.0, 50.0]), [[0, 0, 0], 50.0 * rate], atol=1e-18)
    row = motion.trajectory([0.0]).iloc[0]
    assert (row[["lat", "lon", "alt"]] == [lat, 151.0, 20.0]).all()
    assert (row[["VN", "VE", "VD"]] == 0.0).all()
    assert (row[["roll", "pitch", "heading"]] == [10.0, -20.0, 30.0]).all()


def test_angles_over_their_range_are_those_of_the_attitude():
    motion = StationaryMotion(1.0, Origin(10.0, 20.0), 200.0, 100.0, -30.0)
    row = motion.trajectory([0.0]).iloc[0]
    # Over the top: roll and heading by half a turn, pitch back from 100 to 80 deg.
    assert np.allclose(row[["roll", "pitch", "heading"]], [20.0, 80.0, 150.0], atol=1e-12)
    turned = StationaryMotion(1.0, Origin(10.0, 20.0), 0.0, 0.0, -1e-20)
    assert turned.trajectory([0.0]).iloc[0]["heading"] == 0.0


def test_a_stop_has_no_heading():
    with pytest.raises(ConfigError, match="falls to 0 m/s, where the heading"):
        sine(mean_velocity=(0.0, 0.0, 0.0), amplitude=(1.0, 0.0, 0.0))


def test_a_period_is_checked():
    with pytest.raises(ConfigError, match=r"period: a velocity period of 0\.001 s is too short"):
        sine(period=0.001)


def test_a_pole_is_refused():
    motion = sine(duration=3600.0, origin=Origin(88.9, 0.0), mean_velocity=(9.0, 1.0, 0.0))
    with pytest.raises(ConfigError, match=r"reaches a latitude of 89\.\d+ deg"):
        motion.trajectory([0.0])


@pytest.mark.parametrize(
    ("lat", "lon", "words"),
    [
        (151.0, -33.0, "seem to be swapped"),
        (91.0, 151.0, "within -90 to 90"),
        (9.0, 400.0, "more than a full turn"),
        (math.nan, 0.0, "not finite"),
    ],
)
def test_an_origin_is_checked(lat, lon, words):
    with pytest.raises(ConfigError, match=words):
        Origin(lat, lon)

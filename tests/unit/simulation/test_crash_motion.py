"""Pulses of acceleration and turning: velocity, angles, rates and their derivatives agree."""

from __future__ import annotations

import math
import sys
from dataclasses import replace
from pathlib import Path

import mpmath
import numpy as np
import pytest
from mpmath import mpf
from tests.coded import coded

sys.path.insert(0, str(Path(__file__).parent))

from earth_truth import course, felt, turned_twice

from strapdown import frames, rotation
from strapdown.ellipsoids import ELLIPSOIDS
from strapdown.errors import ConfigError
from strapdown.simulation.crash_motion import CrashMotion, HaversinePulse
from strapdown.simulation.earth_motion import Origin, StationaryMotion
from strapdown.simulation.spline_motion import SineVelocityMotion

PULSE = HaversinePulse(0.1, 0.113, (-7.2, 1.0, 0.3), (10.0, -20.0, 87.0))
CRASH = CrashMotion(0.75, Origin(45.0, 20.0, 100.0), (7.1, 0.0, 0.0), (PULSE,), heading_deg=30.0)
ENDS = np.array([0.0, 0.1, 0.213, 0.75])
# Three that overlap, far from level.
MANY = CrashMotion(
    1.0,
    Origin(-35.0, 149.0, 600.0),
    (3.0, -12.0, 0.5),
    (
        HaversinePulse(0.1, 0.4, (-7.0, 4.0, 1.0), (60.0, -40.0, 90.0)),
        HaversinePulse(0.25, 0.1, (1.0, -6.0, -0.7), (-200.0, 30.0, 10.0)),
        HaversinePulse(0.3, 0.7, (2.0, 2.0, 2.0), (20.0, 80.0, -150.0)),
    ),
    roll_deg=25.0,
    pitch_deg=-40.0,
    heading_deg=200.0,
)


def test_before_and_after_the_pulse():
    k = CRASH.kinematics(ENDS)
    np.testing.assert_allclose(k.velocity[:2], [[7.1, 0.0, 0.0]] * 2, atol=1e-15)
    np.testing.assert_allclose(k.velocity[2:], [[-0.1, 1.0, 0.3]] * 2, atol=2e-15)
    # sin²(pi x) at the rounding of x at the end.
    np.testing.assert_allclose(k.acceleration, 0.0, atol=1e-27)
    # Half of the pulse's length at the full rate, and all of what follows.
    turned = np.array([10.0, -20.0, 87.0]) * (0.5 * 0.113 + 0.537) + [0.0, 0.0, 30.0]
    np.testing.assert_allclose(rotation.euler_from_quaternion(k.q_nb[3]), turned, atol=1e-12)


def test_the_peak_is_twice_the_mean():
    at = np.array([0.1 + 0.5 * 0.113])
    peak = CRASH.kinematics(at).acceleration[0]
    np.testing.assert_allclose(peak, 2.0 / 0.113 * np.array([-7.2, 1.0, 0.3]), rtol=1e-14)
    assert abs(peak[0]) / 9.80665 == pytest.approx(13.0, abs=0.05)  # the pole test's 13 g


@pytest.mark.parametrize("x", [0.0, 1e-3, 0.2, 0.5, 0.83, 1.0, 2.0])
def test_a_pulse_is_its_own_integral(x):
    # In 30 digits from the acceleration alone.
    pulse = HaversinePulse(0.0, 0.113)
    time = np.array([x * 0.113])
    with mpmath.workdps(30):
        length, end = mpf(0.113), min(mpf(time[0]), mpf(0.113))

        def slope(t):
            return 2 / length * mpmath.sin(mpmath.pi * t / length) ** 2

        done = mpmath.quad(slope, [0, end])
        # The integral of an integral: each instant counts for what is left of the time.
        gathered = mpmath.quad(lambda t: (mpf(time[0]) - t) * slope(t), [0, end])
    assert pulse.slope(time)[0] == pytest.approx(float(slope(end)), abs=1e-14)
    assert pulse.done(time)[0] == pytest.approx(float(done), abs=3e-16)
    assert pulse.gathered(time)[0] == pytest.approx(float(gathered), abs=3e-17)


def test_pulses_add_up():
    t = np.linspace(0.0, 1.0, 57)
    whole = MANY.kinematics(t)
    still = replace(MANY, pulses=()).kinematics(t)
    alone = [replace(MANY, pulses=(p,)).kinematics(t) for p in MANY.pulses]
    for name in ("velocity", "acceleration", "angles"):
        without = getattr(still, name)
        parts = without + sum(getattr(k, name) - without for k in alone)
        # Sums of four numbers of 200 at the most, each rounded.
        np.testing.assert_allclose(getattr(whole, name), parts, rtol=0.0, atol=2e-13)


def test_one_pulse_in_two_halves_of_strength_is_the_same():
    half = HaversinePulse(0.1, 0.113, (-3.6, 0.5, 0.15), (5.0, -10.0, 43.5))
    t = np.linspace(0.0, 0.75, 31)
    one, two = CRASH, replace(CRASH, pulses=(half, half))
    for name in ("rate", "specific_force", "angular_acceleration"):
        # Rounding of 130 m/s² and 3000 deg/s².
        np.testing.assert_allclose(getattr(one, name)(t), getattr(two, name)(t), atol=3e-14)


def exact_velocity(motion, at):
    def velocity(t):
        t = mpf(at) + t
        out = [mpf(v) for v in motion.velocity]
        for p in motion.pulses:
            x = min(max((t - mpf(p.start)) / mpf(p.length), mpf(0)), mpf(1))
            done = x - mpmath.sin(2 * mpmath.pi * x) / (2 * mpmath.pi)
            out = [v + mpf(d) * done for v, d in zip(out, p.velocity_change, strict=True)]
        return out

    return velocity


def exact_angles(motion, at):
    def angles(t):
        t = mpf(at) + t
        out = [mpf(x) for x in (motion.roll_deg, motion.pitch_deg, motion.heading_deg)]
        for p in motion.pulses:
            length = mpf(p.length)
            since = t - mpf(p.start)
            x = min(max(since / length, mpf(0)), mpf(1))
            within = x * x / 2 + (mpmath.cos(2 * mpmath.pi * x) - 1) / (4 * mpmath.pi**2)
            gathered = length * within + max(since - length, mpf(0))
            out = [a + mpf(d) * gathered for a, d in zip(out, p.rate_change, strict=True)]
        return [mpmath.radians(a) for a in out]

    return angles


@pytest.mark.parametrize("motion", [CRASH, MANY], ids=["one", "many"])
@pytest.mark.parametrize("at", [0.05, 0.17, 0.31, 0.6])
@pytest.mark.parametrize("ellipsoid", ["wgs84", "krassovsky1940"])
def test_what_is_felt_is_what_inertial_axes_have(motion, at, ellipsoid):
    motion = replace(motion, ellipsoid=ELLIPSOIDS[ellipsoid])
    start = motion.origin.place(motion.kinematics(np.array([at])).moved)[0].tolist()
    velocity, angles = exact_velocity(motion, at), exact_angles(motion, at)
    place = course(motion.ellipsoid, start, velocity)
    rate, force = felt(motion.ellipsoid, place, angles)
    swing = turned_twice(motion.ellipsoid, place, angles)
    # Angles of up to 300 deg are known to 6e-14 deg = 1e-15 rad, which turns forces of 130 m/s².
    np.testing.assert_allclose(motion.specific_force([at])[0], force, rtol=0.0, atol=3e-13)
    # The same on 4 rad/s, and on 4000 deg/s² = 70 rad/s².
    np.testing.assert_allclose(motion.rate([at])[0], rate, rtol=0.0, atol=1e-14)
    np.testing.assert_allclose(motion.angular_acceleration([at])[0], swing, rtol=0.0, atol=3e-13)
    # The Earth's part counts: what the test would not see of it is a thousandth.
    without = motion.kinematics(np.array([at])).swinging[0]
    assert np.abs(without - swing).max() > 1e-7 or at == 0.05


def test_angular_acceleration_is_the_derivative_of_the_rate():
    # Sixth-order differences; the next term is h^6/140 of the seventh derivative of the rate,
    # 70 rad/s² (2 pi/0.1 s)^6 in the shortest pulse: 3e-8; and rounding of 4 rad/s over h, 3e-12.
    h, t = 1e-3, np.array([0.29, 0.33, 0.7])
    weights = {1: 3 / 4, 2: -3 / 20, 3: 1 / 60}
    slope = sum(w * (MANY.rate(t + k * h) - MANY.rate(t - k * h)) / h for k, w in weights.items())
    np.testing.assert_allclose(MANY.angular_acceleration(t), slope, rtol=0.0, atol=4e-8)


def test_the_integral_of_the_rate_is_the_angle():
    # Gauss-Legendre between the edges, 40 nodes: rates are products of a few sines.
    total = np.zeros(3)
    x, w = np.polynomial.legendre.leggauss(40)
    for a, b in zip(MANY.breaks[:-1], MANY.breaks[1:], strict=True):
        total += 0.5 * (b - a) * (w @ MANY.rate(0.5 * (a + b) + 0.5 * (b - a) * x))
    np.testing.assert_allclose(MANY.angle([1.0])[0], total, rtol=0.0, atol=2e-14)


def test_at_rest_before_the_pulses():
    motion = replace(MANY, velocity=(0.0, 0.0, 0.0))
    rest = StationaryMotion(1.0, motion.origin, 25.0, -40.0, 200.0)
    t = np.linspace(0.0, 0.1, 5)
    # Two roundings of 9.8 m/s²; headings of 200 and -160 deg make quaternions of another rounding.
    np.testing.assert_allclose(motion.specific_force(t), rest.specific_force(t), atol=4e-15)
    np.testing.assert_allclose(motion.rate(t), rest.rate(t), rtol=0.0, atol=4e-20)
    for still in (motion, rest):
        np.testing.assert_array_equal(still.angular_acceleration(t), 0.0)


def test_the_place_is_the_integral_in_closed_form():
    trajectory = CRASH.trajectory(ENDS)
    place = trajectory[["lat", "lon", "alt"]].to_numpy()
    ned = frames.ned_from_geodetic(place[3], origin=place[0])
    change = np.array([-7.2, 1.0, 0.3])
    expected = np.array([7.1, 0.0, 0.0]) * 0.75 + change * (0.5 * 0.113 + 0.537)
    # 3.3 m on a sphere of 6.4e6 m: 1e-6 m of curvature.
    np.testing.assert_allclose(ned, expected, atol=2e-6)


def test_a_pulse_may_end_with_the_motion():
    # 0.1 + 0.2 is more than 0.3 in doubles.
    motion = replace(CRASH, duration=0.3, pulses=(HaversinePulse(0.1, 0.2),))
    assert motion.breaks == [0.0, 0.1, 0.3]


@pytest.mark.parametrize("pulse", [(-0.1, 0.1), (0.1, 0.0), (0.1, math.nan), (0.1, math.inf)])
def test_what_is_no_pulse_is_refused(pulse):
    with pytest.raises(ConfigError, match="pulse") as refused:
        HaversinePulse(*pulse)
    assert "a length above zero" in str(refused.value)


def test_a_pulse_outside_the_motion_is_refused():
    with pytest.raises(ConfigError, match="pulse 2") as refused:
        replace(CRASH, pulses=(PULSE, HaversinePulse(0.7, 0.1)))
    assert "ends after the motion" in str(refused.value)


@pytest.mark.parametrize("change", [(1.0, 2.0), (1.0, 2.0, math.inf)])
def test_a_change_is_three_numbers(change):
    for name in ("velocity_change", "rate_change"):
        with pytest.raises(ConfigError, match=name):
            HaversinePulse(0.0, 0.1, **{name: change})


def test_a_motion_that_does_not_know_its_angular_acceleration_says_so():
    motion = SineVelocityMotion(10.0, Origin(45.0, 20.0), (5.0, 1.0, 0.0), (1.0, 0.0, 0.0), 5.0)
    with pytest.raises(ConfigError, check=coded("simulation.does-not-know-angular-acceleration")):
        motion.angular_acceleration([1.0])

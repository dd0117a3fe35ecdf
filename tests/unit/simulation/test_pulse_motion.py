"""Pulses of acceleration and turning: velocity, angles and rates belong together."""

from __future__ import annotations

import numpy as np
import pytest

from strapdown import frames, rotation
from strapdown.exceptions import ConfigError
from strapdown.simulation.earth_motion import Origin
from strapdown.simulation.pulse_motion import PulseMotion

CRASH = PulseMotion(
    0.75,
    Origin(45.0, 20.0, 100.0),
    (7.1, 0.0, 0.0),
    velocity_change=(-7.2, 1.0, 0.3),
    rate_change=(10.0, -20.0, 87.0),
    start=0.1,
    length=0.113,
    heading_deg=30.0,
)
ENDS = np.array([0.0, 0.1, 0.213, 0.75])


def test_before_and_after_the_pulse():
    k = CRASH.kinematics(ENDS)
    np.testing.assert_allclose(k.velocity[:2], [[7.1, 0.0, 0.0]] * 2, atol=1e-15)
    np.testing.assert_allclose(k.velocity[2:], [[-0.1, 1.0, 0.3]] * 2, atol=2e-15)
    np.testing.assert_allclose(k.acceleration, 0.0, atol=1e-13)
    # Half of the pulse's length at the full rate, and all of what follows.
    turned = np.array([10.0, -20.0, 87.0]) * (0.5 * 0.113 + 0.537) + [0.0, 0.0, 30.0]
    np.testing.assert_allclose(rotation.euler_from_quaternion(k.q_nb[3]), turned, atol=1e-12)


def test_the_peak_is_twice_the_mean():
    at = np.array([0.1 + 0.5 * 0.113])
    peak = CRASH.kinematics(at).acceleration[0]
    np.testing.assert_allclose(peak, 2.0 / 0.113 * np.array([-7.2, 1.0, 0.3]), rtol=1e-14)
    assert abs(peak[0]) / 9.80665 == pytest.approx(13.0, abs=0.05)  # the pole test's 13 g


def test_derivatives_are_those_of_the_values():
    h = 1e-5
    t = np.linspace(0.12, 0.19, 8)
    low, mid, high = (CRASH.kinematics(t + d) for d in (-h, 0.0, h))
    slope = (high.velocity - low.velocity) / (2 * h)
    # h²/6 of the third derivative, 2 D/T (2 pi/T)²: 7e-6 m/s².
    np.testing.assert_allclose(slope, mid.acceleration, atol=1e-5)
    turned = rotation.rotation_vector_from_quaternion(
        rotation.compose(rotation.conjugate(low.q_nb), high.q_nb)
    )
    # The same of the rates, 1.5 rad/s (2 pi/T)² h²/6 = 8e-8, and rounding over 2 h.
    np.testing.assert_allclose(turned / (2 * h), mid.turning, atol=2e-7)


def test_the_place_is_the_integral_in_closed_form():
    trajectory = CRASH.trajectory(ENDS)
    place = trajectory[["lat", "lon", "alt"]].to_numpy()
    ned = frames.ned_from_geodetic(place[3], origin=place[0])
    change = np.array([-7.2, 1.0, 0.3])
    expected = np.array([7.1, 0.0, 0.0]) * 0.75 + change * (0.5 * 0.113 + 0.537)
    # 3.3 m on a sphere of 6.4e6 m: 1e-6 m of curvature.
    np.testing.assert_allclose(ned, expected, atol=2e-6)


@pytest.mark.parametrize("pulse", [(-0.1, 0.1), (0.7, 0.1), (0.1, 0.0), (0.1, np.nan)])
def test_a_pulse_outside_the_motion_is_refused(pulse):
    with pytest.raises(ConfigError, match="pulse") as refused:
        PulseMotion(0.75, Origin(0, 0), (1.0, 0.0, 0.0), start=pulse[0], length=pulse[1])
    assert "end before the motion" in str(refused.value)

"""Steps of both sets of level axes against a motion that is known in the Earth's axes."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[2]))

from ecef_motion import OverThePole, errors_in_earth_axes
from strapdown import rotation
from strapdown.errors import DivergenceError
from strapdown.mechanization import NorthEastDown, WanderAzimuth, run_mechanization

RADIUS = 6.38e6
STEP, STEPS = 2.0, 12
TIME = STEP * np.arange(STEPS + 1.0)
# m/s and rad/s: along the surface, of the Earth; m and rad/s of the waves, down and aside.
SPEED, SPIN = 250.0, 7.3e-5
WAVE, RHYTHM = 5.0, 2.0 * np.pi / 50.0
# At 55 deg north, course north-east; it climbs, sinks and rolls, and passes no pole.
MOTION = OverThePole(speed=SPEED, half=14_000.0, miss=3e5, wave=WAVE, period=50.0)


def bounds():
    """Of place, velocity and attitude after the steps: m, m/s, rad."""
    # As the kernel's page has it: 1/2 g (omega + v/R) (v_d + e2 v)/R dt².
    turn = SPIN + SPEED / RADIUS
    off = 0.5 * 9.8 * turn * (WAVE * RHYTHM + 6.7e-3 * SPEED) / RADIUS * STEP**2
    # Of half the turn of the level in a step the third order is left out where both axes meet.
    tilt = STEPS * 0.5 * (turn * STEP / 2.0 * 2.0**0.5) ** 3
    duration = STEP * STEPS
    velocity = off * duration + tilt * 9.8 * duration
    # Hermite's cubic leaves dt⁴/720 of the fourth derivative, which the Earth's rate turns.
    cubic = STEP**4 / 720.0 * WAVE * RHYTHM**4
    place = 0.5 * velocity * duration + duration * SPIN * cubic + 20.0 * RADIUS * 2.0**-53
    return place, velocity, tilt


def test_north_east_down_follows_a_flight_with_waves():
    run = run_mechanization(
        NorthEastDown(), MOTION.state(0.0), MOTION.increments(TIME), longest_step=1e9
    )
    place, velocity, tilt = bounds()
    for row, at in zip(run.history[1:], TIME[1:], strict=True):
        true = MOTION.state(at)
        moved = (row[:3] - [true.lat, true.lon, true.alt]) * [
            RADIUS,
            RADIUS * np.cos(true.lat),
            1.0,
        ]
        assert np.abs(moved).max() < place
        assert np.abs(row[3:6] - true.v_n).max() < velocity
        turned = rotation.compose(row[6:10], rotation.conjugate(true.q_nb))
        assert np.linalg.norm(rotation.rotation_vector_from_quaternion(turned)) < tilt


def test_wander_azimuth_follows_a_flight_with_waves():
    run = run_mechanization(
        WanderAzimuth(), MOTION.state(0.0), MOTION.increments(TIME), longest_step=1e9
    )
    assert (errors_in_earth_axes(run, MOTION) < bounds()).all()


@pytest.mark.parametrize(("step", "leaps"), [(250.0, False), (260.0, True)])
def test_a_step_beyond_a_hundredth_of_a_radian_is_a_leap(step, leaps):
    """0.01 rad of 6.39e6 m are 63.9 km: 255.6 s at 250 m/s."""
    increments = MOTION.increments(np.array([0.0, step]))
    if leaps:
        with pytest.raises(DivergenceError):
            run_mechanization(WanderAzimuth(), MOTION.state(0.0), increments, longest_step=1e9)
    else:
        run_mechanization(WanderAzimuth(), MOTION.state(0.0), increments, longest_step=1e9)

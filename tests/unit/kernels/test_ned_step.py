"""Steps of the local level against a motion that is known in the Earth's axes."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

from ecef_motion import OverThePole
from strapdown import rotation
from strapdown.mechanization import NorthEastDown, run_mechanization

RADIUS = 6.38e6
STEP, STEPS = 2.0, 12
# m/s and rad/s: along the surface, of the Earth; m and rad/s of the waves, down and aside.
SPEED, SPIN = 250.0, 7.3e-5
WAVE, RHYTHM = 5.0, 2.0 * np.pi / 50.0


def test_steps_of_two_seconds_follow_a_flight_with_waves():
    """At 55 deg north, course north-east; it climbs, sinks and rolls, and passes no pole."""
    motion = OverThePole(speed=SPEED, half=14_000.0, miss=3e5, wave=WAVE, period=50.0)
    time = STEP * np.arange(STEPS + 1.0)
    run = run_mechanization(
        NorthEastDown(), motion.state(0.0), motion.increments(time), longest_step=1e9
    )
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
    for row, at in zip(run.history[1:], time[1:], strict=True):
        true = motion.state(at)
        moved = (row[:3] - [true.lat, true.lon, true.alt]) * [
            RADIUS,
            RADIUS * np.cos(true.lat),
            1.0,
        ]
        assert np.abs(moved).max() < place
        assert np.abs(row[3:6] - true.v_n).max() < velocity
        turned = rotation.compose(row[6:10], rotation.conjugate(true.q_nb))
        assert np.linalg.norm(rotation.rotation_vector_from_quaternion(turned)) < tilt

"""Motions with exact truth, and the sensor data they would give."""

from strapdown.simulation.coning import Coning
from strapdown.simulation.gesture import Gesture, gesture
from strapdown.simulation.gyro import GyroErrors, simulate_gyro
from strapdown.simulation.handling import Handling
from strapdown.simulation.minimum_jerk import Track
from strapdown.simulation.motion import Pulse, PulseMotion
from strapdown.simulation.scenarios import SCENARIOS, Scenario, find_scenario
from strapdown.simulation.smooth_random import SmoothRandom

__all__ = [
    "SCENARIOS",
    "Coning",
    "Gesture",
    "GyroErrors",
    "Handling",
    "Pulse",
    "PulseMotion",
    "Scenario",
    "SmoothRandom",
    "Track",
    "find_scenario",
    "gesture",
    "simulate_gyro",
]

"""Motions with exact truth, and the sensor data they would give."""

from strapdown.sensors.triad_errors import ImuErrors, TriadErrors
from strapdown.simulation.coning import Coning
from strapdown.simulation.gesture import Gesture, gesture
from strapdown.simulation.handling import Handling
from strapdown.simulation.imu import simulate_imu
from strapdown.simulation.minimum_jerk import Track
from strapdown.simulation.motion import Motion, Pulse, PulseMotion
from strapdown.simulation.scenarios import SCENARIOS, Scenario, find_scenario
from strapdown.simulation.sculling import Sculling
from strapdown.simulation.smooth_random import SmoothRandom

__all__ = [
    "SCENARIOS",
    "Coning",
    "Gesture",
    "Handling",
    "ImuErrors",
    "Motion",
    "Pulse",
    "PulseMotion",
    "Scenario",
    "Sculling",
    "SmoothRandom",
    "Track",
    "TriadErrors",
    "find_scenario",
    "gesture",
    "simulate_imu",
]

"""Motions with exact truth, and the sensor data they would give."""

from strapdown.sensors.triad_errors import ImuErrors, TriadErrors
from strapdown.simulation.coning import Coning
from strapdown.simulation.earth_motion import EarthMotion, Origin
from strapdown.simulation.gesture import Gesture, gesture
from strapdown.simulation.handling import Handling
from strapdown.simulation.imu import simulate_imu
from strapdown.simulation.minimum_jerk import Track
from strapdown.simulation.motion import Motion, Pulse, PulseMotion
from strapdown.simulation.scenarios import SCENARIOS, Scenario, find_scenario
from strapdown.simulation.sculling import Sculling
from strapdown.simulation.sine_velocity import SineVelocityMotion
from strapdown.simulation.smooth_random import SmoothRandom
from strapdown.simulation.stationary import StationaryMotion

__all__ = [
    "SCENARIOS",
    "Coning",
    "EarthMotion",
    "Gesture",
    "Handling",
    "ImuErrors",
    "Motion",
    "Origin",
    "Pulse",
    "PulseMotion",
    "Scenario",
    "Sculling",
    "SineVelocityMotion",
    "SmoothRandom",
    "StationaryMotion",
    "Track",
    "TriadErrors",
    "find_scenario",
    "gesture",
    "simulate_imu",
]

"""Motions with exact truth, and the sensor data they would give."""

from strapdown.simulation.gyro import GyroErrors, simulate_gyro
from strapdown.simulation.motion import Pulse, PulseMotion
from strapdown.simulation.scenarios import SCENARIOS, Scenario, find_scenario

__all__ = [
    "SCENARIOS",
    "GyroErrors",
    "Pulse",
    "PulseMotion",
    "Scenario",
    "find_scenario",
    "simulate_gyro",
]

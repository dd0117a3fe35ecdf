"""Motions with exact truth, and the sensor data they would give."""

from strapdown.sensors.triad_errors import ImuErrors, TriadErrors
from strapdown.simulation.imu import simulate_imu
from strapdown.simulation.motion import Motion, Pulse, PulseMotion
from strapdown.simulation.scenarios import SCENARIOS, Scenario, find_scenario

__all__ = [
    "SCENARIOS",
    "ImuErrors",
    "Motion",
    "Pulse",
    "PulseMotion",
    "Scenario",
    "TriadErrors",
    "find_scenario",
    "simulate_imu",
]

"""Motions with exact truth, and the sensor data they would give."""

from strapdown.sensors.triad_errors import ImuErrors, TriadErrors
from strapdown.simulation.coning import Coning
from strapdown.simulation.crash_course import CrashScenario, Setting
from strapdown.simulation.crash_motion import CrashMotion, HaversinePulse
from strapdown.simulation.crash_scenarios import CRASHES, find_crash
from strapdown.simulation.earth_motion import EarthMotion, Origin
from strapdown.simulation.gesture import Gesture, gesture
from strapdown.simulation.handling import Handling
from strapdown.simulation.imu import simulate_imu
from strapdown.simulation.minimum_jerk import Track
from strapdown.simulation.motion import Motion, Pulse, PulseMotion
from strapdown.simulation.mounted_motion import MountedMotion
from strapdown.simulation.path_motion import PathMotion, rocking_stand
from strapdown.simulation.ringing import Ringing
from strapdown.simulation.scenarios import SCENARIOS, Scenario, find_scenario
from strapdown.simulation.sculling import Sculling
from strapdown.simulation.sine_velocity import SineVelocityMotion
from strapdown.simulation.smooth_random import SmoothRandom
from strapdown.simulation.spline_motion import SplineMotion
from strapdown.simulation.stationary import StationaryMotion
from strapdown.simulation.vehicle_points import PointKinematics, point_kinematics, point_path
from strapdown.simulation.vehicles import aircraft, car, ship
from strapdown.simulation.walking import GAITS, Gait, Stride, WalkingMotion, walk
from strapdown.simulation.waves import Wave
from strapdown.simulation.waypoints import through_waypoints

__all__ = [
    "CRASHES",
    "GAITS",
    "SCENARIOS",
    "Coning",
    "CrashMotion",
    "CrashScenario",
    "EarthMotion",
    "Gait",
    "Gesture",
    "Handling",
    "HaversinePulse",
    "ImuErrors",
    "Motion",
    "MountedMotion",
    "Origin",
    "PathMotion",
    "PointKinematics",
    "Pulse",
    "PulseMotion",
    "Ringing",
    "Scenario",
    "Sculling",
    "Setting",
    "SineVelocityMotion",
    "SmoothRandom",
    "SplineMotion",
    "StationaryMotion",
    "Stride",
    "Track",
    "TriadErrors",
    "WalkingMotion",
    "Wave",
    "aircraft",
    "car",
    "find_crash",
    "find_scenario",
    "gesture",
    "point_kinematics",
    "point_path",
    "rocking_stand",
    "ship",
    "simulate_imu",
    "through_waypoints",
    "walk",
]

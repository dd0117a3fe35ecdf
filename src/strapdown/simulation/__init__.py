"""Motions with exact truth, and the sensor data they would give."""

from strapdown.sensors.triad_errors import ImuErrors, TriadErrors
from strapdown.simulation.cameras import film, paper_cameras, path_from_cameras
from strapdown.simulation.coning import Coning
from strapdown.simulation.course import Manoeuvre
from strapdown.simulation.crash_course import CrashScenario, Setting
from strapdown.simulation.crash_motion import CrashMotion, HaversinePulse
from strapdown.simulation.crash_recording import record_crash
from strapdown.simulation.crash_scenarios import CRASHES, find_crash
from strapdown.simulation.earth_motion import EarthMotion, Origin
from strapdown.simulation.exact_answers import ExactAnswers
from strapdown.simulation.front_impacts import frontal_impact, oblique_impact, pole_impact
from strapdown.simulation.gesture import Gesture, gesture
from strapdown.simulation.gnss import GnssReceiver, simulate_gnss
from strapdown.simulation.handling import Handling
from strapdown.simulation.imu import (
    ACCEL_SEED,
    GYRO_SEED,
    sample_accelerometer,
    sample_gyro,
    simulate_imu,
)
from strapdown.simulation.manoeuvres import Accelerate, LaneChange, Stop, Straight, Turn
from strapdown.simulation.minimum_jerk import Track
from strapdown.simulation.motion import Motion, Pulse, PulseMotion
from strapdown.simulation.mounted_motion import MountedMotion
from strapdown.simulation.other_impacts import rear_impact, side_impact
from strapdown.simulation.paper_recorders import paper_units
from strapdown.simulation.path_motion import PathMotion, rocking_stand
from strapdown.simulation.recorder_design import RecorderDesign, RecorderTruth, TriadDesign
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
    "ACCEL_SEED",
    "CRASHES",
    "GAITS",
    "GYRO_SEED",
    "SCENARIOS",
    "Accelerate",
    "Coning",
    "CrashMotion",
    "CrashScenario",
    "EarthMotion",
    "ExactAnswers",
    "Gait",
    "Gesture",
    "GnssReceiver",
    "Handling",
    "HaversinePulse",
    "ImuErrors",
    "LaneChange",
    "Manoeuvre",
    "Motion",
    "MountedMotion",
    "Origin",
    "PathMotion",
    "PointKinematics",
    "Pulse",
    "PulseMotion",
    "RecorderDesign",
    "RecorderTruth",
    "Ringing",
    "Scenario",
    "Sculling",
    "Setting",
    "SineVelocityMotion",
    "SmoothRandom",
    "SplineMotion",
    "StationaryMotion",
    "Stop",
    "Straight",
    "Stride",
    "Track",
    "TriadDesign",
    "TriadErrors",
    "Turn",
    "WalkingMotion",
    "Wave",
    "aircraft",
    "car",
    "film",
    "find_crash",
    "find_scenario",
    "frontal_impact",
    "gesture",
    "oblique_impact",
    "paper_cameras",
    "paper_units",
    "path_from_cameras",
    "point_kinematics",
    "point_path",
    "pole_impact",
    "rear_impact",
    "record_crash",
    "rocking_stand",
    "sample_accelerometer",
    "sample_gyro",
    "ship",
    "side_impact",
    "simulate_gnss",
    "simulate_imu",
    "through_waypoints",
    "walk",
]

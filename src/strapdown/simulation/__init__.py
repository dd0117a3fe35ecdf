"""Motions with exact truth, and simulated sensor data for them."""

from strapdown.sensors.triad_errors import ImuErrors, TriadErrors
from strapdown.simulation.cameras import film, paper_cameras, path_from_cameras
from strapdown.simulation.coning import Coning, Sculling
from strapdown.simulation.crash_motion import CrashMotion, CrashScenario, HaversinePulse, Setting
from strapdown.simulation.crash_recording import record_crash
from strapdown.simulation.crash_scenarios import (
    CRASHES,
    find_crash,
    frontal_impact,
    oblique_impact,
    pole_impact,
    rear_impact,
    side_impact,
)
from strapdown.simulation.earth_motion import EarthMotion, Origin, StationaryMotion
from strapdown.simulation.exact_answers import ExactAnswers
from strapdown.simulation.gnss import GnssReceiver, simulate_gnss
from strapdown.simulation.hand_motions import Gesture, Handling, gesture
from strapdown.simulation.imu import (
    ACCEL_SEED,
    GYRO_SEED,
    sample_accelerometer,
    sample_gyro,
    simulate_imu,
)
from strapdown.simulation.minimum_jerk import Track
from strapdown.simulation.motion import Motion, Pulse, PulseMotion
from strapdown.simulation.mounted_motion import MountedMotion
from strapdown.simulation.path_motion import Manoeuvre, PathMotion, Wave, rocking_stand
from strapdown.simulation.recorder_design import (
    RecorderDesign,
    RecorderTruth,
    TriadDesign,
    paper_units,
)
from strapdown.simulation.ringing import Ringing
from strapdown.simulation.scenarios import SCENARIOS, Scenario, find_scenario
from strapdown.simulation.smooth_random import SmoothRandom
from strapdown.simulation.spline_motion import SineVelocityMotion, SplineMotion, through_waypoints
from strapdown.simulation.vehicle_points import PointKinematics, point_kinematics, point_path
from strapdown.simulation.vehicles import (
    Accelerate,
    LaneChange,
    Stop,
    Straight,
    Turn,
    aircraft,
    car,
    ship,
)
from strapdown.simulation.walking import GAITS, Gait, Stride, WalkingMotion, walk

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

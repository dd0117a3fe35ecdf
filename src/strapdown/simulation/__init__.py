"""Motions with exact truth, and simulated sensor data for them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from strapdown.lazy_names import load_on_first_use

if TYPE_CHECKING:
    from strapdown.sensors.triad_errors import ImuErrors as ImuErrors
    from strapdown.sensors.triad_errors import TriadErrors as TriadErrors
    from strapdown.simulation.attitude_motions import Coning as Coning
    from strapdown.simulation.attitude_motions import Gesture as Gesture
    from strapdown.simulation.attitude_motions import Handling as Handling
    from strapdown.simulation.attitude_motions import Sculling as Sculling
    from strapdown.simulation.attitude_motions import SmoothRandom as SmoothRandom
    from strapdown.simulation.attitude_motions import gesture as gesture
    from strapdown.simulation.cameras import film as film
    from strapdown.simulation.cameras import paper_cameras as paper_cameras
    from strapdown.simulation.cameras import path_from_cameras as path_from_cameras
    from strapdown.simulation.crash_motion import CRASHES as CRASHES
    from strapdown.simulation.crash_motion import CrashMotion as CrashMotion
    from strapdown.simulation.crash_motion import CrashScenario as CrashScenario
    from strapdown.simulation.crash_motion import HaversinePulse as HaversinePulse
    from strapdown.simulation.crash_motion import Setting as Setting
    from strapdown.simulation.crash_motion import crash_scenario as crash_scenario
    from strapdown.simulation.crash_motion import find_crash as find_crash
    from strapdown.simulation.crash_recording import RecorderDesign as RecorderDesign
    from strapdown.simulation.crash_recording import RecorderTruth as RecorderTruth
    from strapdown.simulation.crash_recording import TriadDesign as TriadDesign
    from strapdown.simulation.crash_recording import paper_units as paper_units
    from strapdown.simulation.crash_recording import record_crash as record_crash
    from strapdown.simulation.earth_motion import EarthMotion as EarthMotion
    from strapdown.simulation.earth_motion import Origin as Origin
    from strapdown.simulation.earth_motion import StationaryMotion as StationaryMotion
    from strapdown.simulation.gnss import GnssReceiver as GnssReceiver
    from strapdown.simulation.gnss import simulate_gnss as simulate_gnss
    from strapdown.simulation.imu import ACCEL_SEED as ACCEL_SEED
    from strapdown.simulation.imu import GYRO_SEED as GYRO_SEED
    from strapdown.simulation.imu import sample_accelerometer as sample_accelerometer
    from strapdown.simulation.imu import sample_gyro as sample_gyro
    from strapdown.simulation.imu import simulate_imu as simulate_imu
    from strapdown.simulation.motion import Motion as Motion
    from strapdown.simulation.motion import Pulse as Pulse
    from strapdown.simulation.motion import PulseMotion as PulseMotion
    from strapdown.simulation.motion import Track as Track
    from strapdown.simulation.mounted_motion import ExactAnswers as ExactAnswers
    from strapdown.simulation.mounted_motion import MountedMotion as MountedMotion
    from strapdown.simulation.mounted_motion import Ringing as Ringing
    from strapdown.simulation.mounted_motion import point_kinematics as point_kinematics
    from strapdown.simulation.mounted_motion import point_path as point_path
    from strapdown.simulation.path_motion import Manoeuvre as Manoeuvre
    from strapdown.simulation.path_motion import PathMotion as PathMotion
    from strapdown.simulation.path_motion import Wave as Wave
    from strapdown.simulation.scenarios import SCENARIOS as SCENARIOS
    from strapdown.simulation.scenarios import Scenario as Scenario
    from strapdown.simulation.scenarios import find_scenario as find_scenario
    from strapdown.simulation.spline_motion import SineVelocityMotion as SineVelocityMotion
    from strapdown.simulation.spline_motion import SplineMotion as SplineMotion
    from strapdown.simulation.spline_motion import through_waypoints as through_waypoints
    from strapdown.simulation.vehicles import Accelerate as Accelerate
    from strapdown.simulation.vehicles import LaneChange as LaneChange
    from strapdown.simulation.vehicles import Stop as Stop
    from strapdown.simulation.vehicles import Straight as Straight
    from strapdown.simulation.vehicles import Turn as Turn
    from strapdown.simulation.vehicles import aircraft as aircraft
    from strapdown.simulation.vehicles import car as car
    from strapdown.simulation.vehicles import ship as ship
    from strapdown.simulation.walking import GAITS as GAITS
    from strapdown.simulation.walking import Stride as Stride
    from strapdown.simulation.walking import WalkingMotion as WalkingMotion
    from strapdown.simulation.walking import walk as walk


load_on_first_use(
    __name__,
    {
        "attitude_motions": "Coning Gesture Handling Sculling SmoothRandom gesture",
        "cameras": "film paper_cameras path_from_cameras",
        "crash_motion": "CRASHES CrashMotion CrashScenario HaversinePulse Setting crash_scenario "
        "find_crash",
        "crash_recording": "RecorderDesign RecorderTruth TriadDesign paper_units record_crash",
        "earth_motion": "EarthMotion Origin StationaryMotion",
        "gnss": "GnssReceiver simulate_gnss",
        "imu": "ImuErrors TriadErrors ACCEL_SEED GYRO_SEED sample_accelerometer sample_gyro "
        "simulate_imu",
        "motion": "Motion Pulse PulseMotion Track",
        "mounted_motion": "ExactAnswers MountedMotion Ringing point_kinematics point_path",
        "path_motion": "Manoeuvre PathMotion Wave",
        "scenarios": "SCENARIOS Scenario find_scenario",
        "spline_motion": "SineVelocityMotion SplineMotion through_waypoints",
        "vehicles": "Accelerate LaneChange Stop Straight Turn aircraft car ship",
        "walking": "GAITS Stride WalkingMotion walk",
    },
)

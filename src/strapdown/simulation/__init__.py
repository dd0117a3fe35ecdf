"""Motions with exact truth, and simulated sensor data for them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from strapdown.lazy_names import load_on_first_use

if TYPE_CHECKING:
    from strapdown.sensors.triad_errors import ImuErrors, TriadErrors
    from strapdown.simulation.attitude_motions import (
        Coning,
        Gesture,
        Handling,
        Sculling,
        SmoothRandom,
        gesture,
    )
    from strapdown.simulation.cameras import film, paper_cameras, path_from_cameras
    from strapdown.simulation.crash_motion import (
        CRASHES,
        CrashMotion,
        CrashScenario,
        HaversinePulse,
        Setting,
        crash_scenario,
        find_crash,
    )
    from strapdown.simulation.crash_recording import (
        RecorderDesign,
        RecorderTruth,
        TriadDesign,
        paper_units,
        record_crash,
    )
    from strapdown.simulation.earth_motion import EarthMotion, Origin, StationaryMotion
    from strapdown.simulation.gnss import GnssReceiver, simulate_gnss
    from strapdown.simulation.imu import (
        ACCEL_SEED,
        GYRO_SEED,
        sample_accelerometer,
        sample_gyro,
        simulate_imu,
    )
    from strapdown.simulation.motion import Motion, Pulse, PulseMotion, Track
    from strapdown.simulation.mounted_motion import (
        ExactAnswers,
        MountedMotion,
        Ringing,
        point_kinematics,
        point_path,
    )
    from strapdown.simulation.path_motion import Manoeuvre, PathMotion, Wave
    from strapdown.simulation.scenarios import SCENARIOS, Scenario, find_scenario
    from strapdown.simulation.spline_motion import (
        SineVelocityMotion,
        SplineMotion,
        through_waypoints,
    )
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
    from strapdown.simulation.walking import GAITS, Stride, WalkingMotion, walk

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
    "crash_scenario",
    "film",
    "find_crash",
    "find_scenario",
    "gesture",
    "paper_cameras",
    "paper_units",
    "path_from_cameras",
    "point_kinematics",
    "point_path",
    "record_crash",
    "sample_accelerometer",
    "sample_gyro",
    "ship",
    "simulate_gnss",
    "simulate_imu",
    "through_waypoints",
    "walk",
]

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

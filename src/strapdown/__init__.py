"""strapdown: from an inertial sensor log to an answer that can be trusted.

Conventions, everywhere:

* body axes ``b``: x forward, y right, z down; local level ``n``: north, east, down;
* ``C_nb`` and ``q_nb`` turn a vector from body axes into local level, ``v_n = C_nb @ v_b``;
  quaternions are Hamilton's, scalar first;
* 3-2-1 Euler angles: heading 0-360 deg clockwise from north, pitch up to ±90 deg nose up,
  roll up to ±180 deg right side down;
* specific force ``f_b`` in m/s², about (0, 0, -9.8) at rest and level; rates in rad/s, of the
  body relative to inertial space; angles in degrees and everything else in SI at this surface,
  radians inside the kernels; time in seconds.

Samples in any form go in, and data comes out; only ``save`` and ``write_*`` write files::

    import strapdown as sd
    imu = sd.read_imu("drive.csv", axes="forward-left-up")
    run = sd.navigate(imu, [sd.Gnss(sd.read_gnss("fixes.pos"))], sensor="icm-42688-p")
    run.trajectory, run.sd, run.innovations["gnss.position"], run.findings
    run.save("out/")
    sd.compare_attitude(imu, rates_hz=[100, 50]).answer
    sd.reconstruct("case.toml").vehicles["1"].delta_v
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from strapdown.lazy_names import load_on_first_use

if TYPE_CHECKING:
    from strapdown.alignment.alignment import Site
    from strapdown.alignment.fine import FineAlignment
    from strapdown.api.alignment import AlignmentRun, OutageRun, align, outage
    from strapdown.api.allan import AllanRun, allan, compare_sensors, list_sensors
    from strapdown.api.attitude import (
        Attitude,
        AttitudeComparison,
        AttitudeOptions,
        MagnetometerCalibration,
        OrientationFilter,
        attitude,
        calibrate_magnetometer,
        compare_attitude,
    )
    from strapdown.api.calibrate import CalibrateRun, calibrate
    from strapdown.api.compare import RunComparison, compare_runs
    from strapdown.api.crash import CrashRun, reconstruct
    from strapdown.api.doctor import Diagnosis, doctor
    from strapdown.api.extrinsics import ExtrinsicsRun, extrinsics
    from strapdown.api.navigation import (
        Barometer,
        BodyVelocity,
        Gnss,
        Heading,
        Magnetometer,
        Measurement,
        NavigationRun,
        NonHolonomic,
        Odometer,
        ZeroAngularRate,
        ZeroVelocity,
        navigate,
    )
    from strapdown.api.reading import GnssFixes, Imu, Streams, read, read_gnss, read_imu
    from strapdown.api.simulation import Simulation, simulate
    from strapdown.api.writing import write
    from strapdown.bundle.signature import sign
    from strapdown.campaign.engine import Workers
    from strapdown.campaign.run import CampaignRun, run_campaign
    from strapdown.crash.entry import Entry
    from strapdown.crash.path import sample_paths
    from strapdown.crash.reconstruction import (
        CrashOptions,
        CrashReconstruction,
        reconstruct_crash,
    )
    from strapdown.earth import magnetic_field
    from strapdown.errors import ConfigError, DataError, DivergenceError, StrapdownError
    from strapdown.evaluation.trajectory_differences import (
        summarise_differences,
        trajectory_differences,
    )
    from strapdown.formats import read_log
    from strapdown.formats.crash_records import read_crash_record
    from strapdown.formats.nhtsa import read_nhtsa
    from strapdown.formats.trajectory_readers import read_trajectory
    from strapdown.formats.writers import write_trajectory
    from strapdown.increments import motion_increments
    from strapdown.mechanization import NavTracker, NorthEastDown, WanderAzimuth, run_mechanization
    from strapdown.nav_state import NavState
    from strapdown.report.sensors import SensorsRun
    from strapdown.report.verify import verify
    from strapdown.sensors.crash_unit import Assumed, CrashUnit, Mounting, RecordedTriad
    from strapdown.sensors.imu_health import check_imu_channels
    from strapdown.sensors.redundant_units import vote_units
    from strapdown.sensors.uncertainty import ImuUncertainty, TriadUncertainty

__version__ = "0.2.0.dev0"

__all__ = [
    "AlignmentRun",
    "AllanRun",
    "Assumed",
    "Attitude",
    "AttitudeComparison",
    "AttitudeOptions",
    "Barometer",
    "BodyVelocity",
    "CalibrateRun",
    "CampaignRun",
    "ConfigError",
    "CrashOptions",
    "CrashReconstruction",
    "CrashRun",
    "CrashUnit",
    "DataError",
    "Diagnosis",
    "DivergenceError",
    "Entry",
    "ExtrinsicsRun",
    "FineAlignment",
    "Gnss",
    "GnssFixes",
    "Heading",
    "Imu",
    "ImuUncertainty",
    "Magnetometer",
    "MagnetometerCalibration",
    "Measurement",
    "Mounting",
    "NavState",
    "NavTracker",
    "NavigationRun",
    "NonHolonomic",
    "NorthEastDown",
    "Odometer",
    "OrientationFilter",
    "OutageRun",
    "RecordedTriad",
    "RunComparison",
    "SensorsRun",
    "Simulation",
    "Site",
    "StrapdownError",
    "Streams",
    "TriadUncertainty",
    "WanderAzimuth",
    "Workers",
    "ZeroAngularRate",
    "ZeroVelocity",
    "__version__",
    "align",
    "allan",
    "attitude",
    "calibrate",
    "calibrate_magnetometer",
    "check_imu_channels",
    "compare_attitude",
    "compare_runs",
    "compare_sensors",
    "doctor",
    "extrinsics",
    "list_sensors",
    "magnetic_field",
    "motion_increments",
    "navigate",
    "outage",
    "read",
    "read_crash_record",
    "read_gnss",
    "read_imu",
    "read_log",
    "read_nhtsa",
    "read_trajectory",
    "reconstruct",
    "reconstruct_crash",
    "run_campaign",
    "run_mechanization",
    "sample_paths",
    "sign",
    "simulate",
    "summarise_differences",
    "trajectory_differences",
    "verify",
    "vote_units",
    "write",
    "write_trajectory",
]

# numba alone takes longer to import than most commands take to run.
load_on_first_use(
    __name__,
    {
        "alignment.alignment": "Site",
        "alignment.fine": "FineAlignment",
        "api.alignment": "AlignmentRun OutageRun align outage",
        "api.allan": "AllanRun allan compare_sensors list_sensors",
        "report.sensors": "SensorsRun",
        "api.calibrate": "CalibrateRun calibrate",
        "api.attitude": "Attitude AttitudeComparison AttitudeOptions MagnetometerCalibration "
        "OrientationFilter attitude calibrate_magnetometer compare_attitude",
        "api.compare": "RunComparison compare_runs",
        "api.crash": "CrashRun reconstruct",
        "api.doctor": "Diagnosis doctor",
        "api.extrinsics": "ExtrinsicsRun extrinsics",
        "api.navigation": "Barometer BodyVelocity Gnss Heading Magnetometer Measurement "
        "NavigationRun NonHolonomic Odometer ZeroAngularRate ZeroVelocity navigate",
        "api.reading": "GnssFixes Imu Streams read read_gnss read_imu",
        "api.simulation": "Simulation simulate",
        "api.writing": "write",
        "campaign.engine": "Workers",
        "campaign.run": "CampaignRun run_campaign",
        "crash.entry": "Entry",
        "bundle.signature": "sign",
        "crash.path": "sample_paths",
        "crash.reconstruction": "CrashOptions CrashReconstruction reconstruct_crash",
        "earth": "magnetic_field",
        "errors": "ConfigError DataError DivergenceError StrapdownError",
        "evaluation.trajectory_differences": "trajectory_differences summarise_differences",
        "formats": "read_log",
        "formats.crash_records": "read_crash_record",
        "formats.nhtsa": "read_nhtsa",
        "formats.trajectory_readers": "read_trajectory",
        "formats.writers": "write_trajectory",
        "increments": "motion_increments",
        "mechanization": "NavTracker NorthEastDown WanderAzimuth run_mechanization",
        "nav_state": "NavState",
        "report.verify": "verify",
        "sensors.crash_unit": "Assumed CrashUnit Mounting RecordedTriad",
        "sensors.imu_health": "check_imu_channels",
        "sensors.redundant_units": "vote_units",
        "sensors.uncertainty": "ImuUncertainty TriadUncertainty",
    },
)

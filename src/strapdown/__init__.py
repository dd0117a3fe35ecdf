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
    from strapdown.alignment.alignment import Site as Site
    from strapdown.alignment.fine import FineAlignment as FineAlignment
    from strapdown.api.alignment import AlignmentRun as AlignmentRun
    from strapdown.api.alignment import OutageRun as OutageRun
    from strapdown.api.alignment import align as align
    from strapdown.api.alignment import outage as outage
    from strapdown.api.allan import AllanRun as AllanRun
    from strapdown.api.allan import allan as allan
    from strapdown.api.allan import compare_sensors as compare_sensors
    from strapdown.api.allan import list_sensors as list_sensors
    from strapdown.api.attitude import Attitude as Attitude
    from strapdown.api.attitude import AttitudeComparison as AttitudeComparison
    from strapdown.api.attitude import AttitudeOptions as AttitudeOptions
    from strapdown.api.attitude import MagnetometerCalibration as MagnetometerCalibration
    from strapdown.api.attitude import OrientationFilter as OrientationFilter
    from strapdown.api.attitude import attitude as attitude
    from strapdown.api.attitude import calibrate_magnetometer as calibrate_magnetometer
    from strapdown.api.attitude import compare_attitude as compare_attitude
    from strapdown.api.calibrate import CalibrateRun as CalibrateRun
    from strapdown.api.calibrate import calibrate as calibrate
    from strapdown.api.compare import RunComparison as RunComparison
    from strapdown.api.compare import compare_runs as compare_runs
    from strapdown.api.crash import CrashRun as CrashRun
    from strapdown.api.crash import reconstruct as reconstruct
    from strapdown.api.doctor import Diagnosis as Diagnosis
    from strapdown.api.doctor import doctor as doctor
    from strapdown.api.extrinsics import ExtrinsicsRun as ExtrinsicsRun
    from strapdown.api.extrinsics import extrinsics as extrinsics
    from strapdown.api.navigation import Barometer as Barometer
    from strapdown.api.navigation import BodyVelocity as BodyVelocity
    from strapdown.api.navigation import Gnss as Gnss
    from strapdown.api.navigation import Heading as Heading
    from strapdown.api.navigation import Magnetometer as Magnetometer
    from strapdown.api.navigation import Measurement as Measurement
    from strapdown.api.navigation import NavigationRun as NavigationRun
    from strapdown.api.navigation import NonHolonomic as NonHolonomic
    from strapdown.api.navigation import Odometer as Odometer
    from strapdown.api.navigation import ZeroAngularRate as ZeroAngularRate
    from strapdown.api.navigation import ZeroVelocity as ZeroVelocity
    from strapdown.api.navigation import navigate as navigate
    from strapdown.api.reading import GnssFixes as GnssFixes
    from strapdown.api.reading import Imu as Imu
    from strapdown.api.reading import Streams as Streams
    from strapdown.api.reading import read as read
    from strapdown.api.reading import read_gnss as read_gnss
    from strapdown.api.reading import read_imu as read_imu
    from strapdown.api.simulation import Simulation as Simulation
    from strapdown.api.simulation import simulate as simulate
    from strapdown.api.writing import write as write
    from strapdown.bundle.signature import sign as sign
    from strapdown.campaign.engine import Workers as Workers
    from strapdown.campaign.run import CampaignRun as CampaignRun
    from strapdown.campaign.run import run_campaign as run_campaign
    from strapdown.crash.entry import Entry as Entry
    from strapdown.crash.path import sample_paths as sample_paths
    from strapdown.crash.reconstruction import CrashOptions as CrashOptions
    from strapdown.crash.reconstruction import CrashReconstruction as CrashReconstruction
    from strapdown.crash.reconstruction import reconstruct_crash as reconstruct_crash
    from strapdown.earth import magnetic_field as magnetic_field
    from strapdown.errors import ConfigError as ConfigError
    from strapdown.errors import DataError as DataError
    from strapdown.errors import DivergenceError as DivergenceError
    from strapdown.errors import StrapdownError as StrapdownError
    from strapdown.evaluation.trajectory_differences import (
        summarise_differences as summarise_differences,
    )
    from strapdown.evaluation.trajectory_differences import (
        trajectory_differences as trajectory_differences,
    )
    from strapdown.formats import read_log as read_log
    from strapdown.formats.crash_records import read_crash_record as read_crash_record
    from strapdown.formats.nhtsa import read_nhtsa as read_nhtsa
    from strapdown.formats.trajectory_readers import read_trajectory as read_trajectory
    from strapdown.formats.writers import write_trajectory as write_trajectory
    from strapdown.increments import motion_increments as motion_increments
    from strapdown.mechanization import NavTracker as NavTracker
    from strapdown.mechanization import NorthEastDown as NorthEastDown
    from strapdown.mechanization import WanderAzimuth as WanderAzimuth
    from strapdown.mechanization import run_mechanization as run_mechanization
    from strapdown.nav_state import NavState as NavState
    from strapdown.report.sensors import SensorsRun as SensorsRun
    from strapdown.report.verify import verify as verify
    from strapdown.sensors.crash_unit import Assumed as Assumed
    from strapdown.sensors.crash_unit import CrashUnit as CrashUnit
    from strapdown.sensors.crash_unit import Mounting as Mounting
    from strapdown.sensors.crash_unit import RecordedTriad as RecordedTriad
    from strapdown.sensors.imu_health import check_imu_channels as check_imu_channels
    from strapdown.sensors.redundant_units import vote_units as vote_units
    from strapdown.sensors.uncertainty import ImuUncertainty as ImuUncertainty
    from strapdown.sensors.uncertainty import TriadUncertainty as TriadUncertainty

__version__ = "0.2.0.dev0"

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

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
    from strapdown.api.alignment import AlignmentRun, OutageRun, align, coast
    from strapdown.api.attitude import (
        Attitude,
        AttitudeComparison,
        AttitudeOptions,
        OrientationFilter,
        attitude,
        compare_attitude,
    )
    from strapdown.api.crash import CrashRun, reconstruct
    from strapdown.api.navigation import (
        Barometer,
        BodyVelocity,
        Gnss,
        Heading,
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
    from strapdown.crash.entry import Entry
    from strapdown.crash.path import sample_paths
    from strapdown.crash.reconstruction import (
        CrashOptions,
        CrashReconstruction,
        reconstruct_crash,
    )
    from strapdown.evaluation.trajectory_differences import (
        summarise_differences,
        trajectory_differences,
    )
    from strapdown.formats import read_log
    from strapdown.formats.crash_records import read_crash_record
    from strapdown.formats.nhtsa import read_nhtsa
    from strapdown.formats.trajectory_readers import read_trajectory
    from strapdown.formats.trajectory_writers import write_trajectory
    from strapdown.increments import motion_increments
    from strapdown.mechanization import NavTracker, NorthEastDown, WanderAzimuth, run_mechanization
    from strapdown.nav_state import NavState
    from strapdown.report.verify import verify
    from strapdown.sensors.crash_unit import Assumed, CrashUnit, Mounting, RecordedTriad
    from strapdown.sensors.imu_health import check_imu_channels
    from strapdown.sensors.redundant_units import vote_units
    from strapdown.sensors.uncertainty import ImuUncertainty, TriadUncertainty

__version__ = "0.2.0.dev0"

__all__ = [
    "AlignmentRun",
    "Assumed",
    "Attitude",
    "AttitudeComparison",
    "AttitudeOptions",
    "Barometer",
    "BodyVelocity",
    "CrashOptions",
    "CrashReconstruction",
    "CrashRun",
    "CrashUnit",
    "Entry",
    "FineAlignment",
    "Gnss",
    "GnssFixes",
    "Heading",
    "Imu",
    "ImuUncertainty",
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
    "Simulation",
    "Site",
    "Streams",
    "TriadUncertainty",
    "WanderAzimuth",
    "ZeroAngularRate",
    "ZeroVelocity",
    "__version__",
    "align",
    "attitude",
    "check_imu_channels",
    "coast",
    "compare_attitude",
    "motion_increments",
    "navigate",
    "read",
    "read_crash_record",
    "read_gnss",
    "read_imu",
    "read_log",
    "read_nhtsa",
    "read_trajectory",
    "reconstruct",
    "reconstruct_crash",
    "run_mechanization",
    "sample_paths",
    "simulate",
    "summarise_differences",
    "trajectory_differences",
    "verify",
    "vote_units",
    "write_trajectory",
]

# Loaded on first use: numba alone takes longer to import than most commands take to run.
_HOMES = {
    "FineAlignment": "strapdown.alignment.fine",
    "Site": "strapdown.alignment.alignment",
    "AlignmentRun": "strapdown.api.alignment",
    "OutageRun": "strapdown.api.alignment",
    "align": "strapdown.api.alignment",
    "coast": "strapdown.api.alignment",
    "Attitude": "strapdown.api.attitude",
    "AttitudeComparison": "strapdown.api.attitude",
    "AttitudeOptions": "strapdown.api.attitude",
    "OrientationFilter": "strapdown.api.attitude",
    "attitude": "strapdown.api.attitude",
    "compare_attitude": "strapdown.api.attitude",
    "CrashRun": "strapdown.api.crash",
    "reconstruct": "strapdown.api.crash",
    "Barometer": "strapdown.api.navigation",
    "BodyVelocity": "strapdown.api.navigation",
    "Gnss": "strapdown.api.navigation",
    "Heading": "strapdown.api.navigation",
    "Measurement": "strapdown.api.navigation",
    "NavigationRun": "strapdown.api.navigation",
    "NonHolonomic": "strapdown.api.navigation",
    "Odometer": "strapdown.api.navigation",
    "ZeroAngularRate": "strapdown.api.navigation",
    "ZeroVelocity": "strapdown.api.navigation",
    "navigate": "strapdown.api.navigation",
    "GnssFixes": "strapdown.api.reading",
    "Imu": "strapdown.api.reading",
    "Streams": "strapdown.api.reading",
    "read": "strapdown.api.reading",
    "read_gnss": "strapdown.api.reading",
    "read_imu": "strapdown.api.reading",
    "CrashOptions": "strapdown.crash.reconstruction",
    "CrashReconstruction": "strapdown.crash.reconstruction",
    "Simulation": "strapdown.api.simulation",
    "simulate": "strapdown.api.simulation",
    "Entry": "strapdown.crash.entry",
    "sample_paths": "strapdown.crash.path",
    "trajectory_differences": "strapdown.evaluation.trajectory_differences",
    "summarise_differences": "strapdown.evaluation.trajectory_differences",
    "read_log": "strapdown.formats",
    "read_crash_record": "strapdown.formats.crash_records",
    "read_nhtsa": "strapdown.formats.nhtsa",
    "read_trajectory": "strapdown.formats.trajectory_readers",
    "write_trajectory": "strapdown.formats.trajectory_writers",
    "motion_increments": "strapdown.increments",
    "NavTracker": "strapdown.mechanization",
    "NorthEastDown": "strapdown.mechanization",
    "WanderAzimuth": "strapdown.mechanization",
    "run_mechanization": "strapdown.mechanization",
    "NavState": "strapdown.nav_state",
    "verify": "strapdown.report.verify",
    "Assumed": "strapdown.sensors.crash_unit",
    "CrashUnit": "strapdown.sensors.crash_unit",
    "Mounting": "strapdown.sensors.crash_unit",
    "RecordedTriad": "strapdown.sensors.crash_unit",
    "check_imu_channels": "strapdown.sensors.imu_health",
    "ImuUncertainty": "strapdown.sensors.uncertainty",
    "vote_units": "strapdown.sensors.redundant_units",
    "TriadUncertainty": "strapdown.sensors.uncertainty",
    "reconstruct_crash": "strapdown.crash.reconstruction",
}


def __getattr__(name: str) -> Any:
    if name in _HOMES:
        from importlib import import_module

        return getattr(import_module(_HOMES[name]), name)
    raise AttributeError(f"module 'strapdown' has no attribute '{name}'")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})

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

Three lines that answer a question::

    import strapdown
    bench = strapdown.bench_attitude("alexiev-fig4", rate=100)
    print(bench.summary)

And of a crash, from the records of its units (see the page "Crash" of the manual)::

    crash = strapdown.reconstruct_crash(units, strapdown.Entry.from_speed(14.0, 0.3))
    print(crash.summary())
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from strapdown.alignment.fine import FineAlignment
    from strapdown.alignment.site import Site
    from strapdown.crash.entry import Entry
    from strapdown.crash.monte_carlo import sample_paths
    from strapdown.evaluation.trajectory_differences import trajectory_differences
    from strapdown.evaluation.trajectory_summary import summarise_differences
    from strapdown.formats import read_log
    from strapdown.formats.crash_records import read_crash_record
    from strapdown.formats.nhtsa import read_nhtsa
    from strapdown.formats.trajectory_readers import read_trajectory
    from strapdown.formats.trajectory_writers import write_trajectory
    from strapdown.increments import motion_increments
    from strapdown.mechanization import (
        NavTracker,
        NorthEastDown,
        WanderAzimuth,
        run_mechanization,
    )
    from strapdown.nav_state import NavState
    from strapdown.report.alignment import align
    from strapdown.report.attitude import write_attitude
    from strapdown.report.coast import coast
    from strapdown.report.crash_case import reconstruct_case
    from strapdown.report.navigation import navigate
    from strapdown.report.simulation import simulate
    from strapdown.report.verify import verify
    from strapdown.sensors.assumed import Assumed
    from strapdown.sensors.crash_unit import CrashUnit, Mounting, RecordedTriad
    from strapdown.sensors.imu_health import check_imu_channels
    from strapdown.sensors.imu_uncertainty import ImuUncertainty
    from strapdown.sensors.redundant_units import vote_units
    from strapdown.sensors.triad_uncertainty import TriadUncertainty
    from strapdown.systems.attitude_bench import bench_attitude
    from strapdown.systems.crash_reconstruction import CrashReconstruction, reconstruct_crash

__version__ = "0.1.0"

__all__ = [
    "Assumed",
    "CrashReconstruction",
    "CrashUnit",
    "Entry",
    "FineAlignment",
    "ImuUncertainty",
    "Mounting",
    "NavState",
    "NavTracker",
    "NorthEastDown",
    "RecordedTriad",
    "Site",
    "TriadUncertainty",
    "WanderAzimuth",
    "__version__",
    "align",
    "bench_attitude",
    "check_imu_channels",
    "coast",
    "motion_increments",
    "navigate",
    "read_crash_record",
    "read_log",
    "read_nhtsa",
    "read_trajectory",
    "reconstruct_case",
    "reconstruct_crash",
    "run_mechanization",
    "sample_paths",
    "simulate",
    "summarise_differences",
    "trajectory_differences",
    "verify",
    "vote_units",
    "write_attitude",
    "write_trajectory",
]

# Loaded on first use: numba alone takes longer to import than most commands take to run.
_HOMES = {
    "vote_units": "strapdown.sensors.redundant_units",
    "ImuUncertainty": "strapdown.sensors.imu_uncertainty",
    "check_imu_channels": "strapdown.sensors.imu_health",
    "align": "strapdown.report.alignment",
    "WanderAzimuth": "strapdown.mechanization",
    "Site": "strapdown.alignment.site",
    "FineAlignment": "strapdown.alignment.fine",
    "Assumed": "strapdown.sensors.assumed",
    "CrashReconstruction": "strapdown.systems.crash_reconstruction",
    "CrashUnit": "strapdown.sensors.crash_unit",
    "Entry": "strapdown.crash.entry",
    "Mounting": "strapdown.sensors.crash_unit",
    "NavState": "strapdown.nav_state",
    "NavTracker": "strapdown.mechanization",
    "NorthEastDown": "strapdown.mechanization",
    "RecordedTriad": "strapdown.sensors.crash_unit",
    "TriadUncertainty": "strapdown.sensors.triad_uncertainty",
    "bench_attitude": "strapdown.systems.attitude_bench",
    "coast": "strapdown.report.coast",
    "motion_increments": "strapdown.increments",
    "navigate": "strapdown.report.navigation",
    "read_log": "strapdown.formats",
    "read_crash_record": "strapdown.formats.crash_records",
    "read_nhtsa": "strapdown.formats.nhtsa",
    "read_trajectory": "strapdown.formats.trajectory_readers",
    "reconstruct_case": "strapdown.report.crash_case",
    "reconstruct_crash": "strapdown.systems.crash_reconstruction",
    "run_mechanization": "strapdown.mechanization",
    "sample_paths": "strapdown.crash.monte_carlo",
    "simulate": "strapdown.report.simulation",
    "summarise_differences": "strapdown.evaluation.trajectory_summary",
    "trajectory_differences": "strapdown.evaluation.trajectory_differences",
    "verify": "strapdown.report.verify",
    "write_attitude": "strapdown.report.attitude",
    "write_trajectory": "strapdown.formats.trajectory_writers",
}


def __getattr__(name: str) -> Any:
    if name in _HOMES:
        from importlib import import_module

        return getattr(import_module(_HOMES[name]), name)
    raise AttributeError(f"module 'strapdown' has no attribute '{name}'")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})

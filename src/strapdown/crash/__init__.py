"""Crash reconstruction: events, delta-V, direction of force, severity, path, and their bounds."""

from __future__ import annotations

from typing import TYPE_CHECKING

from strapdown.lazy_names import load_on_first_use

if TYPE_CHECKING:
    from strapdown.crash.acceleration import Acceleration as Acceleration
    from strapdown.crash.closure import Blame as Blame
    from strapdown.crash.closure import Closure as Closure
    from strapdown.crash.closure import Figure as Figure
    from strapdown.crash.closure import Hypothesis as Hypothesis
    from strapdown.crash.closure import ImpactVehicle as ImpactVehicle
    from strapdown.crash.closure import against_barrier as against_barrier
    from strapdown.crash.closure import blame as blame
    from strapdown.crash.closure import blame_points as blame_points
    from strapdown.crash.closure import close_vehicles as close_vehicles
    from strapdown.crash.deformation import Crush as Crush
    from strapdown.crash.deformation import crush_energy as crush_energy
    from strapdown.crash.deformation import dynamic_crush as dynamic_crush
    from strapdown.crash.deformation import energy_equivalent_speed as energy_equivalent_speed
    from strapdown.crash.deformation import energy_share as energy_share
    from strapdown.crash.deformation import equal_force_share as equal_force_share
    from strapdown.crash.deformation import impulse_of as impulse_of
    from strapdown.crash.delta_v import delta_v as delta_v
    from strapdown.crash.delta_v import trailing_delta_v as trailing_delta_v
    from strapdown.crash.delta_v_bound import EventChanges as EventChanges
    from strapdown.crash.delta_v_bound import VelocityChange as VelocityChange
    from strapdown.crash.delta_v_bound import body_delta_v_bound as body_delta_v_bound
    from strapdown.crash.delta_v_bound import resolved_delta_v_bound as resolved_delta_v_bound
    from strapdown.crash.delta_v_bound import velocity_change as velocity_change
    from strapdown.crash.drive_entry import DriveEntry as DriveEntry
    from strapdown.crash.entry import Entry as Entry
    from strapdown.crash.entry_estimate import FixCorrelation as FixCorrelation
    from strapdown.crash.events import detect_events as detect_events
    from strapdown.crash.measuring_point import at_point as at_point
    from strapdown.crash.path import PathComparison as PathComparison
    from strapdown.crash.path import compare_with_reference as compare_with_reference
    from strapdown.crash.path import sample_paths as sample_paths
    from strapdown.crash.pdof import NedPdof as NedPdof
    from strapdown.crash.pdof import Pdof as Pdof
    from strapdown.crash.pdof import ned_pdof as ned_pdof
    from strapdown.crash.pdof import pdof as pdof
    from strapdown.crash.preparation import Preparation as Preparation
    from strapdown.crash.preparation import prepare_unit as prepare_unit
    from strapdown.crash.reconstruction import CrashOptions as CrashOptions
    from strapdown.crash.reconstruction import UnitReconstruction as UnitReconstruction
    from strapdown.crash.reconstruction import reconstruct_unit as reconstruct_unit


load_on_first_use(
    __name__,
    {
        "acceleration": "Acceleration",
        "closure": "Blame Closure Figure Hypothesis ImpactVehicle against_barrier blame "
        "blame_points close_vehicles",
        "deformation": "Crush crush_energy dynamic_crush energy_equivalent_speed energy_share "
        "equal_force_share impulse_of",
        "delta_v": "delta_v trailing_delta_v",
        "delta_v_bound": "EventChanges VelocityChange body_delta_v_bound "
        "resolved_delta_v_bound velocity_change",
        "entry": "Entry",
        "entry_estimate": "FixCorrelation",
        "events": "detect_events",
        "drive_entry": "DriveEntry",
        "measuring_point": "at_point",
        "path": "PathComparison compare_with_reference sample_paths",
        "pdof": "NedPdof Pdof ned_pdof pdof",
        "preparation": "Preparation prepare_unit",
        "reconstruction": "CrashOptions UnitReconstruction reconstruct_unit",
    },
)

"""Crash reconstruction: events, delta-V, direction of force, severity, path, and their bounds."""

from __future__ import annotations

from typing import TYPE_CHECKING

from strapdown.lazy_names import load_on_first_use

if TYPE_CHECKING:
    from strapdown.crash.acceleration import Acceleration
    from strapdown.crash.closure import (
        Blame,
        Closure,
        Figure,
        Hypothesis,
        ImpactVehicle,
        against_barrier,
        blame,
        blame_points,
        close_vehicles,
    )
    from strapdown.crash.deformation import (
        Crush,
        crush_energy,
        dynamic_crush,
        energy_equivalent_speed,
        energy_share,
        equal_force_share,
        impulse_of,
    )
    from strapdown.crash.delta_v import delta_v, trailing_delta_v
    from strapdown.crash.delta_v_bound import (
        EventChanges,
        VelocityChange,
        body_delta_v_bound,
        resolved_delta_v_bound,
        velocity_change,
    )
    from strapdown.crash.drive_entry import DriveEntry
    from strapdown.crash.entry import Entry
    from strapdown.crash.entry_estimate import FixCorrelation
    from strapdown.crash.events import detect_events
    from strapdown.crash.measuring_point import at_point
    from strapdown.crash.path import PathComparison, compare_with_reference, sample_paths
    from strapdown.crash.pdof import NedPdof, Pdof, ned_pdof, pdof
    from strapdown.crash.preparation import Preparation, prepare_unit
    from strapdown.crash.reconstruction import CrashOptions, UnitReconstruction, reconstruct_unit

__all__ = [
    "Acceleration",
    "Blame",
    "Closure",
    "CrashOptions",
    "Crush",
    "DriveEntry",
    "Entry",
    "EventChanges",
    "Figure",
    "FixCorrelation",
    "Hypothesis",
    "ImpactVehicle",
    "NedPdof",
    "PathComparison",
    "Pdof",
    "Preparation",
    "UnitReconstruction",
    "VelocityChange",
    "against_barrier",
    "at_point",
    "blame",
    "blame_points",
    "body_delta_v_bound",
    "close_vehicles",
    "compare_with_reference",
    "crush_energy",
    "delta_v",
    "detect_events",
    "dynamic_crush",
    "energy_equivalent_speed",
    "energy_share",
    "equal_force_share",
    "impulse_of",
    "ned_pdof",
    "pdof",
    "prepare_unit",
    "reconstruct_unit",
    "resolved_delta_v_bound",
    "sample_paths",
    "trailing_delta_v",
    "velocity_change",
]

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

"""Frozen specifications of runs: stored with every result, so that it can be run again."""

from __future__ import annotations

from typing import TYPE_CHECKING

from strapdown.lazy_names import load_on_first_use

if TYPE_CHECKING:
    from strapdown.config.crash_case import CaseSpec
    from strapdown.config.motions import TrajectorySpec
    from strapdown.config.sources import (
        CrashSimulationSpec,
        LogSpec,
        ScenarioSpec,
        SimulateSpec,
    )
    from strapdown.config.spec import specify

__all__ = [
    "CaseSpec",
    "CrashSimulationSpec",
    "LogSpec",
    "ScenarioSpec",
    "SimulateSpec",
    "TrajectorySpec",
    "specify",
]

load_on_first_use(
    __name__,
    {
        "crash_case": "CaseSpec",
        "motions": "TrajectorySpec",
        "sources": "CrashSimulationSpec LogSpec ScenarioSpec SimulateSpec",
        "spec": "specify",
    },
)

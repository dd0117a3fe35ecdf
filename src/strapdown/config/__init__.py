"""Frozen specifications of runs: stored with every result, so that it can be run again."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

from pydantic import Field, FiniteFloat

from strapdown.config.spec import Spec, specify
from strapdown.lazy_names import load_on_first_use

if TYPE_CHECKING:
    from strapdown.config.crash_case import CaseSpec
    from strapdown.config.crash_case_file import read_case_spec
    from strapdown.config.crash_simulation import CrashSimulationSpec
    from strapdown.config.trajectory import TrajectorySpec, read_trajectory_spec

__all__ = [
    "CaseSpec",
    "CrashSimulationSpec",
    "LogSpec",
    "ScenarioSpec",
    "SimulateSpec",
    "TrajectorySpec",
    "read_case_spec",
    "read_trajectory_spec",
    "specify",
]

load_on_first_use(
    __name__,
    {
        "crash_case": "CaseSpec",
        "crash_case_file": "read_case_spec",
        "crash_simulation": "CrashSimulationSpec",
        "trajectory": "TrajectorySpec read_trajectory_spec",
    },
)


class ScenarioSpec(Spec):
    """A simulated log; `sensor` replaces the scenario's own errors."""

    kind: Literal["scenario"] = "scenario"
    name: str
    rate_hz: FiniteFloat = 100.0
    sampling: str = "instantaneous"
    seed: int = Field(default=0, ge=0)
    sensor: str | None = None


class LogSpec(Spec):
    """A recorded log and how to read it; None means as stated in the log."""

    kind: Literal["log"] = "log"
    path: str
    columns: dict[str, str] = Field(default_factory=dict)
    gyro_unit: str | None = None
    accel_unit: str | None = None
    time_unit: str | None = None
    axes: str | None = None
    sampling: str | None = None
    rate_hz: FiniteFloat | None = None
    repair: bool = False


class SimulateSpec(Spec):
    """One run of the simulator."""

    scenario: ScenarioSpec
    formats: tuple[str, ...] = ("csv",)

"""Specifications of a log or a simulated one, and of a run of the simulator."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

from pydantic import Field, FiniteFloat

from strapdown.config.spec import Spec
from strapdown.formats.recording import ReadOptions

if TYPE_CHECKING:
    from strapdown.config.alignment import LogTable

__all__ = ["CrashSimulationSpec", "LogSpec", "ScenarioSpec", "SimulateSpec", "read_options"]


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
    format: str | None = None
    columns: dict[str, str] = Field(default_factory=dict)
    gyro_unit: str | None = None
    accel_unit: str | None = None
    time_unit: str | None = None
    axes: str | None = None
    sampling: str | None = None
    rate_hz: FiniteFloat | None = None
    repair: bool = False


def read_options(log: LogSpec | LogTable, axes: str | None) -> ReadOptions:
    """Return the options with which the file of a log is read, its axes as letters."""
    return ReadOptions(
        format=log.format,
        columns=dict(log.columns),
        gyro_unit=log.gyro_unit,
        accel_unit=log.accel_unit,
        time_unit=log.time_unit,
        axes=axes,
        sampling=log.sampling,
        rate=log.rate_hz,
        repair=log.repair,
    )


class SimulateSpec(Spec):
    """One run of the simulator."""

    scenario: ScenarioSpec
    formats: tuple[str, ...] = ("csv",)


class CrashSimulationSpec(Spec):
    """One crash and its recorders; without a rate each recorder uses its own."""

    name: str
    units: tuple[str, ...] = ()
    rate_hz: FiniteFloat | None = Field(default=None, gt=0.0)
    sampling: Literal["instantaneous", "mean"] = "instantaneous"
    seed: int = Field(default=0, ge=0)
    formats: tuple[str, ...] = ("csv",)

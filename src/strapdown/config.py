"""What was asked for, as frozen specifications: sealed with every result, and run again from."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

__all__ = ["AttitudeSpec", "LogSpec", "ScenarioSpec", "SimulateSpec"]


class Spec(BaseModel):
    """Frozen, and strict about names."""

    model_config = ConfigDict(frozen=True, extra="forbid")


class ScenarioSpec(Spec):
    """A simulated log."""

    kind: Literal["scenario"] = "scenario"
    name: str
    rate_hz: float = 100.0
    sampling: str = "instantaneous"
    seed: int = 0


class LogSpec(Spec):
    """A recorded log and how to read it; None is left to the log itself."""

    kind: Literal["log"] = "log"
    path: str
    columns: dict[str, str] = Field(default_factory=dict)
    gyro_unit: str | None = None
    accel_unit: str | None = None
    time_unit: str | None = None
    axes: str | None = None
    sampling: str | None = None
    rate_hz: float | None = None
    repair: bool = False


class AttitudeSpec(Spec):
    """One run of the attitude bench."""

    source: Annotated[ScenarioSpec | LogSpec, Field(discriminator="kind")]
    algorithms: tuple[str, ...] = ("naive", "euler", "dcm", "quaternion")
    initial: str = "auto"
    gyro_bias: str = "none"
    references: tuple[str, ...] = ()
    truth_path: str | None = None
    gyro_bias_path: str | None = None
    from_s: float | None = None
    to_s: float | None = None


class SimulateSpec(Spec):
    """One run of the simulator."""

    scenario: ScenarioSpec
    formats: tuple[str, ...] = ("csv",)

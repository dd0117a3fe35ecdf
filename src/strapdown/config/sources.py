"""Specifications of a log or a simulated one, and of a run of the simulator."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, FiniteFloat, StrictInt

from strapdown.config.reading import FileSpec
from strapdown.config.spec import Later, Positive, Spec, Triple
from strapdown.config.toml_file import read_toml


class GyroErrorsSpec(Spec):
    """Errors of the gyros of a scenario, for each axis."""

    noise_density_deg_per_s_per_sqrt_hz: Triple = (0.0, 0.0, 0.0)
    bias_deg_per_s: Triple = (0.0, 0.0, 0.0)
    trend_deg_per_s2: Triple = (0.0, 0.0, 0.0)


class AccelErrorsSpec(Spec):
    """Errors of the accelerometers of a scenario, for each axis."""

    noise_density_ug_per_sqrt_hz: Triple = (0.0, 0.0, 0.0)
    bias_m_per_s2: Triple = (0.0, 0.0, 0.0)


class ScenarioFile(FileSpec):
    """A scenario of rotation in a file."""

    called = "scenario"

    name: str = "scenario"
    title: str = ""
    rate_hz: Positive = 100.0
    sampling: str = "instantaneous"
    seed: StrictInt = Field(default=0, ge=0)
    sensor: str | None = None
    references: tuple[str, ...] = ()
    #: Of pulses; within a campaign on the Earth as well, with its turning.
    motion: Annotated[Any, BeforeValidator(Later("strapdown.config.motions", "ScenarioMotion"))]
    gyro: GyroErrorsSpec = Field(default_factory=GyroErrorsSpec)
    accel: AccelErrorsSpec = Field(default_factory=AccelErrorsSpec)


def is_scenario_file(path: Path) -> bool:
    """Whether a TOML file has a scenario of rotation; else it has a trajectory, or is refused."""
    motion = read_toml(path).table.get("motion")
    return isinstance(motion, dict) and motion.get("kind") == "pulses"


class ScenarioSpec(Spec):
    """A simulated log; `sensor` replaces the scenario's own errors."""

    kind: Literal["scenario"] = "scenario"
    name: str
    #: The scenario itself, where it is from a file.
    own: ScenarioFile | None = None
    rate_hz: FiniteFloat = 100.0
    sampling: str = "instantaneous"
    seed: int = Field(default=0, ge=0)
    sensor: str | None = None

    @classmethod
    def of_file(
        cls,
        path: Path,
        rate_hz: float | None = None,
        sampling: str | None = None,
        seed: int | None = None,
        sensor: str | None = None,
    ) -> ScenarioSpec:
        """Read a scenario from its file; what is given replaces the values of the file.

        ConfigError: the file is missing or an entry is invalid; the message names key and line.
        """
        own = ScenarioFile.read(path, rate_hz=rate_hz, sampling=sampling, seed=seed, sensor=sensor)
        return cls(
            name=own.name,
            own=own,
            rate_hz=own.rate_hz,
            sampling=own.sampling,
            seed=own.seed,
            sensor=own.sensor,
        )


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
    calibration: str | None = None


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

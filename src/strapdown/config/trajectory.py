"""Configuration of a simulated trajectory, from a TOML file."""

from __future__ import annotations

from pathlib import Path
from typing import Any, ClassVar

from pydantic import Field, FiniteFloat, ValidationError, field_validator

from strapdown.config.filled_form import explained
from strapdown.config.motions import KINDS, MANOEUVRES, MotionSpec
from strapdown.config.spec import TableSpec
from strapdown.config.toml_file import KeyPath, place_of, read_toml

__all__ = ["TrajectorySpec", "read_trajectory_spec"]


class TrajectorySpec(TableSpec):
    """One run of the simulator over a motion on the Earth."""

    unwritten: ClassVar[tuple[str, ...]] = ("name",)

    name: str = "trajectory"
    title: str = ""
    ellipsoid: str = "wgs84"
    rate_hz: FiniteFloat = Field(default=100.0, gt=0.0)
    sampling: str = "instantaneous"
    seed: int = Field(default=0, ge=0)
    sensor: str | None = None
    formats: tuple[str, ...] = Field(default=("csv",), min_length=1)
    trajectory_formats: tuple[str, ...] = ()
    motion: MotionSpec

    @field_validator("formats", "trajectory_formats", mode="before")
    @classmethod
    def _several(cls, value: Any) -> Any:
        return [value] if isinstance(value, str) else value


def read_trajectory_spec(path: Path, **instead: Any) -> TrajectorySpec:
    """Read a trajectory file.

    Parameters
    ----------
    path : Path
    **instead
        Values that replace those of the file; None keeps them.

    Returns
    -------
    TrajectorySpec
        Named after the file. A sensor file is resolved relative to it.

    Raises
    ------
    ConfigError
        The file is missing or not TOML, or a value does not fit; the message names the key.
    """
    file = read_toml(path)
    table = dict(file.table)
    if "name" in table:
        raise file.refuse(("name",), "config.named-after-file", kind="trajectory")
    table["name"] = path.stem
    sensor = table.get("sensor")
    if isinstance(sensor, str) and sensor.lower().endswith(".toml"):
        table["sensor"] = str(path.parent / sensor)
    table |= {key: value for key, value in instead.items() if value is not None}
    try:
        return TrajectorySpec(**table)
    except ValidationError as error:
        tags = {"kind": KINDS, "do": MANOEUVRES}
        raise explained(error.errors()[0], file, place=_place, tags=tags) from None


def _place(parts: KeyPath) -> str:
    """Position of a path for users, without the motion and its kind."""
    if len(parts) > 1 and parts[0] == "motion":
        parts = parts[1 + (parts[1] in KINDS and len(parts) > 2) :]
    return place_of(parts)

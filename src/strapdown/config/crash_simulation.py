"""The records of a simulated crash, as they are asked for."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, FiniteFloat

from strapdown.config.spec import Spec

__all__ = ["CrashSimulationSpec"]


class CrashSimulationSpec(Spec):
    """One crash, the recorders that write it, and how; no rate leaves each its own."""

    name: str
    units: tuple[str, ...] = ()
    rate_hz: FiniteFloat | None = Field(default=None, gt=0.0)
    sampling: Literal["instantaneous", "mean"] = "instantaneous"
    seed: int = Field(default=0, ge=0)
    formats: tuple[str, ...] = ("csv",)

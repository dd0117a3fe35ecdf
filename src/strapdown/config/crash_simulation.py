"""Configuration of the records of a simulated crash."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, FiniteFloat

from strapdown.config.spec import Spec

__all__ = ["CrashSimulationSpec"]


class CrashSimulationSpec(Spec):
    """One crash and its recorders; without a rate each recorder uses its own."""

    name: str
    units: tuple[str, ...] = ()
    rate_hz: FiniteFloat | None = Field(default=None, gt=0.0)
    sampling: Literal["instantaneous", "mean"] = "instantaneous"
    seed: int = Field(default=0, ge=0)
    formats: tuple[str, ...] = ("csv",)

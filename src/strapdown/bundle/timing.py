"""What is put beside a seal, because clocks differ."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from strapdown.bundle.json_text import to_json
from strapdown.bundle.seal import LATENCY, TIMING, Seal

__all__ = ["write_latency", "write_timing"]


def write_timing(
    seal: Seal, seconds: dict[str, float], sample_ns: dict[str, dict[str, float]] | None = None
) -> None:
    """Put the times that a run took beside its bundle's seal.

    Parameters
    ----------
    seal : Seal
    seconds : dict of str to float
        Stage to seconds.
    sample_ns : dict of str to dict, optional
        Algorithm to nanoseconds of a sample in each precision.
    """
    timing: dict[str, Any] = {"seconds": {stage: round(t, 4) for stage, t in seconds.items()}}
    if sample_ns:
        timing["sample_ns"] = sample_ns
    (seal.path / TIMING).write_text(to_json(timing), encoding="utf-8", newline="\n")


def write_latency(seal: Seal, latency: Mapping[str, Any]) -> None:
    """Put what each sample took beside its bundle's seal.

    Parameters
    ----------
    seal : Seal
    latency : mapping
        As JSON.
    """
    (seal.path / LATENCY).write_text(to_json(latency), encoding="utf-8", newline="\n")

"""Errors of a sensor in words that carry their units."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

from strapdown.simulation import TriadErrors

__all__ = ["stated_errors"]

# What follows the unit of the triad in a key, or stands instead of it.
_AFTER = {
    "noise_density": "_per_sqrt_hz",
    "random_walk": "_per_sqrt_s",
    "trend": "_per_s",
    "vibration_rectification": "_per_m2_per_s4",
}
_UNITS = {
    "correlation_time": "s",
    "jitter": "s",
    "warm_up_time": "s",
    "bandwidth": "hz",
    "misalignment": "rad",
    "scale": "relative",
    "nonlinearity_2": "relative",
    "nonlinearity_3": "relative",
}


def stated_errors(errors: TriadErrors, unit: str) -> dict[str, Any]:
    """The errors that there are, each key with its unit."""
    none, stated = TriadErrors(), {}
    for f in fields(errors):
        value = getattr(errors, f.name)
        if value != getattr(none, f.name):
            of = _UNITS.get(f.name, unit + _AFTER.get(f.name, ""))
            of += "_per_m_per_s2" if f.name == "g_sensitivity" else ""
            stated[f"{f.name}_{of}"] = value
    return stated

"""Prefilters from a high sample rate to the navigation rate: outliers, low-pass, decimation."""

from __future__ import annotations

from strapdown.prefilter.prefilter import (
    CHANNELS,
    Grid,
    NoPrefilter,
    Portion,
    Prefilter,
    Prefiltered,
    PrefilterReport,
)
from strapdown.prefilter.robust_fir import RobustFir
from strapdown.prefilter.summed import Summed
from strapdown.prefilter.w_d import RobustWd

__all__ = [
    "CHANNELS",
    "PREFILTERS",
    "Grid",
    "NoPrefilter",
    "Portion",
    "Prefilter",
    "PrefilterReport",
    "Prefiltered",
    "RobustFir",
    "RobustWd",
    "Summed",
]

#: Every prefilter, by name.
PREFILTERS: dict[str, type[Prefilter]] = {
    "none": NoPrefilter,
    "robust_fir": RobustFir,
    "summed": Summed,
    "w_d": RobustWd,
}

"""Prefilters from a high sample rate to the navigation rate: outliers, low-pass, decimation."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from strapdown.lazy_names import Choices, load_on_first_use

if TYPE_CHECKING:
    from strapdown.prefilter.prefilter import (
        CHANNELS,
        Grid,
        NoPrefilter,
        Prefilter,
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
    "Prefilter",
    "PrefilterReport",
    "RobustFir",
    "RobustWd",
    "Summed",
]

load_on_first_use(
    __name__,
    {
        "prefilter": "CHANNELS Grid NoPrefilter Prefilter PrefilterReport",
        "robust_fir": "RobustFir",
        "summed": "Summed",
        "w_d": "RobustWd",
    },
)

#: Every prefilter, by name.
PREFILTERS: Mapping[str, type[Prefilter]] = Choices(
    {
        "none": "strapdown.prefilter.prefilter:NoPrefilter",
        "robust_fir": "strapdown.prefilter.robust_fir:RobustFir",
        "summed": "strapdown.prefilter.summed:Summed",
        "w_d": "strapdown.prefilter.w_d:RobustWd",
    }
)

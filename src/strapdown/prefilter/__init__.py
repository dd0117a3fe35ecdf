"""From samples of 1 kHz to those that are navigated by: outliers, low-pass, decimation."""

from __future__ import annotations

from strapdown.prefilter.prefilter import Grid, Portion, Prefilter, Prefiltered
from strapdown.prefilter.report import PrefilterReport
from strapdown.prefilter.robust_fir import RobustFir

__all__ = [
    "PREFILTERS",
    "Grid",
    "Portion",
    "Prefilter",
    "PrefilterReport",
    "Prefiltered",
    "RobustFir",
]

#: Every prefilter, by name.
PREFILTERS: dict[str, type[Prefilter]] = {"robust_fir": RobustFir}

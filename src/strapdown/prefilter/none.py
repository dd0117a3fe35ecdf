"""No prefilter: samples as they come."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from strapdown.dsp.samples import check_segment
from strapdown.prefilter.prefilter import Grid, Portion, Prefilter
from strapdown.prefilter.report import Changed

Array = NDArray[np.float64]

__all__ = ["NoPrefilter"]


@dataclass(frozen=True)
class NoPrefilter(Prefilter):
    """Every sample as it came, at the rate at which it came."""

    name: ClassVar[str] = "none"
    summary: ClassVar[str] = "samples as they come"
    source: ClassVar[str] = "-"

    def begin(self, grid: Grid, channels: int = 6) -> tuple[Grid, int]:
        """As `Prefilter.begin`."""
        return grid, 0

    def advance(
        self, state: tuple[Grid, int], values: Array, last: bool = False
    ) -> tuple[tuple[Grid, int], Portion]:
        """As `Prefilter.advance`."""
        grid, given = state
        check_segment(values, given)
        after = given + len(values)
        time = grid.time(np.arange(given, after))
        return (grid, after), Portion(time, values.copy(), np.empty((0, 10)), Changed.none())

    def figures(self, grid: Grid) -> dict[str, float]:
        """As `Prefilter.figures`."""
        half = 0.5 / grid.step
        return {
            "delay": 0.0,
            "latency": 0.0,
            "noise_factor": 1.0,
            "passband": half,
            "stopband": half,
            "attenuation": 0.0,
        }

    def sampling(self, grid: Grid) -> str:
        """As the samples are."""
        return "mean" if grid.means else "instantaneous"

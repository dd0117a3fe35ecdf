"""A mechanization in one file: north-east-down, each step in two halves."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from strapdown._kernels.motion_increments import split_increment
from strapdown.constants import Array
from strapdown.mechanization.ned import NorthEastDown


@dataclass(frozen=True)
class HalfSteps(NorthEastDown):
    """North-east-down, each step cut in two.

    Attributes
    ----------
    part : float
        Of the step, that goes first.
    ellipsoid, height, height_time_constant, latitude_limit_deg, largest_speed, height_limits
        As `Mechanization`.
    """

    part: float = 0.5

    name: ClassVar[str] = "half_steps"
    summary: ClassVar[str] = "north-east-down, each step in two"
    source: ClassVar[str] = "a test"

    def advance_rows(
        self, state: Array, increments: Array, heights: Array, earth: Array, history: Array
    ) -> tuple[int, int]:
        """Advance `state` over rows of increments; return the steps made, and why no more."""
        for k, row in enumerate(increments):
            first, second, rows = np.empty(10), np.empty(10), np.empty((2, self.row))
            split_increment(row, self.part * row[0], first, second)
            halves = np.stack([first, second])
            made, why = super().advance_rows(state, halves, heights, earth, rows)
            if made < 2:
                return k, why
            history[k] = rows[1]
        return len(increments), 0

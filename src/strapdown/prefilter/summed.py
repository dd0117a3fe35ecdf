"""Outliers replaced, motion increments at the full rate, joined exactly: nothing is lost."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from strapdown.dsp.outliers import OutlierDesign, OutlierState
from strapdown.prefilter.prefilter import Grid, Portion, Prefilter, whole_factor
from strapdown.prefilter.report import Changed

Array = NDArray[np.float64]

__all__ = ["Summed", "SummedState"]


@dataclass(frozen=True, eq=False)
class SummedState:
    """Between segments.

    Attributes
    ----------
    grid : Grid
    factor : int
    outliers : OutlierState
    given : int
        Outputs so far.
    values : ndarray, (k, c)
        Screened samples from the stamp of the last output on.
    """

    grid: Grid
    factor: int
    outliers: OutlierState
    given: int
    values: Array


@dataclass(frozen=True)
class Summed(Prefilter):
    """Outliers replaced; turn, velocity and distance of each step joined to those of an interval.

    Nothing is filtered: coning and sculling of all frequencies are in the increments, as far as
    the samples show them. The samples of the Imu table that comes with them, for levelling and
    the like, are means over the intervals: of what is above their Nyquist frequency they hold
    much.

    Parameters
    ----------
    rate : float, Hz
        Of the output: a whole part of that of the samples.
    outliers : OutlierDesign
    steps : tuple of float, optional
        As `OutlierDesign.begin`.
    """

    name: ClassVar[str] = "summed"
    summary: ClassVar[str] = "outliers replaced, motion increments joined exactly"
    source: ClassVar[str] = "Blanes, Casas and Ros 2000 (each step); group composition"

    rate: float = 100.0
    outliers: OutlierDesign = field(default_factory=OutlierDesign)
    steps: tuple[float, ...] | None = None

    def begin(self, grid: Grid, channels: int = 6) -> SummedState:
        """As `Prefilter.begin`."""
        factor = whole_factor(self.rate, grid, self.name)
        steps = None if self.steps is None else np.asarray(self.steps, dtype=np.float64)
        return SummedState(
            grid, factor, self.outliers.begin(channels, steps), 0, np.empty((0, channels))
        )

    def advance(
        self, state: SummedState, values: Array, last: bool = False
    ) -> tuple[SummedState, Portion]:
        """As `Prefilter.advance`."""
        from strapdown._kernels.motion_blocks import join_blocks
        from strapdown._kernels.motion_increments import motion_increments_linear

        grid, factor = state.grid, state.factor
        outliers, part = self.outliers.advance(state.outliers, values, last)
        held = np.vstack([state.values, part.values])
        count = max(0, (len(held) - 1) // factor)
        used = held[: count * factor + 1] if count else held[:0]
        channels = held.shape[1]
        rows, means = np.empty((0, 10)), np.empty((count, channels))
        if count:
            ends, starts = used[1:], used[:-1]
            each = ends if grid.means else 0.5 * (starts + ends)
            # Reduced in one order whatever the number of rows.
            for j in range(factor):
                means = each[j::factor].copy() if j == 0 else means + each[j::factor]
            means /= factor
        if count and channels == 6:
            dt = np.full(len(used) - 1, grid.step)
            steps, rows = np.empty((len(dt), 10)), np.empty((len(dt), 10))
            rate, force = (np.ascontiguousarray(used[:, k : k + 3]) for k in (0, 3))
            motion_increments_linear(dt, rate, force, grid.means, steps)
            joined = join_blocks(dt, factor, steps, np.empty(len(dt), np.int64), rows)
            rows = rows[:joined].copy()
        number = factor * np.arange(state.given + 1, state.given + count + 1)
        portion = Portion(grid.time(number), means, rows, Changed.of(part))
        after = SummedState(
            grid, factor, outliers, state.given + count, held[count * factor :].copy()
        )
        return after, portion

    def figures(self, grid: Grid) -> dict[str, float]:
        """As `Prefilter.figures`; noise and band are those of the means."""
        factor = whole_factor(self.rate, grid, self.name)
        length = factor * grid.step
        return {
            "delay": 0.0,
            "latency": self.outliers.latency * grid.step,
            "noise_factor": 1.0 / math.sqrt(factor),
            # Where sinc(f length) is down by 0.1 dB: (pi f length)²/6 = 0.0114.
            "passband": 0.0833 / length,
            "stopband": 0.5 / length,
            # Of sinc at the Nyquist frequency.
            "attenuation": 20.0 * math.log10(math.pi / 2.0),
        }

    def sampling(self, grid: Grid) -> str:
        """Means over the intervals."""
        return "mean"

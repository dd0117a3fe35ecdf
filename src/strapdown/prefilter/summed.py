"""Outlier replacement and exact composition of full-rate motion increments."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from strapdown.dsp.outliers import OutlierDesign, OutlierState
from strapdown.prefilter.prefilter import Changed, Grid, Portion, Prefilter, whole_factor

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class SummedState:
    """State between chunks.

    Attributes
    ----------
    given : int
        Outputs so far.
    values : ndarray, (k, c)
        Screened samples, starting one before the stamp of the last output; before the first output,
        from the start of the record.
    """

    grid: Grid
    factor: int
    outliers: OutlierState
    given: int
    values: Array

    @property
    def before(self) -> int:
        """Samples before the first one to be joined."""
        return int(self.given > 0)


@dataclass(frozen=True)
class Summed(Prefilter):
    """Replace outliers and compose the motion increments of each step over an output interval.

    No low-pass is applied. Each step is the flow of the cubic through four samples, or of the
    parabola with the means of three (`motion_increments`, 'cubic'). For coning and sculling that
    rotate by x = 2 pi f step, the relative deficit is 11/360 x⁴: 6e-4 at 60 Hz and 1 kHz. The
    accompanying Imu table, for leveling and similar uses, holds means over the intervals and is
    strongly aliased above its Nyquist frequency.

    Parameters
    ----------
    rate : float, Hz
        Output rate; must divide the sample rate.
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
        grid, factor, before = state.grid, state.factor, state.before
        outliers, part = self.outliers.advance(state.outliers, values, last)
        held = np.vstack([state.values, part.values])
        # A step's polynomial uses its neighbors: one more sample, except at the end of the record.
        count = max(0, (len(held) - before - (1 if last else 2)) // factor)
        steps = count * factor
        used = held[before : before + steps + 1] if count else held[:0]
        channels = held.shape[1]
        means, rows = np.empty((count, channels)), np.empty((0, 10))
        if count:
            each = used[1:] if grid.means else 0.5 * (used[:-1] + used[1:])
            # Summed in a fixed order, independent of the number of rows.
            means = sum((each[j::factor] for j in range(1, factor)), each[::factor]) / factor
        if count and channels == 6:
            rows = _joined(held[: before + steps + 2], grid, factor, before, steps)
        number = factor * np.arange(state.given + 1, state.given + count + 1)
        portion = Portion(grid.time(number), means, rows, Changed.of(part))
        left = held[before + steps - 1 :] if count else held
        return SummedState(grid, factor, outliers, state.given + count, left.copy()), portion

    def figures(self, grid: Grid) -> dict[str, float]:
        """As `Prefilter.figures`; noise and band are those of the means."""
        factor = whole_factor(self.rate, grid, self.name)
        length = factor * grid.step
        return {
            "delay": 0.0,
            "latency": (self.outliers.latency + 1) * grid.step,
            "noise_factor": 1.0 / math.sqrt(factor),
            # sinc(f length) is down by 0.1 dB: (pi f length)²/6 = 0.0114.
            "passband": 0.0833 / length,
            "stopband": 0.5 / length,
            # Attenuation of sinc at the Nyquist frequency.
            "attenuation": 20.0 * math.log10(math.pi / 2.0),
        }

    def sampling(self, grid: Grid) -> str:
        """Means over the intervals."""
        return "mean"


def _joined(values: Array, grid: Grid, factor: int, before: int, steps: int) -> Array:
    """Motion increments of each step, composed over the output intervals."""
    from strapdown._kernels import motion_increments as kernels

    dt = np.full(len(values) - 1, grid.step)
    rows, scratch = np.empty((len(dt), 10)), np.empty((kernels.ROWS, kernels.WIDEST))
    kernels.motion_increments_neighbours(dt, values, grid.means, scratch, rows)
    out = np.empty((steps, 10))
    own = np.ascontiguousarray(rows[before : before + steps])
    count = kernels.join_blocks(dt[:steps], factor, own, np.empty(steps, np.int64), out)
    return out[:count].copy()

"""Robust digital filter: outlier replacement, linear-phase low-pass, decimation."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from strapdown.dsp.decimation import FirDecimation, FirState, fir_decimation
from strapdown.dsp.outliers import OutlierDesign, OutlierState
from strapdown.errors import ConfigError
from strapdown.prefilter.prefilter import Changed, Grid, Portion, Prefilter, whole_factor

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class RobustFirState:
    """State of outlier screening and low-pass between chunks."""

    grid: Grid
    low_pass: FirDecimation
    outliers: OutlierState
    fir: FirState


@dataclass(frozen=True)
class RobustFir(Prefilter):
    """Replace outliers, apply a linear-phase FIR low-pass, and decimate.

    All channels use the same weights, so no phase difference arises between gyros and
    accelerometers; the stamps are corrected for the delay of half the filter length. Constants pass
    unchanged, and the integral of the outputs equals that of the samples. Motion above `passband`,
    including its coning and sculling, is lost; `Summed` keeps it.

    Parameters
    ----------
    rate : float, Hz
        Output rate; must divide the sample rate.
    passband : float
        End of the passband as a fraction of the output's Nyquist frequency.
    attenuation : float, dB
        From that Nyquist frequency on.
    steps : tuple of float, optional
        Quantization steps of the channels, as `OutlierDesign.begin`.

    Notes
    -----
    Chernodarov (2009), Figs. 3 to 5, names a robust digital filter at 1 kHz without its formulas;
    those in its reference [12] are not in the paper.
    """

    name: ClassVar[str] = "robust_fir"
    summary: ClassVar[str] = "outliers replaced, linear-phase low-pass, decimation"
    source: ClassVar[str] = "Chernodarov 2009, Figs. 3-5; Kaiser 1974"

    rate: float = 100.0
    passband: float = 0.5
    attenuation: float = 80.0
    outliers: OutlierDesign = field(default_factory=OutlierDesign)
    steps: tuple[float, ...] | None = None

    def low_pass(self, grid: Grid) -> FirDecimation:
        """Design the low-pass for the samples of a grid.

        Raises
        ------
        ConfigError
            The rate does not divide the sample rate, or equals it.
        """
        factor = whole_factor(self.rate, grid, self.name)
        if factor == 1:
            raise ConfigError(
                "prefilter.rate-not-below-log",
                quantity="rate",
                name=self.name,
                rate=self.rate,
                rate_2=0.5 * self.rate,
            )
        return fir_decimation(
            grid.step,
            factor,
            means=grid.means,
            passband=self.passband,
            attenuation=self.attenuation,
        )

    def begin(self, grid: Grid, channels: int = 6) -> RobustFirState:
        """As `Prefilter.begin`."""
        low_pass = self.low_pass(grid)
        steps = None if self.steps is None else np.asarray(self.steps, dtype=np.float64)
        return RobustFirState(
            grid, low_pass, self.outliers.begin(channels, steps), low_pass.begin(channels)
        )

    def advance(
        self, state: RobustFirState, values: Array, last: bool = False
    ) -> tuple[RobustFirState, Portion]:
        """As `Prefilter.advance`."""
        low_pass, grid = state.low_pass, state.grid
        outliers, part = self.outliers.advance(state.outliers, values, last)
        fir, out = low_pass.advance(state.fir, part.values)
        number = low_pass.centre + low_pass.factor * np.arange(state.fir.given, fir.given)
        portion = Portion(grid.time(number), out, np.empty((0, 10)), Changed.of(part))
        return RobustFirState(grid, low_pass, outliers, fir), portion

    def figures(self, grid: Grid) -> dict[str, float]:
        """As `Prefilter.figures`."""
        low_pass = self.low_pass(grid)
        return {
            "delay": low_pass.delay,
            "latency": low_pass.delay + self.outliers.latency * grid.step,
            "noise_factor": low_pass.noise_factor,
            "passband": low_pass.design.passband,
            "stopband": low_pass.design.stopband,
            "attenuation": self.attenuation,
        }

    def sampling(self, grid: Grid) -> str:
        """Values at the stamps, also for means, because the filter is symmetric about the stamp."""
        return "instantaneous"

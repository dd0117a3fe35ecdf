"""Oscillations of a coordinate as sums of sines."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import ConfigError

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Wave:
    """``amplitude sin(2 pi t/period + phase)``.

    Attributes
    ----------
    amplitude : float
        Unit of the coordinate.
    period : float, s
    phase_deg : float, deg

    Raises
    ------
    ConfigError
        A number is not finite, or the period is not positive.
    """

    amplitude: float
    period: float
    phase_deg: float = 0.0

    def __post_init__(self) -> None:
        if not 0.0 < self.period < math.inf:
            raise ConfigError(
                "simulation.wave-cannot-period", quantity="period", period=self.period
            )
        if not (math.isfinite(self.amplitude) and math.isfinite(self.phase_deg)):
            raise ConfigError("simulation.amplitude-or-phase-not-finite", quantity="wave")


def sum_waves(waves: Sequence[Wave], time: Array) -> tuple[Array, Array, Array]:
    """Sum of waves and its first two derivatives by time.

    Parameters
    ----------
    waves : sequence of Wave
    time : ndarray, (n,), s

    Returns
    -------
    value, first, second : ndarray, (n,)
        Zero without waves.
    """
    value, first, second = np.zeros(time.size), np.zeros(time.size), np.zeros(time.size)
    for wave in waves:
        omega = 2.0 * math.pi / wave.period
        # Whole periods are taken away without rounding, so that late phases are as good as early.
        phase = 2.0 * math.pi * (np.fmod(time, wave.period) / wave.period)
        phase += math.radians(wave.phase_deg)
        high, level = wave.amplitude * np.sin(phase), wave.amplitude * np.cos(phase)
        value += high
        first += omega * level
        second -= omega * omega * high
    return value, first, second

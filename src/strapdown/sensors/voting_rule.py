"""When redundant axes disagree, and what is stated of them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import ConfigError
from strapdown.sensors.imu_uncertainty import BiasDrift
from strapdown.sensors.triad_uncertainty import TriadUncertainty
from strapdown.tables.checks import is_number

Array = NDArray[np.float64]

__all__ = ["AxisErrors", "VotingRule"]


@dataclass(frozen=True)
class VotingRule:
    """When axes are held to disagree, to have failed, and to be sound again.

    Attributes
    ----------
    windows : tuple of float, s
        Time constants of the means that are compared: a short one for what is large, a long one
        for what is small. Each mean is that of all samples so far until it is as old.
    persist : float
        A window's chi-square must be beyond its limit for this part of its time constant.
    learn : float, s
        For so long the axes are compared within their stated biases; from then on, each within
        what may have changed since.
    readmit : float, s
        An axis that failed is taken back after it has been within half of the limit for so long;
        infinite is never. A disagreement of the same two is told again after so long without one.
    false_alarm : float, 1/h
        Expected number of samples an hour beyond a limit, of all windows and both triads, where all
        is as stated.
    confusion : float
        Likelihood of the next axis over that of the one that is excluded.
    apart : float, m
        Largest distance between the accelerometers of two units. Lever arms are not corrected;
        this allows for the centripetal acceleration between them, ``apart ω²``.

    Raises
    ------
    ConfigError
        A number is out of range.
    """

    windows: tuple[float, ...] = (0.1, 5.0)
    persist: float = 0.5
    learn: float = 30.0
    readmit: float = 60.0
    false_alarm: float = 1e-3
    confusion: float = 1e-6
    apart: float = 0.0

    def __post_init__(self) -> None:
        good = {
            "windows": bool(self.windows)
            and all(is_number(x) and 0.0 < x < math.inf for x in self.windows),
            "persist": is_number(self.persist) and 0.0 < self.persist < math.inf,
            "learn": is_number(self.learn) and 0.0 < self.learn < math.inf,
            "readmit": is_number(self.readmit) and self.readmit > 0.0,
            "false_alarm": is_number(self.false_alarm) and 0.0 < self.false_alarm < 1.0,
            "confusion": is_number(self.confusion) and 0.0 < self.confusion < 1.0,
            "apart": is_number(self.apart) and 0.0 <= self.apart < math.inf,
        }
        for name, fine in good.items():
            if not fine:
                raise ConfigError("sensors.will-not-do", quantity=name, value=getattr(self, name))


@dataclass(frozen=True, eq=False)
class AxisErrors:
    """What is not known of m axes: arrays (m,), named as in `TriadUncertainty` and `BiasDrift`."""

    noise_density: Array
    bias: Array
    scale: Array
    misalignment: Array
    g_sensitivity: Array
    quantization: Array
    drift: Array
    correlation_time: Array

    @classmethod
    def of(cls, parts: Sequence[tuple[TriadUncertainty, BiasDrift, int]]) -> AxisErrors:
        """Take axis ``part[2]`` of each triad, one an axis."""
        names = (
            "noise_density",
            "bias",
            "scale",
            "misalignment",
            "g_sensitivity",
            "quantization",
        )
        columns = {n: np.array([t.axis(n)[k] for t, _, k in parts]) for n in names}
        drift = np.array([d.triad[k] for _, d, k in parts])
        time = np.array([d.correlation_time for _, d, _ in parts])
        return cls(**columns, drift=drift, correlation_time=time)

"""What is not known of a triad of sensors."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import ConfigError
from strapdown.sensors.triad_errors import Triad, TriadLike
from strapdown.tables.checks import is_number

# Facts about the range, which are not standard deviations, and may be infinite.
FACTS = ("full_scale", "quantization", "bandwidth")
WHERE_ZERO_IS_NOTHING = ("full_scale", "bandwidth")


@dataclass(frozen=True)
class TriadUncertainty:
    """Standard deviations of what a triad does to the truth, and the facts of its range.

    The unit u is rad/s for gyros and m/s² for accelerometers. Each is the same on all axes where
    one number is given. All errors are independent of one another, normal and of mean zero; they
    act as in `error_chain`.

    Attributes
    ----------
    noise_density : triad, u/√Hz
        White noise: a sample that stands for an interval dt has the standard deviation
        ``noise_density / √dt``.
    bias : triad, u
        Of a record, before any of it is estimated.
    scale : triad
        Relative.
    misalignment : triad, rad
        Of each of the two angles with which an axis feels the other two.
    nonlinearity_2 : triad
        Relative to full scale, at an input of full scale.
    g_sensitivity : triad, u per m/s²
        Of gyros: each of the three terms of an axis.
    vibration_rectification : triad, u per (m/s²)²
        Shift of the output per variance of the vibration on the axis.
    full_scale : triad, u
        The output is held within ± this.
    quantization : triad, u
        Step of the output.
    bandwidth : float, Hz
        Of the single-pole low-pass before the sampler.

    Raises
    ------
    ConfigError
        A number is negative or not finite, or a full scale or a bandwidth is zero.
    """

    noise_density: TriadLike = 0.0
    bias: TriadLike = 0.0
    scale: TriadLike = 0.0
    misalignment: TriadLike = 0.0
    nonlinearity_2: TriadLike = 0.0
    g_sensitivity: TriadLike = 0.0
    vibration_rectification: TriadLike = 0.0
    full_scale: TriadLike = math.inf
    quantization: TriadLike = 0.0
    bandwidth: float = math.inf

    def __post_init__(self) -> None:
        for f in fields(self):
            given = getattr(self, f.name)
            numbers = _numbers(given, f.name)
            if f.name != "bandwidth":
                numbers = numbers * 3 if len(numbers) == 1 else numbers
            if len(numbers) != (1 if f.name == "bandwidth" else 3):
                raise ConfigError("sensors.not-right-shape", quantity=f.name, given=given)
            if any(math.isnan(x) or x < 0.0 for x in numbers) or (
                f.name not in FACTS and any(math.isinf(x) for x in numbers)
            ):
                raise ConfigError(
                    "sensors.no-standard-deviation-or-range", quantity=f.name, given=given
                )
            if f.name in WHERE_ZERO_IS_NOTHING and 0.0 in numbers:
                raise ConfigError("sensors.leaves-nothing-measure", quantity=f.name, given=given)
            value = tuple(float(x) for x in numbers)
            object.__setattr__(self, f.name, value[0] if f.name == "bandwidth" else value)
        if any(
            n > 0.0 and math.isinf(r)
            for n, r in zip(self.axis("nonlinearity_2"), self.axis("full_scale"), strict=True)
        ):
            raise ConfigError("sensors.nonlinearity-relative-none", quantity="full_scale")

    def axis(self, name: str) -> Triad:
        """Return a per-axis attribute as three numbers."""
        value: Triad = getattr(self, name)
        return value

    def variance_by_input(self, value: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return what scale factors and misalignments make of an input that stays the same.

        Parameters
        ----------
        value : ndarray, (3,), u

        Returns
        -------
        ndarray, (3,), u²
            Variance of the reading of each axis.
        """
        squares = value * value
        across = float(value @ value) - squares
        scale, misalignment = self.axis("scale"), self.axis("misalignment")
        return np.asarray(np.square(scale) * squares + np.square(misalignment) * across)


def _numbers(given: Any, name: str) -> tuple[float, ...]:
    try:
        numbers = (given,) if is_number(given) else tuple(given)
        if isinstance(given, str) or not all(is_number(x) for x in numbers):
            raise TypeError
        return tuple(float(x) for x in numbers)
    except TypeError:
        raise ConfigError("sensors.uncertainty-not-a-number", quantity=name, given=given) from None

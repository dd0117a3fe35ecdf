"""The quaternion algorithm, Alexiev (2021), Eqs. (20)-(22)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from strapdown._kernels import attitude as kernel
from strapdown.attitude_algorithms.algorithm import Accuracy, AttitudeAlgorithm
from strapdown.constants import Array
from strapdown.errors import ConfigError


@dataclass(frozen=True)
class Quaternion(AttitudeAlgorithm):
    """The quaternion, multiplied at each step by that of the increment.

    Exact wherever the direction of the rate is constant within each step; on general motion
    of order 2, as the direction cosines are.

    Parameters
    ----------
    order : int
        Highest power of the increment in the series (21) and (22), 1 to 20; 0 for the limit:
        exact sine and cosine.
    normalise : bool
        Scale back to norm 1 after each step.
    """

    name = "quaternion"
    title = "Quaternion"
    equations = "(20)-(22)"
    summary = "four numbers, multiplied by the quaternion of each increment"
    advance_kernel = staticmethod(kernel.quaternion_advance)
    update_kernel = staticmethod(kernel.quaternion_update)

    order: int = 0
    normalise: bool = True

    def __post_init__(self) -> None:
        if not 0 <= self.order <= 20:
            raise ConfigError("attitude.out-range-2", quantity="quaternion:order", order=self.order)

    @property
    def accuracy(self) -> Accuracy:
        """Two, whatever the order of the series: 2 atan(r/2) is r to that order already."""
        return Accuracy(increments=2, rates=2, coning=2)

    def diagnostics(self, state: Array, time: Array) -> dict[str, float]:
        """Return the deviation of the norm from 1 at the end."""
        return {"norm_error": float(np.sqrt(state @ state) - 1.0)}

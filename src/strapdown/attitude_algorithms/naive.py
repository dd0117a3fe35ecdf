"""The naive algorithm: each gyro integrated on its own, Alexiev (2021), Eq. (2)."""

from __future__ import annotations

from dataclasses import dataclass

from strapdown._kernels import attitude as kernel
from strapdown.attitude_algorithms.algorithm import Accuracy, AttitudeAlgorithm


@dataclass(frozen=True)
class Naive(AttitudeAlgorithm):
    """Sum of the increments about each axis, read as roll, pitch and heading.

    Exact for rotation about one axis from a level start. Rotations do not commute, but this sum
    treats them as if they did: an error of the order of the product of the angles, which no
    sampling rate removes. Order of accuracy on general motion: 0.
    """

    name = "naive"
    title = "Naive sum"
    equations = "(2)"
    summary = "integrates each gyro on its own; ignores that rotations do not commute"
    width = 3
    advance_kernel = staticmethod(kernel.naive_advance)
    update_kernel = staticmethod(kernel.naive_update)

    @property
    def accuracy(self) -> Accuracy:
        """Zero: a commutation error, independent of the step."""
        return Accuracy(increments=0, rates=0, coning=0)

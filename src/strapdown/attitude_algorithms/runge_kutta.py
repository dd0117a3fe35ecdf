"""The quaternion's kinematic equation by the classical Runge-Kutta step."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from strapdown._kernels import attitude as kernel
from strapdown.attitude_algorithms.algorithm import Accuracy, AttitudeAlgorithm
from strapdown.constants import Array


@dataclass(frozen=True)
class RungeKutta(AttitudeAlgorithm):
    """The quaternion, by the fourth-order Runge-Kutta step of its differential equation.

    The rate is taken as linear over the step: rates at the stamps give the change of its axis,
    which the exponential of the increment alone lacks; with increments alone this change is
    unknown, and the order is 2 like that.

    Parameters
    ----------
    normalise : bool
        Scale back to norm 1 after each step.
    """

    name = "rk4"
    title = "Runge-Kutta quaternion"
    equations = "(18)"
    summary = "dq/dt = q (0, rate)/2 by the classical fourth-order step, rate linear over it"
    advance_kernel = staticmethod(kernel.rk4_advance)
    update_kernel = staticmethod(kernel.rk4_update)

    normalise: bool = True

    @property
    def accuracy(self) -> Accuracy:
        """Four with rates of that order, and two from increments alone."""
        return Accuracy(increments=2, rates=4, coning=2)

    def diagnostics(self, state: Array, time: Array) -> dict[str, float]:
        """Return the deviation of the norm from 1 at the end."""
        return {"norm_error": float(np.sqrt(state @ state) - 1.0)}

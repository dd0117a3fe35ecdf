"""Euler-Krylov kinematics, Alexiev (2021), Eqs. (8)-(10)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from strapdown._kernels import attitude as kernel
from strapdown.attitude_algorithms.algorithm import Accuracy, AttitudeAlgorithm
from strapdown.constants import Array
from strapdown.errors import ConfigError


@dataclass(frozen=True)
class EulerKrylov(AttitudeAlgorithm):
    """Rates of roll, pitch and heading, integrated step by step.

    Singular at a pitch of ±90°: (8) and (10) divide by cos(pitch). The angles stay finite
    there, and the run records its least distance and when; an error made near the pole stays.

    Parameters
    ----------
    step : {'forward', 'rk4'}
        Forward Euler with the mean rate of the step (order 1), or the classical fourth-order
        Runge-Kutta step with the rate taken as linear over the step (order 4 in the
        kinematics; the linear rate itself limits general motion to order 2).
    """

    name = "euler"
    title = "Euler-Krylov"
    equations = "(8)-(10)"
    summary = "rates of roll, pitch and heading; singular at ±90° pitch"
    width = 3
    advance_kernel = staticmethod(kernel.euler_advance)
    update_kernel = staticmethod(kernel.euler_update)

    step: Literal["forward", "rk4"] = "forward"

    def __post_init__(self) -> None:
        if self.step not in ("forward", "rk4"):
            raise ConfigError("attitude.no-step", quantity="euler:step", step=self.step)

    def begin(self, q_nb: Array) -> Array:
        """Return roll, pitch, heading in rad, least ``|cos(pitch)|``, its step, steps so far."""
        angles = super().begin(q_nb)
        return np.array([*angles, abs(np.cos(angles[1])), 0.0, 0.0])

    @property
    def accuracy(self) -> Accuracy:
        """One for the forward step; Runge-Kutta is limited by the knowledge of the rate."""
        if self.step == "forward":
            return Accuracy(increments=1, rates=1, coning=2)
        return Accuracy(increments=2, rates=4, coning=2)

    def kernel_options(self) -> tuple[float, float]:
        """Return whether the step is Runge-Kutta's."""
        return float(self.step == "rk4"), 0.0

    def diagnostics(self, state: Array, time: Array) -> dict[str, float]:
        """Return the least distance of the pitch from ±90° (deg), and when it was (s)."""
        return {
            "closest_to_pole_deg": float(np.degrees(np.arcsin(min(1.0, state[3])))),
            "closest_to_pole_time_s": float(time[min(int(state[4]), len(time) - 1)]),
        }

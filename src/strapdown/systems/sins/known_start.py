"""Navigation from a state that is known, without an alignment."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import ConfigError
from strapdown.nav_state import NavState
from strapdown.rotation import euler_from_quaternion
from strapdown.tables.checks import is_number

__all__ = ["KnownStart"]

Array = NDArray[np.float64]
Three = tuple[float, float, float]


@dataclass(frozen=True)
class KnownStart:
    """The state at a start, with standard deviations.

    Attributes
    ----------
    state : NavState
        Navigation begins with the sample at its time; samples before are left out.
    position_sd : tuple of float, (3,), m
        North, east, down.
    velocity_sd : tuple of float, (3,), m/s
    attitude_sd_deg : tuple of float, (3,), deg
        Roll, pitch, heading.
    at_first_sample : bool
        Whether the state is that of the first sample, whatever its time.

    Raises
    ------
    ConfigError
        A standard deviation is negative or no number.
    """

    state: NavState
    position_sd: Three
    velocity_sd: Three
    attitude_sd_deg: Three
    at_first_sample: bool = False

    def __post_init__(self) -> None:
        for name in ("position_sd", "velocity_sd", "attitude_sd_deg"):
            value = getattr(self, name)
            if len(value) != 3 or not all(is_number(x) and 0.0 <= x < math.inf for x in value):
                raise ConfigError(
                    "navigation.no-three-standard-deviations", quantity=name, value=value
                )

    @property
    def covariance(self) -> Array:
        """Of displacement, velocity and rotation in north-east-down, (9, 9).

        Errors of roll, pitch and heading turn about the forward axis, about the level axis to its
        right, and about down.
        """
        _, pitch, heading = np.radians(euler_from_quaternion(self.state.q_nb)).tolist()
        sp, cp, sh, ch = math.sin(pitch), math.cos(pitch), math.sin(heading), math.cos(heading)
        axes = np.array([[cp * ch, -sh, 0.0], [cp * sh, ch, 0.0], [-sp, 0.0, 1.0]])
        P = np.zeros((9, 9))
        P[0:3, 0:3] = np.diag(np.square(self.position_sd))
        P[3:6, 3:6] = np.diag(np.square(self.velocity_sd))
        P[6:9, 6:9] = axes * np.square(np.radians(self.attitude_sd_deg)) @ axes.T
        return P

"""One of several inertial units on a body: its errors, and how it is turned in the body."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from strapdown.errors import ConfigError
from strapdown.sensors.imu_uncertainty import ImuUncertainty

__all__ = ["MountedUnit"]

# Of a mounting: how far it may be from a rotation.
ROTATION = 1e-6


@dataclass(frozen=True, eq=False)
class MountedUnit:
    """What is known of a unit before it is switched on.

    Attributes
    ----------
    name : str
    uncertainty : ImuUncertainty
        Its noise, bias, scale factor and so on, of its own axes; the misalignment with that of its
        mounting.
    mounting : array_like, (3, 3)
        ``C``, with which a vector in the unit's axes becomes one in body axes, ``C v``.

    Raises
    ------
    ConfigError
        The mounting is no rotation.
    """

    name: str
    uncertainty: ImuUncertainty
    mounting: ArrayLike = field(default_factory=lambda: np.eye(3))

    def __post_init__(self) -> None:
        c = np.asarray(self.mounting, dtype=np.float64)
        good = c.shape == (3, 3) and np.isfinite(c).all()
        if not good or np.abs(c @ c.T - np.eye(3)).max() > ROTATION or np.linalg.det(c) < 0.0:
            raise ConfigError("sensors.mounting-no-rotation", file=self.name, quantity="mounting")
        object.__setattr__(self, "mounting", c)

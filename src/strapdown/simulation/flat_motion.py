"""What motions near the ground have in common: an Earth that is flat and at rest."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from strapdown import rotation
from strapdown.constants import STANDARD_GRAVITY

Array = NDArray[np.float64]


class _Accelerated(Protocol):
    def attitude(self, time: ArrayLike) -> Array: ...

    def acceleration(self, time: ArrayLike) -> Array: ...


class FlatMotion:
    """Base of motions that know position, velocity and acceleration in fixed north-east-down."""

    def specific_force(self: _Accelerated, time: ArrayLike) -> Array:
        """What an ideal accelerometer reads.

        Parameters
        ----------
        time : array_like, (n,), s

        Returns
        -------
        ndarray, (n, 3), m/s²
            ``C_nb^T (a_n - g_n)`` with the standard gravity straight down.
        """
        upward = self.acceleration(time) - np.array([0.0, 0.0, STANDARD_GRAVITY])
        return rotation.rotate(rotation.conjugate(self.attitude(time)), upward)

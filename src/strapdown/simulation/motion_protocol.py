"""What every motion with exact truth can tell."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


class Motion(Protocol):
    """A body whose attitude, and where it has one its path, is known at every instant.

    Every method takes ``(n,)`` instants in s.
    """

    @property
    def duration(self) -> float:
        """Length in s; the motion begins at zero."""
        ...

    def rate(self, time: ArrayLike) -> Array:
        """Body rate, (n, 3), rad/s."""
        ...

    def angle(self, time: ArrayLike) -> Array:
        """Integral of the body rate from time zero, (n, 3), rad."""
        ...

    def attitude(self, time: ArrayLike) -> Array:
        """Attitude ``q_nb``, (n, 4)."""
        ...

    def acceleration(self, time: ArrayLike) -> Array:
        """Second derivative of the position, without gravity, (n, 3), north-east-down, m/s²."""
        ...

    def velocity(self, time: ArrayLike) -> Array:
        """Derivative of the position, (n, 3), north-east-down, m/s."""
        ...

    def position(self, time: ArrayLike) -> Array:
        """Position from where the motion begins, (n, 3), north-east-down, m."""
        ...

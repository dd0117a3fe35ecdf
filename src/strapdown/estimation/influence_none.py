"""Least squares as an influence function: every residual counts in full."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from strapdown.estimation.influence import Influence


@dataclass(frozen=True)
class LeastSquares(Influence):
    """``psi(u) = u``: the plain Kalman filter."""

    name: ClassVar[str] = "none"
    summary: ClassVar[str] = "every observation counts in full"
    source: ClassVar[str] = "Gauss 1809"

    @property
    def linear(self) -> float:
        """Everywhere."""
        return math.inf

    @property
    def knots(self) -> tuple[float, ...]:
        """None."""
        return ()

    def rho(self, u: float) -> float:
        """Half the square."""
        return 0.5 * u * u

    def psi(self, u: float) -> float:
        """The residual."""
        return u

    def psi_prime(self, u: float) -> float:
        """1."""
        return 1.0

"""Tukey's biweight: a smooth influence function that comes down to nothing at c."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from strapdown.estimation.influence import Influence, check_rising


@dataclass(frozen=True)
class Tukey(Influence):
    """``psi(u) = u (1 - (u / c)^2)^2`` up to c, nothing beyond.

    There is no linear range: even a good observation counts a little less than in full.

    Attributes
    ----------
    c : float
        4.685 has 95 % efficiency with normal errors.
    """

    c: float = 4.685

    name: ClassVar[str] = "tukey"
    summary: ClassVar[str] = "smooth: nothing beyond c"
    source: ClassVar[str] = (
        "Beaton and Tukey 1974, Technometrics 16, 147-185; constant: Holland and Welsch 1977, "
        "Communications in Statistics A6, 813-827"
    )

    def __post_init__(self) -> None:
        check_rising(self.name, c=self.c)

    @property
    def linear(self) -> float:
        """Nowhere but at zero."""
        return 0.0

    @property
    def knots(self) -> tuple[float, ...]:
        """Where psi'' = 0, and at c."""
        return (math.sqrt(0.6) * self.c, self.c)

    def rho(self, u: float) -> float:
        """From half the square to ``c^2 / 6``."""
        t = min(1.0, (u / self.c) ** 2)
        return self.c * self.c / 6.0 * t * (3.0 - 3.0 * t + t * t)

    def psi(self, u: float) -> float:
        """The residual times its weight."""
        return u * self.weight(u)

    def psi_prime(self, u: float) -> float:
        """``(1 - t) (1 - 5 t)`` with ``t = (u / c)^2``."""
        t = (u / self.c) ** 2
        return (1.0 - t) * (1.0 - 5.0 * t) if t < 1.0 else 0.0

    def weight(self, u: float) -> float:
        """``(1 - (u / c)^2)^2``, the biweight."""
        t = (u / self.c) ** 2
        return (1.0 - t) ** 2 if t < 1.0 else 0.0

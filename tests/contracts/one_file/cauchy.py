"""An influence function in one file: that of Cauchy's distribution."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from strapdown.estimation.robust import Influence, check_rising


@dataclass(frozen=True)
class Cauchy(Influence):
    """``psi(u) = u / (1 + (u / c)^2)``.

    Attributes
    ----------
    c : float
        2.385 has 95 % efficiency with normal errors.
    """

    c: float = 2.385

    name: ClassVar[str] = "cauchy"
    summary: ClassVar[str] = "never nothing, ever less"
    source: ClassVar[str] = "Holland and Welsch 1977"

    def __post_init__(self) -> None:
        check_rising(self.name, c=self.c)

    @property
    def linear(self) -> float:
        """Nowhere but at zero."""
        return 0.0

    @property
    def knots(self) -> tuple[float, ...]:
        """Where psi'' = 0."""
        return (math.sqrt(3.0) * self.c,)

    def rho(self, u: float) -> float:
        """``c^2 / 2 ln(1 + (u / c)^2)``."""
        return 0.5 * self.c**2 * math.log1p((u / self.c) ** 2)

    def psi(self, u: float) -> float:
        """The residual times its weight."""
        return u / (1.0 + (u / self.c) ** 2)

    def psi_prime(self, u: float) -> float:
        """``(1 - t) / (1 + t)^2`` with ``t = (u / c)^2``."""
        t = (u / self.c) ** 2
        return (1.0 - t) / (1.0 + t) ** 2

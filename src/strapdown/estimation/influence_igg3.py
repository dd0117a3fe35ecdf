"""IGG-III: in full, then less and less, then nothing; used for positions from satellites."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from strapdown.estimation.influence import Influence, check_rising


@dataclass(frozen=True)
class Igg3(Influence):
    """Weight 1 up to k0, ``(k0 / u) ((k1 - u) / (k1 - k0))^2`` up to k1, nothing beyond.

    Attributes
    ----------
    k0, k1 : float
        Published values lie from 1 to 3 and from 2.5 to 8.5; many of the pairs have far less than
        95 % efficiency with normal errors (1.5 and 3: 0.76), the default has it.
    """

    k0: float = 2.0
    k1: float = 4.976

    name: ClassVar[str] = "igg3"
    summary: ClassVar[str] = "full, reduced, nothing: the weights of geodesy"
    source: ClassVar[str] = "Yang 1994, manuscripta geodaetica 19; Yang et al. 2001, J. Geodesy 75"

    def __post_init__(self) -> None:
        check_rising(self.name, k0=self.k0, k1=self.k1)

    @property
    def linear(self) -> float:
        """Up to k0."""
        return self.k0

    @property
    def knots(self) -> tuple[float, ...]:
        """At k0 and k1."""
        return (self.k0, self.k1)

    def rho(self, u: float) -> float:
        """Half the square, a cubic, and then the same for all."""
        u = abs(u)
        if u <= self.k0:
            return 0.5 * u * u
        width = self.k1 - self.k0
        left = max(0.0, self.k1 - u) / width
        return 0.5 * self.k0 * self.k0 + self.k0 * width / 3.0 * (1.0 - left**3)

    def psi(self, u: float) -> float:
        """The residual, then ``k0 ((k1 - u) / (k1 - k0))^2``, then nothing."""
        size = abs(u)
        if size <= self.k0:
            return u
        left = max(0.0, self.k1 - size) / (self.k1 - self.k0)
        return math.copysign(self.k0 * left * left, u)

    def psi_prime(self, u: float) -> float:
        """1, then ``-2 k0 (k1 - u) / (k1 - k0)^2``, then 0."""
        size = abs(u)
        if size <= self.k0:
            return 1.0
        return -2.0 * self.k0 * max(0.0, self.k1 - size) / (self.k1 - self.k0) ** 2

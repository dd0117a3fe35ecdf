"""Hampel's influence function: in three parts, and nothing beyond c."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from strapdown.estimation.influence import Influence, check_rising


@dataclass(frozen=True)
class Hampel(Influence):
    """``psi(u) = u`` up to a, a up to b, then down in a straight line to zero at c.

    Attributes
    ----------
    a, b, c : float
        The default, (1.5, 3.5, 8) times 0.9016085, has 95 % efficiency with normal errors and
        comes down at a third of the slope at zero.
    """

    a: float = 1.35241275
    b: float = 3.15562975
    c: float = 7.212868

    name: ClassVar[str] = "hampel"
    summary: ClassVar[str] = "bounded, then down in a straight line: nothing beyond c"
    source: ClassVar[str] = (
        "Hampel, Ronchetti, Rousseeuw and Stahel 1986, Robust Statistics, p. 150; "
        "constants: Koller and Stahel 2011, Computational Statistics and Data Analysis 55"
    )

    def __post_init__(self) -> None:
        check_rising(self.name, a=self.a, b=self.b, c=self.c)

    @property
    def linear(self) -> float:
        """Up to a."""
        return self.a

    @property
    def knots(self) -> tuple[float, ...]:
        """At a, b and c."""
        return (self.a, self.b, self.c)

    def rho(self, u: float) -> float:
        """Half the square, a straight line, a parabola, and then the same for all."""
        u, a, b, c = abs(u), self.a, self.b, self.c
        if u <= a:
            return 0.5 * u * u
        if u <= b:
            return a * (u - 0.5 * a)
        left = max(0.0, c - u)
        return a * (b - 0.5 * a) + 0.5 * a * ((c - b) - left * left / (c - b))

    def psi(self, u: float) -> float:
        """The residual, then a, then less, then nothing."""
        size = abs(u)
        if size <= self.a:
            return u
        if size <= self.b:
            return math.copysign(self.a, u)
        return math.copysign(self.a * max(0.0, self.c - size) / (self.c - self.b), u)

    def psi_prime(self, u: float) -> float:
        """1, 0, ``-a / (c - b)``, 0."""
        size = abs(u)
        if size <= self.a:
            return 1.0
        return -self.a / (self.c - self.b) if self.b < size <= self.c else 0.0

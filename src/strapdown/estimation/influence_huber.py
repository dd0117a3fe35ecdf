"""Huber's influence function: a residual counts no more than k standard deviations."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from strapdown.estimation.influence import Influence, check_rising


@dataclass(frozen=True)
class Huber(Influence):
    """``psi(u) = u`` up to k, and k beyond.

    Convex: there is one minimiser, and nothing is ever rejected outright, so that an estimate that
    is wrong is always pulled back. A gross error goes on pulling with k standard deviations.

    Attributes
    ----------
    k : float
        1.345 has 95 % efficiency with normal errors.
    """

    k: float = 1.345

    name: ClassVar[str] = "huber"
    summary: ClassVar[str] = "bounded: a gross error pulls with k standard deviations"
    source: ClassVar[str] = "Huber 1964, Annals of Mathematical Statistics 35, 73-101"

    def __post_init__(self) -> None:
        check_rising(self.name, k=self.k)

    @property
    def linear(self) -> float:
        """Up to k."""
        return self.k

    @property
    def knots(self) -> tuple[float, ...]:
        """At k."""
        return (self.k,)

    def rho(self, u: float) -> float:
        """Half the square, then a straight line."""
        u = abs(u)
        return 0.5 * u * u if u <= self.k else self.k * (u - 0.5 * self.k)

    def psi(self, u: float) -> float:
        """The residual, at most k of it."""
        return u if abs(u) <= self.k else math.copysign(self.k, u)

    def psi_prime(self, u: float) -> float:
        """1, then 0."""
        return 1.0 if abs(u) <= self.k else 0.0

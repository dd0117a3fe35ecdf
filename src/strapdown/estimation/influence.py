"""What every influence function is: how much a residual counts, the larger it is."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar

from strapdown.errors import ConfigError


@dataclass(frozen=True)
class Influence(ABC):
    """An M-estimator's rho, psi = rho' and weight = psi / residual.

    Residuals are in units of the standard deviation of a good one. All functions are those of
    least squares near zero: ``psi(u) = u + O(u^2)``; rho and the weight are even, psi is odd and
    continuous.
    """

    name: ClassVar[str]
    summary: ClassVar[str]
    source: ClassVar[str]

    @property
    @abstractmethod
    def linear(self) -> float:
        """Residual up to which it is least squares: ``psi(u) = u``."""

    @property
    @abstractmethod
    def knots(self) -> tuple[float, ...]:
        """Residuals above zero, rising, between which psi is convex or concave."""

    @abstractmethod
    def rho(self, u: float) -> float:
        """Loss of a residual: half its square near zero."""

    @abstractmethod
    def psi(self, u: float) -> float:
        """Influence of a residual."""

    @abstractmethod
    def psi_prime(self, u: float) -> float:
        """Slope of psi; at a bend, that of the side nearer to zero."""

    def weight(self, u: float) -> float:
        """Share of a residual that counts, ``psi(u) / u``, from 1 at zero downwards to 0."""
        return self.psi(u) / u if u else 1.0


def check_rising(name: str, **values: float) -> None:
    """Raise `ConfigError` unless parameters are finite, positive, and rise in the order given."""
    before, known = 0.0, ""
    for quantity, value in values.items():
        if not (math.isfinite(value) and value > before):
            raise ConfigError(
                "estimation.influence-bounds-not-rising"
                if known
                else "estimation.influence-bound-not-positive",
                quantity=quantity,
                parameter=quantity,
                value=value,
                name=name,
                lower=known,
                limit=before,
                order=tuple(values),
            )
        before, known = value, quantity

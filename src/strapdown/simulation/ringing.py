"""Structural ringing: a part of the structure that swings to and fro after a blow."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from strapdown.errors import ConfigError

Array = NDArray[np.float64]
Triple = tuple[float, float, float]

# (1 - e)^2 of the onset, as the sum of its powers.
_BINOMIAL = (1.0, -2.0, 1.0)
# exp(-25) is 1.4e-11.
_LEFT = 25.0


@dataclass(frozen=True)
class Ringing:
    """A damped oscillation of where a unit is mounted, about its place on the rigid vehicle.

    Its displacement begins at rest, is bounded and dies away, so that it moves nothing for good:
    ``X (1 - exp(-w t))² exp(-t/decay) sin(w t)`` with ``w = 2 pi frequency``. The factor in
    brackets lets displacement, velocity and acceleration begin at zero without a jump; after one
    period it is 0.996. A bare ``amplitude exp(-t/decay) sin(w t)`` as the acceleration would leave
    the unit with a velocity of ``amplitude w/(w² + 1/decay²)`` for ever.

    Attributes
    ----------
    start : float, s
        On the clock of the motion.
    amplitude : float, m/s²
        Of the acceleration, on the envelope ``amplitude exp(-t/decay)`` that it follows after the
        first period: ``X (w² + 1/decay²)``. The largest value falls into the onset, and is within
        6 % of it where the ringing lasts (``w decay`` above 20).
    frequency : float, Hz
        Of the damped oscillation.
    decay : float, s
        In which the envelope falls to 1/e.
    direction : tuple of float
        Forward, right, down, in vehicle axes; its length does not count.

    Raises
    ------
    ConfigError
        A number is not finite, a frequency or decay is not positive, or there is no direction.
    """

    start: float
    amplitude: float
    frequency: float
    decay: float
    direction: Triple = (1.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        direction = tuple(float(x) for x in self.direction)
        length = math.hypot(*direction)
        if len(direction) != 3 or not 0.0 < length < math.inf:
            raise ConfigError(
                "simulation.no-direction-2", quantity="direction", direction=self.direction
            )
        object.__setattr__(self, "direction", tuple(x / length for x in direction))
        if not (math.isfinite(self.start) and math.isfinite(self.amplitude)):
            raise ConfigError("simulation.not-finite", quantity="start, amplitude")
        for name in ("frequency", "decay"):
            if not 0.0 < getattr(self, name) < math.inf:
                raise ConfigError("simulation.cannot", quantity=name, value=getattr(self, name))

    def displacement(self, time: ArrayLike) -> Array:
        """From its place on the rigid vehicle, in vehicle axes, (n, 3), m."""
        return self._derivative(time, 0)

    def velocity(self, time: ArrayLike) -> Array:
        """Derivative of the displacement, in vehicle axes, (n, 3), m/s."""
        return self._derivative(time, 1)

    def acceleration(self, time: ArrayLike) -> Array:
        """Second derivative of the displacement, in vehicle axes, (n, 3), m/s²."""
        return self._derivative(time, 2)

    def quarters(self) -> Array:
        """Instants from the start in steps of a quarter of a period, until 1e-11 is left; s."""
        last = math.ceil(_LEFT * self.decay * 4.0 * self.frequency)
        return np.asarray(self.start + np.arange(last + 1) / (4.0 * self.frequency))

    def _derivative(self, time: ArrayLike, order: int) -> Array:
        """Sum of three damped oscillations, each an exponential of a complex rate."""
        t = np.maximum(np.asarray(time, dtype=np.float64) - self.start, 0.0)
        w = 2.0 * math.pi * self.frequency
        out = np.zeros(t.shape)
        for k, part in enumerate(_BINOMIAL):
            s = complex(-1.0 / self.decay - k * w, w)
            out += part * np.imag(s**order * np.exp(s * t))
        scale = self.amplitude / (w * w + 1.0 / (self.decay * self.decay))
        return np.outer(scale * out, self.direction)

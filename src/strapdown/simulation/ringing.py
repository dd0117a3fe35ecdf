"""Structural ringing: a damped oscillation of the mounting point after a blow."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from strapdown.errors import ConfigError

Array = NDArray[np.float64]
Triple = tuple[float, float, float]

# (1 - e)^2 of the onset, expanded in powers.
_BINOMIAL = (1.0, -2.0, 1.0)
# exp(-25) is 1.4e-11.
_LEFT = 25.0


@dataclass(frozen=True)
class Ringing:
    """A damped oscillation of a mounting point about its position on the rigid vehicle.

    The displacement starts at rest, is bounded and decays, so that it leaves no permanent change:
    ``X (1 - exp(-w t))² exp(-t/decay) sin(w t)`` with ``w = 2 pi frequency``. The factor in
    parentheses starts displacement, velocity and acceleration at zero without a jump; after one
    period it is 0.996. A bare acceleration ``amplitude exp(-t/decay) sin(w t)`` would leave the
    unit with a permanent velocity of ``amplitude w/(w² + 1/decay²)``.

    Attributes
    ----------
    start : float, s
        On the motion's clock.
    amplitude : float, m/s²
        Acceleration amplitude: after the first period the envelope is ``amplitude exp(-t/decay)``,
        with ``amplitude = X (w² + 1/decay²)``. The maximum falls in the onset and is within 6 % of
        the amplitude for long ringing (``w decay`` above 20).
    frequency : float, Hz
        Frequency of the damped oscillation.
    decay : float, s
        Time in which the envelope falls to 1/e.
    direction : tuple of float
        Forward, right, down, in vehicle axes; any length.

    Raises
    ------
    ConfigError
        A number is not finite, frequency or decay is not positive, or the direction is zero.
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
        """Displacement from the rigid position, in vehicle axes, (n, 3), m."""
        return self._derivative(time, 0)

    def velocity(self, time: ArrayLike) -> Array:
        """Derivative of the displacement, in vehicle axes, (n, 3), m/s."""
        return self._derivative(time, 1)

    def acceleration(self, time: ArrayLike) -> Array:
        """Second derivative of the displacement, in vehicle axes, (n, 3), m/s²."""
        return self._derivative(time, 2)

    def quarters(self) -> Array:
        """Instants from the start in steps of a quarter period, until the envelope is 1e-11; s."""
        last = math.ceil(_LEFT * self.decay * 4.0 * self.frequency)
        return np.asarray(self.start + np.arange(last + 1) / (4.0 * self.frequency))

    def _derivative(self, time: ArrayLike, order: int) -> Array:
        """Sum of three damped oscillations, each an exponential with a complex rate."""
        t = np.maximum(np.asarray(time, dtype=np.float64) - self.start, 0.0)
        w = 2.0 * math.pi * self.frequency
        out = np.zeros(t.shape)
        for k, part in enumerate(_BINOMIAL):
            s = complex(-1.0 / self.decay - k * w, w)
            out += part * np.imag(s**order * np.exp(s * t))
        scale = self.amplitude / (w * w + 1.0 / (self.decay * self.decay))
        return np.outer(scale * out, self.direction)

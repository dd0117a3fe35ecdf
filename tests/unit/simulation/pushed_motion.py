"""A car on a flat Earth that is pushed once, turning as it goes, in closed form."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from strapdown import rotation
from strapdown.simulation.motion import FlatMotion


@dataclass(frozen=True)
class Pushed(FlatMotion):
    """North at `speed`, then a haversine pulse of velocity and heading rate at `start`."""

    duration: float = 3.0
    start: float = 2.0
    length: float = 0.113
    speed: float = 7.1
    change: tuple = (-7.2, 1.0, 0.3)
    turn: float = np.radians(87.0)
    # An oscillation of the acceleration along each axis, from the pulse on.
    ringing: tuple = (0.0, 0.0, 0.0)
    frequency: float = 195.0
    decay: float = 0.03

    def _phase(self, time):
        since = np.asarray(time, dtype=float) - self.start
        return np.clip(since / self.length, 0.0, 1.0), np.maximum(since - self.length, 0.0), since

    def rate(self, time):
        x, _, _ = self._phase(time)
        out = np.zeros((x.size, 3))
        out[:, 2] = self.turn * (x - np.sin(2 * np.pi * x) / (2 * np.pi))
        return out

    def _integral(self, time):
        x, after, _ = self._phase(time)
        rest = (np.cos(2 * np.pi * x) - 1.0) / (4 * np.pi**2)
        return self.length * (0.5 * x * x + rest) + after

    def angle(self, time):
        out = np.zeros((np.size(time), 3))
        out[:, 2] = self.turn * self._integral(time)
        return out

    def attitude(self, time):
        return rotation.quaternion_from_rotation_vector(self.angle(time))

    def acceleration(self, time):
        x, _, since = self._phase(time)
        rise = (1.0 - np.cos(2 * np.pi * x)) / self.length
        later = np.maximum(since, 0.0)
        ring = np.exp(-later / self.decay) * np.sin(2 * np.pi * self.frequency * later)
        return np.outer(rise, self.change) + np.outer(ring, self.ringing)

    def position(self, time):
        t = np.asarray(time, dtype=float)
        moved = np.outer(self._integral(t), self.change)
        moved[:, 0] += self.speed * t
        return moved

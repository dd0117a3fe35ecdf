"""Haversine pulses in closed form, apart from the code under test."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

KMH = 1.0 / 3.6


@dataclass(frozen=True)
class Pulse:
    """``a = D/T (1 - cos 2 pi x)``, ``v = D (x - sin(2 pi x) / 2 pi)``, x from 0 to 1 over T."""

    change: tuple[float, float, float]
    start: float = 0.0
    length: float = 0.113

    def phase(self, t):
        return np.clip((np.asarray(t, dtype=float) - self.start) / self.length, 0.0, 1.0)

    def accel(self, t):
        rise = (1.0 - np.cos(2.0 * np.pi * self.phase(t))) / self.length
        return np.multiply.outer(rise, self.change)

    def velocity(self, t):
        x = self.phase(t)
        return np.multiply.outer(x - np.sin(2.0 * np.pi * x) / (2.0 * np.pi), self.change)

    def share(self, t):
        """Velocity reached, as a share of the whole."""
        x = self.phase(t)
        return x - np.sin(2.0 * np.pi * x) / (2.0 * np.pi)

    def window(self, t, w):
        """Share of the change within the window that ends at t."""
        return self.share(t) - self.share(np.asarray(t) - w)

    def jerk_most(self):
        """Largest |da/dt| of each component over its change."""
        return 2.0 * np.pi / self.length**2

    def slope(self, t, w):
        """Slope of `window`."""
        return (
            (1.0 - np.cos(2.0 * np.pi * self.phase(t)))
            - (1.0 - np.cos(2.0 * np.pi * self.phase(np.asarray(t) - w)))
        ) / self.length

    def up(self, w, level):
        """First instant at which `window` reaches a level (a share)."""
        middle = self.start + 0.5 * (self.length + w)
        return brentq(lambda t: self.window(t, w) - level, self.start, middle, xtol=1e-15)

    def down(self, w, level):
        """Last instant at which `window` is above a level."""
        middle = self.start + 0.5 * (self.length + w)
        return brentq(
            lambda t: self.window(t, w) - level, middle, self.start + self.length + w, xtol=1e-15
        )


def stamps(rate, begin=-0.1, end=0.75):
    """Stamps of a record, a step apart."""
    return begin + np.arange(round((end - begin) * rate) + 1) / rate


def means(pulses, time):
    """Exact means of the acceleration over the intervals that end at the stamps."""
    h = time[1] - time[0]
    before = np.concatenate([[time[0] - h], time[:-1]])
    return sum(p.velocity(time) - p.velocity(before) for p in pulses) / (time - before)[:, None]

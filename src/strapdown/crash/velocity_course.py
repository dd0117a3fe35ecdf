"""Velocity at any instant of a record, and where its change is largest."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from strapdown.crash.acceleration import Acceleration

Array = NDArray[np.float64]

# Golden section: each turn leaves 0.618 of the interval; 80 leave its rounding.
_GOLDEN = 0.5 * (5.0**0.5 - 1.0)
_TURNS = 80


class VelocityCourse:
    """Integral of an acceleration since its first stamp.

    Parameters
    ----------
    acceleration : Acceleration
        Between instantaneous samples it is a line, over the interval of a mean a constant; so is
        the velocity here the same as `window_weights` gives.
    """

    def __init__(self, acceleration: Acceleration) -> None:
        self._time, values = acceleration.time, acceleration.values
        # The acceleration just after each step's start, and its slope over the step.
        steps = np.diff(self._time)[:, None]
        mean = acceleration.sampling == "mean"
        self._first = values[1:] if mean else values[:-1]
        self._slope = (values[1:] - self._first) / steps
        rise = 0.5 * (self._first + values[1:]) * steps
        self._velocity = np.vstack([np.zeros(3), np.cumsum(rise, axis=0)])

    def _place(self, instants: Array) -> tuple[NDArray[np.int64], Array]:
        time = self._time
        k = np.clip(np.searchsorted(time, instants, side="right") - 1, 0, len(time) - 2)
        return k.astype(np.int64), (instants - time[k])[:, None]

    def velocity(self, instants: Array) -> Array:
        """Velocity at instants, (m, 3), m/s, zero at the first stamp."""
        k, u = self._place(instants)
        moved: Array = self._velocity[k] + u * (self._first[k] + 0.5 * u * self._slope[k])
        return moved

    def rate(self, instants: Array) -> Array:
        """Acceleration at instants, (m, 3), m/s²."""
        k, u = self._place(instants)
        rate: Array = self._first[k] + u * self._slope[k]
        return rate

    def largest_change(
        self, low: float, high: float, window: float, axes: Sequence[int] = (0, 1, 2)
    ) -> float:
        """End in [low, high] of the window in which the velocity changes most, s."""
        time, columns = self._time, list(axes)
        begin = time[0]

        def size(at: Array) -> Array:
            before = np.maximum(at - window, begin)
            change = (self.velocity(at) - self.velocity(before))[:, columns]
            squared: Array = (change**2).sum(axis=1)
            return squared

        # Between these the change is one polynomial.
        return _largest(size, np.r_[time, time + window], low, high)

    def largest_since(self, start: float, end: float, axes: Sequence[int]) -> float:
        """Instant in [start, end] at which the change since `start` is largest, s."""
        columns = list(axes)
        origin = self.velocity(np.array([start]))[:, columns]

        def size(at: Array) -> Array:
            squared: Array = ((self.velocity(at)[:, columns] - origin) ** 2).sum(axis=1)
            return squared

        return _largest(size, self._time, start, end)


def _largest(size: Callable[[Array], Array], breaks: Array, low: float, high: float) -> float:
    """Where a function that is smooth between breaks is largest in an interval."""
    nodes = np.unique(np.r_[low, breaks[(breaks > low) & (breaks < high)], high])
    sizes = size(nodes)
    best = int(np.argmax(sizes))
    at, most = float(nodes[best]), float(sizes[best])
    for a, b in ((best - 1, best), (best, best + 1)):
        if a < 0 or b >= len(nodes):
            continue
        left, right = float(nodes[a]), float(nodes[b])
        for _ in range(_TURNS):
            x, y = right - _GOLDEN * (right - left), left + _GOLDEN * (right - left)
            fx, fy = size(np.array([x, y]))
            left, right = (left, y) if fx >= fy else (x, right)
        middle = 0.5 * (left + right)
        found = float(size(np.array([middle]))[0])
        # A plateau is met where it begins, whatever its rounding.
        if found > most * (1.0 + 1e-12):
            at, most = middle, found
    return at

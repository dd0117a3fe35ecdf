"""Velocity at any instant of a record, and where its change is largest."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from strapdown.crash.acceleration import Acceleration
from strapdown.dsp.running_integral import running_integral

Array = NDArray[np.float64]

#: Value, slope and half the curvature of each component at some instants, (m, k) each.
Polynomials = tuple[Array, Array, Array]


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
        self._velocity = running_integral(self._time, values, means=mean)

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

    def slope(self, instants: Array) -> Array:
        """Slope of the acceleration at instants between stamps, (m, 3), m/s³."""
        k, _ = self._place(instants)
        slope: Array = self._slope[k]
        return slope

    def largest_change(
        self, low: float, high: float, window: float, axes: Sequence[int] = (0, 1, 2)
    ) -> float:
        """End in [low, high] of the window in which the velocity changes most, s."""
        time, columns, begin = self._time, list(axes), self._time[0]

        def course(at: Array) -> Polynomials:
            before = np.maximum(at - window, begin)
            return (
                (self.velocity(at) - self.velocity(before))[:, columns],
                (self.rate(at) - self.rate(before))[:, columns],
                0.5 * (self.slope(at) - self.slope(before))[:, columns],
            )

        # Between these the change is one polynomial.
        return _largest(course, np.r_[time, time + window], low, high)

    def largest_since(self, start: float, end: float, axes: Sequence[int]) -> float:
        """Instant in [start, end] at which the change since `start` is largest, s."""
        columns = list(axes)
        origin = self.velocity(np.array([start]))

        def course(at: Array) -> Polynomials:
            return (
                (self.velocity(at) - origin)[:, columns],
                self.rate(at)[:, columns],
                0.5 * self.slope(at)[:, columns],
            )

        return _largest(course, self._time, start, end)


def _largest(
    course: Callable[[Array], Polynomials], breaks: Array, low: float, high: float
) -> float:
    """Where the length of a vector of quadratics is largest in an interval.

    Parameters
    ----------
    course : callable
        Value, slope and half the curvature at instants between breaks.
    breaks : ndarray
    low, high : float
    """
    nodes = np.unique(np.r_[low, breaks[(breaks > low) & (breaks < high)], high])
    sizes = np.sqrt((course(nodes)[0] ** 2).sum(axis=1))
    best = int(np.argmax(sizes))
    at, most = float(nodes[best]), float(sizes[best])
    if len(nodes) < 2:
        return at
    # About the middles, where no rounding of a break takes the neighbour's polynomial.
    middle, half = 0.5 * (nodes[1:] + nodes[:-1]), 0.5 * np.diff(nodes)
    c0, c1, c2 = course(middle)
    # No point of a piece is further from one of its ends than half its length times the
    # greatest slope, and that is at an end.
    steep = np.sqrt(
        np.maximum(
            ((c1 - 2.0 * c2 * half[:, None]) ** 2).sum(axis=1),
            ((c1 + 2.0 * c2 * half[:, None]) ** 2).sum(axis=1),
        )
    )
    reach = np.maximum(sizes[1:], sizes[:-1]) + half * steep
    for k in np.flatnonzero(reach > most).tolist():
        a, b, c = c0[k], c1[k], c2[k]
        # Derivative of half the squared length: a cubic.
        cubic = [2.0 * c @ c, 3.0 * b @ c, b @ b + 2.0 * a @ c, a @ b]
        roots = np.roots(cubic)
        for u in roots[np.abs(roots.imag) <= 1e-6 * half[k]].real:
            if abs(u) <= half[k]:
                found = float(np.sqrt((((c * u + b) * u + a) ** 2).sum()))
                # A plateau is met where it begins, whatever its rounding.
                if found > most * (1.0 + 1e-12):
                    at, most = float(middle[k] + u), found
    return at

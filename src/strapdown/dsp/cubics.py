"""Cubics between samples: through values and slopes, or the spline through values alone.

In the operations of scipy's `CubicHermiteSpline`, `CubicSpline` and `PPoly`, whose package takes
0.3 s to load: to the last bit the same numbers.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from strapdown._kernels import piecewise
from strapdown.constants import Array


@dataclass(frozen=True, eq=False)
class Polynomials:
    """Polynomials between knots; the outermost ones go on.

    Attributes
    ----------
    knots : ndarray, (n,)
        Increasing.
    coefficients : ndarray, (terms, n - 1, m)
        Highest power first, of the distance from the knot to the left.
    """

    knots: Array
    coefficients: Array

    def __call__(self, at: Array) -> Array:
        """Values, (k, m), at (k,)."""
        k = np.clip(np.searchsorted(self.knots, at, side="right") - 1, 0, len(self.knots) - 2)
        since = (at - self.knots[k])[:, None]
        value, power = self.coefficients[-1, k], since
        for coefficient in self.coefficients[-2::-1]:
            value = value + coefficient[k] * power
            power = power * since
        return np.asarray(value)

    def integral(self) -> Self:
        """From the first knot."""
        terms = len(self.coefficients)
        divided = self.coefficients / np.arange(terms, 0.0, -1.0)[:, None, None]
        step = np.diff(self.knots)[:, None]
        parts, power = [], step
        for coefficient in divided[::-1]:
            parts.append(coefficient * power)
            power = power * step
        # One after the other, as when each constant is the value at the end of the piece before.
        total = np.cumsum(np.stack(parts, axis=1).reshape(-1, step.shape[1] * divided.shape[2]), 0)
        constant = np.concatenate([np.zeros_like(total[:1]), total[terms - 1 : -1 : terms]])
        return type(self)(self.knots, np.concatenate([divided, constant[None]]))


def hermite(knots: Array, values: Array, slopes: Array) -> Polynomials:
    """Cubics through values and slopes, (n, m), at knots, (n,)."""
    step = np.diff(knots)[:, None]
    chord = np.diff(values, axis=0) / step
    bend = (slopes[:-1] + slopes[1:] - 2.0 * chord) / step
    parts = (bend / step, (chord - slopes[:-1]) / step - bend, slopes[:-1], values[:-1])
    return Polynomials(knots, np.stack(parts))


def spline(knots: Array, values: Array) -> Polynomials:
    """Cubic spline through values, (n, m), at knots, (n,), of which there are four or more.

    Two neighbors at either end share a cubic ("not a knot").
    """
    step = np.diff(knots)
    column = step[:, None]
    chord = np.diff(values, axis=0) / column
    first, last = knots[2] - knots[0], knots[-1] - knots[-3]
    diagonal = np.concatenate([step[1:2], 2.0 * (step[:-1] + step[1:]), step[-2:-1]])
    upper = np.concatenate([[first], step[:-1]])
    lower = np.concatenate([step[1:], [last]])
    slopes = np.empty(values.shape)
    slopes[1:-1] = 3.0 * (column[1:] * chord[:-1] + column[:-1] * chord[1:])
    slopes[0] = (step[0] + 2.0 * first) * step[1] * chord[0] + step[0] ** 2 * chord[1]
    slopes[-1] = step[-1] ** 2 * chord[-2] + (2.0 * last + step[-1]) * step[-2] * chord[-1]
    slopes[[0, -1]] /= np.array([[first], [last]])
    piecewise.solve_tridiagonal(lower, diagonal, upper, slopes)
    return hermite(knots, values, slopes)

"""Splines of the fifth degree with their derivatives."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

_DEGREE = 5  # continuous to the fourth derivative


@dataclass(frozen=True, eq=False)
class Spline:
    """Quintic spline of m coordinates: knots (p + 1,), coefficients (p, 6, m)."""

    knots: Array
    coefficients: Array

    def __call__(self, time: Array) -> tuple[Array, Array, Array]:
        """Value and first two derivatives, (n, m) each."""
        from strapdown._kernels.piecewise import polynomials

        shape = (time.size, self.coefficients.shape[2])
        value, first, second = np.empty(shape), np.empty(shape), np.empty(shape)
        polynomials(self.knots, self.coefficients, time, value, first, second)
        return value, first, second


def quintic(time: ArrayLike, values: ArrayLike) -> Spline:
    """Spline of the fifth degree through values, whose third and fourth derivatives end at zero.

    Parameters
    ----------
    time : array_like, (n,), s
        Two or more, rising.
    values : array_like, (n, m)

    Returns
    -------
    Spline
        With continuous fourth derivative: of all curves through the values the one of least mean
        square third derivative. Two values give a straight line.
    """
    from scipy.interpolate import make_interp_spline

    t, rows = np.asarray(time, dtype=np.float64), np.asarray(values, dtype=np.float64)
    zero = np.zeros(rows.shape[1])
    if len(t) == 2:
        slope = (rows[1] - rows[0]) / (t[1] - t[0])
        coefficients = np.zeros((1, _DEGREE + 1, rows.shape[1]))
        coefficients[0, -2], coefficients[0, -1] = slope, rows[0]
        return Spline(t, coefficients)
    ends = [(3, zero), (4, zero)]
    spline = make_interp_spline(t, rows, k=_DEGREE, bc_type=(ends, ends))  # type: ignore[arg-type]
    knots = np.unique(spline.t)
    # Taylor coefficients at the left of each piece, highest power first.
    powers = [spline(knots[:-1], nu=k) / math.factorial(k) for k in range(_DEGREE, -1, -1)]
    return Spline(knots, np.ascontiguousarray(np.stack(powers, axis=1)))

"""Integral of a body rate without closed form, to rounding."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

_NODES = 16
_X, _W = legendre.leggauss(_NODES)
# Rate at the nodes to Legendre coefficients: c_j = (2j + 1)/2 sum_i w_i P_j(x_i) f(x_i), exact for
# polynomials that 16 nodes determine.
_TO_COEFFICIENTS = (np.arange(_NODES) + 0.5)[:, None] * (
    legendre.legvander(_X, _NODES - 1) * _W[:, None]
).T
# Truncation error of the series within one panel, rad.
_TOLERANCE = 1e-14
# Shortest panel, s; below it rounding dominates the truncation error.
_SHORTEST = 1e-5


@dataclass(frozen=True)
class RateIntegral:
    """Integral of a rate as Legendre series over panels.

    Attributes
    ----------
    edges : ndarray, (p + 1,), s
    before : ndarray, (p, 3), rad
        Integral up to the left edge of each panel.
    series : ndarray, (p, 17, 3), rad
        Legendre coefficients of the integral within each panel.
    """

    edges: Array
    before: Array
    series: Array

    def __call__(self, time: ArrayLike) -> Array:
        """Integral from the first edge; constant beyond both ends; (n, 3), rad."""
        from strapdown._kernels.piecewise import legendre_sums

        t = np.clip(np.asarray(time, dtype=np.float64), self.edges[0], self.edges[-1])
        out = np.empty((t.size, 3))
        legendre_sums(self.edges, self.before, self.series, t, out)
        return out


def integrate_rate(rate: Callable[[ArrayLike], Array], breaks: Sequence[float]) -> RateIntegral:
    """Integrate a piecewise smooth rate.

    `rate`: (n,) instants in s to (n, 3) rates in rad/s. `breaks` (s): instants where the rate or a
    derivative may jump; the first and the last are the ends.

    Sixteen Gauss-Legendre nodes per panel give the Legendre coefficients c_j of the rate. The
    integral of P_n over any part of a panel of half-length h is at most 2h/(2n+1), so the first
    omitted term contributes at most ``2h |c_16| / 33``. Where ``2h |c| / 29`` of the last two terms
    kept (two, because symmetry can make one vanish) exceeds 1e-14 rad, the panel is halved. c
    decreases geometrically for an analytic rate, and the integral over a whole panel is exact to
    degree 31. The sums over the panels are compensated.
    """
    edges = np.unique(np.asarray(breaks, dtype=np.float64))
    left, right = edges[:-1], edges[1:]
    lefts, lengths, series = [], [], []
    while left.size:
        half = 0.5 * (right - left)
        nodes = left[:, None] + half[:, None] * (1.0 + _X)
        values = rate(nodes.ravel()).reshape(left.size, _NODES, 3)
        c = _TO_COEFFICIENTS @ values
        tail = np.abs(c[:, -2:]).max(axis=(1, 2))
        good = (2.0 * half * tail / (2 * _NODES - 3) <= _TOLERANCE) | (half < _SHORTEST)
        lefts.append(left[good])
        lengths.append(half[good])
        series.append(c[good])
        middle = left[~good] + half[~good]
        left, right = np.concatenate([left[~good], middle]), np.concatenate([middle, right[~good]])
    order = np.argsort(np.concatenate(lefts))
    starts = np.concatenate(lefts)[order]
    half = np.concatenate(lengths)[order]
    rates = np.moveaxis(np.concatenate(series)[order], 1, 0)
    integrals = legendre.legint(rates, lbnd=-1, axis=0) * half[:, None]
    whole = 2.0 * half[:, None] * rates[0]
    return RateIntegral(
        np.append(starts, edges[-1]),
        _sums(whole),
        np.ascontiguousarray(np.moveaxis(integrals, 0, 1)),
    )


def _sums(terms: Array) -> Array:
    """Sum of all preceding terms, compensated (Neumaier 1974)."""
    out = np.zeros_like(terms)
    total, lost = np.zeros(3), np.zeros(3)
    for k in range(len(terms) - 1):
        term = terms[k]
        new = total + term
        lost += np.where(np.abs(total) >= np.abs(term), (total - new) + term, (term - new) + total)
        total = new
        out[k + 1] = total + lost
    return out

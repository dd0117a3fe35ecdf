"""Directions that units measure, where some of them assume others."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from strapdown.crash.at_point import AtPoint
from strapdown.crash.unit_differences import floored

Array = NDArray[np.float64]

__all__ = ["chi_square_along", "measured_axes", "measured_by_all", "measured_by_any"]

# Of squared cosines: a direction is within what is measured, or has nothing of it.
ROUNDING = 1e-9
# An axis is measured where so much of it is (squared cosine): 18 deg.
MOST = 0.9


def measured_by_all(units: Sequence[AtPoint]) -> Array:
    """Orthonormal columns of the directions along which each of the units measures, (3, r)."""
    total = sum((_unmeasured(u) for u in units), np.zeros((3, 3)))
    if not total.any():
        return np.eye(3)
    values, vectors = np.linalg.eigh(total)
    return np.asarray(vectors[:, values < ROUNDING])


def measured_by_any(units: Sequence[AtPoint]) -> Array:
    """Orthonormal columns of the directions along which at least one of them measures, (3, r)."""
    measured = np.mean([np.eye(3) - _unmeasured(u) for u in units], axis=0)
    values, vectors = np.linalg.eigh(measured)
    return np.asarray(vectors[:, values > ROUNDING])


def measured_axes(basis: Array) -> NDArray[np.bool_]:
    """Which of the vehicle's axes lie within these directions, (3,)."""
    return np.asarray((basis**2).sum(axis=1) > MOST)


def chi_square_along(basis: Array, difference: Array, covariance: Array) -> tuple[float, int]:
    """Chi-square of a difference along some directions, and its degrees of freedom.

    Parameters
    ----------
    basis : ndarray, (3, r)
        Orthonormal columns.
    difference : ndarray, (3 m,)
        By piece, then axis.
    covariance : ndarray, (3 m, 3 m)
    """
    if basis.shape[1] < 3:
        along = np.kron(np.eye(difference.size // 3), basis)
        difference, covariance = along.T @ difference, along.T @ covariance @ along
    if not difference.size:
        return 0.0, 0
    return float(difference @ np.linalg.solve(floored(covariance), difference)), difference.size


def _unmeasured(unit: AtPoint) -> Array:
    return np.zeros((3, 3)) if unit.unmeasured is None else unit.unmeasured

"""95 % bounds of an error in a plane."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

__all__ = ["PLANE_95", "plane_bound", "plane_reach"]

Array = NDArray[np.float64]

#: Half axes of the 95 % ellipse of a normal error in a plane, over the standard deviations along
#: them: the root of the chi-square of two degrees of freedom, -2 ln 0.05.
PLANE_95 = math.sqrt(-2.0 * math.log(0.05))


def plane_bound(covariance: Array) -> Array:
    """Return the longer half axis of the 95 % ellipse of each covariance.

    Parameters
    ----------
    covariance : ndarray, (n, k, k)
        Of two components or more, of which the first two are those of the plane.

    Returns
    -------
    ndarray, (n,)
        In the unit of the components.
    """
    largest = np.linalg.eigvalsh(covariance[:, :2, :2])[:, 1]
    return np.asarray(PLANE_95 * np.sqrt(np.maximum(largest, 0.0)))


def plane_reach(size: Array, distance: Array, covariance: Array) -> Array:
    """Radius of the 95 % ellipse along errors of length `size` and Mahalanobis `distance`, (n,).

    An error of no length has no direction, and gets the longer half axis.
    """
    some = distance > 0.0
    along = PLANE_95 * size / np.where(some, distance, 1.0)
    return np.where(some, along, plane_bound(covariance))

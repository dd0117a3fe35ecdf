"""Parity of redundant axes: what they tell of each other whatever the motion is."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from strapdown.errors import ConfigError

Array = NDArray[np.float64]

__all__ = ["checked_directions", "isolable_axes", "parity_matrix"]

# Of the smallest over the largest singular value, and of the cosine of two parity columns.
RANK = 1e-6
PARALLEL = 1e-9


def checked_directions(directions: ArrayLike) -> Array:
    """Unit vectors, one a row, that span the space.

    Raises
    ------
    ConfigError
        They are no (m, 3) numbers of length one to within 1e-6, or lie in a plane.
    """
    h = np.asarray(directions, dtype=np.float64)
    if h.ndim != 2 or h.shape[1] != 3 or h.shape[0] < 3 or not np.isfinite(h).all():
        raise ConfigError("sensors.directions-shape", quantity="directions", shape=h.shape)
    off = np.abs(np.sqrt((h**2).sum(axis=1)) - 1.0)
    if off.max() > 1e-6:
        raise ConfigError(
            "sensors.row-length-or-inverse",
            quantity="directions",
            argmax=int(off.argmax()) + 1,
            off=1.0 + off.max(),
        )
    values = np.linalg.svd(h, compute_uv=False)
    if values[-1] < RANK * values[0]:
        raise ConfigError("sensors.all-axes-lie-plane", quantity="directions")
    return np.ascontiguousarray(h)


def parity_matrix(directions: ArrayLike) -> Array:
    """Matrix V that no motion passes: ``V H = 0``, ``V Vᵀ = I``.

    Parameters
    ----------
    directions : array_like, (m, 3)
        H, unit vectors along which the axes measure.

    Returns
    -------
    ndarray, (m - 3, m)
        The parity vector of readings z is ``p = V z``. Errors e of covariance C give it the
        covariance ``V C Vᵀ``, and ``pᵀ (V C Vᵀ)⁻¹ p`` is chi-square with m - 3 degrees of freedom.
        Its sign and turn are those of a singular value decomposition.

    Notes
    -----
    Potter and Suman 1977 (AGARDograph 224, Thresholdless redundancy management with arrays of
    skewed instruments). An axis that fails moves p along its own column of V: one of five axes or
    more can be told by that, where no two columns are parallel.
    """
    h = checked_directions(directions)
    u, _, _ = np.linalg.svd(h, full_matrices=True)
    return np.ascontiguousarray(u[:, 3:].T)


def isolable_axes(directions: ArrayLike) -> NDArray[np.bool_]:
    """Which axes, where one fails, can be told from every other, (m,)."""
    v = parity_matrix(directions)
    m = v.shape[1]
    if v.shape[0] < 2:
        return np.zeros(m, dtype=bool)
    length = np.sqrt((v**2).sum(axis=0))
    seen = length > RANK
    unit = v / np.where(seen, length, 1.0)
    cosine = np.abs(unit.T @ unit) - np.eye(m)
    return np.asarray(seen & ~(cosine > 1.0 - PARALLEL).any(axis=1))

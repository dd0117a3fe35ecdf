"""Weights of units in their mean: one number an axis for the whole record."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from strapdown.crash.at_point import AtPoint
from strapdown.crash.clipped_samples import clipped_axes
from strapdown.crash.unit_differences import floored

Array = NDArray[np.float64]

__all__ = ["by_none", "crash_steps", "force_weights"]

# What is weighed: the change of velocity from shortly before the impact to the end of the path.
CRASH_WINDOW = (-0.1, 0.75)  # s
# Of squared cosines.
ROUNDING = 1e-9


def force_weights(units: Sequence[AtPoint]) -> Array:
    """Weights of the specific forces of units in their mean.

    Parameters
    ----------
    units : sequence of AtPoint
        k units at one point and at the same stamps.

    Returns
    -------
    ndarray, (k, 3, 3)
        Of vehicle axes, summing to the identity. Diagonal and from zero to one, where every axis
        that a unit lacks is one of the vehicle's: then a change of velocity of the mean lies
        between those of the units, axis by axis, over every window.

    Notes
    -----
    In each axis the weights w of sum one, none negative, with the least ``wᵀ C w``, where C is the
    joint covariance of the units' changes of velocity along it from 0.1 s before to 0.75 s after
    the trigger (`velocity_covariance`). They depend on the samples through the size of the stated
    errors over the whole crash alone. Weights of each sample would not do: the stated error of a
    scale factor or of a misalignment grows with the reading, so that the unit that reads less
    would always count for more, and a mean of units that ring or disagree would be less than any
    of them. Nor would weights that change in time, as with the range that speaks: a change of
    velocity could lie outside.

    Where one unit was clipped along an axis and another was not, it does not count there.
    """
    covariance = velocity_covariance(units)
    missing = [u.unmeasured for u in units]
    aligned = all(
        p is None or np.abs(p - np.diag(np.diagonal(p))).max() < ROUNDING for p in missing
    )
    if not aligned:
        return _turned_weights(covariance, missing)
    weights = np.zeros((len(units), 3, 3))
    lacks = np.array([np.zeros(3) if p is None else np.diagonal(p) for p in missing]) > 0.5
    cut = np.array([clipped_axes(u, CRASH_WINDOW) for u in units])
    for axis in range(3):
        counts = ~lacks[:, axis]
        if (counts & ~cut[:, axis]).any():
            counts &= ~cut[:, axis]
        if not counts.any():
            counts[:] = True
        weights[counts, axis, axis] = least_variance(covariance[axis][np.ix_(counts, counts)])
    return weights


def crash_steps(time: Array) -> Array:
    """Steps of the crash window, zero outside of it; all, where no stamp lies in it.

    Parameters
    ----------
    time : ndarray, (n,), s
        From the trigger.

    Returns
    -------
    ndarray, (n,), s
    """
    steps = np.gradient(time)
    within = (time >= CRASH_WINDOW[0]) & (time <= CRASH_WINDOW[1])
    return np.where(within, steps, 0.0) if within.any() else steps


def velocity_covariance(units: Sequence[AtPoint]) -> Array:
    """Joint covariance of the changes of velocity of units over the crash, axis by axis.

    Parameters
    ----------
    units : sequence of AtPoint
        k units, at the same stamps.

    Returns
    -------
    ndarray, (3, k, k), (m/s)²
        Of the integral of the specific force along each vehicle axis. Unknowns of one name are one
        unknown; noise is that of independent samples.
    """
    steps = crash_steps(units[0].time)
    columns: dict[str, int] = {}
    for u in units:
        for name in u.effects.names:
            columns.setdefault(name, len(columns))
    spread = np.zeros((len(units), len(columns), 3))
    noise = np.zeros((len(units), 3))
    for k, u in enumerate(units):
        at = [columns[name] for name in u.effects.names]
        spread[k, at] = np.tensordot(steps, u.effects.force, axes=(0, 1))
        noise[k] = steps**2 @ u.effects.force_noise**2
    shared = np.einsum("apx,bpx->xab", spread, spread)
    return np.asarray(shared + noise.T[:, :, None] * np.eye(len(units)))


def least_variance(covariance: Array) -> Array:
    """Weights of sum one, none negative, with which a mean has the least variance.

    Parameters
    ----------
    covariance : ndarray, (k, k)

    Returns
    -------
    ndarray, (k,)

    Notes
    -----
    ``min |Lᵀ w|² + (1 - 1ᵀ w)²`` over ``w >= 0``, with ``C = L Lᵀ``: for every direction of w the
    best length gives ``q / (1 + q)``, q the variance of the weights of that direction whose sum is
    one, so that the direction is the one wanted.
    """
    from scipy.optimize import nnls

    one = floored(covariance)
    one = one / np.diagonal(one).min()
    root = np.vstack([np.linalg.cholesky(one).T, np.ones(len(one))])
    found, _ = nnls(root, np.append(np.zeros(len(one)), 1.0))
    return np.asarray(found / found.sum())


def by_none(projections: Sequence[Array | None]) -> Array | None:
    """Projection onto the directions that none of several units measures."""
    given = [p for p in projections if p is not None]
    if len(given) < len(projections):
        return None
    values, vectors = np.linalg.eigh(np.mean(given, axis=0))
    kept = vectors[:, values > 1.0 - ROUNDING]
    return np.asarray(kept @ kept.T) if kept.size else None


def _turned_weights(covariance: Array, missing: Sequence[Array | None]) -> Array:
    """Where a missing axis is none of the vehicle's it cannot be had by axis."""
    information = []
    for k, unmeasured in enumerate(missing):
        own = floored(np.diag(covariance[:, k, k]))
        gone = np.zeros((3, 3)) if unmeasured is None else unmeasured
        kept = np.eye(3) - gone
        information.append(kept @ np.linalg.inv(kept @ own @ kept + gone) @ kept)
    none = by_none(missing)
    if none is not None:
        # Along what none measures all are as good as one another.
        size = float(np.mean(np.trace(information, axis1=-2, axis2=-1)))
        information = [i + size * none for i in information]
    total = np.linalg.inv(np.sum(information, axis=0))
    return np.array([total @ i for i in information])

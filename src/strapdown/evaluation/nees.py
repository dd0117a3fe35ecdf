"""Errors against what was claimed of them: normalised squares and their bounds."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from strapdown.dsp.chi_square import chi_square_exceeded, chi_square_quantile
from strapdown.errors import DataError

__all__ = ["SHARE", "band_of_mean", "bounds", "normalised_squares"]

Array = NDArray[np.float64]

#: Of the bounds, where nothing else is said.
SHARE = 0.95


def normalised_squares(errors: Array, covariance: Array) -> Array:
    """Return ``e' P^-1 e`` of each epoch (NEES), chi-square if P is what is claimed of e.

    Bar-Shalom, Li and Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001,
    Eq. (5.4.2-1). Each component counts in units of its own standard deviation, so that metres
    beside radians cost no digits.

    Parameters
    ----------
    errors : ndarray, (..., n)
    covariance : ndarray, (..., n, n)

    Returns
    -------
    ndarray, (...)

    Raises
    ------
    DataError
        A covariance is not positive definite; its first epoch is named.
    """
    sd = np.sqrt(np.diagonal(covariance, axis1=-2, axis2=-1))
    if not np.all(sd > 0.0):
        raise _not_positive(np.argwhere(~(sd > 0.0))[0])
    e = errors / sd
    P = covariance / (sd[..., :, None] * sd[..., None, :])
    try:
        factor = np.linalg.cholesky(P)
    except np.linalg.LinAlgError:
        bad = np.linalg.eigvalsh(P)[..., 0] <= 0.0
        raise _not_positive(np.argwhere(bad)[0] if bad.any() else np.zeros(1, int)) from None
    y = np.linalg.solve(factor, e[..., None])[..., 0]
    return np.asarray(np.sum(y * y, axis=-1))


def bounds(freedom: int, share: float = SHARE) -> tuple[float, float]:
    """Return the two-sided bounds within which a share of chi-square numbers is."""
    outside = 0.5 - 0.5 * share
    return chi_square_quantile(outside, freedom), chi_square_exceeded(outside, freedom)


def band_of_mean(freedom: int, runs: int, share: float = SHARE) -> tuple[float, float]:
    """Return the bounds of the mean over independent runs of a chi-square number each.

    Bar-Shalom et al. (2001), Eq. (5.4.2-9): ``chi2(runs * freedom) / runs``.
    """
    low, high = bounds(freedom * runs, share)
    return low / runs, high / runs


def _not_positive(at: NDArray[np.int_]) -> DataError:
    return DataError(
        "evaluation.covariance-not-positive-definite", row=int(at[0]) + 1, quantity="covariance"
    )

"""Chi-square, normal, Student, binomial distributions without scipy.stats; 95 % ellipses."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from strapdown.constants import Array


def chi_square_quantile(share: Any, freedom: Any) -> Any:
    """Compute the chi-square quantile of a probability.

    `share`: probability of a value below the quantile, 0 to 1. `freedom`: degrees of freedom, above
    0. Returns float or ndarray: ``2 P⁻¹(freedom/2, share)``, P the regularized incomplete gamma
    function (DLMF 8.2.4).
    """
    from scipy.special import gammaincinv

    return _plain(2.0 * gammaincinv(0.5 * np.asarray(freedom, dtype=np.float64), share))


def chi_square_exceeded(share: Any, freedom: Any) -> Any:
    """Compute the chi-square value exceeded with a probability; exact for small ones."""
    from scipy.special import chdtri

    return _plain(chdtri(freedom, share))


def chi_square_below(value: Any, freedom: Any) -> Any:
    """Compute the chi-square probability below a value of 0 or more."""
    from scipy.special import chdtr

    return _plain(chdtr(freedom, value))


def chi_square_above(value: Any, freedom: Any) -> Any:
    """Compute the chi-square probability above a value of 0 or more; exact for small ones."""
    from scipy.special import chdtrc

    return _plain(chdtrc(freedom, value))


def normal_quantile(share: Any) -> Any:
    """Compute the quantile of the standard normal distribution."""
    from scipy.special import ndtri

    return _plain(ndtri(share))


def normal_above(value: Any) -> Any:
    """Compute the standard normal probability above a value; exact for small ones."""
    from scipy.special import ndtr

    return _plain(ndtr(-np.asarray(value)))


def student_quantile(share: float, freedom: float) -> float:
    """Compute the quantile of Student's distribution."""
    from scipy.special import stdtrit

    return float(stdtrit(freedom, share))


def student_above(value: float, freedom: float) -> float:
    """Compute the probability of Student's distribution above a value."""
    from scipy.special import stdtr

    return float(stdtr(freedom, -value))


def binomial_at_least(hits: float, trials: float, probability: float) -> float:
    """Compute the binomial probability of `hits` or more; neither number need be whole.

    The regularized incomplete beta function ``I_p(k, n - k + 1)`` (DLMF 8.17.5).
    """
    from scipy.special import betainc

    return float(betainc(hits, trials - hits + 1.0, probability)) if hits > 0.0 else 1.0


def binomial_quantile(share: Any, trials: Any, probability: Any) -> NDArray[np.int64]:
    """Compute the smallest count of hits that is not exceeded with a probability of `share`.

    Bisection over the binomial distribution ``I_q(n - k, k + 1)``, q = 1 - `probability`
    (DLMF 8.17.5), so that the count is the exact one. The arguments are broadcast.
    """
    from scipy.special import betainc

    share, trials, probability = np.broadcast_arrays(share, trials, probability)
    low, high = np.full(share.shape, -1, np.int64), trials.astype(np.int64)
    while (high - low > 1).any():
        middle = (low + high) // 2
        enough = betainc(trials - middle, middle + 1.0, 1.0 - probability) >= share
        low, high = np.where(enough, low, middle), np.where(enough, middle, high)
    return np.asarray(high, dtype=np.int64)


def clopper_pearson(hits: float, trials: float, confidence: float = 0.95) -> tuple[float, float]:
    """Compute the exact interval of a probability of which `hits` of `trials` were seen.

    Clopper and Pearson (1934): it contains the probability with `confidence` or more, whatever the
    probability is. Without trials it is 0 to 1.
    """
    from scipy.special import betaincinv

    tail, misses = 0.5 * (1.0 - confidence), trials - hits
    low = float(betaincinv(hits, misses + 1.0, tail)) if hits > 0.0 else 0.0
    high = 1.0 - float(betaincinv(misses, hits + 1.0, tail)) if misses > 0.0 else 1.0
    return low, high


def _plain(values: Any) -> Any:
    return float(values) if np.ndim(values) == 0 else values


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

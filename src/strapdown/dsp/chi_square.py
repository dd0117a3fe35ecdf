"""Chi-square and normal distributions, without the time that loading scipy.stats takes."""

from __future__ import annotations

from typing import Any

import numpy as np

__all__ = [
    "chi_square_above",
    "chi_square_below",
    "chi_square_exceeded",
    "chi_square_quantile",
    "normal_above",
    "normal_quantile",
]


def chi_square_quantile(share: Any, freedom: Any) -> Any:
    """Return what a share of chi-square numbers is below.

    Parameters
    ----------
    share : array_like
        0 to 1.
    freedom : array_like
        Degrees of freedom, more than 0.

    Returns
    -------
    float or ndarray
        ``2 P⁻¹(freedom/2, share)``, P the regularised incomplete gamma function (DLMF 8.2.4).
    """
    from scipy.special import gammaincinv

    return _plain(2.0 * gammaincinv(0.5 * np.asarray(freedom, dtype=np.float64), share))


def chi_square_exceeded(share: Any, freedom: Any) -> Any:
    """Return what a share of chi-square numbers is above, exact where it is small."""
    from scipy.special import chdtri

    return _plain(chdtri(freedom, share))


def chi_square_below(value: Any, freedom: Any) -> Any:
    """Return the probability of less than a value, 0 or more."""
    from scipy.special import chdtr

    return _plain(chdtr(freedom, value))


def chi_square_above(value: Any, freedom: Any) -> Any:
    """Return the probability of more than a value, 0 or more, exact where it is small."""
    from scipy.special import chdtrc

    return _plain(chdtrc(freedom, value))


def normal_quantile(share: Any) -> Any:
    """Return what a share of normal numbers of mean 0 and variance 1 is below."""
    from scipy.special import ndtri

    return _plain(ndtri(share))


def normal_above(value: Any) -> Any:
    """Return the probability of more than a value, exact where it is small."""
    from scipy.special import ndtr

    return _plain(ndtr(-np.asarray(value)))


def _plain(values: Any) -> Any:
    return float(values) if np.ndim(values) == 0 else values

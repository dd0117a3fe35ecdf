"""Chi-square and normal distributions, without the load time of scipy.stats."""

from __future__ import annotations

from typing import Any

import numpy as np


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


def _plain(values: Any) -> Any:
    return float(values) if np.ndim(values) == 0 else values

"""Observations whose errors last, for a filter that takes each for new."""

from __future__ import annotations

import math

__all__ = ["longer_by"]


def longer_by(interval: float, correlation_time: float) -> float:
    """Return by how much the variance of a mean of correlated errors exceeds that of others.

    Parameters
    ----------
    interval : float, s
        Between observations.
    correlation_time : float, s
        Zero: errors are new each time.

    Returns
    -------
    float
        ``(1 + rho) / (1 - rho)``, ``rho = exp(-interval / correlation_time)``: what the variance of
        the mean of many is times their number.
    """
    if correlation_time == 0.0:
        return 1.0
    rho = math.exp(-interval / correlation_time)
    return (1.0 + rho) / (1.0 - rho)

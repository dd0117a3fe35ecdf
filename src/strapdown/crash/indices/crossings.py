"""When a quantity that is known with its slope first reaches a level."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def cubic(time: Array, values: Array, slopes: Array, at: float) -> tuple[float, float]:
    """Value and slope between samples, along the cubic that the two neighbours share.

    Exact for the double integral of an acceleration that is linear between samples.

    Parameters
    ----------
    time, values, slopes : ndarray, (n,)
    at : float
        Within the record.
    """
    k = int(np.clip(np.searchsorted(time, at, side="right") - 1, 0, time.size - 2))
    h = float(time[k + 1] - time[k])
    u = (at - float(time[k])) / h
    y0, y1 = float(values[k]), float(values[k + 1])
    m0, m1 = h * float(slopes[k]), h * float(slopes[k + 1])
    a = 2.0 * (y0 - y1) + m0 + m1
    b = 3.0 * (y1 - y0) - 2.0 * m0 - m1
    return ((a * u + b) * u + m0) * u + y0, ((3.0 * a * u + 2.0 * b) * u + m0) / h


def first_reach(time: Array, values: Array, slopes: Array, level: float) -> float | None:
    """Return the first instant at which a quantity comes up to a level from below.

    Parameters
    ----------
    time, values, slopes : ndarray, (n,)
    level : float

    Returns
    -------
    float or None
        None where it stays below. A touch within one step that both its ends are below is not
        seen.
    """
    above = np.flatnonzero(values >= level)
    if not above.size:
        return None
    k = int(above[0])
    if k == 0:
        return float(time[0])
    from scipy.optimize import brentq

    def short(at: float) -> float:
        return cubic(time, values, slopes, at)[0] - level

    # The value at a knot is that of the samples to rounding: a root there has no change of sign.
    if short(float(time[k])) <= 0.0:
        return float(time[k])
    return float(brentq(short, float(time[k - 1]), float(time[k]), xtol=1e-15, rtol=1e-14))

"""What a quantity exceeds by chance, told by the tail of its own values over a record."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

__all__ = ["tail_limit"]


def tail_limit(
    values: ArrayLike, near: int, far: int, false_alarm: float, *, slack: float = 1.0
) -> float:
    """Extrapolate the tail of a record's own values.

    Parameters
    ----------
    values : array_like, (m,)
        Most of them sound.
    near, far : int
        Ranks from the largest, ``near > far``, between which the tail is told. Fewer than `far`
        that are not sound hardly move it.
    false_alarm : float
        Probability that the largest of the sound ones exceeds the limit.
    slack : float
        Factor on the scale of the tail.

    Returns
    -------
    float
        ``u + slack e ln(far / false_alarm)`` with u of rank `far` and the scale
        ``e = (u - v) / ln(near / far)``, v of rank `near`: exact for a geometric or exponential
        tail, too high for a normal one. Infinite where there are fewer than `near` values, or
        `far` is none.

    Notes
    -----
    Peaks over a threshold with the shape parameter zero (Coles 2001, An Introduction to
    Statistical Modeling of Extreme Values, section 4.2), the scale from two order statistics,
    which a few outliers do not move.
    """
    x = np.asarray(values, dtype=np.float64)
    if far < 1 or near <= far or x.size < near:
        return math.inf
    ordered = np.partition(x, [x.size - near, x.size - far])
    v, u = float(ordered[x.size - near]), float(ordered[x.size - far])
    return u + slack * (u - v) / math.log(near / far) * math.log(far / false_alarm)

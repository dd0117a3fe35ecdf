"""Holes in a record."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike


@dataclass(frozen=True)
class Gap:
    """A hole in a record.

    Attributes
    ----------
    start, end : float, s
        The stamps on its two sides.
    usual : float, s
        The step that the record usually keeps.
    sample : int
        Position of the sample after the gap, counted from 0.
    """

    start: float
    end: float
    usual: float
    sample: int

    @property
    def length(self) -> float:
        """Length of the gap in s."""
        return self.end - self.start


def find_gaps(time: ArrayLike) -> list[Gap]:
    """Find the steps that are far longer than a record's own habit.

    Parameters
    ----------
    time : array_like, (n,), s
        Increasing stamps. Bursts, as of a phone that sends over a network, are a habit: a
        gap is a step of more than three times the step that 95 % of the steps do not exceed.

    Returns
    -------
    list of Gap
        In order of time.
    """
    stamps = np.asarray(time, dtype=np.float64)
    steps = np.diff(stamps)
    if steps.size < 2:
        return []
    usual = float(np.quantile(steps, 0.95, method="lower"))
    return [
        Gap(float(stamps[k]), float(stamps[k + 1]), usual, int(k) + 1)
        for k in np.flatnonzero(steps > 3.0 * usual)
    ]

"""What a smoother found of a run."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from strapdown.mechanization.mechanization import Mechanization
from strapdown.navigation.engine import SAME_INSTANT

__all__ = ["Smoothed"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Smoothed:
    """Errors that a filter's states have, by all observations, and what is left unknown.

    Attributes
    ----------
    mechanization : Mechanization
    time : ndarray, (k,), s
        Of the nodes.
    errors : ndarray, (k, 9)
        Of the state at each, level axes of the mechanization.
    mark_errors : ndarray, (m, 9)
        Of the state at each mark, north-east-down.
    covariance : ndarray, (m, 9, 9)
        At the marks, north-east-down.
    sensors : ndarray, (m, s)
        What the estimates of the sensors then still lack.
    sensors_sd : ndarray, (m, s)
    """

    mechanization: Mechanization
    time: Array
    errors: Array
    mark_errors: Array
    covariance: Array
    sensors: Array
    sensors_sd: Array

    def corrected(self, time: Array, history: Array) -> Array:
        """Return rows of a history without the errors that were found.

        Between two nodes an error goes along a line: a tenth of a second apart, what is left is
        less than a thousandth of what is smoothed.

        Parameters
        ----------
        time : ndarray, (n,), s
        history : ndarray, (n, row)

        Returns
        -------
        ndarray, (n, row)
        """
        # At an instant with several nodes the last one is of the state that is shown.
        right = np.searchsorted(self.time, time + SAME_INSTANT, side="right")
        before = np.clip(right - 1, 0, len(self.time) - 1)
        after = np.clip(right, 0, len(self.time) - 1)
        length = self.time[after] - self.time[before]
        part = np.clip(time - self.time[before], 0.0, None)
        share = np.divide(part, length, out=np.zeros_like(part), where=length > 0.0)
        # Beyond the last node of a filter nothing grows that was noted.
        share = np.minimum(share, 1.0)[:, None]
        errors = (1.0 - share) * self.errors[before] + share * self.errors[after]
        return self.mechanization.corrected_history(history, errors)

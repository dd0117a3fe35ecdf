"""Whether a filter and its smoother can both be right."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from strapdown.ellipsoids import WGS84, Ellipsoid
from strapdown.evaluation.trajectory_differences import trajectory_differences
from strapdown.navigation.record import NavigationRecord
from strapdown.tables import TRAJECTORY_ERROR

__all__ = ["SmootherConsistency", "smoother_consistency"]

Array = NDArray[np.float64]

#: Of a difference, in the standard deviations that are expected of it.
WITHIN = 3.0
#: A smoother that takes less than this share off a variance has told nothing, and the difference
#: of the variances is rounding.
TOLD = 1e-3


@dataclass(frozen=True, eq=False)
class SmootherConsistency:
    """Differences of what a filter said and what its smoother says.

    Attributes
    ----------
    columns : tuple of str
        Components: those of a TrajectoryError table.
    instants : ndarray of int, (9,)
        At which the smoother told more than the filter.
    share : ndarray, (9,)
        Of these, where the difference is within three of its standard deviations; NaN where there
        are none.
    rms : ndarray, (9,)
        Root mean square of the difference in them: about 1 where the model is right.
    """

    columns: tuple[str, ...]
    instants: NDArray[np.int_]
    share: Array
    rms: Array


def smoother_consistency(
    forward: NavigationRecord, smoothed: NavigationRecord, ellipsoid: Ellipsoid = WGS84
) -> SmootherConsistency:
    """Hold the difference of two estimates against what their covariances say of it.

    Where the model is right, ``x_filter - x_smoother`` has the covariance ``P_filter -
    P_smoother`` (McReynolds, JOTA 1 (1967); Bryson and Ho, Applied Optimal Control, 1975, sec.
    13.2), of each component a normal number, correlated over time: three standard deviations hold
    99.7 % of them. A filter that believes a wrong model is told so by its own later observations.

    Parameters
    ----------
    forward, smoothed : NavigationRecord
        Of one run.
    ellipsoid : Ellipsoid

    Returns
    -------
    SmootherConsistency
    """
    columns = list(TRAJECTORY_ERROR)
    apart = trajectory_differences(forward.trajectory, smoothed.trajectory, ellipsoid)
    rows, marks = apart.index.to_numpy(), forward.sd.index.to_numpy()
    # A mark is of the first row after it; one that a later mark precedes that row is not.
    row = np.searchsorted(rows, marks - 1e-7)
    kept = np.append(row[1:] > row[:-1], True) & (row < len(rows))
    values = apart[columns].to_numpy()[row[kept]]
    less = np.square(forward.sd[columns].to_numpy()[kept])
    more = less - np.square(smoothed.sd[columns].to_numpy()[kept])
    told = more > TOLD * less
    z = np.where(told, values / np.sqrt(np.where(told, more, 1.0)), np.nan)
    count = told.sum(axis=0)
    inside = (np.abs(z) <= WITHIN).sum(axis=0)
    squares = np.where(told, np.square(z), 0.0).sum(axis=0)
    of = np.where(count > 0, count, np.nan)
    return SmootherConsistency(tuple(columns), count, inside / of, np.sqrt(squares / of))
